//! The stability map: which schemes bear which steps, and what that does to the energy.
//!
//! ```text
//! cargo run --release --example stability_map -- [--short] [--out DIR] [--threads N]
//!     [--scene NAME]… [--scheme NAME]… [--tau VALUE]… [--ratio VALUE]… [--end TIME]
//! ```
//!
//! Every combination of scene, scheme, step and upwinding runs with a fixed step and without any help: a step
//! that fails ends it. Cases run side by side, each on one thread. Each adds its row to `stability-map.csv` as it
//! ends; what has a row there is not run again, so that a map may be computed in parts. At the end `.md`, `.svg`
//! and `.png` beside it show the whole map, as far as it is known.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program that reports as it goes on")]

#[path = "../shared/basics.rs"]
mod basics;
mod case;
mod results;
#[path = "../shared/scenes.rs"]
mod scenes;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use case::{Case, RATIOS, SCENES, SCHEMES, UPWINDING};
use clap::Parser;
use results::Results;
use scenes::chosen;

#[derive(Debug, Parser)]
#[command(about = "Maps which time schemes bear which steps")]
struct Arguments {
    /// A few cases of some seconds.
    #[arg(long)]
    short: bool,
    /// Directory of the results.
    #[arg(long, value_name = "DIR", default_value = "results/stability-map")]
    out: PathBuf,
    /// Cases that run side by side [default: all cores].
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Only this scene; may be repeated.
    #[arg(long, value_name = "NAME", value_parser = SCENES.map(|(name, _)| name))]
    scene: Vec<String>,
    /// Only this scheme; may be repeated.
    #[arg(long, value_name = "NAME", value_parser = SCHEMES)]
    scheme: Vec<String>,
    /// Only this parameter of the upwinding; may be repeated.
    #[arg(long, value_name = "VALUE")]
    tau: Vec<f64>,
    /// Only this step over the explicit limit; may be repeated, and need not be one of the map.
    #[arg(long, value_name = "VALUE")]
    ratio: Vec<f64>,
    /// Time to reach, s [default: 100, or 5 with --short].
    #[arg(long, value_name = "TIME")]
    end: Option<f64>,
}

impl Arguments {
    fn end(&self) -> f64 {
        self.end.unwrap_or(if self.short { 5.0 } else { 100.0 })
    }

    /// The cases, the longest first.
    fn cases(&self) -> Vec<Case> {
        let ratios = chosen(&self.ratio, if self.short { vec![20.0, 100.0] } else { RATIOS.to_vec() });
        let schemes = if self.short { vec!["crank_nicolson", "energy_momentum"] } else { SCHEMES.to_vec() };
        let schemes = chosen(&self.scheme, schemes.into_iter().map(str::to_owned));
        let mut cases = Vec::new();
        for scene in chosen(&self.scene, SCENES.map(|(name, _)| name.to_owned())) {
            for scheme in &schemes {
                for &upwinding in &chosen(&self.tau, UPWINDING) {
                    for &ratio in &ratios {
                        let (scene, scheme) = (scene.clone(), scheme.clone());
                        cases.push(Case { scene, scheme, upwinding, ratio, end: self.end() });
                    }
                }
            }
        }
        // The impact has twice as many particles.
        let cost = |case: &Case| if case.scene == "impact" { 4.0 } else { 1.0 } / case.ratio;
        cases.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
        cases
    }
}

fn map(arguments: &Arguments) -> Result<(), String> {
    let results = Results::open(&arguments.out)?;
    let cases: Vec<Case> = arguments.cases().into_iter().filter(|case| !results.has(case)).collect();
    let results = Mutex::new(results);
    let next = AtomicUsize::new(0);
    let done = AtomicUsize::new(0);
    let work = || -> Result<(), String> {
        let alone = basics::alone()?;
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            let outcome = alone.install(|| case.run()).map_err(|error| format!("{case:?}: {error}"))?;
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            eprintln!(
                "{count}/{}: {} {} tau {} ratio {}: {} at t = {} s, {} after {:.1} s",
                cases.len(),
                case.scene,
                case.scheme,
                case.upwinding,
                case.ratio,
                outcome.ending.name(),
                outcome.time,
                outcome.cell().text,
                outcome.seconds
            );
            results.lock().map_err(|_| "another case has failed".to_owned())?.add(outcome)?;
        }
        Ok(())
    };
    let threads = arguments.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.clamp(1, cases.len().max(1))).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().map_err(|_| "a case panicked".to_owned())?)
    })?;
    let results = results.into_inner().map_err(|_| "a case has failed".to_owned())?;
    for file in results.summarise(arguments.end())? {
        println!("{}", file.display());
    }
    Ok(())
}

fn main() -> ExitCode {
    match map(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
