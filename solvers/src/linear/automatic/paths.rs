//! The paths that the automatic solver can take, and the turns from one to another.

use std::time::Instant;

use super::super::cg::Cg;
use super::super::choice::{AutomaticOptions, KrylovOptions, Operator, Preconditioner, PreconditionerMatrix};
use super::super::direct::Direct;
use super::super::effort::{Costs, effort_of};
use super::super::gmres::Gmres;
use super::super::krylov::{Krylov, Method};
use super::super::lu::LuFactors;
use super::super::multigrid::MultigridOptions;
use super::super::{LinearError, LinearReport, LinearSolver, Symmetry, Tangent};
use super::{Automatic, LARGEST_FACTOR, Path, add};

/// Preparations, at most, between two tries to keep a factor.
const LONGEST_PAUSE: usize = 64;
/// Iterations of a solve with a factor, at most.
const MOST_CORRECTIONS: usize = 90;
/// GMRES needs about this part of the iterations that the contraction of refinement promises.
const ACCELERATION: f64 = 0.5;

/// What a solve is asked for: the `x` of `A x = b`, to a relative residual.
pub(super) struct Equation<'a> {
    pub(super) tangent: &'a dyn Tangent,
    pub(super) b: &'a [f64],
    pub(super) x: &'a mut [f64],
    pub(super) tolerance: f64,
}

