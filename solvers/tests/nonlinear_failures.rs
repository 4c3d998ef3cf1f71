//! Every failure carries the right cause and its whole history, and leaves the unknowns as they were.

#[path = "nonlinear/support.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;
#[path = "nonlinear/test_functions.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod test_functions;

use std::error::Error;
use std::ops::ControlFlow;

use nicolson_solvers::linear::{LinearError, LinearSolver};
use nicolson_solvers::nonlinear::{
    Forcing, Globalisation, IterationRecord, NewtonCause, NewtonFailure, NewtonMonitor, NewtonOptions, NewtonSolver,
    TangentPolicy,
};
use nicolson_solvers::{EvaluationError, EvaluationFailure};
use support::{DenseLu, DenseTangent, Equations, Fault, Faulty, globalisations, logarithm};
use test_functions::rosenbrock;

/// Solves, expects a failure, and checks what holds for all of them.
fn failure_of(
    options: NewtonOptions,
    linear: Box<dyn LinearSolver>,
    problem: &mut Equations,
    start: &[f64],
) -> NewtonFailure {
    let mut solver = NewtonSolver::new(options, linear);
    let mut y = start.to_vec();
    let failure = *solver.solve(problem, &mut y).expect_err("must fail");
    let bits = |y: &[f64]| y.iter().map(|y| y.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&y), bits(start), "{failure}");
    assert!(failure.history.iter().enumerate().all(|(i, record)| record.iteration == i));
    assert!(failure.history.is_empty() || failure.history.len() == failure.work.iterations + 1);
    assert_eq!((solver.totals().solves, solver.totals().failures), (1, 1));
    failure
}

fn with(globalisation: Globalisation) -> NewtonOptions {
    NewtonOptions { globalisation, ..Default::default() }
}

#[test]
fn iteration_limit() {
    for globalisation in globalisations() {
        let options = NewtonOptions { max_iterations: 1, ..with(globalisation) };
        let failure = failure_of(options, Box::new(DenseLu::default()), &mut logarithm(), &[5.0]);
        assert_eq!(failure.cause, NewtonCause::IterationLimit { iterations: 1 }, "{globalisation:?}");
    }
}

#[test]
fn iteration_limit_with_a_stale_tangent_first_tries_full_newton() {
    let policy = TangentPolicy::Lagged { contraction: 0.99, steps: 50 };
    let options = NewtonOptions { max_iterations: 2, tangent: policy, ..Default::default() };
    let failure = failure_of(options, Box::new(DenseLu::default()), &mut logarithm(), &[0.001]);
    assert_eq!(failure.cause, NewtonCause::IterationLimit { iterations: 4 });
}

#[test]
fn stagnation() {
    // 1 + 1/x has no zero: Newton runs away and the residual tends to one.
    let mut problem = Equations::new(1, |x| vec![support::constant(1.0) / x[0] + 1.0]);
    let options = NewtonOptions { stagnation: 3, ..with(Globalisation::None) };
    let failure = failure_of(options, Box::new(DenseLu::default()), &mut problem, &[1.0]);
    assert_eq!(failure.cause, NewtonCause::Stagnation { iterations: 3 });
}

#[test]
fn a_step_that_changes_nothing_is_stagnation_and_not_convergence() {
    // A tangent that is far too stiff: the step norm is tiny from the start, the residual is not.
    let mut problem = Equations { tangent_factor: 1e30, ..Equations::new(2, rosenbrock) };
    for globalisation in globalisations() {
        let failure = failure_of(with(globalisation), Box::new(DenseLu::default()), &mut problem, &[-1.2, 1.0]);
        assert!(matches!(failure.cause, NewtonCause::Stagnation { .. }), "{globalisation:?}: {failure}");
    }
}

#[test]
fn divergence() {
    // The cube root: full Newton steps double the distance and change the side.
    let cube_root = |x: &[support::Dual]| vec![x[0] * ((x[0] * x[0]).ln() / -3.0).exp()];
    let mut problem = Equations::new(1, cube_root);
    let options = NewtonOptions { divergence: 100.0, stagnation: 50, max_iterations: 50, ..with(Globalisation::None) };
    let failure = failure_of(options, Box::new(DenseLu::default()), &mut problem, &[1.0]);
    let NewtonCause::Divergence { growth } = failure.cause else { panic!("{failure}") };
    assert!(growth > 100.0 && growth < 130.0);
    assert_eq!(failure.work.iterations, 20);
}

