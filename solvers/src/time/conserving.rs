//! The energy–momentum step: one nonlinear problem, and where to start on it.
//!
//! For long steps the problem is hard, although it has a solution: energy keeps the end of the step away from
//! the boundary of the domain whatever the length of the step, and for short ones there is exactly one. Three
//! starts are tried, each for when the one before has failed:
//!
//! 1. the motion extrapolated;
//! 2. at rest, `v₁ = −v₀`, with the end configuration of the start: always admissible;
//! 3. continuation in the length of the step: the solution of a shorter step, at its end configuration, is the
//!    start for a longer one. Only the full step is ever taken; the shorter ones serve its start.

use super::attempt::{Attempt, Counts, Estimate, Span, Tools};
use super::stage::solve;
use super::{ConservingSystem, StepCause};
use crate::nonlinear::NewtonSolver;

/// Nonlinear solves that a continuation may take.
const MOST_SOLVES: usize = 60;
/// Shortest step of a continuation, relative to the full one.
const SHORTEST: f64 = 1e-3;
/// Growth of the step from one point of a continuation to the next, at first.
const GROWTH: f64 = 2.0;
/// Growth below which a continuation has got stuck.
const LEAST_GROWTH: f64 = 1.005;

impl Attempt<'_> {
    /// The step of a [`ConservingSystem`]. No embedded estimate.
    pub fn energy_momentum(&mut self) -> Result<Estimate, StepCause> {
        let Tools { newton, unknowns, first_unknowns, counts, .. } = &mut *self.tools;
        let newton = newton.as_mut().ok_or(StepCause::Capability("and a Newton solver"))?;
        let needs = StepCause::Capability("with a discrete energy to conserve");
        let system = self.system.conserving().ok_or(needs)?;
        let mut step = ConservingStep { system, newton, counts, time: self.start.time, from: &self.start.values };
        step.solve(self.span, unknowns, first_unknowns)?;
        step.system.finish_conserving(unknowns, &mut self.end.values)?;
        self.system.impose(self.span.end, &mut self.end.values);
        Ok(Estimate::None)
    }
}

/// The problem of one step and the means to solve it.
struct ConservingStep<'a> {
    system: &'a mut dyn ConservingSystem,
    newton: &'a mut NewtonSolver,
    counts: &'a mut Counts,
    time: f64,
    from: &'a [f64],
}

impl ConservingStep<'_> {
    /// Solves the step from one start after another; the cause is that of the last start that failed.
    fn solve(&mut self, span: Span, y: &mut Vec<f64>, kept: &mut Vec<f64>) -> Result<(), StepCause> {
        self.system.begin_conserving(self.time, span.step, self.from);
        y.resize(self.system.unknowns(), 0.0);
        self.system.extrapolated_start(y);
        kept.clone_from(y);
        let Err(cause) = solve(self.newton, self.system, y, self.counts) else { return Ok(()) };
        if !cause.is_curable() {
            return Err(cause);
        }
        self.system.resting_start(y);
        if y == kept {
            return Err(cause);
        }
        let Err(cause) = solve(self.newton, self.system, y, self.counts) else { return Ok(()) };
        if !cause.is_curable() {
            return Err(cause);
        }
        let (reports, failures) = (self.counts.newton.len(), self.counts.failed_solves.len());
        let continued = self.continuation(span.step, y, kept);
        // The solves on the way are work, but no part of the step.
        let mut solves = self.counts.newton.split_off(reports);
        self.counts.auxiliary_solves += solves.len() + (self.counts.failed_solves.len() - failures);
        self.counts.failed_solves.truncate(failures);
        if continued {
            self.counts.auxiliary_solves -= 1;
            self.counts.newton.extend(solves.pop());
        }
        if continued { Ok(()) } else { Err(cause) }
    }

    /// Follows the solution from a short step to the full one; `y` is the solution if it gets there.
    fn continuation(&mut self, step: f64, y: &mut [f64], kept: &mut [f64]) -> bool {
        // The longest step so far that could be solved, and its solution in `kept`.
        let mut reached = 0.0;
        let mut fraction = 0.25;
        let mut growth = GROWTH;
        for _ in 0..MOST_SOLVES {
            self.system.begin_conserving(self.time, fraction * step, self.from);
            if reached > 0.0 {
                y.copy_from_slice(kept);
                self.system.continued_start(reached / fraction, y);
            } else {
                self.system.extrapolated_start(y);
            }
            match solve(self.newton, self.system, y, self.counts) {
                Ok(()) if fraction >= 1.0 => return true,
                Ok(()) => {
                    kept.copy_from_slice(y);
                    reached = fraction;
                    growth = (growth * growth).min(GROWTH);
                }
                Err(cause) if !cause.is_curable() => return false,
                Err(_) if reached > 0.0 => {
                    growth = growth.sqrt();
                    if growth < LEAST_GROWTH {
                        return false;
                    }
                }
                Err(_) if fraction < SHORTEST => return false,
                Err(_) => {
                    fraction *= 0.25;
                    continue;
                }
            }
            fraction = (reached * growth).min(1.0);
        }
        false
    }
}
