//! The merit function along a direction, `φ(α) = φ(y + α d)`, with everything that a search on it needs
//! to stay cheap and safe: the last trial is remembered, evaluations are counted and bounded, and a
//! point outside the domain is an error, never a number.

use super::NonlinearProblem;
use super::options::Merit;
use super::report::NewtonTotals;
use super::sample::{Sample, evaluate};
use crate::EvaluationError;
use crate::vector::dot;

/// Sufficient decrease (Armijo): `φ(α) ≤ φ(0) + c α φ'(0)`. Dennis & Schnabel (1983), section 6.3.
pub(super) const SUFFICIENT_DECREASE: f64 = 1e-4;

/// A full step that brings the residual down to this fraction needs no search.
const CLEARLY_GOOD: f64 = 0.1;

/// Step of the directional difference of the residual, in lengths of the direction. Forward
/// differences of a function known to 1e-16 are best near 1e-8; a little more survives cancellation.
const DIFFERENCE: f64 = 1e-7;

/// Why a value along the ray is not available.
#[derive(Debug, Clone)]
pub(super) enum RayError {
    Evaluation(EvaluationError),
    /// All trials are spent.
    Exhausted,
}

/// A trial point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    pub alpha: f64,
    pub value: f64,
    pub sample: Sample,
}

/// Buffers that a ray borrows.
pub(super) struct RayBuffers<'a> {
    /// Holds `y + α d` of the last trial.
    pub trial: &'a mut [f64],
    /// Holds `R` of the last trial.
    pub residual: &'a mut [f64],
    /// Second residual of a directional difference.
    pub difference: &'a mut [f64],
}

/// The merit function along a direction.
pub(super) struct Ray<'a> {
    problem: &'a mut dyn NonlinearProblem,
    origin: &'a [f64],
    direction: &'a [f64],
    buffers: RayBuffers<'a>,
    work: &'a mut NewtonTotals,
    merit: Merit,
    value: f64,
    slope: f64,
    here: Sample,
    last: Option<Trial>,
    last_slope: Option<(f64, f64)>,
    /// The lowest trial with sufficient decrease.
    best: Option<Trial>,
    /// The point of the problem's own last residual evaluation.
    problem_is_at: Option<f64>,
    smallest: f64,
    /// Why the last trial could not be evaluated, if it could not.
    error: Option<EvaluationError>,
    trials: usize,
    calls: usize,
    limit: usize,
}

impl<'a> Ray<'a> {
    /// The ray from `origin` along `direction`, which solves the linear model to the relative residual
    /// `linear_residual`.
    #[allow(clippy::too_many_arguments, reason = "one private call site; a struct would only rename the arguments")]
    pub(super) fn new(
        problem: &'a mut dyn NonlinearProblem,
        origin: &'a [f64],
        direction: &'a [f64],
        buffers: RayBuffers<'a>,
        work: &'a mut NewtonTotals,
        here: Sample,
        linear_residual: f64,
    ) -> Self {
        Self {
            problem,
            origin,
            direction,
            buffers,
            work,
            merit: Merit::Residual,
            // Relative to ‖R(0)‖², so that nothing overflows.
            value: 0.5,
            // (½‖R‖²)' = R · J d = −‖R‖² + R · (R + J d) ≤ −(1 − η) ‖R‖².
            slope: -(1.0 - linear_residual.clamp(0.0, 0.999)),
            here,
            last: None,
            last_slope: None,
            best: None,
            problem_is_at: None,
            smallest: f64::INFINITY,
            error: None,
            trials: 0,
            calls: 0,
            limit: usize::MAX,
        }
    }

