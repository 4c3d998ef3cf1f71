//! Tangent policies, forcing, merit, monitor and counts: what each choice costs and what it reaches.

#[path = "nonlinear/support.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;
#[path = "nonlinear/test_functions.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod test_functions;

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use nicolson_solvers::linear::Symmetry;
use nicolson_solvers::nonlinear::{
    Convergence, Forcing, Globalisation, IterationRecord, Merit, NewtonFailure, NewtonMonitor, NewtonOptions,
    NewtonReport, NewtonSolver, SecantUpdate, TangentCause, TangentPolicy,
};
use support::{DenseLu, Dual, Equations, Fault, Faulty, constant, globalisations, logarithm};
use test_functions::{broyden_tridiagonal, discrete_boundary_value, rosenbrock};

fn solver(options: NewtonOptions) -> NewtonSolver {
    NewtonSolver::new(options, Box::new(DenseLu::default()))
}

fn with_tangent(tangent: TangentPolicy) -> NewtonOptions {
    NewtonOptions { tangent, ..Default::default() }
}

fn solve(solver: &mut NewtonSolver, problem: &mut Equations, y: &mut [f64]) -> NewtonReport {
    solver.solve(problem, y).unwrap_or_else(|failure| panic!("{failure}\n{:#?}", failure.history))
}

/// `A y = b` with a fixed matrix.
fn linear(b: f64) -> Equations {
    let mut problem = Equations::new(3, move |y| {
        vec![y[0] * 4.0 - y[1] - b, y[1] * 5.0 - y[0] - y[2] * 2.0 - b * b, y[2] * 3.0 - y[1] * 2.0 + y[0] * 0.1 + 1.0]
    });
    problem.key = Some(42);
    problem
}

/// A mildly nonlinear system that depends on time: `y + ε y³ = g(t)`, coupled like a chain.
fn chain(t: f64, strength: f64) -> Equations {
    Equations::new(6, move |y| {
        (0..6)
            .map(|i| {
                let left = if i > 0 { y[i - 1] } else { constant(0.0) };
                let right = if i < 5 { y[i + 1] } else { constant(0.0) };
                y[i] * 3.0 - left - right + y[i].cube() * strength - (t + i as f64).sin()
            })
            .collect()
    })
}

/// A tangent policy that spans solves needs one problem that lives as long.
fn set(problem: &mut Equations, t: f64, strength: f64) {
    problem.function = chain(t, strength).function;
}

#[test]
fn newton_converges_quadratically() {
    for globalisation in globalisations() {
        let options = NewtonOptions { relative_tolerance: 1e-14, globalisation, ..Default::default() };
        let report = solve(&mut solver(options), &mut logarithm(), &mut [1.3]);
        let order = report.observed_order().expect("four points");
        assert!((order - 2.0).abs() < 0.15, "{globalisation:?}: {order}");
    }
}

/// Corrections after convergence reuse the last factor, count as iterations, and end where rounding does.
#[test]
fn final_corrections_go_beyond_convergence_without_a_factorisation() {
    let report = |final_corrections: usize| {
        let options = NewtonOptions { relative_tolerance: 1e-3, final_corrections, ..Default::default() };
        solve(&mut solver(options), &mut chain(0.3, 0.5), &mut [0.0; 6])
    };
    let plain = report(0);
    let residual = |report: &NewtonReport| report.history.last().expect("a history").residual;
    let mut before = residual(&plain);
    for count in 1..4 {
        let corrected = report(count);
        assert_eq!(corrected.iterations, plain.iterations + count);
        assert_eq!(corrected.work.linearisations, plain.work.linearisations);
        assert_eq!(corrected.convergence, plain.convergence);
        // Linear convergence: the factor is that of the last iteration.
        assert!(residual(&corrected) < 0.1 * before, "{} after {before}", residual(&corrected));
        before = residual(&corrected);
    }
    // No further than rounding, whatever is allowed.
    let most = report(1000);
    assert!(most.iterations < plain.iterations + 30 && residual(&most) < 1e-14, "{most:?}");
    // A start that is exact, and a linear problem, need none.
    let options = NewtonOptions { final_corrections: 5, ..Default::default() };
    assert_eq!(solve(&mut solver(options.clone()), &mut linear(1.0), &mut [0.0; 3]).iterations, 1);
    let mut exact = [1.0];
    assert_eq!(solve(&mut solver(options), &mut logarithm(), &mut exact).iterations, 0);
}

