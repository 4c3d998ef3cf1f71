//! `nicolson run`: a scene with the console, and whoever else is to hear of it.

use std::fs::File;
use std::io;
use std::path::PathBuf;

use super::console::{Console, complain};
use super::signals::listen;
use super::{DONE, FAILED, INTERRUPTED, WRONG_INPUT, report_error};
use crate::output::Status;
use crate::scene::Scene;
use crate::simulation::diagnostics::{Monitors, SolveLog, SolveTable};
use crate::simulation::{self, Checkpoint, RunOptions};

/// What is told of a run, besides its results.
#[derive(Debug, Default)]
pub struct Listening {
    /// Errors only.
    pub quiet: bool,
    /// A line per step on standard output.
    pub solve_report: bool,
    /// JSON lines into a file.
    pub solve_log: Option<PathBuf>,
}

/// Where a run begins.
#[derive(Debug, Clone, Copy)]
pub struct Beginning<'a> {
    /// What it goes on from.
    pub checkpoint: &'a Checkpoint,
    /// Whether with a scene that has changed.
    pub forced: bool,
}

/// Runs a scene, from the beginning or from a checkpoint, and returns the exit code.
pub fn run_scene(scene: &Scene, from: Option<Beginning<'_>>, options: RunOptions, listening: Listening) -> u8 {
    let Listening { quiet, solve_report, solve_log } = listening;
    let opened = match (&solve_log, from) {
        (None, _) => Ok(None),
        (Some(path), None) => File::create(path).map(|file| Some(SolveLog::new(file))),
        (Some(path), Some(from)) => SolveLog::reopen(path, from.checkpoint.about.step).map(Some),
    };
    let mut log = match opened {
        Ok(log) => log,
        Err(error) => {
            let path = solve_log.unwrap_or_default();
            complain(&format!("--solve-log {}: {error}; choose a file in a directory that exists", path.display()));
            return WRONG_INPUT;
        }
    };
    let mut table = solve_report.then(|| SolveTable::new(io::stdout()));
    let mut console = Console::new(quiet, options.directory.clone());
    if solve_report {
        console.leave_progress_out();
    }
    let signals = listen();
    let options =
        RunOptions { checkpoint_request: Some(signals.checkpoint.clone()), solve_log: solve_log.clone(), ..options };
    // The console last: its summary stands below the table.
    let mut monitors = Monitors::new().with_optional(log.as_mut()).with_optional(table.as_mut()).with(&mut console);
    let outcome = match from {
        None => simulation::run(scene, &options, &mut monitors, &signals.interrupt),
        Some(Beginning { checkpoint, forced }) => {
            simulation::restart(scene, checkpoint, forced, &options, &mut monitors, &signals.interrupt)
        }
    };
    if let (Some(error), Some(path)) = (log.as_mut().and_then(SolveLog::take_error), &solve_log) {
        complain(&format!("--solve-log {}: {error}; the log is not complete", path.display()));
        return FAILED;
    }
    match outcome {
        Ok(outcome) => match outcome.report.status {
            Status::Completed => DONE,
            Status::Interrupted => INTERRUPTED,
            Status::Failed => FAILED,
        },
        Err(error) => report_error(&error),
    }
}
