//! A matrix as an operator: for preconditioners, and for systems that are matrices to begin with.

use std::sync::Arc;

use super::{SparseMatrix, SparsePattern, Symmetry, Tangent};

/// A [`Tangent`] that owns its entries.
#[derive(Debug, Clone)]
pub struct StoredTangent {
    pattern: Arc<SparsePattern>,
    matrix: SparseMatrix,
    symmetry: Symmetry,
}

impl StoredTangent {
    /// The operator with these entries, in the order of the pattern. The symmetry is the caller's word.
    ///
    /// # Panics
    /// If there is not one value per entry of the pattern (a programming error of the caller).
    pub fn new(pattern: &Arc<SparsePattern>, values: Vec<f64>, symmetry: Symmetry) -> Self {
        Self { pattern: Arc::clone(pattern), matrix: SparseMatrix::new(pattern, values), symmetry }
    }
}

impl Tangent for StoredTangent {
    fn size(&self) -> usize {
        self.pattern.size()
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        self.matrix.apply(v, out);
    }

    fn pattern(&self) -> Option<&Arc<SparsePattern>> {
        Some(&self.pattern)
    }

    fn fill(&self, values: &mut [f64]) {
        values.copy_from_slice(self.matrix.values());
    }
}
