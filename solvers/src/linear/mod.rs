//! Linear systems `A x = b`.
//!
//! A [`Tangent`] is first an *action* `v ↦ A v`; sparse entries on a pattern that never changes are a
//! capability it may have. A [`LinearSolver`] is prepared (analysed once per pattern, factored when
//! told) and then solves any number of right-hand sides; it checks every solution against the
//! operator itself and never returns one that is not finite or not accurate.
//!
//! Keeping an old factor is not a mode: it is simply not calling [`LinearSolver::prepare`].
//!
//! [`LinearSolverChoice`] names the solvers as plain data and builds them:
//!
//! | choice | needs | notes |
//! |---|---|---|
//! | [`SparseLu`] | entries | any matrix; ten times the cost of LDLᵀ |
//! | [`SparseLdlt`] | entries, symmetry | falls back to more pivoting, and to LU, by itself |
//! | [`SparseCholesky`] | entries, symmetry, definiteness | names the unknown that loses definiteness |
//! | GMRES(m) | an action | robust; `m + 1` vectors |
//! | BiCGStab | an action | seven vectors |
//! | CG | an action, symmetry, definiteness | four vectors; reports negative curvature |
//! | MINRES | an action, symmetry | seven vectors; a preconditioner must be positive definite |
//! | automatic | an action; entries for its better half | iterates, or factors, by counted costs |
//!
//! The direct solvers probe every factor (faer's LU answers `Ok` on singular matrices) and refine every
//! solution until the residual of the operator itself meets the tolerance. The Krylov methods take a
//! [`Preconditioner`] built from the entries of the operator or of its [`sparser`](Tangent::sparser)
//! relative; block Jacobi and multigrid also work from [diagonal blocks](Tangent::diagonal_blocks) and
//! [geometry](Tangent::geometry), without any entry. There is no QR factorisation: it costs fifty times LU.

mod automatic;
mod bicgstab;
mod cg;
mod choice;
mod direct;
mod effort;
mod elimination;
mod factor;
mod gmres;
mod iteration;
mod krylov;
mod ldlt;
mod lu;
mod minres;
mod multigrid;
mod pivots;
mod precondition;
mod scaling;
mod sparse;
mod stored;

use std::sync::Arc;

use crate::snapshot::{RestoreError, Snapshot};

pub use choice::{
    AutomaticOptions, InvalidChoice, KrylovOptions, LinearSolverChoice, Operator, Preconditioner, PreconditionerMatrix,
};
pub use effort::Effort;
pub use elimination::Places;
pub use ldlt::{EliminationOrder, SparseCholesky, SparseLdlt};
pub use lu::SparseLu;
pub use multigrid::{CoarseMatrix, Geometry, MultigridOptions, PointTents, Tents};
pub use sparse::{SparseMatrix, SparsePattern};
pub use stored::StoredTangent;

/// What is known about the symmetry of an operator, by construction (not by inspection).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// Symmetric, and positive definite as long as the solution is stable.
    PositiveDefinite,
    /// Symmetric, possibly indefinite.
    Symmetric,
    /// Not symmetric.
    General,
}

/// A linear operator on flat vectors: the derivative of a residual at a frozen point.
pub trait Tangent: Sync {
    /// Number of rows and columns.
    fn size(&self) -> usize;

    /// Symmetry that holds by construction.
    fn symmetry(&self) -> Symmetry {
        Symmetry::General
    }

    /// `out = A v`, without entries. Both have [`size`](Self::size) entries.
    fn apply(&self, v: &[f64], out: &mut [f64]);

    /// The pattern of the entries, if the operator can deliver entries; the same `Arc` for the whole
    /// life of the operator, so that a solver knows when its analysis is still good.
    fn pattern(&self) -> Option<&Arc<SparsePattern>> {
        None
    }

    /// Writes the entries in the order of [`pattern`](Self::pattern).
    ///
    /// Called only when there is a pattern. Not finite entries are the caller's to detect.
    fn fill(&self, values: &mut [f64]) {
        let _ = values;
    }

    /// Boundaries of the diagonal blocks of unknowns that belong together (for block Jacobi):
    /// block `i` is `blocks[i]..blocks[i + 1]`. Empty: every unknown is its own block.
    fn blocks(&self) -> &[usize] {
        &[]
    }

    /// Whether [`diagonal_blocks`](Self::diagonal_blocks) are to be had without entries.
    fn offers_diagonal_blocks(&self) -> bool {
        false
    }

