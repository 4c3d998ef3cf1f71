//! Secant updates around one fixed factor.
//!
//! A kept factor gives `z = B₀⁻¹ R` by one linear solve; the steps taken and the changes of the
//! residual they caused improve it without another factorisation.
//!
//! - Broyden, product form of the inverse (C. T. Kelley, *Iterative Methods for Linear and Nonlinear
//!   Equations*, 1995, chapter 7), here for steps of any length:
//!   `B₊⁻¹ = (I + u sᵀ) B⁻¹`, `u = (s − w) / (sᵀ w)`, `w = B⁻¹ ΔR`. When the memory is full it starts
//!   again from the factor: dropping the oldest factor of a product would change all later ones.
//! - L-BFGS (H. Matthies and G. Strang, Int. J. Numer. Meth. Eng. 14 (1979) 1613): the two-loop recursion
//!   of Nocedal & Wright (2006), algorithm 7.4, with `H₀ = B₀⁻¹`. The oldest pair is dropped.

use std::collections::VecDeque;

use super::tangent_policy::SecantUpdate;
use crate::linear::{LinearError, LinearReport};
use crate::vector::{axpy, dot, norm};

/// An update whose denominator is relatively smaller than this would ruin the rest.
const DEGENERATE: f64 = 1e-10;

/// Two vectors of an update: `(u, s)` for Broyden, `(s, ΔR)` with `1 / sᵀΔR` for L-BFGS.
#[derive(Debug, Clone, Default)]
struct Pair {
    first: Vec<f64>,
    second: Vec<f64>,
    weight: f64,
}

/// The updates of one solve.
#[derive(Debug, Clone)]
pub(super) struct QuasiNewton {
    update: SecantUpdate,
    memory: usize,
    pairs: VecDeque<Pair>,
    /// Pairs whose memory can be used again.
    spare: Vec<Pair>,
    /// The last step and `B⁻¹ R` before it, waiting for `B⁻¹ R` after it (Broyden).
    step: Vec<f64>,
    solved: Vec<f64>,
    has_step: bool,
    work: Vec<f64>,
    coefficients: Vec<f64>,
}

impl QuasiNewton {
    pub(super) fn new(update: SecantUpdate, memory: usize) -> Self {
        Self {
            update,
            memory,
            pairs: VecDeque::new(),
            spare: Vec::new(),
            step: Vec::new(),
            solved: Vec::new(),
            has_step: false,
            work: Vec::new(),
            coefficients: Vec::new(),
        }
    }

    /// Back to the factor alone.
    pub(super) fn restart(&mut self) {
        self.spare.extend(self.pairs.drain(..));
        self.has_step = false;
    }

    /// `out = B⁻¹ residual`, with `solve` for `B₀⁻¹`.
    pub(super) fn solve(
        &mut self,
        residual: &[f64],
        out: &mut [f64],
        mut solve: impl FnMut(&[f64], &mut [f64]) -> Result<LinearReport, LinearError>,
    ) -> Result<LinearReport, LinearError> {
        match self.update {
            SecantUpdate::Broyden => {
                let report = solve(residual, out)?;
                if self.has_step && self.pairs.len() >= self.memory {
                    self.restart();
                }
                for pair in &self.pairs {
                    let along = dot(&pair.second, out);
                    axpy(along, &pair.first, out);
                }
                if self.has_step {
                    self.has_step = false;
                    self.update_broyden(out);
                }
                self.solved.clear();
                self.solved.extend_from_slice(out);
                Ok(report)
            }
            SecantUpdate::LimitedBfgs => {
                self.work.clear();
                self.work.extend_from_slice(residual);
                self.coefficients.clear();
                for pair in self.pairs.iter().rev() {
                    let a = pair.weight * dot(&pair.first, &self.work);
                    axpy(-a, &pair.second, &mut self.work);
                    self.coefficients.push(a);
                }
                let report = solve(&self.work, out)?;
                for (pair, a) in self.pairs.iter().zip(self.coefficients.iter().rev()) {
                    let b = pair.weight * dot(&pair.second, out);
                    axpy(a - b, &pair.first, out);
                }
                Ok(report)
            }
        }
    }

