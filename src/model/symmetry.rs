//! Which terms of the tangent are symmetric, by construction.
//!
//! | term | symmetric |
//! |---|---|
//! | inertia | always |
//! | stress of a stored energy of F, and of J where it follows det F | always: a Hessian |
//! | stress of an evolved J | where the equations are linear; else up to the time error of J, `O(s L)` |
//! | viscosity | its derivative by L; that by F is of the size of the viscous stress |
//! | D_v | along a fixed direction, at a fixed wave speed, without reconstruction; else up to its jumps and limiter |
//! | D_p | never: it couples volume ratios to pressures |
//! | hourglass control | always: a quadratic energy |
//! | discrete gradient of a conserving step | where it is linear; else up to `O(Δt²)` |
//!
//! At rest, without velocities, nothing dissipates and every stress has an energy. Unknowns other than velocities alone
//! are never symmetric. What misses symmetry by little has a symmetric part whose factor is a good preconditioner.

use nicolson_solvers::linear::Symmetry;

use super::{Model, Unknowns};
use crate::stabilisation::Upwind;

/// What an implicit problem solves for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Problem {
    /// A stage of an implicit scheme.
    Stage,
    /// A step that conserves energy.
    Conserving,
    /// An equilibrium.
    Equilibrium,
}

/// What is known about a term, or about all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Declared {
    /// Which term.
    pub term: &'static str,
    /// Its symmetry.
    pub symmetry: Symmetry,
    /// Whether the symmetric part stands for the whole: true of what is symmetric.
    pub nearly: bool,
}

impl Declared {
    fn new(term: &'static str, symmetry: Symmetry, nearly: bool) -> Self {
        Self { term, symmetry, nearly: nearly || symmetry != Symmetry::General }
    }

    /// The weaker of two promises.
    fn and(self, other: Self) -> Self {
        let rank = |symmetry| match symmetry {
            Symmetry::PositiveDefinite => 2,
            Symmetry::Symmetric => 1,
            Symmetry::General => 0,
        };
        let symmetry = if rank(other.symmetry) < rank(self.symmetry) { other.symmetry } else { self.symmetry };
        Self { symmetry, nearly: self.nearly && other.nearly, ..self }
    }
}

impl<const D: usize> Model<D> {
    /// Symmetry of every term that is present.
    pub fn declared_terms(&self, problem: Problem) -> Vec<Declared> {
        let resting = problem == Problem::Equilibrium;
        let conserving = problem == Problem::Conserving;
        // In three dimensions the conserving stress of J is not linear even where the equations are.
        let curved = conserving && D == 3 && self.materials.iter().any(|(law, _)| law.evolves_volume());
        let linear = self.linear && self.structurally_linear() && !curved;
        let hessian = match (linear, conserving) {
            (true, _) => Symmetry::PositiveDefinite,
            (false, true) => Symmetry::General,
            (false, false) => Symmetry::Symmetric,
        };
        let unless = |general: bool| if general { Symmetry::General } else { Symmetry::Symmetric };
        let mut terms = vec![Declared::new("inertia", Symmetry::PositiveDefinite, true)];
        if self.unknowns.kind() != Unknowns::Velocity {
            terms.push(Declared::new("volume ratio as an unknown", Symmetry::General, false));
        }
        for (index, (law, _)) in self.materials.iter().enumerate() {
            if law.solid.is_some() {
                terms.push(Declared::new("solid stress", hessian, true));
            }
            if law.volumetric.is_some() {
                let evolved = self.evolved[index] && !linear && !resting;
                let symmetry = if evolved { Symmetry::General } else { hessian };
                terms.push(Declared::new("volumetric stress", symmetry, true));
            }
            if law.viscosity.is_some() {
                terms.push(Declared::new("viscosity", unless(!resting), true));
            }
        }
        if self.upwind.as_ref().is_some_and(Upwind::has_velocity) {
            let steady = linear && self.upwind.as_ref().is_none_or(|u| !u.options.interface.reconstructs());
            let symmetry = if steady { Symmetry::PositiveDefinite } else { unless(!resting) };
            terms.push(Declared::new("D_v", symmetry, true));
        }
        if self.upwind.as_ref().is_some_and(Upwind::has_pressure) {
            terms.push(Declared::new("D_p", Symmetry::General, false));
        }
        if self.hourglass.is_some() {
            terms.push(Declared::new("hourglass control", Symmetry::PositiveDefinite, true));
        }
        terms
    }

    /// All terms together.
    pub fn declared(&self, problem: Problem) -> Declared {
        let all = Declared { term: "all", symmetry: Symmetry::PositiveDefinite, nearly: true };
        self.declared_terms(problem).into_iter().fold(all, Declared::and)
    }

    /// The problem that is posed.
    pub(super) fn problem(&self) -> Problem {
        match (self.stage.at_rest, self.stage.start.is_empty()) {
            (true, _) => Problem::Equilibrium,
            (false, true) => Problem::Stage,
            (false, false) => Problem::Conserving,
        }
    }
}
