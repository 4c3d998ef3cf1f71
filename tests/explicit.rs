//! The explicit path: the sweeps over blocks give what the sweeps that every other path takes give, whether rows
//! repeat or not, in every dimension.

#![allow(clippy::print_stdout, reason = "the measured differences are a result, shown by --nocapture")]

mod support;

use nicolson::simulation::Prepared;
use nicolson_solvers::time::{RatePart, System};
use support::scenes::prepared;

/// A state in general position.
fn shaken<const D: usize>(prepared: &Prepared<D>) -> Vec<f64> {
    let n = prepared.model.particles();
    let mut state = prepared.state.values.clone();
    for (i, value) in state.iter_mut().enumerate() {
        let size = if i < n * D { 1e-3 } else { 1e-2 };
        *value += size * (1.7 * i as f64).sin();
    }
    state
}

fn rates_are_forces_over_masses<const D: usize>(name: &str, overrides: &[(&str, &str)], lattice: bool) {
    let mut prepared = prepared::<D>(name, overrides);
    let mut state = shaken(&prepared);
    let model = &mut prepared.model;
    model.impose(0.0, &mut state);
    let n = model.particles();
    let [own, transposed] = model.gradient().in_runs();
    println!("{name}: {n} particles, {own} in runs, {transposed} of the transpose");
    assert_eq!(lattice, own > 0 && transposed > 0, "{name}");
    let (mut rate, mut forces) = (vec![0.0; state.len()], Vec::new());
    model.rate(0.0, &state, &mut rate).expect("inside the domain");
    model.forces_at(0.0, &state, &mut forces).expect("inside the domain");
    let largest = forces.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    assert!(largest > 0.0, "{name}");
    for (i, force) in forces.iter().enumerate() {
        let (a, acceleration) = (i / D, rate[n * D + i]);
        let free = prepared.model.setup().constraints[a][i % D] == nicolson::setup::Constraint::Free;
        let expected = if free { *force } else { 0.0 };
        let found = acceleration * prepared.model.masses()[a];
        assert!((found - expected).abs() <= 1e-12 * largest, "{name}: {found:e} for {expected:e}");
    }
    assert_eq!(rate[..n * D], state[n * D..2 * n * D], "{name}");
    for a in 0..n {
        let gradient = |field: &[f64]| prepared.model.gradient().of(a, field);
        let f = nicolson::tensor::Tensor::<D>::identity() + gradient(&state[..n * D]);
        let l = gradient(&state[n * D..2 * n * D]);
        // Where J is det F, there is nothing to integrate.
        let evolved = prepared.model.evolves_volume(a);
        let expected = if evolved { nicolson::tensor::contract(&nicolson::tensor::cofactor(&f), &l) } else { 0.0 };
        let found = rate[2 * n * D + a];
        assert!(
            (found - expected).abs() <= 1e-13 * (1.0 + l.norm()),
            "{name}, particle {a}: {found:e} for {expected:e}"
        );
    }
    // The parts are the parts of the whole, to the bit.
    let mut parts = vec![0.0; state.len()];
    for part in [RatePart::Velocities, RatePart::Others] {
        prepared.model.rate_part(part, 0.0, &state, &mut parts).expect("inside the domain");
    }
    assert_eq!(parts, rate, "{name}");
}

#[test]
fn blocks_give_the_rates_of_single_particles() {
    rates_are_forces_over_masses::<1>("bar-smooth", &[], true);
    rates_are_forces_over_masses::<2>("piston-hyperelastic", &[("body.0.spacing", "0.1")], true);
    rates_are_forces_over_masses::<2>("piston-hyperelastic", &[("body.0.perturb", "{ amount = 0.1 }")], false);
    rates_are_forces_over_masses::<2>("impact-hyperelastic", &[("body.0.spacing", "0.1")], true);
    rates_are_forces_over_masses::<3>("block-piston", &[("body.0.shape.box.upper", "[6.0, 1.0, 2.5]")], true);
    rates_are_forces_over_masses::<3>("block-piston", &[], false);
}
