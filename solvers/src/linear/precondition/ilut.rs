//! ILUT: Gaussian elimination that drops by size instead of by position. Saad (1994), "ILUT: a dual
//! threshold incomplete LU factorization"; Saad (2003), algorithm 10.6.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::super::factor::check_entries;
use super::super::iteration::ApproximateInverse;
use super::super::{LinearCounts, LinearError, SparsePattern, Tangent};
use super::triangular::{Rows, TriangularProduct};
use super::unsuitable;
use crate::vector::norm;

/// A pivot below this fraction of the norm of its row is replaced (Saad 2003, §10.4.2).
const SMALLEST_PIVOT: f64 = 1e-4;

/// ILUT(τ, p) of a matrix: entries below `τ ‖a_i‖₂` are dropped, and each row of `L` and of `U` keeps as
/// many of the largest as `A` has there, and `p` more.
pub(super) struct Ilut {
    drop_tolerance: f64,
    fill: usize,
    values: Vec<f64>,
    /// The row at work, dense; and which of its entries exist.
    row: Vec<f64>,
    exists: Vec<bool>,
    /// Columns left of the diagonal that are still to be eliminated, smallest first.
    left: BinaryHeap<Reverse<usize>>,
    lower: Vec<(usize, f64)>,
    upper: Vec<usize>,
    kept: Vec<(usize, f64)>,
    factors: TriangularProduct,
}

impl Ilut {
    /// Nothing factored yet.
    pub(super) fn new(drop_tolerance: f64, fill: usize) -> Self {
        Self {
            drop_tolerance,
            fill,
            values: Vec::new(),
            row: Vec::new(),
            exists: Vec::new(),
            left: BinaryHeap::new(),
            lower: Vec::new(),
            upper: Vec::new(),
            kept: Vec::new(),
            factors: TriangularProduct::default(),
        }
    }

    /// Notes that the row at work has an entry in a column.
    fn occupy(&mut self, i: usize, column: usize) {
        if !self.exists[column] {
            self.exists[column] = true;
            if column < i {
                self.left.push(Reverse(column));
            } else {
                self.upper.push(column);
            }
        }
    }

    /// Eliminates one row. False if it is empty or not finite.
    fn eliminate(&mut self, pattern: &SparsePattern, i: usize) -> bool {
        let length = norm(&self.values[pattern.stored(i)]);
        let threshold = self.drop_tolerance * length;
        self.lower.clear();
        self.upper.clear();
        self.occupy(i, i);
        for (k, &column) in pattern.stored(i).zip(pattern.row(i)) {
            self.row[column] = self.values[k];
            self.occupy(i, column);
        }
        let below = pattern.row(i).partition_point(|&column| column < i);
        let above = pattern.row(i).len() - below;
        while let Some(Reverse(k)) = self.left.pop() {
            self.exists[k] = false;
            let multiplier = std::mem::take(&mut self.row[k]) * self.factors.inverse_diagonal[k];
            // The multiplier has the units of a ratio: it is compared as it was, times the pivot.
            if (multiplier / self.factors.inverse_diagonal[k]).abs() <= threshold {
                continue;
            }
            self.lower.push((k, multiplier));
            let upper = std::mem::take(&mut self.factors.upper);
            for (column, value) in upper.row(k) {
                self.occupy(i, column);
                self.row[column] -= multiplier * value;
            }
            self.factors.upper = upper;
        }
        let mut pivot = std::mem::take(&mut self.row[i]);
        self.exists[i] = false;
        self.kept.clear();
        for &column in self.upper.iter().filter(|&&column| column != i) {
            self.exists[column] = false;
            self.kept.push((column, std::mem::take(&mut self.row[column])));
        }
        self.kept.retain(|entry| entry.1.abs() > threshold);
        keep_largest(&mut self.lower, below + self.fill, &mut self.factors.lower);
        keep_largest(&mut self.kept, above.saturating_sub(1) + self.fill, &mut self.factors.upper);
        let smallest = SMALLEST_PIVOT * length;
        if pivot.abs() < smallest {
            pivot = smallest.copysign(pivot);
        }
        self.factors.inverse_diagonal.push(1.0 / pivot);
        pivot.is_finite() && pivot != 0.0
    }
}

/// Appends the largest entries, in the order of the columns. Of equal ones the first columns win, so
/// that the choice does not depend on how the selection works.
fn keep_largest(entries: &mut Vec<(usize, f64)>, number: usize, rows: &mut Rows) {
    if entries.len() > number {
        entries.sort_unstable_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
        entries.truncate(number);
    }
    entries.sort_unstable_by_key(|entry| entry.0);
    entries.iter().for_each(|&(column, value)| rows.push(column, value));
    rows.close();
}

impl ApproximateInverse for Ilut {
    fn name(&self) -> String {
        format!("ILUT({:e}, {})", self.drop_tolerance, self.fill)
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        let pattern = tangent.pattern().ok_or_else(|| LinearError::NeedsEntries { solver: self.name() })?;
        let n = pattern.size();
        self.values.resize(pattern.entries(), 0.0);
        tangent.fill(&mut self.values);
        check_entries(pattern, &self.values)?;
        counts.factorisations += 1;
        self.row.clear();
        self.row.resize(n, 0.0);
        self.exists.clear();
        self.exists.resize(n, false);
        self.left.clear();
        self.factors.clear();
        for i in 0..n {
            if !self.eliminate(pattern, i) {
                return Err(unsuitable("ILUT", format_args!("row {i} has no usable pivot")));
            }
        }
        Ok(())
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.factors.solve(r, z);
    }

    fn fill(&self) -> usize {
        self.factors.entries()
    }
}
