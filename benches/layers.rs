//! Cost of the layers of one implicit step, as ratios to one rate evaluation in the same run, and one Newton
//! iteration against its factorisation and solve.
//!
//! `cargo bench --bench layers [-- SPACING…]`. Clock times on shared machines are noise; ratios taken in one run
//! are not. Each figure is the smallest of several repetitions. Three cases of impact-hyperelastic, one thread:
//!
//! - `symmetric`: without D_v, J from the determinant, by LDLᵀ;
//! - `D_v`: as the scene is, by GMRES with the LDLᵀ factor of the symmetric part;
//! - `its LU`: the same as the line before, by LU. `differs`: relative difference of its solution.
//!
//! Measured at 9576 particles (19 076 unknowns), processor time of a machine with twenty times as many programs as cores,
//! rate = 1: residual 1.0 to 1.4, derivatives 0.2, entries 1.1 to 1.6 (D_v: 2.6; before rows were kept and slots shared:
//! 4.0), factor 35, its solve 6 (D_v: 22 and 21; LU: 77 and 56). A Newton iteration is 1.08 times its factorisation and solve
//! without D_v, 1.10 with it, and 2.4 and 1.4 times faster than by LU; the solutions differ by 7e-13 and, as far as GMRES was
//! asked to go, 2e-9.
#![allow(clippy::print_stdout, reason = "a bench reports on the terminal")]

#[path = "shared/clock.rs"]
mod clock;

use std::path::Path;
use std::time::Instant;

use clock::smallest;
use nicolson::model::CheckPoint;
use nicolson::scene::Scene;
use nicolson::simulation::prepare;
use nicolson_solvers::linear::{
    EliminationOrder, KrylovOptions, LinearSolverChoice, Preconditioner, PreconditionerMatrix, Tangent,
};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{StageSystem, System};

const DETERMINANT: (&str, &str) = ("body.0.volume_ratio", "determinant");

fn preconditioned() -> LinearSolverChoice {
    let krylov = KrylovOptions {
        preconditioner: Preconditioner::Ldlt { order: EliminationOrder::default() },
        preconditioner_matrix: PreconditionerMatrix::SymmetricPart,
        ..KrylovOptions::default()
    };
    LinearSolverChoice::Gmres { restart: 50, krylov }
}

type Overrides<'a> = &'a [(&'a str, &'a str)];

fn measure(
    case: &str,
    spacing: &str,
    overrides: Overrides<'_>,
    choice: &LinearSolverChoice,
    before: &[f64],
) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/impact-hyperelastic.toml");
    let mut all = vec![("body.0.spacing".to_owned(), spacing.to_owned())];
    all.extend(overrides.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())));
    let scene = Scene::read(&path, &all)?;
    let start = Instant::now();
    let mut prepared = prepare::<2>(&scene)?;
    let setup = start.elapsed().as_secs_f64();
    let model = &mut prepared.model;
    let state = prepared.state.values.clone();
    let mut rate = vec![0.0; state.len()];
    let unit = smallest(20, || model.rate(0.0, &state, &mut rate).unwrap_or_default());

    let CheckPoint { time, shift, base, unknowns, .. } = model.check_point(0.0, 0.025, &state, 0.02, 1)?;
    model.begin_stage(time, shift, &base);
    let mut residual = vec![0.0; unknowns.len()];
    let residual_time = smallest(10, || {
        // A fresh stage each time: the model remembers the last point.
        model.begin_stage(time, shift, &base);
        let _ = model.residual(&unknowns, &mut residual);
    });
    let linearise = smallest(5, || model.linearise(&unknowns).unwrap_or_default());
    let mut action = vec![0.0; unknowns.len()];
    let apply = smallest(10, || model.tangent().apply(&residual, &mut action));
    let mut values = vec![0.0; model.pattern_entries()];
    let fill = smallest(10, || model.fill(&mut values));
    let mut solver = choice.build();
    solver.prepare(model.tangent())?;
    let factor = smallest(5, || solver.prepare(model.tangent()).unwrap_or_default()) - fill;
    let mut iterations = 0;
    let solve = smallest(5, || {
        iterations = solver.solve(model.tangent(), &residual, &mut action, 1e-10).map_or(0, |report| report.iterations);
    });
    let largest = |v: &mut dyn Iterator<Item = f64>| v.fold(0.0_f64, |m, x| m.max(x.abs()));
    let difference = largest(&mut action.iter().zip(before).map(|(x, y)| x - y)) / largest(&mut action.iter().copied());
    let differs = if choice == &LinearSolverChoice::Lu { format!("{difference:.0e}") } else { String::new() };
    let algebra = factor + solve;
    let all = residual_time + linearise + fill + algebra;
    println!(
        "{case:>9} {:>9} {:>9} {:>10.2e} {:>8.1} {:>8.2} {:>8.2} {:>8.2} {:>8.2} {:>8.2} {:>8.2} {:>5} {:>10.2e} {:>8.2} {differs:>8}",
        model.particles(),
        unknowns.len(),
        unit,
        setup / unit,
        residual_time / unit,
        linearise / unit,
        apply / unit,
        fill / unit,
        factor / unit,
        solve / unit,
        iterations,
        all,
        all / algebra,
    );
    Ok(action)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| a.parse::<f64>().is_ok()).collect();
    let spacings = if chosen.is_empty() { vec!["0.25".into(), "0.125".into(), "0.0625".into()] } else { chosen };
    println!(
        "{:>9} {:>9} {:>9} {:>10} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>5} {:>10} {:>8} {:>8}",
        "case",
        "particles",
        "unknowns",
        "rate [s]",
        "set-up",
        "residual",
        "linear.",
        "action",
        "entries",
        "factor",
        "solve",
        "iter.",
        "Newton [s]",
        "/algebra",
        "differs"
    );
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let cases: [(&str, Overrides<'_>, LinearSolverChoice); 4] = [
        ("symmetric", &[("stabilisation.tau_v", "0"), DETERMINANT], LinearSolverChoice::ldlt()),
        ("its LU", &[("stabilisation.tau_v", "0"), DETERMINANT], LinearSolverChoice::Lu),
        ("D_v", &[DETERMINANT], preconditioned()),
        ("its LU", &[DETERMINANT], LinearSolverChoice::Lu),
    ];
    pool.install(|| {
        for spacing in &spacings {
            let mut last = Vec::new();
            for (case, overrides, choice) in &cases {
                last = measure(case, spacing, overrides, choice, &last).map_err(|e| e.to_string())?;
            }
        }
        Ok::<(), String>(())
    })?;
    Ok(())
}
