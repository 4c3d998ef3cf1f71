//! The contract of the linear seam, for every solver × preconditioner: the tolerance is honoured by the
//! true residual, or there is an error that says why; never NaN, never a panic.

mod linear_support;

use linear_support::*;
use nicolson_solvers::linear::{LinearError, LinearReport, LinearSolverChoice, Symmetry, Tangent};

const TOLERANCE: f64 = 1e-9;

/// Prepares and solves; an `Ok` is checked against the true residual.
fn attempt(choice: &LinearSolverChoice, matrix: &Matrix, b: &[f64]) -> Result<(LinearReport, Vec<f64>), LinearError> {
    let mut solver = choice.build();
    let mut x = vec![f64::NAN; b.len()];
    solver.prepare(matrix)?;
    let report = solver.solve(matrix, b, &mut x, TOLERANCE)?;
    assert!(x.iter().all(|x| x.is_finite()), "{choice:?}");
    if b.iter().any(|&b| b != 0.0) {
        let residual = matrix.relative_residual(b, &x);
        assert!(residual <= 1.01 * TOLERANCE, "{choice:?}: {residual:e}");
    }
    Ok((report, x))
}

/// The residual that an error tells must be a number.
fn check_error(choice: &LinearSolverChoice, error: &LinearError) {
    assert!(!format!("{error}").contains("NaN"), "{choice:?}: {error}");
}

#[test]
fn positive_definite_systems_are_solved_by_all() {
    let matrix = grid(12, 2.4, 0.5, 0.0);
    let b = right_hand_side(matrix.size());
    let (_, reference) = attempt(&LinearSolverChoice::Lu, &matrix, &b).expect("solved");
    for choice in all_solvers() {
        let (report, x) = attempt(&choice, &matrix, &b).unwrap_or_else(|e| panic!("{choice:?}: {e}"));
        assert!(report.relative_residual <= TOLERANCE);
        assert!(x.iter().zip(&reference).all(|(x, r)| (x - r).abs() < 1e-6), "{choice:?}");
    }
}

#[test]
fn indefinite_systems_are_solved_or_named_not_positive_definite() {
    let matrix = grid(12, 2.4, -0.4, 0.0);
    let b = right_hand_side(matrix.size());
    for choice in all_solvers() {
        match attempt(&choice, &matrix, &b) {
            Ok(_) => assert!(!needs_definiteness(&choice), "{choice:?}"),
            Err(LinearError::NotPositiveDefinite { value, .. }) => {
                // MINRES itself does not mind, but its preconditioner must be definite.
                let minres = matches!(choice, LinearSolverChoice::Minres { .. });
                assert!(needs_definiteness(&choice) || minres, "{choice:?}");
                assert!(value < 0.0);
            }
            // Incomplete factors of an indefinite matrix promise nothing.
            Err(error) => {
                assert!(matches!(
                    choice,
                    LinearSolverChoice::BiCgStab { .. }
                        | LinearSolverChoice::Gmres { .. }
                        | LinearSolverChoice::Minres { .. }
                ));
                assert!(matches!(error, LinearError::IterationLimit { .. } | LinearError::Breakdown { .. }));
                check_error(&choice, &error);
            }
        }
    }
    for choice in [LinearSolverChoice::Lu, LinearSolverChoice::ldlt()] {
        attempt(&choice, &matrix, &b).expect("solved");
    }
}

#[test]
fn unsymmetric_systems_are_solved_or_refused() {
    let matrix = grid(12, 2.4, 0.5, 0.15);
    let b = right_hand_side(matrix.size());
    for choice in all_solvers() {
        match attempt(&choice, &matrix, &b) {
            Ok(_) => assert!(!needs_symmetry(&choice), "{choice:?}"),
            Err(LinearError::NeedsSymmetry { .. }) => assert!(needs_symmetry(&choice), "{choice:?}"),
            Err(error) => panic!("{choice:?}: {error}"),
        }
    }
}

