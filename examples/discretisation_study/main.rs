//! The discretisation study: what kernel, smoothing length, layout, weights and hourglass control give, and cost.
//!
//! ```text
//! cargo run --release --example discretisation_study [-- --short] [--out DIR]
//! ```
//!
//! Linear elasticity in plane strain, ν = 0.3, of a free beam (lattice, perturbed lattice) and a free ring (concentric
//! rings), see `measure`. References of the beam and the frequencies of the ring are extrapolated from fine clouds; the
//! ring under pressure has Lamé's solution. The cost is the time to assemble and factorise a tangent, over the least of
//! all, measured before everything else and alone.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program that reports as it goes on")]

#[path = "../shared/basics.rs"]
mod basics;
mod case;
mod measure;
mod results;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use case::{CELLS, CONTROL, Case, Cloud, KERNELS, SMOOTHING, Stopwatch};
use clap::Parser;
use measure::{Values, measure, reference};
use rayon::prelude::*;
use results::Row;

/// Cells of the coarser one of two clouds from which a reference is extrapolated: beam and ring.
const FINE: [usize; 2] = [16, 16];
const FINE_SHORT: [usize; 2] = [8, 8];
/// Rounds in which the costs are measured.
const ROUNDS: usize = 25;

#[derive(Debug, Parser)]
#[command(about = "Errors and costs of discretisations")]
struct Arguments {
    /// A few cases of some seconds.
    #[arg(long)]
    short: bool,
    /// Directory of the results.
    #[arg(long, value_name = "DIR", default_value = "results/discretisation-study")]
    out: PathBuf,
}

/// All cases, or some of every kind.
fn cases(short: bool) -> Vec<Case> {
    let mut cases = Vec::new();
    for cloud in [Cloud::Lattice, Cloud::Perturbed, Cloud::Ring] {
        let layouts: &[&str] = if cloud == Cloud::Ring || short { &["vertex"] } else { &["vertex", "cell", "mixed"] };
        let weights: &[&str] = match cloud {
            Cloud::Lattice => &["separate", "balanced", "balanced, stencil"],
            _ => &["separate", "balanced"],
        };
        let cells = CELLS[usize::from(cloud == Cloud::Ring)];
        for &layout in layouts {
            for &weights in weights {
                for kernel in kernels(short) {
                    for smoothing in smoothing(short) {
                        cases.push(Case { cloud, layout, kernel, smoothing, weights, cells });
                    }
                }
            }
        }
    }
    cases
}

fn kernels(short: bool) -> &'static [&'static str] {
    if short { &KERNELS[..1] } else { &KERNELS }
}

fn smoothing(short: bool) -> Vec<f64> {
    if short { vec![1.2] } else { SMOOTHING.to_vec() }
}

/// The rows of a case, one for each coefficient of the control.
fn rows(case: &Case, cost: f64, references: &[(Values, f64); 2]) -> Vec<Row> {
    let reference = references[usize::from(case.cloud == Cloud::Ring)].0;
    let all = || {
        let matrices = case.matrices()?;
        let row =
            |alpha: &f64| Ok(Row::new(case, cost, &matrices, *alpha, measure(case, &matrices, *alpha)?, &reference));
        CONTROL.iter().map(row).collect::<Result<Vec<Row>, String>>()
    };
    // That a case is impossible, because its weights cannot be balanced say, is a result.
    all().unwrap_or_else(|reason| vec![Row::impossible(case, cost, reason)])
}

/// Kernel and smoothing, and what they cost, s.
type Cost = ((&'static str, f64), f64);

/// Seconds of every kernel and smoothing: the least of several rounds, so that other work on the machine is not measured.
fn costs(short: bool) -> Result<Vec<Cost>, String> {
    let alone = basics::alone()?;
    let mut costs = Vec::new();
    for &kernel in kernels(short) {
        for smoothing in smoothing(short) {
            costs.push(((kernel, smoothing), Stopwatch::new(kernel, smoothing)?, f64::INFINITY));
        }
    }
    for _ in 0..if short { 1 } else { ROUNDS } {
        for (_, watch, least) in &mut costs {
            *least = least.min(alone.install(|| watch.seconds())?);
        }
    }
    Ok(costs.into_iter().map(|(key, _, least)| (key, least)).collect())
}

fn study(arguments: &Arguments) -> Result<(), String> {
    let short = arguments.short;
    let costs = costs(short)?;
    let cheapest = costs.iter().map(|(_, seconds)| *seconds).fold(f64::INFINITY, f64::min);
    let cost = |case: &Case| {
        let found = costs.iter().find(|(key, _)| *key == (case.kernel, case.smoothing));
        found.map_or(f64::NAN, |(_, seconds)| seconds / cheapest)
    };
    let fine = if short { FINE_SHORT } else { FINE };
    let references = [reference(Cloud::Lattice, fine[0])?, reference(Cloud::Ring, fine[1])?];
    for ((values, missed), name) in references.iter().zip(["beam", "ring"]) {
        eprintln!("{name}: {values:?}, of which the finest cloud is {:.2} % away", 100.0 * missed);
    }
    let cases = cases(short);
    let done = AtomicUsize::new(0);
    let found: Vec<Vec<Row>> = cases
        .par_iter()
        .map(|case| {
            let rows = rows(case, cost(case), &references);
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            eprintln!("{count}/{}: {case:?}", cases.len());
            rows
        })
        .collect();
    let rows: Vec<Row> = found.into_iter().flatten().collect();
    for file in results::write(&arguments.out, &rows)? {
        println!("{}", file.display());
    }
    Ok(())
}

fn main() -> ExitCode {
    match study(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
