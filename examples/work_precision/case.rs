//! One scene, one method, one step: the error, and what it cost.

use std::time::Instant;

use nicolson::model::Model;
use nicolson::simulation::{Prepared, exact_errors};
use nicolson_solvers::time::System;

use super::problem::{Method, Problem};
use super::scenes;

/// Times at which solutions are compared, equally spaced and the last at the end.
pub const SAMPLES: usize = 4;
/// A case is repeated until this much time has gone, in s, and the shortest one counts.
const ENOUGH: f64 = 0.5;
/// Repetitions at most.
const REPETITIONS: usize = 5;
/// A rate is timed as the shortest of so many.
const RATES: usize = 15;

/// A scene with its stiffness and duration.
#[derive(Debug, Clone, Copy)]
pub struct Variant {
    pub problem: Problem,
    /// Stiffness over that of the scene.
    pub stiffness: f64,
    /// Time to reach over that of the problem.
    pub duration: f64,
}

/// Step of a case.
#[derive(Debug, Clone, Copy)]
pub enum Length {
    /// Steps to the end.
    Steps(usize),
    /// `c Δt/d` at most.
    Courant(f64),
    /// So many steps in one of this Courant number at most.
    Part(f64, usize),
}

/// Displacements at the sample times.
pub type Track = Vec<Vec<f64>>;

/// Counts of work, and the time that it took.
#[derive(Debug, Clone, Default)]
pub struct Work {
    pub steps: usize,
    pub rates: usize,
    pub residuals: usize,
    pub newton: usize,
    pub assemblies: usize,
    pub factorisations: usize,
    pub solves: usize,
    /// Actions of the tangent inside linear solves.
    pub actions: usize,
    /// Stepping, s.
    pub seconds: f64,
    /// Everything before the first step, s.
    pub setup: f64,
    /// One evaluation of the rate, s.
    pub rate_seconds: f64,
}

impl Work {
    /// Evaluations of rates and residuals.
    pub fn evaluations(&self) -> usize {
        self.rates + self.residuals
    }

    /// The whole time in evaluations of the rate.
    pub fn equivalents(&self) -> f64 {
        self.seconds / self.rate_seconds
    }
}

/// A finished run.
#[derive(Debug, Clone, Default)]
pub struct Solution {
    pub track: Track,
    /// Distance from the exact solution, relative; NaN where none is known.
    pub total_error: f64,
    pub work: Work,
    /// Step, s.
    pub step: f64,
}

impl Variant {
    /// As the scene is.
    pub fn plain(problem: Problem) -> Self {
        Self { problem, stiffness: 1.0, duration: 1.0 }
    }

    /// Time to reach, s.
    pub fn end(&self) -> f64 {
        self.problem.end * self.duration
    }

    fn overrides(&self, method: &Method, step: f64) -> Vec<(&'static str, String)> {
        let (key, value, power) = self.problem.stiffness;
        let stiffness = value * self.stiffness.powf(1.0 / f64::from(power));
        let own = [
            (key, format!("{stiffness:e}")),
            ("time.end", format!("{:e}", self.end())),
            ("time.step", format!("{step:e}")),
            // A step that fails ends the run.
            ("time.minimum_step", format!("{step:e}")),
            ("output.history", "false".to_owned()),
        ];
        let given = self.problem.size.iter().chain(method.keys).map(|(key, value)| (*key, (*value).to_owned()));
        own.into_iter().chain(given).collect()
    }

    /// Runs it, repeatedly where that is cheap.
    ///
    /// # Errors
    /// Why it ended early, in words.
    pub fn run(&self, method: &Method, length: Length, repeat: bool) -> Result<Solution, String> {
        match self.problem.dimension {
            1 => self.run_in::<1>(method, length, repeat),
            2 => self.run_in::<2>(method, length, repeat),
            _ => self.run_in::<3>(method, length, repeat),
        }
    }

    /// The step of a length, s, such that a whole number of steps reaches every sample.
    fn step<const D: usize>(&self, method: &Method, length: Length) -> Result<f64, String> {
        let between = self.end() / SAMPLES as f64;
        let steps = match length {
            Length::Steps(steps) => steps.div_ceil(SAMPLES) as f64,
            Length::Courant(courant) => self.steps::<D>(method, courant)?,
            Length::Part(courant, parts) => self.steps::<D>(method, courant)? * parts as f64,
        };
        Ok(between / steps)
    }

    /// Steps between samples with a Courant number at most.
    fn steps<const D: usize>(&self, method: &Method, courant: f64) -> Result<f64, String> {
        let between = self.end() / SAMPLES as f64;
        let mut prepared = self.prepared::<D>(method, between)?;
        // The limit contains the default factor.
        let limit = prepared.model.stable_step(0.0, &prepared.state.values) / DEFAULT_COURANT;
        Ok((between / (courant * limit)).ceil())
    }

