//! `nicolson restart`: a run goes on from a checkpoint.

use std::path::PathBuf;

use clap::Args;

use super::console::{complain, warn};
use super::run::{Beginning, Listening, run_scene};
use super::{FAILED, WRONG_INPUT, in_pool, memory_limit, overrides};
use crate::scene::Scene;
use crate::simulation::{Checkpoint, RunOptions};

/// Arguments of `restart`.
#[derive(Debug, Args)]
pub struct RestartArguments {
    /// Checkpoint, or directory of results: its newest checkpoint that can be read.
    #[arg(value_name = "PATH")]
    path: PathBuf,
    /// Override a key of the scene; may be repeated. `time.end`, `output` and `checkpoint` may change freely.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    overrides: Vec<String>,
    /// Take the scene from a file instead of the checkpoint; it must be the same, as for --set.
    #[arg(long, value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// Directory for results [default: that of the checkpoint, whose files are cut back to it and continued].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of threads [default: all cores]. Results do not depend on it.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Go on although the scene has changed: the state is kept, scheme and solvers begin anew.
    #[arg(long)]
    force: bool,
    /// Go on even if the scene seems to need more memory than there is.
    #[arg(long)]
    ignore_memory: bool,
    /// No progress, no summary: only errors.
    #[arg(long)]
    quiet: bool,
    /// Print a line per step: iterations, contraction, line search, factorisations and rejections by cause.
    #[arg(long)]
    solve_report: bool,
    /// Continue the log of the solves in this file [default: that of the run, if it had one].
    #[arg(long, value_name = "FILE.jsonl")]
    solve_log: Option<PathBuf>,
}

/// Goes on from a checkpoint and returns the exit code.
pub fn restart(arguments: RestartArguments, command: String) -> u8 {
    let Ok(changes) = overrides(&arguments.overrides) else { return WRONG_INPUT };
    let (checkpoint, passed) = match Checkpoint::find(&arguments.path) {
        Ok(found) => found,
        Err(error) => {
            complain(&error.to_string());
            return if error.is_input() { WRONG_INPUT } else { FAILED };
        }
    };
    passed.iter().for_each(|error| warn(&format!("passed over {error}")));
    let scene = match &arguments.scene {
        Some(path) => Scene::read(path, &changes),
        None => checkpoint.scene(&changes),
    };
    let mut scene = match scene {
        Ok(scene) => scene,
        Err(errors) => {
            complain(&errors.to_string());
            return WRONG_INPUT;
        }
    };
    scene.limit_memory(memory_limit(arguments.ignore_memory));
    let directory = arguments.out.unwrap_or_else(|| checkpoint.directory());
    let options = RunOptions { directory: Some(directory), command, ..RunOptions::default() };
    let known = PathBuf::from(&checkpoint.about.solve_log);
    let listening = Listening {
        quiet: arguments.quiet,
        solve_report: arguments.solve_report,
        solve_log: arguments.solve_log.or(Some(known).filter(|known| known.is_file())),
    };
    let from = Beginning { checkpoint: &checkpoint, forced: arguments.force };
    in_pool(arguments.threads, || run_scene(&scene, Some(from), options, listening))
}