    /// Writes the diagonal blocks, one after the other, each by rows: those of [`blocks`](Self::blocks). They may be
    /// approximate, since they only serve preconditioners.
    ///
    /// Called only where they are [offered](Self::offers_diagonal_blocks).
    fn diagonal_blocks(&self, values: &mut [f64]) {
        let _ = values;
    }

    /// Where the unknowns are in space, if they are components of vectors at points; for multigrid.
    fn geometry(&self) -> Option<Geometry> {
        None
    }

    /// Adds `Pᵀ A P` to a coarse matrix, where the columns of P are tent functions, one for every node and component;
    /// only the symmetric part counts. False if the operator cannot do it: multigrid then takes its entries.
    fn project(&self, tents: &Tents, coarse: &mut CoarseMatrix) -> bool {
        let _ = (tents, coarse);
        false
    }

    /// Where the [blocks](Self::blocks) of unknowns are in space, if they are anywhere: a good order of elimination
    /// follows from it.
    fn places(&self) -> Option<Places> {
        None
    }

    /// What an action and the entries cost, if the operator knows; needs no pattern.
    fn effort(&self) -> Option<Effort> {
        None
    }

    /// A sparser operator close to this one, as material for a preconditioner (the coupling between
    /// direct neighbours only, say).
    fn sparser(&self) -> Option<&dyn Tangent> {
        None
    }
}

impl LinearCounts {
    pub(crate) fn save(&self) -> Snapshot {
        let Self { analyses, factorisations, solves, iterations } = *self;
        let mut saved = Snapshot::new();
        saved.put_counts("counts", &[analyses, factorisations, solves, iterations]);
        saved
    }

    pub(crate) fn restored(saved: &Snapshot) -> Result<Self, RestoreError> {
        let [analyses, factorisations, solves, iterations] = saved.counts("counts")?;
        Ok(Self { analyses, factorisations, solves, iterations })
    }
}

/// Counters of the work a linear solver has done since it was built.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LinearCounts {
    /// Symbolic analyses of a pattern.
    pub analyses: usize,
    /// Numeric factorisations (of the matrix or of a preconditioner).
    pub factorisations: usize,
    /// Right-hand sides solved.
    pub solves: usize,
    /// Iterations of an iterative method, including iterative refinement.
    pub iterations: usize,
}

/// How a solver describes itself once prepared.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSolverInfo {
    /// Name in words (`"sparse LU (faer)"`, `"GMRES(30) + ILU(0)"`).
    pub name: String,
    /// Number of unknowns of the last prepared operator.
    pub unknowns: usize,
    /// Stored entries of the operator (0 if matrix-free).
    pub entries: usize,
    /// Stored entries of the factor or preconditioner.
    pub fill: usize,
    /// Threads used inside the solver.
    pub threads: usize,
    /// Why a solver that chooses for itself chose this; empty for others.
    pub reason: String,
}

/// What one solve did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearReport {
    /// Iterations (0 for a direct solve without refinement).
    pub iterations: usize,
    /// `‖b − A x‖ / ‖b‖`, computed from the operator itself.
    pub relative_residual: f64,
}

