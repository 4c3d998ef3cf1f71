//! One implicit stage: pose it, solve it, and what to do when Newton's method cannot.

use super::attempt::{Attempt, Tools};
use super::{StageSystem, StepCause};
use crate::linear::LinearError;
use crate::nonlinear::{NewtonCause, NewtonFailure, NewtonSolver, NonlinearProblem};
use crate::vector::first_not_finite;

/// Where Newton's method starts in a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guess {
    /// The state at the start of the step.
    Start,
    /// The values of the end, as far as they have come (the stage before).
    Last,
}

impl Attempt<'_> {
    /// Solves `u = ũ + s f(t, u)` with `ũ` in `tools.base`; the solution goes to `end.values`, its rate to
    /// `tools.rates[slot]`.
    pub fn solve_stage(&mut self, t: f64, shift: f64, guess: Guess, slot: usize) -> Result<(), StepCause> {
        let Tools { newton, base, unknowns, first_unknowns, rates, counts, .. } = &mut *self.tools;
        let newton = newton.as_mut().ok_or(StepCause::Capability("and a Newton solver"))?;
        let system = self.system.stages().ok_or(StepCause::Capability(NO_STAGES))?;
        system.begin_stage(t, shift, base);
        unknowns.resize(system.unknowns(), 0.0);
        let guess = if guess == Guess::Start { &self.start.values } else { &self.end.values };
        system.start_from(guess, unknowns);
        first_unknowns.clone_from(unknowns);
        let first = solve(newton, as_problem(system), unknowns, counts);
        if let Err(cause) = first {
            // Another start is worth a try only after a start or an iteration outside the domain.
            if !is_outside_domain(&cause) {
                return Err(cause);
            }
            system.admissible_start(&self.start.values, unknowns);
            if unknowns == first_unknowns {
                return Err(cause);
            }
            solve(newton, as_problem(system), unknowns, counts)?;
        }
        system.finish_stage(unknowns, &mut self.end.values, &mut rates[slot])?;
        for values in [&self.end.values, &rates[slot]] {
            if let Some(index) = first_not_finite(values) {
                return Err(StepCause::NotFinite { index, value: values[index] });
            }
        }
        Ok(())
    }

    /// Ends a step whose last stage lies at its end: the rate found there, in `rates[slot]`, is that of
    /// the next start, unless imposing the prescribed values changes the state after all.
    pub fn finish_at_stage(&mut self, slot: usize) {
        let imposed = &mut self.tools.base;
        imposed.copy_from_slice(&self.end.values);
        self.system.impose(self.span.end, imposed);
        if *imposed == self.end.values {
            self.end.memory.rate.clone_from(&self.tools.rates[slot]);
        } else {
            self.end.values.copy_from_slice(imposed);
        }
    }
}

const NO_STAGES: &str = "that can pose implicit stages";

pub(super) fn as_problem(system: &mut dyn StageSystem) -> &mut dyn NonlinearProblem {
    system
}

/// Newton's method, with the books kept.
pub(super) fn solve(
    newton: &mut NewtonSolver,
    problem: &mut dyn NonlinearProblem,
    unknowns: &mut [f64],
    counts: &mut super::attempt::Counts,
) -> Result<(), StepCause> {
    match newton.solve(problem, unknowns) {
        Ok(report) => {
            counts.newton_iterations += report.iterations;
            counts.newton.push(report);
            Ok(())
        }
        Err(failure) => {
            counts.newton_iterations += failure.work.iterations;
            counts.failed_solves.push((*failure).clone());
            Err(StepCause::Newton(failure))
        }
    }
}

/// Whether the iteration left the domain of the equations or began outside.
pub(super) fn is_outside_domain(cause: &StepCause) -> bool {
    matches!(cause, StepCause::Newton(failure) if matches!(failure.cause, NewtonCause::Domain { .. }))
}

/// Whether a shorter step may help: not against a wrong set-up, nor against the user's wish to stop.
pub(super) fn is_curable(failure: &NewtonFailure) -> bool {
    !matches!(
        failure.cause,
        NewtonCause::WrongLength { .. }
            | NewtonCause::Options(_)
            | NewtonCause::Unsupported { .. }
            | NewtonCause::Stopped
            | NewtonCause::LinearSolve(LinearError::NeedsEntries { .. } | LinearError::NeedsSymmetry { .. })
    )
}
