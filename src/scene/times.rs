//! Checks `[time]`.

use super::document::{AdaptiveText, Document, EffortText, Measure, Scalar, SchemeText, Spanned, TimeText};
use super::findings::{Findings, Span};
use super::settings::{Adaptive, Effort, Scheme, StepChoice, TimeSettings};
use super::units::Time;

/// CFL number of explicit schemes that are given no step.
const DEFAULT_CFL: f64 = 0.3;

/// `[time]`.
pub(super) fn time(document: &Document, findings: &mut Findings<'_>) -> Option<TimeSettings> {
    let Some(time) = &document.time else {
        findings.error(0..0, "the table `[time]` is missing", "add `[time]` with `end = 1.0` and `step = 0.01`");
        return None;
    };
    let text = time.get_ref();
    let end = findings.positive(&text.end, "end");
    let scheme = scheme(text, findings);
    let step = step(time, findings);
    let minimum_step = bound(&text.minimum_step, "minimum_step", step, findings);
    let maximum_step = bound(&text.maximum_step, "maximum_step", step, findings);
    let (adaptive, effort) = control(text, findings);
    if let (Some(end), Some(StepChoice::Fixed(step)), Some(written)) = (end, step, &text.step)
        && step > end
    {
        findings.warning(written.span(), format!("the step {step} is longer than the whole computation ({end})"));
    }
    let ramp = ramp(text, findings);
    Some(TimeSettings { end: end?, scheme: scheme?, step: step?, ramp, minimum_step, maximum_step, adaptive, effort })
}

/// Whether static loads grow in proportion to the pseudo-time.
fn ramp(text: &TimeText, findings: &mut Findings<'_>) -> bool {
    let Some(ramp) = &text.ramp else { return true };
    if chosen(text) != SchemeText::Static {
        let remedy = "remove it, choose `scheme = \"static\"`, or write the loads as fields of `t`";
        findings.error(ramp.span(), "`ramp` belongs to the scheme `static`, which is not chosen", remedy);
    }
    *ramp.get_ref()
}

/// The scheme with its own parameters, and a mistake for those of others.
fn scheme(text: &TimeText, findings: &mut Findings<'_>) -> Option<Scheme> {
    let name = chosen(text);
    let owned = [
        ("theta", SchemeText::Theta, "theta", text.theta.as_ref().map(Spanned::span)),
        (
            "spectral_radius",
            SchemeText::GeneralisedAlpha,
            "generalised_alpha",
            text.spectral_radius.as_ref().map(Spanned::span),
        ),
        ("rkc_stages", SchemeText::Rkc, "rkc", text.rkc_stages.as_ref().map(Spanned::span)),
    ];
    for (key, owner, owner_name, span) in owned {
        if let Some(span) = span.filter(|_| name != owner) {
            findings.error(
                span,
                format!("`{key}` belongs to the scheme `{owner_name}`, which is not chosen"),
                format!("remove it, or choose `scheme = \"{owner_name}\"`"),
            );
            return None;
        }
    }
    Some(match name {
        SchemeText::ForwardEuler => Scheme::ForwardEuler,
        SchemeText::TvdRk2 => Scheme::TvdRk2,
        SchemeText::TvdRk3 => Scheme::TvdRk3,
        SchemeText::Rk4 => Scheme::Rk4,
        SchemeText::Rkc => {
            Scheme::Rkc { stages: text.rkc_stages.as_ref().map(|stages| *stages.get_ref()).unwrap_or_default() }
        }
        SchemeText::VelocityVerlet => Scheme::VelocityVerlet,
        SchemeText::BackwardEuler => Scheme::BackwardEuler,
        SchemeText::CrankNicolson => Scheme::CrankNicolson,
        SchemeText::Theta => Scheme::Theta {
            theta: optional(&text.theta, 0.5, |theta| {
                findings.within(theta, "theta", "between 0.5 (Crank–Nicolson) and 1 (backward Euler)", |value| {
                    (0.5..=1.0).contains(&value)
                })
            })?,
        },
        SchemeText::Midpoint => Scheme::Midpoint,
        SchemeText::TrBdf2 => Scheme::TrBdf2,
        SchemeText::Sdirk3 => Scheme::Sdirk3,
        SchemeText::GeneralisedAlpha => Scheme::GeneralisedAlpha {
            spectral_radius: optional(&text.spectral_radius, 0.8, |radius| {
                findings.within(radius, "spectral_radius", "between 0 and 1", |value| (0.0..=1.0).contains(&value))
            })?,
        },
        SchemeText::EnergyMomentum => Scheme::EnergyMomentum,
        SchemeText::Static => Scheme::Static,
    })
}

/// A checked value or its default.
fn optional<N>(
    given: &Option<Spanned<N>>,
    default: f64,
    check: impl FnOnce(&Spanned<N>) -> Option<f64>,
) -> Option<f64> {
    given.as_ref().map_or(Some(default), check)
}

fn chosen(text: &TimeText) -> SchemeText {
    text.scheme.as_ref().map(|scheme| *scheme.get_ref()).unwrap_or_default()
}

fn is_explicit(text: &TimeText) -> bool {
    use SchemeText::{ForwardEuler, Rk4, Rkc, TvdRk2, TvdRk3, VelocityVerlet};
    matches!(chosen(text), ForwardEuler | TvdRk2 | TvdRk3 | Rk4 | Rkc | VelocityVerlet)
}

