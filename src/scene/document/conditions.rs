//! `[initial]`, `[[boundary]]`, `[[traction]]`, `[[probe]]`, `[exact]`.

use serde::Deserialize;

use super::{BoxText, Direction, Field, FieldList, Measure, Spanned, Text, Vector};
use crate::scene::units::{Length, Pressure, Velocity};
use crate::setup::Side;

/// The state at t = 0. Constraints win over it.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table of initial values")]
pub(in crate::scene) struct InitialText {
    /// Displacement, a field per direction; default zero.
    pub displacement: Option<FieldList<Length>>,
    /// Velocity, a field per direction; default zero.
    pub velocity: Option<FieldList<Velocity>>,
    /// Pressure; default none: the volume ratio starts as det F.
    pub pressure: Option<Spanned<Field<Pressure>>>,
    /// Pressure at rest under gravity, instead of `pressure`.
    pub hydrostatic: Option<Spanned<HydrostaticText>>,
    /// Start from the static equilibrium under the loads at t = 0 (solids).
    #[serde(default)]
    pub equilibrium: bool,
}

/// Pressure ρ |g| times the depth.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table such as `{ level = 2.5 }`")]
pub(in crate::scene) struct HydrostaticText {
    /// Height of the free surface, measured against gravity.
    pub level: Measure<Length>,
}

/// Fixed or prescribed motion of selected particles.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table that describes a boundary condition")]
pub(in crate::scene) struct BoundaryText {
    /// Name for messages; default: boundary 1, …
    pub name: Option<Text>,
    /// Name of the body it is about; default: all.
    pub body: Option<Text>,
    /// Which particles.
    pub select: Spanned<SelectText>,
    /// Directions that keep their initial position.
    pub fix: Option<Spanned<Vec<Spanned<AxisName>>>>,
    /// Directions that move as told, each a field.
    pub displacement: Option<Spanned<AxisMap>>,
}

/// Which particles are meant.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    rename_all = "snake_case",
    expecting = "a selection: `select = \"all\"`, `select.face`, `select.box`, `select.half_space`, `select.where` or `select.group`"
)]
pub(in crate::scene) enum SelectText {
    /// All of them.
    All,
    /// Those that carry a side of the bounding box.
    Face(Spanned<FaceName>),
    /// Those with (X - point)·normal ≥ 0.
    HalfSpace(HalfSpaceText),
    /// Those in a box.
    Box(BoxText),
    /// Those where a condition of X, Y, Z holds, as in `Y < 0.2`.
    Where(Text),
    /// Those of a physical group of a Gmsh file.
    Group(Text),
}

/// What lies on one side of a plane.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a half-space, such as `{ point = [0, 0], normal = [0, -1] }`")]
pub(in crate::scene) struct HalfSpaceText {
    /// A point of the plane.
    pub point: Vector<Length>,
    /// Direction that points into the half-space.
    pub normal: Direction,
}

/// A direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum AxisName {
    X,
    Y,
    Z,
}

/// Motion by directions.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table such as `{ y = \"0.1*sin(t)\" }`")]
pub(in crate::scene) struct AxisMap {
    /// Displacement along x.
    pub x: Option<Spanned<Field<Length>>>,
    /// Displacement along y.
    pub y: Option<Spanned<Field<Length>>>,
    /// Displacement along z.
    pub z: Option<Spanned<Field<Length>>>,
}

/// A force per area of the boundary; at least one of face, group, facing and select says where.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table that describes a traction")]
pub(in crate::scene) struct TractionText {
    /// Name for messages; default: traction 1, …
    pub name: Option<Text>,
    /// Name of the body it acts on; default: all whose boundary is known.
    pub body: Option<Text>,
    /// Side of the bounding box.
    pub face: Option<Spanned<FaceName>>,
    /// Pieces of boundary in that group of a Gmsh file.
    pub group: Option<Text>,
    /// Pieces whose normal is within 45° of this direction.
    pub facing: Option<Direction>,
    /// Particles whose pieces are meant; default: all of them.
    pub select: Option<Spanned<SelectText>>,
    /// Force per reference area, a field per direction.
    pub value: FieldList<Pressure>,
}

/// A side of a bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum FaceName {
    LowerX,
    UpperX,
    LowerY,
    UpperY,
    LowerZ,
    UpperZ,
}

impl FaceName {
    /// The side that is meant.
    pub fn side(self) -> Side {
        let (axis, upper) = match self {
            Self::LowerX => (0, false),
            Self::UpperX => (0, true),
            Self::LowerY => (1, false),
            Self::UpperY => (1, true),
            Self::LowerZ => (2, false),
            Self::UpperZ => (2, true),
        };
        Side { axis, upper }
    }
}

/// A place whose motion is recorded.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table that describes a probe")]
pub(in crate::scene) struct ProbeText {
    /// Name of its columns.
    pub name: Text,
    /// Reference position.
    pub at: Vector<Length>,
    /// How values are found there.
    #[serde(default)]
    pub mode: ProbeMode,
    /// Name of the body; default: the first that contains the position.
    pub body: Option<Text>,
}

/// How a probe finds its values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum ProbeMode {
    /// Those of the nearest particle.
    #[default]
    Nearest,
    /// Interpolated between neighbours.
    Interpolated,
}

/// The exact solution, compared with at the end; each field is optional.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table with the exact solution")]
pub(in crate::scene) struct ExactText {
    /// Displacement, a field per direction.
    pub displacement: Option<FieldList<Length>>,
    /// Velocity, a field per direction.
    pub velocity: Option<FieldList<Velocity>>,
    /// Pressure.
    pub pressure: Option<Spanned<Field<Pressure>>>,
}