#[test]
fn badly_scaled_systems_are_solved_or_reported() {
    let scale = |i: usize| 10.0_f64.powf(3.0 * scatter(i as u64));
    for skew in [0.0, 0.15] {
        let matrix = grid(12, 2.4, 0.5, skew).map(|i, j, v| v * scale(i) * scale(j));
        let mut b = vec![0.0; matrix.size()];
        matrix.apply(&vec![1.0; b.len()], &mut b);
        for choice in all_solvers().iter().filter(|c| skew == 0.0 || !needs_symmetry(c)) {
            let result = attempt(choice, &matrix, &b);
            if let Err(error) = &result {
                check_error(choice, error);
            }
            // Without a preconditioner that sees the scales, there is little hope.
            let blind = format!("{choice:?}").contains("preconditioner: None");
            assert!(result.is_ok() || blind, "{choice:?}: {result:?}");
        }
    }
}

#[test]
fn singular_systems_are_reported_by_all() {
    let floating = grid(10, 2.4, 0.0, 0.0);
    let zero = floating.map(|_, _, _| 0.0);
    let rank_one = Matrix::new(6, Symmetry::Symmetric, (0..36).map(|k| (k / 6, k % 6, 1.0)));
    let row = [(0, 0, 2.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 2.0), (2, 0, 1.0), (2, 1, 1.0)];
    let empty_column = Matrix::new(3, Symmetry::General, row);
    let zero_row = Matrix::new(3, Symmetry::Symmetric, row.into_iter().take(4).chain([(2, 2, 0.0)]));
    for (name, matrix) in [
        ("floating", floating),
        ("zero", zero),
        ("rank one", rank_one),
        ("empty column", empty_column),
        ("zero row", zero_row),
    ] {
        let b = right_hand_side(matrix.size());
        for choice in all_solvers() {
            let error = attempt(&choice, &matrix, &b).err().unwrap_or_else(|| panic!("{name}: {choice:?}"));
            check_error(&choice, &error);
            if matches!(choice, LinearSolverChoice::Lu) {
                assert!(matches!(error, LinearError::Singular { .. }), "{name}: {choice:?}: {error:?}");
            }
            if direct_solvers().contains(&choice) && matrix.symmetry != Symmetry::General {
                assert!(matches!(error, LinearError::Singular { .. }), "{name}: {choice:?}: {error:?}");
            }
        }
    }
}

#[test]
fn entries_that_are_not_finite_are_found() {
    for bad in [f64::NAN, f64::INFINITY] {
        let mut matrix = grid(6, 2.4, 0.5, 0.0);
        let k = matrix.pattern.offsets()[17] + 2;
        matrix.values[k] = bad;
        let b = right_hand_side(matrix.size());
        for choice in all_solvers() {
            let error = attempt(&choice, &matrix, &b).expect_err("not finite");
            assert_eq!(error, LinearError::EntryNotFinite { row: 17 }, "{choice:?}");
        }
    }
}

#[test]
fn wrong_vectors_are_refused() {
    let matrix = grid(5, 2.4, 0.5, 0.0);
    let n = matrix.size();
    let b = right_hand_side(n);
    for choice in all_solvers() {
        let mut solver = choice.build();
        let mut x = vec![0.0; n];
        assert_eq!(solver.solve(&matrix, &b, &mut x, TOLERANCE), Err(LinearError::NotPrepared));
        solver.prepare(&matrix).expect("regular");
        let wrong = Err(LinearError::WrongLength { expected: n, found: n - 1 });
        assert_eq!(solver.solve(&matrix, &b[1..], &mut x, TOLERANCE), wrong);
        assert_eq!(solver.solve(&matrix, &b, &mut x[1..], TOLERANCE), wrong);
        let other = grid(4, 2.4, 0.5, 0.0);
        let wrong = Err(LinearError::WrongLength { expected: n, found: 32 });
        assert_eq!(solver.solve(&other, &b, &mut x, TOLERANCE), wrong);
        let mut bad = b.clone();
        bad[3] = f64::NAN;
        let wrong = Err(LinearError::RightHandSideNotFinite { row: 3 });
        assert_eq!(solver.solve(&matrix, &bad, &mut x, TOLERANCE), wrong);
        // A tolerance that is no number is met by nothing.
        solver.solve(&matrix, &b, &mut x, f64::NAN).expect_err("no tolerance");
        // None of this spoils the solver.
        solver.solve(&matrix, &b, &mut x, TOLERANCE).expect("solved");
        assert!(matrix.relative_residual(&b, &x) <= TOLERANCE);
    }
}

