//! The two sweeps over particles that give forces and rates.
//!
//! First sweep: each particle gathers F and L from its neighbours and applies its law. Second sweep:
//! each particle gathers stresses with the transposed weights, and the pair terms. Every loop writes
//! only to its own particle, in fixed neighbour order: the same bits for any number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use nicolson_solvers::EvaluationError;
use rayon::prelude::*;

use super::Model;
use super::law::{Point, VolumeRatios};
use crate::material::Material;
use crate::stabilisation::{Jump, PressureStates, Upwind};
use crate::tensor::{Tensor, Vector, outer, smallest_stretch};

/// Particles handled as one piece of work: below this, sharing costs more than it gains.
pub const GRAIN: usize = 128;

/// Results of the last evaluation.
#[derive(Debug, Clone)]
pub struct Workspace<const D: usize> {
    /// One entry per particle.
    pub points: Vec<Point<D>>,
    /// Volume times first Piola–Kirchhoff stress, and T of the hourglass control, N m^(1).
    pub stress: Vec<Tensor<D>>,
    /// Reconstruction slopes of velocity and pressure; empty without reconstruction.
    pub slopes: Vec<(Tensor<D>, Vector<D>)>,
    /// Force of D_v and rate of D_p; empty without stabilisation.
    pub pairs: Vec<(Vector<D>, f64)>,
    /// Pair forces of the hourglass control, N; empty without.
    pub hourglass: Vec<Vector<D>>,
}

impl<const D: usize> Workspace<D> {
    /// Space for `n` particles.
    pub fn new(n: usize, stabilised: bool, reconstructed: bool, controlled: bool) -> Self {
        Self {
            points: vec![Point::rest(); n],
            stress: vec![Tensor::zeros(); n],
            slopes: if reconstructed { vec![(Tensor::zeros(), Vector::zeros()); n] } else { Vec::new() },
            pairs: if stabilised { vec![(Vector::zeros(), 0.0); n] } else { Vec::new() },
            hourglass: if controlled { vec![Vector::zeros(); n] } else { Vec::new() },
        }
    }
}

impl<const D: usize> Model<D> {
    /// Evaluates forces and rates of J at time `t`; results are left in the workspace.
    pub(super) fn evaluate(
        &mut self,
        t: f64,
        displacement: &[f64],
        velocity: &[f64],
        volume_ratios: VolumeRatios<'_, D>,
    ) -> Result<(), EvaluationError> {
        self.loads
            .update(&self.setup, &self.masses, t)
            .map_err(|error| error.clone().at(self.describe_particle(error.site)))?;
        self.first_sweep(displacement, velocity, volume_ratios)?;
        if !self.workspace.slopes.is_empty() {
            self.reconstruct(velocity);
        }
        self.second_sweep(displacement, velocity);
        Ok(())
    }

    fn first_sweep(
        &mut self,
        displacement: &[f64],
        velocity: &[f64],
        volume_ratios: VolumeRatios<'_, D>,
    ) -> Result<(), EvaluationError> {
        let mut workspace = std::mem::replace(&mut self.workspace, Workspace::new(0, false, false, false));
        let (model, bad) = (&*self, AtomicUsize::new(usize::MAX));
        let deformed = model.upwind.as_ref().is_some_and(|upwind| upwind.options.deformed_wave_speed);
        let conserving = matches!(volume_ratios, VolumeRatios::Conserving { .. });
        workspace.points.par_iter_mut().zip(workspace.stress.par_iter_mut()).with_min_len(GRAIN).enumerate().for_each(
            |(a, (point, stress))| {
                let gradient = model.gradient.of(a, displacement);
                point.deformation = Tensor::identity() + gradient;
                point.velocity_gradient = if model.needs_velocity_gradient(a, conserving) {
                    model.gradient.of(a, velocity)
                } else {
                    Tensor::zeros()
                };
                let solid = model.constitutive(a, volume_ratios, point).unwrap_or_else(|_| {
                    bad.fetch_min(a, Ordering::Relaxed);
                    Tensor::zeros()
                });
                *stress = if model.terms.stress {
                    (solid - point.cofactor * point.pressure) * model.setup.particles.volumes[a]
                } else {
                    Tensor::zeros()
                };
                if let Some(control) = model.active_hourglass() {
                    *stress += control.stress(a, &model.gradient.neighbourhood, displacement, &gradient);
                }
                if deformed {
                    point.wave_speed = model.material(a).wave_speed() / smallest_stretch(&point.deformation).0.sqrt();
                }
                if !model.terms.volume_rate {
                    point.rate = 0.0;
                }
            },
        );
        let outcome = match bad.into_inner() {
            usize::MAX => Ok(()),
            a => Err(model.explain(a, volume_ratios, workspace.points[a])),
        };
        self.workspace = workspace;
        outcome
    }

    /// Least-squares slopes of velocity and pressure of all particles.
    pub(super) fn reconstruct(&mut self, velocity: &[f64]) {
        let mut slopes = std::mem::take(&mut self.workspace.slopes);
        let (model, points) = (&*self, &self.workspace.points);
        if let Some(upwind) = self.upwind.as_ref() {
            slopes.par_iter_mut().with_min_len(GRAIN).enumerate().for_each(|(a, slope)| {
                *slope = model.slopes_at(upwind, a, velocity, |b| points[b].pressure);
            });
        }
        self.workspace.slopes = slopes;
    }