    /// At most so many trials.
    pub(super) fn limit_trials(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Decreases the potential instead of the residual, if there is one, the direction descends on it,
    /// and the expected decrease is above its rounding.
    pub(super) fn prefer_potential(&mut self, residual: &[f64]) {
        let potential = match self.here.potential {
            Some(known) => known,
            None => match self.problem.potential(self.origin) {
                Some(Ok(value)) if value.is_finite() => value,
                _ => return,
            },
        };
        let slope = dot(residual, self.direction);
        if slope < -1e3 * f64::EPSILON * potential.abs() {
            self.merit = Merit::Potential;
            self.value = potential;
            self.slope = slope;
        }
    }

    pub(super) fn merit(&self) -> Merit {
        self.merit
    }

    /// `φ(0)`.
    pub(super) fn start_value(&self) -> f64 {
        self.value
    }

    /// `φ'(0)`.
    pub(super) fn start_slope(&self) -> f64 {
        self.slope
    }

    pub(super) fn trials(&self) -> usize {
        self.trials
    }

    pub(super) fn smallest(&self) -> f64 {
        self.smallest
    }

    /// Why the last trial could not be evaluated, if it could not.
    pub(super) fn take_error(&mut self) -> Option<EvaluationError> {
        self.error.take()
    }

    pub(super) fn best(&self) -> Option<Trial> {
        self.best
    }

    /// Whether a trial decreases the merit sufficiently.
    pub(super) fn is_sufficient(&self, trial: Trial) -> bool {
        trial.alpha > 0.0 && trial.value <= self.value + SUFFICIENT_DECREASE * trial.alpha * self.slope
    }

    /// Whether a trial is so good that looking at slopes would be waste.
    pub(super) fn is_clearly_good(&self, trial: Trial) -> bool {
        self.is_sufficient(trial) && trial.sample.norm <= CLEARLY_GOOD * self.here.norm
    }

    /// The trial at `alpha`.
    pub(super) fn at(&mut self, alpha: f64) -> Result<Trial, RayError> {
        // A search that asks for the same points for ever must come to an end as well.
        self.calls += 1;
        if self.calls > 8 * self.limit.min(1000) {
            return Err(RayError::Exhausted);
        }
        if alpha == 0.0 {
            return Ok(Trial { alpha, value: self.value, sample: self.here });
        }
        if let Some(last) = self.last
            && last.alpha == alpha
        {
            return Ok(last);
        }
        if self.trials >= self.limit {
            return Err(RayError::Exhausted);
        }
        self.trials += 1;
        self.smallest = self.smallest.min(alpha.abs());
        let trial = self.evaluate(alpha).map_err(|error| {
            self.error = Some(error.clone());
            RayError::Evaluation(error)
        })?;
        self.error = None;
        if self.is_sufficient(trial) && self.best.is_none_or(|best| trial.value < best.value) {
            self.best = Some(trial);
        }
        Ok(trial)
    }

    /// `φ'(α)`.
    pub(super) fn slope(&mut self, alpha: f64) -> Result<f64, RayError> {
        if alpha == 0.0 {
            return Ok(self.slope);
        }
        if let Some((at, slope)) = self.last_slope
            && at == alpha
        {
            return Ok(slope);
        }
        self.at(alpha)?;
        let slope = match self.merit {
            Merit::Potential => dot(self.buffers.residual, self.direction),
            Merit::Residual => self.residual_slope(alpha).map_err(RayError::Evaluation)?,
        };
        self.last_slope = Some((alpha, slope));
        Ok(slope)
    }

    /// Leaves the buffers at `alpha`; says whether the problem's own last evaluation was there as well.
    pub(super) fn settle(&mut self, alpha: f64) -> Result<(Trial, bool), EvaluationError> {
        let trial = match self.last {
            Some(last) if last.alpha == alpha => last,
            _ => self.evaluate(alpha)?,
        };
        Ok((trial, self.problem_is_at == Some(alpha)))
    }

    fn evaluate(&mut self, alpha: f64) -> Result<Trial, EvaluationError> {
        self.last = None;
        self.problem_is_at = None;
        place(self.origin, alpha, self.direction, self.buffers.trial);
        let potential = match self.merit {
            Merit::Residual => None,
            Merit::Potential => self.problem.potential(self.buffers.trial).transpose()?,
        };
        let mut sample = evaluate(self.problem, self.buffers.trial, self.buffers.residual, self.work)?;
        self.problem_is_at = Some(alpha);
        sample.potential = potential;
        let value = match (self.merit, potential) {
            (Merit::Residual, _) => 0.5 * (sample.norm / self.here.norm).powi(2),
            (Merit::Potential, Some(value)) if value.is_finite() => value,
            (Merit::Potential, value) => {
                return Err(EvaluationError::not_finite("potential", 0, value.unwrap_or(f64::NAN)));
            }
        };
        let trial = Trial { alpha, value, sample };
        self.last = Some(trial);
        Ok(trial)
    }

    /// `R(α) · (R(α + h) − R(α)) / h`; backward where forward leaves the domain. A difference and not
    /// the tangent, because linearising at trial points would spoil a tangent that is to be kept.
    fn residual_slope(&mut self, alpha: f64) -> Result<f64, EvaluationError> {
        self.problem_is_at = None;
        let mut step = DIFFERENCE;
        place(self.origin, alpha + step, self.direction, self.buffers.trial);
        let mut outcome = evaluate(self.problem, self.buffers.trial, self.buffers.difference, self.work);
        if outcome.is_err() {
            step = -step;
            place(self.origin, alpha + step, self.direction, self.buffers.trial);
            outcome = evaluate(self.problem, self.buffers.trial, self.buffers.difference, self.work);
        }
        place(self.origin, alpha, self.direction, self.buffers.trial);
        outcome?;
        let residual = &*self.buffers.residual;
        let change = dot(residual, self.buffers.difference) - dot(residual, residual);
        Ok(change / (self.here.norm * self.here.norm) / step)
    }
}

/// `out = y + α d`.
pub(super) fn place(y: &[f64], alpha: f64, d: &[f64], out: &mut [f64]) {
    for ((out, y), d) in out.iter_mut().zip(y).zip(d) {
        *out = y + alpha * d;
    }
}
