//! The energy–momentum scheme keeps the energy whatever the step.

mod time_common;

use nicolson_solvers::time::{Scheme, StepControl, TimeState};
use time_common::spring::{Potential, Spring};
use time_common::{run, stepper};

fn largest_drift(potential: Potential, step: f64, v: f64) -> (f64, Spring) {
    let mut spring = Spring::new(potential, 0.0, |_| 0.0);
    let mut state = TimeState::new(0.0, vec![0.1, v]);
    let mut stepper = stepper(Scheme::EnergyMomentum, StepControl::Fixed { step });
    let energy = spring.energy(&state.values);
    let mut drift = 0.0_f64;
    for k in 1..=200 {
        run(&mut stepper, &mut spring, &mut state, step * f64::from(k));
        drift = drift.max((spring.energy(&state.values) / energy - 1.0).abs());
    }
    assert_eq!(stepper.statistics().rejected.total(), 0);
    assert_eq!(stepper.statistics().accepted, 200);
    (drift, spring)
}

#[test]
fn energy_is_constant_for_any_step() {
    for step in [0.01, 0.1, 1.0, 10.0] {
        for potential in [Potential::Quartic { k: 1.0, b: 5.0 }, Potential::Barrier { k: 1.0 }] {
            let (drift, _) = largest_drift(potential, step, 0.7);
            assert!(drift < 1e-12, "{potential:?}, Δt = {step}: {drift:e}");
        }
    }
}

#[test]
fn an_inadmissible_extrapolation_falls_back_on_the_resting_start() {
    // Moving inwards at unit speed, a step of 10 extrapolates far below zero length.
    let (drift, spring) = largest_drift(Potential::Barrier { k: 1.0 }, 10.0, -1.0);
    assert!(drift < 1e-12, "{drift:e}");
    assert!(spring.resting_starts > 0);
}

#[test]
fn an_inadmissible_stage_start_falls_back_on_the_admissible_one() {
    let mut spring = Spring::new(Potential::Barrier { k: 1.0 }, 0.0, |_| 0.0);
    let mut state = TimeState::new(0.0, vec![0.1, -3.0]);
    let mut stepper = stepper(Scheme::BackwardEuler, StepControl::Fixed { step: 2.0 });
    let report = stepper.advance(&mut spring, &mut state, 10.0).expect("one step");
    assert_eq!((report.rejected, report.step), (0, 2.0));
    assert_eq!(spring.admissible_starts, 1);
    assert!(state.values[0] > -1.0);
}

#[test]
fn crank_nicolson_does_not_keep_the_energy_of_a_nonlinear_spring() {
    // What the scheme above is for.
    let mut spring = Spring::new(Potential::Quartic { k: 1.0, b: 5.0 }, 0.0, |_| 0.0);
    let mut state = TimeState::new(0.0, vec![0.1, 0.7]);
    let energy = spring.energy(&state.values);
    let mut stepper = stepper(Scheme::CrankNicolson, StepControl::Fixed { step: 0.5 });
    run(&mut stepper, &mut spring, &mut state, 20.0);
    assert!((spring.energy(&state.values) / energy - 1.0).abs() > 1e-3);
}