#[test]
fn a_linear_problem_takes_one_iteration_and_one_factorisation_for_ever() {
    for (tangent, globalisation) in [
        (TangentPolicy::Full, Globalisation::None),
        (TangentPolicy::Full, Globalisation::Backtracking),
        (TangentPolicy::Full, Globalisation::MoreThuente),
        (TangentPolicy::Full, Globalisation::HagerZhang),
        (TangentPolicy::Full, Globalisation::TrustRegion { initial_radius: None }),
        (TangentPolicy::Modified, Globalisation::Backtracking),
        (TangentPolicy::lagged(), Globalisation::None),
        (TangentPolicy::broyden(), Globalisation::Backtracking),
    ] {
        let mut solver = solver(NewtonOptions { tangent, globalisation, ..Default::default() });
        for step in 0..60 {
            // Every step is another object with the same key.
            let mut problem = linear(f64::from(step) - 20.0);
            solver.new_step();
            let mut y = [0.0; 3];
            let report = solve(&mut solver, &mut problem, &mut y);
            assert_eq!((report.iterations, problem.residuals), (1, 2), "{tangent:?} {globalisation:?}");
            assert_eq!(report.history.len(), 2);
        }
        assert_eq!(solver.totals().factorisations.total(), 1);
        assert_eq!(solver.totals().factorisations.get(TangentCause::First), 1);
        assert_eq!(solver.linear().counts().factorisations, 1);
    }
}

#[test]
fn another_key_another_size_and_forgetting_cost_a_factorisation() {
    let mut solver = solver(NewtonOptions::default());
    let factorisations = |solver: &mut NewtonSolver, mut problem: Equations| {
        let mut y = vec![0.0; problem.tangent.size];
        solve(solver, &mut problem, &mut y);
        solver.totals().factorisations.total()
    };
    assert_eq!(factorisations(&mut solver, linear(1.0)), 1);
    assert_eq!(factorisations(&mut solver, linear(2.0)), 1);
    assert_eq!(factorisations(&mut solver, Equations { key: Some(43), ..linear(3.0) }), 2);
    let other_size = Equations { key: Some(43), ..Equations::new(1, |y| vec![y[0] * 2.0 - 1.0]) };
    assert_eq!(factorisations(&mut solver, other_size), 3);
    assert_eq!(factorisations(&mut solver, linear(4.0)), 4);
    solver.forget();
    assert_eq!(factorisations(&mut solver, linear(5.0)), 5);
    assert_eq!(solver.totals().solves, 6);
}

#[test]
fn a_converged_start_costs_one_evaluation() {
    let mut problem = Equations::new(2, rosenbrock);
    let report = solve(&mut solver(NewtonOptions::default()), &mut problem, &mut [1.0, 1.0]);
    assert_eq!((report.iterations, report.convergence), (0, Convergence::Scale));
    assert_eq!((problem.residuals, problem.linearisations), (1, 0));
    assert_eq!(report.work.factorisations.total(), 0);
    assert_eq!((report.contraction(), report.residual()), (None, 0.0));
}

#[test]
fn the_last_evaluation_is_at_the_solution() {
    for globalisation in globalisations() {
        for merit in [Merit::Residual, Merit::Potential] {
            if matches!(globalisation, Globalisation::TrustRegion { .. }) && merit == Merit::Potential {
                continue;
            }
            for (mut problem, start) in [(logarithm(), vec![12.0]), (Equations::new(2, rosenbrock), vec![-1.2, 1.0])] {
                let mut y = start;
                solve(&mut solver(NewtonOptions { globalisation, merit, ..Default::default() }), &mut problem, &mut y);
                assert_eq!(problem.last_residual_at, y, "{globalisation:?}");
            }
        }
    }
}

