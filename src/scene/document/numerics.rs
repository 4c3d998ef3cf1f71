//! `[stabilisation]`, `[time]`, `[newton]`, `[linear]`, `[output]`.

use serde::Deserialize;
use toml::Spanned;

use super::Number;
use crate::scene::settings::{
    Forcing, LineSearch, OperatorChoice, OutputField, PreconditionerChoice, RkcStages, SolverChoice, TangentPolicy,
    Unknowns,
};

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of stabilisation options")]
pub(in crate::scene) struct StabilisationText {
    pub tau_v: Option<Number>,
    pub tau_p: Option<Number>,
    #[serde(default)]
    pub wave_speed: WaveSpeedText,
    #[serde(default)]
    pub gradient: GradientText,
    #[serde(default)]
    pub interface: InterfaceText,
    #[serde(default)]
    pub pressure_jump: PressureJumpText,
    #[serde(default)]
    pub shear: ShearText,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum WaveSpeedText {
    #[default]
    Constant,
    Deformed,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum GradientText {
    #[default]
    Plain,
    Corrected,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum InterfaceText {
    Constant,
    Reconstructed,
    #[default]
    Limited,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum PressureJumpText {
    #[default]
    Pressure,
    Stress,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum ShearText {
    #[default]
    Central,
    Transverse,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of time options")]
pub(in crate::scene) struct TimeText {
    pub end: Number,
    pub step: Option<Number>,
    pub cfl: Option<Number>,
    pub scheme: Option<Spanned<SchemeText>>,
    pub theta: Option<Number>,
    pub spectral_radius: Option<Number>,
    pub rkc_stages: Option<Spanned<RkcStages>>,
    pub minimum_step: Option<Number>,
    pub maximum_step: Option<Number>,
    pub ramp: Option<Spanned<bool>>,
    pub adaptive: Option<Spanned<AdaptiveText>>,
    pub effort: Option<Spanned<EffortText>>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum SchemeText {
    ForwardEuler,
    TvdRk2,
    TvdRk3,
    Rk4,
    Rkc,
    VelocityVerlet,
    BackwardEuler,
    #[default]
    CrankNicolson,
    Theta,
    Midpoint,
    TrBdf2,
    Sdirk3,
    GeneralisedAlpha,
    EnergyMomentum,
    Static,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as `{ tolerance = 1e-4 }`")]
pub(in crate::scene) struct AdaptiveText {
    pub tolerance: Number,
    pub absolute: Option<Number>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as `{ few = 4, many = 10 }`")]
pub(in crate::scene) struct EffortText {
    pub few: Option<Spanned<u64>>,
    pub many: Option<Spanned<u64>>,
    pub growth: Option<Number>,
    pub cut: Option<Number>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of options of Newton's method")]
pub(in crate::scene) struct NewtonText {
    pub relative_tolerance: Option<Number>,
    pub scale_tolerance: Option<Number>,
    pub max_iterations: Option<Spanned<u64>>,
    pub final_corrections: Option<Spanned<u64>>,
    pub line_search: Option<Spanned<LineSearch>>,
    pub tangent: Option<TangentPolicy>,
    pub forcing: Option<Forcing>,
    pub unknowns: Option<Spanned<Unknowns>>,
    pub linear: Option<bool>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of options of the linear solver")]
pub(in crate::scene) struct LinearSolverText {
    pub solver: Option<SolverChoice>,
    pub preconditioner: Option<Spanned<PreconditionerChoice>>,
    pub operator: Option<Spanned<OperatorChoice>>,
    pub tolerance: Option<Number>,
    pub max_iterations: Option<Spanned<u64>>,
    pub restart: Option<Spanned<u64>>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of output options")]
pub(in crate::scene) struct OutputText {
    pub interval: Option<Number>,
    pub fields: Option<Vec<Spanned<OutputField>>>,
    pub plots: Option<bool>,
    pub history: Option<bool>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of options of checkpoints, such as `{ every_steps = 100 }`")]
pub(in crate::scene) struct CheckpointText {
    pub every_steps: Option<Spanned<u64>>,
    pub every_seconds: Option<Number>,
    pub keep: Option<Spanned<u64>>,
}
