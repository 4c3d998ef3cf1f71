//! Restarted GMRES with right preconditioning.
//!
//! Minimises `‖b − A (x₀ + M⁻¹ V y)‖` over the Krylov space `V` of `A M⁻¹`; with the preconditioner on
//! the right the residual that is minimised is the true one. Arnoldi by modified Gram–Schmidt with a
//! second pass when cancellation calls for it, least squares by Givens rotations. Saad & Schultz
//! (1986); Saad (2003), *Iterative Methods for Sparse Linear Systems*, §6.5 and algorithm 9.5.

use super::iteration::{Outcome, Stop, System, misses};
use crate::vector::{axpy, dot, norm};

/// A vector that loses this much of its length in the projection is projected once more.
const REORTHOGONALISE: f64 = 0.7;
/// A restart cycle must shrink the residual at least to this fraction, else more cycles are useless.
const CYCLE_PROGRESS: f64 = 0.999;

/// Work space of GMRES(m); grows to the longest cycle used and is then kept.
#[derive(Debug)]
pub(super) struct Gmres {
    restart: usize,
    basis: Vec<Vec<f64>>,
    /// Column `j` of the triangular factor: `j + 1` entries.
    columns: Vec<Vec<f64>>,
    rotations: Vec<(f64, f64)>,
    /// Right-hand side of the least squares problem.
    projected: Vec<f64>,
    direction: Vec<f64>,
    residual: Vec<f64>,
}

impl Gmres {
    /// Work space for cycles of `restart` steps.
    pub(super) fn new(restart: usize) -> Self {
        Self {
            restart: restart.max(1),
            basis: Vec::new(),
            columns: Vec::new(),
            rotations: Vec::new(),
            projected: Vec::new(),
            direction: Vec::new(),
            residual: Vec::new(),
        }
    }

    /// Improves `x` until `‖b − A x‖ ≤ tolerance ‖b‖`.
    pub(super) fn solve(&mut self, system: &mut System<'_>, x: &mut [f64]) -> Outcome {
        let n = system.size();
        self.direction.resize(n, 0.0);
        self.residual.resize(n, 0.0);
        let mut relative = system.residual(x, &mut self.residual);
        loop {
            if let Some(outcome) = system.at_start(relative) {
                return outcome;
            }
            if system.is_used_up() {
                return system.outcome(relative, Stop::Limit);
            }
            let steps = self.restart.min(system.limits.max_iterations - system.iterations);
            let (done, end) = self.cycle(system, steps);
            system.iterations += done;
            if !self.update(system, done, x) {
                return system.outcome(relative, end.unwrap_or(Stop::NotFinite));
            }
            let before = relative;
            relative = system.residual(x, &mut self.residual);
            if misses(relative, system.limits.tolerance) && misses(relative, CYCLE_PROGRESS * before) {
                let stop = if relative.is_finite() { end.unwrap_or(Stop::Limit) } else { Stop::NotFinite };
                return system.outcome(if relative.is_finite() { relative } else { before }, stop);
            }
        }
    }

    /// One Arnoldi cycle from the present residual. Returns the number of usable steps, and why the space
    /// could not grow if that ended it.
    fn cycle(&mut self, system: &mut System<'_>, steps: usize) -> (usize, Option<Stop>) {
        let n = self.residual.len();
        let start = norm(&self.residual);
        self.projected.clear();
        self.projected.push(start);
        self.rotations.clear();
        self.vector(0, n);
        for (v, r) in self.basis[0].iter_mut().zip(&self.residual) {
            *v = r / start;
        }
        for j in 0..steps {
            self.vector(j + 1, n);
            let (old, new) = self.basis.split_at_mut(j + 1);
            let w = &mut new[0];
            system.precondition(&old[j], &mut self.direction);
            system.apply(&self.direction, w);
            let length = norm(w);
            if !length.is_finite() {
                return (j, Some(Stop::NotFinite));
            }
            if self.columns.len() <= j {
                self.columns.push(Vec::new());
            }
            let h = &mut self.columns[j];
            h.clear();
            h.resize(j + 1, 0.0);
            let mut rest = length;
            for _ in 0..2 {
                for (v, h) in old.iter().zip(h.iter_mut()) {
                    let projection = dot(v, w);
                    *h += projection;
                    axpy(-projection, v, w);
                }
                let shorter = norm(w);
                let enough = shorter > REORTHOGONALISE * rest;
                rest = shorter;
                if enough {
                    break;
                }
            }
            // Below rounding nothing of the new direction is left: the space is invariant.
            let invariant = rest <= f64::EPSILON * length;
            if !invariant {
                w.iter_mut().for_each(|w| *w /= rest);
            }
            for (i, &(c, s)) in self.rotations.iter().enumerate() {
                (h[i], h[i + 1]) = (c * h[i] + s * h[i + 1], c * h[i + 1] - s * h[i]);
            }
            let below = if invariant { 0.0 } else { rest };
            let diagonal = h[j].hypot(below);
            if diagonal <= f64::EPSILON * length || diagonal == 0.0 {
                // A v lies in the old space and adds nothing: the operator is singular there.
                return (j, Some(Stop::Breakdown));
            }
            let (c, s) = (h[j] / diagonal, below / diagonal);
            h[j] = diagonal;
            self.rotations.push((c, s));
            let g = self.projected[j];
            self.projected[j] = c * g;
            self.projected.push(-s * g);
            if (s * g).abs() <= system.target() || invariant {
                return (j + 1, invariant.then_some(Stop::Breakdown));
            }
        }
        (steps, None)
    }

    /// `x += M⁻¹ V y` with `R y = g`. False if nothing finite came out.
    fn update(&mut self, system: &mut System<'_>, steps: usize, x: &mut [f64]) -> bool {
        if steps == 0 {
            return false;
        }
        let y = &mut self.projected;
        for j in (0..steps).rev() {
            y[j] /= self.columns[j][j];
            for i in 0..j {
                y[i] -= self.columns[j][i] * y[j];
            }
        }
        // The residual is recomputed after every cycle and serves as work space here.
        self.residual.fill(0.0);
        for (v, &y) in self.basis.iter().zip(&y[..steps]) {
            axpy(y, v, &mut self.residual);
        }
        system.precondition(&self.residual, &mut self.direction);
        if crate::vector::first_not_finite(&self.direction).is_some() {
            return false;
        }
        axpy(1.0, &self.direction, x);
        true
    }

    /// Makes sure that basis vector `j` exists with `n` entries.
    fn vector(&mut self, j: usize, n: usize) {
        if self.basis.len() <= j {
            self.basis.push(Vec::new());
        }
        self.basis[j].resize(n, 0.0);
    }
}