#[test]
fn line_search_and_trust_region() {
    // A tangent with the wrong sign leads uphill however short the step.
    let mut problem = Equations { tangent_factor: -1.0, ..Equations::new(2, rosenbrock) };
    for globalisation in globalisations().into_iter().skip(1) {
        let failure = failure_of(with(globalisation), Box::new(DenseLu::default()), &mut problem, &[-1.2, 1.0]);
        let NewtonCause::LineSearch { trials, smallest } = failure.cause else {
            panic!("{globalisation:?}: {failure}")
        };
        assert!(trials > 3 && smallest < 1e-3, "{globalisation:?}: {trials} {smallest}");
        assert!(failure.to_string().contains("no acceptable step"));
    }
}

#[test]
fn linear_solve() {
    let causes = [
        (Fault::Prepare, LinearError::Singular { unknown: Some(1) }),
        (Fault::Solve(1), LinearError::Breakdown { iterations: 3, relative_residual: 0.5 }),
        (Fault::Stagnates, LinearError::IterationLimit { iterations: 500, relative_residual: 0.3 }),
    ];
    for (fault, error) in causes {
        let mut problem = Equations::new(2, rosenbrock);
        let failure = failure_of(NewtonOptions::default(), Box::new(Faulty::new(fault)), &mut problem, &[-1.2, 1.0]);
        assert_eq!(failure.cause, NewtonCause::LinearSolve(error), "{fault:?}");
        assert!(failure.source().is_some());
    }
    let mut problem = Equations::new(2, rosenbrock);
    let faulty = Box::new(Faulty::new(Fault::NotANumber));
    let failure = failure_of(NewtonOptions::default(), faulty, &mut problem, &[-1.2, 1.0]);
    let NewtonCause::LinearSolve(LinearError::Breakdown { relative_residual, .. }) = failure.cause else {
        panic!("{failure}")
    };
    assert!(relative_residual.is_nan());
}

#[test]
fn a_singular_tangent_is_named() {
    // x² + 1 has a singular derivative at 0.
    let mut problem = Equations::new(1, |x| vec![x[0] * x[0] + 1.0]);
    let failure = failure_of(NewtonOptions::default(), Box::new(DenseLu::default()), &mut problem, &[0.0]);
    assert_eq!(failure.cause, NewtonCause::LinearSolve(LinearError::Singular { unknown: Some(0) }));
}

#[test]
fn domain_of_the_start() {
    let failure = failure_of(NewtonOptions::default(), Box::new(DenseLu::default()), &mut logarithm(), &[-1.0]);
    let NewtonCause::Domain { ref error, at_start: true } = failure.cause else { panic!("{failure}") };
    assert_eq!((error.failure, error.value), (EvaluationFailure::OutsideDomain, -1.0));
    assert!(failure.history.is_empty() && failure.worst.is_empty());
    assert!(failure.to_string().contains("the start is not admissible"), "{failure}");
}

#[test]
fn domain_of_every_step() {
    for globalisation in globalisations() {
        let mut problem = Equations::new(2, rosenbrock).inside(|y| {
            let at_start = y == [-1.2, 1.0];
            if at_start { Ok(()) } else { Err(EvaluationError::outside_domain("volume ratio", 1, -0.5)) }
        });
        let failure = failure_of(with(globalisation), Box::new(DenseLu::default()), &mut problem, &[-1.2, 1.0]);
        let NewtonCause::Domain { at_start: false, .. } = failure.cause else { panic!("{globalisation:?}: {failure}") };
        assert!(problem.residuals <= 100, "the number of halvings is bounded");
    }
}

#[test]
fn a_residual_that_errs_once_only_shortens_the_step() {
    for globalisation in globalisations() {
        for fault_at in 2..6 {
            let mut problem = Equations { fault_at: Some(fault_at), ..logarithm() };
            let mut solver = NewtonSolver::new(with(globalisation), Box::new(DenseLu::default()));
            let mut y = [0.2];
            let report =
                solver.solve(&mut problem, &mut y).unwrap_or_else(|failure| panic!("{globalisation:?}: {failure}"));
            assert!((y[0] - 1.0).abs() < 1e-8 && report.iterations > 3);
        }
    }
}

#[test]
fn a_residual_that_holds_nan_is_a_domain_failure() {
    for globalisation in globalisations() {
        for nan_from in [1, 3] {
            let mut problem = Equations { nan_from: Some(nan_from), ..Equations::new(2, rosenbrock) };
            let failure = failure_of(with(globalisation), Box::new(DenseLu::default()), &mut problem, &[-1.2, 0.9]);
            let NewtonCause::Domain { ref error, at_start } = failure.cause else {
                panic!("{globalisation:?}: {failure}")
            };
            assert_eq!((error.failure, at_start), (EvaluationFailure::NotFinite, nan_from == 1));
            assert_eq!(error.place, "component 0");
        }
    }
}