#[test]
fn a_step_out_of_the_domain_is_too_long() {
    // From 12 the full Newton step leads to −17.8.
    for globalisation in globalisations() {
        let mut y = [12.0];
        let mut solver = solver(NewtonOptions { globalisation, ..Default::default() });
        let report = solve(&mut solver, &mut logarithm(), &mut y);
        assert!((y[0] - 1.0).abs() < 1e-8, "{globalisation:?}");
        assert!(report.history[1].trials > 1 && report.history[1].step_length < 1.0);
        assert!(report.work.line_search_steps > 0);
    }
}

#[test]
fn modified_newton_factors_once_per_step() {
    let mut solver = solver(with_tangent(TangentPolicy::Modified));
    let mut y = [0.0; 6];
    let mut problem = chain(0.0, 0.05);
    for step in 0..10 {
        solver.new_step();
        // Two stages per step share the factor.
        for stage in 0..2 {
            set(&mut problem, 0.1 * f64::from(step) + 0.05 * f64::from(stage), 0.05);
            let report = solve(&mut solver, &mut problem, &mut y);
            assert_eq!(report.work.factorisations.total(), usize::from(stage == 0));
            assert!(report.iterations > 1);
        }
    }
    assert_eq!(solver.totals().factorisations.get(TangentCause::NewStep), 9);
    assert_eq!(solver.totals().factorisations.total(), 10);
}

#[test]
fn a_lagged_tangent_lives_over_steps_and_is_renewed_when_it_contracts_poorly() {
    let mut solver = solver(with_tangent(TangentPolicy::Lagged { contraction: 0.1, steps: 1000 }));
    let mut y = [0.0; 6];
    let mut problem = chain(0.0, 0.02);
    for step in 0..20 {
        solver.new_step();
        set(&mut problem, 0.05 * f64::from(step), 0.02);
        solve(&mut solver, &mut problem, &mut y);
    }
    assert_eq!(solver.totals().factorisations.total(), 1);
    // Now the problem becomes strongly nonlinear.
    for step in 20..30 {
        solver.new_step();
        set(&mut problem, 0.05 * f64::from(step), 20.0);
        solve(&mut solver, &mut problem, &mut y);
    }
    let counts = solver.totals().factorisations;
    assert!(counts.get(TangentCause::SlowContraction) > 0, "{counts:?}");
    assert!(counts.total() < solver.totals().iterations / 2, "{counts:?}");
    assert_eq!(counts.iter().map(|(_, count)| count).sum::<usize>(), counts.total());
}

#[test]
fn a_lagged_tangent_has_a_largest_age() {
    let mut solver = solver(with_tangent(TangentPolicy::Lagged { contraction: 0.5, steps: 5 }));
    let mut y = [0.0; 6];
    let mut problem = chain(0.0, 0.02);
    for step in 0..20 {
        solver.new_step();
        set(&mut problem, 0.05 * f64::from(step), 0.02);
        solve(&mut solver, &mut problem, &mut y);
    }
    assert_eq!(solver.totals().factorisations.get(TangentCause::Age), 3);
}

#[test]
fn a_stale_tangent_is_renewed_before_anything_fails() {
    for tangent in
        [TangentPolicy::Modified, TangentPolicy::lagged(), TangentPolicy::broyden(), TangentPolicy::limited_bfgs()]
    {
        for globalisation in [Globalisation::None, Globalisation::Backtracking, Globalisation::MoreThuente] {
            let mut solver = solver(NewtonOptions { tangent, globalisation, ..Default::default() });
            let mut y = [1.2];
            let mut problem = logarithm();
            solve(&mut solver, &mut problem, &mut y);
            // The kept factor has the wrong sign for the mirrored problem.
            problem.function = Box::new(|x: &[Dual]| vec![constant(0.5) - x[0].ln()]);
            let report = solve(&mut solver, &mut problem, &mut y);
            assert!((y[0] - 0.5_f64.exp()).abs() < 1e-7, "{tangent:?} {globalisation:?}");
            assert!(report.work.rejected_steps > 0 && report.work.factorisations.total() > 0);
            let causes: Vec<_> = report.work.factorisations.iter().map(|(cause, _)| cause).collect();
            let expected = [TangentCause::Increase, TangentCause::LineSearch];
            assert!(causes.iter().any(|cause| expected.contains(cause)), "{causes:?}");
        }
    }
}

