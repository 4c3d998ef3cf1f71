//! The scene as `serde` reads it: names and types of every key, nothing checked beyond them.
//!
//! Values are [`Spanned`], so that later checks can point at them; enums are externally tagged, nothing is
//! flattened or untagged, and unknown keys are refused: `toml` then knows the place of every mistake.

mod body;
mod conditions;
mod material;
mod numerics;
mod value;

use serde::Deserialize;
pub(in crate::scene) use toml::Spanned;

pub(in crate::scene) use body::{
    BallText, BodyText, BoxText, CylinderText, LatticeText, LayoutText, LayoutsText, MappedBoxText, MeshPointsText,
    MeshText, PerturbText, PointsText, PolygonText, RingText, ShapeText, StlText, TrapezoidText, VolumeRatioText,
    VolumeText,
};
pub(in crate::scene) use conditions::{
    AxisName, BoundaryText, ExactText, HalfSpaceText, HydrostaticText, InitialText, ProbeMode, ProbeText, SelectText,
    TractionText,
};
pub(in crate::scene) use material::{
    HyperelasticText, LinearText, MaterialText, MooneyRivlinText, NearlyIncompressibleText, NeoHookeanText, SolidText,
    TransverseText,
};
pub(in crate::scene) use numerics::{
    AdaptiveText, CheckpointText, EffortText, GradientText, InterfaceText, LinearSolverText, NewtonText, OutputText,
    PressureJumpText, SchemeText, ShearText, StabilisationText, TimeText, WaveSpeedText,
};
pub(in crate::scene) use value::{Field, FieldList, HourglassText, Number, Text, Vector};

/// The whole scene.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a scene")]
pub(in crate::scene) struct Document {
    pub title: Option<String>,
    pub dimension: Spanned<u64>,
    pub gravity: Option<Vector>,
    pub body_force: Option<FieldList>,
    pub hourglass: Option<Spanned<HourglassText>>,
    #[serde(default)]
    pub body: Vec<Spanned<BodyText>>,
    pub initial: Option<Spanned<InitialText>>,
    #[serde(default)]
    pub boundary: Vec<Spanned<BoundaryText>>,
    #[serde(default)]
    pub traction: Vec<Spanned<TractionText>>,
    pub stabilisation: Option<Spanned<StabilisationText>>,
    pub time: Option<Spanned<TimeText>>,
    #[serde(default)]
    pub newton: NewtonText,
    #[serde(default)]
    pub linear: LinearSolverText,
    #[serde(default)]
    pub output: OutputText,
    pub checkpoint: Option<CheckpointText>,
    #[serde(default)]
    pub probe: Vec<Spanned<ProbeText>>,
    pub exact: Option<Spanned<ExactText>>,
}
