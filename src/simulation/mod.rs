//! From a scene to results: prepare, step, keep the books, write.
//!
//! The library stays silent: a [`Monitor`] hears of every accepted step. A numerical failure is not
//! an error of [`run`]; it ends the run with [`Status::Failed`], with everything computed so far on
//! disk. An error of [`run`] means that nothing was computed, or that the disk refused. [`restart`] goes on from a
//! [`Checkpoint`] as if the run had never ended.

mod account;
mod amplification;
mod by_hand;
mod checkpoint;
mod choices;
mod clocks;
mod comparison;
pub mod diagnostics;
mod frames;
mod keeper;
mod ledger;
mod memory;
mod monitor;
mod preload;
mod prepare;
mod probes;
mod problem;
mod recorder;
mod resume;
mod rows;
mod tables;
mod tangent;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use nicolson_solvers::EvaluationError;

pub use by_hand::resume;
pub use checkpoint::{About, Checkpoint, FOLDER as CHECKPOINT_FOLDER, InputFile};
use clocks::Clocks;
pub use comparison::errors as exact_errors;
use keeper::Keeper;
pub use ledger::{Entry, Ledger, Summary};
pub use memory::{FittingSetup, fitting_setup};
pub use monitor::{Monitor, Plan, Progress, Silent};
pub use prepare::{Forecast, Prepared, prepare};
pub use probes::Gauge;
pub use problem::StepProblem;
use recorder::Recorder;
pub use rows::Rows;
pub use tangent::first_tangent;

use crate::model::ModelError;
use crate::output::{OutputError, Report, Status};
use crate::scene::{Scene, SceneErrors};

/// How a run is carried out; everything that is not in the scene.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Directory for results; `None` writes nothing.
    pub directory: Option<PathBuf>,
    /// Command line, for the provenance.
    pub command: String,
    /// Whether the rows of `history.csv` and `probes.csv` also come back in the [`Outcome`].
    pub keep_rows: bool,
    /// Asks for a checkpoint after the present step; taken back when it is written.
    pub checkpoint_request: Option<Arc<AtomicBool>>,
    /// Where a log of the solves goes, for checkpoints to remember.
    pub solve_log: Option<PathBuf>,
}

/// Why a run could not begin, or could not write.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The scene is not valid.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// The scene cannot be discretised.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The scene asks for something that does not go together.
    #[error("{0}")]
    Choice(String),
    /// The results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A step led out of the domain of the equations without noticing.
    #[error("the step to t = {time} s led outside: {error}")]
    Outside {
        /// Time reached, s.
        time: f64,
        /// Where and why.
        error: EvaluationError,
    },
}

impl RunError {
    /// Whether the input is at fault (exit code 2) rather than the numerics or the disk during the run
    /// (exit code 3).
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::Output(_) | Self::Outside { .. })
    }
}

/// Result of a run: the report, and the final state for programs that go on from here.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The report, as written to `report.json`.
    pub report: Report,
    /// Final state `[u | v | J]`.
    pub state: Vec<f64>,
    /// The rows of `history.csv`; empty unless [`RunOptions::keep_rows`].
    pub history: Rows,
    /// The rows of `probes.csv`; empty unless [`RunOptions::keep_rows`].
    pub probes: Rows,
}

/// Runs a scene on the present rayon pool.
///
/// # Errors
/// [`RunError`] if the scene is impossible or the disk refuses. A step that cannot be done is not an
/// error here: see [`Status::Failed`].
pub fn run(
    scene: &Scene,
    options: &RunOptions,
    monitor: &mut dyn Monitor,
    interrupt: &AtomicBool,
) -> Result<Outcome, RunError> {
    start(scene, None, options, monitor, interrupt)
}

/// Goes on from a checkpoint, in its own directory or in another one, as if the run had never ended: the results are the
/// same to the last bit. `scene` is that of the [checkpoint](Checkpoint::scene).
///
/// With `forced`, a scene with other keys is taken as well: the state then goes on, and scheme and solvers begin anew.
///
/// # Errors
/// As [`run`]; also if the scene is not that of the checkpoint and that is not forced, or if the files of the run do not
/// fit.
pub fn restart(
    scene: &Scene,
    checkpoint: &Checkpoint,
    forced: bool,
    options: &RunOptions,
    monitor: &mut dyn Monitor,
    interrupt: &AtomicBool,
) -> Result<Outcome, RunError> {
    let from = From { checkpoint, forced: !resume::same_scene(scene, checkpoint, forced)? };
    start(scene, Some(from), options, monitor, interrupt)
}

/// What a run goes on from.
#[derive(Clone, Copy)]
struct From<'a> {
    checkpoint: &'a Checkpoint,
    forced: bool,
}

