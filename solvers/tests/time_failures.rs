//! Failed tries: the state keeps its bits, the step is cut, grows back, or fails in plain words.

mod time_common;

use nicolson_solvers::nonlinear::{NewtonOptions, NewtonSolver};
use nicolson_solvers::time::{
    Adaptive, Retries, RkcOptions, RkcStages, Scheme, StepCause, StepControl, StepReport, Stepper, System, TimeState,
};
use time_common::dense::DenseSolver;
use time_common::faulty::{Fault, Faulty};
use time_common::{Forced, Full, Oscillator, bits, stepper};

fn faulty(fault: Fault, failing: std::ops::Range<usize>) -> Faulty<Full<Forced>> {
    Faulty::new(Full::new(Forced { a: 0.4, c: 0.6 }), fault, failing)
}

fn start() -> TimeState {
    TimeState::new(0.0, Forced::exact(0.0).to_vec())
}

const SCHEMES: [Scheme; 11] = [
    Scheme::ForwardEuler,
    Scheme::TvdRk2,
    Scheme::TvdRk3,
    Scheme::Rk4,
    Scheme::VelocityVerlet,
    Scheme::Rkc(RkcOptions { stages: RkcStages::Fixed(4), largest: 10 }),
    Scheme::CrankNicolson,
    Scheme::Midpoint,
    Scheme::TrBdf2,
    Scheme::Sdirk3,
    Scheme::GeneralisedAlpha { spectral_radius: 0.5 },
];

#[test]
fn a_fault_at_any_call_of_a_step_is_survived_by_a_cut() {
    for scheme in SCHEMES {
        for fault in [Fault::Error, Fault::NotANumber] {
            // Calls of one step without faults.
            let mut counted = faulty(fault, 0..0);
            let mut state = start();
            stepper(scheme, StepControl::Fixed { step: 0.1 }).advance(&mut counted, &mut state, 1.0).expect("one step");
            for call in 0..counted.calls {
                let mut system = faulty(fault, call..call + 1);
                let mut state = start();
                let mut stepper = stepper(scheme, StepControl::Fixed { step: 0.1 });
                let report = stepper
                    .advance(&mut system, &mut state, 1.0)
                    .unwrap_or_else(|failure| panic!("{scheme}, {fault:?} at call {call}: {failure}"));
                assert!(state.values.iter().all(|u| u.is_finite()));
                // Newton may go around one bad point; an explicit scheme cannot.
                let expected = if report.rejected == 0 { 0.1 } else { 0.025 };
                assert!(report.rejected == 1 || (scheme.is_implicit() && report.rejected == 0), "{scheme} {report:?}");
                assert_eq!(report.step, expected);
                assert_eq!(state.time, expected);
                let error = (state.values[0] - Forced::exact(state.time)[0]).abs();
                assert!(error < 0.01, "{scheme}: {error}");
                assert_eq!(stepper.statistics().rejected.total(), report.rejected);
            }
        }
    }
}

#[test]
fn a_lasting_fault_fails_in_words_and_leaves_every_bit() {
    for scheme in SCHEMES {
        for fault in [Fault::Error, Fault::NotANumber] {
            let mut system = faulty(fault, 0..0);
            let mut state = start();
            let mut stepper = stepper(scheme, StepControl::Fixed { step: 0.1 });
            for _ in 0..3 {
                stepper.advance(&mut system, &mut state, 1.0).expect("one step");
            }
            let before = state.clone();
            system.failing = system.calls..usize::MAX;
            let failure = stepper.advance(&mut system, &mut state, 1.0).expect_err("no step");
            assert_eq!(bits(&state), bits(&before));
            assert_eq!(state, before, "{scheme}");
            let steps: Vec<f64> = failure.tries.iter().map(|failed| failed.step).collect();
            assert_eq!(steps[..4], [0.1, 0.025, 0.0125, 0.00625]);
            let last = steps[steps.len() - 1];
            assert!((1e-7..2.1e-7).contains(&last), "{last}");
            let text = failure.to_string();
            assert!(text.starts_with("step from t = 0.3"), "{text}");
            assert!(text.contains(&format!("failed down to Δt = {last:e}")), "{text}");
            let reason = if fault == Fault::Error && !scheme.is_implicit() { "volume ratio J = -5e-1" } else { "" };
            assert!(text.contains(reason), "{text}");
            let statistics = stepper.statistics();
            assert_eq!((statistics.failed, statistics.accepted), (1, 3));
            assert_eq!(statistics.rejected.total(), steps.len());
            // The fault is over: the run goes on from the same state at the nominal step.
            system.failing = 0..0;
            let report = stepper.advance(&mut system, &mut state, 1.0).expect("one step");
            assert_eq!((report.step.to_bits(), report.rejected), (0.1_f64.to_bits(), 0));
        }
    }
}

