//! What a step did, and why it could not be done.

use std::fmt;

use crate::nonlinear::{NewtonFailure, NewtonReport};
use crate::{EvaluationError, EvaluationFailure};

/// An accepted step.
#[derive(Debug, Clone)]
pub struct StepReport {
    /// Time at its end.
    pub time: f64,
    /// Its length.
    pub step: f64,
    /// Newton iterations of its solves, and of failed tries.
    pub newton_iterations: usize,
    /// Failed or rejected tries before it.
    pub rejected: usize,
    /// The same by cause.
    pub rejections: Rejections,
    /// Calls of [`System::rate`](super::System::rate) and [`rate_part`](super::System::rate_part),
    /// failed tries included.
    pub rate_evaluations: usize,
    /// Those among them that asked only for the entries that are not velocities (cheap where these are
    /// the velocities themselves).
    pub partial_evaluations: usize,
    /// Weighted norm of the error estimate (adaptive control only).
    pub error_estimate: Option<f64>,
    /// Stages of a Runge–Kutta–Chebyshev step.
    pub stages: Option<usize>,
    /// Reports of its Newton solves, failed tries excluded.
    pub newton: Vec<NewtonReport>,
    /// Newton solves of the accepted try that failed from one start and succeeded from another.
    pub failed_solves: Vec<NewtonFailure>,
    /// Newton solves for shorter steps that only served to find a start for this one.
    pub auxiliary_solves: usize,
    /// The failed or rejected tries, in order.
    pub tries: Vec<FailedTry>,
}

/// Number of tries that failed or were rejected, by cause.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Rejections {
    /// A rate or a stage could not be evaluated.
    pub evaluation: usize,
    /// Newton's method failed.
    pub newton: usize,
    /// The result was not finite.
    pub not_finite: usize,
    /// The error estimate was above the tolerance.
    pub error: usize,
    /// Runge–Kutta–Chebyshev would have needed too many stages.
    pub stages: usize,
}

impl Rejections {
    /// All of them.
    pub fn total(&self) -> usize {
        self.evaluation + self.newton + self.not_finite + self.error + self.stages
    }

    /// Every cause that occurred, in words, with its count.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, usize)> + use<> {
        let Self { evaluation, newton, not_finite, error, stages } = *self;
        let all = [
            ("evaluation", evaluation),
            ("newton", newton),
            ("not finite", not_finite),
            ("error estimate", error),
            ("stages", stages),
        ];
        all.into_iter().filter(|(_, count)| *count > 0)
    }

    pub(super) fn count(&mut self, cause: &StepCause) {
        match cause {
            StepCause::Evaluation(e) if e.failure == EvaluationFailure::NotFinite => self.not_finite += 1,
            StepCause::Evaluation(_) => self.evaluation += 1,
            StepCause::Newton(_) => self.newton += 1,
            StepCause::NotFinite { .. } => self.not_finite += 1,
            StepCause::ErrorTooLarge { .. } => self.error += 1,
            StepCause::StageLimit { .. } => self.stages += 1,
            _ => {}
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.evaluation += other.evaluation;
        self.newton += other.newton;
        self.not_finite += other.not_finite;
        self.error += other.error;
        self.stages += other.stages;
    }
}

/// Work since the stepper was built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Accepted steps.
    pub accepted: usize,
    /// Failed or rejected tries.
    pub rejected: Rejections,
    /// Calls of `advance` that failed altogether.
    pub failed: usize,
    /// Calls of `rate` and `rate_part`.
    pub rate_evaluations: usize,
    /// Those among them for the entries that are not velocities.
    pub partial_evaluations: usize,
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Shortest accepted step; infinite before the first.
    pub smallest_step: f64,
    /// Longest accepted step; 0 before the first.
    pub largest_step: f64,
}

impl Default for Statistics {
    fn default() -> Self {
        Self {
            accepted: 0,
            rejected: Rejections::default(),
            failed: 0,
            rate_evaluations: 0,
            partial_evaluations: 0,
            newton_iterations: 0,
            smallest_step: f64::INFINITY,
            largest_step: 0.0,
        }
    }
}

