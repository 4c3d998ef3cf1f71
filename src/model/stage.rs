//! The implicit stage `u = ũ + s f(t, u)` as a nonlinear problem (formulation, section 6).
//!
//! The equation of the displacements is linear and local, `u = ũ + s v`; without D_p that of J is
//! local as well. Both are eliminated, and the velocities remain. Residuals are momenta:
//!
//! ```text
//! R_v = m (v − ṽ) − s f(t, u, v, J)        R_J = m c⁰ (J − J̃ − s J̇)        R_u = m (u − ũ − s v)/s
//! ```

use std::sync::Arc;
use std::time::Instant;

use nicolson_solvers::linear::Tangent;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{ConservingSystem, EquilibriumSystem, RatePart, StageSystem, System};
use nicolson_solvers::{EvaluationError, RestoreError, Snapshot, vector};

use super::conserving::StepStart;
use super::evaluation::VolumeRatios;
use super::{Clocks, Model, Unknowns};
use crate::setup::Constraint;
use crate::tensor::{Tensor, coordinates, determinant};

/// The stage being solved.
#[derive(Debug, Clone, Default)]
pub struct Stage<const D: usize> {
    /// Configuration at the start of a conserving step; empty for an implicit stage.
    pub start: Vec<StepStart<D>>,
    /// Whether this is an equilibrium: no inertia, no velocities, shift 1.
    pub at_rest: bool,
    /// Time of the stage, s.
    pub time: f64,
    /// Shift s, s.
    pub shift: f64,
    /// Base `ũ`, with prescribed entries at their values for the time of the stage.
    pub base: Vec<f64>,
    /// Full state at the last evaluated point.
    pub trial: Vec<f64>,
    /// Unknowns at the last evaluated point; empty if the workspace does not belong to this stage.
    pub evaluated: Vec<f64>,
}

impl<const D: usize> System for Model<D> {
    fn len(&self) -> usize {
        self.particles() * (2 * D + 1)
    }

    fn rate(&mut self, t: f64, state: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        let start = Instant::now();
        let outcome = self.all_rates(t, state, out);
        Clocks::add(&self.clocks.rate, start);
        outcome
    }

    fn rate_part(&mut self, part: RatePart, t: f64, state: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        let start = Instant::now();
        let outcome = self.some_rates(part, t, state, out);
        Clocks::add(&self.clocks.rate, start);
        outcome
    }

    fn velocities(&self) -> Option<std::ops::Range<usize>> {
        let n = self.particles() * D;
        Some(n..2 * n)
    }

    fn impose(&mut self, t: f64, state: &mut [f64]) {
        let n = self.particles();
        for &entry in self.rates.prescribed() {
            let (a, i) = (entry as usize / D, entry as usize % D);
            let (displacement, velocity) = match self.setup.constraints[a][i] {
                Constraint::Free => continue,
                Constraint::Fixed => (self.setup.initial.displacement[a][i], 0.0),
                Constraint::Moving(motion) => {
                    let at = coordinates(&self.setup.particles.positions[a]);
                    let motion = &self.setup.motions[motion];
                    (motion.value(at, t), motion.rate(at, t))
                }
            };
            state[a * D + i] = displacement;
            state[(n + a) * D + i] = velocity;
        }
    }

    fn stable_step(&mut self, _t: f64, state: &[f64]) -> f64 {
        let speed = self.largest_wave_speed(self.displacements(state));
        let mut wave = self.cfl * self.smallest_distance / speed;
        if let Some(control) = &self.hourglass {
            // The limit d/c holds up to a frequency of 2c/d; squares of frequencies add up at most.
            wave = self.cfl / (speed / self.smallest_distance).hypot(0.5 * control.frequency());
        }
        // A viscous mode decays at the rate ν k²; both limits together bind sooner than either.
        let diffusivity = self.largest_kinematic_viscosity();
        if diffusivity == 0.0 {
            return wave;
        }
        let viscous = self.cfl * self.smallest_distance * self.smallest_distance / diffusivity;
        wave * viscous / (wave + viscous)
    }

    fn stages(&mut self) -> Option<&mut dyn StageSystem> {
        Some(self)
    }

    fn equilibrium(&mut self) -> Option<&mut dyn EquilibriumSystem> {
        if self.unknowns.kind() == Unknowns::Velocity { Some(self) } else { None }
    }

