//! Orders of elimination, and the pivots of symmetric factors.

use faer::sparse::linalg::cholesky::supernodal::SupernodalLdltRef;
use faer::sparse::linalg::cholesky::{SymbolicCholesky, SymbolicCholeskyRaw};

use super::effort::FactorSize;

/// Positive pivots of an equilibrated matrix within this factor leave little doubt that it is regular.
const SIMILAR_PIVOTS: f64 = 1e-6;

/// The inverse of a permutation of `n` unknowns, if it is one.
pub(super) fn inverse(order: &[usize], n: usize) -> Option<Vec<usize>> {
    let mut inverse = vec![usize::MAX; n];
    for (k, &unknown) in order.iter().enumerate() {
        match inverse.get_mut(unknown) {
            Some(place) if *place == usize::MAX => *place = k,
            _ => return None,
        }
    }
    (order.len() == n).then_some(inverse)
}

/// The unknown that is eliminated as number `index`.
pub(super) fn unknown(symbolic: &SymbolicCholesky<usize>, index: usize) -> Option<usize> {
    symbolic.perm().map_or(Some(index), |p| p.arrays().0.get(index).copied())
}

/// Size of a factor.
pub(super) fn size_of(symbolic: &SymbolicCholesky<usize>) -> Option<FactorSize> {
    let SymbolicCholeskyRaw::Supernodal(nodes) = symbolic.raw() else { return None };
    let mut size = FactorSize::default();
    for (s, &end) in nodes.supernode_end().iter().enumerate() {
        let node = nodes.supernode(s);
        size.add((end - node.start()) as f64, node.pattern().len() as f64);
    }
    Some(size)
}

/// Entry `index` of `D`.
pub(super) fn pivot(symbolic: &SymbolicCholesky<usize>, values: &[f64], index: usize) -> f64 {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Simplicial(symbolic) => values[symbolic.col_ptr()[index]],
        SymbolicCholeskyRaw::Supernodal(symbolic) => {
            let node = symbolic.supernode_end().partition_point(|&end| end <= index);
            let node = SupernodalLdltRef::new(symbolic, values).supernode(node);
            node.val()[(index - node.start(), index - node.start())]
        }
    }
}

/// Whether all pivots are positive and of similar size. Then the matrix is positive definite, and
/// elimination without exchanges as stable as it gets (Higham 2002, §10.1).
pub(super) fn has_good_pivots(symbolic: &SymbolicCholesky<usize>, values: &[f64], square_roots: bool) -> bool {
    let SymbolicCholeskyRaw::Supernodal(symbolic) = symbolic.raw() else { return false };
    let factor = SupernodalLdltRef::new(symbolic, values);
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for node in 0..symbolic.n_supernodes() {
        let block = factor.supernode(node).val();
        for k in 0..block.ncols() {
            let pivot = if square_roots { block[(k, k)].powi(2) } else { block[(k, k)] };
            (smallest, largest) = (smallest.min(pivot), largest.max(pivot));
        }
    }
    smallest > SIMILAR_PIVOTS * largest && largest.is_finite()
}
