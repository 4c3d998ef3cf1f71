//! Whatever solves the equations, the answer is the same (issue 3, point 7); and a run that cannot go on ends
//! with its last good state and the cause (point 8).
#![allow(clippy::print_stdout, reason = "the table of costs is a result, shown by --nocapture")]

mod support;

use std::sync::atomic::AtomicBool;

use nicolson::output::{Report, Status};
use nicolson::scene::Scene;
use nicolson::simulation::{Outcome, RunOptions, Silent, run};
use support::scenes::{distance, outcome, scene};

/// The impact, coarse, with steps of ten times the explicit limit.
const COARSE: [(&str, &str); 5] = [
    ("body.0.spacing", "0.5"),
    ("time.end", "0.3"),
    ("time.step", "0.15"),
    ("output.history", "false"),
    ("newton.relative_tolerance", "1e-10"),
];

/// Linear solvers with a preconditioner where they need one.
const SOLVERS: [(&str, &str); 4] = [("lu", "none"), ("gmres", "ilu0"), ("bicgstab", "block_jacobi"), ("gmres", "ilut")];
const TANGENTS: [&str; 5] = ["full", "modified", "lagged", "broyden", "lbfgs"];
const SEARCHES: [&str; 4] = ["backtracking", "more_thuente", "hager_zhang", "trust_region"];

