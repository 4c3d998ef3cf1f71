//! Sparse LU with partial pivoting, by faer.
//!
//! faer factors compressed columns; our compressed rows are, read that way, the transposed matrix. So
//! `Aᵀ` is factored without a copy and `A x = b` solved with the transposed solve. The supernodal
//! variant is forced (the simplicial one can panic on a zero pivot) and runs on one thread: a second
//! one gains nothing and would change the last bits.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::lu::{LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::linalg::{LuError, qr};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

use super::direct::{Direct, delegate_to_direct};
use super::factor::Factors;
use super::{LinearError, SparsePattern, Tangent};

/// Sparse LU for any square matrix with entries (`P R A C Q = L U`; COLAMD ordering, partial pivoting,
/// equilibration), with iterative refinement. See Davis (2006), *Direct Methods for Sparse Linear
/// Systems*, ch. 6, for the method. The fill it tells is an upper bound for any choice of pivots.
pub struct SparseLu(Direct);

impl SparseLu {
    /// A solver that is not prepared yet.
    pub fn new() -> Self {
        Self(Direct::new(Box::new(LuFactors::new())))
    }
}

impl Default for SparseLu {
    fn default() -> Self {
        Self::new()
    }
}

delegate_to_direct!(SparseLu);

/// Symbolic and numeric factors of `Aᵀ`.
pub(super) struct LuFactors {
    symbolic: Option<SymbolicLu<usize>>,
    numeric: NumericLu<usize, f64>,
    memory: MemBuffer,
    fill: usize,
}

impl LuFactors {
    pub(super) fn new() -> Self {
        Self { symbolic: None, numeric: NumericLu::new(), memory: MemBuffer::new(StackReq::empty()), fill: 0 }
    }

    /// Prepares for matrices on a new pattern.
    pub(super) fn analyse_pattern(&mut self, pattern: &SparsePattern) -> Result<(), LinearError> {
        self.symbolic = None;
        let parameters = LuSymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_lu(transposed(pattern), parameters).map_err(failure)?;
        self.memory = memory(&[
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
            symbolic.solve_transpose_in_place_scratch::<f64>(1, Par::Seq),
        ])?;

        self.fill = fill_bound(pattern, &symbolic)?;
        self.symbolic = Some(symbolic);
        Ok(())
    }
}

/// A failure that has no better name.
pub(super) fn failure(error: impl std::fmt::Debug) -> LinearError {
    LinearError::Factorisation { reason: format!("{error:?}") }
}

/// The pattern as faer sees it: the columns of `Aᵀ`.
pub(super) fn transposed(pattern: &SparsePattern) -> SymbolicSparseColMatRef<'_, usize> {
    let n = pattern.size();
    SymbolicSparseColMatRef::new_checked(n, n, pattern.offsets(), None, pattern.columns())
}

/// Room for the larger of the requests, or an error when memory is short.
pub(super) fn memory(requests: &[StackReq]) -> Result<MemBuffer, LinearError> {
    MemBuffer::try_new(StackReq::any_of(requests)).map_err(|_| failure("out of memory"))
}

impl Factors for LuFactors {
    fn name(&self) -> &'static str {
        "sparse LU (faer)"
    }

    fn needs_symmetry(&self) -> bool {
        false
    }

    fn analyse(&mut self, pattern: &SparsePattern, _: &dyn Tangent) -> Result<(), LinearError> {
        self.analyse_pattern(pattern)
    }

    fn factor(&mut self, pattern: &SparsePattern, values: &[f64]) -> Result<(), LinearError> {
        let symbolic = self.symbolic.as_ref().ok_or(LinearError::NotPrepared)?;
        let matrix = SparseColMatRef::new(transposed(pattern), values);
        let stack = MemStack::new(&mut self.memory);
        match symbolic.factorize_numeric_lu(&mut self.numeric, matrix, Par::Seq, stack, Default::default()) {
            Ok(_) => Ok(()),
            Err(LuError::SymbolicSingular { index }) => {
                Err(LinearError::Singular { unknown: symbolic.col_perm().arrays().0.get(index).copied() })
            }
            Err(error) => Err(failure(error)),
        }
    }

    fn solve(&mut self, x: &mut [f64]) {
        let Some(symbolic) = &self.symbolic else { return };
        let n = x.len();
        LuRef::new_unchecked(symbolic, &self.numeric).solve_transpose_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }

    fn solve_transposed(&mut self, x: &mut [f64]) {
        let Some(symbolic) = &self.symbolic else { return };
        let n = x.len();
        LuRef::new_unchecked(symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }

    fn fill(&self) -> usize {
        self.fill
    }
}

/// An upper bound of the entries of `L` and `U` for any choice of pivots: `U` lies in the Cholesky
/// factor of `(Aᵀ)ᵀ Aᵀ`, and `L` in the Householder vectors of `Aᵀ` (George & Ng 1987). faer keeps
/// the true number to itself.
fn fill_bound(pattern: &SparsePattern, symbolic: &SymbolicLu<usize>) -> Result<usize, LinearError> {
    let n = pattern.size();
    let permutation = symbolic.col_perm();
    // The rows of `Aᵀ` are the columns of `A`, gathered by counting.
    let mut offsets = vec![0; n + 1];
    pattern.columns().iter().for_each(|&column| offsets[column + 1] += 1);
    for i in 0..n {
        offsets[i + 1] += offsets[i];
    }
    let mut next = offsets.clone();
    let mut rows = vec![0; pattern.entries()];
    for row in 0..n {
        for &column in pattern.row(row) {
            rows[next[column]] = row;
            next[column] += 1;
        }
    }
    let adjoint = SymbolicSparseColMatRef::new_checked(n, n, &offsets, None, &rows);

    let mut memory = memory(&[
        qr::col_etree_scratch::<usize>(n, n),
        qr::postorder_scratch::<usize>(n),
        qr::column_counts_aat_scratch::<usize>(n, n),
    ])?;
    let (mut parents, mut post, mut upper, mut first) = (vec![0; n], vec![0; n], vec![0; n], vec![0; n]);
    let tree = qr::col_etree(transposed(pattern), Some(permutation), &mut parents, MemStack::new(&mut memory));
    qr::postorder(&mut post, tree, MemStack::new(&mut memory));
    let stack = MemStack::new(&mut memory);
    qr::column_counts_ata(&mut upper, &mut first, adjoint, Some(permutation), tree, &post, stack);
    // Rows of `Aᵀ` begin at a column and climb the tree, losing one row at every pivot.
    let mut lower = vec![0_usize; n];
    first.iter().filter(|&&column| column < n).for_each(|&column| lower[column] += 1);
    for (column, &parent) in tree.into_inner().iter().enumerate() {
        if let Ok(parent) = usize::try_from(parent) {
            lower[parent] += lower[column].saturating_sub(1);
        }
    }
    Ok(upper.iter().sum::<usize>() + lower.iter().sum::<usize>() - n)
}