    /// A step `length × direction` has been taken that changed the residual from `before` to `after`.
    pub(super) fn observe(&mut self, length: f64, direction: &[f64], before: &[f64], after: &[f64]) {
        match self.update {
            SecantUpdate::Broyden => {
                self.step.clear();
                self.step.extend(direction.iter().map(|d| length * d));
                self.has_step = true;
            }
            SecantUpdate::LimitedBfgs => {
                let mut pair = self.take_pair();
                pair.first.extend(direction.iter().map(|d| length * d));
                pair.second.extend(after.iter().zip(before).map(|(after, before)| after - before));
                let curvature = dot(&pair.first, &pair.second);
                // Without positive curvature the updated operator would no longer be positive definite.
                if curvature > DEGENERATE * norm(&pair.first) * norm(&pair.second) {
                    pair.weight = 1.0 / curvature;
                    self.pairs.push_back(pair);
                } else {
                    self.spare.push(pair);
                }
            }
        }
    }

    /// `z = B⁻¹ R₊` comes in and `B₊⁻¹ R₊ = z + u (sᵀ z)` goes out.
    fn update_broyden(&mut self, z: &mut [f64]) {
        let mut pair = self.take_pair();
        // w = B⁻¹ (R₊ − R) = z − B⁻¹ R.
        pair.first.extend(z.iter().zip(&self.solved).map(|(z, solved)| z - solved));
        pair.second.extend_from_slice(&self.step);
        let denominator = dot(&pair.second, &pair.first);
        if denominator.abs() <= DEGENERATE * norm(&pair.second) * norm(&pair.first) {
            self.spare.push(pair);
            return;
        }
        for (first, step) in pair.first.iter_mut().zip(&pair.second) {
            *first = (step - *first) / denominator;
        }
        let along = dot(&pair.second, z);
        axpy(along, &pair.first, z);
        self.pairs.push_back(pair);
    }

    fn take_pair(&mut self) -> Pair {
        let oldest = if self.pairs.len() >= self.memory { self.pairs.pop_front() } else { None };
        let mut pair = oldest.or_else(|| self.spare.pop()).unwrap_or_default();
        pair.first.clear();
        pair.second.clear();
        pair
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `B₀ = I`.
    fn identity(b: &[f64], x: &mut [f64]) -> Result<LinearReport, LinearError> {
        x.copy_from_slice(b);
        Ok(LinearReport { iterations: 0, relative_residual: 0.0 })
    }

    /// Iterates `y ← y − B⁻¹ (A y − b)` and returns the residual norms.
    fn iterate(update: SecantUpdate, memory: usize, iterations: usize) -> Vec<f64> {
        let matrix = [[2.0, 0.5, 0.0], [0.5, 1.5, 0.2], [0.0, 0.2, 0.8]];
        let residual = |y: &[f64]| -> Vec<f64> { matrix.iter().map(|row| dot(row, y) - 1.0).collect() };
        let mut quasi = QuasiNewton::new(update, memory);
        let (mut y, mut z) = (vec![0.0; 3], vec![0.0; 3]);
        let mut norms = Vec::new();
        for _ in 0..iterations {
            let before = residual(&y);
            norms.push(norm(&before));
            quasi.solve(&before, &mut z, identity).expect("identity");
            let direction: Vec<f64> = z.iter().map(|z| -z).collect();
            axpy(0.9, &direction, &mut y);
            quasi.observe(0.9, &direction, &before, &residual(&y));
        }
        norms
    }

    #[test]
    fn both_updates_solve_a_linear_system_superlinearly() {
        for update in [SecantUpdate::Broyden, SecantUpdate::LimitedBfgs] {
            let norms = iterate(update, 20, 16);
            assert!(norms[15] < 1e-9 * norms[0], "{update:?}: {norms:?}");
        }
    }

    #[test]
    fn a_short_memory_still_converges() {
        for update in [SecantUpdate::Broyden, SecantUpdate::LimitedBfgs] {
            let norms = iterate(update, 2, 40);
            assert!(norms[39] < 1e-9 * norms[0], "{update:?}: {norms:?}");
        }
    }

    #[test]
    fn the_secant_condition_holds_after_an_update() {
        // B₊⁻¹ ΔR = s for both updates.
        for update in [SecantUpdate::Broyden, SecantUpdate::LimitedBfgs] {
            let mut quasi = QuasiNewton::new(update, 5);
            let (before, after, mut out) = ([1.0, 2.0], [0.5, 0.4], [0.0; 2]);
            quasi.solve(&before, &mut out, identity).expect("identity");
            let direction: Vec<f64> = out.iter().map(|z| -z).collect();
            quasi.observe(0.5, &direction, &before, &after);
            quasi.solve(&after, &mut out, identity).expect("identity");
            let change = [after[0] - before[0], after[1] - before[1]];
            let mut image = [0.0; 2];
            quasi.solve(&change, &mut image, identity).expect("identity");
            for (image, direction) in image.iter().zip(&direction) {
                assert!((image - 0.5 * direction).abs() < 1e-14, "{update:?}");
            }
        }
    }
}
