//! The implicit stage `u = ũ + s f(t, u)` (formulation, section 6): what time schemes ask of the model.
//!
//! The equation of the displacements is linear and local, `u = ũ + s v`; without D_p that of J is
//! local as well. Both are eliminated, and the velocities remain. Residuals are momenta:
//!
//! ```text
//! R_v = m (v − ṽ) − s f(t, u, v, J)        R_J = m c⁰ (J − J̃ − s J̇)        R_u = m (u − ũ − s v)/s
//! ```

use std::time::Instant;

use nicolson_solvers::EvaluationError;
use nicolson_solvers::time::{ConservingSystem, EquilibriumSystem, RatePart, StageSystem, System};

use super::conserving::StepStart;
use super::{Clocks, Model, Unknowns};
use crate::setup::Constraint;
use crate::tensor::{coordinates, determinant};

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
