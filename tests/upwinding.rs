//! The default upwinding with `τ_v = 1` and nothing else said: it takes energy out in every step of any scheme, and next to
//! nothing out of a smooth motion, where constant interface states stop it.
#![allow(clippy::print_stdout, reason = "the tables are for people")]

#[path = "support/trajectory.rs"]
#[allow(dead_code, reason = "every test file uses its own part of this module")]
mod trajectory;

use trajectory::{Trajectory, every, example, follow};

/// The beam of CSM3 to its first trough: lowest place of the tip, m, and what upwinding took out by then, over the
/// largest kinetic energy.
fn beam(stabilisation: &str) -> (f64, f64) {
    let overrides = [("body.0.counts", "[71, 5]"), ("stabilisation", stabilisation)];
    let run: Trajectory<2> = follow(&example("csm3", &overrides), &every(0.01, 0.47));
    let lowest = run.curve(0, 1).into_iter().fold(f64::INFINITY, f64::min);
    let kinetic = run.entries.iter().map(|entry| entry.kinetic).fold(0.0, f64::max);
    let lost = run.entries.last().map_or(f64::NAN, |entry| entry.dissipated) / kinetic;
    println!("  {stabilisation:38} trough {:8.3} mm, taken out {lost:.1e} of the kinetic energy", 1e3 * lowest);
    (lowest, lost)
}

#[test]
fn a_swinging_beam_is_not_held_back() {
    println!("CSM3, 71 × 5 particles");
    let (free, none) = beam("{ tau_v = 0 }");
    let (limited, little) = beam("{ tau_v = 1 }");
    let (constant, much) = beam(r#"{ tau_v = 1, interface = "constant" }"#);
    assert_eq!(none, 0.0);
    // Measured: −132.165, −132.160 and −132.108 mm; 1.3e-4 and 1.6e-3.
    assert!((limited / free - 1.0).abs() < 1e-4, "{limited} m, undamped {free} m");
    assert!(little > 0.0 && little < 5e-4, "{little:e}");
    assert!((constant / free - 1.0).abs() < 1e-3 && much > 5.0 * little, "{constant} m of {free} m, {much}");
    // A force across the line of two particles resists rotation, and so the beam: −92 mm of −129 mm, balanced.
    let (held, most) = beam(r#"{ tau_v = 1, interface = "constant", shear = "transverse" }"#);
    assert!(held / free < 0.8 && most > 1.0, "{held} m of {free} m, {most}");
}

#[test]
fn the_energy_falls_in_every_step_of_the_energy_momentum_scheme() {
    let scheme = [("time.scheme", "energy_momentum"), ("stabilisation.tau_v", "1")];
    let limited = [("stabilisation.interface", "limited")];
    let run: Trajectory<2> =
        follow(&example("impact-hyperelastic", &[&scheme[..], &limited].concat()), &every(0.05, 1.0));
    println!("impact, energy–momentum: largest rise {:.1e} J, loss {:.3}", run.largest_rise(), run.loss());
    assert!(run.largest_rise() < 0.0);
    // Measured 0.073.
    assert!((0.02..0.2).contains(&run.loss()), "{}", run.loss());
}
