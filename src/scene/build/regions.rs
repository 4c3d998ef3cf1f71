//! Shapes that are cut out of a lattice: set operations, round and polygonal shapes, the inside of an STL file.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::imports::{bytes, in_file};
use super::shapes::Filled;
use crate::geometry::{CutError, CutLattice, Region, Surface, polygon_area, read_stl};
use crate::scene::document::{
    BallText, BodyText, CylinderText, LatticeText, Measure, PolygonText, RingText, ShapeText, Spanned, StlText,
    TrapezoidText, Vector as VectorText,
};
use crate::scene::findings::{Findings, Span};
use crate::scene::units::Length;
use crate::setup::GeometryRecord;
use crate::tensor::{Tensor, Vector};

/// Volume error that is worth a warning.
const NOTICEABLE: f64 = 0.005;

/// A lattice to be cut.
pub(super) struct Cut<const D: usize> {
    pub lattice: CutLattice<D>,
    /// File, its triangles and open edges, if the shape is one.
    import: Option<(String, usize, usize)>,
    /// Place of the shape in the scene.
    span: Span,
}

impl<const D: usize> Cut<D> {
    /// Cuts; `None` if a mistake was noted.
    pub fn fill(self, findings: &mut Findings<'_>) -> Option<Filled<D>> {
        let (particles, report) = match self.lattice.particles() {
            Ok(filled) => filled,
            Err(error) => {
                findings.error(self.span, error.to_string(), "give a smaller spacing, or check the set operations");
                return None;
            }
        };
        let volume_error = report.exact.map(|exact| report.found / exact - 1.0);
        if let Some(error) = volume_error.filter(|error| error.abs() > NOTICEABLE) {
            let message =
                format!("the cells hold a volume that is off by {:.2} %: give a smaller spacing", 100.0 * error);
            findings.warning(self.span.clone(), message);
        }
        if report.thin > 0 {
            let message = format!(
                "the body is thinner than the spacing in {} cells, which have less than half a volume: give a smaller \
                 spacing",
                report.thin
            );
            findings.warning(self.span.clone(), message);
        }
        if let Some((file, triangles, open)) = &self.import {
            if *open > 0 {
                let message = format!(
                    "{file}: {open} open edges of {triangles} triangles: it was filled by the winding number, has no \
                     faces, and its weights cannot be balanced; close the surface"
                );
                findings.warning(self.span.clone(), message);
            } else if !report.has_faces {
                let message = format!(
                    "{file}: its {triangles} triangles meet each other: it was filled by the winding number, has no \
                     faces, and its weights cannot be balanced; unite the parts before the export"
                );
                findings.warning(self.span.clone(), message);
            }
        }
        let record = GeometryRecord {
            source: self.import.as_ref().map_or_else(|| "shape".to_owned(), |(file, _, _)| file.clone()),
            exact_volume: report.exact,
            volume_error,
            triangles: self.import.as_ref().map(|(_, triangles, _)| *triangles),
            open_edges: self.import.as_ref().map(|(_, _, open)| *open),
            thin_cells: report.thin,
            has_faces: report.has_faces,
            ..GeometryRecord::default()
        };
        let spacing = self.lattice.spacing();
        Some(Filled { particles, spacing, groups: BTreeMap::new(), record: Some(record) })
    }
}

