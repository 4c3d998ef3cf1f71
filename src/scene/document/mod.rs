//! The scene as `serde` reads it: names and types of every key, nothing checked beyond them.
//!
//! Values are [`Spanned`], so that later checks can point at them; enums are externally tagged, nothing is
//! flattened or untagged, and unknown keys are refused: `toml` then knows the place of every mistake.

mod body;
mod conditions;
mod material;
mod numerics;
#[cfg(test)]
mod schemas;
mod value;

use serde::Deserialize;

use crate::scene::units::{Acceleration, UnitSystem};

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
    MaterialText, Moduli, Modulus, MooneyRivlinText, NearlyIncompressibleText, NeoHookeanText, SolidText,
    TransverseText,
};
pub(in crate::scene) use numerics::{
    AdaptiveText, CheckpointText, EffortText, GradientText, InterfaceText, LinearSolverText, NewtonText, OutputText,
    PressureJumpText, SchemeText, ShearText, StabilisationText, TimeText, WaveSpeedText,
};
pub(in crate::scene) use value::{
    Direction, Field, FieldList, HourglassText, Measure, Number, REMEDY, Scalar, Spanned, Text, Vector,
};

/// A scene: bodies, conditions, and how to compute.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(title = "Scene of nicolson"))]
#[serde(deny_unknown_fields, expecting = "a scene")]
pub(in crate::scene) struct Document {
    /// Default: the name of the file.
    pub title: Option<String>,
    /// Number of dimensions: 1, 2 (plane strain) or 3.
    #[cfg_attr(test, schemars(range(min = 1, max = 3)))]
    pub dimension: Spanned<u64>,
    /// Units of plain numbers and expressions; quantities in quotes have their own. Results are always in SI units.
    #[serde(default)]
    pub units: UnitSystem,
    /// Gravity, one number per direction; default none.
    pub gravity: Option<Vector<Acceleration>>,
    /// Force per mass, a field per direction; default none.
    pub body_force: Option<FieldList<Acceleration>>,
    /// Coefficient of the hourglass control, usual are 0.5 to 4, or none; default: none for fluids; for solids 3 with
    /// balanced weights, else 2, and from ν = 0.45 on less.
    pub hourglass: Option<Spanned<HourglassText>>,
    /// One or more bodies; they do not interact.
    #[serde(default)]
    pub body: Vec<Spanned<BodyText>>,
    /// The state at t = 0.
    pub initial: Option<Spanned<InitialText>>,
    /// Fixed and prescribed motion.
    #[serde(default)]
    pub boundary: Vec<Spanned<BoundaryText>>,
    /// Forces on the boundary.
    #[serde(default)]
    pub traction: Vec<Spanned<TractionText>>,
    /// Upwind stabilisation; default none.
    pub stabilisation: Option<Spanned<StabilisationText>>,
    /// Time, step and scheme; required.
    pub time: Option<Spanned<TimeText>>,
    /// Newton's method.
    #[serde(default)]
    pub newton: NewtonText,
    /// The linear solver.
    #[serde(default)]
    pub linear: LinearSolverText,
    /// What is written.
    #[serde(default)]
    pub output: OutputText,
    /// When the state is saved, to go on from.
    pub checkpoint: Option<CheckpointText>,
    /// Places whose motion is recorded.
    #[serde(default)]
    pub probe: Vec<Spanned<ProbeText>>,
    /// The exact solution.
    pub exact: Option<Spanned<ExactText>>,
}
