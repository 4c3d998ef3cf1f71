//! `[[body]]`.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, IntoDeserializer, SeqAccess, Visitor};
use toml::Spanned;

use super::{FieldList, HalfSpaceText, HourglassText, MaterialText, Number, Text, Vector};
use crate::geometry::Layout;
use crate::setup::{CofactorChoice, KernelChoice, VolumeRatioChoice, WeightChoice};

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table that describes a body")]
pub(in crate::scene) struct BodyText {
    pub name: Option<Text>,
    pub spacing: Option<Number>,
    pub counts: Option<Spanned<Vec<Spanned<u64>>>>,
    pub layout: Option<Spanned<LayoutsText>>,
    pub shape: Option<Spanned<ShapeText>>,
    pub perturb: Option<Spanned<PerturbText>>,
    pub points: Option<Spanned<PointsText>>,
    pub mesh: Option<Spanned<MeshText>>,
    pub lattice: Option<Spanned<LatticeText>>,
    #[serde(default)]
    pub kernel: KernelText,
    pub smoothing: Option<Number>,
    #[serde(default)]
    pub weights: WeightText,
    pub volumes: Option<Spanned<VolumeText>>,
    #[serde(default)]
    pub cofactor: CofactorText,
    pub volume_ratio: Option<Spanned<VolumeRatioText>>,
    pub hourglass: Option<Spanned<HourglassText>>,
    pub material: MaterialText,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "snake_case", expecting = "a shape, such as `shape.box = { lower = [0, 0], upper = [1, 1] }`")]
