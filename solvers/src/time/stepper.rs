//! One accepted step after another: place, try, judge, retry; the state changes only on success.

use super::attempt::{Attempt, Counts, Estimate, Span, Tools};
use super::pace::{Accepted, Judged, Pace};
use super::report::{FailedTry, Rejections, Statistics, StepCause, StepFailure, StepReport, StepperError};
use super::{Retries, Scheme, StepControl, System, TimeState};
use crate::nonlinear::NewtonSolver;
use crate::vector::first_not_finite;

/// Integrates a [`System`] with one scheme and one rule for the step.
pub struct Stepper {
    scheme: Scheme,
    control: StepControl,
    retries: Retries,
    statistics: Statistics,
    tools: Tools,
    /// Copy of the state at the start of the step; its memory may be completed by the tries.
    begin: TimeState,
    /// Result of a try; changes places with the caller's state when it is accepted.
    end: TimeState,
    /// Result of the whole step and middle of the two half steps, for step doubling.
    full: TimeState,
    middle: TimeState,
}

/// A try of a step on the time axis.
#[derive(Debug, Clone, Copy)]
struct Placed {
    span: Span,
    remainder: f64,
    /// Shorter than asked, in order to land.
    truncated: bool,
}

impl Stepper {
    /// A stepper.
    ///
    /// # Errors
    /// [`StepperError`] if the scheme needs Newton's method and there is none, if the control does not
    /// suit the scheme, or if a parameter is out of range.
    pub fn new(scheme: Scheme, control: StepControl, newton: Option<NewtonSolver>) -> Result<Self, StepperError> {
        scheme.check()?;
        control.check()?;
        if scheme.is_implicit() && newton.is_none() {
            return Err(StepperError::NewtonMissing { scheme: scheme.name() });
        }
        if !scheme.is_implicit() && matches!(control, StepControl::Effort(_)) {
            return Err(StepperError::NoEffort { scheme: scheme.name() });
        }
        let newton = newton.filter(|_| scheme.is_implicit());
        Ok(Self {
            scheme,
            control,
            retries: Retries::default(),
            statistics: Statistics::default(),
            tools: Tools { newton, ..Tools::default() },
            begin: TimeState::default(),
            end: TimeState::default(),
            full: TimeState::default(),
            middle: TimeState::default(),
        })
    }

    /// The same stepper with another rule for what follows a failed try.
    ///
    /// # Errors
    /// [`StepperError`] if a parameter is out of range.
    pub fn with_retries(mut self, retries: Retries) -> Result<Self, StepperError> {
        retries.check()?;
        self.retries = retries;
        Ok(self)
    }

    /// The scheme.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// The rule for the step.
    pub fn control(&self) -> &StepControl {
        &self.control
    }

