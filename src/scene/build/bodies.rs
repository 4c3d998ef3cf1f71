//! `[[body]]`: shapes and point lists to particles.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use nalgebra::SVector;

use super::shapes::{Filled, Plan, Shape, plan};
use super::{material, name, stabilisation};
use crate::geometry::{BoxLattice, Group, number_along_curve, stencil_volumes};
use crate::kernel;
use crate::scene::document::{BodyText, Document, Spanned, VolumeText};
use crate::scene::findings::{Findings, Span};
use crate::scene::sizes::{Accept, BodySize};
use crate::setup::{Body, GeometryRecord, KernelChoice, Particles};

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
    /// Corners of the box, or of the bounding box of the particles.
    pub lower: SVector<f64, D>,
    pub upper: SVector<f64, D>,
    /// Whether it fills the region between the corners.
    pub is_box: bool,
    /// Whether pieces of its boundary are known.
    pub has_faces: bool,
    /// Groups of a file by name, in the numbers of all particles and faces.
    pub groups: BTreeMap<String, Group>,
    /// What filling came to, if the shape was not a plain one.
    pub record: Option<GeometryRecord>,
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

    /// What filling came to.
    pub fn records(&self) -> Vec<GeometryRecord> {
        self.iter().filter_map(|made| made.record.clone()).collect()
    }

    /// The bodies for the set-up.
    pub fn finished(self) -> Vec<Body> {
        self.made.into_iter().flatten().map(|made| made.body).collect()
    }
}

/// All bodies and their particles.
pub(super) fn make<const D: usize>(
    document: &Document,
    base: &Path,
    accept: &Accept<'_>,
    findings: &mut Findings<'_>,
) -> (Bodies<D>, Particles<D>) {
    if document.body.is_empty() {
        findings.error(0..0, "the scene has no body", "add `[[body]]` with a shape, a spacing and a material");
    }
    let mut names = Vec::new();
    let mut plans = Vec::new();
    for (index, text) in document.body.iter().enumerate() {
        let own = name(text.get_ref().name.as_ref(), "body", index, &names, findings);
        names.push(own);
        let plan = plan::<D>(text, base, findings);
        plans.push(plan);
    }
    // Before anything is allocated.
    let count = |plan: &Option<Plan<D>>| plan.as_ref().map_or(0.0, Plan::approximate_count);
    let sizes: Vec<BodySize> = document
        .body
        .iter()
        .zip(&plans)
        .map(|(text, plan)| BodySize { particles: count(plan), reach: reach(text.get_ref()) })
        .collect();
    if let Err(refusal) = accept(&sizes) {
        let largest = document.body.iter().zip(&plans).max_by(|(_, a), (_, b)| count(a).total_cmp(&count(b)));
        let span = largest.map_or(0..0, |(body, _)| finest(body));
        if !refusal.message.is_empty() {
            findings.error(span, refusal.message, refusal.remedy);
        }
        plans.iter_mut().for_each(|plan| *plan = None);
    }
    let mut particles = Particles::default();
    let mut made = Vec::new();
    for ((text, plan), name) in document.body.iter().zip(plans).zip(&names) {
        let text = text.get_ref();
        let material = material::read::<D>(&text.material, findings);
        let shape = plan.and_then(|plan| plan.shape(findings));
        let smoothing = smoothing(text, shape.as_ref(), findings);
        let hourglass = stabilisation::hourglass::<D>(text, document, material.as_ref(), findings);
        let (Some(shape), Some(material), Some(smoothing), Some(hourglass)) = (shape, material, smoothing, hourglass)
        else {
            made.push(None);
            continue;
        };
        let (is_box, spacing) = (shape.is_box(), shape.spacing());
        let lattice = shape.lattice().cloned();
        let Filled { particles: mut own, mut groups, mut record, .. } = shape.filled();
        volumes(text, lattice, smoothing * spacing, &mut own, findings);
        if let Some(numbers) = number_along_curve(&mut own) {
            for group in groups.values_mut() {
                group.particles.iter_mut().for_each(|particle| *particle = numbers[*particle] as usize);
                group.particles.sort_unstable();
            }
        }
        let (lower, upper) = bounds(&own);
        let has_faces = !own.faces.is_empty();
        if let Some(record) = &mut record {
            record.body.clone_from(name);
            record.complete(&own.volumes, material.density);
        }
        let (first, first_face) = (particles.positions.len(), particles.faces.len());
        for group in groups.values_mut() {
            group.particles.iter_mut().for_each(|particle| *particle += first);
            group.faces.iter_mut().for_each(|face| *face += first_face);
        }
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
            volume_ratio: text.volume_ratio.as_ref().map(|choice| *choice.get_ref()).unwrap_or_default().into(),
            hourglass,
        };
        made.push(Some(Made { body, lower, upper, is_box, has_faces, groups, record }));
    }
    (Bodies { names, made }, particles)
}

/// Radius of the kernel in spacings, as far as it makes sense.
fn reach(text: &BodyText) -> f64 {
    let smoothing = text.smoothing.as_ref().map_or(DEFAULT_SMOOTHING, |number| *number.get_ref());
    kernel::support(text.kernel.into()) * if smoothing > 0.0 { smoothing.min(LARGEST_SMOOTHING) } else { 1.0 }
}

/// Volumes other than those of the cells, if the body asks for them.
fn volumes<const D: usize>(
    text: &BodyText,
    lattice: Option<BoxLattice<D>>,
    smoothing_length: f64,
    particles: &mut Particles<D>,
    findings: &mut Findings<'_>,
) {
    let Some(wanted) = text.volumes.as_ref().filter(|wanted| *wanted.get_ref() == VolumeText::Stencil) else { return };
    let Some(lattice) = lattice else {
        let remedy = "remove it: only `shape.box` without `perturb` has a stencil that is the same everywhere";
        findings.error(wanted.span(), "volumes cannot suit the stencil of this body", remedy);
        return;
    };
    if let Err(share) = stencil_volumes(&lattice, text.kernel.into(), smoothing_length, particles) {
        let message =
            format!("the stencil asks for {share:.2} of a volume to be moved from the second row to the wall");
        findings.error(wanted.span(), message, "give a smaller `smoothing`, or `volumes = \"cells\"`");
    }
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
    all.cells.extend(own.cells.into_iter().map(|corner| corner + start as u32));
    start..all.positions.len()
}

/// Corners of the region of particles and faces.
fn bounds<const D: usize>(particles: &Particles<D>) -> (SVector<f64, D>, SVector<f64, D>) {
    let start = (SVector::repeat(f64::INFINITY), SVector::repeat(f64::NEG_INFINITY));
    let points = particles.positions.iter().chain(particles.faces.iter().map(|face| &face.point));
    points.fold(start, |(lower, upper), point| (lower.inf(point), upper.sup(point)))
}

/// The smoothing length must reach the nearest particles in every direction.
fn smoothing<const D: usize>(text: &BodyText, shape: Option<&Shape<D>>, findings: &mut Findings<'_>) -> Option<f64> {
    let (given, span) = match &text.smoothing {
        Some(number) => (findings.positive(number, "smoothing")?, Some(number.span())),
        None => (DEFAULT_SMOOTHING, None),
    };
    let support = match text.kernel.into() {
        KernelChoice::CubicSpline | KernelChoice::WendlandC2 => 2.0,
        KernelChoice::QuinticSpline => 3.0,
    };
    let stretch = shape.map_or(1.0, Shape::stretch);
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
