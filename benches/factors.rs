//! Cost of the direct path on the tangents of scenes: order of elimination, factorisation, solve.
//!
//! `cargo bench --bench factors [-- CASE…]`, with cases `2d-1k`, `2d-10k`, `2d-50k`, `3d-1k`, `3d-4k`, … (a number of
//! particles in thousands). One thread. Each figure is the smallest of some repetitions.
#![allow(clippy::print_stdout, reason = "a bench reports on the terminal")]

#[path = "shared/clock.rs"]
mod clock;

use std::path::Path;

use clock::{smallest, spent};
use nicolson::model::CheckPoint;
use nicolson::scene::Scene;
use nicolson::simulation::prepare;
use nicolson_solvers::linear::{EliminationOrder, LinearSolver, SparseLdlt, SparseLu, Tangent};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::StageSystem;

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Prints what everything costs. Returns particles, and time of entries, LDLᵀ and solve together, s.
fn measure<const D: usize>(
    example: &str,
    sets: &[(String, String)],
    with_lu: bool,
) -> Result<(f64, f64), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(format!("{example}.toml"));
    let scene = Scene::read(&path, sets)?;
    let mut prepared = prepare::<D>(&scene)?;
    let step = 20.0 * prepared.explicit_step_limit;
    let model = &mut prepared.model;
    let state = prepared.state.values.clone();
    let CheckPoint { time, shift, base, unknowns, .. } = model.check_point(0.0, 0.5 * step, &state, 0.001, 1)?;
    model.begin_stage(time, shift, &base);
    let mut residual = vec![0.0; unknowns.len()];
    let rate = smallest(5, || {
        model.begin_stage(time, shift, &base);
        let _ = model.residual(&unknowns, &mut residual);
    });
    model.linearise(&unknowns)?;
    let mut values = Vec::new();
    let pattern = spent(|| values.resize(model.pattern_entries(), 0.0));
    let fill = smallest(3, || model.fill(&mut values));
    let mut out = vec![0.0; unknowns.len()];
    let action = smallest(5, || model.tangent().apply(&residual, &mut out));
    let pairs = model.gradient().neighbourhood.pairs() as f64;
    let near = pairs / model.particles() as f64;
    println!(
        "a pair: action {:.1} ns; a pair of pairs: entries {:.2} ns; {near:.1} neighbours",
        1e9 * action / pairs,
        1e9 * fill / (pairs * near)
    );
    println!(
        "{example}: {} particles, {} unknowns, {} entries; rate {:.2} ms, pattern {:.1} ms, assembly {:.1} ms, action {:.2} ms",
        model.particles(),
        unknowns.len(),
        values.len(),
        1e3 * rate,
        1e3 * pattern,
        1e3 * fill,
        1e3 * action
    );
    println!("{:>22} {:>10} {:>10} {:>10} {:>12}", "", "analysis", "factor", "solve", "fill");
    let symmetric = model.tangent().symmetry() != nicolson_solvers::linear::Symmetry::General;
    let mut solvers: Vec<(&str, Box<dyn LinearSolver>)> = Vec::new();
    if symmetric {
        solvers.push(("LDLT, by places", Box::new(SparseLdlt::new(EliminationOrder::Automatic))));
        solvers.push(("LDLT, minimum degree", Box::new(SparseLdlt::new(EliminationOrder::MinimumDegree))));
    }
    if with_lu || !symmetric {
        solvers.push(("LU", Box::new(SparseLu::new())));
    }
    let mut direct = f64::NAN;
    for (name, mut solver) in solvers {
        let mut prepared = Ok(());
        let first = spent(|| prepared = solver.prepare(model.tangent()));
        prepared?;
        let repetitions = if first < 1.0 { 5 } else { 1 };
        let again = smallest(repetitions, || solver.prepare(model.tangent()).unwrap_or_default());
        let mut iterations = 0;
        let solve = smallest(repetitions, || {
            if let Ok(report) = solver.solve(model.tangent(), &residual, &mut out, 1e-2) {
                iterations = report.iterations;
            }
        });
        if name == "LDLT, by places" {
            direct = again + solve;
        }
        println!(
            "{name:>22} {:>8.1}ms {:>8.1}ms {:>8.2}ms {:>12} ({iterations} refinements; {})",
            1e3 * (first - again),
            1e3 * (again - fill),
            1e3 * (solve - action),
            solver.info().fill,
            solver.info().name,
        );
    }
    Ok((model.particles() as f64, direct))
}

fn main() -> Outcome {
    let cases: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let cases = if cases.is_empty() { vec!["2d-1".into(), "2d-10".into(), "3d-1".into()] } else { cases };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| all(&cases).map_err(|error| error.to_string()))?;
    Ok(())
}

/// All cases, and how the direct path grows from the first to the last case of each kind.
fn all(cases: &[String]) -> Outcome {
    let with_lu = std::env::var_os("WITH_LU").is_some();
    let mut first = std::collections::HashMap::new();
    for case in cases {
        let (dimension, size) = case.split_once('-').ok_or("a case is DIMENSION-THOUSANDS")?;
        let particles = 1e3 * size.trim_end_matches('k').parse::<f64>()?;
        let (count, direct) = match dimension {
            "2d" => {
                let side = particles.sqrt().round();
                let sets = vec![("body.0.counts".into(), format!("[{side}, {side}]"))];
                measure::<2>("swinging-plate", &sets, with_lu)
            }
            "beam" => {
                let across = (particles / 17.5).sqrt().round();
                let sets = vec![("body.0.counts".into(), format!("[{}, {across}]", 17.5 * (across - 1.0) + 1.0))];
                measure::<2>("csm3", &sets, with_lu)
            }
            _ => {
                let side = particles.cbrt().round();
                let sets = vec![("body.0.counts".into(), format!("[{side}, {side}, {side}]"))];
                measure::<3>("swinging-cube", &sets, with_lu)
            }
        }?;
        let &mut (least, start) = first.entry(dimension).or_insert((count, direct));
        if count > least {
            let exponent = (direct / start).ln() / (count / least).ln();
            println!("{dimension}: entries, LDLT and solve grow as n^{exponent:.2} from {least} to {count} particles");
        }
    }
    Ok(())
}
