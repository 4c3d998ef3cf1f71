//! The systems of Moré, Garbow and Hillstrom (1981) from their standard starting points: which
//! globalisation solves which.
//!
//! Iterations / residual evaluations with the default options and at most 100 iterations; a dash is a
//! failure, whose cause is asserted below.
//!
//! TABLE
//!
//! What the table says. Where the full Newton step works it is the cheapest, but it runs away on Brown's
//! function and on Chebyquad 7. The dogleg is the most robust at the price of a plain backtracking.
//! The Wolfe searches pay two or three evaluations per iteration and are worth it only far away. Nobody
//! reaches the zero of Freudenstein and Roth, since all that decrease ‖R‖ end in its local minimum (which
//! that problem is famous for), and nobody invents one for Chebyquad 8, which has none.

#[path = "nonlinear/support.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod support;
#[path = "nonlinear/test_functions.rs"]
#[allow(dead_code, reason = "every test program uses a part of it")]
mod test_functions;

use nicolson_solvers::nonlinear::{NewtonCause, NewtonOptions, NewtonSolver, NonlinearProblem, TangentPolicy};
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
