//! Preconditioned MINRES: symmetric operators, definite or not.
//!
//! Minimises `‖b − A x‖` in the norm of `M⁻¹` over the Krylov space, by a three-term recursion; needs `M` positive
//! definite. The residual vector itself is carried along, so that the iteration ends by the plain norm that the
//! caller asked for. Paige & Saunders (1975), "Solution of sparse indefinite systems of linear equations"; Elman,
//! Silvester & Wathen (2014), *Finite Elements and Fast Iterative Solvers*, algorithm 4.1.

use super::iteration::{Outcome, Stop, System, misses};
use crate::vector::{axpy, dot, norm};

/// A rotation this small against the largest stretch seen means `A v = 0`.
const NULL: f64 = 1e-14;

/// Work space of MINRES.
#[derive(Debug, Default)]
pub(super) struct Minres {
    residual: Vec<f64>,
    /// `v` of Lanczos: the present vector and the last one, not yet scaled to length one.
    lanczos: [Vec<f64>; 2],
    preconditioned: Vec<f64>,
    product: Vec<f64>,
    directions: [Vec<f64>; 2],
}

impl Minres {
    /// Improves `x` until `‖b − A x‖ ≤ tolerance ‖b‖`.
    pub(super) fn solve(&mut self, system: &mut System<'_>, x: &mut [f64]) -> Outcome {
        let n = system.size();
        let [v, w] = [&mut self.lanczos, &mut self.directions];
        for work in v.iter_mut().chain(w).chain([&mut self.residual, &mut self.preconditioned, &mut self.product]) {
            work.resize(n, 0.0);
        }
        let mut relative = system.residual(x, &mut self.residual);
        loop {
            if let Some(outcome) = system.at_start(relative) {
                return outcome;
            }
            let begin = relative;
            let stop = self.sequence(system, x);
            relative = system.residual(x, &mut self.residual);
            if let Some(stop) = stop.filter(|_| misses(relative, system.limits.tolerance)) {
                let stop = if relative.is_finite() { stop } else { Stop::NotFinite };
                return system.outcome(relative, stop);
            }
            if let Some(outcome) = system.stalled(relative, begin) {
                return outcome;
            }
        }
    }

    /// One Lanczos sequence from the present residual. `None`: the carried residual has converged.
    fn sequence(&mut self, system: &mut System<'_>, x: &mut [f64]) -> Option<Stop> {
        let [present, last] = &mut self.lanczos;
        let [direction, older] = &mut self.directions;
        present.copy_from_slice(&self.residual);
        last.fill(0.0);
        direction.fill(0.0);
        older.fill(0.0);
        system.precondition(present, &mut self.preconditioned);
        let mut length = match root(dot(&self.preconditioned, present)) {
            Ok(length) => length,
            Err(stop) => return Some(stop),
        };
        let (mut last_length, mut projection) = (1.0, length);
        // Cosine and sine of the last two rotations.
        let (mut c, mut s, mut c_old, mut s_old) = (1.0, 0.0, 1.0, 0.0);
        let mut largest = 0.0_f64;
        loop {
            if system.is_used_up() {
                return Some(Stop::Limit);
            }
            if length == 0.0 {
                return Some(Stop::Breakdown);
            }
            self.preconditioned.iter_mut().for_each(|z| *z /= length);
            system.apply(&self.preconditioned, &mut self.product);
            system.iterations += 1;
            let diagonal = dot(&self.product, &self.preconditioned);
            // The next v takes the place of the last one.
            for ((next, v), product) in last.iter_mut().zip(present.iter()).zip(&self.product) {
                *next = product - diagonal / length * v - length / last_length * *next;
            }
            std::mem::swap(present, last);
            // The direction needs the old z, the next v the new one.
            let (first, second) = (s_old * length, s * diagonal + c_old * c * length);
            let unrotated = c * diagonal - c_old * s * length;
            for ((w, old), z) in older.iter_mut().zip(direction.iter()).zip(&self.preconditioned) {
                *w = z - first * *w - second * old;
            }
            std::mem::swap(direction, older);
            system.precondition(present, &mut self.preconditioned);
            let next = match root(dot(&self.preconditioned, present)) {
                Ok(next) => next,
                Err(stop) => return Some(stop),
            };
            let rotated = unrotated.hypot(next);
            if !rotated.is_finite() {
                return Some(Stop::NotFinite);
            }
            largest = largest.max(rotated).max(length);
            if rotated <= NULL * largest {
                return Some(Stop::Singular);
            }
            (c_old, s_old) = (c, s);
            (c, s) = (unrotated / rotated, next / rotated);
            direction.iter_mut().for_each(|w| *w /= rotated);
            axpy(c * projection, direction, x);
            projection *= -s;
            // r_k = s² r_{k−1} + (projection c / length) v_{k+1}.
            let along = if next > 0.0 { projection * c / next } else { 0.0 };
            for (r, v) in self.residual.iter_mut().zip(present.iter()) {
                *r = s * s * *r + along * v;
            }
            // Below rounding the carried residual is no longer the true one.
            if norm(&self.residual) <= system.limits.tolerance.max(f64::EPSILON) * system.scale {
                return None;
            }
            (last_length, length) = (length, next);
        }
    }
}

/// `√(vᵀ M⁻¹ v)`.
fn root(square: f64) -> Result<f64, Stop> {
    match square {
        square if !square.is_finite() => Err(Stop::NotFinite),
        // The preconditioner is not positive definite.
        square if square < 0.0 => Err(Stop::Breakdown),
        square => Ok(square.sqrt()),
    }
}
