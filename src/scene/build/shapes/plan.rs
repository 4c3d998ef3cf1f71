//! From the text of a body to the plan of its shape; every mistake with its place.

use std::path::Path;

use super::super::{imports, regions};
use super::{Mapping, Plan};
use crate::expression::Expression;
use crate::geometry::{BoxLattice, LatticeError, Layout, RingLattice};
use crate::scene::document::{
    BodyText, LayoutText, LayoutsText, MappedBoxText, PerturbText, RingText, Scalar, ShapeText, Spanned,
};
use crate::scene::findings::{Findings, Span};

/// Change of a spacing, to make it divide the box, that is worth a warning.
const NOTICEABLE: f64 = 0.01;
/// Largest perturbation, spacings: cells of a square lattice stay upright up to a quarter, and some beyond.
const LARGEST_PERTURBATION: f64 = 0.45;

/// What a body asks for; `None` if a mistake was noted.
pub fn plan<const D: usize>(body: &Spanned<BodyText>, base: &Path, findings: &mut Findings<'_>) -> Option<Plan<D>> {
    let text = body.get_ref();
    let given = [
        text.shape.as_ref().map(Spanned::span),
        text.points.as_ref().map(Spanned::span),
        text.mesh.as_ref().map(Spanned::span),
    ];
    if let Some(span) = given.into_iter().flatten().nth(1) {
        findings.error(span, "a body has one of shape, points and mesh", "remove the others");
        return None;
    }
    if let Some(points) = &text.points {
        surplus(text, "a list of points", "give it inside `points`", findings);
        return imports::points(points.get_ref(), base, findings).map(|filled| Plan::Filled(Box::new(filled)));
    }
    if let Some(mesh) = &text.mesh {
        surplus(text, "a mesh", "remove it: the mesh decides", findings);
        return imports::mesh(mesh.get_ref(), base, findings).map(|filled| Plan::Filled(Box::new(filled)));
    }
    let Some(shape) = &text.shape else {
        findings.error(
            body.span(),
            "the body has no shape",
            "add `shape.box = { lower = …, upper = … }`, `points = { file = \"cloud.csv\", spacing = 0.1 }` or `mesh`",
        );
        return None;
    };
    let (lower, upper, map) = match (shape.get_ref(), &text.lattice) {
        (ShapeText::Box(text), None) => (&text.lower, &text.upper, None),
        (ShapeText::MappedBox(text), None) => (&text.lower, &text.upper, Some(text)),
        (ShapeText::Ring(ring), None) => return self::ring(body, shape.span(), ring, findings),
        (ShapeText::MappedBox(_) | ShapeText::Ring(_), Some(lattice)) => {
            findings.error(lattice.span(), "this shape has a lattice of its own", "remove it");
            return None;
        }
        _ => return regions::cut(body, shape, base, findings).map(|cut| Plan::Cut(Box::new(cut))),
    };
    let map = map.map(|text| self::map(text, findings));
    let perturbation = text.perturb.as_ref().map(|text| perturbation(text, findings));
    let lower = findings.vector::<D>(lower, "lower");
    let upper = findings.vector::<D>(upper, "upper");
    let lattice = lattice(body, shape.span(), lower?.into(), upper?.into(), findings)?;
    if map.is_none() && perturbation.is_none() {
        return Some(Plan::Lattice(lattice));
    }
    let map = map.map_or(Some(None), |map| map.map(Some))?;
    let perturbation = perturbation.map_or(Some(None), |found| found.map(Some))?;
    Some(Plan::Mapped(Mapping { lattice, map, perturbation, span: shape.span() }))
}

/// Notes keys of lattices where there is none.
fn surplus(text: &BodyText, what: &str, spacing: &str, findings: &mut Findings<'_>) {
    let keys = [
        (text.spacing.as_ref().map(Spanned::span), "spacing", spacing),
        (text.counts.as_ref().map(Spanned::span), "counts", "remove it"),
        (text.layout.as_ref().map(Spanned::span), "layout", "remove it"),
        (text.perturb.as_ref().map(Spanned::span), "perturb", "remove it"),
        (text.lattice.as_ref().map(Spanned::span), "lattice", "remove it"),
    ];
    for (span, key, remedy) in keys {
        if let Some(span) = span {
            findings.error(span, format!("`{key}` belongs to lattices, not to {what}"), remedy);
        }
    }
}

/// The fields of a map.
fn map<const D: usize>(text: &MappedBoxText, findings: &mut Findings<'_>) -> Option<[Expression; D]> {
    let map = findings.fields::<D>(&text.map, "map")?;
    if let Some((field, text)) = map.iter().zip(text.map.get_ref()).find(|(field, _)| field.depends_on_time()) {
        let message = format!("the map `{field}` depends on the time");
        findings.error(text.span(), message, "use X, Y, Z alone: it shapes the body before anything moves");
        return None;
    }
    Some(map)
}

fn perturbation(text: &Spanned<PerturbText>, findings: &mut Findings<'_>) -> Option<(f64, u64)> {
    let text = text.get_ref();
    let wanted = format!("between 0 and {LARGEST_PERTURBATION} spacings");
    let holds = |amount: f64| (0.0..=LARGEST_PERTURBATION).contains(&amount);
    Some((findings.within(&text.amount, "amount", &wanted, holds)?, text.seed))
}

