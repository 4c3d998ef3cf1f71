//! From a scene to results: prepare, step, keep the books, write.
//!
//! The library stays silent: a [`Monitor`] hears of every accepted step. A numerical failure is not
//! an error of [`run`]; it ends the run with [`Status::Failed`], with everything computed so far on
//! disk. An error of [`run`] means that nothing was computed, or that the disk refused.

mod amplification;
mod choices;
mod clocks;
mod comparison;
pub mod diagnostics;
mod frames;
mod ledger;
mod memory;
mod preload;
mod prepare;
mod probes;
mod recorder;
mod tangent;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use nicolson_solvers::EvaluationError;
use nicolson_solvers::time::{StepFailure, StepReport};

use clocks::Clocks;
pub use comparison::errors as exact_errors;
pub use ledger::{Entry, Ledger, Summary};
pub use prepare::{Forecast, Prepared, prepare};
pub use probes::Gauge;
use recorder::Recorder;
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

/// What a monitor hears before the first step.
#[derive(Debug, Clone)]
pub struct Plan<'a> {
    /// Title of the scene.
    pub title: &'a str,
    /// Time at which the run ends, s.
    pub end: f64,
    /// Number of particles.
    pub particles: usize,
    /// Unknowns of an implicit step; 0 for an explicit scheme.
    pub unknowns: usize,
    /// Name of the scheme.
    pub scheme: &'static str,
    /// Largest stable explicit step at the start, s.
    pub explicit_step_limit: f64,
    /// What the user should know.
    pub warnings: &'a [String],
}

/// What a monitor hears of an accepted step.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Time reached, s.
    pub time: f64,
    /// Time at which the run ends, s.
    pub end: f64,
    /// Largest stable explicit step at the start, s.
    pub explicit_step_limit: f64,
    /// The step.
    pub step: &'a StepReport,
}

/// Hears what happens in a run.
pub trait Monitor {
    /// Before the first step.
    fn started(&mut self, plan: &Plan<'_>) {
        let _ = plan;
    }
    /// When something came up in the run that the user should know.
    fn warned(&mut self, warning: &str) {
        let _ = warning;
    }
    /// After an accepted step.
    fn stepped(&mut self, progress: &Progress<'_>) {
        let _ = progress;
    }
    /// After a step that failed for good.
    fn failed(&mut self, failure: &StepFailure) {
        let _ = failure;
    }
    /// At the end, however it came.
    fn finished(&mut self, report: &Report) {
        let _ = report;
    }
}

/// A monitor that does not listen.
pub struct Silent;

impl Monitor for Silent {}

/// Result of a run: the report, and the final state for programs that go on from here.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The report, as written to `report.json`.
    pub report: Report,
    /// Final state `[u | v | J]`.
    pub state: Vec<f64>,
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
    match scene.dimension() {
        1 => run_in::<1>(scene, options, monitor, interrupt),
        2 => run_in::<2>(scene, options, monitor, interrupt),
        _ => run_in::<3>(scene, options, monitor, interrupt),
    }
}

fn run_in<const D: usize>(
    scene: &Scene,
    options: &RunOptions,
    monitor: &mut dyn Monitor,
    interrupt: &AtomicBool,
) -> Result<Outcome, RunError> {
    let begin = Instant::now();
    let mut prepared = prepare::<D>(scene)?;
    let mut clocks = Clocks::after_setup(begin, &prepared);
    let mut recorder = Recorder::open(scene, options, &mut prepared)?;
    monitor.started(&Plan {
        title: &prepared.model.setup().title,
        end: prepared.end,
        particles: prepared.model.particles(),
        unknowns: prepared.unknowns(),
        scheme: prepared.stepper.scheme().name(),
        explicit_step_limit: prepared.explicit_step_limit,
        warnings: &prepared.warnings,
    });
    let mut message = None;
    let mut status = Status::Completed;
    let mut told = prepared.warnings.len();
    while prepared.state.time < prepared.end {
        if interrupt.load(Ordering::Relaxed) {
            status = Status::Interrupted;
            message = Some(format!("interrupted at t = {} s", prepared.state.time));
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
                    break;
                }
                if let Err(error) = recorded {
                    // The results so far are worth a report even where the disk refuses more of them.
                    let failed = Some(error.to_string());
                    let _ = recorder.close(&prepared, Status::Failed, failed, &clocks);
                    return Err(error);
                }
                prepared.warnings[told..].iter().for_each(|warning| monitor.warned(warning));
                told = prepared.warnings.len();
                monitor.stepped(&Progress {
                    time: prepared.state.time,
                    end: prepared.end,
                    explicit_step_limit: prepared.explicit_step_limit,
                    step: &step,
                });
            }
            Err(failure) => {
                monitor.failed(&failure);
                status = Status::Failed;
                message = Some(prepared.explain(&failure));
                break;
            }
        }
    }
    let report = recorder.close(&prepared, status, message, &clocks)?;
    report.warnings[told..].iter().for_each(|warning| monitor.warned(warning));
    monitor.finished(&report);
    Ok(Outcome { report, state: prepared.state.values })
}
