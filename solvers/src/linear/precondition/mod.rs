//! Preconditioners: approximate inverses that are cheap to build and to apply.
//!
//! | choice | built from | applied in | good for |
//! |---|---|---|---|
//! | none | – | – | well conditioned systems |
//! | Jacobi | diagonal | n | one unknown per point |
//! | block Jacobi | diagonal blocks | n × block | steps of a few critical ones |
//! | multigrid | an action, tent functions | a few actions | large steps, statics; see [`super::multigrid`] |
//! | ILU(0) | all entries | entries | larger steps |
//! | ILUT | all entries | entries × fill | systems that are hard for ILU(0) |
//! | LU, LDLᵀ, Cholesky | all entries | factor | an operator near to the one that is solved |
//! | LDLᵀ of `½(A + Aᵀ)` | all entries | factor | operators that are nearly symmetric |
//!
//! Jacobi takes [diagonal blocks](super::Tangent::diagonal_blocks) where the operator offers them. The factors need
//! entries: those of the operator, or of its [`sparser`](super::Tangent::sparser) relative, which is what the
//! matrix-free path offers.

mod ilu0;
mod ilut;
mod jacobi;
mod symmetric_part;
mod triangular;

pub(super) use jacobi::BlockInverses;
pub(super) use symmetric_part::SymmetricPart;

use super::choice::{Preconditioner, PreconditionerMatrix};
use super::factor::FactoredMatrix;
use super::iteration::ApproximateInverse;
use super::ldlt::{SymmetricFactors, Variant};
use super::lu::LuFactors;
use super::multigrid::Multigrid;
use super::{LinearCounts, LinearError, OperatorAge, Tangent};
use crate::snapshot::{RestoreError, Snapshot};

/// Builds the chosen preconditioner. With `definite`, it must be positive definite (for CG).
pub(super) fn build(
    choice: &Preconditioner,
    matrix: PreconditionerMatrix,
    definite: bool,
) -> Box<dyn ApproximateInverse> {
    let symmetric = |variant, order: &super::EliminationOrder| -> Box<dyn ApproximateInverse> {
        Box::new(FactoredMatrix::new(Box::new(SymmetricFactors::new(variant, order.clone()))))
    };
    let inner: Box<dyn ApproximateInverse> = match choice {
        Preconditioner::None => return Box::new(Identity),
        Preconditioner::Multigrid(options) => return Box::new(Multigrid::new(options.clone())),
        Preconditioner::Jacobi => return Box::new(jacobi_of(matrix, true, definite)),
        Preconditioner::BlockJacobi => return Box::new(jacobi_of(matrix, false, definite)),
        Preconditioner::Ilu0 => Box::new(ilu0::Ilu0::new(definite)),
        Preconditioner::Ilut { drop_tolerance, fill } => Box::new(ilut::Ilut::new(*drop_tolerance, *fill)),
        Preconditioner::Lu => Box::new(FactoredMatrix::new(Box::new(LuFactors::new()))),
        Preconditioner::Ldlt { order } => symmetric(Variant::Ldlt, order),
        Preconditioner::Cholesky { order } => symmetric(Variant::Cholesky, order),
    };
    let inner = match matrix {
        PreconditionerMatrix::SymmetricPart => Box::new(symmetric_part::OfSymmetricPart::new(inner)),
        _ => inner,
    };
    Box::new(FromEntries { inner, matrix, takes_diagonal: false })
}

/// Jacobi takes diagonal blocks where the operator offers them, and else the entries of the chosen matrix.
fn jacobi_of(matrix: PreconditionerMatrix, pointwise: bool, definite: bool) -> FromEntries {
    let inner =
        if pointwise { jacobi::BlockJacobi::pointwise(definite) } else { jacobi::BlockJacobi::blockwise(definite) };
    let inner: Box<dyn ApproximateInverse> = match matrix {
        PreconditionerMatrix::SymmetricPart => Box::new(symmetric_part::OfSymmetricPart::new(Box::new(inner))),
        _ => Box::new(inner),
    };
    FromEntries { inner, matrix, takes_diagonal: matrix == PreconditionerMatrix::Auto }
}

/// `M = 1`.
struct Identity;

impl ApproximateInverse for Identity {
    fn name(&self) -> String {
        String::new()
    }

    fn prepare(&mut self, _: &dyn Tangent, _: &mut LinearCounts) -> Result<(), LinearError> {
        Ok(())
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
    }

    fn fill(&self) -> usize {
        0
    }
}

/// Picks the operator whose entries are used.
struct FromEntries {
    inner: Box<dyn ApproximateInverse>,
    matrix: PreconditionerMatrix,
    /// Whether diagonal blocks alone are enough.
    takes_diagonal: bool,
}

impl FromEntries {
    fn source<'a>(&self, tangent: &'a dyn Tangent) -> Option<&'a dyn Tangent> {
        let full = || Some(tangent).filter(|t| t.pattern().is_some());
        let sparser = || tangent.sparser().filter(|t| t.pattern().is_some());
        match self.matrix {
            PreconditionerMatrix::Full | PreconditionerMatrix::SymmetricPart => full(),
            PreconditionerMatrix::Sparser => sparser(),
            PreconditionerMatrix::Auto if self.takes_diagonal && tangent.offers_diagonal_blocks() => Some(tangent),
            PreconditionerMatrix::Auto => full().or_else(sparser),
        }
    }

    fn chosen<'a>(&self, tangent: &'a dyn Tangent) -> Result<&'a dyn Tangent, LinearError> {
        let source = self
            .source(tangent)
            .ok_or_else(|| LinearError::NeedsEntries { solver: format!("{} preconditioner", self.name()) })?;
        if source.size() != tangent.size() {
            return Err(LinearError::WrongLength { expected: tangent.size(), found: source.size() });
        }
        Ok(source)
    }
}

impl ApproximateInverse for FromEntries {
    fn name(&self) -> String {
        match self.matrix {
            PreconditionerMatrix::Sparser => format!("{} of the sparser operator", self.inner.name()),
            PreconditionerMatrix::Full | PreconditionerMatrix::Auto | PreconditionerMatrix::SymmetricPart => {
                self.inner.name()
            }
        }
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        self.inner.prepare(self.chosen(tangent)?, counts)
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
        self.inner.restore(saved, self.chosen(tangent)?, age)
    }
}

/// A preconditioner that cannot be built from this matrix.
fn unsuitable(name: &str, reason: impl std::fmt::Display) -> LinearError {
    LinearError::Factorisation { reason: format!("{name}: {reason}") }
}
