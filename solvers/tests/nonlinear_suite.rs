//! The systems of Moré, Garbow and Hillstrom (1981) from their standard starting points: which
//! globalisation solves which.
//!
//! Iterations / residual evaluations with the default options and at most 100 iterations; a dash is a
//! failure, whose cause is asserted below.
//!
//! | system (number in the paper) | none | backtracking | Moré–Thuente | Hager–Zhang | dogleg |
//! |---|---|---|---|---|---|
//! | Rosenbrock (1) | 2 / 3 | 14 / 27 | 12 / 54 | 15 / 118 | 17 / 26 |
//! | Freudenstein-Roth (2) | – | – | – | – | – |
//! | Powell badly scaled (3) | 12 / 13 | 51 / 95 | 30 / 112 | 26 / 175 | 39 / 43 |
//! | helical valley (7) | 10 / 11 | 9 / 12 | 9 / 20 | 9 / 24 | 10 / 13 |
//! | Powell singular (13) | 14 / 15 | 14 / 15 | 14 / 30 | 14 / 30 | 14 / 15 |
//! | Wood (14) | 13 / 14 | 16 / 23 | 14 / 33 | 14 / 53 | 18 / 23 |
//! | Watson (20), n = 6 | 12 / 13 | 34 / 63 | 20 / 65 | 23 / 157 | 20 / 23 |
//! | variably dimensioned (25), n = 10 | 13 / 14 | 13 / 14 | 13 / 26 | 13 / 26 | 13 / 14 |
//! | trigonometric (26), n = 10 | 7 / 8 | 9 / 15 | 9 / 26 | 8 / 63 | 9 / 12 |
//! | Brown almost linear (27), n = 10 | – | – | 10 / 48 | – | 13 / 19 |
//! | discrete boundary value (28), n = 10 | 3 / 4 | 3 / 4 | 3 / 4 | 3 / 4 | 3 / 4 |
//! | discrete integral (29), n = 10 | 3 / 4 | 3 / 4 | 3 / 4 | 3 / 4 | 3 / 4 |
//! | Broyden tridiagonal (30), n = 10 | 4 / 5 | 4 / 5 | 4 / 6 | 4 / 6 | 4 / 5 |
//! | Broyden banded (31), n = 10 | 5 / 6 | 5 / 6 | 5 / 8 | 5 / 8 | 5 / 6 |
//! | Chebyquad (35), n = 5 | 5 / 6 | 6 / 9 | 5 / 10 | 5 / 13 | 5 / 7 |
//! | Chebyquad (35), n = 7 | – | 8 / 12 | 6 / 17 | 6 / 34 | 6 / 8 |
//! | Chebyquad (35), n = 8 | – | – | – | – | – |
//!
//! What it says. No method is best everywhere. The full step needs the fewest evaluations on most, but
//! it runs away on Brown's function and on Chebyquad 7; on badly scaled valleys (Rosenbrock, Powell 3,
//! Watson) every insistence on decrease costs iterations. The dogleg and Moré–Thuente solve the most, 15
//! of 17. The Wolfe searches pay a second evaluation per iteration for the slope even where the full step
//! is good, and Hager–Zhang many more where it is not.
//!
//! The dashes. Chebyquad 8 has no zero, and none is found. On Freudenstein and Roth the dogleg ends in
//! the local minimum ‖R‖ = 6.999 that the problem is known for; the line searches end before it, at
//! ‖R‖ ≈ 7.6, where the tangent is nearly singular and the Newton direction hardly descends. On Brown's
//! function backtracking meets a tangent that cannot be solved with accurately, and Hager–Zhang stagnates.
//! Full steps would solve Freudenstein–Roth in 42 and Brown in 90 iterations, after an excursion to 1e27
//! times the first residual: the default tests for stagnation and divergence do not wait for that.

#[path = "nonlinear/support.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;
#[path = "nonlinear/test_functions.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod test_functions;

use nicolson_solvers::nonlinear::{
    Globalisation, NewtonCause, NewtonOptions, NewtonSolver, NonlinearProblem, TangentPolicy,
};
use nicolson_solvers::vector::norm;
use support::{DenseLu, globalisations};
use test_functions::{TestFunction, all};

fn options() -> NewtonOptions {
    NewtonOptions { max_iterations: 100, ..Default::default() }
}

