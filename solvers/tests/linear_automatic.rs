//! The order of elimination from places, and the solver that chooses for itself.

mod linear_support;

use std::sync::atomic::Ordering;

use linear_support::{Matrix, grid, right_hand_side};
use nicolson_solvers::linear::{
    AutomaticOptions, Effort, EliminationOrder, LinearSolver, LinearSolverChoice, Places, SparseLdlt, Symmetry, Tangent,
};

/// One unknown per point of a lattice in `D` dimensions, coupled to all points at most two layers away.
fn lattice<const D: usize>(sides: [usize; D]) -> Matrix {
    let points = sides.iter().product();
    let stride = |axis: usize| sides[..axis].iter().product::<usize>();
    let place = |point: usize| -> [usize; D] { std::array::from_fn(|axis| point / stride(axis) % sides[axis]) };
    let mut entries = Vec::new();
    for a in 0..points {
        let at = place(a);
        let mut sum = 0.01;
        for stencil in 0..5_usize.pow(D as u32) {
            let other: [usize; D] = std::array::from_fn(|axis| at[axis] + stencil / 5_usize.pow(axis as u32) % 5);
            if other.iter().zip(sides).any(|(&i, side)| i < 2 || i >= side + 2)
                || other.iter().zip(&at).all(|(o, a)| *o == a + 2)
            {
                continue;
            }
            let b = other.iter().enumerate().map(|(axis, i)| (i - 2) * stride(axis)).sum();
            entries.push((a, b, -1.0));
            sum += 1.0;
        }
        entries.push((a, a, sum));
    }
    let mut matrix = Matrix::new(points, Symmetry::PositiveDefinite, entries);
    matrix.blocks = (0..=points).collect();
    let coordinates = (0..points).flat_map(|a| place(a).map(|i| i as f64)).collect();
    matrix.places = Some(Places { dimension: D, coordinates });
    matrix
}

/// Fill with the order from places over fill with minimum degree; both solve.
fn compare_orders(matrix: &Matrix) -> f64 {
    let b = right_hand_side(matrix.size());
    let solve = |order| {
        let mut solver = SparseLdlt::new(order);
        solver.prepare(matrix).expect("regular");
        let mut x = vec![f64::NAN; b.len()];
        let report = solver.solve(matrix, &b, &mut x, 1e-12).expect("solved");
        assert_eq!(report.iterations, 0);
        (x, solver.info().fill as f64)
    };
    let ((x, fill), (y, reference)) = (solve(EliminationOrder::Automatic), solve(EliminationOrder::MinimumDegree));
    assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-10 * (1.0 + y.abs())), "the same solution");
    fill / reference
}

#[test]
fn orders_from_places_fill_in_less_than_minimum_degree_on_lattices() {
    let plane = compare_orders(&lattice::<2>([160, 160]));
    let space = compare_orders(&lattice::<3>([14, 14, 14]));
    let beam = compare_orders(&lattice::<2>([200, 12]));
    // Multiplications are counted, not the zeros that make supernodes larger: hence a little room for the beam.
    assert!(plane < 1.0 && space < 0.9 && beam < 1.03, "plane {plane}, space {space}, beam {beam}");
}

#[test]
fn places_that_say_nothing_still_give_an_order() {
    let mut matrix = lattice::<2>([12, 12]);
    for coordinate in [0.0, f64::NAN] {
        matrix.places = Some(Places { dimension: 2, coordinates: vec![coordinate; 2 * matrix.size()] });
        assert!(compare_orders(&matrix).is_finite());
    }
    // Places that do not fit are not used.
    matrix.places = Some(Places { dimension: 2, coordinates: vec![0.0; 3] });
    assert_eq!(compare_orders(&matrix), 1.0);
}

fn automatic() -> Box<dyn LinearSolver> {
    LinearSolverChoice::automatic().build()
}

fn solves(solver: &mut dyn LinearSolver, matrix: &Matrix, tolerance: f64) -> usize {
    let b = right_hand_side(matrix.size());
    let mut x = vec![f64::NAN; b.len()];
    let report = solver.solve(matrix, &b, &mut x, tolerance).expect("solved");
    assert!(matrix.relative_residual(&b, &x) <= tolerance, "{}", solver.info().name);
    report.iterations
}

/// With such a cheap product, a factor has to wait.
fn cheap(mut matrix: Matrix, action: f64) -> Matrix {
    matrix.effort = Some(Effort { action, assembly: 1e-3, entries: matrix.values.len() as f64 });
    matrix.with_sparser(|row, column| row / 2 == column / 2)
}

#[test]
fn a_cheap_factor_is_taken_at_once() {
    let matrix = grid(20, 4.8, 0.05, 0.0);
    let mut solver = automatic();
    solver.prepare(&matrix).expect("regular");
    assert_eq!(solves(&mut *solver, &matrix, 1e-12), 0);
    let info = solver.info();
    assert!(info.name.contains("LDLT") && info.reason.contains("iterations"), "{info:?}");
}

#[test]
fn well_conditioned_systems_with_cheap_products_are_iterated() {
    let matrix = cheap(grid(30, 4.8, 50.0, 0.0), 1e-6);
    let mut solver = automatic();
    solver.prepare(&matrix).expect("prepared");
    assert!(solves(&mut *solver, &matrix, 1e-8) > 0);
    assert!(solver.info().name.starts_with("CG"), "{:?}", solver.info());
}