#[test]
fn a_linear_solve_that_fails_with_a_stale_factor_is_tried_again_with_a_fresh_one() {
    let faulty = Box::new(Faulty::new(Fault::Solve(3)));
    let mut solver = NewtonSolver::new(with_tangent(TangentPolicy::Modified), faulty);
    let report = solve(&mut solver, &mut chain(0.3, 0.2), &mut [0.0; 6]);
    assert_eq!(report.work.factorisations.get(TangentCause::LinearSolve), 1);
    // Also for the kept factor of a linear problem.
    let mut solver = NewtonSolver::new(NewtonOptions::default(), Box::new(Faulty::new(Fault::Solve(2))));
    solve(&mut solver, &mut linear(1.0), &mut [0.0; 3]);
    let report = solve(&mut solver, &mut linear(2.0), &mut [0.0; 3]);
    assert_eq!(report.work.factorisations.get(TangentCause::LinearSolve), 1);
}

#[test]
fn secant_updates_around_one_factor_beat_the_factor_alone() {
    let mut iterations = Vec::new();
    for tangent in [
        TangentPolicy::Lagged { contraction: 0.999, steps: 1000 },
        TangentPolicy::broyden(),
        TangentPolicy::QuasiNewton { update: SecantUpdate::Broyden, memory: 2, contraction: 0.95, steps: 1000 },
        TangentPolicy::limited_bfgs(),
    ] {
        // Symmetric and mildly nonlinear; the factor is that of the start.
        let mut problem = chain(0.4, 1.0);
        problem.tangent.symmetry = Symmetry::PositiveDefinite;
        let options = NewtonOptions { max_iterations: 60, relative_tolerance: 1e-10, ..with_tangent(tangent) };
        let mut solver = solver(options);
        let report = solve(&mut solver, &mut problem, &mut [0.6; 6]);
        assert_eq!(report.work.factorisations.total(), 1, "{tangent:?}");
        iterations.push(report.iterations);
    }
    assert!(iterations[1] < iterations[0] && iterations[3] < iterations[0], "{iterations:?}");
}

#[test]
fn quasi_newton_solves_the_standard_problems_with_one_factorisation() {
    let tridiagonal = (Equations::new(10, broyden_tridiagonal), vec![-1.0; 10]);
    let grid: Vec<f64> = (1..=10).map(|j| f64::from(j) / 11.0).map(|t| t * (t - 1.0)).collect();
    let boundary_value = (Equations::new(10, discrete_boundary_value), grid);
    for (mut problem, start) in [tridiagonal, boundary_value] {
        let report = solve(&mut solver(with_tangent(TangentPolicy::broyden())), &mut problem, &mut start.clone());
        assert_eq!(report.work.factorisations.total(), 1);
    }
}

/// Solves with linear solves that are exactly as accurate as asked.
fn inexact(forcing: Forcing) -> NewtonReport {
    let options = NewtonOptions { forcing, relative_tolerance: 1e-10, max_iterations: 60, ..Default::default() };
    let mut solver = NewtonSolver::new(options, Box::new(Faulty::new(Fault::Inexact)));
    solve(&mut solver, &mut chain(0.4, 1.0), &mut [0.6; 6])
}

#[test]
fn a_constant_forcing_term_is_the_rate_of_convergence() {
    let report = inexact(Forcing::Constant(0.1));
    assert!((report.contraction().expect("several") - 0.1).abs() < 0.02);
    assert!(report.history[1..].iter().all(|record| record.forcing == 0.1 && record.linear_iterations == 7));
    assert_eq!(report.work.linear_iterations, 7 * report.iterations);
}

