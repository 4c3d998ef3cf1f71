//! Corrections beyond convergence, for quantities that live on the residual itself.
//!
//! A conservation law holds as exactly as the equations are solved: an energy–momentum step changes the energy by
//! `2 v̄·R` and by nothing else. A tolerance must not ask for less than rounding leaves anywhere, so where rounding is
//! smaller, it leaves something to gain. A correction with the factor at hand costs a solve and a residual.

use super::NonlinearProblem;
use super::newton::NewtonSolver;
use super::newton_parts::{Found, Run};
use super::options::Merit;
use super::report::{IterationRecord, NewtonCause};
use super::sample::{Sample, evaluate};
use crate::vector::norm;

/// Accuracy of the linear solves: the factor is not fresh, more would be wasted.
const LINEAR_TOLERANCE: f64 = 1e-4;
/// A correction counts if it reduces the residual by this factor; else it is rounding that moves.
const REDUCTION: f64 = 0.5;

impl NewtonSolver {
    /// Corrects a converged `y` as often as allowed and as long as the residual falls. Neither a failed solve nor a
    /// point outside the domain matters: `y` is a solution already.
    pub(super) fn correct_further(
        &mut self,
        problem: &mut dyn NonlinearProblem,
        y: &mut [f64],
        mut here: Sample,
        first: f64,
        run: &mut Run,
    ) -> Result<(), NewtonCause> {
        // There is a factor after an iteration only; a linear problem is solved.
        if run.work.iterations == 0 || problem.constant_tangent().is_some() {
            return Ok(());
        }
        for _ in 0..self.options.final_corrections {
            if here.norm == 0.0 {
                break;
            }
            let Ok(linear) = self.direction(problem, LINEAR_TOLERANCE, run) else { break };
            for ((trial, y), d) in self.vectors.trial.iter_mut().zip(y.iter()).zip(&self.vectors.direction) {
                *trial = y + d;
            }
            if norm(&self.vectors.direction) == 0.0 {
                break;
            }
            run.problem_is_here = false;
            let found = evaluate(problem, &self.vectors.trial, &mut self.vectors.trial_residual, &mut run.work);
            let Ok(sample) = found else { break };
            let contraction = sample.norm / here.norm;
            if contraction > REDUCTION {
                break;
            }
            let found = Found { sample, length: 1.0, trials: 1, merit: Merit::Residual, problem_is_here: true };
            let step = self.accept(y, &found);
            run.work.iterations += 1;
            run.problem_is_here = true;
            here = sample;
            self.record(
                run,
                IterationRecord {
                    iteration: run.work.iterations,
                    residual: here.norm,
                    relative: here.norm / first,
                    scale: here.scale,
                    contraction,
                    step,
                    step_length: 1.0,
                    trials: 1,
                    merit: Merit::Residual,
                    tangent: None,
                    forcing: LINEAR_TOLERANCE,
                    linear_residual: linear.relative_residual,
                    linear_iterations: linear.iterations,
                },
            )?;
        }
        Ok(())
    }
}
