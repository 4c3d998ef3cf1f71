//! `[stabilisation]` and `hourglass`.

use crate::material::Material;
use crate::scene::document::{
    BodyText, Document, GradientText, HourglassText, InterfaceText, PressureJumpText, ShearText, WaveSpeedText,
};
use crate::scene::findings::Findings;
use crate::setup::{InterfaceChoice, Stabilisation};

/// The stabilisation, absent if both coefficients are zero.
pub(super) fn read(document: &Document, findings: &mut Findings<'_>) -> Option<Stabilisation> {
    let table = document.stabilisation.as_ref()?;
    let text = table.get_ref();
    let tau_v = text.tau_v.as_ref().map_or(Some(0.0), |tau| findings.not_negative(tau, "tau_v"))?;
    let tau_p = text.tau_p.as_ref().map_or(Some(0.0), |tau| findings.not_negative(tau, "tau_p"))?;
    if tau_v == 0.0 && tau_p == 0.0 {
        if text.tau_v.is_none() && text.tau_p.is_none() {
            findings.warning(table.span(), "`[stabilisation]` without `tau_v` or `tau_p` does nothing");
        }
        return None;
    }
    Some(Stabilisation {
        tau_v,
        tau_p,
        deformed_wave_speed: text.wave_speed == WaveSpeedText::Deformed,
        corrected_gradient: text.gradient == GradientText::Corrected,
        interface: match text.interface {
            InterfaceText::Constant => InterfaceChoice::Constant,
            InterfaceText::Reconstructed => InterfaceChoice::Reconstructed,
            InterfaceText::Limited => InterfaceChoice::Limited,
        },
        stress_jump: text.pressure_jump == PressureJumpText::Stress,
        transverse_shear: text.shear == ShearText::Transverse,
    })
}

/// Coefficient of the hourglass control: that of the body, else that of the scene, else none yet.
pub(super) fn hourglass<const D: usize>(
    body: &BodyText,
    document: &Document,
    material: Option<&Material>,
    findings: &mut Findings<'_>,
) -> Option<Option<f64>> {
    let Some(given) = body.hourglass.as_ref().or(document.hourglass.as_ref()) else { return Some(None) };
    let coefficient = match *given.get_ref() {
        HourglassText::Off => return Some(Some(0.0)),
        HourglassText::Coefficient(value) => value,
    };
    if !(coefficient.is_finite() && coefficient >= 0.0) {
        findings.error(
            given.span(),
            format!("`hourglass` is {coefficient}, but must be zero or positive"),
            "give a number that is zero or positive, usual are 0.5 to 4, or \"none\"",
        );
        return None;
    }
    if D > 1 && coefficient > 0.0 && material.is_some_and(|law| law.shear_modulus() == 0.0) {
        findings.warning(given.span(), "hourglass control makes a fluid resist bending, as a solid does");
    }
    Some(Some(coefficient))
}
