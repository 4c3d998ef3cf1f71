//! The hourglass control: an energy that vanishes for affine motion, its force, its tangent, what it conserves, and
//! what it does to the spectrum of a bar.

#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

#[path = "hourglass/form.rs"]
mod form;
#[path = "hourglass/runs.rs"]
mod runs;
#[path = "hourglass/scenes.rs"]
mod scenes;
#[path = "hourglass/spectrum.rs"]
mod spectrum;
mod support;
#[path = "hourglass/tangent.rs"]
mod tangent;

use nicolson::model::{Model, Noise, Terms};
use nicolson::tensor::Vector;
use support::{linear, particles, setup};

const SPACING: f64 = 0.25;

const ALONE: Terms = Terms { hourglass: true, ..Terms::NONE };

/// A free body on a perturbed lattice.
fn model<const D: usize>(counts: [usize; D], shake: f64, hourglass: f64) -> Model<D> {
    let mut setup = setup(particles(counts, SPACING, shake), SPACING, linear());
    setup.bodies[0].hourglass = Some(hourglass);
    Model::new(setup, None, Some(1.0)).expect("model")
}

/// State with given displacements.
fn displaced<const D: usize>(model: &mut Model<D>, place: impl Fn(&Vector<D>) -> Vector<D>) -> Vec<f64> {
    let mut state = model.initial_state().expect("state");
    for (a, x) in model.setup().particles.positions.iter().enumerate() {
        for i in 0..D {
            state[a * D + i] = place(x)[i] - x[i];
        }
    }
    state
}

fn random<const D: usize>(model: &mut Model<D>, amount: f64, seed: u64) -> Vec<f64> {
    let mut state = model.initial_state().expect("state");
    let (n, mut noise) = (model.particles() * D, Noise::new(seed));
    state[..n].iter_mut().for_each(|u| *u += amount * noise.next());
    state
}

fn forces<const D: usize>(model: &mut Model<D>, state: &[f64]) -> Vec<f64> {
    let mut out = Vec::new();
    model.select_terms(ALONE);
    model.forces_at(0.0, state, &mut out).expect("forces");
    model.select_terms(Terms::ALL);
    out
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

fn digits(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:.2e}")).collect::<Vec<_>>().join(" ")
}
