//! The table `[time]`: step, its control, scheme.

use serde::Deserialize;

/// The table `[time]`.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSettings {
    /// Time at which the computation ends, s; positive.
    pub end: f64,
    /// Scheme; default [`Scheme::CrankNicolson`].
    pub scheme: Scheme,
    /// Step; default [`StepChoice::Cfl`]`(0.3)` for explicit schemes, none for implicit ones.
    pub step: StepChoice,
    /// Step below which the computation gives up, s; default none: the program's own. As large as the step, it
    /// lets the first failure end the computation.
    pub minimum_step: Option<f64>,
    /// Longest step of a controlled step, s; default none.
    pub maximum_step: Option<f64>,
    /// Whether the loads of [`Scheme::Static`] grow in proportion to its pseudo-time; default yes.
    pub ramp: bool,
    /// Control of the step by an error estimate; default none.
    pub adaptive: Option<Adaptive>,
    /// Control of the step by the effort of Newton's method; default none.
    pub effort: Option<Effort>,
}

/// The step size, or the first one if the step is controlled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepChoice {
    /// In seconds; for [`Scheme::Static`] the increment of the pseudo-time.
    Fixed(f64),
    /// As a multiple of d_min / c_max, re-evaluated as the motion goes on.
    Cfl(f64),
}

/// The table `time.adaptive`: the step follows an estimate of its error. `rkc`, `tr_bdf2` and `sdirk3` have one of
/// their own, as has the θ-family from its second step on; the others compare one step with two half ones, at
/// three times the cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Key `tolerance`: error of a step relative to the size of each unknown; between 0 and 1.
    pub relative_tolerance: f64,
    /// Key `absolute`: error that never matters, in the unit of each unknown; default 0.
    pub absolute_tolerance: f64,
}

/// The table `time.effort`: the step grows while Newton's method finds it easy, and is cut when it does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Three steps in a row with at most this many iterations make the step grow; default 4.
    pub few: usize,
    /// A step with more iterations than this makes the next one shorter; default 10.
    pub many: usize,
    /// Factor of growth; default 1.5.
    pub growth: f64,
    /// Factor of a cut; default 0.5.
    pub cut: f64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { few: 4, many: 10, growth: 1.5, cut: 0.5 }
    }
}

/// Key `time.rkc_stages`: where the number of stages of `rkc` comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub enum RkcStages {
    /// From the spectral radius of the actual operator, found by a power iteration.
    #[default]
    SpectralRadius,
    /// From the Courant number c Δt / d_min by rule (4.18) of document 001: `s = 1 + ⌊√(1 + c Δt / (0.131 d_min))⌋`,
    /// which assumes an artificial viscosity with α = 2.5. To reproduce published numbers of stages.
    Courant,
}

/// Time schemes with what only they need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// Explicit, order 1.
    ForwardEuler,
    /// Explicit, order 2, two stages, total variation diminishing.
    TvdRk2,
    /// Explicit, order 3, three stages, total variation diminishing.
    TvdRk3,
    /// Explicit, order 4, the classical one.
    Rk4,
    /// Explicit, order 2, stabilised Runge–Kutta–Chebyshev: for motion dominated by damping.
    Rkc {
        /// Rule for the number of stages; default [`RkcStages::SpectralRadius`].
        stages: RkcStages,
    },
    /// Explicit, order 2, leap-frog for motion without dissipation.
    VelocityVerlet,
    /// Implicit, order 1, damps everything.
    BackwardEuler,
    /// Implicit, order 2, trapezoidal rule.
    CrankNicolson,
    /// Implicit, between the two above.
    Theta {
        /// Weight of the new time; 0.5 (Crank–Nicolson) to 1 (backward Euler); default 0.5.
        theta: f64,
    },
    /// Implicit, order 2, mid-point rule.
    Midpoint,
    /// Implicit, order 2, two stages, strongly damping.
    TrBdf2,
    /// Implicit, order 3, singly diagonal.
    Sdirk3,
    /// Implicit, order 2, damps high frequencies as told.
    GeneralisedAlpha {
        /// Spectral radius at infinite frequency, 0 to 1; default 0.8.
        spectral_radius: f64,
    },
    /// Implicit, order 2, mid-point rule with a discrete gradient: conserves energy exactly.
    EnergyMomentum,
    /// No inertia: equilibrium at every increment of a pseudo-time.
    Static,
}

impl Scheme {
    /// Whether a step needs no equations solved.
    pub fn is_explicit(&self) -> bool {
        matches!(
            self,
            Self::ForwardEuler | Self::TvdRk2 | Self::TvdRk3 | Self::Rk4 | Self::Rkc { .. } | Self::VelocityVerlet
        )
    }
}
