//! `[[boundary]]`: fixed and prescribed motion by components.

use super::{Context, name};
use crate::expression::Expression;
use crate::scene::checks::{padded, place};
use crate::scene::document::{AxisName, BoundaryText, Field, Spanned};
use crate::scene::units::Length;
use crate::setup::Constraint;

/// Names of directions as scenes write them.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Kind of motion of every component of every particle.
pub(super) struct Boundary<const D: usize> {
    pub constraints: Vec<[Constraint; D]>,
    pub motions: Vec<Expression>,
}

/// All boundary conditions.
pub(super) fn read<const D: usize>(context: &mut Context<'_, '_, D>) -> Boundary<D> {
    let document = context.document;
    let count = context.particles.positions.len();
    let mut boundary = Boundary { constraints: vec![[Constraint::Free; D]; count], motions: Vec::new() };
    // Which condition constrained a component: only needed to name the other one in a contradiction.
    let mut by: Vec<[u32; D]> = if document.boundary.is_empty() { Vec::new() } else { vec![[0; D]; count] };
    let mut names = Vec::new();
    for (index, text) in document.boundary.iter().enumerate() {
        let own = name(text.get_ref().name.as_ref(), "boundary", index, &names, context.findings);
        names.push(own);
        condition(context, text, index, &names, &mut boundary, &mut by);
    }
    boundary
}

fn condition<const D: usize>(
    context: &mut Context<'_, '_, D>,
    text: &Spanned<BoundaryText>,
    index: usize,
    names: &[String],
    boundary: &mut Boundary<D>,
    by: &mut [[u32; D]],
) {
    let own = &names[index];
    let span = text.span();
    let text = text.get_ref();
    let wanted = components(context, text, boundary);
    if wanted.iter().all(Option::is_none) && text.fix.as_ref().is_none_or(|fix| fix.get_ref().is_empty()) {
        let empty = text.displacement.as_ref().is_none_or(|map| {
            let map = map.get_ref();
            map.x.is_none() && map.y.is_none() && map.z.is_none()
        });
        if empty {
            let remedy = "add `fix = [\"x\"]` or `displacement = { x = \"0.1*sin(t)\" }`";
            context.findings.error(span, format!("boundary '{own}' constrains nothing"), remedy);
        }
    }
    let Some(bodies) = context.bodies_named(text.body.as_ref()) else { return };
    let Some(selected) = context.select(&format!("boundary '{own}'"), &bodies, &text.select) else { return };
    for (axis, wanted) in wanted.into_iter().enumerate() {
        let Some((constraint, place)) = wanted else { continue };
        let mut conflicts = 0;
        let mut other = 0;
        for particle in &selected {
            let held = &mut boundary.constraints[*particle][axis];
            let same = match (*held, constraint) {
                (Constraint::Free, _) => {
                    *held = constraint;
                    by[*particle][axis] = index as u32;
                    true
                }
                (Constraint::Fixed, Constraint::Fixed) => true,
                (Constraint::Moving(old), Constraint::Moving(new)) => {
                    boundary.motions[old].text() == boundary.motions[new].text()
                }
                _ => false,
            };
            if !same {
                conflicts += 1;
                other = by[*particle][axis] as usize;
            }
        }
        if conflicts > 0 {
            let axis = AXES[axis];
            let message = format!(
                "boundary '{own}' contradicts boundary '{}': both set {axis} of {conflicts} particle(s), differently",
                names[other]
            );
            context.findings.error(place, message, "narrow one of the selections, or give both the same motion");
            continue;
        }
        if let Constraint::Moving(motion) = constraint {
            start(context, &boundary.motions[motion], &selected, place);
        }
    }
}

/// What one condition asks of each direction, and where it says so.
fn components<const D: usize>(
    context: &mut Context<'_, '_, D>,
    text: &BoundaryText,
    boundary: &mut Boundary<D>,
) -> [Option<(Constraint, std::ops::Range<usize>)>; D] {
    let mut wanted = [const { None }; D];
    let absent = |axis: usize| {
        (
            format!("there is no direction {} in a {D}-dimensional scene", AXES[axis]),
            format!("use {}", AXES[..D].join(", ")),
        )
    };
    for fixed in text.fix.iter().flat_map(|fix| fix.get_ref()) {
        let axis = match fixed.get_ref() {
            AxisName::X => 0,
            AxisName::Y => 1,
            AxisName::Z => 2,
        };
        if axis < D {
            wanted[axis] = Some((Constraint::Fixed, fixed.span()));
        } else {
            let (message, remedy) = absent(axis);
            context.findings.error(fixed.span(), message, remedy);
        }
    }
    let Some(map) = &text.displacement else { return wanted };
    let map = map.get_ref();
    let moved: [&Option<Spanned<Field<Length>>>; 3] = [&map.x, &map.y, &map.z];
    for (axis, field) in moved.into_iter().enumerate() {
        let Some(field) = field else { continue };
        if axis >= D {
            let (message, remedy) = absent(axis);
            context.findings.error(field.span(), message, remedy);
        } else if wanted[axis].is_some() {
            let message = format!("direction {} is both fixed and moved", AXES[axis]);
            context.findings.error(field.span(), message, "remove it from `fix` or from `displacement`");
        } else if let Some(motion) = context.findings.field::<D>(field) {
            boundary.motions.push(motion);
            wanted[axis] = Some((Constraint::Moving(boundary.motions.len() - 1), field.span()));
        }
    }
    wanted
}

/// A motion must have a position and a speed to start with.
fn start<const D: usize>(
    context: &mut Context<'_, '_, D>,
    motion: &Expression,
    selected: &[usize],
    span: std::ops::Range<usize>,
) {
    for particle in selected {
        let position = &context.particles.positions[*particle];
        let at = padded(position);
        let (value, rate) = (motion.value(at, 0.0), motion.rate(at, 0.0));
        if !value.is_finite() || !rate.is_finite() {
            let (what, found) = if value.is_finite() { ("its rate", rate) } else { ("the displacement", value) };
            let message = format!("{what} is {found} at t = 0 for the particle at {}", place(position));
            context.findings.error(span, message, "check for 0/0 and roots of negative numbers");
            return;
        }
    }
}
