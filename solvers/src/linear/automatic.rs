//! The linear solver that chooses for itself, by counted costs.
//!
//! | operator | choice |
//! |---|---|
//! | a factor costs less than a few iterations, or accuracy comes first | factor |
//! | no entries, or a factor would need too much memory | iterate |
//! | otherwise | iterate until that has cost as much as a factor, then factor |
//!
//! *Iterate* is CG (symmetric) or GMRES without entries of the whole operator, with block Jacobi or, for long steps and
//! equilibria, [multigrid](iterating). *Factor* is LDLᵀ of
//! the operator or, if it is not symmetric, of its symmetric part, with refinement and GMRES on the operator itself; where
//! that does not contract, or costs more, LU.
//!
//! To iterate first, up to the price of the alternative, costs at most twice what the better of the two would have (the
//! rule for renting skis), whatever the step, the stiffness and the number of right-hand sides.
//!
//! A factor is kept when the operator moves on, as long as the iterations that it then takes cost less than another one. The
//! first product with it shows the contraction, and one that promises too many iterations ends the try at once; after such
//! a failure twice as many preparations pass before the next. Steps whose length changes a little and equations that are
//! almost linear so go on with an old factor.
//!
//! Costs are counted, not timed (see [`Effort`](super::Effort)): choices are the same on every machine and for any number
//! of threads. They do depend on the history of the solver.

mod iterating;
mod memory;
mod paths;

use std::time::Duration;

use super::choice::AutomaticOptions;
use super::direct::Direct;
use super::effort::{Costs, effort_of, estimated_factor};
use super::krylov::Krylov;
use super::ldlt::{EliminationOrder, SymmetricFactors, Variant};
use super::precondition::SymmetricPart;
use super::{LinearCounts, LinearError, LinearReport, LinearSolver, LinearSolverInfo, OperatorAge, Symmetry, Tangent};
use crate::snapshot::{RestoreError, Snapshot};
use iterating::Iterating;
use paths::Equation;

/// A solver without a factor takes hardly fewer iterations than this to any useful accuracy.
const FEW_ITERATIONS: f64 = 15.0;
/// Iterations that the factor of the symmetric part takes where it is worth its name.
const CORRECTIONS: f64 = 4.0;
/// Memory above which no factor is tried, bytes.
const LARGEST_FACTOR: f64 = 8e9;

/// How the present operator is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Path {
    Undecided,
    Iterate,
    /// LDLᵀ, of the operator or its symmetric part.
    Factor,
    Lu,
}

/// Chooses between iterating and factoring; see the [module](self).
pub(super) struct Automatic {
    options: AutomaticOptions,
    path: Path,
    reason: String,
    /// Unknowns and symmetry that the path was chosen for.
    chosen_for: Option<(usize, Symmetry)>,
    costs: Option<Costs>,
    factor: Direct,
    symmetric_part: SymmetricPart,
    lu: Option<Direct>,
    krylov: Option<Krylov>,
    iterating: Iterating,
    /// What iterating has cost since the last preparation, beyond what solving with a factor would have.
    excess: f64,
    /// The factor is older than the operator.
    stale: bool,
    has_factor: bool,
    /// A kept factor has become as expensive as a new one.
    worn: bool,
    /// Preparations to let pass before the next try to keep a factor, and how many the last pause had.
    pause: usize,
    last_pause: usize,
    /// Preparations that kept the factor.
    kept: usize,
    counts: LinearCounts,
    /// Time spent in solves on what could have been prepared before.
    late: Duration,
}

impl Automatic {
    /// A solver that is not prepared yet.
    pub(super) fn new(options: AutomaticOptions) -> Self {
        Self {
            options,
            path: Path::Undecided,
            reason: String::new(),
            chosen_for: None,
            costs: None,
            factor: Direct::new(Box::new(SymmetricFactors::new(Variant::Ldlt, EliminationOrder::default()))),
            symmetric_part: SymmetricPart::default(),
            lu: None,
            krylov: None,
            iterating: Iterating::default(),
            excess: 0.0,
            stale: false,
            has_factor: false,
            worn: false,
            pause: 0,
            last_pause: 0,
            kept: 0,
            counts: LinearCounts::default(),
            late: Duration::ZERO,
        }
    }

