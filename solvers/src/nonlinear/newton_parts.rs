//! The parts that the loop of [`NewtonSolver`] is made of.

use std::ops::ControlFlow;
use std::time::Instant;

use super::NonlinearProblem;
use super::criteria::Convergence;
use super::forcing::ForcingSequence;
use super::line_search::Blocked;
use super::newton::NewtonSolver;
use super::options::{Globalisation, Merit};
use super::ray::{Ray, RayBuffers};
use super::report::{IterationRecord, NewtonCause, NewtonFailure, NewtonTotals, WorstUnknown};
use super::sample::{Sample, evaluate};
use super::tangent_policy::TangentCause;
use super::trust_region::TrustRegionStep;
use crate::linear::{LinearError, LinearReport};
use crate::vector::{first_not_finite, norm};

/// Work space, kept so that only the first solve allocates.
#[derive(Debug, Default)]
pub(super) struct Vectors {
    pub start: Vec<f64>,
    pub residual: Vec<f64>,
    pub direction: Vec<f64>,
    pub trial: Vec<f64>,
    pub trial_residual: Vec<f64>,
    pub difference: Vec<f64>,
}

impl Vectors {
    pub fn resize(&mut self, unknowns: usize) {
        let Self { start, residual, direction, trial, trial_residual, difference } = self;
        for vector in [start, residual, direction, trial, trial_residual, difference] {
            vector.resize(unknowns, 0.0);
        }
    }
}

/// What one solve has done so far.
#[derive(Debug, Default)]
pub(super) struct Run {
    pub history: Vec<IterationRecord>,
    pub work: NewtonTotals,
    /// Whether the residual buffer belongs to the last point of the history.
    pub has_residual: bool,
    /// Whether the problem's own last residual evaluation was at that point.
    pub problem_is_here: bool,
}

/// A trial point that the globalisation found acceptable; it is in the trial buffers.
pub(super) struct Found {
    pub sample: Sample,
    pub length: f64,
    pub trials: usize,
    pub merit: Merit,
    pub problem_is_here: bool,
}

impl NewtonSolver {
    /// Starts the bookkeeping of a solve.
    pub(super) fn begin(&mut self, problem: &dyn NonlinearProblem) {
        self.tangent.begin_solve(problem.unknowns(), problem.constant_tangent());
        if let Some(quasi) = &mut self.quasi {
            quasi.restart();
        }
        if let Globalisation::TrustRegion { initial_radius } = self.options.globalisation {
            self.trust.begin_solve(initial_radius);
        }
    }

