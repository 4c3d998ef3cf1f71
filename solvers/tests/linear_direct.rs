//! The direct solvers at real sizes, and where faer alone would answer with NaN or not at all.

mod linear_support;

use std::sync::Arc;

use linear_support::{Matrix, direct_solvers, grid, right_hand_side, scatter};
use nicolson_solvers::linear::{
    EliminationOrder, LinearError, LinearSolver, LinearSolverChoice, SparseLdlt, SparseLu, Symmetry, Tangent,
};

#[test]
fn a_two_ring_grid_is_solved_to_rounding() {
    let matrix = grid(34, 2.4 * 2.0, 0.05, 0.2);
    let n = 2 * 34 * 34;
    let b = right_hand_side(n);
    let mut x = vec![f64::NAN; n];
    let mut solver = LinearSolverChoice::Lu.build();
    solver.prepare(&matrix).expect("regular");
    let report = solver.solve(&matrix, &b, &mut x, 1e-12).expect("solved");
    assert!(matrix.relative_residual(&b, &x) <= 1e-12);
    assert_eq!(report.iterations, 0);
    let info = solver.info();
    assert_eq!(info.unknowns, n);
    assert_eq!(info.entries, matrix.values.len());
    assert!(info.fill >= info.entries && info.fill < n * n, "{info:?}");
}

#[test]
fn the_symmetric_two_ring_grid_is_solved_to_rounding_by_all() {
    let matrix = grid(34, 2.4 * 2.0, 0.05, 0.0);
    let n = matrix.size();
    let b = right_hand_side(n);
    let mut x = vec![f64::NAN; n];
    let mut fills = Vec::new();
    for choice in direct_solvers() {
        let mut solver = choice.build();
        solver.prepare(&matrix).expect("regular");
        let report = solver.solve(&matrix, &b, &mut x, 1e-12).expect("solved");
        assert!(matrix.relative_residual(&b, &x) <= 1e-12);
        assert_eq!(report.iterations, 0, "{choice:?}");
        fills.push(solver.info().fill);
    }
    assert!(fills[1] < fills[0], "LDLT fills in less than LU: {fills:?}");
}

#[test]
fn dense_elimination_agrees() {
    use faer::prelude::Solve;
    let matrix = grid(6, 2.4, 0.1, 0.3);
    let n = matrix.size();
    let b = right_hand_side(n);
    let mut dense = faer::Mat::<f64>::zeros(n, n);
    for row in 0..n {
        for (k, &column) in matrix.pattern.row(row).iter().enumerate() {
            dense[(row, column)] = matrix.values[matrix.pattern.offsets()[row] + k];
        }
    }
    let reference = dense.partial_piv_lu().solve(faer::Col::<f64>::from_fn(n, |i| b[i]));
    let mut solver = SparseLu::default();
    let mut x = vec![0.0; n];
    solver.prepare(&matrix).expect("regular");
    solver.solve(&matrix, &b, &mut x, 1e-12).expect("solved");
    let largest = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!((0..n).all(|i| (x[i] - reference[i]).abs() < 1e-11 * largest));
}

#[test]
fn ldlt_takes_zero_pivots_on_the_diagonal() {
    // A saddle point: nothing can be eliminated in the order of the unknowns without exchanges.
    let exchange = Matrix::dense(Symmetry::Symmetric, &[&[0.0, 1.0], &[1.0, 0.0]]);
    let saddle = Matrix::dense(
        Symmetry::Symmetric,
        &[&[2.0, 1.0, 1.0, 0.0], &[1.0, 2.0, 0.0, 1.0], &[1.0, 0.0, 0.0, 0.0], &[0.0, 1.0, 0.0, 0.0]],
    );
    for matrix in [exchange, saddle] {
        let b = right_hand_side(matrix.size());
        let mut x = vec![0.0; b.len()];
        let mut solver = LinearSolverChoice::ldlt().build();
        solver.prepare(&matrix).expect("regular");
        solver.solve(&matrix, &b, &mut x, 1e-12).expect("solved");
        assert!(matrix.relative_residual(&b, &x) <= 1e-12);
    }
}

#[test]
fn cholesky_tells_where_and_how_negative() {
    let units = [1.0, 1e4, 1e-3];
    let matrix = Matrix::dense(Symmetry::Symmetric, &[&[4.0, 2.0, 0.0], &[2.0, -1.0, 0.0], &[0.0, 0.0, 3.0]])
        .map(|i, j, v| v * units[i] * units[j]);
    let error = LinearSolverChoice::cholesky().build().prepare(&matrix).expect_err("indefinite");
    let LinearError::NotPositiveDefinite { unknown, value } = error else { panic!("{error:?}") };
    // Either the 2 × 2 block is eliminated from the first unknown or from the second.
    assert_eq!(unknown, Some(1));
    let expected = [-2.0e8, -1.0e8];
    assert!(expected.iter().any(|e| (value / e - 1.0).abs() < 1e-12), "{value:e}");
}

#[test]
fn a_given_order_of_elimination_is_used_or_refused() {
    let matrix = grid(10, 2.4, 0.2, 0.0);
    let n = matrix.size();
    let b = right_hand_side(n);
    let mut x = vec![0.0; n];
    let reversed: Arc<[usize]> = (0..n).rev().collect();
    let mut solver = SparseLdlt::new(EliminationOrder::Given(reversed));
    solver.prepare(&matrix).expect("regular");
    solver.solve(&matrix, &b, &mut x, 1e-12).expect("solved");
    assert!(matrix.relative_residual(&b, &x) <= 1e-12);
    for order in [vec![0; n], (1..=n).collect(), (0..n - 1).collect()] {
        let error =
            SparseLdlt::new(EliminationOrder::Given(order.into())).prepare(&matrix).expect_err("no permutation");
        assert!(matches!(error, LinearError::Factorisation { .. }), "{error:?}");
    }
}