impl Equation<'_> {
    fn by(&mut self, solver: &mut dyn LinearSolver) -> Result<LinearReport, LinearError> {
        solver.solve(self.tangent, self.b, self.x, self.tolerance)
    }

    /// See [`Direct::solve_within`].
    fn within(
        &mut self,
        factor: &mut Direct,
        most: usize,
        acceleration: Option<f64>,
    ) -> Result<LinearReport, LinearError> {
        factor.solve_within(self.tangent, self.b, self.x, self.tolerance, most, acceleration)
    }
}

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

    pub(super) fn factor_generally(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        self.lu().prepare(tangent)
    }

    pub(super) fn lu(&mut self) -> &mut Direct {
        self.lu.get_or_insert_with(|| Direct::new(Box::new(LuFactors::new())))
    }

    pub(super) fn krylov(&mut self, tangent: &dyn Tangent) -> &mut Krylov {
        let symmetric = tangent.symmetry() != Symmetry::General;
        let AutomaticOptions { restart, max_iterations, .. } = self.options;
        let multigrid = self.iterating.is_multigrid();
        self.krylov.get_or_insert_with(|| {
            let options = KrylovOptions {
                preconditioner: match multigrid {
                    true => Preconditioner::Multigrid(MultigridOptions::default()),
                    false => Preconditioner::BlockJacobi,
                },
                // Diagonal blocks, and by no means all entries.
                preconditioner_matrix: match tangent.offers_diagonal_blocks() {
                    true => PreconditionerMatrix::Auto,
                    false => PreconditionerMatrix::Sparser,
                },
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

    /// Drops the iterative solver, but not its counts.
    pub(super) fn retire_krylov(&mut self) {
        if let Some(krylov) = self.krylov.take() {
            add(&mut self.counts, krylov.counts());
        }
    }

    /// Prepares the iteration; multigrid that cannot be set up makes way for block Jacobi.
    pub(super) fn prepare_iteration(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        match self.krylov(tangent).prepare(tangent) {
            Err(error) if self.iterating.is_multigrid() => self.without_multigrid(tangent, &error.to_string()),
            outcome => outcome,
        }
    }

    /// Goes back to block Jacobi.
    fn without_multigrid(&mut self, tangent: &dyn Tangent, why: &str) -> Result<(), LinearError> {
        self.retire_krylov();
        self.iterating.give_up_multigrid();
        self.reason += &format!("; multigrid was given up ({why})");
        self.prepare_iteration(tangent)
    }

    /// Preparations in the course of a solve.
    fn late(&mut self, prepare: impl FnOnce(&mut Self) -> Result<(), LinearError>) -> Result<(), LinearError> {
        let clock = Instant::now();
        let outcome = prepare(self);
        self.late += clock.elapsed();
        outcome
    }

    /// Iterations that cost as much as the alternative.
    fn corrections_worth(&self, alternative: impl Fn(&Costs) -> f64) -> usize {
        let Some(costs) = &self.costs else { return MOST_CORRECTIONS };
        ((alternative(costs) / (costs.action + costs.solve)) as usize).clamp(1, MOST_CORRECTIONS)
    }

    fn solve_with_kept(&mut self, equation: &mut Equation<'_>) -> Option<LinearReport> {
        // Half the price: the counts are not that exact, and a newer factor is worth something.
        let most = self.corrections_worth(|costs| 0.5 * costs.preparation);
        let report = equation.within(&mut self.factor, most, Some(ACCELERATION)).ok();
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

    pub(super) fn solve_by_factor(&mut self, equation: &mut Equation<'_>) -> Result<LinearReport, LinearError> {
        let tangent = equation.tangent;
        if !self.has_factor {
            return Err(LinearError::NotPrepared);
        }
        if self.stale {
            if let Some(report) = self.solve_with_kept(equation) {
                return Ok(report);
            }
            self.late(|own| own.factor_somehow(tangent))?;
            if self.path == Path::Lu {
                return self.solve_generally(equation);
            }
        }
        if tangent.symmetry() != Symmetry::General {
            return equation.by(&mut self.factor);
        }
        let most = self.corrections_worth(|costs| costs.general);
        match equation.within(&mut self.factor, most, None) {
            Err(error @ (LinearError::RightHandSideNotFinite { .. } | LinearError::WrongLength { .. })) => Err(error),
            Err(error) => {
                self.turn_to(Path::Lu, format!("LDLᵀ of the symmetric part did not contract ({error})"));
                self.late(|own| own.factor_generally(tangent))?;
                self.solve_generally(equation)
            }
            outcome => outcome,
        }
    }

    pub(super) fn solve_generally(&mut self, equation: &mut Equation<'_>) -> Result<LinearReport, LinearError> {
        equation.by(self.lu.as_mut().ok_or(LinearError::NotPrepared)?)
    }

    pub(super) fn solve_by_iterating(&mut self, equation: &mut Equation<'_>) -> Result<LinearReport, LinearError> {
        let Equation { tangent, tolerance, .. } = *equation;
        // Where no factor is possible, iterating has no price.
        let costs = self.costs.filter(|costs| costs.bytes <= LARGEST_FACTOR);
        let price = costs
            .map_or(f64::INFINITY, |costs| (costs.preparation + costs.solve - self.excess).max(0.0) / costs.iteration);
        if price < 2.0 {
            let reason = "iterating had cost as much as a factor".to_owned();
            return self.turn_to_factor(equation, reason);
        }
        let (weight, multigrid) = (self.iterating.weight(), self.iterating.before_multigrid(tolerance, price));
        let most = price.min(multigrid.unwrap_or(f64::INFINITY)) / weight;
        let most = (most as usize).clamp(1, self.options.max_iterations);
        let krylov = self.krylov(tangent);
        krylov.limit(most);
        let before = krylov.counts().iterations;
        let outcome = equation.by(krylov);
        let iterations = krylov.counts().iterations - before;
        if let Some(costs) = costs {
            let saved = if outcome.is_ok() { costs.solve } else { 0.0 };
            self.excess += (weight * iterations as f64 * costs.iteration - saved).max(0.0);
        }
        match outcome {
            Ok(report) => {
                if self.iterating.learn(iterations, tolerance) {
                    let why = format!("{iterations} iterations to {tolerance:.0e}, dearer than those of block Jacobi");
                    self.late(|own| own.without_multigrid(tangent, &why))?;
                }
                Ok(report)
            }
            Err(error @ (LinearError::RightHandSideNotFinite { .. } | LinearError::WrongLength { .. })) => Err(error),
            Err(
                LinearError::IterationLimit { relative_residual, .. }
                | LinearError::Breakdown { relative_residual, .. },
            ) if multigrid.is_some() => {
                self.iterating.learn(iterations, relative_residual.clamp(tolerance, 1.0));
                let digits = -tolerance.log10();
                self.reason +=
                    &format!("; {iterations} iterations with block Jacobi were not enough for {digits:.0} digits");
                let setup = self.iterating.take_multigrid();
                self.excess += costs.map_or(0.0, |costs| setup * costs.iteration);
                self.retire_krylov();
                self.late(|own| own.prepare_iteration(tangent))?;
                self.solve_by_iterating(equation)
            }
            Err(error) if costs.is_some() => {
                let reason = format!("iterating to {tolerance:.0e} cost more than a factor ({error})");
                self.turn_to_factor(equation, reason)
            }
            Err(error) if self.iterating.is_multigrid() && self.iterating.knows_block_jacobi() => {
                self.late(|own| own.without_multigrid(tangent, &error.to_string()))?;
                self.solve_by_iterating(equation)
            }
            Err(error) => Err(error),
        }
    }

    /// Turns from iterating to the factor in the course of a solve, or to LU where there is no other.
    fn turn_to_factor(&mut self, equation: &mut Equation<'_>, reason: String) -> Result<LinearReport, LinearError> {
        let tangent = equation.tangent;
        self.turn_to(Path::Factor, reason);
        self.late(|own| own.factor_somehow(tangent))?;
        match self.path {
            Path::Lu => self.solve_generally(equation),
            _ => self.solve_by_factor(equation),
        }
    }
}
