//! Why a function could not be evaluated at a trial point.

use std::fmt;

/// Kind of failure of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EvaluationFailure {
    /// The trial point lies outside the set where the equations are defined (a negative volume, say).
    /// A shorter step may help.
    OutsideDomain,
    /// A value that should be finite is not.
    NotFinite,
}

/// A trial point at which the equations cannot be evaluated: what, where, and the offending value.
///
/// Always recoverable by a smaller step; never expressed as NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationError {
    /// What kind of failure.
    pub failure: EvaluationFailure,
    /// The quantity that failed, in words (`"volume ratio J"`).
    pub quantity: String,
    /// Index of the place where it failed, in the caller's own numbering.
    pub site: usize,
    /// The offending value (may be NaN or infinite).
    pub value: f64,
    /// The place in words that the user understands; empty if the index says it all.
    pub place: String,
}

impl EvaluationError {
    /// The trial point is outside the domain of the equations.
    pub fn outside_domain(quantity: impl Into<String>, site: usize, value: f64) -> Self {
        Self { failure: EvaluationFailure::OutsideDomain, quantity: quantity.into(), site, value, place: String::new() }
    }

    /// A value is NaN or infinite.
    pub fn not_finite(quantity: impl Into<String>, site: usize, value: f64) -> Self {
        Self { failure: EvaluationFailure::NotFinite, ..Self::outside_domain(quantity, site, value) }
    }

    /// The same error with the place described in words.
    #[must_use]
    pub fn at(mut self, place: impl Into<String>) -> Self {
        self.place = place.into();
        self
    }
}

impl fmt::Display for EvaluationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.failure {
            EvaluationFailure::OutsideDomain => {
                write!(f, "{} = {:e} is outside the domain of the equations", self.quantity, self.value)?;
            }
            EvaluationFailure::NotFinite => write!(f, "{} = {} is not finite", self.quantity, self.value)?,
        }
        if self.place.is_empty() { write!(f, " at index {}", self.site) } else { write!(f, " at {}", self.place) }
    }
}

impl std::error::Error for EvaluationError {}
