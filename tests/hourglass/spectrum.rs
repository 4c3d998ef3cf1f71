//! Frequencies of bodies at rest: a bar regains its low ones, and the explicit step knows the highest.

use nalgebra::{DMatrix, SymmetricEigen};
use nicolson::geometry::{BoxLattice, Layout};
use nicolson::model::Model;
use nicolson::setup::*;
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{StageSystem, System};

use super::support::scenes::orders;
use super::support::{linear, particles, setup};
use super::{SPACING, digits};

/// Frequencies of a body at rest, ascending, 1/s, from the assembled tangent `M + s² K`: any law.
fn frequencies<const D: usize>(model: &mut Model<D>) -> Vec<f64> {
    let state = model.initial_state().expect("state");
    let shift = 1.0;
    model.begin_stage(0.0, shift, &state);
    let mut y = vec![0.0; NonlinearProblem::unknowns(model)];
    model.start_from(&state, &mut y);
    model.linearise(&y).expect("linearise");
    let matrix = model.tangent_matrix();
    let pattern = model.tangent().pattern().expect("entries").clone();
    let masses: Vec<f64> = (0..model.particles())
        .flat_map(|a| {
            let free = model.setup().constraints[a].iter().filter(|c| **c == Constraint::Free).count();
            std::iter::repeat_n(model.masses()[a], free)
        })
        .collect();
    let size = y.len();
    assert_eq!(masses.len(), size);
    let mut dense = DMatrix::zeros(size, size);
    for row in 0..size {
        for &column in pattern.row(row) {
            let inertia = if row == column { masses[row] } else { 0.0 };
            dense[(row, column)] =
                (matrix.get(row, column) - inertia) / (shift * shift * (masses[row] * masses[column]).sqrt());
        }
    }
    let asymmetry = (&dense - dense.transpose()).amax() / dense.amax();
    assert!(asymmetry < 1e-13, "the tangent at rest must be symmetric: {asymmetry:e}");
    let mut found: Vec<f64> = SymmetricEigen::new(dense).eigenvalues.iter().map(|l| l.max(0.0).sqrt()).collect();
    found.sort_by(f64::total_cmp);
    found
}

/// A bar of length 1 with c = 1, clamped at one end: relative errors of its two lowest frequencies.
fn bar(count: usize, smoothing: f64, hourglass: f64) -> [f64; 2] {
    weighted_bar(count, smoothing, hourglass, WeightChoice::Separate)
}

fn weighted_bar(count: usize, smoothing: f64, hourglass: f64, weights: WeightChoice) -> [f64; 2] {
    let spacing = 1.0 / (count - 1) as f64;
    let law = nicolson::material::Material::linear_volumetric(1.0, 1.0);
    let lattice = BoxLattice::with_counts([0.0], [1.0], [count], Layout::Vertex).expect("a lattice");
    let mut setup = setup(lattice.particles(), spacing, law);
    setup.bodies[0].smoothing = smoothing;
    setup.bodies[0].weights = weights;
    setup.bodies[0].hourglass = Some(hourglass);
    setup.constraints[0] = [Constraint::Fixed];
    let found = frequencies(&mut Model::<1>::new(setup, None, None).expect("model"));
    [0, 1].map(|i| found[i] / ((i as f64 + 0.5) * std::f64::consts::PI) - 1.0)
}

#[test]
fn the_bar_regains_its_low_frequencies() {
    for hourglass in [0.0, 0.5, 1.0, 2.0, 4.0] {
        let errors = bar(41, 1.2, hourglass);
        println!("41 particles, h = 1.2 Δx, α = {hourglass}: {}", digits(&errors));
        if hourglass == 0.0 {
            assert!((-0.6..-0.45).contains(&errors[1]), "{errors:?}");
        } else {
            assert!(errors[0].abs() < 8e-4 && errors[1].abs() < 5e-3, "{errors:?}");
        }
    }
    // At h = 1.5 Δx the lowest mode itself is spurious.
    assert!(bar(41, 1.5, 0.0)[0] < -0.5);
    assert!(bar(41, 1.5, 2.0)[0].abs() < 5e-3);
}

#[test]
fn the_lowest_frequency_converges_with_second_order() {
    let counts = [11, 21, 41, 81];
    let spacings = counts.map(|n| 1.0 / (n - 1) as f64);
    for hourglass in [0.5, 1.0, 2.0, 4.0] {
        let errors = counts.map(|n| bar(n, 1.0, hourglass)[0].abs());
        let found = orders(&spacings, &errors);
        println!("h = Δx, α = {hourglass}: {}, orders {found:.2?}", digits(&errors));
        assert!(found.iter().all(|order| (1.95..2.1).contains(order)), "{found:?}");
        assert!(errors[0] < 4.0e-3 && errors[3] < 6.2e-5, "{errors:?}");
        // Separate weights have no second order at h = 1.2 Δx (their free end), balanced ones have.
        for (weights, range) in [(WeightChoice::Separate, 1.0..1.85), (WeightChoice::Balanced, 1.9..2.2)] {
            let errors = counts.map(|n| weighted_bar(n, 1.2, hourglass, weights)[0].abs());
            let found = orders(&spacings, &errors);
            println!("h = 1.2 Δx, {weights:?}, α = {hourglass}: {}, orders {found:.2?}", digits(&errors));
            assert!(found.iter().all(|order| range.contains(order)), "{found:?}");
        }
    }
}

fn explicit_limit<const D: usize>(counts: [usize; D]) {
    for (smoothing, shake) in [(1.0, 0.0), (1.2, 0.0), (1.2, 0.2)] {
        let mut without = 0.0;
        for hourglass in [0.0, 0.5, 2.0, 4.0, 16.0] {
            let mut setup = setup(particles(counts, SPACING, shake), SPACING, linear());
            setup.bodies[0].smoothing = smoothing;
            setup.bodies[0].hourglass = Some(hourglass);
            let mut model = Model::<D>::new(setup, None, Some(1.0)).expect("model");
            let state = model.initial_state().expect("state");
            let limit = model.stable_step(0.0, &state);
            let highest = frequencies(&mut model).last().copied().expect("a frequency");
            println!(
                "{D}D h = {smoothing} Δx, shaken {shake}, α = {hourglass:4}: ω_max {highest:8.3}, ω_max Δt/2 {:.3}",
                0.5 * highest * limit
            );
            if hourglass == 0.0 {
                // In the corners of a block the rule d/c itself is not quite enough: 1.08 at h = Δx.
                without = 0.5 * highest * limit;
                assert!(without < 1.1);
            } else {
                assert!(0.5 * highest * limit < without.max(0.9), "{D}D α = {hourglass}: ω_max {highest:e}");
            }
        }
    }
}

#[test]
fn the_explicit_limit_knows_the_stiffness_of_the_control() {
    explicit_limit([25]);
    explicit_limit([9, 9]);
    explicit_limit([5, 5, 5]);
}