    /// Work since the stepper was built.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    pub(super) fn statistics_mut(&mut self) -> &mut Statistics {
        &mut self.statistics
    }

    /// Newton's method, for an implicit scheme.
    pub fn newton(&self) -> Option<&NewtonSolver> {
        self.tools.newton.as_ref()
    }

    /// Newton's method, to change or to forget what it keeps.
    pub fn newton_mut(&mut self) -> Option<&mut NewtonSolver> {
        self.tools.newton.as_mut()
    }

    /// One accepted step, not past `target`, and exactly onto it when it is within reach: if
    /// `|t + Δt − target| ≤ 1e-9 Δt` the step keeps its bits and the time becomes the target's.
    ///
    /// # Errors
    /// [`StepFailure`] with every try. The state is then bit-identical to what it was before.
    pub fn advance(
        &mut self,
        system: &mut dyn System,
        state: &mut TimeState,
        target: f64,
    ) -> Result<StepReport, Box<StepFailure>> {
        self.tools.counts = Counts::default();
        let mut tries = Vec::new();
        let outcome = self.accepted_step(system, state, target, &mut tries);
        let mut rejections = Rejections::default();
        let counts = std::mem::take(&mut self.tools.counts);
        for failed in &tries {
            rejections.count(&failed.cause);
        }
        let statistics = &mut self.statistics;
        statistics.rejected.add(&rejections);
        statistics.rate_evaluations += counts.rate_evaluations;
        statistics.partial_evaluations += counts.partial_evaluations;
        statistics.newton_iterations += counts.newton_iterations;
        match outcome {
            Some((step, error_estimate)) => {
                statistics.accepted += 1;
                statistics.smallest_step = statistics.smallest_step.min(step);
                statistics.largest_step = statistics.largest_step.max(step);
                Ok(StepReport {
                    time: state.time,
                    step,
                    newton_iterations: counts.newton_iterations,
                    rejected: rejections.total(),
                    rejections,
                    rate_evaluations: counts.rate_evaluations,
                    partial_evaluations: counts.partial_evaluations,
                    error_estimate,
                    stages: matches!(self.scheme, Scheme::Rkc(_)).then_some(self.tools.chebyshev.stages),
                    newton: counts.newton,
                    failed_solves: counts.failed_solves,
                    auxiliary_solves: counts.auxiliary_solves,
                    tries,
                })
            }
            None => {
                statistics.failed += 1;
                Err(Box::new(StepFailure { time: state.time, tries }))
            }
        }
    }

    /// The step; `None` after the last entry of `tries` proved final.
    fn accepted_step(
        &mut self,
        system: &mut dyn System,
        state: &mut TimeState,
        target: f64,
        tries: &mut Vec<FailedTry>,
    ) -> Option<(f64, Option<f64>)> {
        let mut pace = match self.begin_step(system, state, target) {
            Ok(pace) => pace,
            Err(cause) => {
                tries.push(FailedTry { step: target - state.time, cause });
                return None;
            }
        };
        loop {
            let placed = self.place(pace.step, target);
            let vanishing = placed.span.end <= self.begin.time;
            let tried = if vanishing { Err(StepCause::Vanishing) } else { self.attempt(system, placed.span) };
            let cause = match tried {
                Ok(judged) => {
                    self.accept(&pace, &placed, judged, !tries.is_empty());
                    std::mem::swap(state, &mut self.end);
                    return Some((placed.span.step, judged.map(|(error, _)| error)));
                }
                Err(cause) => cause,
            };
            if !matches!(cause, StepCause::ErrorTooLarge { .. }) {
                // What made the step fail may have made the operator stiffer, too.
                self.begin.memory.spectral_radius = 0.0;
                // The kept factor may come from a point of the failed iteration that means nothing.
                if let Some(newton) = &mut self.tools.newton {
                    newton.forget();
                }
            }
            let curable = cause.is_curable();
            let shorter = pace.shorten(&self.control, &self.retries, placed.span.step, &cause);
            tries.push(FailedTry { step: placed.span.step, cause });
            if !curable || !shorter || tries.len() >= self.retries.limit {
                return None;
            }
        }
    }

    /// Checks the state, copies it, and proposes a step.
    fn begin_step(&mut self, system: &mut dyn System, state: &TimeState, target: f64) -> Result<Pace, StepCause> {
        let n = system.len();
        if state.values.len() != n {
            return Err(StepCause::WrongLength { expected: n, found: state.values.len() });
        }
        if let StepControl::Adaptive(a) = &self.control
            && let Some(entries) = &a.absolute_entries
            && entries.len() != n
        {
            return Err(StepCause::WrongLength { expected: n, found: entries.len() });
        }
        if !(target.is_finite() && state.time.is_finite() && target > state.time) {
            return Err(StepCause::Target { target });
        }
        if let Some(index) = first_not_finite(&state.values) {
            return Err(StepCause::StartNotFinite { index, value: state.values[index] });
        }
        self.begin.copy_from(state);
        if !self.begin.memory_is_current() {
            let memory = &mut self.begin.memory;
            memory.forget_rates();
            memory.spectral_radius = 0.0;
            memory.time_remainder = 0.0;
        }
        let remaining = target - state.time;
        let order = self.scheme.order();
        Pace::propose(&self.control, system, &mut self.begin, &mut self.tools, order, remaining)
    }

    /// Puts a step on the time axis.
    fn place(&self, step: f64, target: f64) -> Placed {
        let time = self.begin.time;
        let carried = self.begin.memory.time_remainder;
        let remaining = (target - time) - carried;
        if (remaining - step).abs() <= 1e-9 * step {
            return Placed { span: Span { step, end: target }, remainder: 0.0, truncated: false };
        }
        if step > remaining {
            return Placed { span: Span { step: remaining, end: target }, remainder: 0.0, truncated: true };
        }
        // Two equal steps rather than a whole one and a sliver, where the step is not sacred.
        let sacred = matches!(self.control, StepControl::Fixed { .. });
        let (step, truncated) = if !sacred && remaining < 2.0 * step { (0.5 * remaining, true) } else { (step, false) };
        // Compensated summation: without it a million steps drift by a visible part of a step.
        let shift = step + carried;
        let end = time + shift;
        let done = end - time;
        let remainder = (time - (end - done)) + (shift - done);
        Placed { span: Span { step, end }, remainder, truncated }
    }

    /// One try, from `begin` to `end`.
    fn attempt(&mut self, system: &mut dyn System, span: Span) -> Result<Judged, StepCause> {
        let counts = &mut self.tools.counts;
        counts.newton.clear();
        counts.failed_solves.clear();
        counts.auxiliary_solves = 0;
        let Self { scheme, control, tools, begin, end, full, middle, .. } = self;
        let StepControl::Adaptive(adaptive) = control else {
            Attempt { system, tools, start: begin, end, span, wants_estimate: false }.run(*scheme)?;
            return Ok(None);
        };
        let estimate = Attempt { system, tools, start: begin, end, span, wants_estimate: true }.run(*scheme)?;
        let power = match estimate {
            Estimate::Embedded { power } => power,
            Estimate::None => {
                // Step doubling (Richardson): the two half steps are the result, and the distance to the
                // whole step is 2ᵖ − 1 times their error.
                std::mem::swap(full, end);
                let half = Span { step: 0.5 * span.step, end: begin.time + 0.5 * span.step };
                Attempt { system, tools, start: begin, end: middle, span: half, wants_estimate: true }.run(*scheme)?;
                let half = Span { step: half.step, end: span.end };
                Attempt { system, tools, start: middle, end, span: half, wants_estimate: true }.run(*scheme)?;
                let order = scheme.order() as i32;
                let divisor = 2.0_f64.powi(order) - 1.0;
                for ((e, fine), coarse) in tools.estimate.iter_mut().zip(&end.values).zip(&full.values) {
                    *e = (fine - coarse) / divisor;
                }
                f64::from(order + 1)
            }
        };
        let error = adaptive.norm(&tools.estimate, &begin.values, &end.values);
        // The comparison is false for NaN: an estimate that is no number is never accepted.
        if error <= 1.0 { Ok(Some((error, power))) } else { Err(StepCause::ErrorTooLarge { estimate: error, power }) }
    }

    /// Completes the memory of an accepted step.
    fn accept(&mut self, pace: &Pace, placed: &Placed, judged: Judged, after_failures: bool) {
        let counts = &self.tools.counts;
        let accepted = Accepted {
            step: placed.span.step,
            truncated: placed.truncated,
            judged,
            iterations: counts.newton.iter().map(|report| report.iterations).max().unwrap_or(0),
            after_failures,
        };
        let fingerprint = self.end.fingerprint();
        let memory = &mut self.end.memory;
        memory.control = pace.next(&self.control, &self.retries, self.begin.memory.control, &accepted);
        memory.time_remainder = placed.remainder;
        memory.fingerprint = fingerprint;
    }
}
