//! The normal equations `C Cᵀ (λ, μ) = r` of the least change, on the particles of a band.
//!
//! Only entries with both ends in the band are free. Rows couple to rows of the same particle and
//! columns to columns of the same particle only; the entry (a, b) couples the row of `a` with the column
//! of `b`. The matrix is the same for every direction.
//!
//! It is singular, because row sums and column sums add up to the same (Σ Q X_J is both), and nearly so
//! for every smooth field: `λ_a = (f, ½ s∇f)`, `μ_a = −(f, ½ s∇f)` changes pairs by the third differences of
//! `f` only, and a wave of `n` spacings has an eigenvalue of `(2π/n)⁶`. Conjugate gradients would need the
//! square root of that (measured: 5000 iterations at 41² particles); a factorisation does not mind. It
//! gets a diagonal that is larger by a part in 10¹³, and the iteration around it takes that error out
//! again: two to four steps up to 200² particles, nine at 316².

use std::sync::Arc;

use nicolson_solvers::linear::{
    EliminationOrder, LinearError, LinearSolver, SparseCholesky, SparsePattern, StoredTangent, Symmetry, Tangent,
};

use super::constraints::{Constraints, Side};
use super::ordering::nested_dissection;
use crate::tensor::Vector;

/// Part of the diagonal that is added to make the matrix definite.
const REGULARISATION: f64 = 1e-13;
/// Accuracy of one solve; the refinement works on the conditions themselves.
const SOLVE: f64 = 1e-2;

/// The factored normal equations of a band.
pub(super) struct NormalEquations {
    band: Vec<usize>,
    matrix: StoredTangent,
    solver: SparseCholesky,
}

impl NormalEquations {
    /// Assembles and factors the equations of the particles `inside`.
    ///
    /// # Errors
    /// Those of the factorisation.
    pub fn new<const D: usize>(constraints: &Constraints<'_, D>, inside: &[bool]) -> Result<Self, LinearError> {
        let band: Vec<usize> = (0..inside.len()).filter(|a| inside[*a]).collect();
        let matrix = assemble(constraints, inside, &band);
        let order = match D {
            // Measured: in 3D half the time of minimum degree, in 2D a little more.
            3 => EliminationOrder::Given(unknowns(constraints, &band).into()),
            _ => EliminationOrder::MinimumDegree,
        };
        let mut solver = SparseCholesky::new(order);
        solver.prepare(&matrix)?;
        Ok(Self { band, matrix, solver })
    }

    /// Multipliers for residuals, for all directions; zero outside the band.
    ///
    /// # Errors
    /// Those of the solver.
    pub fn solve<const D: usize>(&mut self, residuals: &[[Side<D>; 2]]) -> Result<Vec<[Side<D>; 2]>, LinearError> {
        let size = self.matrix.size();
        let (mut right, mut solution) = (vec![0.0; size], vec![0.0; size]);
        let mut multipliers = vec![[Side::zero(); 2]; residuals.len()];
        for direction in 0..D {
            for (unknown, value) in right.iter_mut().enumerate() {
                let (a, side, j) = self.place::<D>(unknown);
                *value = residuals[a][side].component(direction, j);
            }
            self.solver.solve(&self.matrix, &right, &mut solution, SOLVE)?;
            for (unknown, value) in solution.iter().enumerate() {
                let (a, side, j) = self.place::<D>(unknown);
                multipliers[a][side].set(direction, j, *value);
            }
        }
        Ok(multipliers)
    }

    /// Particle, side and component of an unknown.
    fn place<const D: usize>(&self, unknown: usize) -> (usize, usize, usize) {
        (self.band[unknown / (2 * (D + 1))], unknown / (D + 1) % 2, unknown % (D + 1))
    }
}

/// Unknowns of a band in the order of elimination by nested dissection.
fn unknowns<const D: usize>(constraints: &Constraints<'_, D>, band: &[usize]) -> Vec<usize> {
    let per_particle = 2 * (D + 1);
    let number = |a: usize| band.partition_point(|&b| b < a);
    let order = nested_dissection(constraints, band);
    order
        .into_iter()
        .flat_map(|a| (0..per_particle).map(move |j| (number(a), j)))
        .map(|(k, j)| k * per_particle + j)
        .collect()
}

/// Component `j` of `(1, d)`.
fn shape<const D: usize>(distance: &Vector<D>, j: usize) -> f64 {
    if j == 0 { 1.0 } else { distance[j - 1] }
}

fn assemble<const D: usize>(constraints: &Constraints<'_, D>, inside: &[bool], band: &[usize]) -> StoredTangent {
    let parts = D + 1;
    let mut number = vec![0; inside.len()];
    for (k, &a) in band.iter().enumerate() {
        number[a] = k;
    }
    let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for &a in band {
        let neighbours: Vec<(usize, Vector<D>)> = constraints
            .row(a)
            .map(|entry| constraints.neighbour(entry))
            .filter(|b| inside[*b])
            .map(|b| (b, constraints.distance(a, b)))
            .collect();
        for (side, i) in sides(parts) {
            let present = is_present(constraints, a, side, i);
            for (b, distance) in &neighbours {
                // The same side of another particle has no entry in common.
                for (other, j) in sides(parts).filter(|(other, _)| *other != side || *b == a) {
                    let value = if !(present && is_present(constraints, *b, other, j)) {
                        // Decoupled, so that all blocks are alike.
                        if (a, side, i) == (*b, other, j) { 1.0 } else { 0.0 }
                    } else if other != side {
                        shape(distance, i) * shape(&-distance, j)
                    } else {
                        let product: f64 = neighbours.iter().map(|(_, d)| shape(d, i) * shape(d, j)).sum();
                        if i == j { product * (1.0 + REGULARISATION) } else { product }
                    };
                    columns.push((2 * number[*b] + other) * parts + j);
                    values.push(value);
                }
            }
            offsets.push(columns.len());
        }
    }
    let pattern = Arc::new(SparsePattern::new(offsets, columns));
    StoredTangent::new(&pattern, values, Symmetry::PositiveDefinite)
}

/// Both sides of a particle with their components.
fn sides(parts: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..2).flat_map(move |side| (0..parts).map(move |j| (side, j)))
}

/// Whether there is a condition behind an unknown.
fn is_present<const D: usize>(constraints: &Constraints<'_, D>, a: usize, side: usize, j: usize) -> bool {
    side == 0 || j == 0 || constraints.has_linear_column(a)
}