fn step(time: &Spanned<TimeText>, findings: &mut Findings<'_>) -> Option<StepChoice> {
    let text = time.get_ref();
    match (&text.step, &text.cfl) {
        (Some(step), None) => {
            let value = findings.positive(step, "step")?;
            let end = text.end.get_ref().value();
            if end.is_finite() && value < end * f64::EPSILON {
                findings.error(
                    step.span(),
                    format!("a step of {value:e} s is lost in rounding before the end at {end} s"),
                    "give a larger step",
                );
                return None;
            }
            Some(StepChoice::Fixed(value))
        }
        (None, Some(cfl)) => {
            if chosen(text) == SchemeText::Static {
                findings.error(cfl.span(), "the scheme `static` has no waves, hence no CFL number", "give `step`");
                return None;
            }
            findings.positive(cfl, "cfl").map(StepChoice::Cfl)
        }
        (Some(_), Some(cfl)) => {
            findings.error(cfl.span(), "`step` and `cfl` both set the step", "remove one of the two");
            None
        }
        (None, None) if is_explicit(text) => Some(StepChoice::Cfl(DEFAULT_CFL)),
        (None, None) => {
            let span = text.scheme.as_ref().map_or(text.end.span(), Spanned::span);
            findings.error(
                span,
                "an implicit scheme needs a step",
                "add `step = 0.05` (seconds), or `cfl = 10` (multiples of d_min/c_max)",
            );
            None
        }
    }
}

/// A bound of the step, which must leave the step itself possible.
fn bound(
    given: &Option<Measure<Time>>,
    name: &str,
    step: Option<StepChoice>,
    findings: &mut Findings<'_>,
) -> Option<f64> {
    let number = given.as_ref()?;
    let value = findings.positive(number, name)?;
    let Some(StepChoice::Fixed(step)) = step else { return Some(value) };
    if name == "minimum_step" && value > step {
        findings.error(
            number.span(),
            format!("`minimum_step` is {value}, more than the step {step}"),
            "give a smaller minimum, or a larger step",
        );
    }
    if name == "maximum_step" && value < step {
        findings.error(
            number.span(),
            format!("`maximum_step` is {value}, less than the step {step}"),
            "give a larger maximum, or a smaller step",
        );
    }
    Some(value)
}

/// What controls the step; nothing does unless told.
fn control(text: &TimeText, findings: &mut Findings<'_>) -> (Option<Adaptive>, Option<Effort>) {
    if let (Some(_), Some(effort)) = (&text.adaptive, &text.effort) {
        findings.error(effort.span(), "`adaptive` and `effort` both control the step", "remove one of the two");
        return (None, None);
    }
    if let (None, None, Some(maximum)) = (&text.adaptive, &text.effort, &text.maximum_step) {
        findings.error(
            maximum.span(),
            "`maximum_step` bounds a step that nothing makes grow",
            "add `adaptive` or `effort`, or remove it",
        );
    }
    let adaptive = text.adaptive.as_ref().and_then(|table| {
        refuse_static(text, "adaptive", table.span(), findings);
        adaptive(table.get_ref(), findings)
    });
    let effort = text.effort.as_ref().and_then(|table| {
        if is_explicit(text) {
            findings.error(
                table.span(),
                "an explicit scheme has no Newton iterations to control its step by",
                "use `adaptive` instead, or choose an implicit scheme",
            );
        }
        effort(table.get_ref(), findings)
    });
    (adaptive, effort)
}

fn refuse_static(text: &TimeText, key: &str, span: Span, findings: &mut Findings<'_>) {
    if chosen(text) == SchemeText::Static {
        findings.error(
            span,
            format!("`{key}` follows an error in time, of which the scheme `static` has none"),
            "use `effort` instead, or choose a dynamic scheme",
        );
    }
}

fn adaptive(text: &AdaptiveText, findings: &mut Findings<'_>) -> Option<Adaptive> {
    let relative = findings.within(&text.tolerance, "tolerance", "between 0 and 1", |value| value > 0.0 && value < 1.0);
    let absolute = optional(&text.absolute, 0.0, |absolute| findings.not_negative(absolute, "absolute"));
    Some(Adaptive { relative_tolerance: relative?, absolute_tolerance: absolute? })
}

fn effort(text: &EffortText, findings: &mut Findings<'_>) -> Option<Effort> {
    let default = Effort::default();
    let mut count = |given: &Option<Spanned<u64>>, name: &str, default: usize| match given {
        Some(number) => findings.at_least_one(number, name),
        None => Some(default),
    };
    let (few, many) = (count(&text.few, "few", default.few), count(&text.many, "many", default.many));
    let growth = optional(&text.growth, default.growth, |growth| {
        findings.within(growth, "growth", "more than 1", |value| value > 1.0)
    });
    let cut = optional(&text.cut, default.cut, |cut| {
        findings.within(cut, "cut", "between 0 and 1", |value| value > 0.0 && value < 1.0)
    });
    if let (Some(few), Some(many), Some(span)) =
        (few, many, text.many.as_ref().or(text.few.as_ref()).map(Spanned::span))
        && few >= many
    {
        findings.error(
            span,
            format!("a step of {few} iterations is easy, and one of more than {many} hard"),
            "give `many` as a larger number than `few`",
        );
    }
    Some(Effort { few: few?, many: many?, growth: growth?, cut: cut? })
}
