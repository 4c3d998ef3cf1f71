//! The command line: `new`, `run`, `restart`, `check`, `jacobian`, `list`, `sweep` and `collect`, and for results `render`,
//! `report`, `plot`.
//!
//! Every command has a text of what it does and examples in `help.rs`; a test reads both.
//!
//! Exit codes: 0 done; 2 wrong usage or scene; 3 the simulation failed numerically (or the disk
//! refused), with the results so far on disk; 130 interrupted (Ctrl-C, SIGTERM), with a checkpoint.

#[macro_use]
mod standard;

mod check;
mod collect;
mod completions;
mod console;
mod guard;
mod help;
mod jacobian;
mod list;
mod new;
mod plot;
mod render;
mod report;
mod restart;
mod run;
mod schema;
mod signals;
mod sweep;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand};

use console::complain;

use crate::machine::available_memory;
use crate::scene::Scene;
use crate::simulation::{RunError, RunOptions};

/// Most threads of a run.
const MOST_THREADS: usize = 4096;

/// Everything was done.
pub const DONE: u8 = 0;
/// Wrong usage, or an impossible scene.
pub const WRONG_INPUT: u8 = 2;
/// The simulation failed; results so far are on disk.
pub const FAILED: u8 = 3;
/// Interrupted by the user.
pub const INTERRUPTED: u8 = 130;

/// Implicit-first Total Lagrangian SPH: a scene file in, a verified simulation out.
#[derive(Debug, Parser)]
#[command(name = "nicolson", version, about, long_about = None, after_long_help = help::PROGRAM)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented scene to begin with.
    #[command(long_about = help::NEW, after_long_help = help::NEW_EXAMPLES)]
    New(new::NewArguments),
    /// Run a scene and write its results.
    #[command(long_about = help::RUN, after_long_help = help::RUN_EXAMPLES)]
    Run {
        #[command(flatten)]
        scene: SceneArguments,
        /// Directory for results [default: results/SCENE].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// No progress, no summary: only errors.
        #[arg(long)]
        quiet: bool,
        /// Print a line per step: iterations, contraction, line search, factorisations and rejections by cause.
        #[arg(long)]
        solve_report: bool,
        /// Write the full history of every solve to a file, as one JSON object per line.
        #[arg(long, value_name = "FILE.jsonl")]
        solve_log: Option<PathBuf>,
    },
    /// Go on from a checkpoint, or from the newest of a directory of results, as if the run had never ended.
    #[command(long_about = help::RESTART, after_long_help = help::RESTART_EXAMPLES)]
    Restart(restart::RestartArguments),
    /// Validate a scene and predict its cost; runs nothing.
    #[command(long_about = help::CHECK, after_long_help = help::CHECK_EXAMPLES)]
    Check {
        #[command(flatten)]
        scene: SceneArguments,
        /// Draw particles, constraints and loads into a PNG (and an SVG beside it) [default: SCENE-preview.png].
        #[arg(long, value_name = "FILE.png")]
        preview: Option<Option<PathBuf>>,
    },
    /// Check the analytic Jacobian of a scene: Taylor remainders per block and term, and differences.
    #[command(long_about = help::JACOBIAN, after_long_help = help::JACOBIAN_EXAMPLES)]
    Jacobian {
        #[command(flatten)]
        scene: SceneArguments,
        /// Print JSON.
        #[arg(long)]
        json: bool,
        /// Also write the tangent at the start of the first step, in the Matrix Market format.
        #[arg(long, value_name = "FILE.mtx")]
        export_tangent: Option<PathBuf>,
    },
    /// Draw frames of a run: a picture (PNG, SVG) or an animation (GIF).
    #[command(long_about = help::RENDER, after_long_help = help::RENDER_EXAMPLES)]
    Render(render::RenderArguments),
    /// Plot a probe or a quantity of the history of several runs together.
    #[command(long_about = help::PLOT, after_long_help = help::PLOT_EXAMPLES)]
    Plot(plot::PlotArguments),
    /// Write one HTML file that shows a run: ledger, convergence, histories, particles in motion. Works offline.
    #[command(long_about = help::REPORT, after_long_help = help::REPORT_EXAMPLES)]
    Report(report::ReportArguments),
    /// Run one scene with many values of its keys: grids, lists, convergence studies.
    #[command(long_about = help::SWEEP, after_long_help = help::SWEEP_EXAMPLES)]
    Sweep(sweep::SweepArguments),
    /// Collect the reports of a study into one table.
    #[command(long_about = help::COLLECT, after_long_help = help::COLLECT_EXAMPLES)]
    Collect(collect::CollectArguments),
    /// Print the JSON Schema of scenes, with which editors complete and check keys.
    #[command(long_about = help::SCHEMA, after_long_help = help::SCHEMA_EXAMPLES)]
    Schema(schema::SchemaArguments),
    /// List schemes, solvers, laws and kernels, and the scenes of a directory.
    #[command(long_about = help::LIST, after_long_help = help::LIST_EXAMPLES)]
    List {
        /// Directory with scene files.
        #[arg(default_value = "examples")]
        directory: PathBuf,
    },
    /// Print a script that completes commands, options and files in a shell.
    #[command(long_about = help::COMPLETIONS, after_long_help = help::COMPLETIONS_EXAMPLES)]
    Completions(completions::CompletionsArguments),
    /// Write manual pages.
    #[command(long_about = help::MAN, after_long_help = help::MAN_EXAMPLES)]
    Man(completions::ManArguments),
}

