//! When the tangent is linearised and factored again: the choices, the causes, the counts.

use super::options::{NewtonOptionsError, require};

/// How steps are collected into an improved tangent around a kept factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SecantUpdate {
    /// Broyden's (good) update in product form: any tangent (C. T. Kelley 1995, chapter 7).
    Broyden,
    /// L-BFGS around the factor: symmetric tangents (H. Matthies and G. Strang 1979).
    LimitedBfgs,
}

/// When the tangent is renewed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub enum TangentPolicy {
    /// In every iteration: Newton's method, quadratic convergence.
    #[default]
    Full,
    /// Once per time step ([`NewtonSolver::new_step`](super::NewtonSolver::new_step)), in its first
    /// iteration; sooner only when the measured contraction cannot reach the tolerance.
    Modified,
    /// Kept over time steps until the measured contraction is poorer than allowed.
    Lagged {
        /// Contraction `θ` up to which the tangent is kept, in (0, 1).
        contraction: f64,
        /// Time steps after which it is renewed in any case.
        steps: usize,
    },
    /// Kept over time steps like `Lagged`, and improved within a solve by secant updates.
    QuasiNewton {
        /// Which update.
        update: SecantUpdate,
        /// Updates kept.
        memory: usize,
        /// Contraction `θ` up to which the factor is kept, in (0, 1).
        contraction: f64,
        /// Time steps after which it is renewed in any case.
        steps: usize,
    },
}

impl TangentPolicy {
    /// Lagged with contraction 0.3 and 50 time steps.
    pub fn lagged() -> Self {
        Self::Lagged { contraction: 0.3, steps: 50 }
    }

    /// Broyden with 10 updates, contraction 0.9 and 50 time steps.
    pub fn broyden() -> Self {
        Self::QuasiNewton { update: SecantUpdate::Broyden, memory: 10, contraction: 0.9, steps: 50 }
    }

    /// L-BFGS with 10 updates, contraction 0.9 and 50 time steps.
    pub fn limited_bfgs() -> Self {
        Self::QuasiNewton { update: SecantUpdate::LimitedBfgs, memory: 10, contraction: 0.9, steps: 50 }
    }

    pub(super) fn validate(self) -> Result<(), NewtonOptionsError> {
        if let Self::Lagged { contraction, steps } | Self::QuasiNewton { contraction, steps, .. } = self {
            require(contraction > 0.0 && contraction < 1.0, "tangent", contraction, "(contraction) must be in (0, 1)")?;
            require(steps > 0, "tangent", steps, "(steps) must be at least 1")?;
        }
        if let Self::QuasiNewton { memory, .. } = self {
            require(memory > 0, "tangent", memory, "(memory) must be at least 1")?;
        }
        Ok(())
    }
}

/// Why the tangent was renewed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum TangentCause {
    /// There was none: the first, after `forget`, or another number of unknowns or constant key.
    First,
    /// Full Newton renews in every iteration.
    EveryIteration,
    /// A new time step, by policy.
    NewStep,
    /// Kept for as many time steps as the policy allows.
    Age,
    /// The measured contraction is too poor.
    SlowContraction,
    /// The residual grew with a stale tangent; that step was undone.
    Increase,
    /// The line search or trust region found no acceptable step with a stale tangent.
    LineSearch,
    /// No shortening of a stale direction came into the domain.
    Domain,
    /// The linear solve failed with a stale factor.
    LinearSolve,
    /// Stagnation or divergence with a stale tangent; full Newton from here on.
    Stagnation,
    /// The iteration limit was reached with a stale tangent; full Newton from here on.
    IterationLimit,
}

impl TangentCause {
    /// All causes, in the order of [`TangentCounts`].
    pub const ALL: [Self; 11] = [
        Self::First,
        Self::EveryIteration,
        Self::NewStep,
        Self::Age,
        Self::SlowContraction,
        Self::Increase,
        Self::LineSearch,
        Self::Domain,
        Self::LinearSolve,
        Self::Stagnation,
        Self::IterationLimit,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::EveryIteration => "every iteration",
            Self::NewStep => "new step",
            Self::Age => "age",
            Self::SlowContraction => "slow contraction",
            Self::Increase => "increase",
            Self::LineSearch => "line search",
            Self::Domain => "domain",
            Self::LinearSolve => "linear solve",
            Self::Stagnation => "stagnation",
            Self::IterationLimit => "iteration limit",
        }
    }
}

/// Factorisations counted by cause.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TangentCounts {
    counts: [usize; TangentCause::ALL.len()],
}

impl TangentCounts {
    /// How many had this cause.
    pub fn get(&self, cause: TangentCause) -> usize {
        self.counts[cause as usize]
    }

    /// How many there were.
    pub fn total(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Every cause that occurred, with its count.
    pub fn iter(&self) -> impl Iterator<Item = (TangentCause, usize)> + '_ {
        TangentCause::ALL.into_iter().map(|cause| (cause, self.get(cause))).filter(|(_, count)| *count > 0)
    }

    /// The counts in the order of [`TangentCause::ALL`].
    pub(super) fn list(&self) -> [usize; TangentCause::ALL.len()] {
        self.counts
    }

    pub(super) fn from_list(counts: [usize; TangentCause::ALL.len()]) -> Self {
        Self { counts }
    }

    pub(super) fn count(&mut self, cause: TangentCause) {
        self.counts[cause as usize] += 1;
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (mine, other) in self.counts.iter_mut().zip(other.counts) {
            *mine += other;
        }
    }
}
