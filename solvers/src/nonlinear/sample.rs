//! One checked evaluation of the residual.

use super::NonlinearProblem;
use super::report::NewtonTotals;
use crate::EvaluationError;
use crate::vector::{first_not_finite, norm};

/// The residual at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// `‖R‖`.
    pub norm: f64,
    /// Scale of the summands of `R`.
    pub scale: f64,
    /// `Φ`, where it has been asked for.
    pub potential: Option<f64>,
}

/// Evaluates and counts; a value that is not finite is an error even if the problem did not notice.
pub(super) fn evaluate(
    problem: &mut dyn NonlinearProblem,
    y: &[f64],
    out: &mut [f64],
    work: &mut NewtonTotals,
) -> Result<Sample, EvaluationError> {
    work.residual_evaluations += 1;
    let scale = problem.residual(y, out)?;
    let norm = norm(out);
    if !norm.is_finite() {
        let index = first_not_finite(out).unwrap_or(0);
        let value = out.get(index).copied().unwrap_or(f64::NAN);
        return Err(EvaluationError::not_finite("residual", index, value).at(problem.describe(index)));
    }
    if !scale.is_finite() {
        return Err(EvaluationError::not_finite("scale of the residual", 0, scale));
    }
    Ok(Sample { norm, scale, potential: None })
}