pub(in crate::scene) enum ShapeText {
    Box(BoxText),
    MappedBox(MappedBoxText),
    Ring(RingText),
    Disc(BallText),
    Sphere(BallText),
    Cylinder(CylinderText),
    HalfSpace(HalfSpaceText),
    Polygon(PolygonText),
    Trapezoid(TrapezoidText),
    Stl(StlText),
    Union(Vec<Spanned<ShapeText>>),
    Intersection(Vec<Spanned<ShapeText>>),
    Difference(Vec<Spanned<ShapeText>>),
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a disc or a sphere, such as `{ centre = [0, 0], radius = 1 }`")]
pub(in crate::scene) struct BallText {
    pub centre: Vector,
    pub radius: Number,
    pub inner: Option<Number>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a cylinder or tube, such as `{ start = [0, 0, 0], end = [0, 0, 1], radius = 0.5 }`"
)]
pub(in crate::scene) struct CylinderText {
    pub start: Vector,
    pub end: Vector,
    pub radius: Number,
    pub inner: Option<Number>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a polygon, such as `{ corners = [[0, 0], [1, 0], [0, 1]] }`")]
pub(in crate::scene) struct PolygonText {
    pub corners: Spanned<Vec<Vector>>,
    pub height: Option<Vector>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a trapezoid, such as `{ lower = [0, 0], base = 2, top = 1, rise = 1 }`")]
pub(in crate::scene) struct TrapezoidText {
    pub lower: Vector,
    pub base: Number,
    pub top: Number,
    pub rise: Number,
    pub offset: Option<Number>,
    pub height: Option<Vector>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an STL file, such as `{ file = \"bracket.stl\", scale = 0.001 }`")]
pub(in crate::scene) struct StlText {
    pub file: Text,
    pub scale: Option<Number>,
    pub shift: Option<Vector>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a Gmsh file, such as `{ file = \"part.msh\", particles = \"nodes\" }`")]
pub(in crate::scene) struct MeshText {
    pub file: Text,
    #[serde(default)]
    pub particles: MeshPointsText,
    pub group: Option<Text>,
    pub scale: Option<Number>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum MeshPointsText {
    #[default]
    Cells,
    Nodes,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a lattice, such as `{ angle = 30 }`")]
pub(in crate::scene) struct LatticeText {
    pub angle: Option<Number>,
    pub axis: Option<Vector>,
    pub corner: Option<Vector>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a ring, such as `{ centre = [0, 0], inner = 0.5, outer = 1 }`")]
pub(in crate::scene) struct RingText {
    pub centre: Vector,
    pub inner: Option<Number>,
    pub outer: Number,
    pub height: Option<Vector>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a mapped box, such as `{ lower = [0, 0], upper = [1, 1], map = [\"X*(1 + Y)\", \"Y\"] }`"
)]
pub(in crate::scene) struct MappedBoxText {
    pub lower: Vector,
    pub upper: Vector,
    pub map: FieldList,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a box, such as `{ lower = [0, 0], upper = [1, 1] }`")]
pub(in crate::scene) struct BoxText {
    pub lower: Vector,
    pub upper: Vector,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a perturbation, such as `{ amount = 0.2 }`")]
pub(in crate::scene) struct PerturbText {
    pub amount: Number,
    #[serde(default = "first_seed")]
    pub seed: u64,
}

fn first_seed() -> u64 {
    1
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a list of points, such as `{ file = \"cloud.csv\", spacing = 0.1 }`")]
pub(in crate::scene) struct PointsText {
    pub file: Text,
    pub spacing: Number,
    pub faces: Option<Text>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum LayoutText {
    #[default]
    Vertex,
    Cell,
}

/// One layout for all directions, or one for each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::scene) enum LayoutsText {
    All(LayoutText),
    Each(Vec<LayoutText>),
}

impl<'de> Deserialize<'de> for LayoutsText {
    // By hand: an untagged enum would lose what is wrong.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read;

        impl<'de> Visitor<'de> for Read {
            type Value = LayoutsText;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a layout, or a list of one for each direction")
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<LayoutsText, E> {
                LayoutText::deserialize(value.into_deserializer()).map(LayoutsText::All)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<LayoutsText, A::Error> {
                let mut layouts = Vec::new();
                while let Some(layout) = list.next_element()? {
                    layouts.push(layout);
                }
                Ok(LayoutsText::Each(layouts))
            }
        }

        deserializer.deserialize_any(Read)
    }
}

impl From<LayoutText> for Layout {
    fn from(text: LayoutText) -> Self {
        match text {
            LayoutText::Vertex => Self::Vertex,
            LayoutText::Cell => Self::Cell,
        }
    }
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum KernelText {
    #[default]
    CubicSpline,
    WendlandC2,
    QuinticSpline,
}

impl From<KernelText> for KernelChoice {
    fn from(text: KernelText) -> Self {
        match text {
            KernelText::CubicSpline => Self::CubicSpline,
            KernelText::WendlandC2 => Self::WendlandC2,
            KernelText::QuinticSpline => Self::QuinticSpline,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum VolumeText {
    Cells,
    Stencil,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum WeightText {
    #[default]
    Auto,
    Balanced,
    Cells,
    Separate,
    Single,
}

impl From<WeightText> for WeightChoice {
    fn from(text: WeightText) -> Self {
        match text {
            WeightText::Separate => Self::Separate,
            WeightText::Single => Self::Single,
            WeightText::Balanced => Self::Balanced,
            WeightText::Cells => Self::Cells,
            WeightText::Auto => Self::Auto,
        }
    }
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum CofactorText {
    #[default]
    Geometric,
    Evolved,
}

impl From<CofactorText> for CofactorChoice {
    fn from(text: CofactorText) -> Self {
        match text {
            CofactorText::Geometric => Self::Geometric,
            CofactorText::Evolved => Self::Evolved,
        }
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum VolumeRatioText {
    #[default]
    Auto,
    Determinant,
    Evolved,
}

impl From<VolumeRatioText> for VolumeRatioChoice {
    fn from(text: VolumeRatioText) -> Self {
        match text {
            VolumeRatioText::Auto => Self::Auto,
            VolumeRatioText::Determinant => Self::Determinant,
            VolumeRatioText::Evolved => Self::Evolved,
        }
    }
}
