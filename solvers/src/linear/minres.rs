//! Preconditioned MINRES: symmetric operators, definite or not.
//!
//! Minimises `‖b − A x‖` in the norm of `M⁻¹` over the Krylov space, by a three-term recursion; needs `M` positive
//! definite. The residual vector itself is carried along, so that the iteration ends by the plain norm that the
//! caller asked for. Paige & Saunders (1975), "Solution of sparse indefinite systems of linear equations"; Elman,
//! Silvester & Wathen (2014), *Finite Elements and Fast Iterative Solvers*, algorithm 4.1.

use super::iteration::{Action, ApproximateInverse, Limits, Outcome, Stop, misses, residual};
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
        let [v, w] = [&mut self.lanczos, &mut self.directions];
        for work in v.iter_mut().chain(w).chain([&mut self.residual, &mut self.preconditioned, &mut self.product]) {
            work.resize(n, 0.0);
        }
        let scale = norm(b);
        let mut iterations = 0;
        let mut relative = residual(action, b, x, &mut self.residual) / scale;
        loop {
            if let Some(outcome) = Outcome::at_start(iterations, relative, limits) {
                return outcome;
            }
            let begin = relative;
            let stop = self.sequence(action, inverse, x, limits, scale, &mut iterations);
            relative = residual(action, b, x, &mut self.residual) / scale;
            if let Some(stop) = stop.filter(|_| misses(relative, limits.tolerance)) {
                let stop = if relative.is_finite() { stop } else { Stop::NotFinite };
                return Outcome { iterations, relative_residual: relative, stop };
            }
            if let Some(outcome) = Outcome::stalled(iterations, relative, begin, limits) {
                return outcome;
            }
        }
    }

    /// One Lanczos sequence from the present residual. `None`: the carried residual has converged.
    fn sequence(
        &mut self,
        action: &Action<'_>,
        inverse: &mut dyn ApproximateInverse,
        x: &mut [f64],
        limits: Limits,
        scale: f64,
        iterations: &mut usize,
    ) -> Option<Stop> {
        let [present, last] = &mut self.lanczos;
        let [direction, older] = &mut self.directions;
        present.copy_from_slice(&self.residual);
        last.fill(0.0);
        direction.fill(0.0);
        older.fill(0.0);
        inverse.apply_within(action, present, &mut self.preconditioned);
        let mut length = match root(dot(&self.preconditioned, present)) {
            Ok(length) => length,
            Err(stop) => return Some(stop),
        };
        let (mut last_length, mut projection) = (1.0, length);
        // Cosine and sine of the last two rotations.
        let (mut c, mut s, mut c_old, mut s_old) = (1.0, 0.0, 1.0, 0.0);
        let mut largest = 0.0_f64;
        loop {
            if *iterations >= limits.max_iterations {
                return Some(Stop::Limit);
            }
            if length == 0.0 {
                return Some(Stop::Breakdown);
            }
            self.preconditioned.iter_mut().for_each(|z| *z /= length);
            action(&self.preconditioned, &mut self.product);
            *iterations += 1;
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
            inverse.apply_within(action, present, &mut self.preconditioned);
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
            if norm(&self.residual) <= limits.tolerance.max(f64::EPSILON) * scale {
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
