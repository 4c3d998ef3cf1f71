//! Motion of chosen places: a particle, or a point between particles.

use crate::kernel;
use crate::model::Model;
use crate::output::ProbeState;
use crate::setup::Probe;
use crate::tensor::{Tensor, Vector, inverse, outer, vector_at};

/// A probe as weights over particles.
#[derive(Debug, Clone)]
pub struct Gauge<const D: usize> {
    name: String,
    position: Vector<D>,
    weights: Vec<(usize, f64)>,
}

impl<const D: usize> Gauge<D> {
    /// Finds the weights of a probe. A point between particles takes the linearly exact
    /// (moving least-squares) combination of the particles in its support, so that a linear field is
    /// recorded exactly; where these do not span space, the nearest particle stands in.
    pub fn new(probe: &Probe<D>, model: &Model<D>) -> Self {
        let setup = model.setup();
        let body = &setup.bodies[probe.body];
        let positions = &setup.particles.positions;
        let h = body.smoothing * body.spacing;
        let nearest = || {
            let distance = |a: &usize| (positions[*a] - probe.position).norm_squared();
            let closest = body.particles.clone().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            vec![(closest.unwrap_or(body.particles.start), 1.0)]
        };
        let (position, weights) = match probe.particle {
            Some(a) => (positions[a], vec![(a, 1.0)]),
            None => (
                probe.position,
                linear_weights(probe, body.particles.clone(), positions, body.kernel, h).unwrap_or_else(nearest),
            ),
        };
        Self { name: probe.name.clone(), position, weights }
    }

    /// Name of the probe.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Titles of its columns: displacements, then velocities.
    pub fn columns(&self) -> Vec<String> {
        let axes = &["x", "y", "z"][..D];
        let column = |field: &str| axes.iter().map(|axis| format!("{}.{field}{axis}", self.name)).collect::<Vec<_>>();
        [column("u"), column("v")].concat()
    }

    /// Displacement and velocity at a state.
    pub fn read(&self, model: &Model<D>, state: &[f64]) -> (Vector<D>, Vector<D>) {
        let (mut u, mut v) = (Vector::zeros(), Vector::zeros());
        for &(a, weight) in &self.weights {
            u += vector_at::<D>(state, a) * weight;
            v += vector_at::<D>(model.velocities_of(state), a) * weight;
        }
        (u, v)
    }

    /// The final state, for the report.
    pub fn final_state(&self, model: &Model<D>, state: &[f64]) -> ProbeState {
        let (u, v) = self.read(model, state);
        let list = |x: Vector<D>| x.iter().copied().collect();
        ProbeState { displacement: list(u), velocity: list(v), position: list(self.position + u) }
    }
}

/// Weights `w_b = W_b (1 + c·(X_b − X)) / S` with c chosen so that `Σ w_b (X_b − X) = 0`.
fn linear_weights<const D: usize>(
    probe: &Probe<D>,
    particles: std::ops::Range<usize>,
    positions: &[Vector<D>],
    kernel: crate::setup::KernelChoice,
    h: f64,
) -> Option<Vec<(usize, f64)>> {
    let near: Vec<(usize, f64, Vector<D>)> = particles
        .map(|a| (a, positions[a] - probe.position))
        .map(|(a, d)| (a, kernel::value(kernel, D, d.norm(), h), d))
        .filter(|(_, w, _)| *w > 0.0)
        .collect();
    let mut first = Vector::<D>::zeros();
    let mut second = Tensor::<D>::zeros();
    for (_, w, d) in &near {
        first += d * *w;
        second += outer(d, d) * *w;
    }
    let slope = -(inverse(&second)? * first);
    let sum: f64 = near.iter().map(|(_, w, d)| w * (1.0 + slope.dot(d))).sum();
    let weights: Vec<_> = near.iter().map(|(a, w, d)| (*a, w * (1.0 + slope.dot(d)) / sum)).collect();
    weights.iter().all(|(_, w)| w.is_finite() && w.abs() < 10.0).then_some(weights)
}