/// Solves and checks the outcome; `None` is a failure with an honest cause.
fn outcome(case: &TestFunction, options: NewtonOptions) -> Option<(usize, usize)> {
    let mut problem = case.problem();
    let mut y = case.start.clone();
    let mut solver = NewtonSolver::new(options, Box::new(DenseLu::default()));
    match solver.solve(&mut problem, &mut y) {
        Ok(report) => {
            let mut residual = vec![0.0; y.len()];
            let scale = problem.residual(&y, &mut residual).expect("admissible");
            let target = (1e-8 * report.history[0].residual).max(1e-12 * scale);
            assert!(norm(&residual) <= target, "{}: not a solution", case.name);
            Some((report.iterations, report.work.residual_evaluations))
        }
        Err(failure) => {
            assert_eq!(y, case.start, "{}", case.name);
            assert_eq!(failure.history.len(), failure.work.iterations + 1);
            let honest = matches!(
                failure.cause,
                NewtonCause::Stagnation { .. }
                    | NewtonCause::Divergence { .. }
                    | NewtonCause::LineSearch { .. }
                    | NewtonCause::LinearSolve(_)
            );
            assert!(honest, "{}: {failure}", case.name);
            None
        }
    }
}

#[test]
fn which_globalisation_solves_which() {
    // In the order of `globalisations`; the others are solved by all.
    let unsolved = [
        ("Freudenstein-Roth (2)", [true; 5]),
        ("Brown almost linear (27), n = 10", [true, true, false, true, false]),
        ("Chebyquad (35), n = 7", [true, false, false, false, false]),
        ("Chebyquad (35), n = 8", [true; 5]),
    ];
    let mut solved = 0;
    for case in all() {
        let expected = unsolved.iter().find(|(name, _)| *name == case.name).map_or([false; 5], |(_, fails)| *fails);
        for (globalisation, fails) in globalisations().into_iter().zip(expected) {
            let outcome = outcome(&case, NewtonOptions { globalisation, ..options() });
            assert_eq!(outcome.is_none(), fails, "{} with {globalisation:?}", case.name);
            solved += usize::from(outcome.is_some());
        }
    }
    assert_eq!(solved, 71);
}

#[test]
fn full_steps_solve_two_more_for_those_who_wait() {
    let patient =
        NewtonOptions { globalisation: Globalisation::None, stagnation: 100, divergence: f64::INFINITY, ..options() };
    for case in all() {
        if case.name.starts_with("Freudenstein") || case.name.starts_with("Brown") {
            assert!(outcome(&case, patient.clone()).is_some(), "{}", case.name);
        }
    }
}

#[test]
fn the_dogleg_ends_in_the_known_local_minimum_of_freudenstein_and_roth() {
    let cases = all();
    let case = cases.iter().find(|case| case.name.starts_with("Freudenstein")).expect("a case");
    let globalisation = Globalisation::TrustRegion { initial_radius: None };
    let mut solver = NewtonSolver::new(NewtonOptions { globalisation, ..options() }, Box::new(DenseLu::default()));
    let failure = solver.solve(&mut case.problem(), &mut case.start.clone()).expect_err("no zero is reached");
    // The paper: the sum of squares is 48.9842 there.
    let last = failure.history.last().expect("a point").residual;
    assert!((last * last - 48.984_25).abs() < 1e-3, "{last}");
}

#[test]
fn stale_tangents_lose_nothing() {
    // Whatever full Newton solves, the policies that keep tangents must solve too: they may only be
    // slower, since a stale tangent never decides about failure.
    for case in all() {
        if outcome(&case, options()).is_none() {
            continue;
        }
        for tangent in [TangentPolicy::Modified, TangentPolicy::lagged(), TangentPolicy::broyden()] {
            let kept = outcome(&case, NewtonOptions { tangent, ..options() });
            assert!(kept.is_some(), "{} with {tangent:?}", case.name);
        }
    }
}

/// Prints the table of the head of this file.
#[test]
#[ignore = "writes the table for the documentation"]
fn print_the_table() {
    for case in all() {
        let row: Vec<String> = globalisations()
            .into_iter()
            .map(|globalisation| match outcome(&case, NewtonOptions { globalisation, ..options() }) {
                Some((iterations, evaluations)) => format!("{iterations} / {evaluations}"),
                None => "–".to_string(),
            })
            .collect();
        let line = format!("//! | {} | {} |\n", case.name, row.join(" | "));
        std::io::Write::write_all(&mut std::io::stdout(), line.as_bytes()).expect("stdout");
    }
}
