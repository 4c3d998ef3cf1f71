//! What a solve did: history, counts, and on failure the cause and the worst unknowns.

use std::fmt;

use super::criteria::Convergence;
use super::options::{Merit, NewtonOptionsError};
use super::tangent_policy::{TangentCause, TangentCounts};
use crate::EvaluationError;
use crate::linear::LinearError;

/// One point of the history. Record 0 is the start; record `k` is the point after iteration `k`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationRecord {
    /// Number of the iteration.
    pub iteration: usize,
    /// `‖R‖`.
    pub residual: f64,
    /// `‖R‖ / ‖R₀‖`.
    pub relative: f64,
    /// Scale of the summands of `R`.
    pub scale: f64,
    /// Measured contraction `‖R‖ / ‖R₋‖` (1 at the start).
    pub contraction: f64,
    /// Norm of the step taken.
    pub step: f64,
    /// Length of the step relative to the direction that was computed.
    pub step_length: f64,
    /// Trial points of the globalisation, the accepted one included.
    pub trials: usize,
    /// What the line search decreased.
    pub merit: Merit,
    /// Why the tangent was renewed for this step; `None` if it was kept.
    pub tangent: Option<TangentCause>,
    /// Tolerance `η` asked of the linear solve.
    pub forcing: f64,
    /// Relative residual reached by the linear solve.
    pub linear_residual: f64,
    /// Iterations of the linear solve.
    pub linear_iterations: usize,
}

/// Work counted over one solve or over the life of a solver.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NewtonTotals {
    /// Solves begun.
    pub solves: usize,
    /// Solves that failed.
    pub failures: usize,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations of the residual.
    pub residual_evaluations: usize,
    /// Linearisations.
    pub linearisations: usize,
    /// Factorisations by cause.
    pub factorisations: TangentCounts,
    /// Linear systems solved.
    pub linear_solves: usize,
    /// Iterations inside the linear solves.
    pub linear_iterations: usize,
    /// Trial points of the globalisation beyond the first of every iteration.
    pub line_search_steps: usize,
    /// Attempts with a stale tangent that were given up for a fresh one.
    pub rejected_steps: usize,
    /// Seconds in factorisations (or in building preconditioners).
    pub factorisation_seconds: f64,
    /// Seconds in linear solves.
    pub solve_seconds: f64,
}

impl NewtonTotals {
    pub(super) fn add(&mut self, other: &Self) {
        self.solves += other.solves;
        self.failures += other.failures;
        self.iterations += other.iterations;
        self.residual_evaluations += other.residual_evaluations;
        self.linearisations += other.linearisations;
        self.factorisations.add(&other.factorisations);
        self.linear_solves += other.linear_solves;
        self.linear_iterations += other.linear_iterations;
        self.line_search_steps += other.line_search_steps;
        self.rejected_steps += other.rejected_steps;
        self.factorisation_seconds += other.factorisation_seconds;
        self.solve_seconds += other.solve_seconds;
    }
}

/// A converged solve.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonReport {
    /// Accepted steps.
    pub iterations: usize,
    /// Why it counts as converged.
    pub convergence: Convergence,
    /// Every point, the start included.
    pub history: Vec<IterationRecord>,
    /// What it cost.
    pub work: NewtonTotals,
}

impl NewtonReport {
    /// `‖R‖` at the solution.
    pub fn residual(&self) -> f64 {
        self.history.last().map_or(0.0, |record| record.residual)
    }

    /// Contraction `‖R₊‖ / ‖R‖` of the last iteration, if there was one.
    pub fn contraction(&self) -> Option<f64> {
        self.history.last().filter(|record| record.iteration > 0).map(|record| record.contraction)
    }

    /// Order of convergence seen in the last three residuals, `ln(r₂/r₁) / ln(r₁/r₀)`.
    pub fn observed_order(&self) -> Option<f64> {
        observed_order(&self.history)
    }
}

/// Order of convergence seen in the last three residuals, if they decrease.
pub(super) fn observed_order(history: &[IterationRecord]) -> Option<f64> {
    let [.., a, b, c] = history else { return None };
    let decreasing = a.residual > b.residual && b.residual > c.residual && c.residual > 0.0;
    decreasing.then(|| (c.residual / b.residual).ln() / (b.residual / a.residual).ln())
}

