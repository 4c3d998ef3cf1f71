//! One step of every scheme on the harmonic oscillator against its stability function.
//!
//! With `w = ωq + iv` the oscillator is `w' = −iω w`, so a one-step scheme multiplies `w` by `R(−iz)`, `z = ωΔt`.

mod time_common;

use approx::assert_abs_diff_eq;
use nicolson_solvers::time::{RkcOptions, RkcStages, Scheme, StepControl, TimeState, rkc_growth};
use time_common::complex::{Complex, complex};
use time_common::{Full, Oscillator, run, stepper};

const OMEGA: f64 = 3.0;
const STEPS: [f64; 5] = [0.1, 0.5, 1.0, 1.7, 6.0];

fn step(scheme: Scheme, z: f64, w: Complex) -> Complex {
    let mut system = Full::new(Oscillator { omega: OMEGA });
    let mut state = TimeState::new(0.0, vec![w.re / OMEGA, w.im]);
    let h = z / OMEGA;
    run(&mut stepper(scheme, StepControl::Fixed { step: h }), &mut system, &mut state, h);
    complex(OMEGA * state.values[0], state.values[1])
}

/// Checks `G = R(−iz)` for two phases.
fn check(scheme: Scheme, stability: impl Fn(Complex) -> Complex) {
    for z in STEPS {
        let expected = stability(complex(0.0, -z));
        for w in [complex(1.0, 0.0), complex(-0.3, 0.8)] {
            let error = (step(scheme, z, w) / w - expected).abs();
            assert!(error <= 1e-12 * expected.abs().max(1.0), "{scheme}, z = {z}: error {error:e}");
        }
    }
}

fn growth(scheme: Scheme, z: f64) -> f64 {
    step(scheme, z, complex(0.6, -0.8)).abs()
}

/// `ω_h/ω` from the phase of one step.
fn frequency(scheme: Scheme, z: f64) -> f64 {
    let w = complex(0.6, -0.8);
    -(step(scheme, z, w) / w).arg() / z
}

const ONE: Complex = Complex { re: 1.0, im: 0.0 };

fn theta_function(theta: f64) -> impl Fn(Complex) -> Complex {
    move |z| (ONE + (1.0 - theta) * z) / (ONE - theta * z)
}

#[test]
fn explicit_schemes_multiply_by_their_taylor_polynomials() {
    check(Scheme::ForwardEuler, |z| ONE + z);
    check(Scheme::TvdRk2, |z| ONE + z + 0.5 * (z * z));
    check(Scheme::TvdRk3, |z| ONE + z + 0.5 * (z * z) + 1.0 / 6.0 * (z * z * z));
    check(Scheme::Rk4, |z| ONE + z + 0.5 * (z * z) + 1.0 / 6.0 * (z * z * z) + 1.0 / 24.0 * (z * z * z * z));
    for z in [0.1, 0.5, 1.0] {
        assert_abs_diff_eq!(growth(Scheme::TvdRk2, z), (1.0 + z.powi(4) / 4.0).sqrt(), epsilon = 1e-12);
        let three = (1.0 - z.powi(4) / 12.0 + z.powi(6) / 36.0).sqrt();
        assert_abs_diff_eq!(growth(Scheme::TvdRk3, z), three, epsilon = 1e-12);
    }
    assert_abs_diff_eq!(frequency(Scheme::TvdRk3, 0.5), 1.002_026_77, epsilon = 1e-8);
}

#[test]
fn implicit_schemes_multiply_by_their_rational_functions() {
    check(Scheme::BackwardEuler, theta_function(1.0));
    check(Scheme::CrankNicolson, theta_function(0.5));
    check(Scheme::Theta(0.75), theta_function(0.75));
    check(Scheme::Midpoint, theta_function(0.5));
    let d = 1.0 - 0.5 * std::f64::consts::SQRT_2;
    check(Scheme::TrBdf2, |z| (ONE + (1.0 - 2.0 * d) * z) / ((ONE - d * z) * (ONE - d * z)));
    // L-stable of order 3 with three equal diagonal entries: the numerator follows from the order.
    let g = 0.435_866_521_508_459;
    check(Scheme::Sdirk3, |z| {
        let below = ONE - g * z;
        (ONE + (1.0 - 3.0 * g) * z + (0.5 - 3.0 * g + 3.0 * g * g) * (z * z)) / (below * below * below)
    });
    for z in [0.1_f64, 0.5, 1.0, 1.7] {
        assert_abs_diff_eq!(frequency(Scheme::CrankNicolson, z), 2.0 / z * (z / 2.0).atan(), epsilon = 1e-12);
        assert_abs_diff_eq!(growth(Scheme::CrankNicolson, z), 1.0, epsilon = 1e-12);
        assert_abs_diff_eq!(growth(Scheme::BackwardEuler, z), 1.0 / (1.0 + z * z).sqrt(), epsilon = 1e-12);
        assert_abs_diff_eq!(frequency(Scheme::BackwardEuler, z), z.atan() / z, epsilon = 1e-12);
    }
}

#[test]
fn crank_nicolson_keeps_the_amplitude_over_many_steps_with_one_rate_in_all() {
    let mut system = Full::new(Oscillator { omega: OMEGA });
    let mut state = TimeState::new(0.0, vec![1.0 / OMEGA, 0.0]);
    let mut stepper = stepper(Scheme::CrankNicolson, StepControl::Fixed { step: 0.1 });
    run(&mut stepper, &mut system, &mut state, 100.0);
    let w = complex(OMEGA * state.values[0], state.values[1]);
    assert_abs_diff_eq!(w.abs(), 1.0, epsilon = 1e-11);
    assert_eq!((stepper.statistics().accepted, stepper.statistics().rate_evaluations), (1000, 1));
    assert_eq!((system.rates, system.residuals), (1, 2000));
}

