//! The symmetric part of an operator that is nearly symmetric: its LDLᵀ factor costs a fraction of an LU factor of the
//! whole, and a Krylov method makes up for the rest in a few iterations, the fewer the smaller the skew part.

use std::sync::Arc;

use super::super::iteration::{ApproximateInverse, is_known};
use super::super::{LinearCounts, LinearError, SparsePattern, StoredTangent, Symmetry, Tangent};
use super::unsuitable;

/// A preconditioner for symmetric matrices, built from `½(A + Aᵀ)`.
pub(super) struct SymmetricPart {
    inner: Box<dyn ApproximateInverse>,
    pattern: Option<Arc<SparsePattern>>,
    /// For every entry (i, j) the place of (j, i).
    twins: Vec<usize>,
    values: Vec<f64>,
}

impl SymmetricPart {
    pub(super) fn new(inner: Box<dyn ApproximateInverse>) -> Self {
        Self { inner, pattern: None, twins: Vec::new(), values: Vec::new() }
    }

    fn find_twins(&mut self, pattern: &Arc<SparsePattern>) -> Result<(), LinearError> {
        if is_known(&self.pattern, pattern) {
            return Ok(());
        }
        self.pattern = None;
        self.twins.clear();
        for row in 0..pattern.size() {
            for &column in pattern.row(row) {
                let Ok(position) = pattern.row(column).binary_search(&row) else {
                    let reason = format!("entry ({row}, {column}) of the pattern has no partner");
                    return Err(unsuitable("symmetric part", reason));
                };
                self.twins.push(pattern.stored(column).start + position);
            }
        }
        self.pattern = Some(Arc::clone(pattern));
        Ok(())
    }
}

impl ApproximateInverse for SymmetricPart {
    fn name(&self) -> String {
        format!("{} of the symmetric part", self.inner.name())
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        if tangent.symmetry() != Symmetry::General {
            return self.inner.prepare(tangent, counts);
        }
        let pattern = tangent.pattern().ok_or_else(|| LinearError::NeedsEntries { solver: self.name() })?;
        self.find_twins(pattern)?;
        self.values.resize(pattern.entries(), 0.0);
        tangent.fill(&mut self.values);
        let symmetric = self.values.iter().zip(&self.twins).map(|(value, &twin)| 0.5 * (value + self.values[twin]));
        let part = StoredTangent::new(pattern, symmetric.collect(), Symmetry::Symmetric);
        self.inner.prepare(&part, counts)
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.inner.apply(r, z);
    }

    fn fill(&self) -> usize {
        self.inner.fill()
    }
}
