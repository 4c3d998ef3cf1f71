//! The choice of a linear solver as plain data.

use super::automatic::Automatic;
use super::bicgstab::BiCgStab;
use super::cg::Cg;
use super::gmres::Gmres;
use super::krylov::{Krylov, Method};
use super::minres::Minres;
use super::multigrid::MultigridOptions;
use super::{EliminationOrder, LinearSolver, SparseCholesky, SparseLdlt, SparseLu};

/// Which linear solver to use, and with what settings.
///
/// Symmetric operators are served best by [`Ldlt`](Self::Ldlt) (small and two-dimensional) and
/// [`Cg`](Self::Cg) (large and three-dimensional); everything else by [`Lu`](Self::Lu) where it fits
/// into memory, and [`Gmres`](Self::Gmres) or [`BiCgStab`](Self::BiCgStab) where it does not. The
/// default, LU, takes every operator with entries.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub enum LinearSolverChoice {
    /// Sparse LU: any matrix with entries.
    #[default]
    Lu,
    /// Iterates or factors, by counted costs: any operator.
    Automatic(AutomaticOptions),
    /// Sparse LDLᵀ: symmetric matrices with entries.
    Ldlt {
        /// Order of elimination.
        order: EliminationOrder,
    },
    /// Sparse Cholesky: symmetric positive definite matrices with entries.
    Cholesky {
        /// Order of elimination.
        order: EliminationOrder,
    },
    /// GMRES(m): any operator.
    Gmres {
        /// Length `m` of a cycle; `m + 1` vectors are stored.
        restart: usize,
        /// Settings of the iteration.
        krylov: KrylovOptions,
    },
    /// BiCGStab: any operator, with seven vectors of memory.
    BiCgStab {
        /// Settings of the iteration.
        krylov: KrylovOptions,
    },
    /// Conjugate gradients: symmetric positive definite operators.
    Cg {
        /// Settings of the iteration.
        krylov: KrylovOptions,
    },
    /// MINRES: symmetric operators, definite or not.
    Minres {
        /// Settings of the iteration.
        krylov: KrylovOptions,
    },
}

/// Settings of the solver that chooses for itself.
#[derive(Debug, Clone, PartialEq)]
pub struct AutomaticOptions {
    /// Factor whatever it costs, unless memory forbids it.
    pub direct: bool,
    /// Keep a factor for later operators as long as that is cheaper than another one.
    pub keeps: bool,
    /// Length of a cycle of GMRES.
    pub restart: usize,
    /// Iterations at most in one solve.
    pub max_iterations: usize,
}

impl Default for AutomaticOptions {
    fn default() -> Self {
        Self { direct: false, keeps: true, restart: 50, max_iterations: 1000 }
    }
}

/// Settings that all Krylov methods share.
#[derive(Debug, Clone, PartialEq)]
pub struct KrylovOptions {
    /// The preconditioner.
    pub preconditioner: Preconditioner,
    /// The matrix it is built from.
    pub preconditioner_matrix: PreconditionerMatrix,
    /// Where products with the operator come from.
    pub operator: Operator,
    /// Iterations at most in one solve.
    pub max_iterations: usize,
    /// The loosest relative residual that is accepted; a caller may ask for a smaller one, and with
    /// `None` the caller alone decides.
    pub tolerance: Option<f64>,
}

impl Default for KrylovOptions {
    fn default() -> Self {
        Self {
            preconditioner: Preconditioner::BlockJacobi,
            preconditioner_matrix: PreconditionerMatrix::Auto,
            operator: Operator::Auto,
            max_iterations: 1000,
            tolerance: None,
        }
    }
}

/// An approximate inverse that speeds a Krylov method up.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub enum Preconditioner {
    /// None at all.
    None,
    /// The diagonal.
    Jacobi,
    /// The diagonal blocks of unknowns that belong together.
    #[default]
    BlockJacobi,
    /// Multigrid on lattices of tent functions, for large steps and quasi-static problems.
    Multigrid(MultigridOptions),
    /// Incomplete LU on the pattern of the matrix.
    Ilu0,
    /// Incomplete LU with two thresholds.
    Ilut {
        /// Entries below this fraction of the norm of their row are dropped.
        drop_tolerance: f64,
        /// Entries that a row of `L` or `U` may have beyond those of the matrix.
        fill: usize,
    },
    /// An exact LU factor (of the sparser operator, or one that is kept while the operator moves on).
    Lu,
    /// An exact LDLᵀ factor.
    Ldlt {
        /// Order of elimination.
        order: EliminationOrder,
    },
    /// An exact Cholesky factor.
    Cholesky {
        /// Order of elimination.
        order: EliminationOrder,
    },
}

impl Preconditioner {
    /// ILUT with the usual thresholds, 10⁻³ and 10.
    pub fn ilut() -> Self {
        Self::Ilut { drop_tolerance: 1e-3, fill: 10 }
    }
}

/// From which matrix a preconditioner is built.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PreconditionerMatrix {
    /// The operator's own entries if it has any, else those of its sparser relative.
    #[default]
    Auto,
    /// The operator's own entries.
    Full,
    /// The symmetric part `½(A + Aᵀ)` of the operator's own entries, for the factors of symmetric matrices.
    SymmetricPart,
    /// The entries of the sparser relative: cheaper to build, and a weaker preconditioner.
    Sparser,
}

