//! Newton's method on the analytic Jacobian converges quadratically (issue, point 6; table 6.1 of
//! document 004 checks the derivative, this checks what it is for).
//!
//! Scene: impact-hyperelastic, where everything is nonlinear at once: the law, the cofactor, the direction
//! n(x) and the wave speed c_p(F) of the upwinding. The residual is measured in one unit, the size of its summands
//! at the start of the run, ρ = ‖R‖/scale₀, and every iteration of every step must obey
//!
//! ```text
//! ρ₊ ≤ C ρ²      with one C for the whole run, until ρ is rounding
//! ```
//!
//! That the measure bites is shown by a tangent that is kept through a step (`newton.tangent =
//! "modified"`): it converges linearly, and its `ρ₊/ρ²` is larger by nine orders and more.
#![allow(clippy::print_stdout, reason = "the table is for people")]

#[path = "support/trajectory.rs"]
#[allow(dead_code, reason = "every test file uses its own part of this module")]
mod trajectory;

use nicolson_solvers::nonlinear::NewtonReport;
use trajectory::{every, example, follow};

/// A residual below this many units of its summands is rounding.
const ROUNDING: f64 = 1e-15;
/// Largest `ρ₊/ρ²`. Measured: 37 to 45 for velocities alone, 68 where volume ratios are unknowns too.
const CONSTANT: f64 = 100.0;
/// Iterate to rounding, so that there is a history to look at.
const TIGHT: [(&str, &str); 2] = [("newton.relative_tolerance", "1e-15"), ("newton.scale_tolerance", "1e-15")];

/// Residuals in a unit that does not move as the body does; those that are rounding of their own summands left out.
fn residuals(report: &NewtonReport, unit: f64) -> Vec<f64> {
    let lasting = report.history.iter().filter(|record| record.residual > ROUNDING * record.scale);
    lasting.map(|record| record.residual / unit).collect()
}

/// The size of the summands at the start of a run.
fn unit(histories: &[NewtonReport]) -> f64 {
    histories[0].history[0].scale
}

/// Largest `ρ₊/ρ²` of a solve, from the second iteration on: the first starts at the last step's velocity,
/// which may be far away.
fn constant(residuals: &[f64]) -> f64 {
    residuals.windows(2).skip(1).map(|pair| pair[1] / (pair[0] * pair[0])).fold(0.0, f64::max)
}

fn histories(overrides: &[(&str, &str)], end: f64) -> Vec<NewtonReport> {
    let run = follow::<2>(&example("impact-hyperelastic", &[&TIGHT, overrides].concat()), &every(0.05, end));
    run.steps.iter().flat_map(|step| step.newton.iter().cloned()).collect()
}

fn assert_quadratic(name: &str, histories: &[NewtonReport]) {
    let mut iterations = 0;
    let mut largest = 0.0_f64;
    println!("{name}: ‖R‖/scale₀ by iteration, largest ρ₊/ρ², order of the last three");
    for (step, report) in histories.iter().enumerate() {
        let residuals = residuals(report, unit(histories));
        let constant = constant(&residuals);
        let order = match residuals[..] {
            [.., a, b, c] if residuals.len() > 3 => (c / b).ln() / (b / a).ln(),
            _ => f64::NAN,
        };
        let list: Vec<String> = residuals.iter().map(|rho| format!("{rho:.1e}")).collect();
        println!("  step {:2}: {}   C = {constant:.1}, order {order:.2}", step + 1, list.join(" "));
        assert!(constant < CONSTANT, "{name}, step {}: ρ₊/ρ² = {constant} in {residuals:?}", step + 1);
        // The constant decides. The order of three residuals is 2 less what the constant changes among them,
        // ln(C₂/C₁)/ln(ρ₁/ρ₀): measured 1.73 to 2.01.
        assert!(order.is_nan() || order > 1.7, "{name}, step {}: order {order} in {residuals:?}", step + 1);
        assert!(report.history.iter().skip(1).all(|record| record.step_length == 1.0), "full steps suffice");
        iterations = iterations.max(report.iterations);
        largest = largest.max(constant);
    }
    println!("  largest constant {largest:.1}, at most {iterations} iterations to rounding");
    assert!(iterations <= 7, "{name}: {iterations} iterations to reach rounding");
}

#[test]
fn newton_converges_quadratically_on_the_hyperelastic_impact() {
    let run = histories(&[], 1.0);
    assert_eq!(run.len(), 20, "twenty steps, none rejected");
    assert_quadratic("impact-hyperelastic", &run);
}

#[test]
fn every_nonlinear_term_keeps_newton_quadratic() {
    for (name, overrides) in [
        ("evolved cofactor", &[("body.0.cofactor", "evolved")][..]),
        ("constant wave speed", &[("stabilisation.wave_speed", "constant")]),
        ("D_p", &[("stabilisation.tau_p", "0.2")]),
        ("full system", &[("newton.unknowns", "full")]),
        ("reconstructed", &[("stabilisation.interface", "reconstructed")]),
    ] {
        assert_quadratic(name, &histories(overrides, 0.3));
    }
}

/// The limiter is differentiable, but curves like 1/Δ where a jump Δ is small, so there is no constant; convergence
/// stays superlinear, which a tangent that is a little wrong would not allow.
#[test]
fn the_limiter_keeps_newton_superlinear() {
    let run = histories(&[("stabilisation.interface", "limited")], 1.0);
    assert_eq!(run.len(), 20, "twenty steps, none rejected");
    for (step, report) in run.iter().enumerate() {
        let residuals = residuals(report, unit(&run));
        let ratios: Vec<f64> = residuals.windows(2).map(|pair| pair[1] / pair[0]).collect();
        let list: Vec<String> = residuals.iter().map(|rho| format!("{rho:.1e}")).collect();
        println!("limited, step {:2}: {}", step + 1, list.join(" "));
        assert!(report.history.iter().skip(1).all(|record| record.step_length == 1.0), "full steps suffice");
        assert!(report.iterations <= 8, "step {}: {} iterations to reach rounding", step + 1, report.iterations);
        assert!(ratios.last().is_some_and(|&last| last < 1e-3), "step {}: {ratios:?}", step + 1);
    }
}

#[test]
fn a_kept_tangent_is_seen_to_converge_linearly() {
    let run = histories(&[("newton.tangent", "modified")], 0.3);
    let constants: Vec<f64> = run.iter().map(|report| constant(&residuals(report, unit(&run)))).collect();
    println!("modified Newton: largest ρ₊/ρ² by step {constants:.0?}");
    assert!(constants.iter().all(|&constant| constant > 1e3 * CONSTANT), "{constants:?}");
}
