//! The tangent with which the first step of a scene begins, for other programs.

use std::sync::{Arc, Mutex, PoisonError};

use nicolson_solvers::linear::{
    LinearCounts, LinearError, LinearReport, LinearSolver, LinearSolverInfo, SparseMatrix, Tangent,
};
use nicolson_solvers::nonlinear::{NewtonSolver, NonlinearProblem};
use nicolson_solvers::time::{Retries, Stepper};

use super::{Prepared, RunError};

type Slot = Arc<Mutex<Option<SparseMatrix>>>;

/// A linear solver that keeps the first tangent it is given, and ends the solve with it.
struct Keeper(Slot);

impl LinearSolver for Keeper {
    fn info(&self) -> LinearSolverInfo {
        LinearSolverInfo {
            name: "keeper of the tangent".into(),
            unknowns: 0,
            entries: 0,
            fill: 0,
            threads: 1,
            reason: String::new(),
        }
    }

    fn counts(&self) -> LinearCounts {
        LinearCounts::default()
    }

    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        let mut slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if slot.is_none()
            && let Some(pattern) = tangent.pattern()
        {
            let mut values = vec![0.0; pattern.entries()];
            tangent.fill(&mut values);
            *slot = Some(SparseMatrix::new(pattern, values));
        }
        Err(LinearError::NotPrepared)
    }

    fn solve(&mut self, _: &dyn Tangent, _: &[f64], _: &mut [f64], _: f64) -> Result<LinearReport, LinearError> {
        Err(LinearError::NotPrepared)
    }
}

/// The tangent at the start of the first Newton iteration of the first step, with the scheme and step of the
/// scene. The run itself is left where it was.
///
/// # Errors
/// If the scheme is explicit, or the step cannot even be evaluated at its start.
pub fn first_tangent<const D: usize>(prepared: &mut Prepared<D>) -> Result<SparseMatrix, RunError> {
    let Some(newton) = prepared.stepper.newton() else {
        let name = prepared.stepper.scheme().name();
        return Err(RunError::Choice(format!("{name} is explicit and has no tangent: choose an implicit scheme")));
    };
    let slot = Slot::default();
    let newton = NewtonSolver::new(newton.options().clone(), Box::new(Keeper(Arc::clone(&slot))));
    let once = Retries { limit: 1, ..Retries::default() };
    let mut stepper = Stepper::new(prepared.stepper.scheme(), prepared.stepper.control().clone(), Some(newton))
        .and_then(|stepper| stepper.with_retries(once))
        .map_err(|error| RunError::Choice(error.to_string()))?;
    let mut state = prepared.state.clone();
    let outcome = stepper.advance(&mut prepared.model, &mut state, prepared.end);
    if let Some(matrix) = slot.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Ok(matrix);
    }
    if let Err(failure) = outcome {
        return Err(RunError::Choice(failure.to_string()));
    }
    // The start solved the step already, and no tangent was needed; the stage is still posed.
    let model = &mut prepared.model;
    let unknowns = model.present_unknowns().to_vec();
    model.linearise(&unknowns).map_err(|error| RunError::Choice(error.to_string()))?;
    Ok(model.tangent_matrix())
}
