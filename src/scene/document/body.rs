//! `[[body]]`.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, IntoDeserializer, SeqAccess, Visitor};

use super::{Direction, FieldList, HalfSpaceText, HourglassText, MaterialText, Measure, Number, Spanned, Text, Vector};
use crate::geometry::Layout;
use crate::scene::units::{Angle, Length};
use crate::setup::{CofactorChoice, KernelChoice, VolumeRatioChoice, WeightChoice};

/// A body: a shape or a file, its particles, its material.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table that describes a body")]
pub(in crate::scene) struct BodyText {
    /// Name for messages and conditions; default: body 1, …
    pub name: Option<Text>,
    /// Distance of particles; instead of `counts`.
    pub spacing: Option<Measure<Length>>,
    /// Particles per direction; instead of `spacing`, for boxes.
    pub counts: Option<Spanned<Vec<Spanned<u64>>>>,
    /// Where particles sit: one for all directions, or one for each; for boxes.
    #[cfg_attr(test, schemars(extend("default" = LayoutText::default())))]
    pub layout: Option<Spanned<LayoutsText>>,
    /// Shape that is filled; one of shape, points and mesh.
    pub shape: Option<Spanned<ShapeText>>,
    /// Moves inner corners of the cells; default none.
    pub perturb: Option<Spanned<PerturbText>>,
    /// Particles from a list of points.
    pub points: Option<Spanned<PointsText>>,
    /// Particles from a mesh.
    pub mesh: Option<Spanned<MeshText>>,
    /// How the lattice is turned and placed; default: along the axes, centred.
    pub lattice: Option<Spanned<LatticeText>>,
    /// Kernel.
    #[serde(default)]
    pub kernel: KernelText,
    /// Smoothing length over spacing.
    #[cfg_attr(test, schemars(extend("default" = 1.2)))]
    pub smoothing: Option<Number>,
    /// Weights of the gradient.
    #[serde(default)]
    pub weights: WeightText,
    /// Volumes of particles.
    #[cfg_attr(test, schemars(extend("default" = VolumeText::Cells)))]
    pub volumes: Option<Spanned<VolumeText>>,
    /// Where the cofactor of F comes from.
    #[serde(default)]
    pub cofactor: CofactorText,
    /// Where the volume ratio J comes from.
    #[cfg_attr(test, schemars(extend("default" = VolumeRatioText::default())))]
    pub volume_ratio: Option<Spanned<VolumeRatioText>>,
    /// Coefficient of the hourglass control, or none; default: that of the scene.
    pub hourglass: Option<Spanned<HourglassText>>,
    /// The law and its parameters, as in `material.neo_hookean = { … }`.
    pub material: MaterialText,
}

/// A shape, or a set operation on shapes.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", expecting = "a shape, such as `shape.box = { lower = [0, 0], upper = [1, 1] }`")]
pub(in crate::scene) enum ShapeText {
    /// A box along the axes.
    Box(BoxText),
    /// A box that is bent by a map.
    MappedBox(MappedBoxText),
    /// A ring or disc, filled with concentric rings.
    Ring(RingText),
    /// A disc, in two dimensions.
    Disc(BallText),
    /// A sphere, in three dimensions.
    Sphere(BallText),
    /// A cylinder or tube, in three dimensions.
    Cylinder(CylinderText),
    /// A half-space, within set operations.
    HalfSpace(HalfSpaceText),
    /// A polygon, or a prism.
    Polygon(PolygonText),
    /// A trapezoid, or a prism.
    Trapezoid(TrapezoidText),
    /// The inside of a triangulated surface.
    Stl(StlText),
    /// What is in any of them.
    Union(Vec<Spanned<ShapeText>>),
    /// What is in all of them.
    Intersection(Vec<Spanned<ShapeText>>),
    /// What is in the first and in none of the others.
    Difference(Vec<Spanned<ShapeText>>),
}