#[test]
fn the_unknown_that_moves_freely_is_named() {
    // The first two move together; the matrix differs from a singular one by rounding.
    let mut entries = vec![(0, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 1.0 + 1e-16)];
    entries.extend([(2, 2, 1.0), (3, 3, 1.0)]);
    let matrix = Matrix::new(4, Symmetry::Symmetric, entries);
    for choice in direct_solvers() {
        let error = choice.build().prepare(&matrix).expect_err("singular");
        let LinearError::Singular { unknown } = error else { panic!("{choice:?}: {error:?}") };
        assert!(unknown.is_none_or(|u| u < 2), "{choice:?}: {unknown:?}");
    }
}

#[test]
fn an_equal_pattern_and_a_new_one() {
    let matrix = grid(6, 2.4, 0.2, 0.0);
    let twin = grid(6, 2.4, 0.3, 0.0);
    let other = grid(7, 1.5, 0.2, 0.0);
    for choice in direct_solvers() {
        let mut solver = choice.build();
        for (matrix, analyses) in [(&matrix, 1), (&twin, 1), (&other, 2), (&matrix, 3)] {
            let b = right_hand_side(matrix.size());
            let mut x = vec![0.0; b.len()];
            solver.prepare(matrix).expect("regular");
            solver.solve(matrix, &b, &mut x, 1e-11).expect("solved");
            assert_eq!(solver.counts().analyses, analyses);
        }
        // A failure leaves nothing half prepared behind, and the next matrix is welcome.
        let singular = matrix.map(|_, _, _| 0.0);
        solver.prepare(&singular).expect_err("singular");
        let b = right_hand_side(matrix.size());
        let mut x = vec![0.0; b.len()];
        assert_eq!(solver.solve(&matrix, &b, &mut x, 1e-11), Err(LinearError::NotPrepared));
        solver.prepare(&matrix).expect("regular");
        solver.solve(&matrix, &b, &mut x, 1e-11).expect("solved");
    }
}

#[test]
fn a_tolerance_below_rounding_is_an_error() {
    let matrix = grid(10, 2.4, 1e-6, 0.0);
    let b = right_hand_side(matrix.size());
    let mut x = vec![0.0; b.len()];
    for choice in direct_solvers() {
        let mut solver = choice.build();
        solver.prepare(&matrix).expect("regular");
        let error = solver.solve(&matrix, &b, &mut x, 0.0).expect_err("not reachable");
        assert!(
            matches!(error, LinearError::Inaccurate { relative_residual } if relative_residual < 1e-6),
            "{error:?}"
        );
    }
}

#[test]
fn new_values_need_no_new_analysis() {
    let matrix = grid(8, 2.4, 0.1, 0.1);
    let b = right_hand_side(128);
    let mut x = vec![0.0; 128];
    let mut solver = SparseLu::new();
    for k in 0..4 {
        let changed = matrix.map(|i, j, v| v * (1.0 + 0.1 * scatter((k * 1000 + i * 17 + j) as u64)));
        solver.prepare(&changed).expect("regular");
        solver.solve(&changed, &b, &mut x, 1e-11).expect("solved");
        assert!(changed.relative_residual(&b, &x) <= 1e-11);
    }
    let counts = solver.counts();
    assert_eq!((counts.analyses, counts.factorisations, counts.solves), (1, 4, 4));
}

#[test]
fn a_stale_factor_still_honours_the_tolerance() {
    let matrix = grid(20, 2.4, 0.3, 0.1);
    let size = 800;
    let b = right_hand_side(size);
    let mut x = vec![0.0; size];
    let mut solver = SparseLu::new();
    solver.prepare(&matrix).expect("regular");
    for change in [0.05, 0.2] {
        let moved = matrix.map(|i, j, v| v * (1.0 + change * scatter((i * 31 + j) as u64)));
        let report = solver.solve(&moved, &b, &mut x, 1e-10).expect("solved");
        assert!(moved.relative_residual(&b, &x) <= 1e-10);
        assert!(report.iterations > 0);
    }
    assert_eq!(solver.counts().factorisations, 1);
}

#[test]
fn singular_matrices_are_named_singular() {
    let ones: [&[f64]; 2] = [&[1.0, 1.0], &[1.0, 1.0]];
    let near: [&[f64]; 3] = [&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0], &[7.0, 8.0, 9.0]];
    let floating = grid(30, 2.4, 0.0, 0.0);
    for matrix in [Matrix::dense(Symmetry::General, &ones), Matrix::dense(Symmetry::General, &near), floating] {
        let error = SparseLu::new().prepare(&matrix).expect_err("singular");
        assert!(matches!(error, LinearError::Singular { .. }), "{error:?}");
    }
    // No pivot can be found for one of the first three rows.
    let entries = [(0, 0, 1.0), (1, 0, 2.0), (2, 0, 3.0), (2, 1, 1.0), (3, 2, 1.0), (3, 3, 1.0), (0, 3, 1.0)];
    let structural = Matrix::new(4, Symmetry::General, entries.into_iter().filter(|e| e.1 != 1));
    let error = SparseLu::new().prepare(&structural).expect_err("singular");
    assert!(matches!(error, LinearError::Singular { .. }), "{error:?}");
    let two_rows = Matrix::new(3, Symmetry::General, [(0, 0, 1.0), (1, 0, 2.0), (2, 0, 3.0), (2, 1, 1.0), (2, 2, 1.0)]);
    let error = SparseLu::new().prepare(&two_rows).expect_err("singular");
    assert!(matches!(error, LinearError::Singular { .. }), "{error:?}");
}
