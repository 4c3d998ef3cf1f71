//! The symmetric part of an operator that is nearly symmetric: its LDLᵀ factor costs a fraction of an LU factor of the
//! whole, and a Krylov method makes up for the rest in a few iterations, the fewer the smaller the skew part.

use std::sync::Arc;

use super::super::iteration::{ApproximateInverse, is_known};
use super::super::{LinearCounts, LinearError, OperatorAge, Places, SparsePattern, Symmetry, Tangent};
use super::unsuitable;
use crate::snapshot::{RestoreError, Snapshot};

/// Finds the symmetric part of one operator after another.
#[derive(Debug, Default)]
pub(in super::super) struct SymmetricPart {
    pattern: Option<Arc<SparsePattern>>,
    /// For every entry (i, j) the place of (j, i).
    twins: Vec<usize>,
}

/// A preconditioner for symmetric matrices, built from `½(A + Aᵀ)`.
pub(super) struct OfSymmetricPart {
    inner: Box<dyn ApproximateInverse>,
    part: SymmetricPart,
}

/// `½(A + Aᵀ)`, as far as a factorisation asks.
pub(in super::super) struct HalfSum<'a> {
    whole: &'a dyn Tangent,
    twins: &'a [usize],
}

impl Tangent for HalfSum<'_> {
    fn size(&self) -> usize {
        self.whole.size()
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        self.whole.apply(v, out);
    }

    fn pattern(&self) -> Option<&Arc<SparsePattern>> {
        self.whole.pattern()
    }

    fn fill(&self, values: &mut [f64]) {
        self.whole.fill(values);
        // The pair is visited from its first entry, which is still the old one then; so is its twin.
        for (place, &twin) in self.twins.iter().enumerate().filter(|(place, twin)| place < *twin) {
            let mean = 0.5 * (values[place] + values[twin]);
            (values[place], values[twin]) = (mean, mean);
        }
    }

    fn blocks(&self) -> &[usize] {
        self.whole.blocks()
    }

    fn places(&self) -> Option<Places> {
        self.whole.places()
    }
}

impl OfSymmetricPart {
    pub(super) fn new(inner: Box<dyn ApproximateInverse>) -> Self {
        Self { inner, part: SymmetricPart::default() }
    }
}

impl SymmetricPart {
    /// `½(A + Aᵀ)`.
    pub(in super::super) fn of<'a>(&'a mut self, tangent: &'a dyn Tangent) -> Result<HalfSum<'a>, LinearError> {
        let pattern = tangent.pattern().ok_or_else(|| LinearError::NeedsEntries { solver: "symmetric part".into() })?;
        self.find_twins(pattern)?;
        Ok(HalfSum { whole: tangent, twins: &self.twins })
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

impl ApproximateInverse for OfSymmetricPart {
    fn name(&self) -> String {
        format!("{} of the symmetric part", self.inner.name())
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        if tangent.symmetry() != Symmetry::General {
            return self.inner.prepare(tangent, counts);
        }
        self.inner.prepare(&self.part.of(tangent)?, counts)
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.inner.apply(r, z);
    }

    fn fill(&self) -> usize {
        self.inner.fill()
    }

    fn keeps_older_operator(&self) -> bool {
        self.inner.keeps_older_operator()
    }

    fn save(&self) -> Snapshot {
        self.inner.save()
    }

    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        if tangent.symmetry() != Symmetry::General {
            return self.inner.restore(saved, tangent, age);
        }
        self.inner.restore(saved, &self.part.of(tangent)?, age)
    }
}
