//! Checks `[newton]`, `[linear]`, `[output]` and `[checkpoint]`.

use super::document::{Document, Number, Scalar, SchemeText, Spanned, VolumeRatioText};
use super::findings::Findings;
use super::settings::{
    CheckpointSettings, LineSearch, LinearSettings, NewtonSettings, OutputField, OutputSettings, Scheme, TangentPolicy,
    Unknowns,
};

/// More frames than that are never looked at, and their index alone would fill the disk.
const MOST_FRAMES: f64 = 1e6;

/// `[newton]`.
pub(super) fn newton(document: &Document, findings: &mut Findings<'_>) -> NewtonSettings {
    let text = &document.newton;
    let scheme = document.time.as_ref().and_then(|time| time.get_ref().scheme.as_ref());
    let conserving = scheme.is_some_and(|scheme| *scheme.get_ref() == SchemeText::EnergyMomentum);
    let mut settings = match scheme.map(|scheme| *scheme.get_ref()) {
        Some(SchemeText::EnergyMomentum) => NewtonSettings::of(Scheme::EnergyMomentum),
        Some(SchemeText::Static) => NewtonSettings::of(Scheme::Static),
        _ => NewtonSettings::default(),
    };
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
    if let Some(given) = &text.final_corrections {
        settings.final_corrections = usize::try_from(*given.get_ref()).unwrap_or(usize::MAX);
    }
    settings.line_search = text.line_search.as_ref().map_or(settings.line_search, |search| *search.get_ref());
    settings.tangent = text.tangent.unwrap_or_default();
    if let Some(search) = text.line_search.as_ref().filter(|search| *search.get_ref() == LineSearch::TrustRegion)
        && matches!(settings.tangent, TangentPolicy::Broyden | TangentPolicy::Lbfgs)
    {
        findings.error(
            search.span(),
            "a trust region needs a tangent, which secant updates do not give",
            "choose a line search, or another `tangent`",
        );
    }
    settings.forcing = text.forcing.unwrap_or_default();
    settings.unknowns = text.unknowns.as_ref().map(|unknowns| *unknowns.get_ref()).unwrap_or_default();
    unknowns(document, conserving, findings);
    settings.declared_linear = text.linear;
    settings
}

/// Whether the chosen unknowns can represent the equations, and the conserving step.
fn unknowns(document: &Document, conserving: bool, findings: &mut Findings<'_>) {
    let chosen = document.newton.unknowns.as_ref();
    let tau_p = document.stabilisation.as_ref().and_then(|table| table.get_ref().tau_p.as_ref());
    let tau_p = tau_p.filter(|tau_p| *tau_p.get_ref() != 0.0);
    if conserving {
        if let Some(tau_p) = tau_p {
            findings.error(
                tau_p.span(),
                "`tau_p` couples the volume ratios, which the scheme `energy_momentum` eliminates",
                "set `tau_p = 0`, or choose another scheme",
            );
        }
        if let Some(unknowns) =
            chosen.filter(|unknowns| matches!(unknowns.get_ref(), Unknowns::VelocityJacobian | Unknowns::Full))
        {
            findings.error(
                unknowns.span(),
                "the scheme `energy_momentum` solves for velocities alone",
                "choose `unknowns = \"auto\"` or `\"velocity\"`, or another scheme",
            );
        }
    } else if let (Some(unknowns), Some(_)) =
        (chosen.filter(|unknowns| *unknowns.get_ref() == Unknowns::Velocity), tau_p)
    {
        findings.error(
            unknowns.span(),
            "velocity alone cannot be the unknown where `tau_p` couples the volume ratios",
            "choose `unknowns = \"velocity_jacobian\"` or `\"auto\"`, or set `tau_p = 0`",
        );
    }
    let unknown = chosen.is_some_and(|kind| matches!(kind.get_ref(), Unknowns::VelocityJacobian | Unknowns::Full));
    if tau_p.is_some() || unknown {
        let choices = document.body.iter().filter_map(|body| body.get_ref().volume_ratio.as_ref());
        for choice in choices.filter(|choice| *choice.get_ref() == VolumeRatioText::Determinant) {
            findings.error(
                choice.span(),
                "the volume ratio cannot follow the determinant where `tau_p` couples it or `newton.unknowns` solves for it",
                "choose `volume_ratio = \"evolved\"` or `\"auto\"`",
            );
        }
    }
}

/// `[linear]`.
pub(super) fn linear(document: &Document, findings: &mut Findings<'_>) -> LinearSettings {
    let text = &document.linear;
    let mut settings = LinearSettings { solver: text.solver.unwrap_or_default(), ..LinearSettings::default() };
    if let Some(operator) = &text.operator {
        settings.operator = *operator.get_ref();
        if settings.solver.is_direct() {
            findings.warning(operator.span(), "a direct solver always takes entries");
        }
    }
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
        let end = document.time.as_ref().map(|time| time.get_ref().end.get_ref().value());
        if end.is_some_and(|end| value > end) {
            findings.warning(interval.span(), format!("the interval {value} is longer than the computation"));
        }
        if let Some(end) = end.filter(|end| end.is_finite() && end / value > MOST_FRAMES) {
            findings.error(
                interval.span(),
                format!("an interval of {value} s makes {:.1e} frames, more than {MOST_FRAMES:e}", end / value),
                "give a longer interval",
            );
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

/// `[checkpoint]`.
pub(super) fn checkpoint(document: &Document, findings: &mut Findings<'_>) -> CheckpointSettings {
    let Some(text) = &document.checkpoint else { return CheckpointSettings::default() };
    let mut settings = CheckpointSettings { at_end: true, ..CheckpointSettings::default() };
    settings.every_steps = text.every_steps.as_ref().and_then(|steps| findings.at_least_one(steps, "every_steps"));
    settings.every_seconds = text.every_seconds.as_ref().and_then(|time| findings.positive(time, "every_seconds"));
    if let Some(keep) = &text.keep {
        settings.keep = usize::try_from(*keep.get_ref()).unwrap_or(usize::MAX);
        if settings.keep == 0 && (settings.every_steps.is_some() || settings.every_seconds.is_some()) {
            findings.error(
                keep.span(),
                "`keep = 0` writes no checkpoints, and `every_steps` or `every_seconds` asks for some",
                "keep at least one, or remove the other keys",
            );
        }
    }
    settings
}