/// Why one try of a step failed.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum StepCause {
    /// A rate or the solution of a stage could not be evaluated.
    #[error("{0}")]
    Evaluation(#[from] EvaluationError),
    /// Newton's method failed.
    #[error("{0}")]
    Newton(Box<NewtonFailure>),
    /// The result of the step is not finite.
    #[error("entry {index} of the result is {value}")]
    NotFinite {
        /// First bad entry.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The error estimate is above the tolerance.
    #[error("error estimate {estimate:e} times the tolerance")]
    ErrorTooLarge {
        /// Weighted norm of the estimate.
        estimate: f64,
        /// The power of Δt that it behaves as.
        power: f64,
    },
    /// Runge–Kutta–Chebyshev needs more stages than allowed.
    #[error("{needed} stages needed for stability, {limit} allowed")]
    StageLimit {
        /// Stages that the spectral radius asks for.
        needed: usize,
        /// Largest number allowed.
        limit: usize,
    },
    /// The step no longer changes the time.
    #[error("the step vanishes against the time")]
    Vanishing,
    /// The proposed step is not a positive number.
    #[error("the system proposes a step of {step}")]
    StepNotPositive {
        /// The proposal.
        step: f64,
    },
    /// The target is not a finite time after the present one.
    #[error("the target t = {target} is not after the present time")]
    Target {
        /// The target.
        target: f64,
    },
    /// State and system have different lengths.
    #[error("state of length {found} where the system has {expected}")]
    WrongLength {
        /// Length of the system.
        expected: usize,
        /// Length of the state, or of the tolerances per entry.
        found: usize,
    },
    /// The state is not finite before the step.
    #[error("entry {index} of the state is {value} before the step")]
    StartNotFinite {
        /// First bad entry.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The system lacks what the scheme needs.
    #[error("the scheme needs a system {0}")]
    Capability(&'static str),
}

impl StepCause {
    /// The kind of cause in words, without figures.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Evaluation(_) => "evaluation",
            Self::Newton(_) => "newton",
            Self::NotFinite { .. } => "not finite",
            Self::ErrorTooLarge { .. } => "error estimate",
            Self::StageLimit { .. } => "stages",
            Self::Vanishing => "vanishing",
            Self::StepNotPositive { .. } => "step not positive",
            Self::Target { .. } => "target",
            Self::WrongLength { .. } => "wrong length",
            Self::StartNotFinite { .. } => "start not finite",
            Self::Capability(_) => "capability",
        }
    }

    /// Whether a shorter step may help.
    pub fn is_curable(&self) -> bool {
        match self {
            Self::Newton(failure) => super::stage::is_curable(failure),
            Self::Evaluation(_) | Self::NotFinite { .. } | Self::ErrorTooLarge { .. } | Self::StageLimit { .. } => true,
            _ => false,
        }
    }
}

/// One failed try of a step.
#[derive(Debug, Clone)]
pub struct FailedTry {
    /// Length tried.
    pub step: f64,
    /// Why it failed.
    pub cause: StepCause,
}

/// A step that could not be done, with every try.
#[derive(Debug, Clone)]
pub struct StepFailure {
    /// Time from which it was tried.
    pub time: f64,
    /// The tries, in order; never empty.
    pub tries: Vec<FailedTry>,
}

impl StepFailure {
    /// The cause of the last try.
    pub fn cause(&self) -> Option<&StepCause> {
        self.tries.last().map(|last| &last.cause)
    }
}

impl fmt::Display for StepFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(last) = self.tries.last() else { return write!(f, "step from t = {} failed", self.time) };
        if self.tries.len() == 1 {
            return write!(f, "step from t = {} with Δt = {:e} failed: {}", self.time, last.step, last.cause);
        }
        let (time, step, tries) = (self.time, last.step, self.tries.len());
        write!(f, "step from t = {time} failed down to Δt = {step:e} ({tries} tries): {}", last.cause)
    }
}

impl std::error::Error for StepFailure {}

/// Why a stepper cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepperError {
    /// An implicit scheme without Newton's method.
    #[error("{scheme} is implicit and needs a Newton solver")]
    NewtonMissing {
        /// The scheme.
        scheme: &'static str,
    },
    /// Control by Newton effort with an explicit scheme.
    #[error("{scheme} is explicit: its step cannot be controlled by Newton effort")]
    NoEffort {
        /// The scheme.
        scheme: &'static str,
    },
    /// A parameter is out of range.
    #[error("{name} = {value} where {expected} is expected")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
}
