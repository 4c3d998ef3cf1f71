//! `[[traction]]` and `body_force`.

use std::collections::BTreeSet;

use nalgebra::SVector;

use super::{Context, name};
use crate::expression::Expression;
use crate::scene::checks::{padded, place};
use crate::scene::document::{Direction, FieldList, Spanned, TractionText};
use crate::scene::units::Kind;
use crate::setup::Traction;

/// Cosine of the largest angle between the normal of a piece and where it should face: 45°.
const TOWARDS: f64 = 0.707;

/// All tractions.
pub(super) fn tractions<const D: usize>(context: &mut Context<'_, '_, D>) -> Vec<Traction<D>> {
    let document = context.document;
    let mut names = Vec::new();
    let mut tractions = Vec::new();
    for (index, text) in document.traction.iter().enumerate() {
        let own = name(text.get_ref().name.as_ref(), "traction", index, &names, context.findings);
        names.push(own.clone());
        tractions.extend(traction(context, text, own));
    }
    tractions
}

fn traction<const D: usize>(
    context: &mut Context<'_, '_, D>,
    text: &Spanned<TractionText>,
    own: String,
) -> Option<Traction<D>> {
    let whole = text.span();
    let text = text.get_ref();
    let value = context.findings.fields::<D>(&text.value, "value");
    let bodies = context.bodies_named(text.body.as_ref());
    let side = text.face.as_ref().map(|face| (face.get_ref().side(), face.span()));
    // Where the scene says which pieces are meant.
    let span = [
        side.as_ref().map(|(_, span)| span.clone()),
        text.group.as_ref().map(Spanned::span),
        text.facing.as_ref().map(Spanned::span),
        text.select.as_ref().map(Spanned::span),
    ];
    let Some(span) = span.into_iter().flatten().next() else {
        let remedy = "add `face = \"upper_x\"`, `group`, `facing = [1, 0]` or `select`";
        context.findings.error(whole, format!("traction '{own}' does not say where it acts"), remedy);
        return None;
    };
    if let Some((side, span)) = &side
        && side.axis >= D
    {
        let message = format!("a {D}-dimensional body has no such face");
        let names = ["lower_x, upper_x", "lower_y, upper_y", "lower_z, upper_z"][..D].join(", ");
        context.findings.error(span.clone(), message, format!("the faces are {names}"));
        return None;
    }
    let facing = match &text.facing {
        Some(facing) => Some(direction::<D>(facing, context)?),
        None => None,
    };
    let bodies = bodies?;
    // Without a named body, those whose boundary is known are meant.
    let without = bodies.iter().filter_map(|index| context.bodies.made[*index].as_ref()).find(|made| !made.has_faces);
    if let Some(made) = without
        && (text.body.is_some() || context.bodies.iter().all(|made| !made.has_faces))
    {
        let message = format!("body '{}' has no faces: its boundary is not known", made.body.name);
        let remedy = "tractions need a shape, a closed STL, a mesh, or points with `faces`";
        context.findings.error(span, message, remedy);
        return None;
    }
    let group = match &text.group {
        Some(name) => {
            let groups = context.groups_named(name.get_ref().trim(), &bodies, name)?;
            Some(groups.iter().flat_map(|group| group.faces.iter().copied()).collect::<BTreeSet<usize>>())
        }
        None => None,
    };
    let selected = match &text.select {
        Some(select) => Some(context.select(&format!("traction '{own}'"), &bodies, select)?),
        None => None,
    };
    let ranges: Vec<_> = bodies
        .iter()
        .filter_map(|index| context.bodies.made[*index].as_ref())
        .map(|made| made.body.particles.clone())
        .collect();
    let (areas, points): (Vec<(usize, f64)>, Vec<_>) = context
        .particles
        .faces
        .iter()
        .enumerate()
        .filter(|(index, _)| group.as_ref().is_none_or(|group| group.contains(index)))
        .map(|(_, face)| face)
        .filter(|face| side.as_ref().is_none_or(|(side, _)| face.side == Some(*side)))
        .filter(|face| facing.is_none_or(|facing| face.normal.dot(&facing) >= TOWARDS))
        .filter(|face| ranges.iter().any(|range| range.contains(&face.particle)))
        // The selection is in the order of the particles.
        .filter(|face| selected.as_ref().is_none_or(|selected| selected.binary_search(&face.particle).is_ok()))
        .map(|face| ((face.particle, face.area), face.point))
        .unzip();
    if areas.is_empty() && !context.bodies.incomplete() {
        let message = format!("traction '{own}' acts on no particle: none of the selected ones is on that face");
        context.findings.error(span, message, "widen `select`, or choose another face");
        return None;
    }
    let value = value?;
    finite(context, &value, &text.value, "traction", areas.iter().map(|(particle, _)| *particle));
    Some(Traction { name: own, areas, points, value })
}

/// A unit vector.
fn direction<const D: usize>(text: &Direction, context: &mut Context<'_, '_, D>) -> Option<SVector<f64, D>> {
    let vector: SVector<f64, D> = context.findings.vector(text, "facing")?;
    let largest = vector.amax();
    if largest == 0.0 {
        context.findings.error(text.span(), "the direction is zero", "give a direction, such as [1, 0]");
        return None;
    }
    Some((vector / largest).normalize())
}

/// The body force; absent if it is zero everywhere and always.
pub(super) fn body_force<const D: usize>(context: &mut Context<'_, '_, D>) -> Option<[Expression; D]> {
    let list = context.document.body_force.as_ref()?;
    let fields = context.findings.fields::<D>(list, "body_force")?;
    finite(context, &fields, list, "body force", 0..context.particles.positions.len());
    let zero = fields.iter().all(|field| field.as_constant() == Some(0.0));
    (!zero).then_some(fields)
}

/// Notes the first particle where a load is not a number at the start.
fn finite<const D: usize>(
    context: &mut Context<'_, '_, D>,
    fields: &[Expression; D],
    list: &FieldList<impl Kind>,
    what: &str,
    particles: impl Iterator<Item = usize> + Clone,
) {
    for (field, text) in fields.iter().zip(list.get_ref()) {
        for particle in particles.clone() {
            let position = &context.particles.positions[particle];
            let value = field.value(padded(position), 0.0);
            if !value.is_finite() {
                let message = format!("the {what} is {value} at t = 0 and {}", place(position));
                context.findings.error(text.span(), message, "check for 0/0 and roots of negative numbers");
                break;
            }
        }
    }
}
