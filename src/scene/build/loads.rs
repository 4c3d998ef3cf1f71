//! `[[traction]]` and `body_force`.

use super::{Context, name};
use crate::expression::Expression;
use crate::scene::checks::{padded, place};
use crate::scene::document::{FieldList, Spanned, TractionText};
use crate::setup::Traction;

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
    let text = text.get_ref();
    let value = context.findings.fields::<D>(&text.value, "value");
    let bodies = context.bodies_named(text.body.as_ref());
    let side = text.face.get_ref().side();
    if side.axis >= D {
        let message = format!("a {D}-dimensional body has no such face");
        let names = ["lower_x, upper_x", "lower_y, upper_y", "lower_z, upper_z"][..D].join(", ");
        context.findings.error(text.face.span(), message, format!("the faces are {names}"));
        return None;
    }
    let bodies = bodies?;
    // A list of points has no faces. Without a named body, those that have some are meant.
    let without = bodies.iter().filter_map(|index| context.bodies.made[*index].as_ref()).find(|made| !made.has_faces);
    if let Some(made) = without
        && (text.body.is_some() || context.bodies.iter().all(|made| !made.has_faces))
    {
        let message = format!("body '{}' is a list of points and has no faces", made.body.name);
        context.findings.error(text.face.span(), message, "tractions need a body with a shape");
        return None;
    }
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
        .filter(|face| face.side == Some(side) && ranges.iter().any(|range| range.contains(&face.particle)))
        // The selection is in the order of the particles.
        .filter(|face| selected.as_ref().is_none_or(|selected| selected.binary_search(&face.particle).is_ok()))
        .map(|face| ((face.particle, face.area), face.point))
        .unzip();
    if areas.is_empty() && !context.bodies.incomplete() {
        let message = format!("traction '{own}' acts on no particle: none of the selected ones is on that face");
        context.findings.error(text.face.span(), message, "widen `select`, or choose another face");
        return None;
    }
    let value = value?;
    finite(context, &value, &text.value, "traction", areas.iter().map(|(particle, _)| *particle));
    Some(Traction { name: own, areas, points, value })
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
    list: &FieldList,
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
