//! `[initial]`, `[[boundary]]`, `[[traction]]`, `[[probe]]`, `[exact]`.

use serde::Deserialize;
use toml::Spanned;

use super::{BoxText, Field, FieldList, Number, Text, Vector};
use crate::setup::Side;

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table of initial values")]
pub(in crate::scene) struct InitialText {
    pub displacement: Option<FieldList>,
    pub velocity: Option<FieldList>,
    pub pressure: Option<Spanned<Field>>,
    pub hydrostatic: Option<Spanned<HydrostaticText>>,
    #[serde(default)]
    pub equilibrium: bool,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as `{ level = 2.5 }`")]
pub(in crate::scene) struct HydrostaticText {
    pub level: Number,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table that describes a boundary condition")]
pub(in crate::scene) struct BoundaryText {
    pub name: Option<Text>,
    pub body: Option<Text>,
    pub select: Spanned<SelectText>,
    pub fix: Option<Spanned<Vec<Spanned<AxisName>>>>,
    pub displacement: Option<Spanned<AxisMap>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(
    rename_all = "snake_case",
    expecting = "a selection: `select = \"all\"`, `select.face`, `select.box`, `select.half_space`, `select.where` or `select.group`"
)]
pub(in crate::scene) enum SelectText {
    All,
    Face(Spanned<FaceName>),
    HalfSpace(HalfSpaceText),
    Box(BoxText),
    Where(Text),
    Group(Text),
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a half-space, such as `{ point = [0, 0], normal = [0, -1] }`")]
pub(in crate::scene) struct HalfSpaceText {
    pub point: Vector,
    pub normal: Vector,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum AxisName {
    X,
    Y,
    Z,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as `{ y = \"0.1*sin(t)\" }`")]
pub(in crate::scene) struct AxisMap {
    pub x: Option<Spanned<Field>>,
    pub y: Option<Spanned<Field>>,
    pub z: Option<Spanned<Field>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table that describes a traction")]
pub(in crate::scene) struct TractionText {
    pub name: Option<Text>,
    pub body: Option<Text>,
    pub face: Option<Spanned<FaceName>>,
    pub group: Option<Text>,
    pub facing: Option<Vector>,
    pub select: Option<Spanned<SelectText>>,
    pub value: FieldList,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
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

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table that describes a probe")]
pub(in crate::scene) struct ProbeText {
    pub name: Text,
    pub at: Vector,
    #[serde(default)]
    pub mode: ProbeMode,
    pub body: Option<Text>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum ProbeMode {
    #[default]
    Nearest,
    Interpolated,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with the exact solution")]
pub(in crate::scene) struct ExactText {
    pub displacement: Option<FieldList>,
    pub velocity: Option<FieldList>,
    pub pressure: Option<Spanned<Field>>,
}
