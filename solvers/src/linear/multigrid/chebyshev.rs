//! Chebyshev smoothing: the polynomial in `D⁻¹ A` that damps the upper part of the spectrum best, where D holds the
//! diagonal blocks. It needs products only, is symmetric, and has the same bits for any number of threads. Adams,
//! Brezina, Hu & Tuminaro (2003), "Parallel multigrid smoothing: polynomial versus Gauss–Seidel"; the recursion is
//! that of Saad (2003), algorithm 12.1.

use super::super::factor::scatter;
use super::super::iteration::Action;
use super::super::precondition::BlockInverses;
use crate::vector::{axpy, dot};

/// Products that estimate the largest eigenvalue.
const POWER_STEPS: usize = 12;
/// The estimate is from below.
const SAFETY: f64 = 1.1;

/// A smoother: inverses of the diagonal blocks and the interval that is damped.
pub(super) struct Chebyshev {
    pub(super) inverses: BlockInverses,
    /// Largest eigenvalue of `D⁻¹ A`, with a safety margin.
    largest: f64,
    direction: Vec<f64>,
    work: [Vec<f64>; 2],
}

impl Chebyshev {
    /// A smoother whose interval is estimated by a few products.
    pub(super) fn new(inverses: BlockInverses, action: &Action<'_>, size: usize) -> Self {
        let mut out =
            Self { inverses, largest: 1.0, direction: vec![0.0; size], work: [vec![0.0; size], vec![0.0; size]] };
        out.largest = out.estimate(action) * SAFETY;
        out
    }

    /// Largest eigenvalue of `D⁻¹ A` by the power method, as the Rayleigh quotient of `(A, D)`.
    fn estimate(&mut self, action: &Action<'_>) -> f64 {
        let [product, scaled] = &mut self.work;
        let v = &mut self.direction;
        v.iter_mut().enumerate().for_each(|(i, v)| *v = scatter(i));
        let mut quotient = 1.0;
        for _ in 0..POWER_STEPS {
            action(v, product);
            self.inverses.apply(product, scaled);
            // With w = D⁻¹ A v: (w, A v)/(w, D v) = (w, A v)/(v, A v).
            let energy = dot(v, product);
            let next = dot(scaled, product);
            if !(energy > 0.0 && next.is_finite()) {
                break;
            }
            quotient = next / energy;
            let length = dot(scaled, scaled).sqrt();
            v.iter_mut().zip(scaled.iter()).for_each(|(v, w)| *v = w / length);
        }
        quotient
    }

    /// `z += q(D⁻¹ A) D⁻¹ r` with `degree` terms, on the interval from `1/ratio` of the largest eigenvalue; `r` is
    /// overwritten. Takes `degree − 1` products.
    pub(super) fn smooth(&mut self, action: &Action<'_>, r: &mut [f64], z: &mut [f64], degree: usize, ratio: f64) {
        let (upper, lower) = (self.largest, self.largest / ratio);
        let (centre, half) = (0.5 * (upper + lower), 0.5 * (upper - lower));
        let [scaled, product] = &mut self.work;
        self.inverses.apply(r, scaled);
        self.direction.iter_mut().zip(scaled.iter()).for_each(|(p, s)| *p = s / centre);
        let mut rho = half / centre;
        for step in 0..degree {
            axpy(1.0, &self.direction, z);
            if step + 1 == degree {
                break;
            }
            action(&self.direction, product);
            axpy(-1.0, product, r);
            self.inverses.apply(r, scaled);
            let next = 1.0 / (2.0 * centre / half - rho);
            let (keep, add) = (next * rho, 2.0 * next / half);
            self.direction.iter_mut().zip(scaled.iter()).for_each(|(p, s)| *p = keep * *p + add * s);
            rho = next;
        }
    }
}
