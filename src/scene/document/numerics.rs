//! `[stabilisation]`, `[time]`, `[newton]`, `[linear]`, `[output]`.

use serde::Deserialize;

use super::{Measure, Number, Spanned};
#[cfg(test)]
use crate::scene::settings::{CheckpointSettings, Effort, LinearSettings, NewtonSettings, OutputSettings};
use crate::scene::settings::{
    Forcing, LineSearch, OperatorChoice, OutputField, PreconditionerChoice, RkcStages, SolverChoice, TangentPolicy,
    Unknowns,
};
use crate::scene::units::{Time, WallTime};

/// Upwind stabilisation after document 004; `tau_v` or `tau_p` switches it on.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table of stabilisation options")]
pub(in crate::scene) struct StabilisationText {
    /// Coefficient of the jump of velocities.
    #[cfg_attr(test, schemars(extend("default" = 0.0)))]
    pub tau_v: Option<Number>,
    /// Coefficient of the jump of pressures; not with `energy_momentum`.
    #[cfg_attr(test, schemars(extend("default" = 0.0)))]
    pub tau_p: Option<Number>,
    /// Wave speed of the upwind terms.
    #[serde(default)]
    pub wave_speed: WaveSpeedText,
    /// Gradient of the upwind terms.
    #[serde(default)]
    pub gradient: GradientText,
    /// States on both sides of an interface.
    #[serde(default)]
    pub interface: InterfaceText,
    /// What jumps across an interface.
    #[serde(default)]
    pub pressure_jump: PressureJumpText,
    /// How dissipation acts on shear.
    #[serde(default)]
    pub shear: ShearText,
}

/// Wave speed of the upwind terms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum WaveSpeedText {
    /// That at rest.
    #[default]
    Constant,
    /// That of the deformed state.
    Deformed,
}

/// Gradient of the upwind terms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum GradientText {
    /// As in the balance.
    #[default]
    Plain,
    /// Corrected to be exact for linear fields.
    Corrected,
}

/// States on both sides of an interface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum InterfaceText {
    /// Those of the particles (document 004).
    Constant,
    /// Linear reconstructions.
    Reconstructed,
    /// Linear reconstructions with a limiter.
    #[default]
    Limited,
}

/// What jumps across an interface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum PressureJumpText {
    /// The pressure.
    #[default]
    Pressure,
    /// The stress along the line of two particles.
    Stress,
}

/// How dissipation acts on shear.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum ShearText {
    /// Along the line of two particles.
    #[default]
    Central,
    /// Across it too, with the speed of shear waves; for solids.
    Transverse,
}

/// Time, step and scheme.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table of time options")]
pub(in crate::scene) struct TimeText {
    /// Time at which the computation ends.
    pub end: Measure<Time>,
    /// Step, or the first one if it is controlled.
    pub step: Option<Measure<Time>>,
    /// Step as a multiple of d_min/c_max, instead of `step`; default 0.3 for explicit schemes.
    pub cfl: Option<Number>,
    /// Scheme.
    #[cfg_attr(test, schemars(extend("default" = SchemeText::default())))]
    pub scheme: Option<Spanned<SchemeText>>,
    /// Weight of the new time, 0.5 to 1; with the scheme `theta` only.
    #[cfg_attr(test, schemars(extend("default" = 0.5)))]
    pub theta: Option<Number>,
    /// Spectral radius at infinite frequency, 0 to 1; with `generalised_alpha` only.
    #[cfg_attr(test, schemars(extend("default" = 0.8)))]
    pub spectral_radius: Option<Number>,
    /// Where the number of stages comes from; with `rkc` only.
    #[cfg_attr(test, schemars(extend("default" = RkcStages::default())))]
    pub rkc_stages: Option<Spanned<RkcStages>>,
    /// Step below which the computation gives up; default: that of the program.
    pub minimum_step: Option<Measure<Time>>,
    /// Longest step of a controlled step; default: nothing bounds it.
    pub maximum_step: Option<Measure<Time>>,
    /// Whether all loads grow in proportion to the pseudo-time; with `static` only.
    #[cfg_attr(test, schemars(extend("default" = true)))]
    pub ramp: Option<Spanned<bool>>,
    /// Control of the step by its error; not with `effort`.
    pub adaptive: Option<Spanned<AdaptiveText>>,
    /// Control of the step by Newton iterations; not with `adaptive`.
    pub effort: Option<Spanned<EffortText>>,
}

/// Time schemes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum SchemeText {
    /// Explicit, order 1.
    ForwardEuler,
    /// Explicit, order 2, two stages.
    TvdRk2,
    /// Explicit, order 3, three stages.
    TvdRk3,
    /// Explicit, order 4.
    Rk4,
    /// Explicit, order 2, stabilised Runge–Kutta–Chebyshev: for motion dominated by damping.
    Rkc,
    /// Explicit, order 2, leap-frog: for motion without dissipation.
    VelocityVerlet,
    /// Implicit, order 1, damps everything.
    BackwardEuler,
    /// Implicit, order 2, trapezoidal rule.
    #[default]
    CrankNicolson,
    /// Implicit, between the two above.
    Theta,
    /// Implicit, order 2, mid-point rule.
    Midpoint,
    /// Implicit, order 2, two stages, strongly damping.
    TrBdf2,
    /// Implicit, order 3, singly diagonal.
    Sdirk3,
    /// Implicit, order 2, damps high frequencies as told.
    GeneralisedAlpha,
    /// Implicit, order 2: conserves energy exactly.
    EnergyMomentum,
    /// No inertia: equilibrium at every increment of a pseudo-time.
    Static,
}

