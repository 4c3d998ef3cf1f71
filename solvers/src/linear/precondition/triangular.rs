//! The product of a unit lower and an upper triangle, stored by rows.

/// `M = L U`: strictly lower entries of `L`, strictly upper ones of `U`, inverted diagonal of `U`.
#[derive(Debug, Default)]
pub(super) struct TriangularProduct {
    pub(super) lower: Rows,
    pub(super) upper: Rows,
    pub(super) inverse_diagonal: Vec<f64>,
}

/// Compressed rows that are appended one after the other.
#[derive(Debug, Default)]
pub(super) struct Rows {
    ends: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Rows {
    /// Forgets the rows and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.ends.clear();
        self.columns.clear();
        self.values.clear();
    }

    /// Appends an entry to the open row.
    pub(super) fn push(&mut self, column: usize, value: f64) {
        self.columns.push(column);
        self.values.push(value);
    }

    /// Closes the open row.
    pub(super) fn close(&mut self) {
        self.ends.push(self.columns.len());
    }

    /// Entries of a closed row.
    pub(super) fn row(&self, row: usize) -> impl DoubleEndedIterator<Item = (usize, f64)> + '_ {
        let start = if row == 0 { 0 } else { self.ends[row - 1] };
        let stored = start..self.ends[row];
        self.columns[stored.clone()].iter().copied().zip(self.values[stored].iter().copied())
    }
}

impl TriangularProduct {
    /// Forgets the entries and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.lower.clear();
        self.upper.clear();
        self.inverse_diagonal.clear();
    }

    /// Stored entries.
    pub(super) fn entries(&self) -> usize {
        self.lower.values.len() + self.upper.values.len() + self.inverse_diagonal.len()
    }

    /// `z = U⁻¹ L⁻¹ r`.
    pub(super) fn solve(&self, r: &[f64], z: &mut [f64]) {
        for row in 0..r.len() {
            let known: f64 = self.lower.row(row).map(|(column, value)| value * z[column]).sum();
            z[row] = r[row] - known;
        }
        for row in (0..r.len()).rev() {
            let known: f64 = self.upper.row(row).map(|(column, value)| value * z[column]).sum();
            z[row] = (z[row] - known) * self.inverse_diagonal[row];
        }
    }
}
