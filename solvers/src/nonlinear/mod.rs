//! Nonlinear systems `R(y) = 0`. Time does not exist here.
//!
//! Newton's method is a product of independent choices, each an enum or a trait with one file:
//!
//! | choice | type | what it decides |
//! |---|---|---|
//! | tangent policy | [`TangentPolicy`] | when the derivative is linearised and factored again |
//! | linear solve | [`LinearSolver`](crate::linear::LinearSolver) | how `J d = −R` is solved |
//! | forcing | [`Forcing`] | how accurately |
//! | globalisation | [`Globalisation`], [`Merit`] | what is done about steps that are too long |
//! | criteria | tolerances of [`NewtonOptions`] | converged, stagnating, diverging |
//! | monitor | [`NewtonMonitor`] | who watches, and may stop it |
//!
//! Rules that hold for every combination:
//!
//! - Only a residual converges. A small step is no evidence: a rejected or shortened step is small too.
//! - A trial point where the equations cannot be evaluated means that the step was too long.
//! - A failure with a stale tangent renews it; only a failure with a fresh tangent is one.
//! - The residual is evaluated before any tangent work; a converged start costs one evaluation.
//! - On success the problem's last residual evaluation was at the solution; on failure the unknowns
//!   have the bits they had before.
//!
//! Not here: bounds and inequalities, continuation, preconditioned nonlinear iterations.

mod criteria;
mod final_corrections;
mod forcing;
mod line_search;
mod memory;
mod monitor;
mod newton;
mod newton_parts;
mod options;
mod quasi_newton;
mod ray;
mod report;
mod sample;
mod tangent_policy;
mod tangent_state;
mod trust_region;

pub use criteria::Convergence;
pub use forcing::Forcing;
pub use monitor::NewtonMonitor;
pub use newton::NewtonSolver;
pub use options::{Globalisation, Merit, NewtonOptions, NewtonOptionsError};
pub use report::{IterationRecord, NewtonCause, NewtonFailure, NewtonReport, NewtonTotals, WorstUnknown};
pub use tangent_policy::{SecantUpdate, TangentCause, TangentCounts, TangentPolicy};

use std::sync::Arc;

use crate::EvaluationError;
use crate::linear::Tangent;
use crate::snapshot::{RestoreError, Snapshot};

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
    /// Also called once per solve where a kept factor makes it seem unnecessary, because a problem with a
    /// [constant tangent](Self::constant_tangent) may be another object than the one that was factored: a
    /// problem that knows better returns at once.
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

    /// Where the derivative was [frozen](Self::linearise), as plain numbers that let
    /// [`linearise_again`](Self::linearise_again) freeze it once more with the same bits. `None` from a problem that does
    /// not keep that in mind: what a solver made of its derivatives is then lost at a restart.
    fn linearisation_point(&self) -> Option<Arc<Snapshot>> {
        None
    }

    /// Freezes the derivative where it was frozen then.
    ///
    /// # Errors
    /// [`RestoreError`] if the point is not one of this problem.
    fn linearise_again(&mut self, point: &Snapshot) -> Result<(), RestoreError> {
        let _ = point;
        Err(crate::snapshot::unfit("point", "a point of this problem"))
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
