//! `[initial]`: the state at t = 0. Constraints win: a fixed component does not move, and a prescribed one
//! starts where and as fast as its motion says.

use nalgebra::SVector;

use super::Context;
use super::boundary::Boundary;
use crate::expression::Expression;
use crate::material::Volumetric;
use crate::scene::checks::{padded, place};
use crate::scene::document::{FieldList, HydrostaticText, Spanned};
use crate::scene::findings::Span;
use crate::scene::units::Kind;
use crate::setup::{Constraint, InitialState};

/// The initial state; `gravity` is `None` if it was wrong.
pub(super) fn read<const D: usize>(
    context: &mut Context<'_, '_, D>,
    gravity: Option<SVector<f64, D>>,
    boundary: &Boundary<D>,
) -> InitialState<D> {
    let count = context.particles.positions.len();
    let mut state = InitialState {
        displacement: vec![SVector::zeros(); count],
        velocity: vec![SVector::zeros(); count],
        pressure: None,
        equilibrium: false,
    };
    if let Some(table) = &context.document.initial {
        let text = table.get_ref();
        state.equilibrium = text.equilibrium;
        if let Some(list) = &text.displacement {
            vectors(context, list, "displacement", &mut state.displacement);
            warn_of_motions(context, list.span(), boundary, &state.displacement);
        }
        if let Some(list) = &text.velocity {
            vectors(context, list, "velocity", &mut state.velocity);
        }
        state.pressure = match (&text.pressure, &text.hydrostatic) {
            (Some(_), Some(hydrostatic)) => {
                let message = "`pressure` and `hydrostatic` both set the initial pressure";
                context.findings.error(hydrostatic.span(), message, "remove one of the two");
                None
            }
            (Some(field), None) => context.findings.field::<D>(field).and_then(|expression| {
                let pressure = scalars(context, &expression, field.span())?;
                possible(context, &pressure, field.span()).then_some(pressure)
            }),
            (None, Some(text)) => hydrostatic(context, text, gravity),
            (None, None) => None,
        };
    }
    for (particle, constraints) in boundary.constraints.iter().enumerate() {
        let at = padded(&context.particles.positions[particle]);
        for (axis, constraint) in constraints.iter().enumerate() {
            match constraint {
                Constraint::Free => {}
                Constraint::Fixed => state.velocity[particle][axis] = 0.0,
                Constraint::Moving(motion) => {
                    let motion = &boundary.motions[*motion];
                    state.displacement[particle][axis] = motion.value(at, 0.0);
                    state.velocity[particle][axis] = motion.rate(at, 0.0);
                }
            }
        }
    }
    state
}

fn vectors<const D: usize>(
    context: &mut Context<'_, '_, D>,
    list: &FieldList<impl Kind>,
    what: &str,
    values: &mut [SVector<f64, D>],
) {
    let Some(fields) = context.findings.fields::<D>(list, what) else { return };
    for (axis, field) in fields.iter().enumerate() {
        for (position, values) in context.particles.positions.iter().zip(values.iter_mut()) {
            let value = field.value(padded(position), 0.0);
            if !value.is_finite() {
                let message = format!("the initial {what} is {value} at {}", place(position));
                let span = list.get_ref()[axis].span();
                context.findings.error(span, message, "check for 0/0 and roots of negative numbers");
                break;
            }
            values[axis] = value;
        }
    }
}

fn scalars<const D: usize>(context: &mut Context<'_, '_, D>, field: &Expression, span: Span) -> Option<Vec<f64>> {
    let mut values = Vec::with_capacity(context.particles.positions.len());
    for position in &context.particles.positions {
        let value = field.value(padded(position), 0.0);
        if !value.is_finite() {
            let message = format!("the initial pressure is {value} at {}", place(position));
            context.findings.error(span, message, "check for 0/0 and roots of negative numbers");
            return None;
        }
        values.push(value);
    }
    Some(values)
}

/// An initial displacement that a prescribed motion overrules is perhaps not meant.
fn warn_of_motions<const D: usize>(
    context: &mut Context<'_, '_, D>,
    span: Span,
    boundary: &Boundary<D>,
    displacement: &[SVector<f64, D>],
) {
    let overruled = boundary.constraints.iter().zip(displacement).zip(&context.particles.positions);
    let overruled = overruled
        .filter(|((constraints, displacement), position)| {
            (0..D).any(|axis| match constraints[axis] {
                Constraint::Moving(motion) => {
                    let start = boundary.motions[motion].value(padded(position), 0.0);
                    (start - displacement[axis]).abs() > 1e-12 * start.abs().max(displacement[axis].abs())
                }
                _ => false,
            })
        })
        .count();
    if overruled > 0 {
        let message = format!("prescribed motions overrule the initial displacement of {overruled} particle(s)");
        context.findings.warning(span, message);
    }
}

/// p = ρ |g| (depth below the level), zero above it; heights are measured against gravity.
fn hydrostatic<const D: usize>(
    context: &mut Context<'_, '_, D>,
    text: &Spanned<HydrostaticText>,
    gravity: Option<SVector<f64, D>>,
) -> Option<Vec<f64>> {
    let level = context.findings.within(&text.get_ref().level, "level", "finite", |_| true);
    let gravity = gravity?;
    let strength = gravity.norm();
    if strength == 0.0 {
        let remedy = "add `gravity`, such as `gravity = [0.0, -9.81]`, or give `pressure`";
        context.findings.error(text.span(), "a hydrostatic pressure needs gravity", remedy);
        return None;
    }
    let level = level?;
    let up = -gravity / strength;
    let mut pressure = vec![0.0; context.particles.positions.len()];
    let mut above = 0;
    for made in context.bodies.iter() {
        let density = made.body.material.density;
        let slack = 1e-9 * made.size();
        for particle in made.body.particles.clone() {
            let depth = level - context.particles.positions[particle].dot(&up);
            above += usize::from(depth < -slack);
            pressure[particle] = density * strength * depth.max(0.0);
        }
    }
    if above == pressure.len() && above > 0 {
        let message = format!("all particles lie above the level {level}");
        context.findings.error(text.span(), message, "give the height of the surface, measured against gravity");
        return None;
    }
    if above > 0 {
        let message = format!("{above} particle(s) lie above the level {level}: their pressure starts at 0");
        context.findings.warning(text.span(), message);
    }
    possible(context, &pressure, text.span()).then_some(pressure)
}

/// Whether every pressure belongs to a positive volume ratio: p < κ for the linear law, p > −κ for the
/// hyperelastic one.
fn possible<const D: usize>(context: &mut Context<'_, '_, D>, pressure: &[f64], span: Span) -> bool {
    for made in context.bodies.iter() {
        for particle in made.body.particles.clone() {
            let p = pressure[particle];
            let (fits, limit) = match made.body.material.volumetric {
                Some(Volumetric::Linear(law)) => (p < law.bulk_modulus, format!("below {} Pa", law.bulk_modulus)),
                Some(Volumetric::Hyperelastic(law)) => {
                    (p > -law.bulk_modulus, format!("above {} Pa", -law.bulk_modulus))
                }
                None => (p == 0.0, "zero (its law has no pressure of its own)".into()),
            };
            if !fits {
                let position = place(&context.particles.positions[particle]);
                let message = format!(
                    "the initial pressure {p} Pa at {position} is impossible: in body '{}' it must be {limit}",
                    made.body.name
                );
                context.findings.error(span, message, "give a smaller pressure or a stiffer material");
                return false;
            }
        }
    }
    true
}
