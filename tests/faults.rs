//! Faults injected into a real simulation (issue 3, point 8): a factorisation that gives NaN, one that fails, a
//! Krylov method that stagnates, a residual that errs or is NaN. Each rejects the step and leaves the state as it
//! was, to the last bit. One that passes lets the run go on with a shorter step; one that stays ends it with its
//! cause, and had it never been, no later bit would be another. How the program ends is in `command_line`.

#[path = "../solvers/tests/time_common/faulty.rs"]
mod faulty;
mod support;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use faulty::{Fault, Faulty};
use nicolson_solvers::linear::{
    LinearCounts, LinearError, LinearReport, LinearSolver, LinearSolverInfo, SparseLu, Tangent,
};
use nicolson_solvers::nonlinear::{NewtonOptions, NewtonSolver};
use nicolson_solvers::time::{Scheme, StepControl, StepReport, Stepper, System, TimeState};
use support::scenes::prepared;

const STEP: f64 = 0.1;
const SCHEMES: [Scheme; 3] = [Scheme::CrankNicolson, Scheme::TrBdf2, Scheme::EnergyMomentum];

/// How a linear solver fails.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Failing {
    /// It says that all is well, and returns NaN.
    NotANumber,
    /// Its factorisation fails.
    Singular,
    /// It iterates to no end.
    Stagnation,
}

/// A direct solver of which the next few solves fail.
struct Broken {
    inner: SparseLu,
    failing: Failing,
    left: Arc<AtomicUsize>,
}

impl Broken {
    fn strikes(&self) -> bool {
        self.left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1)).is_ok()
    }
}

impl LinearSolver for Broken {
    fn info(&self) -> LinearSolverInfo {
        self.inner.info()
    }

    fn counts(&self) -> LinearCounts {
        self.inner.counts()
    }

    fn prepare(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        self.inner.prepare(tangent)?;
        if self.failing == Failing::Singular && self.strikes() {
            return Err(LinearError::Singular { unknown: Some(3) });
        }
        Ok(())
    }

    fn solve(
        &mut self,
        a: &dyn Tangent,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<LinearReport, LinearError> {
        let report = self.inner.solve(a, b, x, tolerance)?;
        if self.failing == Failing::Singular || !self.strikes() {
            return Ok(report);
        }
        if self.failing == Failing::Stagnation {
            return Err(LinearError::IterationLimit { iterations: 1000, relative_residual: 0.9 });
        }
        x.fill(f64::NAN);
        Ok(report)
    }
}

fn stepper(scheme: Scheme, linear: impl LinearSolver + 'static) -> Stepper {
    let newton = NewtonSolver::new(NewtonOptions::default(), Box::new(linear));
    Stepper::new(scheme, StepControl::Fixed { step: STEP }, Some(newton)).expect("a stepper")
}

fn bits(state: &TimeState) -> Vec<u64> {
    std::iter::once(state.time).chain(state.values.iter().copied()).map(f64::to_bits).collect()
}

/// Two steps, then one with the fault: `strike(system, true)` lets it stay, `strike(system, false)` ends it.
/// Returns the words of the failure and the state one step after the fault.
fn lasting(
    stepper: &mut Stepper,
    system: &mut dyn System,
    state: &mut TimeState,
    mut strike: impl FnMut(&mut dyn System, bool),
) -> String {
    let mut advance = |system: &mut dyn System, state: &mut TimeState| stepper.advance(system, state, 10.0);
    for _ in 0..2 {
        advance(system, state).expect("a step");
    }
    let before = bits(state);
    strike(system, true);
    let failure = advance(system, state).expect_err("no step");
    assert_eq!(bits(state), before, "{failure}");
    assert!(failure.tries.len() > 1, "shorter steps were tried: {failure}");
    strike(system, false);
    let report = advance(system, state).expect("a step");
    assert_eq!((report.step, report.rejected), (STEP, 0));
    failure.to_string()
}

/// The state after three steps without any fault.
fn undisturbed(scheme: Scheme) -> TimeState {
    let mut run = coarse();
    let mut stepper = stepper(scheme, SparseLu::default());
    for _ in 0..3 {
        stepper.advance(&mut run.model, &mut run.state, 10.0).expect("a step");
    }
    run.state
}

fn coarse() -> nicolson::simulation::Prepared<2> {
    prepared::<2>("impact-hyperelastic", &[("body.0.spacing", "0.5")])
}

#[test]
fn a_broken_linear_solver_costs_a_step_and_no_bit() {
    for scheme in SCHEMES {
        let expected = bits(&undisturbed(scheme));
        for (failing, words) in [
            (Failing::NotANumber, "relative residual NaN"),
            (Failing::Singular, "matrix is singular at unknown 3"),
            (Failing::Stagnation, "no convergence in 1000 iterations"),
        ] {
            let left = Arc::new(AtomicUsize::new(0));
            let broken = Broken { inner: SparseLu::default(), failing, left: Arc::clone(&left) };
            let mut run = coarse();
            let mut stepper = stepper(scheme, broken);
            let strike =
                |_: &mut dyn System, lasts: bool| left.store(if lasts { 1_000_000 } else { 0 }, Ordering::SeqCst);
            let text = lasting(&mut stepper, &mut run.model, &mut run.state, strike);
            assert!(text.contains("the linear solve failed") && text.contains(words), "{scheme}, {failing:?}: {text}");
            assert_eq!(bits(&run.state), expected, "{scheme}, {failing:?}");
            // One that passes.
            left.store(1, Ordering::SeqCst);
            let report = stepper.advance(&mut run.model, &mut run.state, 10.0).expect("a step");
            survived(scheme, &report, &run.state);
        }
    }
}

/// A step after a fault that passed: shorter, or, with the energy–momentum scheme, from another start.
fn survived(scheme: Scheme, report: &StepReport, state: &TimeState) {
    let repaired = report.failed_solves.len();
    match report.rejected {
        0 => assert!(scheme == Scheme::EnergyMomentum && repaired == 1 && report.step == STEP, "{scheme}: {report:?}"),
        count => assert_eq!((count, report.step), (1, 0.25 * STEP), "{scheme}"),
    }
    assert!(state.values.iter().all(|value| value.is_finite()));
}

#[test]
fn a_residual_that_errs_at_any_iteration_costs_a_step_and_no_bit() {
    // The wrapper has no conserving step.
    for scheme in [Scheme::CrankNicolson, Scheme::TrBdf2] {
        let expected = bits(&undisturbed(scheme));
        for (fault, words) in
            [(Fault::Error, "volume ratio J = -5e-1"), (Fault::NotANumber, "residual = NaN is not finite")]
        {
            // From the k-th evaluation of the third step on.
            for k in 0..4 {
                let run = coarse();
                let mut state = run.state;
                let mut system = Faulty::new(run.model, fault, 0..0);
                let mut stepper = stepper(scheme, SparseLu::default());
                for _ in 0..2 {
                    stepper.advance(&mut system, &mut state, 10.0).expect("a step");
                }
                let before = bits(&state);
                system.failing = system.calls + k..usize::MAX;
                let failure = stepper.advance(&mut system, &mut state, 10.0).expect_err("no step");
                assert_eq!(bits(&state), before, "{failure}");
                assert!(failure.to_string().contains(words), "{scheme}, {fault:?}, {k}: {failure}");
                system.failing = 0..0;
                stepper.advance(&mut system, &mut state, 10.0).expect("a step");
                assert_eq!(bits(&state), expected, "{scheme}, {fault:?}, {k}");
            }
        }
    }
}
