//! `[[body]]`: lattices and point lists to particles.

use std::ops::Range;
use std::path::Path;

use nalgebra::SVector;

use super::{material, name, stabilisation};
use crate::geometry::{BoxLattice, LatticeError, Layout, PointError, read_points};
use crate::scene::document::{BodyText, Document, PointsText, ShapeText, Spanned};
use crate::scene::errors::SceneError;
use crate::scene::findings::{Findings, Span};
use crate::setup::{Body, KernelChoice, Particles};

/// Change of a spacing, to make it divide the box, that is worth a warning.
const NOTICEABLE: f64 = 0.01;
/// Largest smoothing length over spacing: more only makes neighbours.
const LARGEST_SMOOTHING: f64 = 10.0;
/// Smoothing length over spacing if nothing is said.
const DEFAULT_SMOOTHING: f64 = 1.2;

/// The bodies of a scene; those that could not be made have a name only.
pub(super) struct Bodies<const D: usize> {
    pub names: Vec<String>,
    pub made: Vec<Option<Made<D>>>,
}

/// A body and the region it fills.
pub(super) struct Made<const D: usize> {
    pub body: Body,
    /// Corners of the box, or of the bounding box of a point list.
    pub lower: SVector<f64, D>,
    pub upper: SVector<f64, D>,
    /// Whether it is a box with faces.
    pub is_box: bool,
}

impl<const D: usize> Made<D> {
    /// Diagonal of the region.
    pub fn size(&self) -> f64 {
        (self.upper - self.lower).norm()
    }
}

impl<const D: usize> Bodies<D> {
    /// Whether a body could not be made.
    pub fn incomplete(&self) -> bool {
        self.made.iter().any(Option::is_none)
    }

    /// The bodies that were made.
    pub fn iter(&self) -> impl Iterator<Item = &Made<D>> {
        self.made.iter().flatten()
    }

    /// The bodies for the set-up.
    pub fn finished(self) -> Vec<Body> {
        self.made.into_iter().flatten().map(|made| made.body).collect()
    }
}

/// A body before its particles are made.
enum Plan<const D: usize> {
    Lattice(BoxLattice<D>),
    Points(Particles<D>, f64),
}

impl<const D: usize> Plan<D> {
    fn approximate_count(&self) -> f64 {
        match self {
            Self::Lattice(lattice) => lattice.approximate_count(),
            Self::Points(particles, _) => particles.positions.len() as f64,
        }
    }
}

/// All bodies and their particles.
pub(super) fn make<const D: usize>(
    document: &Document,
    base: &Path,
    most_particles: usize,
    findings: &mut Findings<'_>,
) -> (Bodies<D>, Particles<D>) {
    if document.body.is_empty() {
        findings.error(0..0, "the scene has no body", "add `[[body]]` with a shape, a spacing and a material");
    }
    let mut names = Vec::new();
    let mut plans = Vec::new();
    let mut total = 0.0;
    for (index, text) in document.body.iter().enumerate() {
        let own = name(text.get_ref().name.as_ref(), "body", index, &names, findings);
        names.push(own);
        let plan = plan::<D>(text, base, findings);
        total += plan.as_ref().map_or(0.0, Plan::approximate_count);
        plans.push(plan);
    }
    // Before anything is allocated.
    if total > most_particles as f64 {
        let count = |plan: &Option<Plan<D>>| plan.as_ref().map_or(0.0, Plan::approximate_count);
        let largest = document.body.iter().zip(&plans).max_by(|(_, a), (_, b)| count(a).total_cmp(&count(b)));
        let span = largest.map_or(0..0, |(body, _)| finest(body));
        findings.error(
            span,
            format!("the bodies would have {total:.3e} particles, more than {most_particles}"),
            "give a larger spacing or smaller counts",
        );
        plans.iter_mut().for_each(|plan| *plan = None);
    }
    let mut particles = Particles::default();
    let mut made = Vec::new();
    for ((text, plan), name) in document.body.iter().zip(plans).zip(&names) {
        let text = text.get_ref();
        let material = material::read::<D>(&text.material, findings);
        let smoothing = smoothing(text, plan.as_ref(), findings);
        let hourglass = stabilisation::hourglass::<D>(text, document, material.as_ref(), findings);
        let (Some(plan), Some(material), Some(smoothing), Some(hourglass)) = (plan, material, smoothing, hourglass)
        else {
            made.push(None);
            continue;
        };
        let (own, spacing, lower, upper, is_box) = match plan {
            Plan::Lattice(lattice) => {
                (lattice.particles(), lattice.mean_spacing(), lattice.lower(), lattice.upper(), true)
            }
            Plan::Points(own, spacing) => {
                let (lower, upper) = bounds(&own.positions);
                (own, spacing, lower, upper, false)
            }
        };
        let range = append(&mut particles, own);
        let body = Body {
            name: name.clone(),
            particles: range,
            spacing,
            kernel: text.kernel.into(),
            smoothing,
            weights: text.weights.into(),
            material,
            cofactor: text.cofactor.into(),
            hourglass,
        };
        made.push(Some(Made { body, lower, upper, is_box }));
    }
    (Bodies { names, made }, particles)
}

/// Place of the key that decides how many particles there are.
fn finest(body: &Spanned<BodyText>) -> Span {
    let text = body.get_ref();
    text.spacing.as_ref().map(Spanned::span).or(text.counts.as_ref().map(Spanned::span)).unwrap_or(body.span())
}

