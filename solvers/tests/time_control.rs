//! Step control: fixed, CFL, by error, by Newton effort; landing; continuing from a checkpoint.

mod time_common;

use nicolson_solvers::time::{
    Adaptive, Effort, Retries, RkcOptions, RkcStages, Scheme, StepCause, StepControl, Stepper, StepperError, TimeState,
};
use time_common::spring::{Potential, Spring};
use time_common::{Equations, Forced, Full, Oscillator, bits, newton, run, stepper};

fn forced() -> Full<Forced> {
    Full::new(Forced { a: 0.4, c: 0.6 })
}

fn start() -> TimeState {
    TimeState::new(0.0, Forced::exact(0.0).to_vec())
}

fn rkc() -> Scheme {
    Scheme::Rkc(RkcOptions { stages: RkcStages::Fixed(3), ..RkcOptions::default() })
}

fn all_schemes() -> Vec<Scheme> {
    vec![
        Scheme::ForwardEuler,
        Scheme::TvdRk2,
        Scheme::TvdRk3,
        Scheme::Rk4,
        Scheme::VelocityVerlet,
        rkc(),
        Scheme::Theta(0.6),
        Scheme::BackwardEuler,
        Scheme::CrankNicolson,
        Scheme::Midpoint,
        Scheme::TrBdf2,
        Scheme::Sdirk3,
        Scheme::GeneralisedAlpha { spectral_radius: 0.6 },
        Scheme::EnergyMomentum,
    ]
}

/// The quartic spring of the conserving scheme, with the motion `0.7 sin(1.1 t)`.
fn spring() -> Spring {
    Spring::new(Potential::Quartic { k: 2.0, b: 1.5 }, 0.3, |t| {
        let (x, v) = (0.7 * (1.1 * t).sin(), 0.77 * (1.1 * t).cos());
        0.79 * x + 1.5 * x * x * x + 0.3 * v
    })
}

#[test]
fn adaptive_control_meets_the_tolerance_with_every_scheme() {
    for scheme in all_schemes() {
        let mut errors = Vec::new();
        for tolerance in [1e-4, 1e-6] {
            let mut state = TimeState::new(0.0, vec![0.0, 0.77]);
            let mut stepper = stepper(scheme, StepControl::Adaptive(Adaptive::new(tolerance, tolerance)));
            run(&mut stepper, &mut spring(), &mut state, 3.0);
            let exact = [0.7 * 3.3_f64.sin(), 0.77 * 3.3_f64.cos()];
            let error = (state.values[0] - exact[0]).abs().max((state.values[1] - exact[1]).abs());
            let statistics = stepper.statistics();
            // Global errors follow the tolerance as Δtᵖ/Δtᵏ does: worst for first order, √tolerance.
            let allowed = if scheme.order() == 1 { 2.0 * tolerance.sqrt() } else { 40.0 * tolerance.powf(0.8) };
            assert!(error < allowed, "{scheme}, tolerance {tolerance:e}: error {error:e}, {statistics:?}");
            assert!(statistics.accepted < 6000, "{scheme}: {statistics:?}");
            assert_eq!(statistics.rejected.total(), statistics.rejected.error);
            errors.push(error);
        }
        assert!(errors[1] < 0.2 * errors[0], "{scheme}: {errors:?}");
    }
}

/// A burst at t = 1 that a step chosen on the calm before is too long for.
struct Burst;

impl Equations for Burst {
    fn len(&self) -> usize {
        1
    }

    fn rate(&self, t: f64, _u: &[f64], out: &mut [f64]) {
        out[0] = (-(30.0 * (t - 1.0)).powi(2)).exp();
    }

    fn jacobian(&self, _t: f64, _u: &[f64]) -> Vec<f64> {
        vec![0.0]
    }
}

#[test]
fn adaptive_control_rejects_counts_and_recovers() {
    for scheme in [Scheme::TvdRk3, Scheme::Rk4, Scheme::TrBdf2, Scheme::Sdirk3, Scheme::CrankNicolson] {
        let mut state = TimeState::new(0.0, vec![0.0]);
        let adaptive = Adaptive { largest: 0.1, ..Adaptive::new(0.0, 1e-6) };
        let mut stepper = stepper(scheme, StepControl::Adaptive(adaptive));
        let mut reported = 0;
        while state.time < 2.0 {
            let report = stepper.advance(&mut Full::new(Burst), &mut state, 2.0).expect("a step");
            assert!(report.error_estimate.expect("an estimate") <= 1.0);
            assert_eq!(report.rejected, report.rejections.error);
            reported += report.rejected;
        }
        let statistics = stepper.statistics();
        assert!(statistics.rejected.error > 0, "{scheme}");
        assert_eq!(reported, statistics.rejected.error);
        assert!(statistics.largest_step > 0.09 && statistics.smallest_step < 0.02, "{scheme}: {statistics:?}");
        let exact = std::f64::consts::PI.sqrt() / 30.0;
        assert!((state.values[0] - exact).abs() < 1e-4, "{scheme}: {:?}", state.values);
    }
}

