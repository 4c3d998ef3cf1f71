//! Scenes followed step by step: what the probes and the books say at chosen times.

use std::path::Path;

use nicolson::scene::Scene;
use nicolson::simulation::{Entry, Gauge, Ledger, Prepared, prepare};
use nicolson_solvers::time::StepReport;

/// A scene of `examples/` with overrides `(key.path, value)`.
pub fn example(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(format!("{name}.toml"));
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    Scene::read(&path, &overrides).unwrap_or_else(|errors| panic!("{name}: {errors}"))
}

/// What a run leaves behind at the times that were asked for, and what its steps say.
pub struct Trajectory<const D: usize> {
    /// Displacement of every probe at every time: `displacements[time][probe][axis]`.
    pub displacements: Vec<Vec<[f64; D]>>,
    /// The books at every time.
    pub books: Vec<Entry>,
    /// The books after every step, the initial state first.
    pub entries: Vec<Entry>,
    /// Every accepted step.
    pub steps: Vec<StepReport>,
    /// The scene at its last time.
    pub prepared: Prepared<D>,
}

impl<const D: usize> Trajectory<D> {
    /// One displacement component of one probe against time.
    pub fn curve(&self, probe: usize, axis: usize) -> Vec<f64> {
        self.displacements.iter().map(|probes| probes[probe][axis]).collect()
    }

    /// Largest increase of the total energy in one step, J; negative if it always falls.
    pub fn largest_rise(&self) -> f64 {
        self.entries.windows(2).map(|pair| pair[1].total - pair[0].total).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Largest `|total + dissipated − total(0)|` of any step, J.
    pub fn ledger_error(&self) -> f64 {
        let first = self.entries[0].total;
        self.entries.iter().map(|entry| (entry.total + entry.dissipated - first).abs()).fold(0.0, f64::max)
    }

    /// Part of the initial total energy that is gone at the end.
    pub fn loss(&self) -> f64 {
        1.0 - self.entries.last().map_or(0.0, |entry| entry.total) / self.entries[0].total
    }
}

/// Follows a scene through `times` (the first is the initial one), landing on each of them.
pub fn follow<const D: usize>(scene: &Scene, times: &[f64]) -> Trajectory<D> {
    let mut prepared = prepare::<D>(scene).unwrap_or_else(|error| panic!("{}: {error}", scene.title));
    let probes = prepared.model.setup().probes.clone();
    let gauges: Vec<_> = probes.iter().map(|probe| Gauge::new(probe, &prepared.model)).collect();
    let mut ledger = Ledger::open(&mut prepared.model, 0.0, &prepared.state.values).expect("initial state");
    let (mut displacements, mut books) = (Vec::new(), Vec::new());
    let (mut entries, mut steps) = (vec![ledger.entry()], Vec::new());
    for &time in times {
        while prepared.state.time < time {
            let Prepared { model, stepper, state, .. } = &mut prepared;
            let step =
                stepper.advance(model, state, time).unwrap_or_else(|failure| panic!("{}: {failure}", scene.title));
            entries.push(ledger.follow(model, state.time, &state.values).expect("an accepted state"));
            steps.push(step);
        }
        let read = |gauge: &Gauge<D>| gauge.read(&prepared.model, &prepared.state.values).0.into();
        displacements.push(gauges.iter().map(read).collect());
        books.push(ledger.entry());
    }
    Trajectory { displacements, books, entries, steps, prepared }
}

/// Times `0, step, 2 step, …, end`.
pub fn every(step: f64, end: f64) -> Vec<f64> {
    (0..=(end / step).round() as usize).map(|i| i as f64 * step).collect()
}

/// Distance of two curves over the range of the second: at its largest, and in the root of the mean square.
pub fn distance(curve: &[f64], reference: &[f64]) -> (f64, f64) {
    assert_eq!(curve.len(), reference.len());
    let range = reference.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - reference.iter().copied().fold(f64::INFINITY, f64::min);
    let gaps = || curve.iter().zip(reference).map(|(a, b)| (a - b).abs() / range);
    (gaps().fold(0.0, f64::max), (gaps().map(|gap| gap * gap).sum::<f64>() / curve.len() as f64).sqrt())
}