/// The lattice and the region of a body; `None` if a mistake was noted.
pub(super) fn cut<const D: usize>(
    body: &Spanned<BodyText>,
    shape: &Spanned<ShapeText>,
    base: &Path,
    findings: &mut Findings<'_>,
) -> Option<Cut<D>> {
    let text = body.get_ref();
    let before = findings.count();
    let surplus = [
        (text.counts.as_ref().map(Spanned::span), "counts", "give `spacing`"),
        (text.layout.as_ref().map(Spanned::span), "layout", "remove it: particles sit in the middle of what is inside"),
        (text.perturb.as_ref().map(Spanned::span), "perturb", "remove it"),
    ];
    for (given, key, remedy) in surplus {
        if let Some(given) = given {
            findings.error(given, format!("`{key}` does not go with a shape that is cut out of a lattice"), remedy);
        }
    }
    let spacing = match &text.spacing {
        Some(spacing) => findings.positive(spacing, "spacing"),
        None => {
            findings.error(body.span(), "the body has no `spacing`", "add `spacing = 0.1`, in metres");
            None
        }
    };
    let lattice = text.lattice.as_ref().map_or(Some((Tensor::identity(), None)), |text| lattice(text, findings));
    let region = region::<D>(shape, base, findings);
    let (spacing, (turn, corner), region) = (spacing?, lattice?, region?);
    if findings.count() > before {
        return None;
    }
    let import = match (&region, shape.get_ref()) {
        (Region::Inside(surface), ShapeText::Stl(stl)) => {
            if surface.was_reversed() {
                let message = format!("{}: its triangles face inwards: they were turned", stl.file.get_ref());
                findings.warning(stl.file.span(), message);
            }
            Some((stl.file.get_ref().clone(), surface.triangles().len(), surface.open_edges()))
        }
        _ => None,
    };
    match CutLattice::new(region, spacing, turn, corner) {
        Ok(lattice) => Some(Cut { lattice, import, span: shape.span() }),
        Err(error) => {
            let span = text.spacing.as_ref().filter(|_| matches!(error, CutError::Spacing { .. }));
            let remedy = match error {
                CutError::Unbounded(_) => "intersect it with a box",
                CutError::Empty => "check the sizes, and the order of the set operations",
                CutError::Spacing { .. } => "give a smaller spacing",
            };
            findings.error(span.map_or(shape.span(), Spanned::span), error.to_string(), remedy);
            None
        }
    }
}

/// Directions of a turned lattice, and a corner of its cells.
fn lattice<const D: usize>(
    text: &Spanned<LatticeText>,
    findings: &mut Findings<'_>,
) -> Option<(Tensor<D>, Option<Vector<D>>)> {
    let text = text.get_ref();
    let angle = match &text.angle {
        Some(angle) => findings.within(angle, "angle", "finite", |_| true)?.to_radians(),
        None => 0.0,
    };
    let corner = match &text.corner {
        Some(corner) => Some(findings.vector::<D>(corner, "corner")?),
        None => None,
    };
    let mut axis = nalgebra::Vector3::z();
    if let Some(given) = &text.axis {
        if D != 3 {
            findings.error(given.span(), format!("a {D}-dimensional lattice has no axis"), "remove it");
            return None;
        }
        let wanted = findings.vector::<3>(given, "axis")?;
        let largest = wanted.amax();
        if largest == 0.0 {
            findings.error(given.span(), "the axis is zero", "give a direction, such as [0, 0, 1]");
            return None;
        }
        axis = (wanted / largest).normalize();
    }
    let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_unchecked(axis), angle);
    let turn = if angle == 0.0 { Tensor::identity() } else { Tensor::from_fn(|i, j| turn[(i, j)]) };
    Some((turn, corner))
}

/// A region of the dimension of the scene; `None` if a mistake was noted.
fn region<const D: usize>(text: &Spanned<ShapeText>, base: &Path, findings: &mut Findings<'_>) -> Option<Region<D>> {
    let span = text.span();
    let only = |dimensions: &[usize], findings: &mut Findings<'_>| {
        let fits = dimensions.contains(&D);
        if !fits {
            let message = format!("a {D}-dimensional scene has no such shape");
            let remedy = match D {
                1 => "use `shape.box`",
                2 => "use disc, ring, polygon, trapezoid, box or half_space",
                _ => "use sphere, cylinder, ring, polygon, trapezoid, box, half_space or stl",
            };
            findings.error(span.clone(), message, remedy);
        }
        fits.then_some(())
    };
    match text.get_ref() {
        ShapeText::Box(text) => {
            let (lower, upper) =
                (findings.vector::<D>(&text.lower, "lower"), findings.vector::<D>(&text.upper, "upper"));
            let (lower, upper) = (lower?, upper?);
            if (0..D).any(|axis| upper[axis] <= lower[axis]) {
                let remedy = "make every component of `upper` larger than that of `lower`";
                findings.error(text.upper.span(), "the box has no extent", remedy);
                return None;
            }
            Some(Region::Box { lower, upper })
        }
        ShapeText::MappedBox(_) => {
            findings.error(span, "a mapped box cannot be part of a set operation", "use a polygon or a box");
            None
        }
        ShapeText::Ring(ring) => only(&[2, 3], findings).and_then(|()| self::ring(ring, span, findings)),
        ShapeText::Disc(ball) => only(&[2], findings).and_then(|()| self::ball(ball, findings)),
        ShapeText::Sphere(ball) => only(&[3], findings).and_then(|()| self::ball(ball, findings)),
        ShapeText::Cylinder(text) => only(&[3], findings).and_then(|()| cylinder(text, findings)),
        ShapeText::HalfSpace(half) => {
            let (point, normal) =
                (findings.vector::<D>(&half.point, "point"), findings.vector::<D>(&half.normal, "normal"));
            let (point, normal) = (point?, normal?);
            let largest = normal.amax();
            if largest == 0.0 {
                findings.error(half.normal.span(), "the normal is zero", "give a direction, such as [0, -1]");
                return None;
            }
            // As in selections, it points into the half-space.
            Some(Region::HalfSpace { point, normal: -(normal / largest).normalize() })
        }
        ShapeText::Polygon(text) => only(&[2, 3], findings).and_then(|()| polygon(text, span, findings)),
        ShapeText::Trapezoid(text) => only(&[2, 3], findings).and_then(|()| trapezoid(text, span, findings)),
        ShapeText::Stl(text) => only(&[3], findings).and_then(|()| stl(text, base, findings)),
        ShapeText::Union(parts) => Some(Region::Union(regions(parts, span, base, findings)?)),
        ShapeText::Intersection(parts) => Some(Region::Intersection(regions(parts, span, base, findings)?)),
        ShapeText::Difference(parts) => Some(Region::Difference(regions(parts, span, base, findings)?)),
    }
}

