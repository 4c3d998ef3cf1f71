//! The residual of the stage, and the stage as the nonlinear problem that Newton's method solves.

use std::sync::Arc;
use std::time::Instant;

use nicolson_solvers::linear::Tangent;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::System;
use nicolson_solvers::{EvaluationError, RestoreError, Snapshot, vector};

use super::law::VolumeRatios;
use super::{Clocks, Model, Unknowns};
use crate::tensor::Tensor;

impl<const D: usize> Model<D> {
    /// Writes the full state of unknowns `y`, except for volume ratios that the evaluation finds.
    fn expand(&self, y: &[f64], state: &mut [f64]) {
        let n = self.particles();
        let s = self.stage.shift;
        state.copy_from_slice(&self.stage.base);
        for a in 0..n {
            for i in 0..D {
                if let Some(unknown) = self.unknowns.velocity(a, i) {
                    state[(n + a) * D + i] = if self.stage.at_rest { 0.0 } else { y[unknown] };
                    state[a * D + i] = match self.unknowns.displacement(a, i) {
                        Some(displacement) => s * y[displacement],
                        None => self.stage.base[a * D + i] + s * y[unknown],
                    };
                }
            }
            if let Some(unknown) = self.unknowns.volume_ratio(a) {
                state[2 * n * D + a] = y[unknown] / self.volume_unit(a);
            }
        }
    }

    /// Evaluates forces and rates at unknowns `y`, unless they are there already.
    pub(super) fn evaluate_stage(&mut self, y: &[f64]) -> Result<(), EvaluationError> {
        if self.stage.evaluated == y && !y.is_empty() {
            return Ok(());
        }
        self.stage.evaluated.clear();
        let mut trial = std::mem::take(&mut self.stage.trial);
        trial.resize(self.len(), 0.0);
        self.expand(y, &mut trial);
        let base = std::mem::take(&mut self.stage.base);
        let n = self.particles();
        let (displacement, rest) = trial.split_at_mut(n * D);
        let (velocity, ratios) = rest.split_at_mut(n * D);
        let local = self.unknowns.kind() == Unknowns::Velocity;
        let start = std::mem::take(&mut self.stage.start);
        let source = if !start.is_empty() {
            VolumeRatios::Conserving { start: &start, shift: self.stage.shift }
        } else if self.stage.at_rest {
            VolumeRatios::Equilibrium { constants: &base[2 * n * D..] }
        } else if local {
            VolumeRatios::Stage { base: &base[2 * n * D..], shift: self.stage.shift }
        } else {
            VolumeRatios::Given(ratios)
        };
        let outcome = self.evaluate(self.stage.time, displacement, velocity, source);
        if outcome.is_ok() && local {
            for (a, (ratio, point)) in ratios.iter_mut().zip(&self.workspace.points).enumerate() {
                if self.evolves_volume(a) {
                    *ratio = point.volume_ratio;
                }
            }
        }
        self.stage.start = start;
        self.stage.base = base;
        self.stage.trial = trial;
        if outcome.is_ok() {
            self.stage.evaluated.extend_from_slice(y);
        }
        outcome
    }

    /// Size of the summands of a particle's residual before they cancel. The stress counts with its
    /// modulus: a pressure near zero is itself a difference, `κ(1 − J)`. So is the increment of J, of products
    /// of cofactor and velocity gradient, and the cofactor, of displacements: after large shear or far from
    /// its place a body knows its forces with fewer digits.
    fn residual_scale(&self, a: usize, v: f64, base: f64) -> f64 {
        let point = &self.workspace.points[a];
        let material = self.material(a);
        let modulus = material.density * material.wave_speed().powi(2);
        let moved = crate::tensor::vector_at::<D>(&self.stage.trial, a).norm();
        let root = (D as f64).sqrt();
        let cofactor = (point.cofactor.norm() / root).max(1.0 + self.reach[a] * moved / root);
        let increment = if self.evolves_volume(a) {
            self.stage.shift * point.velocity_gradient.norm()
        } else {
            (point.deformation - Tensor::identity()).norm()
        };
        let ratio = 1.0 + cofactor * increment;
        let stress = (point.pressure.abs() + modulus * ratio) * cofactor * self.setup.particles.volumes[a];
        let hourglass = self
            .active_hourglass()
            .map_or(0.0, |control| control.summands(a, 1.0 + point.deformation.norm() / root, moved, self.reach[a]));
        let forces = stress * self.reach[a] + hourglass + self.loads.on(a).norm();
        self.masses[a] * (v + base) + self.stage.shift * forces
    }

