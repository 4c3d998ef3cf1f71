//! Newton's method: evaluate, renew the tangent if need be, solve, globalise, judge.

use std::ops::ControlFlow;
use std::time::Instant;

use super::NonlinearProblem;
use super::criteria::{Convergence, Criteria, Trouble};
use super::forcing::ForcingSequence;
use super::line_search::{Blocked, LineSearcher};
use super::monitor::NewtonMonitor;
use super::options::{Globalisation, Merit, NewtonOptions};
use super::quasi_newton::QuasiNewton;
use super::ray::{Ray, RayBuffers};
use super::report::{IterationRecord, NewtonCause, NewtonFailure, NewtonReport, NewtonTotals};
use super::sample::{Sample, evaluate};
use super::tangent_policy::{TangentCause, TangentPolicy, TangentState};
use super::trust_region::{TrustRegion, TrustRegionStep};
use crate::linear::{LinearError, LinearReport, LinearSolver};
use crate::vector::{first_not_finite, norm};

/// Solves one nonlinear problem after another with one linear solver.
///
/// The iteration is `J d = −R(y)`, `y ← y + α d` (J. E. Dennis and R. B. Schnabel 1983, chapter 6); what
/// `J`, the accuracy of `d`, and `α` are is up to the [`NewtonOptions`]. The factor is kept from solve to
/// solve as far as the tangent policy allows, and for ever if the problem has a
/// [constant tangent](NonlinearProblem::constant_tangent): so one solver belongs to one problem, or
/// [`forget`](Self::forget) is called between two.
pub struct NewtonSolver {
    options: NewtonOptions,
    linear: Box<dyn LinearSolver>,
    tangent: TangentState,
    quasi: Option<QuasiNewton>,
    searcher: LineSearcher,
    trust: TrustRegion,
    vectors: Vectors,
    totals: NewtonTotals,
    monitor: Option<Box<dyn NewtonMonitor>>,
}

/// Work space, kept so that only the first solve allocates.
#[derive(Debug, Default)]
struct Vectors {
    start: Vec<f64>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    trial: Vec<f64>,
    trial_residual: Vec<f64>,
    difference: Vec<f64>,
}

impl Vectors {
    fn resize(&mut self, unknowns: usize) {
        let Self { start, residual, direction, trial, trial_residual, difference } = self;
        for vector in [start, residual, direction, trial, trial_residual, difference] {
            vector.resize(unknowns, 0.0);
        }
    }
}

/// What one solve has done so far.
#[derive(Debug, Default)]
struct Run {
    history: Vec<IterationRecord>,
    work: NewtonTotals,
    /// Whether the residual buffer belongs to the last point of the history.
    has_residual: bool,
}

/// A trial point that the globalisation found acceptable; it is in the trial buffers.
struct Found {
    sample: Sample,
    length: f64,
    trials: usize,
    merit: Merit,
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
        let mut criteria = Criteria::new(&self.options, here);
        let mut forcing = ForcingSequence::new(self.options.forcing);
        let mut limit = self.options.max_iterations;
        self.record(run, start_record(here))?;