    /// Linearises and factors if the policy wants it, and says why it did.
    pub(super) fn prepare_tangent(
        &mut self,
        problem: &mut dyn NonlinearProblem,
        y: &[f64],
        run: &mut Run,
    ) -> Result<Option<TangentCause>, NewtonCause> {
        let due = self.tangent.due();
        let before = if due.is_some() { problem.linearisation_point() } else { None };
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
            self.mind_older_operator(before);
            prepared.map_err(NewtonCause::LinearSolve)?;
            self.tangent.renewed(problem.unknowns());
            if let Some(quasi) = &mut self.quasi {
                quasi.restart();
            }
        }
        Ok(due)
    }

    /// The forcing term `η` of this iteration.
    pub(super) fn linear_tolerance(
        &self,
        problem: &dyn NonlinearProblem,
        forcing: &ForcingSequence,
        here: Sample,
        target: f64,
    ) -> f64 {
        let eta = forcing.next(here.norm, target);
        // A linear problem has nothing to gain from a second iteration.
        if problem.constant_tangent().is_some() { eta.min((0.1 * target / here.norm).max(1e-12)) } else { eta }
    }

    /// The direction `d = −B⁻¹ R`.
    pub(super) fn direction(
        &mut self,
        problem: &dyn NonlinearProblem,
        eta: f64,
        run: &mut Run,
    ) -> Result<LinearReport, LinearError> {
        let Vectors { residual, direction, .. } = &mut self.vectors;
        let linear = &mut self.linear;
        let tangent = problem.tangent();
        let (clock, late) = (Instant::now(), linear.late_preparation());
        // The next residual of linear equations checks the direction as well as a product would; once with every factor
        // the solver has looked itself.
        let unchecked = run.work.iterations == 0 && self.tangent.is_proven() && self.quasi.is_none();
        let unchecked = if unchecked { linear.solve_unchecked(residual, direction) } else { None };
        let mut solve = |b: &[f64], x: &mut [f64]| usable(linear.solve(tangent, b, x, eta));
        let report = match (unchecked, &mut self.quasi) {
            (Some(outcome), _) => outcome.map(|()| LinearReport { iterations: 0, relative_residual: eta }),
            (None, None) => solve(residual, direction),
            (None, Some(quasi)) => quasi.solve(residual, direction, solve),
        };
        if !self.linear.keeps_older_operator() {
            // It has taken the present operator after all.
            self.older_point = None;
        }
        let late = (self.linear.late_preparation() - late).as_secs_f64();
        run.work.factorisation_seconds += late;
        run.work.solve_seconds += clock.elapsed().as_secs_f64() - late;
        run.work.linear_solves += 1;
        let report = report?;
        self.tangent.solved();
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
    pub(super) fn globalise(
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
            let (sample, length, merit) = (trial.sample, trial.alpha, Merit::Residual);
            return Ok(Found { sample, length, trials, merit, problem_is_here: true });
        }
        let wants_potential =
            self.options.merit == Merit::Potential && self.options.globalisation != Globalisation::None;
        for with_potential in [true, false] {
            let buffers = RayBuffers { trial, residual: trial_residual, difference };
            let accuracy = linear.relative_residual;
            let mut ray = Ray::new(problem, y, direction, buffers, &mut run.work, here, accuracy);
            ray.limit_trials(limit);
            if with_potential && wants_potential {
                ray.prefer_potential(residual);
            }
            let found = self.searcher.search(self.options.globalisation, &mut ray);
            let (trials, merit) = (ray.trials(), ray.merit());
            run.work.line_search_steps += trials.saturating_sub(1);
            match found {
                // The decrease may have drowned in the rounding of the potential: the residual can tell.
                Err(Blocked::NoDecrease { .. }) if merit == Merit::Potential => {}
                Err(blocked) => return Err(blocked),
                Ok((trial, problem_is_here)) => {
                    return Ok(Found { sample: trial.sample, length: trial.alpha, trials, merit, problem_is_here });
                }
            }
        }
        Err(Blocked::NoDecrease { trials: limit, smallest: 0.0 })
    }

    /// Moves to the trial point and returns the norm of the step.
    pub(super) fn accept(&mut self, y: &mut [f64], found: &Found) -> f64 {
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
    pub(super) fn retry(&mut self, run: &mut Run, cause: TangentCause) {
        run.work.rejected_steps += 1;
        self.tangent.demand(cause);
    }

    /// Leaves the problem at the solution: it may have been evaluated at other trial points since.
    pub(super) fn finish(
        &mut self,
        convergence: Convergence,
        problem: &mut dyn NonlinearProblem,
        y: &[f64],
        run: &mut Run,
    ) -> Result<Convergence, NewtonCause> {
        if !run.problem_is_here {
            evaluate(problem, y, &mut self.vectors.residual, &mut run.work)
                .map_err(|error| NewtonCause::Domain { error, at_start: false })?;
        }
        Ok(convergence)
    }

    /// Adds a point to the history and shows it to the monitor.
    pub(super) fn record(&mut self, run: &mut Run, record: IterationRecord) -> Result<(), NewtonCause> {
        run.history.push(record);
        match self.monitor.as_mut().map(|monitor| monitor.point(&record)) {
            Some(ControlFlow::Break(())) => Err(NewtonCause::Stopped),
            _ => Ok(()),
        }
    }

    /// Restores `y` and collects the evidence.
    pub(super) fn fail(
        &mut self,
        problem: &dyn NonlinearProblem,
        y: &mut [f64],
        run: &mut Run,
        cause: NewtonCause,
    ) -> (NewtonCause, Vec<WorstUnknown>) {
        run.work.failures = 1;
        if matches!(cause, NewtonCause::WrongLength { .. }) {
            return (cause, Vec::new());
        }
        y.copy_from_slice(&self.vectors.start);
        // A start that cannot be evaluated says nothing against the factor.
        if !matches!(cause, NewtonCause::Domain { at_start: true, .. }) {
            self.tangent.failed(matches!(cause, NewtonCause::LinearSolve(_)));
        }
        let worst = if run.has_residual {
            NewtonFailure::worst_of(&self.vectors.residual, |unknown| problem.describe(unknown))
        } else {
            Vec::new()
        };
        (cause, worst)
    }
}

/// The history begins with the start.
pub(super) fn start_record(here: Sample) -> IterationRecord {
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

/// Largest relative residual of a direct solve with which an iteration goes on.
const USABLE: f64 = 1e-4;

/// Of a matrix of condition κ no arithmetic gets a relative residual below ε κ, and tangents of slender bodies are that
/// ill-conditioned. A direct solve that says so has still brought the best direction there is, and the iteration gains
/// four digits from it; its own criteria decide the rest.
fn usable(outcome: Result<LinearReport, LinearError>) -> Result<LinearReport, LinearError> {
    match outcome {
        Err(LinearError::Inaccurate { relative_residual }) if relative_residual <= USABLE => {
            Ok(LinearReport { iterations: 0, relative_residual })
        }
        outcome => outcome,
    }
}
