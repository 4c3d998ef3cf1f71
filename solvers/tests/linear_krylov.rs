//! The Krylov methods: where products and preconditioners come from, limits, curvature.

mod linear_support;

use linear_support::*;
use nicolson_solvers::linear::{
    KrylovOptions, LinearError, LinearSolver, LinearSolverChoice, Operator, Preconditioner, PreconditionerMatrix,
    Symmetry, Tangent,
};

fn options(preconditioner: Preconditioner) -> KrylovOptions {
    KrylovOptions { preconditioner, ..Default::default() }
}

/// Prepares, solves, checks the true residual; iterations and the solver.
fn solve(choice: &LinearSolverChoice, matrix: &Matrix, tolerance: f64) -> (usize, Box<dyn LinearSolver>) {
    let b = right_hand_side(matrix.size());
    let mut x = vec![0.0; b.len()];
    let mut solver = choice.build();
    solver.prepare(matrix).unwrap_or_else(|e| panic!("{choice:?}: {e}"));
    let report = solver.solve(matrix, &b, &mut x, tolerance).unwrap_or_else(|e| panic!("{choice:?}: {e}"));
    assert!(matrix.relative_residual(&b, &x) <= 1.01 * tolerance, "{choice:?}");
    (report.iterations, solver)
}

#[test]
fn a_matrix_free_operator_needs_no_entries_or_a_sparser_one() {
    let bare = grid(12, 2.4, 0.5, 0.0).without_entries();
    // The direct neighbours only.
    let near = |row: usize, column: usize| {
        let (a, b) = (row / 2, column / 2);
        (a / 12).abs_diff(b / 12) <= 1 && (a % 12).abs_diff(b % 12) <= 1
    };
    let offering = grid(12, 2.4, 0.5, 0.0).with_sparser(near).without_entries();
    for choice in direct_solvers() {
        let error = choice.build().prepare(&offering).expect_err("no entries");
        assert!(matches!(error, LinearError::NeedsEntries { .. }));
    }
    for preconditioner in preconditioners() {
        let none = preconditioner == Preconditioner::None;
        for choice in krylov_methods(&options(preconditioner.clone())) {
            match choice.build().prepare(&bare) {
                Ok(()) => assert!(none),
                Err(LinearError::NeedsEntries { solver }) => assert!(!none && solver.contains("preconditioner")),
                Err(error) => panic!("{choice:?}: {error}"),
            }
            let (_, solver) = solve(&choice, &offering, 1e-8);
            assert_eq!(solver.info().entries, 0);
        }
        let mut krylov = options(preconditioner);
        krylov.operator = Operator::Assembled;
        for choice in krylov_methods(&krylov) {
            let error = choice.build().prepare(&offering).expect_err("no entries");
            assert!(matches!(error, LinearError::NeedsEntries { .. }));
        }
    }
}

#[test]
fn a_sparser_factor_is_cheaper_and_weaker_than_a_full_one() {
    let near = |row: usize, column: usize| {
        let (a, b) = (row / 2, column / 2);
        (a / 16).abs_diff(b / 16) <= 1 && (a % 16).abs_diff(b % 16) <= 1
    };
    let matrix = grid(16, 3.5, 0.5, 0.1).with_sparser(near);
    let mut krylov = options(Preconditioner::Ilu0);
    let (full, solver) = solve(&LinearSolverChoice::Gmres { restart: 40, krylov: krylov.clone() }, &matrix, 1e-8);
    let full_fill = solver.info().fill;
    assert!(solver.info().name.contains("ILU(0)"), "{:?}", solver.info());
    krylov.preconditioner_matrix = PreconditionerMatrix::Sparser;
    let (sparse, solver) = solve(&LinearSolverChoice::Gmres { restart: 40, krylov: krylov.clone() }, &matrix, 1e-8);
    assert!(solver.info().fill < full_fill);
    assert!(solver.info().name.contains("sparser"), "{:?}", solver.info());
    let (none, _) =
        solve(&LinearSolverChoice::Gmres { restart: 40, krylov: options(Preconditioner::None) }, &matrix, 1e-8);
    assert!(full < sparse && full < none, "{full} {sparse} {none}");
    krylov.preconditioner_matrix = PreconditionerMatrix::Full;
    let error = LinearSolverChoice::Gmres { restart: 40, krylov }.build().prepare(&matrix.without_entries());
    assert!(matches!(error, Err(LinearError::NeedsEntries { .. })));
}

#[test]
fn products_agree_wherever_they_come_from() {
    let matrix = grid(12, 2.4, 0.3, 0.0);
    for operator in [Operator::Auto, Operator::Assembled, Operator::MatrixFree] {
        for choice in krylov_methods(&KrylovOptions { operator, ..options(Preconditioner::BlockJacobi) }) {
            let (iterations, mut solver) = solve(&choice, &matrix, 1e-8);
            assert!(iterations > 3 && iterations < 200, "{choice:?}: {iterations}");
            assert_eq!(solver.info().entries > 0, operator != Operator::MatrixFree);
            // The operator moves on, the assembled entries do not.
            let moved = matrix.map(|i, j, v| v * (1.0 + 0.2 * scatter((i * j + i + j) as u64)));
            let b = right_hand_side(matrix.size());
            let mut x = vec![0.0; b.len()];
            solver.solve(&moved, &b, &mut x, 1e-8).expect("solved");
            assert!(moved.relative_residual(&b, &x) <= 1.01e-8, "{choice:?}");
        }
    }
}