fn ring<const D: usize>(
    body: &Spanned<BodyText>,
    span: Span,
    ring: &RingText,
    findings: &mut Findings<'_>,
) -> Option<Plan<D>> {
    let text = body.get_ref();
    let before = findings.count();
    if D == 1 {
        findings.error(span.clone(), "a ring needs two dimensions", "use `shape.box`, or `dimension = 2`");
    }
    let surplus = [
        (text.counts.as_ref().map(Spanned::span), "counts", "give `spacing`: the rings have as many as fit"),
        (text.layout.as_ref().map(Spanned::span), "layout", "remove it: the outer rings lie on the boundary"),
    ];
    for (given, key, remedy) in surplus {
        if let Some(given) = given {
            findings.error(given, format!("`{key}` belongs to boxes, not to rings"), remedy);
        }
    }
    let centre = findings.vector::<2>(&ring.centre, "centre");
    let inner = ring.inner.as_ref().map_or(Some(0.0), |inner| findings.not_negative(inner, "inner"));
    let outer = findings.positive(&ring.outer, "outer");
    let height = match (&ring.height, D == 3) {
        (Some(height), true) => findings.vector::<2>(height, "height").map(|height| Some(height.into())),
        (None, false) => Some(None),
        (Some(height), false) => {
            findings.error(height.span(), format!("a {D}-dimensional ring has no height"), "remove it");
            None
        }
        (None, true) => {
            findings.error(span.clone(), "the ring has no height", "add `height = [0, 1]`, its ends along z");
            None
        }
    };
    let perturbation = text.perturb.as_ref().map_or(Some((0.0, 0)), |text| perturbation(text, findings));
    let spacing = match &text.spacing {
        Some(spacing) => findings.positive(spacing, "spacing"),
        None => {
            findings.error(body.span(), "the body has no `spacing`", "add `spacing = 0.1`, in metres");
            None
        }
    };
    if findings.count() > before {
        return None;
    }
    match RingLattice::new(centre?.into(), [inner?, outer?], height?, spacing?) {
        Ok(lattice) => Some(Plan::Ring(lattice, perturbation?)),
        Err(error) => {
            let remedy = "make `outer` larger than `inner`, the end above the start, and the spacing smaller than both";
            findings.error(span, error.to_string(), remedy);
            None
        }
    }
}

/// Layout of every direction.
fn layout<const D: usize>(text: &BodyText, findings: &mut Findings<'_>) -> Option<[Layout; D]> {
    let Some(text) = &text.layout else { return Some([Layout::default(); D]) };
    match text.get_ref() {
        LayoutsText::All(layout) => Some([(*layout).into(); D]),
        LayoutsText::Each(layouts) => {
            let layouts: Vec<Layout> = layouts.iter().map(|layout: &LayoutText| (*layout).into()).collect();
            let found = layouts.len();
            layouts.try_into().ok().or_else(|| {
                let message = format!("`layout` has {found} component(s) in a {D}-dimensional scene");
                findings.error(text.span(), message, format!("give {D} component(s), one per direction"));
                None
            })
        }
    }
}

fn lattice<const D: usize>(
    body: &Spanned<BodyText>,
    shape: Span,
    lower: [f64; D],
    upper: [f64; D],
    findings: &mut Findings<'_>,
) -> Option<BoxLattice<D>> {
    let text = body.get_ref();
    let layout = layout(text, findings)?;
    let (lattice, span) = match (&text.spacing, &text.counts) {
        (Some(spacing), None) => {
            let wanted = findings.positive(spacing, "spacing")?;
            (BoxLattice::with_spacing(lower, upper, wanted, layout), spacing.span())
        }
        (None, Some(counts)) => {
            let found = counts.get_ref();
            if found.len() != D {
                let message = format!("`counts` has {} component(s) in a {D}-dimensional scene", found.len());
                findings.error(counts.span(), message, format!("give {D} component(s), one per direction"));
                return None;
            }
            // What does not fit a machine word is too many in any case.
            let numbers = std::array::from_fn(|axis| usize::try_from(*found[axis].get_ref()).unwrap_or(usize::MAX));
            (BoxLattice::with_counts(lower, upper, numbers, layout), counts.span())
        }
        (Some(_), Some(counts)) => {
            findings.error(counts.span(), "`spacing` and `counts` both set the lattice", "remove one of the two");
            return None;
        }
        (None, None) => {
            findings.error(
                body.span(),
                "the body has neither `spacing` nor `counts`",
                "add `spacing = 0.1`, in metres",
            );
            return None;
        }
    };
    let lattice = match lattice {
        Ok(lattice) => lattice,
        Err(error) => {
            let (place, remedy) = match error {
                LatticeError::NoExtent { .. } => {
                    (shape, "make every component of `upper` larger than that of `lower`".into())
                }
                LatticeError::Spacing(_) => (span, "give a positive spacing".to_owned()),
                LatticeError::TooFew { extent, .. } => {
                    (span, format!("the box is {extent} m long there: give a smaller spacing or more counts"))
                }
            };
            findings.error(place, error.to_string(), remedy);
            return None;
        }
    };
    if let Some(spacing) = &text.spacing {
        let wanted = spacing.get_ref().value();
        for (axis, found) in lattice.spacings().into_iter().enumerate() {
            if (found / wanted - 1.0).abs() > NOTICEABLE {
                let axis = ["x", "y", "z"][axis];
                let message =
                    format!("the spacing {wanted} does not divide the box along {axis}: {found} is used there");
                findings.warning(spacing.span(), message);
            }
        }
    }
    Some(lattice)
}
