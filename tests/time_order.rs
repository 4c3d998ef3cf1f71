//! Order in time on nonlinear scenes, against a solution with much smaller steps (RK4, whose error is
//! below 1e-11 here): both scenes are coarse and smooth in time.
//!
//! - piston-hyperelastic, 6 × 6 particles, no stabilisation;
//! - impact-hyperelastic, 7 × 11 particles, D_v with deformation-dependent wave speed.
//!
//! Crank–Nicolson and TVD-RK2 have order 2.00 ± 0.05, backward Euler 1.00 ± 0.05; all other schemes their
//! order ± 0.1. Errors are pinned too, relative to the largest entry of the state.

#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

mod support;

use std::sync::LazyLock;

use support::scenes::{distance, number, orders, outcome};

struct Case {
    scene: &'static str,
    end: f64,
}

impl Case {
    fn state(&self, scheme: &str, step: f64) -> Vec<f64> {
        let (step, end) = (number(step), number(self.end));
        let overrides = [
            ("body.0.spacing", "0.5"),
            ("time.end", &end),
            ("output.interval", &end),
            ("newton.relative_tolerance", "1e-12"),
            ("time.scheme", scheme),
            ("time.step", &step),
        ];
        outcome(self.scene, &overrides).state
    }

    /// Errors and orders of a scheme for steps that are halved; the finest error must be `finest` within a
    /// tenth, and all orders `order` within `tolerance`.
    fn check(&self, reference: &[f64], (scheme, coarsest): (&str, f64), (order, tolerance): (f64, f64), finest: f64) {
        let steps = [coarsest, 0.5 * coarsest, 0.25 * coarsest];
        let errors: Vec<f64> = steps.iter().map(|step| distance(reference, &self.state(scheme, *step))).collect();
        let found = orders(&steps, &errors);
        print!("{:20} {scheme:18} Δt = {:9} …:", self.scene, steps[0]);
        for error in &errors {
            print!(" {error:.3e}");
        }
        println!("  orders {found:.3?}");
        for found in &found {
            assert!((found - order).abs() < tolerance, "{} {scheme}: {found}", self.scene);
        }
        assert!((errors[2] / finest - 1.0).abs() < 0.1, "{} {scheme}: {:e}, was {finest:e}", self.scene, errors[2]);
    }
}

const PISTON: Case = Case { scene: "piston-hyperelastic", end: 0.64 };
const IMPACT: Case = Case { scene: "impact-hyperelastic", end: 0.32 };

static PISTON_REFERENCE: LazyLock<Vec<f64>> = LazyLock::new(|| PISTON.state("rk4", 1e-4));
static IMPACT_REFERENCE: LazyLock<Vec<f64>> = LazyLock::new(|| IMPACT.state("rk4", 2e-4));

#[test]
fn piston_schemes_of_order_two_and_one() {
    let reference = &PISTON_REFERENCE;
    PISTON.check(reference, ("crank_nicolson", 0.01), (2.0, 0.05), 2.866e-4);
    PISTON.check(reference, ("backward_euler", 0.00125), (1.0, 0.05), 2.667e-3);
    PISTON.check(reference, ("tvd_rk2", 0.008), (2.0, 0.05), 3.621e-4);
}

#[test]
fn impact_schemes_of_order_two_and_one() {
    let reference = &IMPACT_REFERENCE;
    IMPACT.check(reference, ("crank_nicolson", 0.005), (2.0, 0.05), 8.874e-5);
    IMPACT.check(reference, ("backward_euler", 0.00125), (1.0, 0.05), 2.342e-3);
    IMPACT.check(reference, ("tvd_rk2", 0.004), (2.0, 0.05), 1.22e-4);
}

#[test]
fn piston_other_schemes() {
    let reference = &PISTON_REFERENCE;
    PISTON.check(reference, ("midpoint", 0.01), (2.0, 0.1), 2.851e-4);
    PISTON.check(reference, ("tr_bdf2", 0.01), (2.0, 0.1), 1.39e-4);
    PISTON.check(reference, ("generalised_alpha", 0.01), (2.0, 0.1), 2.954e-4);
    PISTON.check(reference, ("energy_momentum", 0.01), (2.0, 0.1), 2.856e-4);
    PISTON.check(reference, ("sdirk3", 0.01), (3.0, 0.1), 1.194e-6);
    PISTON.check(reference, ("velocity_verlet", 0.008), (2.0, 0.1), 9.089e-5);
    PISTON.check(reference, ("rk4", 0.008), (4.0, 0.1), 4.106e-8);
    // The third-order error term is small here, so that the next one is seen in large steps.
    PISTON.check(reference, ("tvd_rk3", 0.001), (3.0, 0.1), 2.241e-9);
    PISTON.check(reference, ("forward_euler", 0.002), (1.0, 0.1), 4.359e-3);
}