#[test]
fn eisenstat_and_walker_tighten_towards_the_solution_and_do_not_oversolve() {
    for forcing in [Forcing::eisenstat_walker_1(), Forcing::eisenstat_walker_2()] {
        let report = inexact(forcing);
        let etas: Vec<f64> = report.history[1..].iter().map(|record| record.forcing).collect();
        assert_eq!(etas[0], 0.1);
        let smallest = etas.iter().copied().fold(1.0, f64::min);
        assert!(smallest < 1e-2, "{etas:?}");
        assert!(etas.iter().all(|eta| *eta <= 0.5));
        let last = &report.history[report.iterations - 1];
        let target = 1e-10 * report.history[0].residual;
        assert!(etas[report.iterations - 1] >= 0.5 * target / last.residual * 0.999, "{etas:?}");
        assert!(report.iterations < inexact(Forcing::Constant(0.1)).iterations);
    }
}

#[test]
fn a_linear_problem_takes_one_iteration_whatever_the_forcing() {
    let options = NewtonOptions { forcing: Forcing::Constant(0.1), ..Default::default() };
    let mut solver = NewtonSolver::new(options, Box::new(Faulty::new(Fault::Inexact)));
    assert_eq!(solve(&mut solver, &mut linear(1.0), &mut [0.0; 3]).iterations, 1);
}

/// `Φ = Σ (eʸ − a y) + ½ (y₁ − y₂)²`, convex.
fn convex() -> Equations {
    let potential = |y: &[f64]| y[0].exp() - 3.0 * y[0] + y[1].exp() - 0.1 * y[1] + 0.5 * (y[0] - y[1]).powi(2);
    Equations::new(2, |y| {
        let coupling = y[0] - y[1];
        vec![y[0].exp() - 3.0 + coupling, y[1].exp() - 0.1 - coupling]
    })
    .with_potential(potential)
}

#[test]
fn the_potential_is_the_merit_where_there_is_one() {
    for globalisation in [Globalisation::Backtracking, Globalisation::MoreThuente, Globalisation::HagerZhang] {
        let options = NewtonOptions { globalisation, merit: Merit::Potential, ..Default::default() };
        let report = solve(&mut solver(options.clone()), &mut convex(), &mut [-6.0, 5.0]);
        assert_eq!(report.history[1].merit, Merit::Potential);
        // Without a potential the history says that the residual was used.
        let report = solve(&mut solver(options), &mut Equations::new(2, rosenbrock), &mut [-1.2, 1.0]);
        assert_eq!(report.history[1].merit, Merit::Residual);
    }
}

#[test]
fn where_newton_does_not_descend_on_the_potential_the_residual_decides() {
    // Φ = ¼ (y² − 1)², concave at 0.1: Newton climbs towards the maximum at 0.
    let mut problem =
        Equations::new(1, |y| vec![y[0] * (y[0] * y[0] - 1.0)]).with_potential(|y| 0.25 * (y[0] * y[0] - 1.0).powi(2));
    let options = NewtonOptions { merit: Merit::Potential, ..Default::default() };
    let report = solve(&mut solver(options), &mut problem, &mut [0.1]);
    assert_eq!(report.history[1].merit, Merit::Residual);
}

#[test]
fn a_potential_drowned_in_rounding_gives_way_to_the_residual() {
    // A constant of 1e12 hides every decrease below 1e-4.
    let drowned = || Equations { potential: Some(Box::new(|y: &[f64]| 1e12 + y[0].exp() - y[0])), ..exponential() };
    let options = NewtonOptions { merit: Merit::Potential, ..Default::default() };
    let report = solve(&mut solver(options), &mut drowned(), &mut [2.0]);
    assert_eq!(report.history.last().map(|record| record.merit), Some(Merit::Residual));
}

fn exponential() -> Equations {
    Equations::new(1, |y| vec![y[0].exp() - 1.0])
}