#[test]
fn every_step_lands_on_its_targets() {
    let controls = [
        StepControl::Fixed { step: 0.07 },
        StepControl::Cfl { factor: 0.5 },
        StepControl::Adaptive(Adaptive::new(1e-3, 1e-3)),
    ];
    for control in controls {
        let mut system = forced();
        let mut state = start();
        let mut stepper = stepper(Scheme::CrankNicolson, control);
        for k in 1..=30 {
            run(&mut stepper, &mut system, &mut state, f64::from(k) / 7.0);
        }
    }
}

#[test]
fn a_fixed_step_keeps_its_bits_and_does_not_drift() {
    let mut system = Full::new(Oscillator { omega: 1.0 });
    let mut state = TimeState::new(0.0, vec![1.0, 0.0]);
    // 0.1 is no binary fraction: without compensation a hundred thousand steps miss the target by
    // more than 1e-9 steps, and a sliver of a step would follow.
    let mut stepper = stepper(Scheme::Rk4, StepControl::Fixed { step: 0.1 });
    let steps = run(&mut stepper, &mut system, &mut state, 10_000.0);
    assert_eq!(steps, 100_000);
    let statistics = stepper.statistics();
    assert_eq!((statistics.smallest_step, statistics.largest_step), (0.1, 0.1));
    // The last step of an interval is shorter where it must be.
    let report = stepper.advance(&mut system, &mut state, 10_000.03).expect("one step");
    assert!((report.step - 0.03).abs() < 1e-11 && state.time == 10_000.03);
}

/// An oscillator whose CFL limit shrinks with time.
struct Stiffening;

impl Equations for Stiffening {
    fn len(&self) -> usize {
        1
    }

    fn rate(&self, _t: f64, u: &[f64], out: &mut [f64]) {
        out[0] = -u[0];
    }

    fn jacobian(&self, _t: f64, _u: &[f64]) -> Vec<f64> {
        vec![-1.0]
    }

    fn stable_step(&self, t: f64) -> f64 {
        if t < 100.0 { 0.2 / (1.0 + t) } else { f64::NAN }
    }
}

#[test]
fn the_cfl_limit_is_asked_for_every_step() {
    let mut system = Full::new(Stiffening);
    let mut state = TimeState::new(0.0, vec![1.0]);
    let mut stepper = stepper(Scheme::TvdRk2, StepControl::Cfl { factor: 0.5 });
    while state.time < 3.0 {
        let limit = 0.5 * 0.2 / (1.0 + state.time);
        let remaining = 3.0 - state.time;
        let report = stepper.advance(&mut system, &mut state, 3.0).expect("one step");
        // Near the target the rest is halved rather than leaving a sliver.
        assert!(report.step == limit || remaining < 2.0 * limit && report.step <= limit * (1.0 + 1e-9));
    }
    // No limit at all: straight to the target. A limit that is no number is an error.
    let mut free = forced();
    let mut elsewhere = start();
    let report = stepper.advance(&mut free, &mut elsewhere, 0.25).expect("one step");
    assert_eq!(report.step, 0.25);
    let mut late = TimeState::new(200.0, vec![1.0]);
    let failure = stepper.advance(&mut system, &mut late, 201.0).expect_err("no step");
    assert!(matches!(failure.cause(), Some(StepCause::StepNotPositive { .. })));
}

#[test]
fn effort_lengthens_cheap_steps_and_shortens_costly_ones() {
    let effort = Effort { largest: 2.0, ..Effort::new(0.01) };
    let mut state = TimeState::new(0.0, vec![0.1, 0.7]);
    let mut stepper = stepper(Scheme::EnergyMomentum, StepControl::Effort(effort));
    run(&mut stepper, &mut spring(), &mut state, 20.0);
    assert!(stepper.statistics().largest_step > 0.05);
    let cheap = stepper.statistics().accepted;
    assert!(cheap < 1000);

    let effort = Effort { few: 0, many: 1, ..Effort::new(0.5) };
    let mut stepper = Stepper::new(Scheme::Midpoint, StepControl::Effort(effort), Some(newton())).expect("valid");
    let mut state = TimeState::new(0.0, vec![0.1, 0.7]);
    stepper.advance(&mut spring(), &mut state, 20.0).expect("one step");
    assert_eq!(state.memory.control.step, 0.25);
}

