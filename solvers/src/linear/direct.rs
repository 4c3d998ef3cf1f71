//! Solving with a factor: iterative refinement, and GMRES where refinement does not contract.
//!
//! `x ← x + M⁻¹ (b − A x)` with `A` the operator as it is *now* and `M` its factor, fresh or stale
//! (Higham 2002, ch. 12). A stale factor, or one of an ill conditioned matrix, may make this contract
//! slowly or diverge; then the same products are spent on GMRES preconditioned by `M`, which converges
//! whenever refinement does, and faster.

use super::effort::FactorSize;
use super::factor::{FactoredMatrix, Factors};
use super::gmres::Gmres;
use super::iteration::{ApproximateInverse, Limits, System, check_vectors, misses, residual};
use super::{LinearCounts, LinearError, LinearReport, LinearSolver, LinearSolverInfo, OperatorAge, Tangent};
use crate::snapshot::{RestoreError, Snapshot};
use crate::vector::{axpy, first_not_finite, max_norm, norm};

/// Refinement goes on while each step shrinks the residual to this fraction.
const CONTRACTION: f64 = 0.25;
/// Steps of plain refinement.
const REFINEMENTS: usize = 5;
/// Length of an accelerating cycle, and how many iterations there may be in all.
const CYCLE: usize = 30;
const ACCELERATED: usize = 90;

/// A direct solver on one kind of factorisation.
pub(super) struct Direct {
    factor: FactoredMatrix,
    counts: LinearCounts,
    residual: Vec<f64>,
    correction: Vec<f64>,
    previous: Vec<f64>,
    acceleration: Gmres,
}

impl Direct {
    /// A solver that is not prepared yet.
    pub(super) fn new(factors: Box<dyn Factors>) -> Self {
        Self {
            factor: FactoredMatrix::new(factors),
            counts: LinearCounts::default(),
            residual: Vec::new(),
            correction: Vec::new(),
            previous: Vec::new(),
            acceleration: Gmres::new(CYCLE),
        }
    }

    /// Size of the factor, where the analysis tells.
    pub(super) fn size_of_factor(&self) -> Option<FactorSize> {
        self.factor.size_of_factor()
    }

    /// The work space of a factored matrix.
    fn make_room(&mut self, n: usize) {
        self.residual.resize(n, 0.0);
        self.correction.resize(n, 0.0);
        self.previous.resize(n, 0.0);
    }

    /// The counters of a solver that does not take part at present.
    pub(super) fn set_counts(&mut self, counts: LinearCounts) {
        self.counts = counts;
    }

    /// Whether the residual is what rounding leaves of `b − A x`: iterating would change nothing.
    fn at_rounding(&self, x: &[f64], b: &[f64]) -> bool {
        let noise = f64::EPSILON * (self.factor.magnitude() * max_norm(x) + max_norm(b));
        max_norm(&self.residual) <= noise
    }
}

impl LinearSolver for Direct {
    fn info(&self) -> LinearSolverInfo {
        LinearSolverInfo {
            name: self.factor.name(),
            unknowns: self.factor.size().unwrap_or(0),
            entries: self.factor.entries(),
            fill: self.factor.fill(),
            threads: 1,
            reason: String::new(),
        }
    }

    fn counts(&self) -> LinearCounts {
        self.counts
    }

    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        self.factor.prepare(tangent, &mut self.counts)?;
        self.make_room(tangent.size());
        Ok(())
    }

    fn solve_unchecked(&mut self, b: &[f64], x: &mut [f64]) -> Option<Result<(), LinearError>> {
        let n = self.factor.size()?;
        if b.len() != n || x.len() != n {
            return None;
        }
        self.counts.solves += 1;
        self.factor.apply(b, x);
        Some(match first_not_finite(x) {
            None => Ok(()),
            Some(_) => Err(LinearError::Singular { unknown: None }),
        })
    }

    fn solve(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        self.solve_within(tangent, b, x, tolerance, ACCELERATED, None)
    }

    fn save(&self) -> Snapshot {
        let mut saved = self.counts.save();
        saved.put_flag("ready", self.factor.size().is_some());
        saved.put_part("factor", self.factor.save());
        saved
    }

    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        if age == OperatorAge::Older {
            return Ok(());
        }
        if saved.flag("ready")? {
            self.factor.restore(&saved.part("factor"), tangent, age)?;
            self.make_room(tangent.size());
        }
        self.counts = LinearCounts::restored(saved)?;
        Ok(())
    }
}