#[test]
fn without_tolerances_the_precision_limit_ends_it() {
    let grid: Vec<f64> = (1..=10).map(|j| f64::from(j) / 11.0).map(|t| t * (t - 1.0)).collect();
    for globalisation in globalisations() {
        let options =
            NewtonOptions { globalisation, relative_tolerance: 0.0, scale_tolerance: 0.0, ..Default::default() };
        for (mut problem, mut y) in [
            (Equations::new(10, discrete_boundary_value), grid.clone()),
            (Equations::new(10, broyden_tridiagonal), vec![-1.0; 10]),
            (chain(0.4, 1.0), vec![0.6; 6]),
        ] {
            let report = solve(&mut solver(options.clone()), &mut problem, &mut y);
            let last = report.history.last().expect("a point");
            assert!(last.residual <= 1e-13 * last.scale, "{globalisation:?}");
            assert!(matches!(report.convergence, Convergence::PrecisionLimit | Convergence::Scale));
            assert_eq!(problem.last_residual_at, y);
        }
    }
}

#[derive(Default)]
struct Log {
    points: Vec<IterationRecord>,
    outcomes: Vec<bool>,
}

struct Recorder(Arc<Mutex<Log>>);

impl NewtonMonitor for Recorder {
    fn point(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        self.0.lock().expect("log").points.push(*record);
        ControlFlow::Continue(())
    }

    fn finished(&mut self, outcome: Result<&NewtonReport, &NewtonFailure>) {
        self.0.lock().expect("log").outcomes.push(outcome.is_ok());
    }
}

#[test]
fn the_monitor_receives_every_point_and_the_outcome() {
    let log = Arc::new(Mutex::new(Log::default()));
    let mut solver = solver(NewtonOptions::default());
    solver.set_monitor(Some(Box::new(Recorder(log.clone()))));
    let report = solve(&mut solver, &mut Equations::new(2, rosenbrock), &mut [-1.2, 1.0]);
    assert_eq!(log.lock().expect("log").points, report.history);
    solver.solve(&mut logarithm(), &mut [-1.0]).expect_err("outside");
    assert_eq!(log.lock().expect("log").outcomes, [true, false]);
    solver.set_monitor(None);
    solve(&mut solver, &mut Equations::new(2, rosenbrock), &mut [-1.2, 1.0]);
    assert_eq!(log.lock().expect("log").points.len(), report.history.len());
}

#[test]
fn totals_are_the_sum_of_the_reports() {
    let mut solver = solver(with_tangent(TangentPolicy::lagged()));
    let (mut iterations, mut residuals, mut linearisations, mut factorisations) = (0, 0, 0, 0);
    let mut problem = chain(0.0, 1.0);
    for step in 0..5 {
        solver.new_step();
        set(&mut problem, 0.3 * f64::from(step), 1.0);
        let report = solve(&mut solver, &mut problem, &mut [0.5; 6]);
        iterations += report.iterations;
        residuals += report.work.residual_evaluations;
        linearisations += report.work.linearisations;
        factorisations += report.work.factorisations.total();
    }
    assert_eq!((residuals, linearisations), (problem.residuals, problem.linearisations));
    let totals = solver.totals();
    assert_eq!((totals.iterations, totals.residual_evaluations), (iterations, residuals));
    assert_eq!((totals.linearisations, totals.factorisations.total()), (linearisations, factorisations));
    assert_eq!(totals.linear_solves, solver.linear().counts().solves);
    assert!(totals.factorisation_seconds > 0.0 && totals.solve_seconds > 0.0);
}

#[test]
fn the_same_problem_gives_the_same_bits() {
    for globalisation in globalisations() {
        let run = || {
            let mut y = [-1.2, 1.0];
            let options = NewtonOptions { globalisation, ..Default::default() };
            let report = solve(&mut solver(options), &mut Equations::new(2, rosenbrock), &mut y);
            (y.map(f64::to_bits), report.history)
        };
        assert_eq!(run(), run());
    }
}