    /// Writes the residual of the evaluated point and returns the scale of its summands.
    fn write_residual(&self, out: &mut [f64]) -> f64 {
        let n = self.particles();
        let (s, base, trial) = (self.stage.shift, &self.stage.base, &self.stage.trial);
        let mut scale = 0.0;
        for (a, point) in self.workspace.points.iter().enumerate() {
            let mass = if self.stage.at_rest { 0.0 } else { self.masses[a] };
            let (mut size, mut base_size) = (0.0, 0.0);
            for i in 0..D {
                let entry = (n + a) * D + i;
                size += trial[entry] * trial[entry];
                base_size += base[entry] * base[entry];
                if let Some(row) = self.unknowns.velocity(a, i) {
                    out[row] = mass * (trial[entry] - base[entry]) - s * point.force[i];
                    if let Some(row) = self.unknowns.displacement(a, i) {
                        let u = a * D + i;
                        out[row] = mass * ((trial[u] - base[u]) / s - trial[entry]);
                    }
                }
            }
            if let Some(row) = self.unknowns.volume_ratio(a) {
                let j = 2 * n * D + a;
                let unit = mass * self.volume_unit(a);
                out[row] = unit * (trial[j] - base[j] - s * point.rate);
                size += self.volume_unit(a).powi(2);
            }
            if self.unknowns.free(a) > 0 || self.unknowns.volume_ratio(a).is_some() {
                scale += self.residual_scale(a, size.sqrt(), base_size.sqrt()).powi(2);
            }
        }
        scale.sqrt()
    }
}

impl<const D: usize> NonlinearProblem for Model<D> {
    fn unknowns(&self) -> usize {
        self.unknowns.count()
    }

    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<f64, EvaluationError> {
        let start = Instant::now();
        let outcome = self.evaluate_stage(y);
        let scale = if outcome.is_ok() { self.write_residual(out) } else { 0.0 };
        Clocks::add(&self.clocks.rate, start);
        outcome?;
        match vector::first_not_finite(out) {
            None => Ok(scale),
            Some(i) => {
                let a = self.unknowns.particle_of(i);
                Err(self.located(EvaluationError::not_finite("residual", a, out[i])))
            }
        }
    }

    fn linearise(&mut self, y: &[f64]) -> Result<(), EvaluationError> {
        // The derivatives of linear equations are everywhere those of their first point.
        if self.constant_tangent().is_some()
            && self.linearisation.shift == self.stage.shift
            && self.linearisation.at_rest == self.stage.at_rest
            && self.linearisation.taken
        {
            return Ok(());
        }
        self.evaluate_stage(y)?;
        let start = Instant::now();
        self.freeze();
        Clocks::add(&self.clocks.linearisation, start);
        Ok(())
    }

    fn tangent(&self) -> &dyn Tangent {
        self
    }

    fn linearisation_point(&self) -> Option<Arc<Snapshot>> {
        self.linearisation.point.clone().filter(|_| self.linearisation.taken)
    }

    fn linearise_again(&mut self, point: &Snapshot) -> Result<(), RestoreError> {
        self.linearise_at(point)
    }

    fn constant_tangent(&self) -> Option<u64> {
        // In three dimensions the conserving stress is not linear even where the equations are.
        let conserving = !self.stage.start.is_empty();
        // An equilibrium has the tangent of no step: a shift of zero stands for it.
        let key = if self.stage.at_rest { 0.0 } else { self.stage.shift };
        (self.linear && !(conserving && D == 3)).then(|| key.to_bits())
    }

    fn describe(&self, unknown: usize) -> String {
        let particle = self.unknowns.particle_of(unknown);
        format!("{} of {}", self.unknowns.describe(unknown), self.describe_particle(particle))
    }
}
