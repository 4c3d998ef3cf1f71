//! Evolution `u' = f(t, u)`.
//!
//! Explicit schemes need a [`System`]. Implicit schemes need a [`StageSystem`], which can pose the one
//! problem that all of them are made of, `u = ũ + s f(t, u)`, in unknowns of its own choice. A scheme
//! that conserves energy needs a [`ConservingSystem`]: not every system has an energy.
//!
//! A [`Stepper`] takes one accepted step after another on a [`TimeState`], by a [`Scheme`] and a
//! [`StepControl`]. A step that fails leaves the state bit-identical; the stepper then tries another start,
//! then shorter steps, and gives up with a [`StepFailure`] that tells every try.
//!
//! What this layer does not do: events, dense output, multi-step methods, splitting.

mod attempt;
mod conserving;
mod control;
mod diagonal;
mod equilibrium;
mod explicit;
mod implicit;
mod memory;
mod pace;
mod report;
mod rkc;
mod scheme;
mod stage;
mod state;
mod stepper;
mod verlet;

pub use control::{Adaptive, Effort, Retries, StepControl};
pub use diagonal::DiagonalTableau;
pub use report::{FailedTry, Rejections, Statistics, StepCause, StepFailure, StepReport, StepperError};
pub use rkc::{
    DominantEigenvalue, RkcCoefficients, RkcOptions, RkcStages, rkc_growth, rkc_stability_limit, rkc_stages,
    rkc_stages_by_courant,
};
pub use scheme::Scheme;
pub use state::{ControlMemory, Memory, TimeState};
pub use stepper::Stepper;

use crate::EvaluationError;
use crate::nonlinear::NonlinearProblem;

/// Which part of a rate is wanted, for systems of second order in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RatePart {
    /// Everything.
    All,
    /// Only the entries of [`System::velocities`].
    Velocities,
    /// Only the other entries.
    Others,
}

/// A system `u' = f(t, u)` on a flat state.
pub trait System {
    /// Length of the state.
    fn len(&self) -> usize;

    /// Whether there is nothing to integrate.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes `f(t, u)`. Entries whose motion is prescribed may hold anything finite.
    ///
    /// # Errors
    /// [`EvaluationError`] if `u` is outside the domain or the result is not finite.
    fn rate(&mut self, t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError>;

    /// Writes one part of `f(t, u)`; the other entries of `out` are left as they are.
    ///
    /// # Errors
    /// As [`rate`](Self::rate).
    fn rate_part(&mut self, part: RatePart, t: f64, u: &[f64], out: &mut [f64]) -> Result<(), EvaluationError> {
        let Some(velocities) = self.velocities() else { return self.rate(t, u, out) };
        let mut all = vec![0.0; u.len()];
        self.rate(t, u, &mut all)?;
        for (i, (out, all)) in out.iter_mut().zip(&all).enumerate() {
            let wanted = match part {
                RatePart::All => true,
                RatePart::Velocities => velocities.contains(&i),
                RatePart::Others => !velocities.contains(&i),
            };
            if wanted {
                *out = *all;
            }
        }
        Ok(())
    }

    /// The range of the state that holds velocities, if the system is of second order in time: the
    /// rate of the other entries then depends on the velocities, and velocity Verlet applies.
    fn velocities(&self) -> Option<std::ops::Range<usize>> {
        None
    }

    /// Overwrites the entries of `u` whose motion is prescribed with their values at time `t`.
    fn impose(&mut self, t: f64, u: &mut [f64]) {
        let _ = (t, u);
    }

    /// Largest step that an explicit scheme may take from `(t, u)`: the CFL estimate of the system.
    /// Infinite if the system has no such limit.
    fn stable_step(&mut self, t: f64, u: &[f64]) -> f64 {
        let _ = (t, u);
        f64::INFINITY
    }

    /// The system as one that can pose implicit stages, if it can.
    fn stages(&mut self) -> Option<&mut dyn StageSystem> {
        None
    }

    /// The system as one whose equilibrium can be sought without inertia, if it can.
    fn equilibrium(&mut self) -> Option<&mut dyn EquilibriumSystem> {
        None
    }

    /// The system as one that has a discrete energy, if it has.
    fn conserving(&mut self) -> Option<&mut dyn ConservingSystem> {
        None
    }
}

/// A system that can pose the implicit stage `u = ũ + s f(t, u)` as a [`NonlinearProblem`] in reduced
/// unknowns `y` of its own choice.
///
/// Order of calls: [`begin_stage`](Self::begin_stage); one of the starts; Newton on the problem that
/// the system itself now is; [`finish_stage`](Self::finish_stage).
pub trait StageSystem: System + NonlinearProblem {
    /// Fixes the stage: time `t`, shift `s > 0`, base `ũ` (length of the state).
    fn begin_stage(&mut self, t: f64, shift: f64, base: &[f64]);