#[derive(Debug, Args)]
struct SceneArguments {
    /// Scene file (TOML).
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    /// Override a key of the scene; may be repeated.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    overrides: Vec<String>,
    /// Number of threads [default: all cores]. Results do not depend on it.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Go on even if the scene seems to need more memory than there is.
    #[arg(long)]
    ignore_memory: bool,
}

/// Runs the command line and returns the exit code.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let code = obey(arguments);
    match standard::lost() {
        Some(error) if code == DONE => {
            complain(&format!("standard output cannot be written: {error}; what was printed is not complete"));
            FAILED
        }
        _ => code,
    }
}

fn obey(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let parsed = match Arguments::try_parse_from(&arguments) {
        Ok(parsed) => parsed,
        Err(error) => {
            // Help and version come this way too, with exit code 0.
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(WRONG_INPUT);
        }
    };
    let command: Vec<String> = arguments.iter().map(|a| a.to_string_lossy().into_owned()).collect();
    match parsed.command {
        Command::Run { scene, out, quiet, solve_report, solve_log } => on_scene(&scene, |loaded| {
            let directory = out.unwrap_or_else(|| default_directory(&scene.scene));
            let written = [solve_log.as_deref()];
            if let Err(error) =
                guard::spares(loaded, &written).and_then(|()| guard::spares_directory(loaded, &directory))
            {
                return refuse(&error);
            }
            let options =
                RunOptions { directory: Some(directory), command: command.join(" "), ..RunOptions::default() };
            run::run_scene(loaded, None, options, run::Listening { quiet, solve_report, solve_log })
        }),
        Command::Restart(arguments) => restart::restart(arguments, command.join(" ")),
        Command::Check { scene, preview } => {
            let preview = preview.map(|path| path.unwrap_or_else(|| default_preview(&scene.scene)));
            on_scene(&scene, |loaded| match guard::spares(loaded, &[preview.as_deref()]) {
                Ok(()) => check::check(loaded, preview.as_deref()),
                Err(error) => refuse(&error),
            })
        }
        Command::Jacobian { scene, json, export_tangent } => {
            on_scene(&scene, |loaded| match guard::spares(loaded, &[export_tangent.as_deref()]) {
                Ok(()) => jacobian::jacobian(loaded, json, export_tangent.as_deref()),
                Err(error) => refuse(&error),
            })
        }
        Command::Render(arguments) => render::render(arguments),
        Command::Plot(arguments) => plot::plot(arguments),
        Command::Report(arguments) => report::report(arguments),
        Command::Sweep(arguments) => sweep::run_study(&arguments, command.join(" ")),
        Command::Collect(arguments) => collect::run_collect(&arguments),
        Command::Schema(arguments) => schema::schema(&arguments),
        Command::List { directory } => list::list(&directory),
        Command::New(arguments) => new::run_new(&arguments),
        Command::Completions(arguments) => completions::completions(&arguments, Arguments::command()),
        Command::Man(arguments) => completions::man(&arguments, &Arguments::command()),
    }
}

