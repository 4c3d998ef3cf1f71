//! Run time against error: which scheme, solver and step take a scene to a given error, and how fast.
//!
//! ```text
//! cargo run --release --example work_precision [-- --short] [--part NAME]… [--scene NAME]… [--out DIR]
//! ```
//!
//! `sweep`: every scene with every method and a row of steps. The *time error* is the distance from a solution of the same
//! discrete system by RK4 with steps far below the stability limit, at four times, over the largest displacement, so that
//! it holds nothing of the discretisation in space; where the scene has an exact solution, the *total error* is the
//! distance from that. `crossover`: seconds to 1 % for stiffer materials and longer times. `csm3`: the beam of Turek and
//! Hron to t = 2 s with period and trough within 1 %. `diffsol`: the same systems by the integrators of that library.
//!
//! Everything runs on one thread, each case the shortest of several repetitions where they are cheap, and without output.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program that reports as it goes on")]

#[path = "../shared/basics.rs"]
mod basics;
mod beam;
mod case;
mod crossover;
mod peer;
mod problem;
mod results;
#[path = "../shared/scenes.rs"]
mod scenes;
mod sweep;
mod versus;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use problem::PROBLEMS;

const PARTS: [&str; 4] = ["sweep", "crossover", "csm3", "diffsol"];

#[derive(Debug, Parser)]
#[command(about = "Measures run time against error")]
struct Arguments {
    /// Some seconds instead of some minutes: short times, few cases, nothing to conclude from.
    #[arg(long)]
    short: bool,
    /// Only this part; may be repeated.
    #[arg(long, value_name = "NAME", value_parser = PARTS)]
    part: Vec<String>,
    /// Only this scene; may be repeated.
    #[arg(long, value_name = "NAME", value_parser = PROBLEMS.map(|problem| problem.name))]
    scene: Vec<String>,
    /// Directory of the results.
    #[arg(long, value_name = "DIR", default_value = "results/work-precision")]
    out: PathBuf,
}

fn measure(arguments: &Arguments) -> Result<(), String> {
    let Arguments { short, out, .. } = arguments;
    std::fs::create_dir_all(out).map_err(basics::reason(out))?;
    let names = scenes::chosen(&arguments.scene, PROBLEMS.map(|problem| problem.name.to_owned()));
    let wanted = PROBLEMS.into_iter().filter(|problem| names.iter().any(|name| name == problem.name));
    let problems: Vec<_> = wanted.map(|problem| if *short { problem.coarsened() } else { problem }).collect();
    let mut files = Vec::new();
    for part in scenes::chosen(&arguments.part, PARTS.map(str::to_owned)) {
        files.extend(match part.as_str() {
            "sweep" => results::write(out, &sweep::sweep(&problems, *short)?)?,
            "crossover" => crossover::write(out, &problems, *short)?,
            "diffsol" => versus::write(out, &problems, *short)?,
            _ if names.iter().any(|name| name == "csm3") => beam::write(out, *short)?,
            _ => Vec::new(),
        });
    }
    files.iter().for_each(|file| println!("{}", file.display()));
    Ok(())
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = basics::alone().and_then(|alone| alone.install(|| measure(&arguments)));
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
