//! `nicolson run`: a scene with the console, and whoever else is to hear of it.

use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::console::{Console, complain};
use super::{DONE, FAILED, INTERRUPTED, WRONG_INPUT, report_error};
use crate::output::Status;
use crate::scene::Scene;
use crate::simulation::diagnostics::{Monitors, SolveLog, SolveTable};
use crate::simulation::{self, RunOptions};

/// What is told of a run, besides its results.
pub struct Listening {
    /// Errors only.
    pub quiet: bool,
    /// A line per step on standard output.
    pub solve_report: bool,
    /// JSON lines into a file.
    pub solve_log: Option<PathBuf>,
}

/// Runs a scene and returns the exit code.
pub fn run_scene(scene: &Scene, options: &RunOptions, listening: Listening) -> u8 {
    let Listening { quiet, solve_report, solve_log } = listening;
    let mut log = match solve_log.as_ref().map(File::create).transpose() {
        Ok(file) => file.map(SolveLog::new),
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
    let interrupt = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupt);
    // A second handler (in tests, which share a process) is refused; the first one serves.
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed));
    // The console last: its summary stands below the table.
    let mut monitors = Monitors::new().with_optional(log.as_mut()).with_optional(table.as_mut()).with(&mut console);
    let outcome = simulation::run(scene, options, &mut monitors, &interrupt);
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