/// A disc or a sphere, hollow if it has an inner radius.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a disc or a sphere, such as `{ centre = [0, 0], radius = 1 }`")]
pub(in crate::scene) struct BallText {
    /// Centre.
    pub centre: Vector<Length>,
    /// Radius.
    pub radius: Measure<Length>,
    /// Radius of the hole.
    #[cfg_attr(test, schemars(extend("default" = 0.0)))]
    pub inner: Option<Measure<Length>>,
}

/// A cylinder or tube.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "a cylinder or tube, such as `{ start = [0, 0, 0], end = [0, 0, 1], radius = 0.5 }`"
)]
pub(in crate::scene) struct CylinderText {
    /// Middle of one end.
    pub start: Vector<Length>,
    /// Middle of the other end.
    pub end: Vector<Length>,
    /// Radius.
    pub radius: Measure<Length>,
    /// Radius of the hole.
    #[cfg_attr(test, schemars(extend("default" = 0.0)))]
    pub inner: Option<Measure<Length>>,
}

/// A polygon, in three dimensions a prism.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a polygon, such as `{ corners = [[0, 0], [1, 0], [0, 1]] }`")]
pub(in crate::scene) struct PolygonText {
    /// Corners in order around it, in the plane.
    pub corners: Spanned<Vec<Vector<Length>>>,
    /// Ends along z; in three dimensions only.
    pub height: Option<Vector<Length>>,
}

/// A trapezoid with a base along x, in three dimensions a prism.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a trapezoid, such as `{ lower = [0, 0], base = 2, top = 1, rise = 1 }`")]
pub(in crate::scene) struct TrapezoidText {
    /// Left end of the base.
    pub lower: Vector<Length>,
    /// Length of the base.
    pub base: Measure<Length>,
    /// Length of the top; may be zero.
    pub top: Measure<Length>,
    /// Distance of base and top.
    pub rise: Measure<Length>,
    /// How far the top begins to the right of the base; default: symmetric.
    pub offset: Option<Measure<Length>>,
    /// Ends along z; in three dimensions only.
    pub height: Option<Vector<Length>>,
}

/// The inside of a triangulated surface, where its generalised winding number is at least a half.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "an STL file, such as `{ file = \"bracket.stl\", scale = 0.001 }`")]
pub(in crate::scene) struct StlText {
    /// STL file, ASCII or binary, sought from the folder of the scene.
    pub file: Text,
    /// Length of one unit of the file; default: one unit of the scene.
    #[cfg_attr(test, schemars(extend("default" = 1.0)))]
    pub scale: Option<Measure<Length>>,
    /// Moved by this, after the scale; default zero.
    pub shift: Option<Vector<Length>>,
}

/// A mesh of Gmsh, 4.1 or 2.2, ASCII or binary, elements of first order.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a Gmsh file, such as `{ file = \"part.msh\", particles = \"nodes\" }`")]
pub(in crate::scene) struct MeshText {
    /// Mesh file, sought from the folder of the scene.
    pub file: Text,
    /// What particles are made of.
    #[serde(default)]
    pub particles: MeshPointsText,
    /// Physical group whose cells are taken; default: all.
    pub group: Option<Text>,
    /// Length of one unit of the file; default: one unit of the scene.
    #[cfg_attr(test, schemars(extend("default" = 1.0)))]
    pub scale: Option<Measure<Length>>,
}

/// What particles are made of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum MeshPointsText {
    /// One of every cell, at its centroid.
    #[default]
    Cells,
    /// One of every node, with its share of the cells around it.
    Nodes,
}

/// How the lattice that shapes are cut out of is turned and placed. Without `counts`, `layout` and `perturb`.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a lattice, such as `{ angle = 30 }`")]
pub(in crate::scene) struct LatticeText {
    /// Angle it is turned by.
    #[cfg_attr(test, schemars(extend("default" = 0.0)))]
    pub angle: Option<Measure<Angle>>,
    /// Axis it is turned about; in three dimensions only; default z.
    #[cfg_attr(test, schemars(extend("default" = [0, 0, 1])))]
    pub axis: Option<Direction>,
    /// Place of a corner of its cells; default: centred on the shape.
    pub corner: Option<Vector<Length>>,
}

