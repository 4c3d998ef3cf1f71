//! Compressed sparse rows on a pattern that never changes. sprs holds the matrix; its types stay
//! private to this package.

use rayon::prelude::*;
use sprs::{CsMatBase, CsMatI};

/// Rows of a product that one thread takes at a time.
const ROWS: usize = 512;

/// Positions of the stored entries, row by row, columns ascending.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SparsePattern {
    size: usize,
    offsets: Vec<usize>,
    columns: Vec<usize>,
}

impl SparsePattern {
    /// A square pattern from row offsets and column indices.
    ///
    /// # Panics
    /// If the offsets are not ascending from 0 to `columns.len()`, or the columns of a row are not
    /// strictly ascending and inside the matrix (a programming error of the caller).
    pub fn new(offsets: Vec<usize>, columns: Vec<usize>) -> Self {
        let size = offsets.len().saturating_sub(1);
        assert!(offsets.first() == Some(&0), "offsets must start at 0");
        assert!(offsets.last() == Some(&columns.len()), "offsets must end at the number of columns");
        for row in offsets.windows(2) {
            assert!(row[0] <= row[1], "offsets must ascend");
            let columns = &columns[row[0]..row[1]];
            assert!(columns.windows(2).all(|c| c[0] < c[1]), "columns must ascend strictly");
            assert!(columns.last().is_none_or(|&c| c < size), "column outside the matrix");
        }
        Self { size, offsets, columns }
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.columns.len()
    }

    /// Start of every row in the arrays of columns and values, and the end of the last.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// Column of every stored entry.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// Where the entries of one row lie in the arrays of columns and values.
    pub fn stored(&self, row: usize) -> std::ops::Range<usize> {
        self.offsets[row]..self.offsets[row + 1]
    }

    /// Columns of one row.
    pub fn row(&self, row: usize) -> &[usize] {
        &self.columns[self.stored(row)]
    }
}

/// A square sparse matrix in compressed rows.
#[derive(Debug, Clone)]
pub struct SparseMatrix {
    inner: CsMatI<f64, usize>,
}

impl SparseMatrix {
    /// A matrix of zeros on a pattern.
    pub fn zeros(pattern: &SparsePattern) -> Self {
        Self::new(pattern, vec![0.0; pattern.entries()])
    }

    /// A matrix with given entries on a pattern.
    ///
    /// # Panics
    /// If the number of values differs from that of the pattern.
    pub fn new(pattern: &SparsePattern, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), pattern.entries(), "as many values as entries");
        let n = pattern.size();
        Self { inner: CsMatBase::new((n, n), pattern.offsets.clone(), pattern.columns.clone(), values) }
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.inner.rows()
    }

    /// The stored values, row by row.
    pub fn values(&self) -> &[f64] {
        self.inner.data()
    }

    /// The stored values, to be overwritten.
    pub fn values_mut(&mut self) -> &mut [f64] {
        self.inner.data_mut()
    }

    /// An entry; zero where nothing is stored.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.inner.get(row, column).copied().unwrap_or(0.0)
    }

    /// `out = A v`, each row summed in the order of its columns, whatever the number of threads.
    pub fn apply(&self, v: &[f64], out: &mut [f64]) {
        let (offsets, columns, values) = (self.inner.indptr(), self.inner.indices(), self.inner.data());
        let offsets = offsets.raw_storage();
        out.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, out)| {
            for (row, out) in (chunk * ROWS..).zip(out) {
                let stored = offsets[row]..offsets[row + 1];
                *out = values[stored.clone()].iter().zip(&columns[stored]).map(|(a, &column)| a * v[column]).sum();
            }
        });
    }

    /// Writes the matrix in the Matrix Market exchange format (coordinate, real, general).
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_matrix_market(&self, path: &std::path::Path) -> std::io::Result<()> {
        sprs::io::write_matrix_market(path, self.inner.view())
    }
}
