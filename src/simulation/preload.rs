//! The equilibrium that a run starts from.

use nicolson_solvers::nonlinear::{Globalisation, NewtonOptions, NewtonSolver};
use nicolson_solvers::time::{Scheme, StepControl, Stepper, TimeState};

use super::{RunError, choices};
use crate::model::{Model, Ramp};
use crate::scene::Scene;

/// Increments in which the loads are applied, before any cut.
const INCREMENTS: f64 = 4.0;

/// Replaces the displacements (and volume ratios) of a state by the equilibrium under the loads at `t = 0`, which grow
/// from zero in increments; velocities stay.
///
/// # Errors
/// If the scene has no equilibrium, or Newton's method cannot find it.
pub fn equilibrate<const D: usize>(scene: &Scene, model: &mut Model<D>, values: &mut [f64]) -> Result<(), RunError> {
    choices::possible(Scheme::Static, model)?;
    model.set_ramp(Some(Ramp { end: 1.0, frozen: Some(0.0) }));
    let options = NewtonOptions { globalisation: Globalisation::None, ..choices::newton(scene)? };
    let newton = NewtonSolver::new(options, choices::linear(scene, true)?.build());
    let control = StepControl::Fixed { step: 1.0 / INCREMENTS };
    let mut stepper =
        Stepper::new(Scheme::Static, control, Some(newton)).map_err(|error| RunError::Choice(error.to_string()))?;
    let mut state = TimeState::new(0.0, values.to_vec());
    while state.time < 1.0 {
        stepper.advance(model, &mut state, 1.0).map_err(|failure| {
            RunError::Choice(format!(
                "initial.equilibrium: no equilibrium found beyond {:.1} % of the loads: {failure}; check that every body \
                 is held, or start from rest",
                100.0 * state.time
            ))
        })?;
    }
    model.set_ramp(None);
    let n = model.particles() * D;
    values[..n].copy_from_slice(&state.values[..n]);
    values[2 * n..].copy_from_slice(&state.values[2 * n..]);
    Ok(())
}
