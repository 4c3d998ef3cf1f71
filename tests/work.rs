//! The work of every example scene over its first steps, pinned; and the clocks that say where the time of a run goes.
//!
//! `tests/work/counts.csv` has a row for every scene in `examples/`, and any other number of anything, or another path of the linear solver, is a failure: more
//! work is a regression unless it is meant, and less is worth knowing. After a change that is meant,
//!
//! ```text
//! NICOLSON_UPDATE_COUNTS=1 cargo test --test work
//! ```
//!
//! writes the file anew; look at the difference before committing it.

mod support;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nicolson::output::Report;
use nicolson::scene::settings::StepChoice;
use nicolson::simulation::{RunOptions, Silent, run};
use support::scenes::{number, scene};

/// Steps of every scene.
const STEPS: f64 = 3.0;
/// Set to write the file anew.
const UPDATE: &str = "NICOLSON_UPDATE_COUNTS";

fn directory(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The scenes of `examples/`, by name.
fn scenes() -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(directory("examples"))
        .expect("examples")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Scenes that run explicitly as well.
const EXPLICIT: [(&str, &str); 3] =
    [("csm3", "velocity_verlet"), ("impact-hyperelastic", "tvd_rk2"), ("bending-column", "rk4")];

/// Overrides that end a scene after [`STEPS`] of its steps.
fn shortened(name: &str) -> Vec<(&'static str, String)> {
    let step = match scene(name, &[]).time.step {
        StepChoice::Fixed(step) => step,
        StepChoice::Cfl(_) => panic!("{name}: give this test the length of a step"),
    };
    vec![("time.end", number(STEPS * step))]
}

fn report(name: &str, overrides: &[(&str, String)]) -> Report {
    let overrides: Vec<(&str, &str)> = overrides.iter().map(|(key, value)| (*key, value.as_str())).collect();
    let options = RunOptions::default();
    let outcome = run(&scene(name, &overrides), &options, &mut Silent, &Default::default());
    outcome.unwrap_or_else(|error| panic!("{name}: {error}")).report
}

/// The explicit limit of a scene, s.
fn explicit_limit(name: &str) -> f64 {
    report(name, &shortened(name)).explicit_step_limit.expect("a limit")
}

const COLUMNS: &str = "scene,unknowns,steps,rejected,newton_iterations,residuals,linearisations,analyses,factorisations,\
                       linear_solves,linear_iterations,rate_evaluations,solver,reason";

fn row(label: &str, name: &str, overrides: &[(&str, String)]) -> String {
    let Report { unknowns, steps, newton, linear, rate_evaluations, .. } = report(name, overrides);
    let counts = [
        unknowns,
        steps.accepted,
        steps.rejected,
        newton.iterations,
        newton.residual_evaluations,
        newton.linearisations,
        linear.analyses,
        linear.factorisations,
        linear.solves,
        linear.iterations,
        rate_evaluations,
    ];
    counts.iter().fold(label.to_owned(), |mut row, count| {
        let _ = write!(row, ",{count}");
        row
    }) + &path(&linear.solver, &linear.reason)
}

/// The path that the linear solver took, and why, without commas: they separate columns.
fn path(solver: &str, reason: &str) -> String {
    format!(",{},{}", solver.replace(',', ";"), reason.replace(',', ";"))
}

#[test]
fn the_first_steps_of_every_scene_take_the_work_that_they_took() {
    let file = directory("tests/work/counts.csv");
    let mut found = format!("{COLUMNS}\n");
    for name in scenes() {
        found += &row(&name, &name, &shortened(&name));
        found.push('\n');
    }
    for (name, scheme) in EXPLICIT {
        let step = 0.5 * explicit_limit(name);
        let overrides =
            [("time.scheme", scheme.into()), ("time.step", number(step)), ("time.end", number(STEPS * step))];
        found += &row(&format!("{name} {scheme}"), name, &overrides);
        found.push('\n');
    }
    if std::env::var_os(UPDATE).is_some() {
        std::fs::write(&file, &found).expect("counts");
    }
    let pinned = std::fs::read_to_string(&file).expect("counts");
    let different: Vec<String> = found
        .lines()
        .filter(|line| !pinned.lines().any(|pinned| pinned == *line))
        .map(|line| {
            let name = line.split(',').next().unwrap_or_default();
            let before = pinned.lines().find(|pinned| pinned.split(',').next() == Some(name)).unwrap_or("nothing");
            format!("  {line}\n  instead of {before}")
        })
        .collect();
    assert!(
        different.is_empty() && found.lines().count() == pinned.lines().count(),
        "the work has changed ({COLUMNS}):\n{}\nif that is meant, {UPDATE}=1 cargo test --test work",
        different.join("\n")
    );
}

#[test]
fn the_clocks_see_nearly_all_of_a_run() {
    for (name, scheme) in [("csm3", "crank_nicolson"), ("csm3", "velocity_verlet"), ("impact-hyperelastic", "tvd_rk2")]
    {
        let directory = tempfile::tempdir().expect("a directory");
        let step = if scheme == "crank_nicolson" { "0.01" } else { "1e-4" };
        let scene = scene(name, &[("time.scheme", scheme), ("time.step", step), ("time.end", "0.05")]);
        let options = RunOptions { directory: Some(directory.path().to_path_buf()), ..RunOptions::default() };
        let report = run(&scene, &options, &mut Silent, &Default::default()).expect("a run").report;
        let seconds = &report.wall_seconds;
        let known: f64 = seconds.parts().iter().filter(|(part, _)| *part != "other").map(|(_, part)| part).sum();
        // Neighbouring clocks, not durations: the share does not depend on the machine.
        assert!(known >= 0.95 * seconds.total, "{name} {scheme}: {seconds:?}");
        assert!(known <= 1.001 * seconds.total, "{name} {scheme}: {seconds:?}");
        assert!(seconds.parts().iter().all(|(_, part)| *part >= 0.0));
        let work: &[f64] = if report.unknowns == 0 {
            assert_eq!((seconds.assembly, seconds.factorisation, seconds.solve), (0.0, 0.0, 0.0));
            &[seconds.rate, seconds.integration, seconds.ledger, seconds.output]
        } else {
            &[seconds.rate, seconds.assembly, seconds.factorisation, seconds.solve, seconds.integration, seconds.ledger]
        };
        assert!(work.iter().all(|part| *part > 0.0), "{name} {scheme}: {seconds:?}");
        assert!(!report.bottleneck.hint.is_empty() && report.bottleneck.share > 0.0);
    }
}