        loop {
            if let Some(convergence) = criteria.converged(here) {
                return Ok(convergence);
            }
            if run.work.iterations >= limit {
                // The last step may owe its failure to a stale tangent: full Newton gets its own chance.
                if self.options.tangent == TangentPolicy::Full || problem.constant_tangent().is_some() {
                    return Err(NewtonCause::IterationLimit { iterations: run.work.iterations });
                }
                if !self.tangent.escalate(TangentCause::IterationLimit) {
                    return Err(NewtonCause::IterationLimit { iterations: run.work.iterations });
                }
                limit += self.options.max_iterations;
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
                return self.at_precision(criteria.is_small(here), problem, y, run);
            }

            let found = match self.globalise(problem, y, here, linear, run) {
                Ok(found) => found,
                Err(blocked) if self.tangent.is_stale() => {
                    self.retry(run, cause_of(&blocked));
                    continue;
                }
                Err(Blocked::Domain(error)) => return Err(NewtonCause::Domain { error, at_start: false }),
                Err(Blocked::NoDecrease { .. }) if criteria.is_noise(here) => {
                    return self.at_precision(true, problem, y, run);
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
                return Ok(Convergence::PrecisionLimit);
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

    fn begin(&mut self, problem: &dyn NonlinearProblem) {
        self.tangent.begin_solve(problem.unknowns(), problem.constant_tangent());
        if let Some(quasi) = &mut self.quasi {
            quasi.restart();
        }
        if let Globalisation::TrustRegion { initial_radius } = self.options.globalisation {
            self.trust.begin_solve(initial_radius);
        }
    }

    /// Linearises and factors if the policy wants it, and says why it did.
    fn prepare_tangent(
        &mut self,
        problem: &mut dyn NonlinearProblem,
        y: &[f64],
        run: &mut Run,
    ) -> Result<Option<TangentCause>, NewtonCause> {
        let due = self.tangent.due();
        if due.is_some() || self.tangent.must_linearise() {
            run.work.linearisations += 1;
            problem.linearise(y).map_err(|error| NewtonCause::Domain { error, at_start: false })?;
            self.tangent.linearised();
        }
        if let Some(cause) = due {
            run.work.factorisations.count(cause);
            let clock = Instant::now();
            let prepared = self.linear.prepare(problem.tangent());
            run.work.factorisation_seconds += clock.elapsed().as_secs_f64();
            prepared.map_err(NewtonCause::LinearSolve)?;
            self.tangent.renewed(problem.unknowns());
            if let Some(quasi) = &mut self.quasi {
                quasi.restart();
            }
        }
        Ok(due)
    }

    fn linear_tolerance(
        &self,
        problem: &dyn NonlinearProblem,
        forcing: &ForcingSequence,
        here: Sample,
        target: f64,
    ) -> f64 {
        let eta = forcing.next(here.norm, target);
        // A linear problem has nothing to gain from a second iteration.
        if problem.constant_tangent().is_some() { eta.min((0.1 * target / here.norm).max(1e-14)) } else { eta }
    }

    /// The direction `d = −B⁻¹ R`.
    fn direction(
        &mut self,
        problem: &dyn NonlinearProblem,
        eta: f64,
        run: &mut Run,
    ) -> Result<LinearReport, LinearError> {
        let Vectors { residual, direction, .. } = &mut self.vectors;
        let linear = &mut self.linear;
        let tangent = problem.tangent();
        let clock = Instant::now();
        let report = match &mut self.quasi {
            None => linear.solve(tangent, residual, direction, eta),
            Some(quasi) => quasi.solve(residual, direction, |b, x| linear.solve(tangent, b, x, eta)),
        };
        run.work.solve_seconds += clock.elapsed().as_secs_f64();
        run.work.linear_solves += 1;
        let report = report?;
        run.work.linear_iterations += report.iterations;
        if first_not_finite(direction).is_some() {
            return Err(LinearError::Breakdown { iterations: report.iterations, relative_residual: f64::NAN });
        }
        for d in direction.iter_mut() {
            *d = -*d;
        }
        Ok(report)
    }

    /// Finds a trial point and leaves it in the trial buffers.
    fn globalise(
        &mut self,
        problem: &mut dyn NonlinearProblem,
        y: &[f64],
        here: Sample,
        linear: LinearReport,
        run: &mut Run,
    ) -> Result<Found, Blocked> {
        let Vectors { residual, direction, trial, trial_residual, difference, .. } = &mut self.vectors;
        let limit = self.options.max_trials;
        if let Globalisation::TrustRegion { .. } = self.options.globalisation {
            let step = TrustRegionStep { y, here, residual, direction, trial, trial_residual, limit };
            let (trial, trials) = self.trust.step(problem, step, &mut run.work)?;
            run.work.line_search_steps += trials - 1;
            return Ok(Found { sample: trial.sample, length: trial.alpha, trials, merit: Merit::Residual });
        }
        let buffers = RayBuffers { trial, residual: trial_residual, difference };
        let accuracy = linear.relative_residual;
        let mut ray = Ray::new(problem, y, direction, buffers, &mut run.work, residual, here, accuracy);
        ray.limit_trials(limit);
        if self.options.merit == Merit::Potential && self.options.globalisation != Globalisation::None {
            ray.prefer_potential(residual);
        }
        let found = self.searcher.search(self.options.globalisation, &mut ray);
        let (trials, merit) = (ray.trials(), ray.merit());
        run.work.line_search_steps += trials.saturating_sub(1);
        found.map(|trial| Found { sample: trial.sample, length: trial.alpha, trials, merit })
    }

    /// Moves to the trial point and returns the norm of the step.
    fn accept(&mut self, y: &mut [f64], found: &Found) -> f64 {
        let Vectors { residual, direction, trial, trial_residual, difference, .. } = &mut self.vectors;
        for ((step, trial), y) in difference.iter_mut().zip(trial.iter()).zip(y.iter()) {
            *step = trial - y;
        }
        if let Some(quasi) = &mut self.quasi {
            quasi.observe(found.length, direction, residual, trial_residual);
        }
        y.copy_from_slice(trial);
        std::mem::swap(residual, trial_residual);
        norm(difference)
    }

    /// Gives up what a stale tangent led to.
    fn retry(&mut self, run: &mut Run, cause: TangentCause) {
        run.work.rejected_steps += 1;
        self.tangent.demand(cause);
    }

    /// Ends where no step can improve: converged if the residual is small against its summands.
    fn at_precision(
        &mut self,
        is_small: bool,
        problem: &mut dyn NonlinearProblem,
        y: &[f64],
        run: &mut Run,
    ) -> Result<Convergence, NewtonCause> {
        if !is_small {
            return Err(NewtonCause::Stagnation { iterations: 1 });
        }
        // Trials may have been evaluated since, and the problem is to be left at y.
        evaluate(problem, y, &mut self.vectors.residual, &mut run.work)
            .map_err(|error| NewtonCause::Domain { error, at_start: false })?;
        Ok(Convergence::PrecisionLimit)
    }

    fn record(&mut self, run: &mut Run, record: IterationRecord) -> Result<(), NewtonCause> {
        run.history.push(record);
        match self.monitor.as_mut().map(|monitor| monitor.point(&record)) {
            Some(ControlFlow::Break(())) => Err(NewtonCause::Stopped),
            _ => Ok(()),
        }
    }

    /// Restores `y` and collects the evidence.
    fn fail(
        &mut self,
        problem: &dyn NonlinearProblem,
        y: &mut [f64],
        run: &mut Run,
        cause: NewtonCause,
    ) -> (NewtonCause, Vec<super::report::WorstUnknown>) {
        run.work.failures = 1;
        if matches!(cause, NewtonCause::WrongLength { .. }) {
            return (cause, Vec::new());
        }
        y.copy_from_slice(&self.vectors.start);
        self.tangent.failed(matches!(cause, NewtonCause::LinearSolve(_)));
        let worst = if run.has_residual {
            NewtonFailure::worst_of(&self.vectors.residual, |unknown| problem.describe(unknown))
        } else {
            Vec::new()
        };
        (cause, worst)
    }
}

fn start_record(here: Sample) -> IterationRecord {
    IterationRecord {
        iteration: 0,
        residual: here.norm,
        relative: 1.0,
        scale: here.scale,
        contraction: 1.0,
        step: 0.0,
        step_length: 0.0,
        trials: 0,
        merit: Merit::Residual,
        tangent: None,
        forcing: 0.0,
        linear_residual: 0.0,
        linear_iterations: 0,
    }
}

fn cause_of(blocked: &Blocked) -> TangentCause {
    match blocked {
        Blocked::Domain(_) => TangentCause::Domain,
        Blocked::NoDecrease { .. } | Blocked::NeedsTransposed => TangentCause::LineSearch,
    }
}
