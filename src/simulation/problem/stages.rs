//! Stage after stage of a diagonally implicit scheme, each a nonlinear problem of its own.

use nicolson_solvers::time::{DiagonalTableau, StageSystem, TimeState};

use super::{Posed, StepProblem};
use crate::simulation::RunError;

impl<const D: usize> StepProblem<D> {
    /// Whether so many stages can lie before another one.
    pub(super) fn check_earlier(&self, earlier: usize) -> Result<(), RunError> {
        let (stages, name) = (self.scheme.implicit_stages(), self.scheme.name());
        if earlier < stages.max(1) {
            return Ok(());
        }
        Err(RunError::Choice(format!(
            "{earlier} earlier stages are solved already, but a step of {name} has {stages}: give the unknowns of at most {} \
             earlier ones",
            stages.saturating_sub(1)
        )))
    }

    /// Poses the stage that comes after those that `earlier` solves, and returns the start of Newton's method: the solution
    /// of the stage before, or the start of the step.
    pub(super) fn pose_diagonal(
        &mut self,
        state: &TimeState,
        step: f64,
        tableau: &DiagonalTableau,
        earlier: &[Vec<f64>],
    ) -> Result<Vec<f64>, RunError> {
        let end = self.end;
        let mut rates: Vec<Vec<f64>> = Vec::with_capacity(tableau.rows.len());
        let mut values = state.values.clone();
        let mut solutions = earlier.iter();
        for (i, row) in tableau.rows.iter().enumerate() {
            if row[i] == 0.0 {
                rates.push(self.start_rate(state)?);
                continue;
            }
            let mut base = state.values.clone();
            for (weight, rate) in row.iter().zip(&rates) {
                nicolson_solvers::vector::axpy(weight * step, rate, &mut base);
            }
            let time = if i + 1 == tableau.rows.len() { end } else { state.time + tableau.nodes[i] * step };
            self.begin(time, row[i] * step, base, Posed::Stage);
            let Some(y) = solutions.next() else {
                // What its unknowns stand for is the state at the stage; of the last one that is the end.
                self.end = time;
                return Ok(self.begin_at(&values));
            };
            self.check_unknowns(y)?;
            let mut rate = vec![0.0; values.len()];
            self.model.finish_stage(y, &mut values, &mut rate).map_err(|error| self.outside(error))?;
            rates.push(rate);
        }
        // Unreachable: the number of solutions has been checked.
        self.check_earlier(earlier.len()).map(|()| Vec::new())
    }
}