fn append<const D: usize>(all: &mut Particles<D>, mut own: Particles<D>) -> Range<usize> {
    let start = all.positions.len();
    all.positions.append(&mut own.positions);
    all.volumes.append(&mut own.volumes);
    all.kernel_volumes.append(&mut own.kernel_volumes);
    own.faces.iter_mut().for_each(|face| face.particle += start);
    all.faces.append(&mut own.faces);
    start..all.positions.len()
}

fn bounds<const D: usize>(positions: &[SVector<f64, D>]) -> (SVector<f64, D>, SVector<f64, D>) {
    let start = (SVector::repeat(f64::INFINITY), SVector::repeat(f64::NEG_INFINITY));
    positions.iter().fold(start, |(lower, upper), position| (lower.inf(position), upper.sup(position)))
}

fn plan<const D: usize>(body: &Spanned<BodyText>, base: &Path, findings: &mut Findings<'_>) -> Option<Plan<D>> {
    let text = body.get_ref();
    match (&text.shape, &text.points) {
        (Some(shape), None) => {
            let ShapeText::Box(text) = shape.get_ref();
            let lower = findings.vector::<D>(&text.lower, "lower");
            let upper = findings.vector::<D>(&text.upper, "upper");
            lattice(body, shape.span(), lower?.into(), upper?.into(), findings).map(Plan::Lattice)
        }
        (None, Some(points)) => {
            let surplus = [
                (text.spacing.as_ref().map(Spanned::span), "spacing", "give it inside `points`"),
                (text.counts.as_ref().map(Spanned::span), "counts", "remove it"),
                (text.layout.as_ref().map(Spanned::span), "layout", "remove it"),
            ];
            for (span, key, remedy) in surplus {
                if let Some(span) = span {
                    findings.error(span, format!("`{key}` belongs to lattices, not to a list of points"), remedy);
                }
            }
            self::points(points.get_ref(), base, findings)
        }
        (Some(_), Some(points)) => {
            findings.error(points.span(), "a body has either a shape or points", "remove one of the two");
            None
        }
        (None, None) => {
            findings.error(
                body.span(),
                "the body has no shape",
                "add `shape.box = { lower = …, upper = … }` or `points = { file = \"cloud.csv\", spacing = 0.1 }`",
            );
            None
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
    let layout: Layout = text.layout.as_ref().map(|layout| *layout.get_ref()).unwrap_or_default().into();
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
        let wanted = *spacing.get_ref();
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

fn points<const D: usize>(text: &PointsText, base: &Path, findings: &mut Findings<'_>) -> Option<Plan<D>> {
    let spacing = findings.positive(&text.spacing, "spacing");
    let path = base.join(text.file.get_ref());
    let content = match std::fs::read(&path).map(String::from_utf8) {
        Ok(Ok(content)) => content,
        Ok(Err(_)) => {
            let message = format!("{} is not UTF-8 text", path.display());
            findings.error(text.file.span(), message, "give a file of numbers separated by commas");
            return None;
        }
        Err(error) => {
            let message = format!("{} cannot be read: {error}", path.display());
            findings.error(text.file.span(), message, "paths are sought from the folder of the scene file");
            return None;
        }
    };
    let spacing = spacing?;
    match read_points::<D>(&content, spacing) {
        Ok(particles) => Some(Plan::Points(particles, spacing)),
        Err(errors) => {
            for error in errors {
                findings.elsewhere(text.file.span(), in_file(&path, &content, error));
            }
            None
        }
    }
}

fn in_file(path: &Path, content: &str, error: PointError) -> SceneError {
    let line = content.lines().nth(error.line.saturating_sub(1)).unwrap_or_default();
    SceneError {
        origin: path.display().to_string(),
        line: Some(error.line),
        column: Some(error.column),
        source_line: Some(line.chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect()),
        length: error.length,
        message: error.message,
        remedy: error.remedy,
    }
}

/// The smoothing length must reach the nearest particles in every direction.
fn smoothing<const D: usize>(text: &BodyText, plan: Option<&Plan<D>>, findings: &mut Findings<'_>) -> Option<f64> {
    let (given, span) = match &text.smoothing {
        Some(number) => (findings.positive(number, "smoothing")?, Some(number.span())),
        None => (DEFAULT_SMOOTHING, None),
    };
    let support = match text.kernel.into() {
        KernelChoice::CubicSpline | KernelChoice::WendlandC2 => 2.0,
        KernelChoice::QuinticSpline => 3.0,
    };
    let stretch = match plan {
        Some(Plan::Lattice(lattice)) => lattice.spacings().into_iter().fold(0.0, f64::max) / lattice.mean_spacing(),
        _ => 1.0,
    };
    // At 1.0 the nearest particles sit on the edge of the support, with no weight at all.
    let least = 1.2 * stretch / support;
    let span = span.or(text.counts.as_ref().map(Spanned::span)).unwrap_or(0..0);
    if given < least {
        findings.error(
            span,
            format!("a smoothing length of {given} spacings does not reach the neighbours"),
            format!("give `smoothing` of at least {least:.3}; usual are 1.0 to 1.5"),
        );
        return None;
    }
    if given > LARGEST_SMOOTHING {
        findings.error(
            span,
            format!("a smoothing length of {given} spacings makes too many neighbours"),
            format!("give `smoothing` of at most {LARGEST_SMOOTHING}; usual are 1.0 to 1.5"),
        );
        return None;
    }
    Some(given)
}