fn coarse(solver: (&str, &str), tangent: &str, search: &str) -> Vec<(&'static str, String)> {
    let mut overrides: Vec<(&'static str, String)> =
        COARSE.iter().map(|(key, value)| (*key, (*value).into())).collect();
    overrides.push(("linear.solver", format!("\"{}\"", solver.0)));
    if solver.1 != "none" {
        overrides.push(("linear.preconditioner", format!("\"{}\"", solver.1)));
    }
    overrides.push(("newton.tangent", format!("\"{tangent}\"")));
    overrides.push(("newton.line_search", format!("\"{search}\"")));
    overrides
}

fn borrowed<'a>(overrides: &'a [(&'static str, String)]) -> Vec<(&'a str, &'a str)> {
    overrides.iter().map(|(key, value)| (*key, value.as_str())).collect()
}

#[test]
fn every_combination_gives_the_same_answer() {
    let solve = |solver, tangent, search| outcome("impact-hyperelastic", &borrowed(&coarse(solver, tangent, search)));
    let reference = outcome(
        "impact-hyperelastic",
        &[&COARSE[..4], &[("newton.relative_tolerance", "1e-14"), ("newton.scale_tolerance", "1e-15")]].concat(),
    );
    println!(
        "{:<22} {:<9} {:<13} {:>6} {:>8} {:>7} {:>9}",
        "linear", "tangent", "search", "newton", "factors", "linear", "distance"
    );
    let (mut count, mut worst) = (0, 0.0_f64);
    for solver in SOLVERS {
        for tangent in TANGENTS {
            for search in SEARCHES {
                if search == "trust_region" && (tangent == "broyden" || tangent == "lbfgs") {
                    continue;
                }
                let found = solve(solver, tangent, search);
                let report: &Report = &found.report;
                assert_eq!(report.steps.rejected, 0, "{solver:?} {tangent} {search}");
                let gap = distance(&reference.state, &found.state);
                println!(
                    "{:<22} {tangent:<9} {search:<13} {:>6} {:>8} {:>7} {gap:>9.1e}",
                    format!("{}, {}", solver.0, solver.1),
                    report.newton.iterations,
                    report.linear.factorisations,
                    report.linear.iterations
                );
                assert!(gap < 1e-9, "{solver:?} {tangent} {search}: {gap:e}");
                worst = worst.max(gap);
                count += 1;
            }
        }
    }
    println!("{count} combinations, largest distance {worst:.1e}");
}

/// The tangent of the impact is not symmetric (upwinding along the deformed direction): what needs symmetry
/// says so, and does not try shorter steps.
#[test]
fn solvers_for_symmetric_tangents_are_refused_with_a_reason() {
    for solver in ["ldlt", "cholesky", "cg"] {
        let overrides = coarse((solver, "none"), "full", "backtracking");
        let scene = scene("impact-hyperelastic", &borrowed(&overrides));
        let report = run(&scene, &RunOptions::default(), &mut Silent, &AtomicBool::new(false)).unwrap().report;
        let message = report.message.unwrap();
        assert_eq!((report.status, report.steps.accepted, report.steps.rejected), (Status::Failed, 0, 1), "{message}");
        assert!(message.contains("needs a symmetric matrix") && message.contains("choose LU"), "{solver}: {message}");
    }
}

/// Runs a scene into a directory that is read back.
fn on_disk(scene: &Scene) -> (Outcome, Report, tempfile::TempDir) {
    let directory = tempfile::tempdir().unwrap();
    let options = RunOptions { directory: Some(directory.path().to_owned()), ..RunOptions::default() };
    let outcome = run(scene, &options, &mut Silent, &AtomicBool::new(false)).unwrap();
    let report = Report::read(directory.path()).unwrap();
    (outcome, report, directory)
}

/// Last row of `history.csv`: the time and the step.
fn last_row(directory: &tempfile::TempDir) -> (f64, f64) {
    let text = std::fs::read_to_string(directory.path().join("history.csv")).unwrap();
    let row: Vec<f64> = text.lines().last().unwrap().split(',').map(|value| value.parse().unwrap()).collect();
    (row[0], row[1])
}

/// A block whose upper side is loaded by an expression of time; with the table `[time]` still open.
fn loaded(load: &str, scheme: &str) -> Scene {
    let text = format!(
        "dimension = 2\n[[body]]\nname = \"block\"\nspacing = 0.25\nshape.box = {{ lower = [0, 0], upper = [1, 1] }}\n\
         material.hyperelastic_volumetric = {{ density = 1000, gamma = 7, wave_speed = 10 }}\n[[boundary]]\n\
         select.where = \"Y < 0.1\"\nfix = [\"x\", \"y\"]\n[[boundary]]\nselect = \"all\"\nfix = [\"x\"]\n{load}\n\
         [time]\nend = 0.5\nstep = 0.01\nscheme = \"{scheme}\"\n[output]\nplots = false\n"
    );
    Scene::parse(&text, "loaded.toml", std::path::Path::new(""), &[]).unwrap_or_else(|errors| panic!("{errors}"))
}

/// A load that is no number from t₁ on: the run ends there, whatever the scheme, with the state before.
#[test]
fn a_load_that_becomes_nan_or_infinite_ends_the_run_at_the_last_good_state() {
    for (fault, scheme) in [
        ("sqrt(0.2 - t)", "crank_nicolson"),
        ("1/(0.5*abs(t - 0.2) + 0.5*(0.2 - t))", "backward_euler"),
        ("ln(0.2 - t)", "energy_momentum"),
        ("sqrt(0.2 - t)", "tvd_rk2"),
    ] {
        let load = format!("[[traction]]\nface = \"upper_y\"\nvalue = [0, \"-10 + 0*{fault}\"]");
        let (outcome, report, directory) = on_disk(&loaded(&load, scheme));
        let message = report.message.clone().unwrap();
        assert_eq!(report.status, Status::Failed, "{scheme}");
        assert!(message.contains("traction") || message.contains("load"), "{scheme}: {message}");
        // Up to the fault the run is the one without it, bit for bit.
        let (time, _) = last_row(&directory);
        assert_eq!(time, report.time_reached);
        assert!((0.19..=0.2).contains(&time), "{scheme}: {time}");
        assert!(outcome.state.iter().all(|value| value.is_finite()));
        let mut last = std::fs::read_to_string(directory.path().join("fields.pvd")).unwrap();
        last.retain(|letter| !letter.is_whitespace());
        assert!(last.contains(&format!("timestep=\"{time}\"")), "{scheme}: no frame at {time} in {last}");
    }
}

/// A lid that is pushed through the base: no step, however short, is possible from some time on.
#[test]
fn a_motion_that_turns_the_body_inside_out_ends_the_run() {
    let load = "[[boundary]]\nselect.where = \"Y > 0.9\"\ndisplacement = { y = \"-6*t\" }";
    for scheme in ["crank_nicolson", "energy_momentum", "tr_bdf2"] {
        let (outcome, report, directory) = on_disk(&loaded(load, scheme));
        let message = report.message.clone().unwrap();
        assert_eq!(report.status, Status::Failed, "{scheme}");
        let (time, step) = last_row(&directory);
        assert_eq!(time, report.time_reached);
        assert!(time > 0.0 && time < 0.2 && step > 0.0, "{scheme}: {time}");
        assert!(report.steps.rejected > 1, "{scheme}: shorter steps were tried");
        assert!(message.contains("failed") && message.contains("try"), "{scheme}: {message}");
        // The state is admissible: every volume is positive.
        let n = outcome.state.len() / 5;
        assert!(outcome.state[4 * n..].iter().all(|ratio| *ratio > 0.0), "{scheme}");
    }
}