/// The step follows an estimate of its error.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table such as `{ tolerance = 1e-4 }`")]
pub(in crate::scene) struct AdaptiveText {
    /// Error of a step relative to the size of each unknown, between 0 and 1.
    pub tolerance: Number,
    /// Error that never matters, in the SI unit of each unknown.
    #[cfg_attr(test, schemars(extend("default" = 0.0)))]
    pub absolute: Option<Number>,
}

/// The step follows the effort of Newton's method; implicit schemes only.
#[derive(Debug, Clone, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table such as `{ few = 4, many = 10 }`")]
pub(in crate::scene) struct EffortText {
    /// Three steps in a row with at most this many iterations make the step grow.
    #[cfg_attr(test, schemars(extend("default" = Effort::default().few)))]
    pub few: Option<Spanned<u64>>,
    /// A step with more iterations makes the next one shorter.
    #[cfg_attr(test, schemars(extend("default" = Effort::default().many)))]
    pub many: Option<Spanned<u64>>,
    /// Factor of growth, more than 1.
    #[cfg_attr(test, schemars(extend("default" = Effort::default().growth)))]
    pub growth: Option<Number>,
    /// Factor of a cut, between 0 and 1.
    #[cfg_attr(test, schemars(extend("default" = Effort::default().cut)))]
    pub cut: Option<Number>,
}

/// Newton's method.
#[derive(Debug, Clone, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table of options of Newton's method")]
pub(in crate::scene) struct NewtonText {
    /// Residual relative to the first one; default 1e-12 with `energy_momentum`.
    #[cfg_attr(test, schemars(extend("default" = NewtonSettings::default().relative_tolerance)))]
    pub relative_tolerance: Option<Number>,
    /// Residual relative to the size of its summands; default 1e-15 with `energy_momentum`.
    #[cfg_attr(test, schemars(extend("default" = NewtonSettings::default().scale_tolerance)))]
    pub scale_tolerance: Option<Number>,
    /// Most iterations of a step.
    #[cfg_attr(test, schemars(extend("default" = NewtonSettings::default().max_iterations)))]
    pub max_iterations: Option<Spanned<u64>>,
    /// Corrections beyond convergence, with the factor at hand; default 2 with `energy_momentum`.
    #[cfg_attr(test, schemars(extend("default" = NewtonSettings::default().final_corrections)))]
    pub final_corrections: Option<Spanned<u64>>,
    /// How far to go along an increment; default none with `static`.
    #[cfg_attr(test, schemars(extend("default" = LineSearch::default())))]
    pub line_search: Option<Spanned<LineSearch>>,
    /// When the tangent is renewed.
    #[cfg_attr(test, schemars(extend("default" = TangentPolicy::default())))]
    pub tangent: Option<TangentPolicy>,
    /// Tolerance of iterative linear solves.
    #[cfg_attr(test, schemars(extend("default" = Forcing::default())))]
    pub forcing: Option<Forcing>,
    /// Unknowns of the implicit system.
    #[cfg_attr(test, schemars(extend("default" = Unknowns::default())))]
    pub unknowns: Option<Spanned<Unknowns>>,
    /// Declares whether the equations are linear, to be checked; default: not declared.
    pub linear: Option<bool>,
}

/// The linear solver.
#[derive(Debug, Clone, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table of options of the linear solver")]
pub(in crate::scene) struct LinearSolverText {
    /// Solver; by default that with the fewest counted operations.
    #[cfg_attr(test, schemars(extend("default" = SolverChoice::default())))]
    pub solver: Option<SolverChoice>,
    /// Preconditioner of iterative solvers.
    #[cfg_attr(test, schemars(extend("default" = PreconditionerChoice::default())))]
    pub preconditioner: Option<Spanned<PreconditionerChoice>>,
    /// Where the products of iterative solvers come from.
    #[cfg_attr(test, schemars(extend("default" = OperatorChoice::default())))]
    pub operator: Option<Spanned<OperatorChoice>>,
    /// Relative residual of iterative solvers.
    #[cfg_attr(test, schemars(extend("default" = LinearSettings::default().tolerance)))]
    pub tolerance: Option<Number>,
    /// Most iterations of iterative solvers.
    #[cfg_attr(test, schemars(extend("default" = LinearSettings::default().max_iterations)))]
    pub max_iterations: Option<Spanned<u64>>,
    /// Iterations of GMRES before it starts afresh.
    #[cfg_attr(test, schemars(extend("default" = LinearSettings::default().restart)))]
    pub restart: Option<Spanned<u64>>,
}

/// What is written.
#[derive(Debug, Clone, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table of output options")]
pub(in crate::scene) struct OutputText {
    /// Time between frames; default: the first and the last frame only.
    pub interval: Option<Measure<Time>>,
    /// Fields of the frames.
    #[cfg_attr(test, schemars(extend("default" = OutputField::ALL)))]
    pub fields: Option<Vec<Spanned<OutputField>>>,
    /// Whether to draw plots.
    #[cfg_attr(test, schemars(extend("default" = OutputSettings::default().plots)))]
    pub plots: Option<bool>,
    /// Whether to write the history of energies.
    #[cfg_attr(test, schemars(extend("default" = OutputSettings::default().history)))]
    pub history: Option<bool>,
}

/// Checkpoints, for `nicolson restart`; with this table also one at the end.
#[derive(Debug, Clone, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table of options of checkpoints, such as `{ every_steps = 100 }`")]
pub(in crate::scene) struct CheckpointText {
    /// Steps between checkpoints; default none.
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub every_steps: Option<Spanned<u64>>,
    /// Time of the clock on the wall between checkpoints, a plain number in seconds; default none.
    pub every_seconds: Option<Measure<WallTime>>,
    /// How many of the newest are kept; 0 writes none.
    #[cfg_attr(test, schemars(extend("default" = CheckpointSettings::default().keep)))]
    pub keep: Option<Spanned<u64>>,
}
