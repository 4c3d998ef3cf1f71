//! What all iterations share: the operator as an action, an approximate inverse, limits and outcome.

use std::sync::Arc;

use super::{LinearCounts, LinearError, OperatorAge, SparsePattern, Tangent};
use crate::snapshot::{RestoreError, Snapshot};
use crate::vector::norm;

/// `out = A v`.
pub(super) type Action<'a> = dyn Fn(&[f64], &mut [f64]) + 'a;

/// `M⁻¹ ≈ A⁻¹`: a preconditioner or a factor, fresh or stale.
pub(super) trait ApproximateInverse: Send {
    /// Name in words; empty for the identity.
    fn name(&self) -> String;

    /// Takes the operator at its present values.
    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError>;

    /// `z = M⁻¹ r`. Only after a successful preparation.
    fn apply(&mut self, r: &[f64], z: &mut [f64]);

    /// The same for inverses that use products with the operator.
    fn apply_within(&mut self, action: &Action<'_>, r: &[f64], z: &mut [f64]) {
        let _ = action;
        self.apply(r, z);
    }

    /// Stored entries.
    fn fill(&self) -> usize;

    /// As [`keeps_older_operator`](super::LinearSolver::keeps_older_operator).
    fn keeps_older_operator(&self) -> bool {
        false
    }

    /// As [`save`](super::LinearSolver::save).
    fn save(&self) -> Snapshot {
        Snapshot::new()
    }

    /// As [`restore`](super::LinearSolver::restore); the counts are the caller's to put right.
    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        let _ = saved;
        if age == OperatorAge::Last { Ok(self.prepare(tangent, &mut LinearCounts::default())?) } else { Ok(()) }
    }
}

/// When an iteration ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Wanted `‖b − A x‖ / ‖b‖`.
    pub(super) tolerance: f64,
    /// Products with the operator, at most (two of BiCGStab count as one).
    pub(super) max_iterations: usize,
}

/// Why an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stop {
    /// The true residual is small enough.
    Converged,
    /// Iterations are used up, or more of them would change nothing.
    Limit,
    /// A denominator vanished.
    Breakdown,
    /// `vᵀ A v / vᵀ v`, not positive.
    NegativeCurvature(f64),
    /// `A v = 0` for some `v`.
    Singular,
    /// NaN or infinity appeared.
    NotFinite,
}

/// What an iteration came to; the residual is the true one of the `x` it leaves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outcome {
    pub(super) iterations: usize,
    pub(super) relative_residual: f64,
    pub(super) stop: Stop,
}

/// Iterations start again from the true residual as long as that still shrinks to this fraction.
const RESTART_PROGRESS: f64 = 0.5;

/// What an iteration is given, `A x = b` with `b` not zero and `M⁻¹ ≈ A⁻¹`, and the iterations taken so far.
pub(super) struct System<'a> {
    action: &'a Action<'a>,
    inverse: &'a mut dyn ApproximateInverse,
    right: &'a [f64],
    /// `‖b‖`.
    pub(super) scale: f64,
    pub(super) limits: Limits,
    pub(super) iterations: usize,
}

impl<'a> System<'a> {
    pub(super) fn new(
        action: &'a Action<'a>,
        inverse: &'a mut dyn ApproximateInverse,
        right: &'a [f64],
        limits: Limits,
    ) -> Self {
        Self { action, inverse, right, scale: norm(right), limits, iterations: 0 }
    }

    /// Number of unknowns.
    pub(super) fn size(&self) -> usize {
        self.right.len()
    }

    /// `out = A v`.
    pub(super) fn apply(&self, v: &[f64], out: &mut [f64]) {
        (self.action)(v, out);
    }

    /// `z = M⁻¹ r`.
    pub(super) fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        self.inverse.apply_within(self.action, r, z);
    }

    /// `r = b − A x`, and `‖r‖ / ‖b‖`.
    pub(super) fn residual(&self, x: &[f64], r: &mut [f64]) -> f64 {
        residual(self.action, self.right, x, r) / self.scale
    }

    /// The `‖b − A x‖` that is wanted.
    pub(super) fn target(&self) -> f64 {
        self.limits.tolerance * self.scale
    }

    /// Whether all iterations are used up.
    pub(super) fn is_used_up(&self) -> bool {
        self.iterations >= self.limits.max_iterations
    }

    /// The outcome at a residual.
    pub(super) fn outcome(&self, relative_residual: f64, stop: Stop) -> Outcome {
        Outcome { iterations: self.iterations, relative_residual, stop }
    }

    /// The outcome where there is nothing to do from a residual, or nothing that can be done.
    pub(super) fn at_start(&self, relative: f64) -> Option<Outcome> {
        let stop = match () {
            () if !relative.is_finite() => Stop::NotFinite,
            () if relative <= self.limits.tolerance => Stop::Converged,
            () => return None,
        };
        Some(self.outcome(relative, stop))
    }

    /// The outcome where the residual of a recursion has converged, and the true one neither has nor gets smaller by
    /// starting again.
    pub(super) fn stalled(&self, relative: f64, before: f64) -> Option<Outcome> {
        let stop = if relative.is_finite() { Stop::Limit } else { Stop::NotFinite };
        (misses(relative, self.limits.tolerance) && misses(relative, RESTART_PROGRESS * before))
            .then(|| self.outcome(relative, stop))
    }
}

/// Whether a residual is not below a bound. NaN on either side misses.
pub(super) fn misses(residual: f64, bound: f64) -> bool {
    residual.partial_cmp(&bound).is_none_or(|order| order.is_gt())
}

/// `r = b − A x`, and its norm.
pub(super) fn residual(action: &Action<'_>, b: &[f64], x: &[f64], r: &mut [f64]) -> f64 {
    if x.iter().all(|&x| x == 0.0) {
        r.copy_from_slice(b);
    } else {
        action(x, r);
        r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
    }
    norm(r)
}

/// Checks the vectors given to a solve.
pub(super) fn check_vectors(size: usize, tangent: &dyn Tangent, b: &[f64], x: &[f64]) -> Result<(), LinearError> {
    for found in [tangent.size(), b.len(), x.len()] {
        if found != size {
            return Err(LinearError::WrongLength { expected: size, found });
        }
    }
    match crate::vector::first_not_finite(b) {
        Some(row) => Err(LinearError::RightHandSideNotFinite { row }),
        None => Ok(()),
    }
}

/// Whether a pattern is the one that was analysed; the same `Arc` needs no comparison.
pub(super) fn is_known(known: &Option<Arc<SparsePattern>>, pattern: &Arc<SparsePattern>) -> bool {
    known.as_ref().is_some_and(|known| Arc::ptr_eq(known, pattern) || known == pattern)
}