fn regions<const D: usize>(
    parts: &[Spanned<ShapeText>],
    span: Span,
    base: &Path,
    findings: &mut Findings<'_>,
) -> Option<Vec<Region<D>>> {
    if parts.is_empty() {
        findings.error(span, "a set operation on nothing", "give a list of shapes, `[{ box = … }, { disc = … }]`");
        return None;
    }
    let found: Vec<Option<Region<D>>> = parts.iter().map(|part| region(part, base, findings)).collect();
    found.into_iter().collect()
}

/// Radii in order.
fn radii(inner: Option<&Measure<Length>>, outer: &Measure<Length>, findings: &mut Findings<'_>) -> Option<[f64; 2]> {
    let outer_radius = findings.positive(outer, "radius")?;
    let inner = inner.map_or(Some(0.0), |inner| findings.not_negative(inner, "inner"))?;
    if inner >= outer_radius {
        findings.error(outer.span(), format!("radii from {inner} to {outer_radius}"), "make the outer one larger");
        return None;
    }
    Some([inner, outer_radius])
}

fn ball<const D: usize>(text: &BallText, findings: &mut Findings<'_>) -> Option<Region<D>> {
    let centre = findings.vector::<D>(&text.centre, "centre");
    let [inner, outer] = radii(text.inner.as_ref(), &text.radius, findings)?;
    Some(Region::Shell { centre: centre?, inner, outer })
}

fn ring<const D: usize>(text: &RingText, span: Span, findings: &mut Findings<'_>) -> Option<Region<D>> {
    let centre = findings.vector::<2>(&text.centre, "centre");
    let radii = radii(text.inner.as_ref(), &text.outer, findings);
    let height = height::<D>(text.height.as_ref(), span, findings);
    let (centre, [inner, outer], height) = (centre?, radii?, height?);
    let place = |z: f64| Vector::from_fn(|axis, _| if axis < 2 { centre[axis] } else { z });
    Some(match height {
        None => Region::Shell { centre: place(0.0), inner, outer },
        Some([low, high]) => {
            let axis = Vector::from_fn(|axis, _| if axis == 2 { 1.0 } else { 0.0 });
            Region::Tube { start: place(low), axis, length: high - low, inner, outer }
        }
    })
}

fn cylinder<const D: usize>(text: &CylinderText, findings: &mut Findings<'_>) -> Option<Region<D>> {
    let (start, end) = (findings.vector::<D>(&text.start, "start"), findings.vector::<D>(&text.end, "end"));
    let radii = radii(text.inner.as_ref(), &text.radius, findings);
    let (start, end, [inner, outer]) = (start?, end?, radii?);
    let length = (end - start).norm();
    if length <= 0.0 || !length.is_finite() {
        findings.error(text.end.span(), "the cylinder has no length", "give two different ends");
        return None;
    }
    Some(Region::Tube { start, axis: (end - start) / length, length, inner, outer })
}

