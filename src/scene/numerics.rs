//! Checks `[time]`, `[newton]`, `[linear]` and `[output]`.

use super::document::{Document, Number, SchemeText, Spanned, TimeText};
use super::findings::Findings;
use super::settings::{
    Adaptive, LinearSettings, NewtonSettings, OutputField, OutputSettings, Scheme, StepChoice, TimeSettings, Unknowns,
};

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
    let minimum_step = text.minimum_step.as_ref().and_then(|minimum| {
        let value = findings.positive(minimum, "minimum_step")?;
        if let Some(StepChoice::Fixed(step)) = step
            && value > step
        {
            findings.error(
                minimum.span(),
                format!("`minimum_step` is {value}, more than the step {step}"),
                "give a smaller minimum, or a larger step",
            );
        }
        Some(value)
    });
    let adaptive = adaptive(text, findings);
    if let (Some(end), Some(StepChoice::Fixed(step)), Some(written)) = (end, step, &text.step)
        && step > end
    {
        findings.warning(written.span(), format!("the step {step} is longer than the whole computation ({end})"));
    }
    Some(TimeSettings { end: end?, scheme: scheme?, step: step?, minimum_step, adaptive })
}

/// The scheme with its own parameters, and a mistake for those of others.
fn scheme(text: &TimeText, findings: &mut Findings<'_>) -> Option<Scheme> {
    let name = text.scheme.as_ref().map(|scheme| *scheme.get_ref()).unwrap_or_default();
    if let Some(theta) = text.theta.as_ref().filter(|_| name != SchemeText::Theta) {
        findings.error(
            theta.span(),
            "`theta` belongs to the scheme `theta`, which is not chosen",
            "remove it, or choose `scheme = \"theta\"`",
        );
        return None;
    }
    if let Some(radius) = text.spectral_radius.as_ref().filter(|_| name != SchemeText::GeneralisedAlpha) {
        findings.error(
            radius.span(),
            "`spectral_radius` belongs to the scheme `generalised_alpha`, which is not chosen",
            "remove it, or choose `scheme = \"generalised_alpha\"`",
        );
        return None;
    }
    Some(match name {
        SchemeText::ForwardEuler => Scheme::ForwardEuler,
        SchemeText::TvdRk2 => Scheme::TvdRk2,
        SchemeText::TvdRk3 => Scheme::TvdRk3,
        SchemeText::Rk4 => Scheme::Rk4,
        SchemeText::Rkc => Scheme::Rkc,
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
fn optional(given: &Option<Number>, default: f64, check: impl FnOnce(&Number) -> Option<f64>) -> Option<f64> {
    given.as_ref().map_or(Some(default), check)
}

fn is_explicit(text: &TimeText) -> bool {
    let name = text.scheme.as_ref().map(|scheme| *scheme.get_ref()).unwrap_or_default();
    use SchemeText::{ForwardEuler, Rk4, Rkc, TvdRk2, TvdRk3, VelocityVerlet};
    matches!(name, ForwardEuler | TvdRk2 | TvdRk3 | Rk4 | Rkc | VelocityVerlet)
}

fn step(time: &Spanned<TimeText>, findings: &mut Findings<'_>) -> Option<StepChoice> {
    let text = time.get_ref();
    match (&text.step, &text.cfl) {
        (Some(step), None) => findings.positive(step, "step").map(StepChoice::Fixed),
        (None, Some(cfl)) => {
            if text.scheme.as_ref().is_some_and(|scheme| *scheme.get_ref() == SchemeText::Static) {
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

fn adaptive(text: &TimeText, findings: &mut Findings<'_>) -> Option<Adaptive> {
    let adaptive = text.adaptive.as_ref()?;
    let scheme = scheme(text, &mut Findings::new(findings.source));
    if scheme.is_some_and(|scheme| !scheme.estimates_error()) {
        findings.error(
            adaptive.span(),
            "an adaptive step needs a scheme that estimates its error",
            "choose `scheme = \"rkc\"`, `\"tr_bdf2\"` or `\"sdirk3\"`, or remove `adaptive`",
        );
    }
    let text = adaptive.get_ref();
    let relative = findings.within(&text.tolerance, "tolerance", "between 0 and 1", |value| value > 0.0 && value < 1.0);
    let absolute = optional(&text.absolute, 0.0, |absolute| findings.not_negative(absolute, "absolute"));
    Some(Adaptive { relative_tolerance: relative?, absolute_tolerance: absolute? })
}

/// `[newton]`.
pub(super) fn newton(document: &Document, findings: &mut Findings<'_>) -> NewtonSettings {
    let text = &document.newton;
    let mut settings = NewtonSettings::default();
    let small = |findings: &mut Findings<'_>, given: &Option<Number>, name: &str, target: &mut f64| {
        if let Some(value) = given
            .as_ref()
            .and_then(|number| findings.within(number, name, "between 0 and 1", |value| value > 0.0 && value < 1.0))
        {
            *target = value;
        }
    };
    small(findings, &text.relative_tolerance, "relative_tolerance", &mut settings.relative_tolerance);
    small(findings, &text.scale_tolerance, "scale_tolerance", &mut settings.scale_tolerance);
    count(findings, &text.max_iterations, "max_iterations", &mut settings.max_iterations);
    settings.line_search = text.line_search.unwrap_or_default();
    settings.tangent = text.tangent.unwrap_or_default();
    settings.forcing = text.forcing.unwrap_or_default();
    if let Some(unknowns) = &text.unknowns {
        settings.unknowns = *unknowns.get_ref();
        let tau_p = document.stabilisation.as_ref().and_then(|table| table.get_ref().tau_p.as_ref());
        if settings.unknowns == Unknowns::Velocity && tau_p.is_some_and(|tau_p| *tau_p.get_ref() != 0.0) {
            findings.error(
                unknowns.span(),
                "velocity alone cannot be the unknown where `tau_p` couples the volume ratios",
                "choose `unknowns = \"velocity_jacobian\"` or `\"auto\"`, or set `tau_p = 0`",
            );
        }
    }
    settings.declared_linear = text.linear;
    settings
}

/// `[linear]`.
pub(super) fn linear(document: &Document, findings: &mut Findings<'_>) -> LinearSettings {
    let text = &document.linear;
    let mut settings = LinearSettings { solver: text.solver.unwrap_or_default(), ..LinearSettings::default() };
    if let Some(preconditioner) = &text.preconditioner {
        settings.preconditioner = *preconditioner.get_ref();
        if settings.solver.is_direct() {
            findings.warning(preconditioner.span(), "a direct solver does not use a preconditioner");
        }
    }
    if let Some(tolerance) = &text.tolerance {
        let checked = findings.within(tolerance, "tolerance", "between 0 and 1", |value| value > 0.0 && value < 1.0);
        settings.tolerance = checked.unwrap_or(settings.tolerance);
    }
    count(findings, &text.max_iterations, "max_iterations", &mut settings.max_iterations);
    count(findings, &text.restart, "restart", &mut settings.restart);
    settings
}

fn count(findings: &mut Findings<'_>, given: &Option<Spanned<u64>>, name: &str, target: &mut usize) {
    if let Some(value) = given.as_ref().and_then(|number| findings.at_least_one(number, name)) {
        *target = value;
    }
}

/// `[output]`.
pub(super) fn output(document: &Document, findings: &mut Findings<'_>) -> OutputSettings {
    let text = &document.output;
    let interval = text.interval.as_ref().and_then(|interval| {
        let value = findings.positive(interval, "interval")?;
        let end = document.time.as_ref().map(|time| *time.get_ref().end.get_ref());
        if end.is_some_and(|end| value > end) {
            findings.warning(interval.span(), format!("the interval {value} is longer than the computation"));
        }
        Some(value)
    });
    let mut settings = OutputSettings { interval, ..OutputSettings::default() };
    if let Some(fields) = &text.fields {
        let mut chosen: Vec<OutputField> = Vec::new();
        for field in fields {
            if chosen.contains(field.get_ref()) {
                findings.error(field.span(), "the field is listed twice", "remove one of the two");
            }
            chosen.push(*field.get_ref());
        }
        settings.fields = chosen;
    }
    settings.plots = text.plots.unwrap_or(settings.plots);
    settings.history = text.history.unwrap_or(settings.history);
    settings
}
