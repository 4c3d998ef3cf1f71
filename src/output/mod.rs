//! Result files: fields for viewers, tables, plots and the report of a run.
//!
//! | file | written by | when |
//! |---|---|---|
//! | frames (`.vtu`) and their index (`fields.pvd`) | [`Frame`], [`Series`] | every frame |
//! | `history.csv`, `probes.csv` | [`Table`] | every row at once |
//! | energies and probes against time (`.svg`, `.png`) | [`HistoryColumns`], [`ProbeColumns`], [`LinePlot`], [`PlotGrid`] | at the end |
//! | a scene before it runs (`.svg`, `.png`) | [`Preview`] | when asked for |
//! | still pictures of particles (`.svg`, `.png`) | [`ParticlePlot`] | when asked for |
//! | tables of outcomes as pictures (`.svg`, `.png`) | [`Panels`] | when asked for |
//! | checkpoints (`.safetensors`) | [`write_container`] | when due, on signals, at a bad end |
//! | `report.json` | [`Report`] | at the end, however it comes |
//!
//! Everything here takes plain slices and a number of dimensions known at run time; nothing here knows
//! a kernel, a material or a solver. Nothing prints and nothing panics: failures are [`OutputError`]s
//! that name the path and the remedy. All files but the growing tables are complete or absent
//! ([`write_atomically`]), and the same data always give the same bytes.

mod animation;
mod appended;
mod atomic;
mod axis;
mod bottleneck;
mod canvas;
mod chart;
mod colour;
mod colour_bar;
mod comparison;
mod container;
mod curve;
mod error;
mod history;
mod html;
mod legend;
mod panels;
mod particle_sizes;
mod particles;
mod picture;
mod plot;
mod plot_grid;
mod preview;
mod pvd;
mod quantity;
mod render;
mod report;
mod report_parts;
mod slope;
mod splat;
mod stored_frame;
mod stored_run;
mod stored_table;
mod table;
mod text;
mod view;
mod vtu;

pub use atomic::{prepare_directory, sweep_partial_files, write_atomically};
pub use colour::ColourMap;
pub use comparison::Comparison;
pub use container::{parse_container, read_container, write_container};
pub use curve::Style;
pub use error::OutputError;
pub use history::{HistoryColumns, ProbeColumns};
pub use html::HtmlReport;
pub use panels::{Cell, Panel, Panels, Tone};
pub use particles::{Extent, ParticlePlot};
pub use plot::{LinePlot, LineSeries};
pub use plot_grid::PlotGrid;
pub use preview::{Hold, Preview};
pub use pvd::Series;
pub use quantity::Quantity;
pub use render::{FrameChoice, Rendering};
pub use report::{REPORT_FILE, Report};
pub use report_parts::{
    BalanceWork, Bottleneck, EnergyBudget, ErrorNorms, LinearWork, NewtonWork, ProbeState, Provenance, Status, Steps,
    WallSeconds,
};
pub use slope::Slope;
pub use stored_frame::{StoredField, StoredFrame};
pub use stored_run::StoredRun;
pub use stored_table::StoredTable;
pub use table::Table;
pub(crate) use text::number as number_text;
pub use view::View;
pub use vtu::{Frame, OutOfPlane, Precision, Tensor};