impl Direct {
    /// Solves with at most so many iterations. With a part `acceleration` of the iterations that refinement would take,
    /// as its first contraction tells, a solve that would take more is given up at once.
    pub(super) fn solve_within(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
        most: usize,
        acceleration: Option<f64>,
    ) -> Result<LinearReport, LinearError> {
        let n = self.factor.size().ok_or(LinearError::NotPrepared)?;
        check_vectors(n, tangent, b, x)?;
        self.counts.solves += 1;
        x.fill(0.0);
        let scale = norm(b);
        if scale == 0.0 {
            return Ok(LinearReport { iterations: 0, relative_residual: 0.0 });
        }
        let action = |v: &[f64], out: &mut [f64]| tangent.apply(v, out);
        self.factor.apply(b, x);
        if first_not_finite(x).is_some() {
            return Err(LinearError::Singular { unknown: None });
        }
        let mut relative = residual(&action, b, x, &mut self.residual) / scale;
        if let Some(row) = first_not_finite(&self.residual) {
            return Err(LinearError::EntryNotFinite { row });
        }
        if let Some(part) = acceleration
            && misses(relative, tolerance)
            && (misses(relative, 1.0) || part * tolerance.ln() / relative.ln() > most as f64)
        {
            return Err(LinearError::Inaccurate { relative_residual: relative });
        }
        let mut iterations = 0;
        while misses(relative, tolerance) && iterations < REFINEMENTS.min(most) && !self.at_rounding(x, b) {
            self.factor.apply(&self.residual, &mut self.correction);
            self.previous.copy_from_slice(x);
            axpy(1.0, &self.correction, x);
            iterations += 1;
            let refined = residual(&action, b, x, &mut self.residual) / scale;
            let contracts = refined <= CONTRACTION * relative;
            if misses(refined, relative) {
                // Not finite, or worse: back to where it was.
                x.copy_from_slice(&self.previous);
                break;
            }
            relative = refined;
            if !contracts {
                break;
            }
        }
        if misses(relative, tolerance) {
            residual(&action, b, x, &mut self.residual);
            if !self.at_rounding(x, b) {
                let max_iterations = ACCELERATED.min(most).saturating_sub(iterations);
                let limits = Limits { tolerance, max_iterations };
                let mut system = System::new(&action, &mut self.factor, b, limits);
                let outcome = self.acceleration.solve(&mut system, x);
                iterations += outcome.iterations;
                relative = outcome.relative_residual;
            }
        }
        self.counts.iterations += iterations;
        if relative <= tolerance && first_not_finite(x).is_none() {
            Ok(LinearReport { iterations, relative_residual: relative })
        } else {
            Err(LinearError::Inaccurate { relative_residual: relative })
        }
    }
}

/// Lets a public solver be a [`Direct`] in its first field.
macro_rules! delegate_to_direct {
    ($solver:ty) => {
        impl crate::linear::LinearSolver for $solver {
            fn info(&self) -> crate::linear::LinearSolverInfo {
                self.0.info()
            }

            fn counts(&self) -> crate::linear::LinearCounts {
                self.0.counts()
            }

            fn prepare(&mut self, tangent: &dyn crate::linear::Tangent) -> Result<(), crate::linear::LinearError> {
                self.0.prepare(tangent)
            }

            fn solve_unchecked(&mut self, b: &[f64], x: &mut [f64]) -> Option<Result<(), crate::linear::LinearError>> {
                self.0.solve_unchecked(b, x)
            }

            fn solve(
                &mut self,
                tangent: &dyn crate::linear::Tangent,
                b: &[f64],
                x: &mut [f64],
                tolerance: f64,
            ) -> Result<crate::linear::LinearReport, crate::linear::LinearError> {
                self.0.solve(tangent, b, x, tolerance)
            }

            fn save(&self) -> crate::snapshot::Snapshot {
                self.0.save()
            }

            fn restore(
                &mut self,
                saved: &crate::snapshot::Snapshot,
                tangent: &dyn crate::linear::Tangent,
                age: crate::linear::OperatorAge,
            ) -> Result<(), crate::snapshot::RestoreError> {
                self.0.restore(saved, tangent, age)
            }
        }
    };
}
pub(super) use delegate_to_direct;