/// Reads the scene and calls `then` inside a pool of the wanted size.
fn on_scene(arguments: &SceneArguments, then: impl FnOnce(&Scene) -> u8 + Send) -> u8 {
    let Ok(overrides) = overrides(&arguments.overrides) else { return WRONG_INPUT };
    let scene = match Scene::read(&arguments.scene, &overrides) {
        Ok(mut scene) => {
            scene.limit_memory(memory_limit(arguments.ignore_memory));
            scene
        }
        Err(errors) => {
            complain(&errors.to_string());
            return WRONG_INPUT;
        }
    };
    in_pool(arguments.threads, || then(&scene))
}

/// What `--ignore-memory`, or its absence, leaves of the memory for a run.
fn memory_limit(ignore: bool) -> Option<u64> {
    if ignore { None } else { available_memory() }
}

/// Takes `--set` apart; a mistake has been told.
fn overrides(texts: &[String]) -> Result<Vec<(String, String)>, ()> {
    let mut overrides = Vec::new();
    for text in texts {
        let Some((key, value)) = text.split_once('=') else {
            complain(&format!("--set {text}: expected KEY.PATH=VALUE, as in --set time.step=0.01"));
            return Err(());
        };
        overrides.push((key.trim().to_owned(), value.trim().to_owned()));
    }
    Ok(overrides)
}

/// Calls `then` inside a pool of the wanted size.
fn in_pool(threads: Option<usize>, then: impl FnOnce() -> u8 + Send) -> u8 {
    if threads == Some(0) {
        complain("--threads 0: at least one thread is needed");
        return WRONG_INPUT;
    }
    if let Some(threads) = threads.filter(|threads| *threads > MOST_THREADS) {
        complain(&format!("--threads {threads}: {MOST_THREADS} are the most; more than there are cores gain nothing"));
        return WRONG_INPUT;
    }
    match rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build() {
        Ok(pool) => pool.install(then),
        Err(error) => {
            complain(&format!("cannot start the threads: {error}"));
            WRONG_INPUT
        }
    }
}

/// Prints why nothing is done.
fn refuse(message: &str) -> u8 {
    complain(message);
    WRONG_INPUT
}

/// `results/NAME` for `path/to/NAME.toml`.
fn default_directory(scene: &std::path::Path) -> PathBuf {
    PathBuf::from("results").join(scene.file_stem().unwrap_or_default())
}

/// `NAME-preview.png` for `path/to/NAME.toml`.
fn default_preview(scene: &std::path::Path) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or_default().to_owned();
    name.push("-preview.png");
    PathBuf::from(name)
}

/// Prints an error and returns its exit code.
fn report_error(error: &RunError) -> u8 {
    complain(&error.to_string());
    if error.is_input() { WRONG_INPUT } else { FAILED }
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::Arguments;

    /// The words of a command line, with texts in quotes as one word each.
    fn words(line: &str) -> Vec<String> {
        let line = line.replace("$SLURM_ARRAY_TASK_ID", "3").replace("$SLURM_CPUS_PER_TASK", "2");
        let quoted = line.split('\'').enumerate();
        let split = |(at, part): (usize, &str)| match at % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect(),
            _ => vec![part.to_owned()],
        };
        quoted.flat_map(split).collect()
    }

    #[test]
    fn every_command_says_what_it_does_and_its_examples_are_understood() {
        let program = Arguments::command();
        for command in std::iter::once(&program).chain(program.get_subcommands()) {
            let name = command.get_name();
            let help = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("Examples:\n"), "{name}: no examples in src/cli/help.rs");
            if name != "nicolson" {
                let about = command.get_long_about().map(ToString::to_string).unwrap_or_default();
                assert!(about.ends_with('.'), "{name}: no text in src/cli/help.rs");
            }
            let lines: Vec<&str> = help
                .lines()
                .filter_map(|line| line.strip_prefix("  "))
                .filter(|line| line.starts_with("nicolson "))
                .collect();
            assert!(!lines.is_empty(), "{name}: no example begins with `  nicolson `");
            for line in lines {
                // What follows wide blanks is a comment.
                let line = line.split("   ").next().unwrap_or_default();
                let words = words(line);
                assert!(name == "nicolson" || words[1] == name, "{line}: an example of {name}");
                assert!(Arguments::try_parse_from(&words).is_ok(), "{line} is not understood");
            }
        }
    }
}
