//! What a preconditioner is shown of the operator: its entries as they were assembled, or none.

use std::sync::Arc;

use super::super::{CoarseMatrix, Geometry, LinearError, Places, SparsePattern, Symmetry, Tangent, Tents};
use crate::snapshot::RestoreError;

/// The operator with entries that are already there.
pub(super) struct Assembled<'a> {
    pub(super) tangent: &'a dyn Tangent,
    pub(super) values: &'a [f64],
}

impl Tangent for Assembled<'_> {
    fn size(&self) -> usize {
        self.tangent.size()
    }

    fn symmetry(&self) -> Symmetry {
        self.tangent.symmetry()
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        self.tangent.apply(v, out);
    }

    fn pattern(&self) -> Option<&Arc<SparsePattern>> {
        self.tangent.pattern()
    }

    fn fill(&self, values: &mut [f64]) {
        values.copy_from_slice(self.values);
    }

    fn blocks(&self) -> &[usize] {
        self.tangent.blocks()
    }

    fn geometry(&self) -> Option<Geometry> {
        self.tangent.geometry()
    }

    fn project(&self, tents: &Tents, coarse: &mut CoarseMatrix) -> bool {
        self.tangent.project(tents, coarse)
    }

    fn sparser(&self) -> Option<&dyn Tangent> {
        self.tangent.sparser()
    }
}

/// The operator with its entries hidden, so that nobody builds their pattern.
pub(super) struct WithoutEntries<'a> {
    pub(super) tangent: &'a dyn Tangent,
}

impl Tangent for WithoutEntries<'_> {
    fn size(&self) -> usize {
        self.tangent.size()
    }

    fn symmetry(&self) -> Symmetry {
        self.tangent.symmetry()
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        self.tangent.apply(v, out);
    }

    fn blocks(&self) -> &[usize] {
        self.tangent.blocks()
    }

    fn offers_diagonal_blocks(&self) -> bool {
        self.tangent.offers_diagonal_blocks()
    }

    fn diagonal_blocks(&self, values: &mut [f64]) {
        self.tangent.diagonal_blocks(values);
    }

    fn geometry(&self) -> Option<Geometry> {
        self.tangent.geometry()
    }

    fn project(&self, tents: &Tents, coarse: &mut CoarseMatrix) -> bool {
        self.tangent.project(tents, coarse)
    }

    fn places(&self) -> Option<Places> {
        self.tangent.places()
    }

    fn sparser(&self) -> Option<&dyn Tangent> {
        self.tangent.sparser()
    }
}

/// Tells the one failure after which an operator is shown with its entries.
pub(super) trait IsNeedOfEntries {
    fn is_need_of_entries(&self) -> bool;
}

impl IsNeedOfEntries for LinearError {
    fn is_need_of_entries(&self) -> bool {
        matches!(self, Self::NeedsEntries { .. })
    }
}

impl IsNeedOfEntries for RestoreError {
    fn is_need_of_entries(&self) -> bool {
        matches!(self, Self::Linear(error) if error.is_need_of_entries())
    }
}