fn start(
    scene: &Scene,
    from: Option<From<'_>>,
    options: &RunOptions,
    monitor: &mut dyn Monitor,
    interrupt: &AtomicBool,
) -> Result<Outcome, RunError> {
    match scene.dimension() {
        1 => run_in::<1>(scene, from, options, monitor, interrupt),
        2 => run_in::<2>(scene, from, options, monitor, interrupt),
        _ => run_in::<3>(scene, from, options, monitor, interrupt),
    }
}

fn run_in<const D: usize>(
    scene: &Scene,
    from: Option<From<'_>>,
    options: &RunOptions,
    monitor: &mut dyn Monitor,
    interrupt: &AtomicBool,
) -> Result<Outcome, RunError> {
    let begin = Instant::now();
    let mut prepared = prepare::<D>(scene)?;
    if options.directory.is_some() && scene.checkpoint.keep > 0 {
        prepared.model.keep_linearisation_points();
    }
    if let Some(From { checkpoint, forced }) = from {
        resume::restore(&mut prepared, checkpoint, forced)?;
    }
    let mut clocks = Clocks::after_setup(begin, &prepared);
    let mut keeper = Keeper::new(scene, options, from.map(|from| from.checkpoint));
    let mut recorder = match from {
        None => Recorder::open(scene, options, &mut prepared)?,
        Some(from) => Recorder::resume(scene, options, &mut prepared, from.checkpoint)?,
    };
    monitor.started(&Plan {
        title: &prepared.model.setup().title,
        end: prepared.end,
        particles: prepared.model.particles(),
        unknowns: prepared.unknowns(),
        scheme: prepared.stepper.scheme().name(),
        explicit_step_limit: prepared.explicit_step_limit,
        warnings: &prepared.warnings,
        resumed: from.map(|from| (from.checkpoint.about.step, from.checkpoint.about.time)),
    });
    let mut message = None;
    let mut status = Status::Completed;
    let mut told = prepared.warnings.len();
    // Why a last checkpoint is to be written, and the first refusal of the disk.
    let mut cause = keeper.due_at_end();
    let mut refusal = None;
    while prepared.state.time < prepared.end {
        if interrupt.load(Ordering::Relaxed) {
            status = Status::Interrupted;
            message = Some(format!("interrupted at t = {} s", prepared.state.time));
            cause = Some("interrupt");
            break;
        }
        let target = recorder.next_frame().min(prepared.end);
        let start = Instant::now();
        let advanced = prepared.stepper.advance(&mut prepared.model, &mut prepared.state, target);
        clocks.step(start);
        match advanced {
            Ok(step) => {
                let recorded = recorder.record(&mut prepared, &step);
                if let Err(RunError::Outside { .. }) = &recorded {
                    status = Status::Failed;
                    message = recorded.err().map(|error| prepared.advise(&error.to_string()));
                    cause = Some("failure");
                    break;
                }
                if let Err(error) = recorded {
                    refusal = Some(error);
                    break;
                }
                prepared.warnings[told..].iter().for_each(|warning| monitor.warned(warning));
                told = prepared.warnings.len();
                monitor.stepped(&Progress {
                    time: prepared.state.time,
                    end: prepared.end,
                    explicit_step_limit: prepared.explicit_step_limit,
                    step: &step,
                });
                if let Some(cause) = keeper.due(prepared.stepper.statistics().accepted) {
                    refusal = keeper.write(scene, cause, &mut prepared, &mut recorder, &clocks).err();
                    if refusal.is_some() {
                        break;
                    }
                }
            }
            Err(failure) => {
                monitor.failed(&failure);
                status = Status::Failed;
                message = Some(prepared.explain(&failure));
                cause = Some("failure");
                break;
            }
        }
    }
    if let (None, Some(cause)) = (&refusal, cause) {
        // Before the last frame, which is not one of the frames of a run that goes on.
        refusal = keeper.write(scene, cause, &mut prepared, &mut recorder, &clocks).err();
    }
    if let Some(error) = refusal {
        // The results so far are worth a report even where the disk refuses more of them.
        let _ = recorder.close(&prepared, Status::Failed, Some(error.to_string()), &clocks);
        return Err(error);
    }
    let report = recorder.close(&prepared, status, message, &clocks)?;
    report.warnings[told..].iter().for_each(|warning| monitor.warned(warning));
    monitor.finished(&report);
    let (history, probes) = recorder.take_rows();
    Ok(Outcome { report, state: prepared.state.values, history, probes })
}

/// Whether two paths are the same place, as far as they exist.
fn same_place(one: &Path, other: &Path) -> bool {
    let [one, other] = [one, other].map(|path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf()));
    one == other
}