    /// Chooses between iterating and factoring for a new kind of operator.
    fn choose(&mut self, tangent: &dyn Tangent) {
        self.has_factor = false;
        (self.pause, self.last_pause) = (0, 0);
        self.iterating = Iterating::new(tangent.geometry().is_some());
        self.chosen_for = Some((tangent.size(), tangent.symmetry()));
        let effort = effort_of(tangent);
        self.costs = effort.and_then(|effort| {
            estimated_factor(tangent, &effort).map(|factor| Costs::new(&effort, &factor, tangent.size()))
        });
        let (path, reason) = match (&self.costs, effort) {
            (_, None) => (Path::Iterate, "the operator has no entries to factor".to_owned()),
            (Some(costs), _) if costs.bytes > LARGEST_FACTOR => {
                (Path::Iterate, format!("a factor would take about {:.0} GB", 1e-9 * costs.bytes))
            }
            (Some(costs), _)
                if self.options.direct
                    && self.iterating.suits_equilibria((costs.preparation + costs.solve) / costs.iteration) =>
            {
                (
                    Path::Iterate,
                    format!("a factor would cost about {:.0} iterations", costs.preparation / costs.iteration),
                )
            }
            _ if self.options.direct => (Path::Factor, "an equilibrium is ill-conditioned".to_owned()),
            (Some(costs), _)
                if tangent.symmetry() == Symmetry::General
                    && costs.general < costs.preparation + CORRECTIONS * (costs.action + costs.solve) =>
            {
                (Path::Lu, "LU costs less than correcting a symmetric factor".to_owned())
            }
            (Some(costs), _) => {
                let break_even = (costs.preparation + costs.solve) / costs.iteration;
                if break_even <= FEW_ITERATIONS {
                    (Path::Factor, format!("a factor costs about {break_even:.0} iterations"))
                } else {
                    (Path::Iterate, format!("a factor would cost about {break_even:.0} iterations"))
                }
            }
            (None, Some(_)) => (Path::Factor, "the size of a factor cannot be foretold".to_owned()),
        };
        (self.path, self.reason) = (path, reason);
        if path == Path::Iterate && self.options.direct {
            self.iterating.take_multigrid();
            if self.iterating.is_multigrid() {
                self.reason += ", and an equilibrium is ill-conditioned";
            }
        }
    }

    fn parts(&self) -> impl Iterator<Item = LinearCounts> + '_ {
        let krylov = self.krylov.as_ref().map(LinearSolver::counts);
        let lu = self.lu.as_ref().map(LinearSolver::counts);
        [Some(self.factor.counts()), krylov, lu].into_iter().flatten()
    }
}

/// Adds the work of a part; its solves are those of the whole.
fn add(counts: &mut LinearCounts, part: LinearCounts) {
    counts.analyses += part.analyses;
    counts.factorisations += part.factorisations;
    counts.iterations += part.iterations;
}

impl LinearSolver for Automatic {
    fn info(&self) -> LinearSolverInfo {
        let general = self.chosen_for.is_some_and(|(_, symmetry)| symmetry == Symmetry::General);
        let mut info = match (self.path, &self.krylov, &self.lu) {
            (Path::Iterate, Some(krylov), _) => krylov.info(),
            (Path::Lu, _, Some(lu)) => lu.info(),
            _ => self.factor.info(),
        };
        if general && self.path == Path::Factor {
            info.name = format!("refinement and GMRES with {} of the symmetric part", info.name);
        }
        info.reason = self.reason.clone();
        if self.kept > 0 {
            info.reason += &format!("; {} of its factors were kept for another operator", self.kept);
        }
        info
    }

    fn counts(&self) -> LinearCounts {
        let mut counts = self.counts;
        self.parts().for_each(|part| add(&mut counts, part));
        counts
    }

    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        if self.chosen_for != Some((tangent.size(), tangent.symmetry())) {
            self.retire_krylov();
            self.choose(tangent);
        }
        self.excess = 0.0;
        if self.path == Path::Iterate {
            match self.prepare_iteration(tangent) {
                Err(error) if self.costs.is_some_and(|costs| costs.bytes <= LARGEST_FACTOR) => {
                    self.turn_to(Path::Factor, format!("block Jacobi failed ({error})"));
                }
                outcome => return outcome,
            }
        }
        if self.path == Path::Lu {
            return self.factor_generally(tangent);
        }
        if self.has_factor && !self.worn && self.options.keeps {
            if self.pause == 0 {
                self.stale = true;
                self.kept += 1;
                return Ok(());
            }
            self.pause -= 1;
        }
        self.factor_somehow(tangent)
    }

    fn solve(
        &mut self,
        tangent: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        self.counts.solves += 1;
        let equation = &mut Equation { tangent, b, x, tolerance };
        match self.path {
            Path::Undecided => Err(LinearError::NotPrepared),
            Path::Iterate => self.solve_by_iterating(equation),
            Path::Factor => self.solve_by_factor(equation),
            Path::Lu => self.solve_generally(equation),
        }
    }

    fn late_preparation(&self) -> Duration {
        self.late
    }

    fn keeps_older_operator(&self) -> bool {
        self.has_older_operator()
    }

    fn save(&self) -> Snapshot {
        self.saved()
    }

    fn restore(&mut self, saved: &Snapshot, tangent: &dyn Tangent, age: OperatorAge) -> Result<(), RestoreError> {
        self.take_back(saved, tangent, age)
    }

    fn solve_unchecked(&mut self, b: &[f64], x: &mut [f64]) -> Option<Result<(), LinearError>> {
        let symmetric = self.chosen_for.is_some_and(|(_, symmetry)| symmetry != Symmetry::General);
        let outcome = match self.path {
            Path::Factor if self.has_factor && !self.stale && symmetric => self.factor.solve_unchecked(b, x),
            Path::Lu => self.lu.as_mut().and_then(|lu| lu.solve_unchecked(b, x)),
            _ => None,
        };
        self.counts.solves += usize::from(outcome.is_some());
        outcome
    }
}
