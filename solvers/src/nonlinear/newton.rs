//! Newton's method: evaluate, renew the tangent if need be, solve, globalise, judge.

use std::sync::Arc;

use super::NonlinearProblem;
use super::criteria::{Convergence, Criteria, Trouble};
use super::forcing::ForcingSequence;
use super::line_search::{Blocked, LineSearcher};
use super::monitor::NewtonMonitor;
use super::newton_parts::{Run, Vectors, start_record};
use super::options::NewtonOptions;
use super::quasi_newton::QuasiNewton;
use super::report::{IterationRecord, NewtonCause, NewtonFailure, NewtonReport, NewtonTotals};
use super::sample::evaluate;
use super::tangent_policy::{TangentCause, TangentPolicy};
use super::tangent_state::TangentState;
use super::trust_region::TrustRegion;
use crate::linear::LinearSolver;
use crate::snapshot::Snapshot;
use crate::vector::norm;

/// Solves one nonlinear problem after another with one linear solver.
///
/// The iteration is `J d = −R(y)`, `y ← y + α d` (J. E. Dennis and R. B. Schnabel 1983, chapter 6); what
/// `J`, the accuracy of `d`, and `α` are is up to the [`NewtonOptions`]. The factor is kept from solve to
/// solve as far as the tangent policy allows, and for ever if the problem has a
/// [constant tangent](NonlinearProblem::constant_tangent): so one solver belongs to one problem, or
/// [`forget`](Self::forget) is called between two.
pub struct NewtonSolver {
    pub(super) options: NewtonOptions,
    pub(super) linear: Box<dyn LinearSolver>,
    pub(super) tangent: TangentState,
    pub(super) quasi: Option<QuasiNewton>,
    pub(super) searcher: LineSearcher,
    pub(super) trust: TrustRegion,
    pub(super) vectors: Vectors,
    pub(super) totals: NewtonTotals,
    /// Where the problem was linearised when the linear solver took the operator that it still keeps, if that is not
    /// the last one.
    pub(super) older_point: Option<Arc<Snapshot>>,
    pub(super) monitor: Option<Box<dyn NewtonMonitor>>,
}

impl NewtonSolver {
    /// A solver with these options. Options that make no sense are reported by the first solve; see
    /// [`NewtonOptions::validate`] to know earlier.
    pub fn new(options: NewtonOptions, linear: Box<dyn LinearSolver>) -> Self {
        let quasi = match options.tangent {
            TangentPolicy::QuasiNewton { update, memory, .. } => Some(QuasiNewton::new(update, memory)),
            _ => None,
        };
        Self {
            tangent: TangentState::new(options.tangent),
            options,
            linear,
            quasi,
            searcher: LineSearcher::default(),
            trust: TrustRegion::default(),
            vectors: Vectors::default(),
            totals: NewtonTotals::default(),
            older_point: None,
            monitor: None,
        }
    }

    /// The options.
    pub fn options(&self) -> &NewtonOptions {
        &self.options
    }

    /// The linear solver.
    pub fn linear(&self) -> &dyn LinearSolver {
        &*self.linear
    }

    /// Work done since the solver was built.
    pub fn totals(&self) -> &NewtonTotals {
        &self.totals
    }

    /// Lets `monitor` watch every solve from now on; `None` removes it.
    pub fn set_monitor(&mut self, monitor: Option<Box<dyn NewtonMonitor>>) {
        self.monitor = monitor;
    }

    /// A new time step begins: tangent policies that last for steps count it.
    pub fn new_step(&mut self) {
        self.tangent.new_step();
    }

    /// The factor must not be used again: the state has been rolled back, or another problem comes.
    pub fn forget(&mut self) {
        self.tangent.forget();
    }

    /// Solves `R(y) = 0` from the start `y`. On success the last residual evaluation was at `y`.
    ///
    /// # Errors
    /// [`NewtonFailure`]; `y` then has the same bits as before.
    pub fn solve(
        &mut self,
        problem: &mut dyn NonlinearProblem,
        y: &mut [f64],
    ) -> Result<NewtonReport, Box<NewtonFailure>> {
        let unknowns = problem.unknowns();
        let mut run = Run::default();
        run.work.solves = 1;
        let outcome = if y.len() == unknowns {
            self.vectors.resize(unknowns);
            self.vectors.start.copy_from_slice(y);
            self.iterate(problem, y, &mut run)
        } else {
            Err(NewtonCause::WrongLength { expected: unknowns, found: y.len() })
        };
        let outcome = outcome.map_err(|cause| self.fail(problem, y, &mut run, cause));
        self.totals.add(&run.work);
        let Run { history, work, .. } = run;
        let outcome = match outcome {
            Ok(convergence) => Ok(NewtonReport { iterations: work.iterations, convergence, history, work }),
            Err((cause, worst)) => Err(Box::new(NewtonFailure { cause, history, worst, work })),
        };
        if let Some(monitor) = &mut self.monitor {
            monitor.finished(outcome.as_ref().map_err(|failure| &**failure));
        }
        outcome
    }