/// Why a solve failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NewtonCause {
    /// The iteration limit was reached with fresh tangents.
    #[error("the limit of {iterations} iterations was reached")]
    IterationLimit {
        /// Iterations done.
        iterations: usize,
    },
    /// The residual no longer falls, and is not at its rounding noise.
    #[error("the residual stagnates: no progress in the last {iterations} iterations")]
    Stagnation {
        /// Iterations without progress.
        iterations: usize,
    },
    /// The residual has grown beyond all bounds.
    #[error("the iteration diverges: the residual is {growth:.1e} times the first")]
    Divergence {
        /// `‖R‖ / ‖R₀‖`.
        growth: f64,
    },
    /// No step along the direction (or in the trust region) decreases the merit function enough.
    #[error("no acceptable step: {trials} trial points down to {smallest:.1e} of the step decrease nothing")]
    LineSearch {
        /// Trial points.
        trials: usize,
        /// Shortest relative step tried.
        smallest: f64,
    },
    /// The linear solve failed with a fresh factor.
    #[error("the linear solve failed: {0}")]
    LinearSolve(LinearError),
    /// The equations cannot be evaluated at the start, or no shortening of a step comes to a point where
    /// they can, or they have no tangent at a point where they can.
    #[error("{}: {error}", if *.at_start { "the start is not admissible" } else { "no step, however short, is admissible" })]
    Domain {
        /// What failed where.
        error: EvaluationError,
        /// Whether it was the start: another start may help.
        at_start: bool,
    },
    /// The vector of unknowns has the wrong length.
    #[error("vector of length {found} where the problem has {expected} unknowns")]
    WrongLength {
        /// Unknowns of the problem.
        expected: usize,
        /// Length given.
        found: usize,
    },
    /// An option makes no sense.
    #[error("{0}")]
    Options(#[from] NewtonOptionsError),
    /// The problem cannot do what the options ask for.
    #[error("{reason}")]
    Unsupported {
        /// What is missing, and what to choose instead.
        reason: String,
    },
    /// The monitor asked to stop.
    #[error("stopped by the monitor")]
    Stopped,
}

impl NewtonCause {
    /// The kind of cause in words, without figures.
    pub fn name(&self) -> &'static str {
        match self {
            Self::IterationLimit { .. } => "iteration limit",
            Self::Stagnation { .. } => "stagnation",
            Self::Divergence { .. } => "divergence",
            Self::LineSearch { .. } => "line search",
            Self::LinearSolve(_) => "linear solve",
            Self::Domain { .. } => "domain",
            Self::WrongLength { .. } => "wrong length",
            Self::Options(_) => "options",
            Self::Unsupported { .. } => "unsupported",
            Self::Stopped => "stopped",
        }
    }
}

/// An unknown whose equation is far from satisfied.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstUnknown {
    /// Index of the equation and unknown.
    pub index: usize,
    /// Its residual.
    pub residual: f64,
    /// The unknown in words.
    pub description: String,
}

/// A failed solve; the unknowns are as they were before it.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonFailure {
    /// Why.
    pub cause: NewtonCause,
    /// Every point, the start included.
    pub history: Vec<IterationRecord>,
    /// The largest residuals at the last point, largest first.
    pub worst: Vec<WorstUnknown>,
    /// What it cost.
    pub work: NewtonTotals,
}

/// Unknowns listed in a failure.
const WORST: usize = 8;

impl NewtonFailure {
    /// The largest entries of a residual, largest first; ties in the order of the unknowns.
    pub(super) fn worst_of(residual: &[f64], describe: impl Fn(usize) -> String) -> Vec<WorstUnknown> {
        let mut indices: Vec<usize> = (0..residual.len()).filter(|&i| residual[i] != 0.0).collect();
        indices.sort_by(|&a, &b| residual[b].abs().total_cmp(&residual[a].abs()).then(a.cmp(&b)));
        indices.truncate(WORST);
        let worst = |index| WorstUnknown { index, residual: residual[index], description: describe(index) };
        indices.into_iter().map(worst).collect()
    }
}

impl fmt::Display for NewtonFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Newton's method failed: {}.", self.cause)?;
        if let Some(last) = self.history.last() {
            write!(
                f,
                " After {} iterations the residual norm is {:.3e}, which is {:.1e} of the first",
                last.iteration, last.residual, last.relative
            )?;
            if last.scale > 0.0 {
                write!(f, " and {:.1e} of the size of its terms", last.residual / last.scale)?;
            }
            write!(f, ".")?;
        }
        let mut separator = " The largest residuals are at ";
        for worst in self.worst.iter().take(3) {
            write!(f, "{separator}{} ({:.3e})", worst.description, worst.residual)?;
            separator = ", ";
        }
        if self.worst.is_empty() { Ok(()) } else { write!(f, ".") }
    }
}

impl std::error::Error for NewtonFailure {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.cause {
            NewtonCause::LinearSolve(error) => Some(error),
            NewtonCause::Domain { error, .. } => Some(error),
            NewtonCause::Options(error) => Some(error),
            _ => None,
        }
    }
}
