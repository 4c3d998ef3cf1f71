//! Studies: one scene, run with many values of its keys.
//!
//! A study file names a scene and what varies in it:
//!
//! ```toml
//! title = "Schemes and steps"          # default: the name of the file
//! scene = "../dam-break.toml"          # from the folder of the study
//!
//! [set]                                # in every case; optional
//! time.end = 0.1
//!
//! [grid]                               # all combinations; the last key varies fastest
//! time.scheme = ["crank_nicolson", "midpoint"]
//! body.0.spacing = [0.5, 0.25]
//! ```
//!
//! Keys are those of `--set` ([`crate::scene`]), written with dots, as tables, or in quotes; values are numbers, texts,
//! booleans, lists and tables in braces. Instead of `[grid]`, a list of cases may be given row by row:
//!
//! ```toml
//! [[case]]
//! body.0.spacing = 0.5
//! time.step = 0.02
//!
//! [[case]]
//! body.0.spacing = 0.25
//! time.step = 0.01
//! ```
//!
//! A convergence study refines one key, or several together:
//!
//! ```toml
//! [convergence]
//! quantity = "errors.displacement.l2"  # or a list; any number of report.json
//! sizes = [0.1, 0.05, 0.025]           # from coarse to fine: what orders are measured in
//! # exact = -0.0661                    # of a quantity that is not an error itself; default: extrapolated from three levels
//!
//! [convergence.refine]
//! body.0.spacing = 1.0                 # a factor: the value is this times the size
//! time.step = 1e-2
//! # body.0.counts = [[11, 11], [21, 21], [41, 41]]   # or a value for each size
//! ```
//!
//! `sizes` may be left out where the first refined key has a list of numbers. Together with `[grid]` or `[[case]]` there
//! is one table for each of their rows.
//!
//! # What a sweep leaves
//!
//! | file in the directory of the study | content |
//! |---|---|
//! | `study.toml` | the study as it was run |
//! | `case-0001/`, … | as `nicolson run` leaves them, and `case.toml`: what was overridden; cases count from 1 |
//! | `cases.csv` | a row for every case: [`collect`] |
//! | `convergence.csv`, `.svg`, `.png` | orders, of a convergence study: [`ConvergenceTable`] |
//!
//! [`sweep`] skips a case whose report says that the very same scene was completed; one that was interrupted or killed goes
//! on from its newest checkpoint, to the same bits; every other one is run again. Files that a scene names are not compared: who changes an STL file removes the case. Everything but the growing tables of a
//! case is written atomically, and no case stops another.

mod cases;
mod check;
mod collect;
mod convergence;
mod document;
mod entries;
mod orders;
mod quantity;
mod sweep;

pub use cases::{Assignment, Case};
pub use check::ReadyCase;
pub use collect::{Collected, collect};
pub use convergence::ConvergenceTable;
pub use document::{Convergence, Study};
pub use orders::{Level, Reference};
pub use sweep::{CaseState, Ending, Event, SweepOptions, SweepSummary, state_of, sweep};

/// Most cases of a study.
pub const MOST_CASES: usize = 100_000;

/// The study as it was run, in the directory of its results.
const STUDY_FILE: &str = "study.toml";