    /// The method itself.
    fn iterate(
        &mut self,
        problem: &mut dyn NonlinearProblem,
        y: &mut [f64],
        run: &mut Run,
    ) -> Result<Convergence, NewtonCause> {
        self.options.validate()?;
        self.begin(problem);
        let mut here = evaluate(problem, y, &mut self.vectors.residual, &mut run.work)
            .map_err(|error| NewtonCause::Domain { error, at_start: true })?;
        run.has_residual = true;
        run.problem_is_here = true;
        let mut criteria = Criteria::new(&self.options, here);
        let mut forcing = ForcingSequence::new(self.options.forcing);
        let mut limit = self.options.max_iterations;
        self.record(run, start_record(here))?;

        loop {
            if let Some(convergence) = criteria.converged(here) {
                self.correct_further(problem, y, here, criteria.first(), run)?;
                return self.finish(convergence, problem, y, run);
            }
            if run.work.iterations >= limit {
                // The failure may be due to stale tangents: full Newton gets its own chance.
                let never_stale = self.options.tangent == TangentPolicy::Full || problem.constant_tangent().is_some();
                if never_stale || !self.tangent.escalate(TangentCause::IterationLimit) {
                    return Err(NewtonCause::IterationLimit { iterations: run.work.iterations });
                }
                limit = limit.saturating_add(self.options.max_iterations);
                criteria.give_another_chance();
            }

            let renewed = self.prepare_tangent(problem, y, run)?;
            let eta = self.linear_tolerance(problem, &forcing, here, criteria.target(here));
            let linear = match self.direction(problem, eta, run) {
                Ok(linear) => linear,
                Err(_) if self.tangent.refactoring_may_help() => {
                    self.retry(run, TangentCause::LinearSolve);
                    continue;
                }
                Err(error) => return Err(NewtonCause::LinearSolve(error)),
            };
            if !self.tangent.is_stale() && criteria.step_vanishes(norm(&self.vectors.direction), norm(y)) {
                // No representable change of y is left to try.
                return if criteria.is_small(here) {
                    self.finish(Convergence::PrecisionLimit, problem, y, run)
                } else {
                    Err(NewtonCause::Stagnation { iterations: 1 })
                };
            }

            run.problem_is_here = false;
            let found = match self.globalise(problem, y, here, linear, run) {
                Ok(found) => found,
                Err(blocked) if self.tangent.is_stale() => {
                    self.retry(run, cause_of(&blocked));
                    continue;
                }
                Err(Blocked::Domain(error)) => return Err(NewtonCause::Domain { error, at_start: false }),
                Err(Blocked::NoDecrease { .. }) if criteria.is_noise(here) => {
                    return self.finish(Convergence::PrecisionLimit, problem, y, run);
                }
                Err(Blocked::NoDecrease { trials, smallest }) => {
                    return Err(NewtonCause::LineSearch { trials, smallest });
                }
                Err(Blocked::NeedsTransposed) => {
                    let reason = "the trust region needs a symmetric tangent or one with entries: use a line search";
                    return Err(NewtonCause::Unsupported { reason: reason.to_string() });
                }
            };
            let was_stale = self.tangent.is_stale();
            let contraction = found.sample.norm / here.norm;
            if was_stale && contraction >= 1.0 && criteria.converged(found.sample).is_none() {
                self.retry(run, TangentCause::Increase);
                continue;
            }

            forcing.observe(eta, here.norm, found.length, linear.relative_residual);
            let step = self.accept(y, &found);
            run.work.iterations += 1;
            run.problem_is_here = found.problem_is_here;
            here = found.sample;
            self.record(
                run,
                IterationRecord {
                    iteration: run.work.iterations,
                    residual: here.norm,
                    relative: here.norm / criteria.first(),
                    scale: here.scale,
                    contraction,
                    step,
                    step_length: found.length,
                    trials: found.trials,
                    merit: found.merit,
                    tangent: renewed,
                    forcing: eta,
                    linear_residual: linear.relative_residual,
                    linear_iterations: linear.iterations,
                },
            )?;
            let reduction = criteria.target(here) / here.norm;
            self.tangent.moved(contraction, reduction, limit.saturating_sub(run.work.iterations));
            if criteria.converged(here).is_some() {
                continue;
            }
            if contraction > 0.5 && criteria.is_noise(here) {
                return self.finish(Convergence::PrecisionLimit, problem, y, run);
            }
            if let Some(trouble) = criteria.judge(here) {
                if was_stale && self.tangent.escalate(TangentCause::Stagnation) {
                    criteria.give_another_chance();
                    continue;
                }
                return Err(match trouble {
                    Trouble::Stagnation { iterations } => NewtonCause::Stagnation { iterations },
                    Trouble::Divergence { growth } => NewtonCause::Divergence { growth },
                });
            }
        }
    }
}

fn cause_of(blocked: &Blocked) -> TangentCause {
    match blocked {
        Blocked::Domain(_) => TangentCause::Domain,
        Blocked::NoDecrease { .. } | Blocked::NeedsTransposed => TangentCause::LineSearch,
    }
}
