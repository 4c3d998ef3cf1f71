//! What Newton's method remembers from step to step, for checkpoints.
//!
//! Secant pairs, forcing terms and trust radii do not outlive a solve. What does: the work so far, the age of the
//! tangent, and what the linear solver made of operators. These are made again where the problem was linearised then:
//! at two points, where a solver keeps a factor while the operator moves on.

use std::sync::Arc;

use super::NonlinearProblem;
use super::newton::NewtonSolver;
use super::report::NewtonTotals;
use super::tangent_policy::TangentCounts;
use crate::linear::OperatorAge;
use crate::snapshot::{RestoreError, Snapshot};

impl NewtonSolver {
    /// Keeps the point of the operator that the linear solver keeps, if that is not the last one. `before`: where the
    /// problem was linearised before the last time.
    pub(super) fn mind_older_operator(&mut self, before: Option<Arc<Snapshot>>) {
        if !self.linear.keeps_older_operator() {
            self.older_point = None;
        } else if self.older_point.is_none() {
            self.older_point = before;
        }
    }

    /// What it remembers, `problem` being the one that it solved last.
    pub fn save(&self, problem: &dyn NonlinearProblem) -> Snapshot {
        let mut saved = Snapshot::new();
        saved.put_part("totals", self.totals.save());
        saved.put_part("tangent", self.tangent.save());
        saved.put_part("linear", self.linear.save());
        if let Some(point) = problem.linearisation_point() {
            saved.put_part("point", Snapshot::clone(&point));
        }
        if let Some(point) = &self.older_point {
            saved.put_part("older_point", Snapshot::clone(point));
        }
        saved
    }

    /// Makes a new solver with the same options what that one was, to the last bit. A problem that does not tell where
    /// it was linearised gives the work so far and nothing more: the next solve begins with a new tangent.
    ///
    /// # Errors
    /// [`RestoreError`] if the snapshot is of another kind of solver or problem.
    pub fn restore(&mut self, problem: &mut dyn NonlinearProblem, saved: &Snapshot) -> Result<(), RestoreError> {
        self.totals = NewtonTotals::restored(&saved.part("totals"))?;
        let (point, older) = (saved.part("point"), saved.part("older_point"));
        if point.is_empty() {
            self.forget();
            return Ok(());
        }
        let linear = saved.part("linear");
        self.older_point = None;
        if !older.is_empty() {
            problem.linearise_again(&older)?;
            self.linear.restore(&linear, problem.tangent(), OperatorAge::Older)?;
            self.older_point = problem.linearisation_point();
        }
        problem.linearise_again(&point)?;
        self.linear.restore(&linear, problem.tangent(), OperatorAge::Last)?;
        self.tangent.restore(&saved.part("tangent"))
    }
}

impl NewtonTotals {
    fn save(&self) -> Snapshot {
        let Self {
            solves,
            failures,
            iterations,
            residual_evaluations,
            linearisations,
            factorisations,
            linear_solves,
            linear_iterations,
            line_search_steps,
            rejected_steps,
            factorisation_seconds,
            solve_seconds,
        } = *self;
        let mut saved = Snapshot::new();
        saved.put_counts("solves", &[solves, failures, iterations, residual_evaluations, linearisations]);
        saved.put_counts("factorisations", &factorisations.list());
        saved.put_counts("linear", &[linear_solves, linear_iterations, line_search_steps, rejected_steps]);
        saved.put_reals("seconds", [factorisation_seconds, solve_seconds]);
        saved
    }

    fn restored(saved: &Snapshot) -> Result<Self, RestoreError> {
        let [solves, failures, iterations, residual_evaluations, linearisations] = saved.counts("solves")?;
        let [linear_solves, linear_iterations, line_search_steps, rejected_steps] = saved.counts("linear")?;
        let [factorisation_seconds, solve_seconds] = saved.some_reals("seconds")?;
        Ok(Self {
            solves,
            failures,
            iterations,
            residual_evaluations,
            linearisations,
            factorisations: TangentCounts::from_list(saved.counts("factorisations")?),
            linear_solves,
            linear_iterations,
            line_search_steps,
            rejected_steps,
            factorisation_seconds,
            solve_seconds,
        })
    }
}