#[test]
fn iterating_ends_at_the_price_of_a_factor() {
    let matrix = cheap(grid(30, 4.8, 1e-4, 0.0), 1e-4);
    let mut solver = automatic();
    solver.prepare(&matrix).expect("prepared");
    assert_eq!(solves(&mut *solver, &matrix, 1e-10), 0);
    let info = solver.info();
    assert!(info.name.contains("LDLT") && info.reason.contains("cost more than a factor"), "{info:?}");
    let spent = solver.counts().iterations;
    // Afterwards it goes there directly.
    solves(&mut *solver, &matrix, 1e-10);
    assert_eq!(solver.counts().iterations, spent);
    assert_eq!(solver.counts().analyses, 1);
}

#[test]
fn many_right_hand_sides_pay_for_a_factor() {
    let matrix = cheap(grid(30, 4.8, 5.0, 0.0), 1e-4);
    let mut solver = automatic();
    solver.prepare(&matrix).expect("prepared");
    let iterated = (0..200).take_while(|_| solves(&mut *solver, &matrix, 1e-8) > 0).count();
    assert!(iterated > 0 && iterated < 200, "{iterated}: {:?}", solver.info());
    assert!(solver.info().name.contains("LDLT"), "{:?}", solver.info());
}

#[test]
fn a_factor_that_does_not_fit_is_not_tried() {
    let mut matrix = cheap(grid(20, 4.8, 5.0, 0.0), 1e-4);
    matrix.effort = Some(Effort { action: 1e-4, assembly: 1.0, entries: 1e9 });
    for direct in [false, true] {
        let mut solver =
            LinearSolverChoice::Automatic(AutomaticOptions { direct, ..AutomaticOptions::default() }).build();
        solver.prepare(&matrix).expect("prepared");
        solves(&mut *solver, &matrix, 1e-8);
        assert!(solver.info().reason.contains("GB"), "{:?}", solver.info());
    }
}

#[test]
fn a_factor_is_kept_for_operators_near_by_and_only_for_those() {
    let first = grid(30, 4.8, 1.0, 0.0);
    let mut solver = automatic();
    solver.prepare(&first).expect("regular");
    solves(&mut *solver, &first, 1e-8);
    let near = first.map(|row, column, value| if row == column { 1.001 * value } else { value });
    solver.prepare(&near).expect("kept");
    assert!(solves(&mut *solver, &near, 1e-4) > 0);
    assert_eq!(solver.counts().factorisations, 1);
    let far = grid(30, 4.8, 500.0, 0.0);
    solver.prepare(&far).expect("tried");
    solves(&mut *solver, &far, 1e-4);
    assert_eq!(solver.counts().factorisations, 2);
    // The next operator gets its own factor without a try: nothing is iterated.
    let spent = solver.counts().iterations;
    solver.prepare(&first).expect("regular");
    assert_eq!(solves(&mut *solver, &first, 1e-12), 0);
    assert_eq!((solver.counts().factorisations, solver.counts().iterations), (3, spent));
}

#[test]
fn nearly_symmetric_operators_take_the_factor_of_their_symmetric_part() {
    let matrix = grid(30, 4.8, 1.0, 0.01);
    let mut solver = automatic();
    solver.prepare(&matrix).expect("regular");
    assert!(solves(&mut *solver, &matrix, 1e-10) > 0);
    assert!(solver.info().name.contains("symmetric part"), "{:?}", solver.info());
    // Mostly skew: LU.
    let skew = matrix.map(|row, column, value| {
        if row == column {
            0.1
        } else if row < column {
            value
        } else {
            -value
        }
    });
    let mut solver = automatic();
    solver.prepare(&skew).expect("regular");
    solves(&mut *solver, &skew, 1e-8);
    assert!(solver.info().name.contains("LU"), "{:?}", solver.info());
}

#[test]
fn an_unchecked_solve_takes_no_product() {
    let matrix = grid(20, 4.8, 0.05, 0.0);
    let b = right_hand_side(matrix.size());
    for choice in [LinearSolverChoice::automatic(), LinearSolverChoice::ldlt(), LinearSolverChoice::Lu] {
        let mut solver = choice.build();
        assert!(solver.solve_unchecked(&b, &mut vec![0.0; b.len()]).is_none(), "{choice:?}: not prepared");
        solver.prepare(&matrix).expect("regular");
        let before = matrix.products.load(Ordering::Relaxed);
        let mut x = vec![f64::NAN; b.len()];
        solver.solve_unchecked(&b, &mut x).expect("a direct solver").expect("regular");
        assert_eq!(matrix.products.load(Ordering::Relaxed), before, "{choice:?}");
        assert!(matrix.relative_residual(&b, &x) < 1e-11, "{choice:?}");
        assert_eq!(solver.counts().solves, 1, "{choice:?}");
    }
    let mut iterative = LinearSolverChoice::cg().build();
    iterative.prepare(&matrix).expect("prepared");
    assert!(iterative.solve_unchecked(&b, &mut vec![0.0; b.len()]).is_none());
}
