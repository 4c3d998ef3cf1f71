//! Scenes of `examples/` with overrides, and their runs without a directory: nothing is written.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use nicolson::output::{Report, Status};
use nicolson::scene::Scene;
use nicolson::simulation::{Outcome, Prepared, RunOptions, Silent, prepare, run};
use nicolson_solvers::time::StepReport;

/// Reads `examples/{name}.toml` with overrides `(key, value)`.
pub fn scene(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(format!("{name}.toml"));
    let owned: Vec<(String, String)> = overrides.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scene::read(&path, &owned).unwrap_or_else(|errors| panic!("{name}: {errors}"))
}

/// Runs a scene to its end, which it must reach.
pub fn outcome(name: &str, overrides: &[(&str, &str)]) -> Outcome {
    let scene = scene(name, overrides);
    let outcome = run(&scene, &RunOptions::default(), &mut Silent, &AtomicBool::new(false))
        .unwrap_or_else(|error| panic!("{name} {overrides:?}: {error}"));
    assert_eq!(outcome.report.status, Status::Completed, "{name} {overrides:?}: {:?}", outcome.report.message);
    outcome
}

/// The report of [`outcome`].
pub fn report(name: &str, overrides: &[(&str, &str)]) -> Report {
    outcome(name, overrides).report
}

/// A scene before its first step.
pub fn prepared<const D: usize>(name: &str, overrides: &[(&str, &str)]) -> Prepared<D> {
    prepare(&scene(name, overrides)).unwrap_or_else(|error| panic!("{name} {overrides:?}: {error}"))
}

/// Steps to the end of a scene and shows every accepted step.
pub fn march<const D: usize>(prepared: &mut Prepared<D>, mut seen: impl FnMut(&mut Prepared<D>, &StepReport)) {
    while prepared.state.time < prepared.end {
        let target = prepared.end;
        let step = prepared
            .stepper
            .advance(&mut prepared.model, &mut prepared.state, target)
            .unwrap_or_else(|failure| panic!("{failure}"));
        seen(prepared, &step);
    }
}

/// A number as TOML that reads back to the same bits.
pub fn number(value: f64) -> String {
    format!("{value:e}")
}

/// Observed orders of errors that belong to sizes, from one line of a table to the next.
pub fn orders(sizes: &[f64], errors: &[f64]) -> Vec<f64> {
    sizes.windows(2).zip(errors.windows(2)).map(|(h, e)| (e[0] / e[1]).ln() / (h[0] / h[1]).ln()).collect()
}

/// Largest difference of two vectors over the largest entry of the first.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = a.iter().fold(0.0_f64, |m, x| m.max(x.abs())).max(f64::MIN_POSITIVE);
    a.iter().zip(b).fold(0.0_f64, |m, (x, y)| m.max((x - y).abs())) / scale
}
