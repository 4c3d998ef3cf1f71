//! Preconditioned conjugate gradients.
//!
//! Minimises the energy norm of the error over the Krylov space; needs `A` and `M` symmetric positive
//! definite. A direction with `pᵀ A p ≤ 0` proves that `A` is not, and ends the iteration: for a
//! structure it means loss of stability. Hestenes & Stiefel (1952); Saad (2003), algorithm 9.1.

use super::iteration::{Outcome, Stop, System};
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
    /// Improves `x` until `‖b − A x‖ ≤ tolerance ‖b‖`.
    pub(super) fn solve(&mut self, system: &mut System<'_>, x: &mut [f64]) -> Outcome {
        let n = system.size();
        for work in [&mut self.residual, &mut self.preconditioned, &mut self.direction, &mut self.product] {
            work.resize(n, 0.0);
        }
        let mut largest = 0.0_f64;
        let mut relative = system.residual(x, &mut self.residual);
        loop {
            if let Some(outcome) = system.at_start(relative) {
                return outcome;
            }
            let begin = relative;
            let stop = self.sequence(system, x, &mut largest);
            relative = system.residual(x, &mut self.residual);
            if let Some(stop) = stop {
                return system.outcome(relative, stop);
            }
            if let Some(outcome) = system.stalled(relative, begin) {
                return outcome;
            }
        }
    }

    /// Conjugate directions from the present residual. `None`: its recursion has converged.
    fn sequence(&mut self, system: &mut System<'_>, x: &mut [f64], largest: &mut f64) -> Option<Stop> {
        system.precondition(&self.residual, &mut self.preconditioned);
        self.direction.copy_from_slice(&self.preconditioned);
        let mut product = dot(&self.residual, &self.preconditioned);
        loop {
            if system.is_used_up() {
                return Some(Stop::Limit);
            }
            if !product.is_finite() {
                return Some(Stop::NotFinite);
            }
            if product <= 0.0 {
                // The preconditioner is not positive definite.
                return Some(Stop::Breakdown);
            }
            system.apply(&self.direction, &mut self.product);
            system.iterations += 1;
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
            if norm(&self.residual) <= system.target() {
                return None;
            }
            system.precondition(&self.residual, &mut self.preconditioned);
            let next = dot(&self.residual, &self.preconditioned);
            let conjugation = next / product;
            for (p, z) in self.direction.iter_mut().zip(&self.preconditioned) {
                *p = z + conjugation * *p;
            }
            product = next;
        }
    }
}
