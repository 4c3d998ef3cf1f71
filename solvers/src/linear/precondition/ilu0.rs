//! ILU(0): Gaussian elimination that drops every entry outside the pattern of `A`. Saad (2003),
//! algorithm 10.4 (row by row).
//!
//! On a symmetric matrix this is incomplete LDLᵀ in other words (`U = D Lᵀ`), so it serves CG as long
//! as all pivots are positive. Where pivots vanish or have the wrong sign, the diagonal is shifted,
//! `A + α diag`, with growing `α` (Manteuffel 1980).

use super::super::factor::check_entries;
use super::super::iteration::ApproximateInverse;
use super::super::{LinearCounts, LinearError, SparsePattern, Tangent};
use super::triangular::TriangularProduct;
use super::unsuitable;

/// Shifts that are tried, in units of the largest entry of the row.
const SHIFTS: [f64; 5] = [0.0, 1e-3, 1e-2, 1e-1, 1.0];
/// A usable pivot is at least this fraction of the largest entry of its row.
const SMALLEST_PIVOT: f64 = 1e-8;
const NOT_STORED: usize = usize::MAX;

/// ILU(0) of a matrix.
pub(super) struct Ilu0 {
    definite: bool,
    values: Vec<f64>,
    /// Where a column lies in the row at work.
    place: Vec<usize>,
    row: Vec<f64>,
    factors: TriangularProduct,
}

impl Ilu0 {
    /// Nothing factored yet; with `definite`, pivots must be positive.
    pub(super) fn new(definite: bool) -> Self {
        Self { definite, values: Vec::new(), place: Vec::new(), row: Vec::new(), factors: TriangularProduct::default() }
    }

    /// One attempt. False if a pivot is unusable.
    fn eliminate(&mut self, pattern: &SparsePattern, shift: f64) -> bool {
        self.factors.clear();
        for i in 0..pattern.size() {
            let columns = pattern.row(i);
            self.row.clear();
            self.row.extend_from_slice(&self.values[pattern.stored(i)]);
            let largest = self.row.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (k, &column) in columns.iter().enumerate() {
                self.place[column] = k;
            }
            let diagonal = self.place[i];
            self.row[diagonal] += (shift * largest).copysign(self.row[diagonal]);
            for (k, &earlier) in columns[..diagonal].iter().enumerate() {
                let multiplier = self.row[k] * self.factors.inverse_diagonal[earlier];
                for (column, value) in self.factors.upper.row(earlier) {
                    let place = self.place[column];
                    if place != NOT_STORED {
                        self.row[place] -= multiplier * value;
                    }
                }
                self.factors.lower.push(earlier, multiplier);
            }
            for (&column, &value) in columns.iter().zip(&self.row).skip(diagonal + 1) {
                self.factors.upper.push(column, value);
            }
            for &column in columns {
                self.place[column] = NOT_STORED;
            }
            self.factors.lower.close();
            self.factors.upper.close();
            let pivot = self.row[diagonal];
            let size = if self.definite { pivot } else { pivot.abs() };
            if !pivot.is_finite() || size <= SMALLEST_PIVOT * largest {
                return false;
            }
            self.factors.inverse_diagonal.push(1.0 / pivot);
        }
        true
    }
}

impl ApproximateInverse for Ilu0 {
    fn name(&self) -> String {
        "ILU(0)".to_owned()
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        let pattern = tangent.pattern().ok_or_else(|| LinearError::NeedsEntries { solver: self.name() })?;
        self.values.resize(pattern.entries(), 0.0);
        tangent.fill(&mut self.values);
        check_entries(pattern, &self.values)?;
        self.place.clear();
        self.place.resize(pattern.size(), NOT_STORED);
        for row in 0..pattern.size() {
            let Ok(k) = pattern.row(row).binary_search(&row) else {
                return Err(unsuitable("ILU(0)", format_args!("row {row} has no diagonal entry")));
            };
            let value = self.values[pattern.offsets()[row] + k];
            if self.definite && value <= 0.0 {
                return Err(LinearError::NotPositiveDefinite { unknown: Some(row), value });
            }
        }
        for shift in SHIFTS {
            counts.factorisations += 1;
            if self.eliminate(pattern, shift) {
                return Ok(());
            }
        }
        Err(unsuitable("ILU(0)", "no usable pivots, even with a shifted diagonal"))
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.factors.solve(r, z);
    }

    fn fill(&self) -> usize {
        self.factors.entries()
    }
}
