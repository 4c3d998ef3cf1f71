//! Sparse LU at real sizes, and where faer alone would answer with NaN.

mod linear_support;

use linear_support::{Matrix, grid, right_hand_side, scatter};
use nicolson_solvers::linear::{LinearError, LinearSolver, LinearSolverChoice, SparseLu, Symmetry};

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
