//! The lattices below the finest one: products and smoothing with entries, a direct factor at the end.

use std::sync::Arc;

use super::super::factor::FactoredMatrix;
use super::super::iteration::ApproximateInverse;
use super::super::ldlt::{EliminationOrder, SymmetricFactors, Variant};
use super::super::precondition::BlockInverses;
use super::super::{LinearCounts, LinearError, SparsePattern, StoredTangent, Symmetry};
use super::chebyshev::Chebyshev;
use super::coarse::CoarseMatrix;
use super::coarsening::Coarsening;
use super::tents::Tents;

/// Shift of the diagonal that makes dependent functions harmless, in fractions of it; then more, where rounding or a
/// loss of stability has made the matrix indefinite.
const SHIFTS: [f64; 5] = [1e-9, 1e-6, 1e-3, 1e-1, 1.0];
/// Terms of the smoother, and ratio of the ends of its interval.
const DEGREE: usize = 2;
const RATIO: f64 = 6.0;
/// A lattice that does not shrink by this factor ends the sequence.
const SHRINKS: f64 = 0.7;

struct Level {
    matrix: CoarseMatrix,
    smoother: Chebyshev,
    coarsening: Coarsening,
    residual: Vec<f64>,
    product: Vec<f64>,
    right: Vec<f64>,
    left: Vec<f64>,
}

/// Coarse matrices, finest first, and the factor of the last.
pub(super) struct Hierarchy {
    levels: Vec<Level>,
    factor: FactoredMatrix,
    entries: usize,
}

impl Hierarchy {
    /// Coarsens until at most `coarsest` unknowns are left, and factors what is left.
    pub(super) fn new(mut matrix: CoarseMatrix, tents: &Tents, coarsest: usize) -> Result<Self, LinearError> {
        matrix.finish(SHIFTS[0]);
        let mut levels = Vec::new();
        let mut next = tents.coarser();
        let mut entries = 0;
        #[expect(clippy::cast_precision_loss, reason = "sizes, for a ratio")]
        while matrix.size() > coarsest && (next.nodes as f64) < SHRINKS * matrix.nodes() as f64 {
            let mut coarser = matrix.coarsened(&next);
            coarser.finish(SHIFTS[0]);
            let size = matrix.size();
            let inverses = BlockInverses::uniform(matrix.dimension(), matrix.diagonal_blocks());
            let smoother = Chebyshev::new(inverses, &|v, out| matrix.apply(v, out), size);
            let below = next.coarser();
            entries += matrix.entries();
            levels.push(Level {
                smoother,
                residual: vec![0.0; size],
                product: vec![0.0; size],
                right: vec![0.0; coarser.size()],
                left: vec![0.0; coarser.size()],
                coarsening: std::mem::replace(&mut next, below),
                matrix: std::mem::replace(&mut matrix, coarser),
            });
        }
        let factor = factored(matrix)?;
        entries += factor.fill();
        Ok(Self { levels, factor, entries })
    }

    /// Stored numbers.
    pub(super) fn entries(&self) -> usize {
        self.entries
    }

    /// One symmetric cycle.
    pub(super) fn solve(&mut self, right: &[f64], left: &mut [f64]) {
        cycle(&mut self.levels, &mut self.factor, right, left);
    }
}

fn cycle(levels: &mut [Level], factor: &mut FactoredMatrix, r: &[f64], z: &mut [f64]) {
    let Some((level, below)) = levels.split_first_mut() else { return factor.apply(r, z) };
    let Level { matrix, smoother, coarsening, residual, product, right, left } = level;
    let action = |v: &[f64], out: &mut [f64]| matrix.apply(v, out);
    let d = matrix.dimension();
    z.fill(0.0);
    residual.copy_from_slice(r);
    smoother.smooth(&action, residual, z, DEGREE, RATIO);
    let mut subtract = |z: &[f64], residual: &mut [f64]| {
        matrix.apply(z, product);
        residual.iter_mut().zip(r).zip(product.iter()).for_each(|((out, r), p)| *out = r - p);
    };
    subtract(z, residual);
    coarsening.restrict(d, residual, right);
    cycle(below, factor, right, left);
    coarsening.prolong(d, left, z);
    subtract(z, residual);
    smoother.smooth(&action, residual, z, DEGREE, RATIO);
}

/// The Cholesky factor of the coarsest matrix, shifted as much as it needs.
fn factored(mut matrix: CoarseMatrix) -> Result<FactoredMatrix, LinearError> {
    let d = matrix.dimension();
    let (mut offsets, mut columns) = (vec![0], Vec::new());
    for row in 0..matrix.nodes() {
        for _ in 0..d {
            columns.extend(matrix.row(row).flat_map(|(column, _)| column * d..(column + 1) * d));
            offsets.push(columns.len());
        }
    }
    let pattern = Arc::new(SparsePattern::new(offsets, columns));
    let mut outcome = Err(LinearError::NotPrepared);
    for shift in SHIFTS {
        let mut values = Vec::with_capacity(pattern.entries());
        for row in 0..matrix.nodes() {
            for i in 0..d {
                values.extend(matrix.row(row).flat_map(|(_, block)| block[i * d..(i + 1) * d].iter().copied()));
            }
        }
        let tangent = StoredTangent::new(&pattern, values, Symmetry::PositiveDefinite);
        let mut factor =
            FactoredMatrix::new(Box::new(SymmetricFactors::new(Variant::Cholesky, EliminationOrder::default())));
        match factor.prepare(&tangent, &mut LinearCounts::default()) {
            Ok(()) => return Ok(factor),
            Err(error) => outcome = Err(error),
        }
        matrix.finish(shift);
    }
    outcome
}
