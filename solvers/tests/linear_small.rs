//! Thousands of small sparse matrices of integers, singular or not: the exact determinant is the judge.

mod linear_support;

use linear_support::*;
use nicolson_solvers::linear::{LinearError, LinearSolverChoice, Symmetry};

/// The determinant by elimination without fractions (Bareiss 1968).
fn determinant(mut a: Vec<Vec<i128>>) -> i128 {
    let n = a.len();
    let (mut sign, mut previous) = (1, 1);
    for k in 0..n {
        let Some(pivot) = (k..n).find(|&i| a[i][k] != 0) else { return 0 };
        if pivot != k {
            a.swap(pivot, k);
            sign = -sign;
        }
        for i in k + 1..n {
            for j in k + 1..n {
                a[i][j] = (a[i][j] * a[k][k] - a[i][k] * a[k][j]) / previous;
            }
            a[i][k] = 0;
        }
        previous = a[k][k];
    }
    sign * previous
}

/// A matrix of small integers, some of them stored zeros, and its determinant.
fn random(seed: u64, symmetric: bool) -> (Matrix, i128) {
    let number = |k: u64| scatter(seed * 10_007 + k);
    let n = 1 + ((number(0) + 1.0) * 4.5) as usize;
    let density = 0.5 * number(1) + 0.5;
    let mut dense = vec![vec![0_i128; n]; n];
    let mut entries = Vec::new();
    for (i, row) in dense.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            let (a, b) = if symmetric { (i.min(j), i.max(j)) } else { (i, j) };
            let k = (a * n + b) as u64;
            if number(100 + k) < density || (i == j && number(500 + k) < 0.5) {
                let value = (number(1000 + k) * 3.0).round();
                *entry = value as i128;
                entries.push((i, j, value));
            }
        }
    }
    let symmetry = if symmetric { Symmetry::Symmetric } else { Symmetry::General };
    (Matrix::new(n, symmetry, entries), determinant(dense))
}

#[test]
fn answers_are_right_and_singular_matrices_are_named() {
    let (mut solved, mut singular, mut substituted) = (0, 0, 0);
    for seed in 0..3000 {
        let symmetric = seed % 2 == 0;
        let (matrix, determinant) = random(seed, symmetric);
        let b = right_hand_side(matrix.pattern.size());
        let mut x = vec![0.0; b.len()];
        for choice in all_solvers() {
            let mut solver = choice.build();
            let result = solver.prepare(&matrix).and_then(|()| solver.solve(&matrix, &b, &mut x, 1e-8));
            match &result {
                Ok(_) => assert!(matrix.relative_residual(&b, &x) <= 1.01e-8, "{seed} {choice:?}"),
                Err(error) => assert!(!format!("{error}").contains("NaN"), "{seed} {choice:?}: {error}"),
            }
            if choice == LinearSolverChoice::Lu {
                match determinant {
                    0 => assert!(matches!(result, Err(LinearError::Singular { .. })), "{seed}: {result:?}"),
                    _ => assert!(result.is_ok(), "{seed}: {result:?}"),
                }
                if determinant == 0 { singular += 1 } else { solved += 1 }
            }
            // LDLᵀ cannot exchange rows freely, but it knows when it has to.
            if symmetric && choice == LinearSolverChoice::ldlt() {
                match determinant {
                    0 => assert!(matches!(result, Err(LinearError::Singular { .. })), "{seed}: {result:?}"),
                    _ => assert!(result.is_ok(), "{seed}: {result:?}"),
                }
                substituted += usize::from(solver.info().name.contains("LU"));
            }
        }
    }
    assert!(solved > 2000 && singular > 300, "{solved} {singular}");
    assert!(substituted > 20 && substituted < 200, "{substituted}");
}