#[test]
fn a_copy_of_the_state_continues_bit_by_bit() {
    for scheme in all_schemes() {
        for control in [StepControl::Fixed { step: 0.03 }, StepControl::Adaptive(Adaptive::new(1e-5, 1e-5))] {
            let mut state = TimeState::new(0.0, vec![0.0, 0.77]);
            let mut first = stepper(scheme, control.clone());
            run(&mut first, &mut spring(), &mut state, 0.5);
            let mut copy = state.clone();
            run(&mut first, &mut spring(), &mut state, 1.0);
            let mut second = stepper(scheme, control);
            run(&mut second, &mut spring(), &mut copy, 1.0);
            assert_eq!(bits(&state), bits(&copy), "{scheme}");
            assert_eq!(state, copy);
        }
    }
}

#[test]
fn a_changed_state_is_noticed_and_its_kept_rate_forgotten() {
    let mut system = forced();
    let mut state = start();
    let mut stepper = stepper(Scheme::CrankNicolson, StepControl::Fixed { step: 0.1 });
    for _ in 0..3 {
        stepper.advance(&mut system, &mut state, 9.0).expect("one step");
    }
    assert_eq!(system.rates, 1);
    state.values[1] += 0.5;
    stepper.advance(&mut system, &mut state, 9.0).expect("one step");
    assert_eq!(system.rates, 2);
    state.forget_rates();
    stepper.advance(&mut system, &mut state, 9.0).expect("one step");
    assert_eq!(system.rates, 3);
}

/// A system that imposes what no stage knows of.
struct Ratchet {
    active: bool,
}

impl Equations for Ratchet {
    fn len(&self) -> usize {
        1
    }

    fn rate(&self, _t: f64, u: &[f64], out: &mut [f64]) {
        out[0] = -u[0];
    }

    fn jacobian(&self, _t: f64, _u: &[f64]) -> Vec<f64> {
        vec![-1.0]
    }

    fn impose(&self, _t: f64, u: &mut [f64]) {
        if self.active {
            u[0] = 0.5;
        }
    }
}

#[test]
fn a_stage_rate_is_kept_only_if_imposing_changes_nothing() {
    for (active, rates) in [(false, 1), (true, 5)] {
        let mut system = Full::new(Ratchet { active });
        let mut state = TimeState::new(0.0, vec![1.0]);
        let mut stepper = stepper(Scheme::CrankNicolson, StepControl::Fixed { step: 0.25 });
        for _ in 0..5 {
            stepper.advance(&mut system, &mut state, 9.0).expect("one step");
        }
        assert_eq!((system.rates, stepper.statistics().rate_evaluations), (rates, rates));
    }
}

#[test]
fn a_target_one_rounding_away_is_reached() {
    let mut state = TimeState::new(0.0, Forced::exact(0.0).to_vec());
    let mut stepper = stepper(Scheme::TvdRk2, StepControl::Fixed { step: 0.1 });
    run(&mut stepper, &mut forced(), &mut state, 0.7);
    assert_eq!(run(&mut stepper, &mut forced(), &mut state, 0.7_f64.next_up()), 1);
}

#[test]
fn impossible_set_ups_are_refused() {
    let fixed = StepControl::Fixed { step: 0.1 };
    for scheme in all_schemes() {
        let made = Stepper::new(scheme, fixed.clone(), None);
        assert_eq!(made.is_err(), scheme.is_implicit());
    }
    let refused = |scheme, control| Stepper::new(scheme, control, Some(newton())).err().expect("refused").to_string();
    assert_eq!(refused(Scheme::Theta(0.0), fixed.clone()), "θ = 0 where 0 < θ ≤ 1 is expected");
    assert!(refused(Scheme::Theta(f64::NAN), fixed.clone()).contains("NaN"));
    assert!(refused(Scheme::GeneralisedAlpha { spectral_radius: 1.5 }, fixed).contains("spectral radius"));
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(Scheme::Rk4, StepControl::Fixed { step }).starts_with("step = "));
        assert!(refused(Scheme::Rk4, StepControl::Cfl { factor: step }).starts_with("CFL factor = "));
    }
    assert!(refused(Scheme::Rk4, StepControl::Adaptive(Adaptive::new(0.0, 0.0))).contains("tolerance"));
    assert!(refused(Scheme::Rk4, StepControl::Effort(Effort::new(0.1))).contains("explicit"));
    let error = Stepper::new(Scheme::BackwardEuler, StepControl::Fixed { step: 0.1 }, None).err();
    assert_eq!(error, Some(StepperError::NewtonMissing { scheme: "backward Euler" }));
    let stepper = stepper(Scheme::Rk4, StepControl::Fixed { step: 0.1 });
    assert!(stepper.with_retries(Retries { cut: 1.0, ..Retries::default() }).is_err());
}