#[test]
fn extreme_right_hand_sides_and_sizes() {
    let matrix = grid(5, 2.4, 0.5, 0.0);
    let one = Matrix::dense(Symmetry::PositiveDefinite, &[&[4.0]]);
    let none = Matrix::new(0, Symmetry::PositiveDefinite, []);
    for choice in all_solvers() {
        let (report, x) = attempt(&choice, &matrix, &[0.0; 50]).expect("solved");
        assert_eq!((report.iterations, report.relative_residual), (0, 0.0));
        assert!(x.iter().all(|&x| x == 0.0));
        for size in [1e-250, 1e250] {
            let b: Vec<f64> = right_hand_side(50).iter().map(|b| b * size).collect();
            attempt(&choice, &matrix, &b).unwrap_or_else(|e| panic!("{choice:?} at {size:e}: {e}"));
        }
        let (_, x) = attempt(&choice, &one, &[2.0]).expect("solved");
        assert!((x[0] - 0.5).abs() < 1e-9);
        attempt(&choice, &none, &[]).expect("nothing to solve");
    }
}

#[test]
fn solvers_describe_themselves_and_their_work() {
    let matrix = grid(6, 2.4, 0.5, 0.0);
    let b = right_hand_side(matrix.size());
    let mut names = std::collections::BTreeSet::new();
    // What chooses for itself goes by the name of its choice, and keeps factors.
    let named = all_solvers().into_iter().filter(|choice| !matches!(choice, LinearSolverChoice::Automatic(_)));
    for choice in named {
        let mut solver = choice.build();
        assert_eq!(solver.info().unknowns, 0);
        let mut x = vec![0.0; b.len()];
        for k in 0..3 {
            let changed = matrix.map(|_, _, v| v * (1.0 + 0.1 * f64::from(k)));
            solver.prepare(&changed).expect("regular");
            let report = solver.solve(&changed, &b, &mut x, TOLERANCE).expect("solved");
            assert!((report.relative_residual - changed.relative_residual(&b, &x)).abs() < 1e-12);
        }
        let (info, counts) = (solver.info(), solver.counts());
        let bare = format!("{choice:?}").contains("preconditioner: None");
        assert!(names.insert(info.name.clone()), "{info:?}");
        assert_eq!(info.unknowns, matrix.size());
        assert_eq!(info.entries > 0, !bare, "{info:?}");
        assert_eq!(info.fill > 0, !bare, "{info:?}");
        assert!(info.threads >= 1);
        assert_eq!(counts.solves, 3);
        assert_eq!(counts.factorisations, if bare { 0 } else { 3 }, "{info:?}");
        assert!(counts.analyses <= 1, "{info:?}");
        assert_eq!(counts.iterations == 0, direct_solvers().contains(&choice), "{info:?}");
    }
}

#[test]
fn a_stale_preparation_still_honours_the_tolerance() {
    let matrix = grid(12, 2.4, 0.5, 0.0);
    let moved = matrix.map(|i, j, v| v * (1.0 + 0.05 * scatter((i * j + i + j) as u64)));
    let b = right_hand_side(matrix.size());
    for choice in all_solvers() {
        let mut solver = choice.build();
        let mut x = vec![0.0; b.len()];
        solver.prepare(&matrix).expect("regular");
        solver.solve(&moved, &b, &mut x, TOLERANCE).unwrap_or_else(|e| panic!("{choice:?}: {e}"));
        assert!(moved.relative_residual(&b, &x) <= 1.01 * TOLERANCE, "{choice:?}");
    }
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let matrix = grid(50, 2.4, 0.5, 0.0);
    let b = right_hand_side(matrix.size());
    for choice in [
        LinearSolverChoice::ldlt(),
        LinearSolverChoice::cg(),
        LinearSolverChoice::minres(),
        LinearSolverChoice::gmres(),
    ] {
        let solve = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| attempt(&choice, &matrix, &b).expect("solved").1)
        };
        let reference = solve(1);
        for threads in [2, 5] {
            assert!(solve(threads).iter().zip(&reference).all(|(x, r)| x.to_bits() == r.to_bits()), "{choice:?}");
        }
    }
}