#[test]
fn verlet_has_the_frequency_of_leap_frog_and_no_damping() {
    for z in [0.1_f64, 0.5, 1.0, 1.7] {
        // Columns of the matrix of one step and, with the kept rate, of two.
        let column = |steps: f64, q: f64, v: f64| {
            let mut system = Full::new(Oscillator { omega: OMEGA });
            let mut state = TimeState::new(0.0, vec![q, v]);
            let mut stepper = stepper(Scheme::VelocityVerlet, StepControl::Fixed { step: z / OMEGA });
            run(&mut stepper, &mut system, &mut state, steps * z / OMEGA);
            assert_eq!(system.velocity_rates as f64, 1.0 + steps);
            [state.values[0], state.values[1]]
        };
        let expected = 2.0 / z * (z / 2.0).asin();
        for steps in [1.0, 2.0] {
            let (a, b) = (column(steps, 1.0, 0.0), column(steps, 0.0, 1.0));
            assert_abs_diff_eq!(a[0] * b[1] - a[1] * b[0], 1.0, epsilon = 1e-12);
            assert_abs_diff_eq!(0.5 * (a[0] + b[1]), (steps * z * expected).cos(), epsilon = 1e-12);
        }
        let a = column(1.0, 1.0, 0.0);
        assert_abs_diff_eq!(a[0].acos() / z, expected, epsilon = 1e-12);
    }
}

#[test]
fn generalised_alpha_multiplies_its_eigenvectors_by_their_eigenvalues() {
    for rho in [0.0, 0.3, 0.5, 0.8, 1.0] {
        let alpha_m = 0.5 * (3.0 - rho) / (1.0 + rho);
        let alpha_f = 1.0 / (1.0 + rho);
        let gamma = 0.5 + alpha_m - alpha_f;
        for size in STEPS {
            // (μ − 1)(1 − αm + αm μ) = z (1 − αf + αf μ)(1 − γ + γ μ) for u₁ = μ u₀, r₁ = μ r₀.
            let z = complex(0.0, -size);
            let a = alpha_m * ONE - alpha_f * gamma * z;
            let b = (1.0 - 2.0 * alpha_m) * ONE - (alpha_f * (1.0 - gamma) + (1.0 - alpha_f) * gamma) * z;
            let c = (alpha_m - 1.0) * ONE - (1.0 - alpha_f) * (1.0 - gamma) * z;
            let root = (b * b - 4.0 * (a * c)).sqrt();
            for sign in [1.0, -1.0] {
                let mu = (sign * root - b) / (2.0 * a);
                let h = size / OMEGA;
                let below = (1.0 - gamma) * ONE + gamma * mu;
                if below.abs() < 1e-3 {
                    continue;
                }
                let r = (1.0 / h) * ((mu - ONE) / below);
                let mut state = TimeState::new(0.0, vec![1.0 / OMEGA, 0.0]);
                state.memory.algorithmic_rate = vec![r.re / OMEGA, r.im];
                state.memory.fingerprint = state.fingerprint();
                let mut system = Full::new(Oscillator { omega: OMEGA });
                let scheme = Scheme::GeneralisedAlpha { spectral_radius: rho };
                run(&mut stepper(scheme, StepControl::Fixed { step: h }), &mut system, &mut state, h);
                assert_eq!(system.rates, 0);
                let w = complex(OMEGA * state.values[0], state.values[1]);
                assert!((w - mu).abs() < 1e-12, "ρ∞ = {rho}, z = {size}: {w:?} for {mu:?}");
                let kept = complex(OMEGA * state.memory.algorithmic_rate[0], state.memory.algorithmic_rate[1]);
                assert!((kept - mu * r).abs() < 1e-11 * (1.0 + r.abs()), "{kept:?} for {:?}", mu * r);
            }
        }
        // At infinite frequency the amplitude falls by ρ∞ per step.
        let mut system = Full::new(Oscillator { omega: 1e9 });
        let mut state = TimeState::new(0.0, vec![1e-9, 0.0]);
        let scheme = Scheme::GeneralisedAlpha { spectral_radius: rho };
        let mut stepper = stepper(scheme, StepControl::Fixed { step: 1.0 });
        let amplitude = |state: &TimeState| (1e9 * state.values[0]).hypot(state.values[1]);
        let mut ratio = f64::NAN;
        for k in 1..=8 {
            let before = amplitude(&state);
            run(&mut stepper, &mut system, &mut state, f64::from(k));
            ratio = amplitude(&state) / before;
        }
        if rho == 1.0 {
            assert_abs_diff_eq!(ratio, 1.0, epsilon = 1e-6);
        } else if rho > 0.0 {
            // A defective double eigenvalue: k ρᵏ, so the ratio tends to ρ∞ as 1 + 1/k.
            assert!(ratio < rho * 1.3 && ratio > rho * 0.9, "{ratio} for {rho}");
        }
    }
}

#[test]
fn runge_kutta_chebyshev_amplifies_as_predicted() {
    for stages in [2, 3, 4, 5, 6, 9] {
        let scheme = Scheme::Rkc(RkcOptions { stages: RkcStages::Fixed(stages), ..RkcOptions::default() });
        for z in [0.1, 0.697, 1.7425] {
            assert_abs_diff_eq!(growth(scheme, z), rkc_growth(stages, z), epsilon = 1e-12);
        }
    }
}
