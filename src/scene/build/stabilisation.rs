//! `[stabilisation]`.

use crate::scene::document::{Document, GradientText, InterfaceText, PressureJumpText, WaveSpeedText};
use crate::scene::findings::Findings;
use crate::setup::Stabilisation;

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
        reconstructed: text.interface == InterfaceText::Reconstructed,
        stress_jump: text.pressure_jump == PressureJumpText::Stress,
    })
}