/// Where the products of an iteration come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Operator {
    /// Assembled entries where the preconditioner needs them anyway, else the action.
    #[default]
    Auto,
    /// Entries, assembled once per preparation.
    Assembled,
    /// The action of the operator, without entries.
    MatrixFree,
}

/// A setting out of its range, or settings that do not go together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("linear solver setting `{setting}`: {reason}")]
pub struct InvalidChoice {
    /// Name of the setting.
    pub setting: &'static str,
    /// What is wrong with it.
    pub reason: String,
}

pub(super) fn refuse(setting: &'static str, reason: impl Into<String>) -> Result<(), InvalidChoice> {
    Err(InvalidChoice { setting, reason: reason.into() })
}

impl KrylovOptions {
    fn validate(&self) -> Result<(), InvalidChoice> {
        if let Preconditioner::Multigrid(options) = &self.preconditioner {
            options.validate()?;
        }
        if self.max_iterations == 0 {
            return refuse("max_iterations", "must be at least 1");
        }
        if let Some(tolerance) = self.tolerance
            && !(tolerance > 0.0 && tolerance < 1.0)
        {
            return refuse("tolerance", format!("must lie between 0 and 1, not {tolerance}"));
        }
        if let Preconditioner::Ilut { drop_tolerance, .. } = self.preconditioner
            && !(0.0..1.0).contains(&drop_tolerance)
        {
            return refuse("drop_tolerance", format!("must be at least 0 and below 1, not {drop_tolerance}"));
        }
        Ok(())
    }
}

impl LinearSolverChoice {
    /// The default settings of the solver that chooses for itself.
    pub fn automatic() -> Self {
        Self::Automatic(AutomaticOptions::default())
    }

    /// LDLᵀ in the default order.
    pub fn ldlt() -> Self {
        Self::Ldlt { order: EliminationOrder::default() }
    }

    /// Cholesky in the default order.
    pub fn cholesky() -> Self {
        Self::Cholesky { order: EliminationOrder::default() }
    }

    /// GMRES(50) with the default settings.
    pub fn gmres() -> Self {
        Self::Gmres { restart: 50, krylov: KrylovOptions::default() }
    }

    /// BiCGStab with the default settings.
    pub fn bicgstab() -> Self {
        Self::BiCgStab { krylov: KrylovOptions::default() }
    }

    /// CG with the default settings.
    pub fn cg() -> Self {
        Self::Cg { krylov: KrylovOptions::default() }
    }

    /// MINRES with the default settings.
    pub fn minres() -> Self {
        Self::Minres { krylov: KrylovOptions::default() }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// [`InvalidChoice`] for a setting out of its range, or a preconditioner that CG or MINRES cannot use.
    pub fn validate(&self) -> Result<(), InvalidChoice> {
        match self {
            Self::Lu | Self::Ldlt { .. } | Self::Cholesky { .. } => Ok(()),
            Self::Automatic(options) if options.restart == 0 => refuse("restart", "must be at least 1"),
            Self::Automatic(options) if options.max_iterations == 0 => refuse("max_iterations", "must be at least 1"),
            Self::Automatic(_) => Ok(()),
            Self::Gmres { restart: 0, .. } => refuse("restart", "must be at least 1"),
            Self::Gmres { krylov, .. } | Self::BiCgStab { krylov } => krylov.validate(),
            Self::Cg { krylov } | Self::Minres { krylov } => match krylov.preconditioner {
                Preconditioner::Ilut { .. } => {
                    refuse("preconditioner", "ILUT is not symmetric; CG and MINRES take ILU(0)")
                }
                Preconditioner::Lu | Preconditioner::Ldlt { .. } => {
                    refuse("preconditioner", "CG and MINRES need a positive definite factor: choose Cholesky")
                }
                _ => krylov.validate(),
            },
        }
    }

    /// Builds the solver.
    ///
    /// # Panics
    /// If [`validate`](Self::validate) refuses the choice.
    pub fn build(&self) -> Box<dyn LinearSolver> {
        if let Err(error) = self.validate() {
            panic!("{error}");
        }
        match self {
            Self::Lu => Box::new(SparseLu::new()),
            Self::Automatic(options) => Box::new(Automatic::new(options.clone())),
            Self::Ldlt { order } => Box::new(SparseLdlt::new(order.clone())),
            Self::Cholesky { order } => Box::new(SparseCholesky::new(order.clone())),
            Self::Gmres { restart, krylov } => {
                let method = Method::Gmres { restart: *restart, work: Gmres::new(*restart) };
                Box::new(Krylov::new(method, krylov.clone()))
            }
            Self::BiCgStab { krylov } => Box::new(Krylov::new(Method::BiCgStab(BiCgStab::default()), krylov.clone())),
            Self::Cg { krylov } => Box::new(Krylov::new(Method::Cg(Cg::default()), krylov.clone())),
            Self::Minres { krylov } => Box::new(Krylov::new(Method::Minres(Minres::default()), krylov.clone())),
        }
    }
}
