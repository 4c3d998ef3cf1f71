//! BiCGStab with right preconditioning.
//!
//! Two products per iteration and short recurrences for a general matrix: a biconjugate gradient step,
//! then a step of minimal residual. Van der Vorst (1992), "Bi-CGSTAB"; Saad (2003), §7.4.2; the minimal
//! residual step is kept away from zero as by Sleijpen & van der Vorst (1995). After a break-down (or a
//! recursion that has drifted from the true residual) it starts again with another shadow residual.

use super::iteration::{Outcome, Stop, System, misses};
use crate::vector::{axpy, dot, norm};

/// Cosine below which two vectors count as orthogonal.
const ORTHOGONAL: f64 = 1e-14;
/// Cosine below which the minimal residual step is lengthened.
const STEADY: f64 = 0.7;
/// Starts in all; each must shrink the residual, or the next one takes another shadow residual.
const STARTS: usize = 12;

/// Work space of BiCGStab.
#[derive(Debug, Default)]
pub(super) struct BiCgStab {
    residual: Vec<f64>,
    shadow: Vec<f64>,
    direction: Vec<f64>,
    preconditioned: Vec<f64>,
    product: Vec<f64>,
    second: Vec<f64>,
    best: Vec<f64>,
}

/// How a sequence of steps ended.
enum End {
    RecursionConverged,
    Orthogonal,
    Limit,
    NotFinite,
}

impl BiCgStab {
    /// Improves `x` until `‖b − A x‖ ≤ tolerance ‖b‖`.
    pub(super) fn solve(&mut self, system: &mut System<'_>, x: &mut [f64]) -> Outcome {
        let n = system.size();
        for work in [
            &mut self.residual,
            &mut self.shadow,
            &mut self.direction,
            &mut self.preconditioned,
            &mut self.product,
            &mut self.second,
            &mut self.best,
        ] {
            work.resize(n, 0.0);
        }
        let mut relative = system.residual(x, &mut self.residual);
        let mut fruitless = 0;
        for start in 0..STARTS {
            if let Some(outcome) = system.at_start(relative) {
                return outcome;
            }
            self.choose_shadow(fruitless, start);
            self.best.copy_from_slice(x);
            let end = self.sequence(system, x);
            let reached = system.residual(x, &mut self.residual);
            if misses(reached, relative) {
                // Worse than before: back.
                x.copy_from_slice(&self.best);
                system.residual(x, &mut self.residual);
                fruitless += 1;
            } else {
                fruitless = if reached < 0.5 * relative { 0 } else { fruitless + 1 };
                relative = reached;
            }
            let stop = match end {
                _ if relative <= system.limits.tolerance => Stop::Converged,
                End::Limit => Stop::Limit,
                End::NotFinite if fruitless > 0 => Stop::NotFinite,
                _ if fruitless > 2 => Stop::Breakdown,
                _ => continue,
            };
            return system.outcome(relative, stop);
        }
        system.outcome(relative, Stop::Breakdown)
    }

    /// The residual itself; after fruitless starts, something that is not orthogonal by structure.
    fn choose_shadow(&mut self, fruitless: usize, start: usize) {
        self.shadow.copy_from_slice(&self.residual);
        if fruitless > 0 {
            #[expect(clippy::cast_precision_loss, reason = "a length")]
            let size = norm(&self.residual) / (self.residual.len() as f64).sqrt();
            for (i, s) in self.shadow.iter_mut().enumerate() {
                *s += size * super::factor::scatter(i + 7919 * start);
            }
        }
    }

    /// Steps from the present residual.
    fn sequence(&mut self, system: &mut System<'_>, x: &mut [f64]) -> End {
        let target = system.target();
        let shadow_length = norm(&self.shadow);
        let mut projection = dot(&self.shadow, &self.residual);
        let mut length = norm(&self.residual);
        self.direction.copy_from_slice(&self.residual);
        loop {
            if system.is_used_up() {
                return End::Limit;
            }
            if projection.abs() <= ORTHOGONAL * shadow_length * length {
                return End::Orthogonal;
            }
            system.iterations += 1;
            system.precondition(&self.direction, &mut self.preconditioned);
            system.apply(&self.preconditioned, &mut self.product);
            let slope = dot(&self.shadow, &self.product);
            let stretched = norm(&self.product);
            if !slope.is_finite() || !stretched.is_finite() {
                return End::NotFinite;
            }
            if slope.abs() <= ORTHOGONAL * shadow_length * stretched {
                return End::Orthogonal;
            }
            let step = projection / slope;
            axpy(step, &self.preconditioned, x);
            axpy(-step, &self.product, &mut self.residual);
            length = norm(&self.residual);
            if !length.is_finite() {
                return End::NotFinite;
            }
            if length <= target {
                return End::RecursionConverged;
            }
            system.precondition(&self.residual, &mut self.preconditioned);
            system.apply(&self.preconditioned, &mut self.second);
            let stretched = norm(&self.second);
            if !stretched.is_finite() {
                return End::NotFinite;
            }
            if stretched == 0.0 {
                return End::Orthogonal;
            }
            let cosine = dot(&self.second, &self.residual) / (stretched * length);
            let steady = if cosine.abs() < STEADY { STEADY.copysign(cosine) } else { cosine };
            let omega = steady * length / stretched;
            axpy(omega, &self.preconditioned, x);
            axpy(-omega, &self.second, &mut self.residual);
            length = norm(&self.residual);
            if !length.is_finite() {
                return End::NotFinite;
            }
            if length <= target {
                return End::RecursionConverged;
            }
            let next = dot(&self.shadow, &self.residual);
            let conjugation = (next / projection) * (step / omega);
            projection = next;
            for ((p, v), r) in self.direction.iter_mut().zip(&self.product).zip(&self.residual) {
                *p = r + conjugation * (*p - omega * v);
            }
        }
    }
}
