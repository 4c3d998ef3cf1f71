//! The paths that the automatic solver can take, and the turns from one to another.

use std::time::Instant;

use super::super::cg::Cg;
use super::super::choice::{AutomaticOptions, KrylovOptions, Operator, Preconditioner, PreconditionerMatrix};
use super::super::direct::Direct;
use super::super::effort::{Costs, effort_of};
use super::super::gmres::Gmres;
use super::super::krylov::{Krylov, Method};
use super::super::lu::LuFactors;
use super::super::{LinearError, LinearReport, LinearSolver, Symmetry, Tangent};
use super::{Automatic, LARGEST_FACTOR, Path};

/// Preparations, at most, between two tries to keep a factor.
const LONGEST_PAUSE: usize = 64;
/// Iterations of a solve with a factor, at most.
const MOST_CORRECTIONS: usize = 90;
/// GMRES needs about this part of the iterations that the contraction of refinement promises.
const ACCELERATION: f64 = 0.5;

impl Automatic {
    /// Takes another path, from now on.
    pub(super) fn turn_to(&mut self, path: Path, reason: String) {
        (self.path, self.reason) = (path, reason);
    }

    /// Factors the operator, or its symmetric part.
    fn factor(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        self.has_factor = false;
        if tangent.symmetry() == Symmetry::General {
            let part = self.symmetric_part.of(tangent)?;
            self.factor.prepare(&part)?;
        } else {
            self.factor.prepare(tangent)?;
        }
        if let (Some(effort), Some(size)) = (effort_of(tangent), self.factor.size_of_factor()) {
            self.costs = Some(Costs::new(&effort, &size, tangent.size()));
        }
        (self.has_factor, self.stale, self.worn) = (true, false, false);
        Ok(())
    }

    /// Factors by LDLᵀ, or by LU where that cannot be.
    pub(super) fn factor_somehow(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        let general = tangent.symmetry() == Symmetry::General;
        match self.factor(tangent) {
            Err(error) if general => {
                self.turn_to(Path::Lu, format!("LDLᵀ of the symmetric part failed ({error})"));
                self.factor_generally(tangent)
            }
            outcome => outcome,
        }
    }

    /// Factors in the course of a solve.
    fn factor_late(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        let clock = Instant::now();
        let outcome = self.factor_somehow(tangent);
        self.late += clock.elapsed();
        outcome
    }

    pub(super) fn factor_generally(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        self.lu().prepare(tangent)
    }

    pub(super) fn lu(&mut self) -> &mut Direct {
        self.lu.get_or_insert_with(|| Direct::new(Box::new(LuFactors::new())))
    }

    pub(super) fn krylov(&mut self, symmetric: bool) -> &mut Krylov {
        let AutomaticOptions { restart, max_iterations, .. } = self.options;
        self.krylov.get_or_insert_with(|| {
            let options = KrylovOptions {
                preconditioner: Preconditioner::BlockJacobi,
                preconditioner_matrix: PreconditionerMatrix::Sparser,
                operator: Operator::MatrixFree,
                max_iterations,
                tolerance: None,
            };
            let method = if symmetric {
                Method::Cg(Cg::default())
            } else {
                Method::Gmres { restart, work: Gmres::new(restart) }
            };
            Krylov::new(method, options)
        })
    }

    /// Iterations that cost as much as the alternative.
    fn corrections_worth(&self, alternative: impl Fn(&Costs) -> f64) -> usize {
        let Some(costs) = &self.costs else { return MOST_CORRECTIONS };
        ((alternative(costs) / (costs.action + costs.solve)) as usize).clamp(1, MOST_CORRECTIONS)
    }

    fn solve_with_kept(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Option<LinearReport> {
        // Half the price: the counts are not that exact, and a newer factor is worth something.
        let most = self.corrections_worth(|costs| 0.5 * costs.preparation);
        let report = self.factor.solve_within(tangent, b, x, tolerance, most, Some(ACCELERATION)).ok();
        match report {
            Some(report) => {
                self.last_pause = 0;
                self.worn = report.iterations >= most;
            }
            None => {
                self.last_pause = (2 * self.last_pause).clamp(1, LONGEST_PAUSE);
                self.pause = self.last_pause;
            }
        }
        report
    }

    pub(super) fn solve_by_factor(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        if !self.has_factor {
            return Err(LinearError::NotPrepared);
        }
        if self.stale {
            if let Some(report) = self.solve_with_kept(tangent, b, x, tolerance) {
                return Ok(report);
            }
            self.factor_late(tangent)?;
            if self.path == Path::Lu {
                return self.solve_generally(tangent, b, x, tolerance);
            }
        }
        if tangent.symmetry() != Symmetry::General {
            return self.factor.solve(tangent, b, x, tolerance);
        }
        let most = self.corrections_worth(|costs| costs.general);
        match self.factor.solve_within(tangent, b, x, tolerance, most, None) {
            Err(error @ (LinearError::RightHandSideNotFinite { .. } | LinearError::WrongLength { .. })) => Err(error),
            Err(error) => {
                self.turn_to(Path::Lu, format!("LDLᵀ of the symmetric part did not contract ({error})"));
                let clock = Instant::now();
                self.factor_generally(tangent)?;
                self.late += clock.elapsed();
                self.solve_generally(tangent, b, x, tolerance)
            }
            outcome => outcome,
        }
    }

    pub(super) fn solve_generally(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        self.lu.as_mut().ok_or(LinearError::NotPrepared)?.solve(tangent, b, x, tolerance)
    }

    pub(super) fn solve_by_iterating(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        let symmetric = tangent.symmetry() != Symmetry::General;
        // Where no factor is possible, iterating has no price.
        let costs = self.costs.filter(|costs| costs.bytes <= LARGEST_FACTOR);
        let left =
            costs.map(|costs| ((costs.preparation + costs.solve - self.excess).max(0.0) / costs.iteration) as usize);
        if left.is_some_and(|left| left < 2) {
            self.turn_to(Path::Factor, "iterating had cost as much as a factor".to_owned());
            self.factor_late(tangent)?;
            return self.solve_factored(tangent, b, x, tolerance);
        }
        let most = left.map_or(self.options.max_iterations, |left| left.min(self.options.max_iterations));
        let krylov = self.krylov(symmetric);
        krylov.limit(most);
        let error = match krylov.solve(tangent, b, x, tolerance) {
            Ok(report) => {
                if let Some(costs) = costs {
                    self.excess += (report.iterations as f64 * costs.iteration - costs.solve).max(0.0);
                }
                return Ok(report);
            }
            Err(error @ (LinearError::RightHandSideNotFinite { .. } | LinearError::WrongLength { .. })) => {
                return Err(error);
            }
            Err(error) => error,
        };
        if effort_of(tangent).is_none() || self.costs.is_some_and(|costs| costs.bytes > LARGEST_FACTOR) {
            return Err(error);
        }
        self.turn_to(Path::Factor, format!("iterating to {tolerance:.0e} cost more than a factor ({error})"));
        self.factor_late(tangent)?;
        self.solve_factored(tangent, b, x, tolerance)
    }

    /// Solves after a turn from iterating to the factor, or to LU where there is no other.
    fn solve_factored(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        match self.path {
            Path::Lu => self.solve_generally(tangent, b, x, tolerance),
            _ => self.solve_by_factor(tangent, b, x, tolerance),
        }
    }
}
