//! What Runge–Kutta–Chebyshev does to the waves of a scene: no interval of the imaginary axis is stable, so
//! undamped motion grows with every step.

use nicolson_solvers::time::{
    DominantEigenvalue, RkcCoefficients, RkcOptions, RkcStages, System, rkc_growth, rkc_stages, rkc_stages_by_courant,
};

/// Growth per step that is no more than rounding.
const HARMLESS: f64 = 1.0 + 1e-9;

/// A warning with the growth factor per step of the fastest mode of the actual operator, unless that mode is
/// damped so much that the scheme keeps it bounded.
///
/// The fastest mode decides: the damping of upwinding grows with the square of the frequency, the scheme's
/// growth with its fourth power, so slower modes are better off.
pub fn warning(system: &mut dyn System, values: &[f64], options: RkcOptions, step: f64, end: f64) -> Option<String> {
    let found = match DominantEigenvalue::of(system, 0.0, values) {
        Ok(found) => found,
        Err(cause) => return Some(format!("rkc: the fastest mode of the scene cannot be estimated: {cause}")),
    };
    let DominantEigenvalue { radius, damping } = found;
    let y = step * radius;
    let stages = match options.stages {
        RkcStages::Fixed(stages) => stages,
        RkcStages::Courant { frequency } => rkc_stages_by_courant(frequency * step),
        RkcStages::SpectralRadius { safety, .. } => rkc_stages(safety * y),
        _ => return None,
    };
    let ratio = damping.clamp(0.0, 1.0);
    let (re, im) = RkcCoefficients::new(stages).stability(-ratio * y, (1.0 - ratio * ratio).sqrt() * y);
    let growth = re.hypot(im);
    // False for NaN, which is no reason for silence.
    if growth <= HARMLESS {
        return None;
    }
    let undamped = rkc_growth(stages, y);
    let decades = (end / step).ceil() * growth.log10();
    Some(format!(
        "rkc has no stable interval on the imaginary axis: with Δt = {step:.3e} s and {stages} stages the fastest mode \
         (ω = {radius:.4e} 1/s, damping ratio {damping:.2}) grows by a factor of {growth:.6} per step, {undamped:.6} if \
         undamped, and by 10^{decades:.1} in the whole run; use rk4, tvd_rk3 or an implicit scheme, or damp the scene \
         (stabilisation.tau_v with interface = \"constant\")"
    ))
}