#[test]
fn bad_input_is_a_failure_and_no_panic() {
    let mut problem = Equations::new(2, rosenbrock);
    let failure = failure_of(NewtonOptions::default(), Box::new(DenseLu::default()), &mut problem, &[1.0; 3]);
    assert_eq!(failure.cause, NewtonCause::WrongLength { expected: 2, found: 3 });
    let options = NewtonOptions { forcing: Forcing::Constant(-1.0), ..Default::default() };
    let failure = failure_of(options, Box::new(DenseLu::default()), &mut problem, &[-1.2, 1.0]);
    assert!(matches!(failure.cause, NewtonCause::Options(_)));
    assert_eq!(problem.residuals, 0);
    let failure = failure_of(NewtonOptions::default(), Box::new(DenseLu::default()), &mut problem, &[f64::NAN, 1.0]);
    assert!(matches!(failure.cause, NewtonCause::Domain { at_start: true, .. }));
}

#[test]
fn absurd_options_do_not_panic() {
    for tangent in [TangentPolicy::Modified, TangentPolicy::broyden(), TangentPolicy::limited_bfgs()] {
        let tangent = match tangent {
            TangentPolicy::QuasiNewton { update, contraction, steps, .. } => {
                TangentPolicy::QuasiNewton { update, memory: usize::MAX, contraction, steps }
            }
            other => other,
        };
        for globalisation in globalisations().into_iter().take(4) {
            let huge = usize::MAX;
            let options = NewtonOptions {
                tangent,
                globalisation,
                max_iterations: huge,
                max_trials: huge,
                stagnation: huge,
                divergence: f64::INFINITY,
                ..Default::default()
            };
            let mut solver = NewtonSolver::new(options, Box::new(DenseLu::default()));
            solver.solve(&mut logarithm(), &mut [12.0]).expect("a solution");
        }
    }
}

#[test]
fn huge_residuals_do_not_overflow_the_merit() {
    let scaled = |x: &[support::Dual]| vec![x[0].ln() * 1e200];
    for globalisation in [Globalisation::None, Globalisation::Backtracking, Globalisation::MoreThuente] {
        let mut problem = Equations { function: Box::new(scaled), ..logarithm() };
        let mut solver = NewtonSolver::new(with(globalisation), Box::new(DenseLu::default()));
        let mut y = [12.0];
        solver.solve(&mut problem, &mut y).expect("a solution");
        assert!((y[0] - 1.0).abs() < 1e-8);
    }
}

#[test]
fn a_trust_region_without_the_transposed_product_says_so() {
    let mut problem = Equations::new(2, rosenbrock);
    problem.tangent = DenseTangent::new(2).without_entries();
    let trust = with(Globalisation::TrustRegion { initial_radius: None });
    let failure = failure_of(trust, Box::new(DenseLu::default()), &mut problem, &[-1.2, 1.0]);
    assert!(matches!(failure.cause, NewtonCause::Unsupported { .. }), "{failure}");
    assert!(failure.to_string().contains("use a line search"));
}

#[test]
fn a_monitor_can_stop() {
    struct Impatient(usize);
    impl NewtonMonitor for Impatient {
        fn point(&mut self, record: &IterationRecord) -> ControlFlow<()> {
            if record.iteration >= self.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
    let mut solver = NewtonSolver::new(NewtonOptions::default(), Box::new(DenseLu::default()));
    solver.set_monitor(Some(Box::new(Impatient(2))));
    let mut y = [-1.2, 1.0];
    let failure = solver.solve(&mut Equations::new(2, rosenbrock), &mut y).expect_err("stopped");
    assert_eq!((failure.cause, failure.work.iterations, y), (NewtonCause::Stopped, 2, [-1.2, 1.0]));
}

#[test]
fn the_message_names_cause_progress_and_place() {
    let mut problem = Equations::new(2, rosenbrock);
    let options = NewtonOptions { max_iterations: 2, ..Default::default() };
    let failure = failure_of(options, Box::new(DenseLu::default()), &mut problem, &[-1.2, 1.0]);
    let message = failure.to_string();
    for part in ["limit of 2 iterations", "After 2 iterations", "of the first", "component "] {
        assert!(message.contains(part), "{message}");
    }
    assert!(failure.worst.len() == 2 && failure.worst[0].residual.abs() >= failure.worst[1].residual.abs());
    let last = failure.history[2].residual;
    let worst = failure.worst.iter().map(|worst| worst.residual * worst.residual).sum::<f64>().sqrt();
    assert!((worst / last - 1.0).abs() < 1e-12, "the worst unknowns are those of the last point");
}