/// Why a linear solve failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearError {
    /// The solver needs entries and the operator has none.
    #[error(
        "{solver} needs matrix entries, but the operator is matrix-free: choose a Krylov method with a preconditioner that needs none"
    )]
    NeedsEntries {
        /// The solver that was asked.
        solver: String,
    },
    /// Multigrid was given an operator whose unknowns have no place in space.
    #[error(
        "multigrid needs unknowns that are components of vectors at points, and this operator has others: choose velocities as the only unknowns, or another preconditioner"
    )]
    NeedsGeometry,
    /// A symmetric solver was given an operator that is not.
    #[error("{solver} needs a symmetric matrix, but this one is not: choose LU, GMRES or BiCGStab")]
    NeedsSymmetry {
        /// The solver that was asked.
        solver: String,
    },
    /// An entry of the matrix is NaN or infinite.
    #[error("matrix entry in row {row} is not finite")]
    EntryNotFinite {
        /// Row of the entry.
        row: usize,
    },
    /// The right-hand side is NaN or infinite.
    #[error("right-hand side entry {row} is not finite")]
    RightHandSideNotFinite {
        /// Index of the entry.
        row: usize,
    },
    /// Structurally or numerically singular.
    #[error("matrix is singular{}", unknown.map(|u| format!(" at unknown {u}")).unwrap_or_default())]
    Singular {
        /// The unknown whose pivot vanished, if known.
        unknown: Option<usize>,
    },
    /// A pivot or a curvature `vᵀAv` is negative where a positive definite matrix was promised.
    #[error("matrix is not positive definite (curvature {value:e}){}", unknown.map(|u| format!(" at unknown {u}")).unwrap_or_default())]
    NotPositiveDefinite {
        /// The unknown whose pivot was negative, if known.
        unknown: Option<usize>,
        /// The negative curvature or pivot.
        value: f64,
    },
    /// A direct solve whose residual stays too large after refinement; the solution vector holds the best one found.
    #[error("direct solve is inaccurate: relative residual {relative_residual:e}")]
    Inaccurate {
        /// Residual reached.
        relative_residual: f64,
    },
    /// The iteration limit was reached.
    #[error("no convergence in {iterations} iterations: relative residual {relative_residual:e}")]
    IterationLimit {
        /// Iterations done.
        iterations: usize,
        /// Best residual reached.
        relative_residual: f64,
    },
    /// The method broke down (division by a vanishing product).
    #[error("iteration broke down after {iterations} iterations: relative residual {relative_residual:e}")]
    Breakdown {
        /// Iterations done.
        iterations: usize,
        /// Residual at the break-down.
        relative_residual: f64,
    },
    /// A vector has the wrong length.
    #[error("vector of length {found} where {expected} was expected")]
    WrongLength {
        /// Size of the operator.
        expected: usize,
        /// Length given.
        found: usize,
    },
    /// `solve` was called before a successful `prepare`.
    #[error("the solver has not been prepared")]
    NotPrepared,
    /// The sparse factorisation ran out of memory or failed in a way that has no better name.
    #[error("factorisation failed: {reason}")]
    Factorisation {
        /// What the factorisation reported.
        reason: String,
    },
}

/// Which operator a solver is given back when it is [restored](LinearSolver::restore).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OperatorAge {
    /// One before the last, that parts of the solver were made of; only where it
    /// [keeps such parts](LinearSolver::keeps_older_operator).
    Older,
    /// The one it was prepared with last.
    Last,
}

/// Solves `A x = b` for one operator after another.
pub trait LinearSolver: Send {
    /// Name, size, fill and threads of the last prepared operator.
    fn info(&self) -> LinearSolverInfo;

    /// Work done since the solver was built.
    fn counts(&self) -> LinearCounts;

    /// Takes the operator at its present values: analyses the pattern if it is new, then factors (or
    /// builds the preconditioner).
    ///
    /// # Errors
    /// [`LinearError`] if the operator does not suit the solver, is not finite, or is singular.
    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError>;

    /// Time spent in solves, so far, on factors that turned out to be needed: it belongs to preparation.
    fn late_preparation(&self) -> std::time::Duration {
        std::time::Duration::ZERO
    }

    /// Whether a part of it was made of an older operator than that of the last [`prepare`](Self::prepare) (or of a
    /// [`solve`](Self::solve) since).
    fn keeps_older_operator(&self) -> bool {
        false
    }

    /// What it remembers beside what it makes of operators.
    fn save(&self) -> Snapshot {
        Snapshot::new()
    }

    /// Makes it again what it was when it was [saved](Self::save), to the last bit, from its operators: first the older
    /// one, if it keeps parts of one, then the last one.
    ///
    /// # Errors
    /// [`RestoreError`] if the snapshot is not that of such a solver, or if the operator cannot be taken.
    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        let _ = saved;
        if age == OperatorAge::Last { Ok(self.prepare(tangent)?) } else { Ok(()) }
    }

    /// `x = A⁻¹ b` with the factor of the last [`prepare`](Self::prepare) and without a look at the residual, for a
    /// caller who looks at it himself. `None` from a solver that has no factor of just that operator.
    fn solve_unchecked(&mut self, b: &[f64], x: &mut [f64]) -> Option<Result<(), LinearError>> {
        let _ = (b, x);
        None
    }

    /// Solves `A x = b` to `‖b − A x‖ ≤ tolerance ‖b‖`, with the factor or preconditioner of the last
    /// [`prepare`](Self::prepare); `tangent` may have moved on since (a stale factor is then a
    /// preconditioner for the present operator). `x` holds nothing on entry.
    ///
    /// # Errors
    /// [`LinearError`]; `x` is then unspecified and not to be used, except after [`LinearError::Inaccurate`].
    fn solve(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError>;
}