#[test]
fn better_preconditioners_take_fewer_iterations() {
    let matrix = grid(20, 2.4, 0.05, 0.0);
    let iterations = |preconditioner: Preconditioner| -> Vec<usize> {
        krylov_methods(&options(preconditioner)).iter().map(|choice| solve(choice, &matrix, 1e-8).0).collect()
    };
    let block = iterations(Preconditioner::BlockJacobi);
    let zero = iterations(Preconditioner::Ilu0);
    let threshold = iterations(Preconditioner::ilut());
    let exact = iterations(Preconditioner::Cholesky { order: Default::default() });
    for method in 0..3 {
        assert!(zero[method] < block[method], "{zero:?} {block:?}");
        assert!(exact[method] <= 2, "{exact:?}");
    }
    assert!(threshold[0] <= zero[0] && threshold[1] <= zero[1], "{threshold:?} {zero:?}");
}

#[test]
fn one_cycle_of_gmres_solves_exactly_within_the_number_of_unknowns() {
    let matrix = Matrix::dense(Symmetry::General, &[&[0.0, 1.0, 0.0], &[0.0, 0.0, 1.0], &[1.0, 0.0, 0.0]]);
    let krylov = options(Preconditioner::None);
    let (iterations, _) = solve(&LinearSolverChoice::Gmres { restart: 5, krylov: krylov.clone() }, &matrix, 1e-13);
    assert_eq!(iterations, 3);
    // A rotation is the classical break-down of BiCGStab: rᵀ A r = 0.
    let rotation = Matrix::dense(Symmetry::General, &[&[0.0, 1.0], &[-1.0, 0.0]]);
    solve(&LinearSolverChoice::BiCgStab { krylov }, &rotation, 1e-10);
}

#[test]
fn negative_curvature_ends_cg_with_its_value() {
    let matrix = grid(10, 2.4, -0.4, 0.0);
    let b = right_hand_side(matrix.size());
    let mut x = vec![0.0; b.len()];
    let mut solver = LinearSolverChoice::Cg { krylov: options(Preconditioner::None) }.build();
    solver.prepare(&matrix).expect("nothing to prepare");
    let error = solver.solve(&matrix, &b, &mut x, 1e-8).expect_err("indefinite");
    let LinearError::NotPositiveDefinite { value, .. } = error else { panic!("{error:?}") };
    // The shift is the lowest eigenvalue: the stiffness alone is positive semidefinite.
    assert!((-0.4 - 1e-12..0.0).contains(&value), "{value}");
    let negative = Matrix::dense(Symmetry::Symmetric, &[&[2.0, 0.0], &[0.0, -3.0]]);
    for preconditioner in [Preconditioner::Jacobi, Preconditioner::BlockJacobi, Preconditioner::Ilu0] {
        let error = LinearSolverChoice::Cg { krylov: options(preconditioner) }.build().prepare(&negative);
        assert_eq!(error, Err(LinearError::NotPositiveDefinite { unknown: Some(1), value: -3.0 }));
    }
}

#[test]
fn limits_and_tolerances_are_kept() {
    let matrix = grid(20, 2.4, 1e-3, 0.0);
    let b = right_hand_side(matrix.size());
    let mut x = vec![0.0; b.len()];
    for choice in krylov_methods(&KrylovOptions { max_iterations: 7, ..Default::default() }) {
        let mut solver = choice.build();
        solver.prepare(&matrix).expect("regular");
        let error = solver.solve(&matrix, &b, &mut x, 1e-10).expect_err("too few iterations");
        let LinearError::IterationLimit { iterations, relative_residual } = error else { panic!("{error:?}") };
        assert!(iterations == 7 && relative_residual > 1e-10 && relative_residual < 1e3);
    }
    let strict = KrylovOptions { tolerance: Some(1e-9), ..options(Preconditioner::Ilu0) };
    for choice in krylov_methods(&strict) {
        let mut solver = choice.build();
        solver.prepare(&matrix).expect("regular");
        solver.solve(&matrix, &b, &mut x, 0.1).expect("solved");
        assert!(matrix.relative_residual(&b, &x) <= 1.01e-9);
        // What rounding forbids is reported, and not iterated for ever.
        let error = solver.solve(&matrix, &b, &mut x, 0.0).expect_err("not reachable");
        assert!(matches!(error, LinearError::IterationLimit { .. } | LinearError::Breakdown { .. }), "{error:?}");
        assert!(solver.counts().iterations < 500, "{:?}", solver.counts());
    }
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let bad = [
        LinearSolverChoice::Gmres { restart: 0, krylov: KrylovOptions::default() },
        LinearSolverChoice::Cg { krylov: options(Preconditioner::ilut()) },
        LinearSolverChoice::Cg { krylov: options(Preconditioner::Lu) },
        LinearSolverChoice::BiCgStab { krylov: KrylovOptions { max_iterations: 0, ..Default::default() } },
        LinearSolverChoice::BiCgStab { krylov: KrylovOptions { tolerance: Some(f64::NAN), ..Default::default() } },
        LinearSolverChoice::BiCgStab { krylov: options(Preconditioner::Ilut { drop_tolerance: -1.0, fill: 1 }) },
    ];
    for choice in bad {
        let error = choice.validate().expect_err("nonsense");
        assert!(!error.setting.is_empty() && format!("{error}").contains(error.setting));
    }
    for choice in all_solvers() {
        choice.validate().expect("sound");
    }
    assert_eq!(LinearSolverChoice::default(), LinearSolverChoice::Lu);
}

#[test]
fn blocks_that_do_not_fit_are_refused() {
    let mut matrix = grid(4, 2.4, 0.5, 0.0);
    matrix.blocks = vec![0, 5, 3, 32];
    let error = LinearSolverChoice::cg().build().prepare(&matrix).expect_err("blocks in disorder");
    assert!(matches!(error, LinearError::Factorisation { .. }));
    matrix.blocks = Vec::new();
    solve(&LinearSolverChoice::cg(), &matrix, 1e-8);
}