/// Ends along z: in space, and there only.
#[allow(clippy::option_option, reason = "a mistake is not the absence of a height")]
fn height<const D: usize>(
    text: Option<&VectorText<Length>>,
    span: Span,
    findings: &mut Findings<'_>,
) -> Option<Option<[f64; 2]>> {
    match (text, D == 3) {
        (None, false) => Some(None),
        (Some(text), true) => {
            let [low, high]: [f64; 2] = findings.vector::<2>(text, "height")?.into();
            if high <= low {
                findings.error(text.span(), format!("a height from {low} to {high}"), "give the lower end first");
                return None;
            }
            Some(Some([low, high]))
        }
        (Some(text), false) => {
            findings.error(text.span(), format!("a {D}-dimensional shape has no height"), "remove it");
            None
        }
        (None, true) => {
            findings.error(span, "the shape has no height", "add `height = [0, 1]`, its ends along z");
            None
        }
    }
}

fn polygon<const D: usize>(text: &PolygonText, span: Span, findings: &mut Findings<'_>) -> Option<Region<D>> {
    let corners: Vec<Option<[f64; 2]>> =
        text.corners.get_ref().iter().map(|corner| findings.vector::<2>(corner, "corners").map(Into::into)).collect();
    let height = height::<D>(text.height.as_ref(), span, findings)?;
    let corners: Vec<[f64; 2]> = corners.into_iter().collect::<Option<_>>()?;
    if corners.len() < 3 || polygon_area(&corners) == 0.0 {
        let message = format!("a polygon of {} corners without an area", corners.len());
        findings.error(text.corners.span(), message, "give three corners or more, in order");
        return None;
    }
    if let Some((i, j)) = crossing(&corners) {
        let message = format!("edges {} and {} of the polygon cross", i + 1, j + 1);
        findings.error(text.corners.span(), message, "give the corners in order around it");
        return None;
    }
    Some(Region::Polygon { corners, height })
}

/// The first two edges of a polygon that cross.
fn crossing(corners: &[[f64; 2]]) -> Option<(usize, usize)> {
    let count = corners.len();
    let edge = |i: usize| (corners[i], corners[(i + 1) % count]);
    let side =
        |(a, b): ([f64; 2], [f64; 2]), p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    (0..count).find_map(|i| {
        let other = (i + 2..count).find(|j| {
            let (one, two) = (edge(i), edge(*j));
            (i, *j) != (0, count - 1)
                && side(one, two.0) * side(one, two.1) < 0.0
                && side(two, one.0) * side(two, one.1) < 0.0
        });
        other.map(|j| (i, j))
    })
}

fn trapezoid<const D: usize>(text: &TrapezoidText, span: Span, findings: &mut Findings<'_>) -> Option<Region<D>> {
    let lower = findings.vector::<2>(&text.lower, "lower");
    let base = findings.positive(&text.base, "base");
    let top = findings.not_negative(&text.top, "top");
    let rise = findings.positive(&text.rise, "rise");
    let offset = match &text.offset {
        Some(offset) => findings.within(offset, "offset", "finite", |_| true),
        None => base.zip(top).map(|(base, top)| (base - top) / 2.0),
    };
    let height = height::<D>(text.height.as_ref(), span, findings);
    let ([x, y], base, top, rise, offset): ([f64; 2], _, _, _, _) = (lower?.into(), base?, top?, rise?, offset?);
    let corners = vec![[x, y], [x + base, y], [x + offset + top, y + rise], [x + offset, y + rise]];
    Some(Region::Polygon { corners, height: height? })
}

fn stl<const D: usize>(text: &StlText, base: &Path, findings: &mut Findings<'_>) -> Option<Region<D>> {
    let scale = text.scale.as_ref().map_or(Some(findings.units.length()), |scale| findings.positive(scale, "scale"));
    let shift = text.shift.as_ref().map_or(Some(Vector::zeros()), |shift| findings.vector::<3>(shift, "shift"));
    let (path, bytes) = bytes(&text.file, base, findings)?;
    let triangles = match read_stl(&bytes) {
        Ok(triangles) => triangles,
        Err(errors) => {
            let content = String::from_utf8_lossy(&bytes);
            for error in errors {
                findings.elsewhere(text.file.span(), in_file(&path, &content, error));
            }
            return None;
        }
    };
    let (scale, shift) = (scale?, shift?);
    let moved = |triangle: [Vector<3>; 3]| triangle.map(|corner| corner * scale + shift);
    Some(Region::Inside(Arc::new(Surface::new(triangles.into_iter().map(moved).collect()))))
}
