//! A [`Document`] to a [`Setup`]: particles, selectors, fields.
//!
//! Every part goes on after a mistake as far as it makes sense: where a body could not be made, what refers to
//! its particles is not complained about.

mod bodies;
mod boundary;
mod imports;
mod initial;
mod loads;
mod material;
mod observation;
mod regions;
mod selection;
mod shapes;
mod solid;
mod stabilisation;

use std::path::Path;

use nalgebra::SVector;

use super::document::Document;
use super::findings::Findings;
use super::sizes::Accept;
use crate::expression::closest;
use crate::setup::{Particles, Setup};
use bodies::Bodies;

/// What all parts need.
struct Context<'a, 'f, const D: usize> {
    document: &'a Document,
    findings: &'a mut Findings<'f>,
    bodies: Bodies<D>,
    particles: Particles<D>,
}

/// Makes the set-up; `None` if a mistake was noted.
pub(super) fn build<const D: usize>(
    document: &Document,
    base: &Path,
    accept: &Accept<'_>,
    findings: &mut Findings<'_>,
) -> Option<Setup<D>> {
    let before = findings.count();
    let gravity = document.gravity.as_ref().map(|gravity| findings.vector::<D>(gravity, "gravity"));
    let gravity = gravity.unwrap_or(Some(SVector::zeros()));
    let (bodies, particles) = bodies::make(document, base, accept, findings);
    let mut context = Context { document, findings, bodies, particles };
    let stabilisation = stabilisation::read(document, context.findings);
    let boundary = boundary::read(&mut context);
    let initial = initial::read(&mut context, gravity, &boundary);
    let tractions = loads::tractions(&mut context);
    let body_force = loads::body_force(&mut context);
    let probes = observation::probes(&mut context);
    let exact = observation::exact(&mut context);
    if context.findings.count() > before {
        return None;
    }
    let geometry = context.bodies.records();
    Some(Setup {
        title: String::new(),
        geometry,
        bodies: context.bodies.finished(),
        particles: context.particles,
        constraints: boundary.constraints,
        motions: boundary.motions,
        tractions,
        gravity: gravity?,
        body_force,
        initial,
        stabilisation,
        probes,
        exact,
    })
}

/// The name given, or `kind 1` and so on; checks that names can be printed and occur once.
fn name(
    given: Option<&super::document::Text>,
    kind: &str,
    index: usize,
    taken: &[String],
    findings: &mut Findings<'_>,
) -> String {
    let Some(given) = given else { return format!("{kind} {}", index + 1) };
    let name = given.get_ref().trim().to_owned();
    if name.is_empty() || name.chars().any(char::is_control) {
        findings.error(
            given.span(),
            format!("this is not a name for a {kind}"),
            "give it a name of printable characters",
        );
    } else if taken.contains(&name) {
        findings.error(given.span(), format!("another {kind} is already named '{name}'"), "give each its own name");
    }
    name
}

/// Remedy for a name that does not exist.
fn suggest(wrong: &str, known: &[String]) -> String {
    let guess = closest(wrong, known.iter().map(String::as_str));
    let guess = guess.map(|guess| format!("did you mean '{guess}'? ")).unwrap_or_default();
    format!("{guess}the names are {}", known.join(", "))
}
