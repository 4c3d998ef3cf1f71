//! `[[probe]]` and `[exact]`.

use nalgebra::SVector;

use super::bodies::Made;
use super::{Context, name};
use crate::expression::Expression;
use crate::scene::checks::{COORDINATES, padded, place};
use crate::scene::document::{FieldList, ProbeMode, ProbeText, Scalar};
use crate::scene::findings::Span;
use crate::scene::units::Kind;
use crate::setup::{ExactSolution, Probe};

/// All probes.
pub(super) fn probes<const D: usize>(context: &mut Context<'_, '_, D>) -> Vec<Probe<D>> {
    let document = context.document;
    let mut names = Vec::new();
    let mut probes = Vec::new();
    for (index, text) in document.probe.iter().enumerate() {
        let own = name(Some(&text.get_ref().name), "probe", index, &names, context.findings);
        names.push(own.clone());
        probes.extend(probe(context, text.get_ref(), own));
    }
    probes
}

fn probe<const D: usize>(context: &mut Context<'_, '_, D>, text: &ProbeText, own: String) -> Option<Probe<D>> {
    let position = context.findings.vector::<D>(&text.at, "at");
    let bodies = context.bodies_named(text.body.as_ref())?;
    let position = position?;
    let found = bodies.iter().find_map(|index| {
        let made = context.bodies.made[*index].as_ref()?;
        let nearest = nearest(&context.particles.positions, made, &position)?;
        contains(&context.particles.positions, made, nearest, &position).then_some((*index, nearest))
    });
    let Some((body, nearest)) = found else {
        if bodies.iter().all(|index| context.bodies.made[*index].is_some()) && !bodies.is_empty() {
            let regions: Vec<String> =
                bodies.iter().filter_map(|index| context.bodies.made[*index].as_ref()).map(region).collect();
            let message = format!("probe '{own}' at {} lies outside", place(&position));
            context.findings.error(text.at.span(), message, format!("move it inside: {}", regions.join("; ")));
        }
        return None;
    };
    let particle = (text.mode == ProbeMode::Nearest).then_some(nearest);
    Some(Probe { name: own, position, body, particle })
}

/// The particle of a body that is nearest to a position; the first of several.
fn nearest<const D: usize>(positions: &[SVector<f64, D>], made: &Made<D>, at: &SVector<f64, D>) -> Option<usize> {
    let distance = |particle: &usize| (positions[*particle] - at).norm_squared();
    made.body.particles.clone().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Inside the box; within a spacing of a point of a list.
fn contains<const D: usize>(
    positions: &[SVector<f64, D>],
    made: &Made<D>,
    nearest: usize,
    at: &SVector<f64, D>,
) -> bool {
    if !made.is_box {
        return (positions[nearest] - at).norm() <= made.body.spacing;
    }
    let slack = 1e-9 * made.size();
    (0..D).all(|axis| at[axis] >= made.lower[axis] - slack && at[axis] <= made.upper[axis] + slack)
}

fn region<const D: usize>(made: &Made<D>) -> String {
    let ranges: Vec<String> =
        (0..D).map(|axis| format!("{} from {} to {}", COORDINATES[axis], made.lower[axis], made.upper[axis])).collect();
    format!("body '{}' has {}", made.body.name, ranges.join(", "))
}

/// The exact solution.
pub(super) fn exact<const D: usize>(context: &mut Context<'_, '_, D>) -> Option<ExactSolution<D>> {
    let table = context.document.exact.as_ref()?;
    let text = table.get_ref();
    if text.displacement.is_none() && text.velocity.is_none() && text.pressure.is_none() {
        context.findings.error(table.span(), "`[exact]` is empty", "add `displacement`, `velocity` or `pressure`");
        return None;
    }
    let displacement = text.displacement.as_ref().map(|list| vector(context, list, "exact displacement"));
    let velocity = text.velocity.as_ref().map(|list| vector(context, list, "exact velocity"));
    let pressure = text.pressure.as_ref().map(|field| {
        let expression = context.findings.field::<D>(field)?;
        finite(context, &expression, field.span(), "exact pressure");
        Some(expression)
    });
    // Mistakes have been noted, so what is lost here is never used.
    Some(ExactSolution {
        displacement: displacement.flatten(),
        velocity: velocity.flatten(),
        pressure: pressure.flatten(),
    })
}

fn vector<const D: usize>(
    context: &mut Context<'_, '_, D>,
    list: &FieldList<impl Kind>,
    what: &str,
) -> Option<[Expression; D]> {
    let fields = context.findings.fields::<D>(list, what)?;
    for (field, text) in fields.iter().zip(list.get_ref()) {
        finite(context, field, text.span(), what);
    }
    Some(fields)
}

/// Notes the first particle where the solution is not a number at the end, when it is compared with.
fn finite<const D: usize>(context: &mut Context<'_, '_, D>, field: &Expression, span: Span, what: &str) {
    let Some(end) = context.document.time.as_ref().map(|time| time.get_ref().end.get_ref().value()) else { return };
    if !end.is_finite() {
        return;
    }
    for position in &context.particles.positions {
        let value = field.value(padded(position), end);
        if !value.is_finite() {
            let message = format!("the {what} is {value} at t = {end} and {}", place(position));
            context.findings.error(span, message, "check for 0/0 and roots of negative numbers");
            return;
        }
    }
}
