//! Preconditioned conjugate gradients.
//!
//! Minimises the energy norm of the error over the Krylov space; needs `A` and `M` symmetric positive
//! definite. A direction with `pᵀ A p ≤ 0` proves that `A` is not, and ends the iteration: for a
//! structure it means loss of stability. Hestenes & Stiefel (1952); Saad (2003), algorithm 9.1.

use super::iteration::{Action, ApproximateInverse, Limits, Outcome, Stop, residual};
use crate::vector::{axpy, dot, norm};

/// `‖A p‖` below this fraction of the largest `‖A p‖ / ‖p‖` seen counts as `A p = 0`.
const NULL: f64 = 1e-14;

/// Work space of CG.
#[derive(Debug, Default)]
pub(super) struct Cg {
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
}

impl Cg {
    /// Improves `x` until `‖b − A x‖ ≤ tolerance ‖b‖`; `b` is not zero.
    pub(super) fn solve(
        &mut self,
        action: &Action<'_>,
        inverse: &mut dyn ApproximateInverse,
        b: &[f64],
        x: &mut [f64],
        limits: Limits,
    ) -> Outcome {
        let n = b.len();
        for work in [&mut self.residual, &mut self.preconditioned, &mut self.direction, &mut self.product] {
            work.resize(n, 0.0);
        }
        let scale = norm(b);
        let mut iterations = 0;
        let mut largest = 0.0_f64;
        let mut relative = residual(action, b, x, &mut self.residual) / scale;
        loop {
            if let Some(outcome) = Outcome::at_start(iterations, relative, limits) {
                return outcome;
            }
            let begin = relative;
            let stop = self.sequence(action, inverse, x, limits, scale, &mut iterations, &mut largest);
            relative = residual(action, b, x, &mut self.residual) / scale;
            if let Some(stop) = stop {
                return Outcome { iterations, relative_residual: relative, stop };
            }
            if let Some(outcome) = Outcome::stalled(iterations, relative, begin, limits) {
                return outcome;
            }
        }
    }

    /// Conjugate directions from the present residual. `None`: its recursion has converged.
    #[expect(clippy::too_many_arguments, reason = "the state of one iteration")]
    fn sequence(
        &mut self,
        action: &Action<'_>,
        inverse: &mut dyn ApproximateInverse,
        x: &mut [f64],
        limits: Limits,
        scale: f64,
        iterations: &mut usize,
        largest: &mut f64,
    ) -> Option<Stop> {
        inverse.apply_within(action, &self.residual, &mut self.preconditioned);
        self.direction.copy_from_slice(&self.preconditioned);
        let mut product = dot(&self.residual, &self.preconditioned);
        loop {
            if *iterations >= limits.max_iterations {
                return Some(Stop::Limit);
            }
            if !product.is_finite() {
                return Some(Stop::NotFinite);
            }
            if product <= 0.0 {
                // The preconditioner is not positive definite.
                return Some(Stop::Breakdown);
            }
            action(&self.direction, &mut self.product);
            *iterations += 1;
            let curvature = dot(&self.direction, &self.product);
            let (length, stretched) = (norm(&self.direction), norm(&self.product));
            if !curvature.is_finite() || !stretched.is_finite() {
                return Some(Stop::NotFinite);
            }
            *largest = largest.max(stretched / length);
            if curvature <= 0.0 {
                return Some(if stretched <= NULL * *largest * length {
                    Stop::Singular
                } else {
                    Stop::NegativeCurvature(curvature / (length * length))
                });
            }
            let step = product / curvature;
            axpy(step, &self.direction, x);
            axpy(-step, &self.product, &mut self.residual);
            if norm(&self.residual) <= limits.tolerance * scale {
                return None;
            }
            inverse.apply_within(action, &self.residual, &mut self.preconditioned);
            let next = dot(&self.residual, &self.preconditioned);
            let conjugation = next / product;
            for (p, z) in self.direction.iter_mut().zip(&self.preconditioned) {
                *p = z + conjugation * *p;
            }
            product = next;
        }
    }
}