#[test]
fn a_cut_step_grows_back_to_the_nominal_bits() {
    let nominal = 0.1;
    let mut system = faulty(Fault::Error, 1..3);
    let mut state = start();
    let mut stepper = stepper(Scheme::TvdRk2, StepControl::Fixed { step: nominal });
    let mut advance = || -> StepReport { stepper.advance(&mut system, &mut state, 100.0).expect("one step") };
    let first = advance();
    assert_eq!((first.rejected, first.rejections.evaluation), (2, 2));
    assert_eq!(first.step, nominal * 0.25 * 0.5);
    let steps: Vec<u64> = (0..5).map(|_| advance().step.to_bits()).collect();
    let expected = [nominal * 0.25, nominal * 0.5, nominal, nominal, nominal].map(f64::to_bits);
    assert_eq!(steps, expected);
    assert_eq!(stepper.statistics().smallest_step, nominal / 8.0);

    // Cuts that are no powers of two come back as well.
    let retries = Retries { first_cut: 0.3, growth: 1.7, ..Retries::default() };
    let control = StepControl::Fixed { step: nominal };
    let mut stepper = Stepper::new(Scheme::Rk4, control, None).and_then(|s| s.with_retries(retries)).expect("valid");
    let mut system = faulty(Fault::NotANumber, 2..3);
    let mut state = start();
    let steps: Vec<f64> =
        (0..5).map(|_| stepper.advance(&mut system, &mut state, 100.0).expect("one step").step).collect();
    assert_eq!(steps[0], nominal * 0.3);
    assert_eq!(steps[4].to_bits(), nominal.to_bits());
}

#[test]
fn an_explicit_step_that_overflows_is_never_accepted() {
    for scheme in [Scheme::ForwardEuler, Scheme::TvdRk2, Scheme::TvdRk3, Scheme::Rk4, Scheme::VelocityVerlet] {
        let mut system = Full::new(Oscillator { omega: 1e160 });
        let mut state = TimeState::new(0.0, vec![1.0, 1.0]);
        let before = state.clone();
        let mut stepper = stepper(scheme, StepControl::Fixed { step: 1.0 });
        let failure = stepper.advance(&mut system, &mut state, 1.0).expect_err("no step");
        assert!(failure.to_string().contains("inf"), "{scheme}: {failure}");
        assert!(matches!(failure.cause(), Some(StepCause::NotFinite { index: 0..2, .. } | StepCause::Evaluation(_))));
        assert_eq!(state, before);
        assert_eq!(stepper.statistics().rejected.not_finite, failure.tries.len());
        // An overflow of the result itself, which a shorter step avoids.
        let mut system = Full::new(Oscillator { omega: 1.0 });
        let mut state = TimeState::new(0.0, vec![1e307, 1e307]);
        let mut stepper = self::stepper(scheme, StepControl::Fixed { step: 100.0 });
        let report = stepper.advance(&mut system, &mut state, 1e3).expect("a shorter step");
        assert!(report.rejections.not_finite >= 1 && report.step < 100.0, "{scheme}: {report:?}");
        assert!(state.values.iter().all(|u| u.is_finite()));
    }
}

#[test]
fn adaptive_control_survives_faults_too() {
    for scheme in SCHEMES {
        for call in [3, 7, 20, 21, 40] {
            let mut system = faulty(Fault::NotANumber, call..call + 2);
            let mut state = start();
            let mut stepper = stepper(scheme, StepControl::Adaptive(Adaptive::new(1e-4, 1e-4)));
            time_common::run(&mut stepper, &mut system, &mut state, 2.0);
            assert!((state.values[0] - Forced::exact(2.0)[0]).abs() < 0.05, "{scheme}");
        }
    }
}

#[test]
fn what_a_shorter_step_cannot_cure_is_not_retried() {
    let control = || StepControl::Fixed { step: 0.1 };
    let mut rk4 = stepper(Scheme::Rk4, control());
    let mut system = Full::new(Oscillator { omega: 1.0 });
    let mut only = |state: &mut TimeState, target: f64| {
        let before = bits(state);
        let failure = rk4.advance(&mut system, state, target).expect_err("refused");
        assert_eq!(failure.tries.len(), 1);
        assert_eq!(bits(state), before);
        failure.to_string()
    };
    let text = only(&mut TimeState::new(0.0, vec![0.0; 3]), 1.0);
    assert!(text.contains("state of length 3 where the system has 2"), "{text}");
    let text = only(&mut TimeState::new(0.0, vec![0.0, f64::NAN]), 1.0);
    assert!(text.contains("entry 1 of the state is NaN before the step"), "{text}");
    for target in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let text = only(&mut TimeState::new(0.0, vec![0.0, 1.0]), target);
        assert!(text.contains("is not after the present time"), "{text}");
    }
    let text = only(&mut TimeState::new(1e20, vec![0.0, 1.0]), 2e20);
    assert!(text.contains("vanishes"), "{text}");

    // A system without what the scheme needs.
    struct Plain;
    impl System for Plain {
        fn len(&self) -> usize {
            1
        }
        fn rate(&mut self, _: f64, _: &[f64], out: &mut [f64]) -> Result<(), nicolson_solvers::EvaluationError> {
            out[0] = 0.0;
            Ok(())
        }
    }
    for (scheme, word) in [
        (Scheme::CrankNicolson, "implicit stages"),
        (Scheme::EnergyMomentum, "discrete energy"),
        (Scheme::VelocityVerlet, "velocities"),
    ] {
        let mut state = TimeState::new(0.0, vec![1.0]);
        let failure = stepper(scheme, control()).advance(&mut Plain, &mut state, 1.0).expect_err("refused");
        assert!(failure.tries.len() == 1 && failure.to_string().contains(word), "{failure}");
    }

    // Newton options that make no sense do not get better by shorter steps.
    let options = NewtonOptions { max_iterations: 0, ..NewtonOptions::default() };
    let newton = NewtonSolver::new(options, Box::new(DenseSolver::default()));
    let mut stepper = Stepper::new(Scheme::BackwardEuler, control(), Some(newton)).expect("valid");
    let mut state = TimeState::new(0.0, vec![1.0, 0.0]);
    let failure = stepper.advance(&mut Full::new(Oscillator { omega: 1.0 }), &mut state, 1.0).expect_err("refused");
    assert_eq!(failure.tries.len(), 1, "{failure}");
}