    /// Writes a start for Newton from a guess of the full state `u`.
    fn start_from(&mut self, guess: &[f64], y: &mut [f64]);

    /// Writes a start that reproduces the configuration of `u`, which is known to be admissible: the
    /// stage of a long step whose extrapolated start is outside the domain can always begin here.
    fn admissible_start(&mut self, u: &[f64], y: &mut [f64]);

    /// Expands the solution `y` to the full state `u` and to the rate `f(t, u)` there, at no further
    /// evaluation where the system can help it.
    ///
    /// # Errors
    /// [`EvaluationError`] if the solution is not admissible after all.
    fn finish_stage(&mut self, y: &[f64], u: &mut [f64], rate: &mut [f64]) -> Result<(), EvaluationError>;
}

/// A system whose equilibrium under the loads of a moment is a nonlinear problem of its own.
///
/// Order of calls: [`begin_equilibrium`](Self::begin_equilibrium), which also writes the start; Newton on the problem
/// that the system itself now is; [`finish_equilibrium`](Self::finish_equilibrium).
pub trait EquilibriumSystem: System + NonlinearProblem {
    /// Poses the equilibrium under the loads and prescribed values of (pseudo-)time `t`, and writes the start of the
    /// iteration: the configuration of `from`.
    fn begin_equilibrium(&mut self, t: f64, from: &[f64], y: &mut Vec<f64>);

    /// Expands the solution to a state at rest.
    ///
    /// # Errors
    /// [`EvaluationError`] if the solution is not admissible after all.
    fn finish_equilibrium(&mut self, y: &[f64], u: &mut [f64]) -> Result<(), EvaluationError>;
}

/// A system with an energy that a discrete-gradient mid-point step can conserve exactly.
///
/// Order of calls: [`begin_conserving`](Self::begin_conserving); one of the starts; Newton on the
/// problem that the system itself now is; [`finish_conserving`](Self::finish_conserving). A step that proves
/// hard is begun several times.
pub trait ConservingSystem: StageSystem {
    /// Fixes the step from `(t, from)` to `t + step`.
    fn begin_conserving(&mut self, t: f64, step: f64, from: &[f64]);

    /// Writes a start that extrapolates the motion.
    fn extrapolated_start(&mut self, y: &mut [f64]);

    /// Writes the start `v₁ = −v₀`, whose end configuration is that of the start of the step and which
    /// is therefore always admissible.
    fn resting_start(&mut self, y: &mut [f64]);

    /// Turns the solution of a shorter step, `fraction` of the present one, into a start with the same end
    /// configuration. The default is for unknowns that are mean velocities.
    fn continued_start(&mut self, fraction: f64, y: &mut [f64]) {
        for y in y {
            *y *= fraction;
        }
    }

    /// Expands the solution to the state at the end of the step.
    ///
    /// # Errors
    /// [`EvaluationError`] if the solution is not admissible after all.
    fn finish_conserving(&mut self, y: &[f64], u: &mut [f64]) -> Result<(), EvaluationError>;
}