    fn conserving(&mut self) -> Option<&mut dyn ConservingSystem> {
        // The discrete gradient eliminates J; D_p couples it.
        if self.unknowns.kind() == Unknowns::Velocity { Some(self) } else { None }
    }
}

impl<const D: usize> Model<D> {
    /// The particle of an entry of the state.
    pub fn particle_of_entry(&self, entry: usize) -> usize {
        let n = self.particles();
        if entry < 2 * n * D { (entry % (n * D)) / D } else { entry - 2 * n * D }
    }

    /// Unknowns at which the posed stage was evaluated last.
    pub(crate) fn present_unknowns(&self) -> &[f64] {
        &self.stage.evaluated
    }

    /// Unknown of J per unit of J, m/s: the wave speed at rest.
    pub(super) fn volume_unit(&self, a: usize) -> f64 {
        self.material(a).wave_speed()
    }

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

impl<const D: usize> StageSystem for Model<D> {
    fn begin_stage(&mut self, t: f64, shift: f64, base: &[f64]) {
        self.stage.start.clear();
        self.stage.at_rest = false;
        let mut kept = std::mem::take(&mut self.stage.base);
        kept.clear();
        kept.extend_from_slice(base);
        self.impose(t, &mut kept);
        self.stage.base = kept;
        self.stage.time = t;
        self.stage.shift = shift;
        self.stage.evaluated.clear();
    }

    fn start_from(&mut self, guess: &[f64], y: &mut [f64]) {
        let n = self.particles();
        for a in 0..n {
            for i in 0..D {
                if let Some(unknown) = self.unknowns.velocity(a, i) {
                    y[unknown] = guess[(n + a) * D + i];
                    if let Some(displacement) = self.unknowns.displacement(a, i) {
                        y[displacement] = self.stage.base[a * D + i] / self.stage.shift + y[unknown];
                    }
                }
            }
            if let Some(unknown) = self.unknowns.volume_ratio(a) {
                y[unknown] = guess[2 * n * D + a] * self.volume_unit(a);
            }
        }
    }

    fn admissible_start(&mut self, state: &[f64], y: &mut [f64]) {
        let n = self.particles();
        let s = self.stage.shift;
        self.start_from(state, y);
        for a in 0..n {
            for i in 0..D {
                if let Some(unknown) = self.unknowns.velocity(a, i) {
                    // u = ũ + s v must give back the present displacement.
                    y[unknown] = (state[a * D + i] - self.stage.base[a * D + i]) / s;
                    if let Some(displacement) = self.unknowns.displacement(a, i) {
                        y[displacement] = state[a * D + i] / s;
                    }
                }
            }
        }
    }

    fn finish_stage(&mut self, y: &[f64], state: &mut [f64], rate: &mut [f64]) -> Result<(), EvaluationError> {
        self.evaluate_stage(y)?;
        state.copy_from_slice(&self.stage.trial);
        let n = self.particles();
        self.write_rate(&self.stage.trial[n * D..2 * n * D], rate);
        Ok(())
    }
}

/// The unknowns are displacements from the start, `u = ũ + y · 1 s`, and the residual is minus the force times 1 s: the
/// stage of shift 1 s without its inertia and with velocities at zero, so that damping plays no part.
impl<const D: usize> EquilibriumSystem for Model<D> {
    fn begin_equilibrium(&mut self, t: f64, from: &[f64], y: &mut Vec<f64>) {
        let n = self.particles();
        let mut base = from.to_vec();
        base[n * D..2 * n * D].fill(0.0);
        self.begin_stage(t, 1.0, &base);
        self.stage.at_rest = true;
        self.stage.base[n * D..2 * n * D].fill(0.0);
        // J follows det F from where both stand.
        for a in 0..n {
            self.stage.base[2 * n * D + a] = if self.evolves_volume(a) {
                let det = determinant(&self.deformation(from, a));
                self.volume_constant(a, from[2 * n * D + a], det).unwrap_or(1.0)
            } else {
                self.initial_volume_constant(a)
            };
        }
        y.clear();
        y.resize(self.unknowns.count(), 0.0);
    }

    fn finish_equilibrium(&mut self, y: &[f64], u: &mut [f64]) -> Result<(), EvaluationError> {
        self.evaluate_stage(y)?;
        let n = self.particles();
        u[..2 * n * D].copy_from_slice(&self.stage.trial[..2 * n * D]);
        for a in (0..n).filter(|&a| self.evolves_volume(a)) {
            u[2 * n * D + a] = self.stage.trial[2 * n * D + a];
        }
        Ok(())
    }
}