    /// The scene before its first step.
    ///
    /// # Errors
    /// In words.
    pub fn prepared<const D: usize>(&self, method: &Method, step: f64) -> Result<Prepared<D>, String> {
        scenes::prepared::<D>(self.problem.text, self.problem.name, self.overrides(method, step))
    }

    fn run_in<const D: usize>(&self, method: &Method, length: Length, repeat: bool) -> Result<Solution, String> {
        let step = self.step::<D>(method, length)?;
        let mut best: Option<Solution> = None;
        let begin = Instant::now();
        for _ in 0..if repeat { REPETITIONS } else { 1 } {
            let mut found = self.once::<D>(method, step)?;
            if let Some(best) = &best {
                found.work.setup = found.work.setup.min(best.work.setup);
                found.work.rate_seconds = found.work.rate_seconds.min(best.work.rate_seconds);
                found.work.seconds = found.work.seconds.min(best.work.seconds);
            }
            best = Some(found);
            if begin.elapsed().as_secs_f64() > ENOUGH {
                break;
            }
        }
        best.ok_or_else(|| "no run".into())
    }

    fn once<const D: usize>(&self, method: &Method, step: f64) -> Result<Solution, String> {
        let begin = Instant::now();
        let mut prepared = self.prepared::<D>(method, step)?;
        let setup = begin.elapsed().as_secs_f64();
        let rate_seconds = rate_seconds(&mut prepared);
        let Prepared { mut model, mut stepper, mut state, .. } = prepared;
        let (mut track, mut total, mut seconds) = (Track::new(), 0.0_f64, 0.0);
        for sample in 1..=SAMPLES {
            let target = if sample == SAMPLES { self.end() } else { self.end() * sample as f64 / SAMPLES as f64 };
            let start = Instant::now();
            while state.time < target {
                stepper.advance(&mut model, &mut state, target).map_err(|failure| failure.to_string())?;
            }
            seconds += start.elapsed().as_secs_f64();
            track.push(model.displacements(&state.values).to_vec());
            let missed = exact_errors(&model, state.time, &state.values);
            total = missed.get("displacement").map_or(f64::NAN, |norms| total.max(norms.l2));
        }
        let size = track.iter().map(|sample| norm(&model, sample)).fold(0.0, f64::max);
        let statistics = *stepper.statistics();
        let newton = stepper.newton().map(|newton| *newton.totals()).unwrap_or_default();
        let linear = stepper.newton().map(|newton| newton.linear().counts()).unwrap_or_default();
        let work = Work {
            steps: statistics.accepted,
            rates: statistics.rate_evaluations - statistics.partial_evaluations,
            residuals: newton.residual_evaluations,
            newton: newton.iterations,
            assemblies: newton.linearisations,
            factorisations: linear.factorisations,
            solves: linear.solves,
            actions: linear.iterations,
            seconds,
            setup,
            rate_seconds,
        };
        Ok(Solution { track, total_error: total / size, work, step })
    }
}

/// Default of `time.cfl`.
const DEFAULT_COURANT: f64 = 0.3;

/// Shortest of several evaluations of the rate, s.
fn rate_seconds<const D: usize>(prepared: &mut Prepared<D>) -> f64 {
    let mut rate = vec![0.0; prepared.state.values.len()];
    let mut shortest = f64::INFINITY;
    for _ in 0..RATES {
        let start = Instant::now();
        let _ = prepared.model.rate(0.0, &prepared.state.values, &mut rate);
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    shortest
}

/// `√(Σ V |u|² / Σ V)`.
fn norm<const D: usize>(model: &Model<D>, displacement: &[f64]) -> f64 {
    let volumes = &model.setup().particles.volumes;
    let sum: f64 = displacement.iter().enumerate().map(|(i, u)| volumes[i / D] * u * u).sum();
    (sum / volumes.iter().sum::<f64>()).sqrt()
}

/// Largest distance of two tracks at a sample time over the largest displacement of the second.
pub fn distance(found: &Track, reference: &Track) -> f64 {
    let root = |squares: f64| squares.sqrt();
    let size = |sample: &Vec<f64>| root(sample.iter().map(|u| u * u).sum());
    let largest = reference.iter().map(size).fold(0.0, f64::max);
    let apart = |(a, b): (&Vec<f64>, &Vec<f64>)| root(a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum());
    // `max` would drop a NaN.
    let worst = |worst: f64, missed: f64| if missed > worst || missed.is_nan() { missed } else { worst };
    found.iter().zip(reference).map(apart).fold(0.0, worst) / largest
}