/// A ring or disc, filled with concentric rings of particles.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a ring, such as `{ centre = [0, 0], inner = 0.5, outer = 1 }`")]
pub(in crate::scene) struct RingText {
    /// Centre, in the plane.
    pub centre: Vector<Length>,
    /// Radius of the hole; default: a disc.
    #[cfg_attr(test, schemars(extend("default" = 0.0)))]
    pub inner: Option<Measure<Length>>,
    /// Outer radius.
    pub outer: Measure<Length>,
    /// Ends along z; in three dimensions only.
    pub height: Option<Vector<Length>>,
}

/// A box that is bent by a map.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "a mapped box, such as `{ lower = [0, 0], upper = [1, 1], map = [\"X*(1 + Y)\", \"Y\"] }`"
)]
pub(in crate::scene) struct MappedBoxText {
    /// Lower corner before it is bent.
    pub lower: Vector<Length>,
    /// Upper corner before it is bent.
    pub upper: Vector<Length>,
    /// Where corners of cells go, a field of X, Y, Z per direction.
    pub map: FieldList<Length>,
}

/// A box.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a box, such as `{ lower = [0, 0], upper = [1, 1] }`")]
pub(in crate::scene) struct BoxText {
    /// Lower corner.
    pub lower: Vector<Length>,
    /// Upper corner.
    pub upper: Vector<Length>,
}

/// Moves inner corners of the cells by chance.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a perturbation, such as `{ amount = 0.2 }`")]
pub(in crate::scene) struct PerturbText {
    /// Largest move in spacings, up to 0.45.
    pub amount: Number,
    /// Seed of the chance.
    #[serde(default = "first_seed")]
    pub seed: u64,
}

fn first_seed() -> u64 {
    1
}

/// Particles from a list of points, CSV or VTU.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a list of points, such as `{ file = \"cloud.csv\", spacing = 0.1 }`")]
pub(in crate::scene) struct PointsText {
    /// CSV of `x,y` or `x,y,volume` per line, or a VTU; sought from the folder of the scene.
    pub file: Text,
    /// Distance of particles.
    pub spacing: Measure<Length>,
    /// CSV of the boundary, `x,y,nx,ny,area` per line; default: the boundary is not known.
    pub faces: Option<Text>,
}

/// Where particles sit in the cells of a lattice.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum LayoutText {
    /// On the corners, and so on the boundary.
    #[default]
    Vertex,
    /// In the middle, half a spacing inside.
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

/// Kernels.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum KernelText {
    /// Cubic B-spline.
    #[default]
    CubicSpline,
    /// Wendland C2.
    WendlandC2,
    /// Quintic B-spline, of wider support.
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

/// Volumes of particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum VolumeText {
    /// Those of the cells.
    Cells,
    /// Adapted to the stencil, for plain boxes: balancing then changes weights beside the boundary only.
    Stencil,
}

/// Weights of the gradient.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum WeightText {
    /// Cells or balanced where possible, else separate.
    #[default]
    Auto,
    /// Changed as little as possible such that constant and linear stresses are in balance.
    Balanced,
    /// Those of multilinear cells; for boxes with the layout vertex.
    Cells,
    /// Of the kernel, corrected on each side.
    Separate,
    /// Of the kernel, corrected on one side.
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

/// Where the cofactor of F comes from.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum CofactorText {
    /// From F.
    #[default]
    Geometric,
    /// Evolved with the motion.
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

/// Where the volume ratio J comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "snake_case")]
pub(in crate::scene) enum VolumeRatioText {
    /// det F where J is not coupled by tau_p, an unknown or in the cofactor.
    #[default]
    Auto,
    /// det F.
    Determinant,
    /// Evolved with the motion.
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
