//! Orders of accuracy on forced, damped, nonlinear oscillators.

mod time_common;

use nicolson_solvers::time::{RkcOptions, RkcStages, Scheme, StepControl, System, TimeState};
use time_common::spring::{Potential, Spring};
use time_common::{Equations, Forced, Full, run, stepper};

/// Largest error at `t = 2` over the entries, with so many steps.
fn error(scheme: Scheme, system: &mut dyn System, exact: impl Fn(f64) -> [f64; 2], steps: i32) -> f64 {
    let end = 2.0;
    let mut state = TimeState::new(0.0, exact(0.0).to_vec());
    let mut stepper = stepper(scheme, StepControl::Fixed { step: end / f64::from(steps) });
    assert_eq!(run(&mut stepper, system, &mut state, end), steps as usize, "{scheme}");
    assert_eq!(stepper.statistics().rejected.total(), 0);
    let exact = exact(end);
    (state.values[0] - exact[0]).abs().max((state.values[1] - exact[1]).abs())
}

fn check_order(scheme: Scheme, order: f64, steps: i32, mut error: impl FnMut(i32) -> f64) {
    let (coarse, fine) = (error(steps), error(2 * steps));
    let found = (coarse / fine).log2();
    assert!((found - order).abs() < 0.05, "{scheme}: order {found} from errors {coarse:e} and {fine:e}");
}

fn rkc(stages: usize) -> Scheme {
    Scheme::Rkc(RkcOptions { stages: RkcStages::Fixed(stages), ..RkcOptions::default() })
}

#[test]
fn every_scheme_has_its_order_on_a_forced_nonlinear_problem() {
    let schemes = [
        (Scheme::ForwardEuler, 2000),
        (Scheme::TvdRk2, 400),
        (Scheme::TvdRk3, 200),
        (Scheme::Rk4, 100),
        (Scheme::VelocityVerlet, 400),
        (rkc(2), 400),
        (rkc(3), 400),
        (rkc(7), 400),
        (Scheme::Theta(0.7), 2000),
        (Scheme::BackwardEuler, 2000),
        (Scheme::CrankNicolson, 200),
        (Scheme::Midpoint, 200),
        (Scheme::TrBdf2, 400),
        (Scheme::Sdirk3, 200),
        (Scheme::GeneralisedAlpha { spectral_radius: 0.0 }, 400),
        (Scheme::GeneralisedAlpha { spectral_radius: 0.5 }, 400),
        (Scheme::GeneralisedAlpha { spectral_radius: 1.0 }, 400),
    ];
    for (scheme, steps) in schemes {
        // The second entry depends on the first, on itself, and on time; so does the first.
        check_order(scheme, scheme.order() as f64, steps, |steps| {
            error(scheme, &mut Full::new(Forced { a: 0.4, c: 0.6 }), Forced::exact, steps)
        });
    }
}

/// `x = 0.7 sin(1.1 t)` with the force that makes it so.
fn spring_exact(t: f64) -> [f64; 2] {
    [0.7 * (1.1 * t).sin(), 0.77 * (1.1 * t).cos()]
}

fn spring_force(t: f64) -> f64 {
    let [x, v] = spring_exact(t);
    -1.21 * x + 2.0 * x + 1.5 * x * x * x + 0.3 * v
}

#[test]
fn energy_momentum_and_condensed_stages_have_their_order() {
    let schemes = [
        (Scheme::EnergyMomentum, 200),
        (Scheme::CrankNicolson, 200),
        (Scheme::Sdirk3, 200),
        (Scheme::VelocityVerlet, 400),
    ];
    for (scheme, steps) in schemes {
        check_order(scheme, scheme.order() as f64, steps, |steps| {
            let mut spring = Spring::new(Potential::Quartic { k: 2.0, b: 1.5 }, 0.3, spring_force);
            error(scheme, &mut spring, spring_exact, steps)
        });
    }
}

/// A mass driven through a spring by a support whose motion is prescribed: entries (support position, support
/// velocity, position, velocity) in the order positions, velocities. The rates of the support's
/// entries are nonsense, as the seam allows.
struct Driven;

fn support(t: f64) -> [f64; 2] {
    [0.5 * (2.0 * t).sin(), (2.0 * t).cos()]
}

/// `q″ = −4 (q − s)` with `s = ½ sin 2t`: resonance, `q = ¼ sin 2t − ½ t cos 2t`.
fn driven_exact(t: f64) -> [f64; 2] {
    [0.25 * (2.0 * t).sin() - 0.5 * t * (2.0 * t).cos(), t * (2.0 * t).sin()]
}

impl Equations for Driven {
    fn len(&self) -> usize {
        4
    }

    fn rate(&self, _t: f64, u: &[f64], out: &mut [f64]) {
        out.copy_from_slice(&[1e3, u[3], -2e3, -4.0 * (u[1] - u[0])]);
    }

    fn jacobian(&self, _t: f64, _u: &[f64]) -> Vec<f64> {
        vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 4.0, -4.0, 0.0, 0.0]
    }

    fn velocities(&self) -> Option<std::ops::Range<usize>> {
        Some(2..4)
    }

    fn impose(&self, t: f64, u: &mut [f64]) {
        [u[0], u[2]] = support(t);
    }
}

#[test]
fn explicit_schemes_keep_their_order_with_prescribed_entries() {
    // Imposing exact values in every stage costs Runge–Kutta schemes of order above 2 their order
    // (M. H. Carpenter et al., SIAM J. Sci. Comput. 16 (1995) 1241), so those up to 2 are tested.
    for (scheme, steps) in [(Scheme::TvdRk2, 800), (Scheme::VelocityVerlet, 400), (rkc(4), 800)] {
        check_order(scheme, 2.0, steps, |steps| {
            let end = 2.0;
            let start = support(0.0);
            let mut state = TimeState::new(0.0, vec![start[0], 0.0, start[1], 0.0]);
            let mut stepper = stepper(scheme, StepControl::Fixed { step: end / f64::from(steps) });
            run(&mut stepper, &mut Full::new(Driven), &mut state, end);
            assert_eq!([state.values[0], state.values[2]], support(end));
            let exact = driven_exact(end);
            (state.values[1] - exact[0]).abs().max((state.values[3] - exact[1]).abs())
        });
    }
}

#[test]
fn adaptive_control_does_not_see_the_rates_of_prescribed_entries() {
    for scheme in [Scheme::ForwardEuler, Scheme::TvdRk2, Scheme::TvdRk3, Scheme::Rk4, Scheme::VelocityVerlet, rkc(3)] {
        let mut adaptive = nicolson_solvers::time::Adaptive::new(1e-4, 1e-4);
        adaptive.first = Some(1e-3);
        let start = support(0.0);
        let mut state = TimeState::new(0.0, vec![start[0], 0.0, start[1], 0.0]);
        let mut stepper = stepper(scheme, StepControl::Adaptive(adaptive));
        let steps = run(&mut stepper, &mut Full::new(Driven), &mut state, 2.0);
        // The estimate of TVD-RK2 is that of Euler's method.
        let by_euler = matches!(scheme, Scheme::ForwardEuler | Scheme::TvdRk2);
        let (most, allowed) = if by_euler { (600, 0.05) } else { (150, 0.01) };
        assert!(steps < most, "{scheme}: {steps} steps");
        let error = (state.values[1] - driven_exact(2.0)[0]).abs();
        assert!(error < allowed, "{scheme}: error {error}");
    }
}
