//! Steps of the iteration that meets the conditions: generalised conjugate residuals (Eisenstat, Elman and
//! Schultz 1983), preconditioned by the factored normal equations.
//!
//! Steps are measured by what they do to the conditions, not by their multipliers: those hold an arbitrary
//! large part of the null space, which conjugate gradients would mistake for progress.

use rayon::prelude::*;

use super::constraints::{Constraints, Side};
use crate::tensor::{Tensor, Vector};

/// A change of the weights and its effect on the conditions.
pub(super) struct Step<const D: usize> {
    /// `ΔQ` per entry.
    pub changes: Vec<Vector<D>>,
    /// `C ΔQ` per particle.
    pub effects: Vec<[Side<D>; 2]>,
    /// `‖C ΔQ‖²` per direction.
    pub square: Vector<D>,
}

impl<const D: usize> Step<D> {
    /// A change with its effect.
    pub fn new(constraints: &Constraints<'_, D>, changes: Vec<Vector<D>>) -> Self {
        let effects = constraints.effects(&changes);
        let square = products(&effects, &effects);
        Self { changes, effects, square }
    }

    /// Makes the effect orthogonal to that of an earlier step.
    pub fn avoid(&mut self, earlier: &Self) {
        let share = quotient(&products(&self.effects, &earlier.effects), &earlier.square);
        for (own, other) in self.changes.iter_mut().zip(&earlier.changes) {
            *own -= other.component_mul(&share);
        }
        let rows = Tensor::from_diagonal(&share);
        for (own, other) in self.effects.iter_mut().flatten().zip(earlier.effects.iter().flatten()) {
            own.constant -= other.constant.component_mul(&share);
            own.linear -= rows * other.linear;
        }
        self.square = products(&self.effects, &self.effects);
    }

    /// The length that makes the residuals smallest, per direction.
    pub fn length(&self, residuals: &[[Side<D>; 2]]) -> Vector<D> {
        quotient(&products(residuals, &self.effects), &self.square)
    }
}

/// Scalar products over all conditions, one per direction, in fixed order.
fn products<const D: usize>(a: &[[Side<D>; 2]], b: &[[Side<D>; 2]]) -> Vector<D> {
    a.iter().flatten().zip(b.iter().flatten()).fold(Vector::zeros(), |sum, (a, b)| {
        sum + a.constant.component_mul(&b.constant) + a.linear.component_mul(&b.linear).column_sum()
    })
}

/// `a/b` by component; zero for a direction in which nothing is left to do.
fn quotient<const D: usize>(a: &Vector<D>, b: &Vector<D>) -> Vector<D> {
    a.zip_map(b, |a, b| if b > 0.0 { a / b } else { 0.0 })
}

/// `ΔQ` of multipliers on the entries with both ends in the band, zero on the others.
pub(super) fn changes<const D: usize>(
    constraints: &Constraints<'_, D>,
    band: &[bool],
    multipliers: &[[Side<D>; 2]],
) -> Vec<Vector<D>> {
    let row = |a: usize| {
        constraints.row(a).map(move |entry| {
            let free = band[a] && band[constraints.neighbour(entry)];
            if free { constraints.change(a, entry, multipliers) } else { Vector::zeros() }
        })
    };
    (0..constraints.count()).into_par_iter().flat_map_iter(row).collect()
}