    /// Least-squares slopes of velocity and pressure at a particle (3.53).
    pub(super) fn slopes_at(
        &self,
        upwind: &Upwind<D>,
        a: usize,
        velocity: &[f64],
        pressure: impl Fn(usize) -> f64,
    ) -> (Tensor<D>, Vector<D>) {
        let here = Vector::<D>::from_column_slice(&velocity[a * D..a * D + D]);
        let mut slope = (Tensor::zeros(), Vector::zeros());
        for entry in self.gradient.neighbourhood.row(a) {
            let b = self.gradient.neighbourhood.neighbour(entry);
            let weight = &upwind.reconstruction[entry];
            let there = Vector::<D>::from_column_slice(&velocity[b * D..b * D + D]);
            slope.0 += outer(&(there - here), weight);
            slope.1 += weight * (pressure(b) - pressure(a));
        }
        slope
    }

    fn second_sweep(&mut self, displacement: &[f64], velocity: &[f64]) {
        self.pair_terms(displacement, velocity);
        if self.hourglass.is_some() {
            self.hourglass_forces(displacement);
        }
        let mut points = std::mem::take(&mut self.workspace.points);
        let (model, workspace) = (&*self, &self.workspace);
        points.par_iter_mut().with_min_len(GRAIN).enumerate().for_each(|(a, point)| {
            point.force = model.loads.on(a) - model.gradient.transposed_of(a, &workspace.stress);
            if let Some((force, rate)) = workspace.pairs.get(a) {
                point.force += force;
                point.rate += rate;
            }
            if let Some(force) = workspace.hourglass.get(a) {
                point.force += force;
            }
        });
        self.workspace.points = points;
    }

    /// Force of D_v and rate of D_p on every particle.
    pub(super) fn pair_terms(&mut self, displacement: &[f64], velocity: &[f64]) {
        let mut pairs = std::mem::take(&mut self.workspace.pairs);
        if let Some(upwind) = self.upwind.as_ref() {
            let with_velocity = upwind.has_velocity() && self.terms.velocity_upwind;
            let with_pressure = upwind.has_pressure() && self.terms.pressure_upwind;
            let (neighbourhood, points) = (&self.gradient.neighbourhood, &self.workspace.points);
            let slopes = &self.workspace.slopes;
            pairs.par_iter_mut().with_min_len(GRAIN).enumerate().for_each(|(a, pair)| {
                let (mut force, mut rate) = (Vector::zeros(), 0.0);
                for entry in neighbourhood.row(a) {
                    let b = neighbourhood.neighbour(entry);
                    if a == b {
                        continue;
                    }
                    let speed = 0.5 * (points[a].wave_speed + points[b].wave_speed);
                    if with_velocity {
                        let jump = Self::velocity_jump(upwind, (a, b), velocity, slopes);
                        force += upwind.velocity_force(entry, (a, b), displacement, speed, &jump);
                    }
                    if with_pressure {
                        let pressure = [points[a].pressure, points[b].pressure];
                        let pressure = Self::pressure_states(upwind, (a, b), pressure, slopes);
                        let cofactors = [&points[a].cofactor, &points[b].cofactor];
                        let entries = (entry, neighbourhood.twin(entry));
                        rate += upwind.pressure_pair(entries, (a, b), displacement, speed, &pressure, cofactors).rate;
                    }
                }
                *pair = (force, rate);
            });
        }
        self.workspace.pairs = pairs;
    }

    /// Velocities at the interface of a pair; constant states where there are no slopes.
    pub(super) fn velocity_jump(
        upwind: &Upwind<D>,
        (a, b): (usize, usize),
        velocity: &[f64],
        slopes: &[(Tensor<D>, Vector<D>)],
    ) -> Jump<D> {
        let difference = Vector::<D>::from_fn(|i, _| velocity[b * D + i] - velocity[a * D + i]);
        let increment = match (slopes.get(a), slopes.get(b)) {
            (Some(own), Some(other)) => (own.0 + other.0) * upwind.reference_separation(a, b) * -0.5,
            _ => Vector::zeros(),
        };
        Jump { difference, increment }
    }

    /// Pressures at the interface of a pair, from those of its two particles.
    pub(super) fn pressure_states(
        upwind: &Upwind<D>,
        (a, b): (usize, usize),
        particle: [f64; 2],
        slopes: &[(Tensor<D>, Vector<D>)],
    ) -> PressureStates {
        let increment = match (slopes.get(a), slopes.get(b)) {
            (Some(own), Some(other)) => {
                let half = upwind.reference_separation(a, b) * 0.5;
                [own.1.dot(&half), -other.1.dot(&half)]
            }
            _ => [0.0; 2],
        };
        PressureStates { particle, increment }
    }

    /// Largest wave speed of a configuration, m/s: for a fluid `c⁰/√λ_min`, the speed across the most compressed
    /// direction (3.57).
    pub fn largest_wave_speed(&self, displacement: &[f64]) -> f64 {
        let speed = |a: usize| {
            let f = Tensor::identity() + self.gradient.of(a, displacement);
            let (smallest, _) = smallest_stretch(&f);
            let largest = f.norm_squared() - (D - 1) as f64 * smallest;
            self.material(a).largest_wave_speed(smallest, largest)
        };
        (0..self.particles()).into_par_iter().with_min_len(GRAIN).map(speed).reduce(|| 0.0, f64::max)
    }

    /// Largest kinematic viscosity, m²/s.
    pub(super) fn largest_kinematic_viscosity(&self) -> f64 {
        let of = |law: &Material| law.viscosity.map_or(0.0, |viscosity| viscosity.modulus() / law.density);
        self.materials.iter().map(|(law, _)| of(law)).fold(0.0, f64::max)
    }
}
