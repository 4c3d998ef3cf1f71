//! Nonlinear systems `R(y) = 0`. Time does not exist here.
//!
//! Newton's method is a product of independent choices:
//! tangent policy × linear solver × forcing × globalisation × criteria.

use crate::EvaluationError;
use crate::linear::Tangent;

/// A system of equations `R(y) = 0` with an analytic derivative.
pub trait NonlinearProblem {
    /// Number of equations and unknowns.
    fn unknowns(&self) -> usize;

    /// Writes `R(y)` and returns the *scale* of its summands: a norm of the same kind as `‖R‖` of the
    /// terms before they cancel. A residual below about 1e-15 × scale is rounding noise.
    ///
    /// # Errors
    /// [`EvaluationError`] if `y` is outside the domain of the equations or gives values that are not
    /// finite; `out` is then unspecified.
    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<f64, EvaluationError>;

    /// Freezes the derivative at `y`; [`tangent`](Self::tangent) is that derivative until the next call.
    ///
    /// # Errors
    /// As [`residual`](Self::residual).
    fn linearise(&mut self, y: &[f64]) -> Result<(), EvaluationError>;

    /// The derivative at the point of the last [`linearise`](Self::linearise).
    fn tangent(&self) -> &dyn Tangent;

    /// `Some(key)` if the equations are linear: every point, and every problem that answers the same
    /// key, has the same tangent to the last bit, so a factor can be kept for ever.
    fn constant_tangent(&self) -> Option<u64> {
        None
    }

    /// A potential `Φ` with `R = ∇Φ`, where the equations have one.
    fn potential(&mut self, y: &[f64]) -> Option<Result<f64, EvaluationError>> {
        let _ = y;
        None
    }

    /// An unknown in words that the user understands ("velocity x of the point at (0.5, 0.25)").
    fn describe(&self, unknown: usize) -> String {
        format!("unknown {unknown}")
    }
}
