//! The energy vanishes for affine motion, and the force is its slope: it keeps both momenta.

use nicolson::model::{Model, Noise};
use nicolson::setup::*;
use nicolson::tensor::{Tensor, Vector, vector_at};

use super::support::scenes::orders;
use super::support::{linear, particles, setup};
use super::{SPACING, digits, displaced, forces, largest, model, random};

fn affine_is_free<const D: usize>(counts: [usize; D]) {
    let mut model = model(counts, 0.2, 2.0);
    let mut noise = Noise::new(4);
    let slope = Tensor::<D>::identity() + Tensor::from_fn(|_, _| 0.5 * noise.next());
    let affine = displaced(&mut model, |x| slope * x + Vector::repeat(0.3));
    let shaken = random(&mut model, SPACING, 9);
    let (none, some) = (forces(&mut model, &affine), forces(&mut model, &shaken));
    let (zero, one) = (model.energies(&affine).hourglass, model.energies(&shaken).hourglass);
    println!("{D}D affine: force {:.1e}, energy {:.1e}", largest(&none) / largest(&some), zero / one);
    assert!(largest(&none) < 1e-13 * largest(&some));
    assert!(one > 0.0 && zero < 1e-26 * one);
}

#[test]
fn affine_motion_costs_nothing() {
    affine_is_free([23]);
    affine_is_free([9, 8]);
    affine_is_free([6, 5, 7]);
}

#[test]
fn the_energy_of_a_quadratic_field_falls_with_the_square_of_the_spacing() {
    let fraction = |count: usize| {
        let spacing = 1.0 / (count - 1) as f64;
        let mut setup = setup(particles([count], spacing, 0.0), spacing, linear());
        setup.bodies[0].hourglass = Some(2.0);
        let mut model = Model::<1>::new(setup, None, None).expect("model");
        let state = displaced(&mut model, |x| x + x * (0.05 * x[0]));
        // J starts as det F in a state that is set up so; here it is put in by hand.
        let mut state = state;
        for a in 0..count {
            state[2 * count + a] = 1.0 + model.gradient().of(a, &state[..count])[(0, 0)];
        }
        let energies = model.energies(&state);
        energies.hourglass / energies.internal
    };
    let counts = [21, 41, 81];
    let found = counts.map(fraction);
    let found_orders = orders(&counts.map(|n| 1.0 / (n - 1) as f64), &found);
    println!("quadratic field, Π over the internal energy: {}, orders {found_orders:.2?}", digits(&found));
    assert!(found_orders.iter().all(|order| (order - 2.0).abs() < 0.1), "{found_orders:?}");
}

fn force_is_the_slope_of_the_energy<const D: usize>(counts: [usize; D]) {
    let mut model = model(counts, 0.2, 1.5);
    let state = random(&mut model, 0.3 * SPACING, 2);
    let force = forces(&mut model, &state);
    for seed in 20..25 {
        let mut noise = Noise::new(seed);
        let direction: Vec<f64> = force.iter().map(|_| noise.next()).collect();
        // Π is quadratic: central differences are exact for any step.
        let at = |step: f64| {
            let mut moved = state.clone();
            moved.iter_mut().zip(&direction).for_each(|(u, d)| *u += step * d);
            model.energies(&moved).hourglass
        };
        let slope = (at(0.1) - at(-0.1)) / 0.2;
        let power: f64 = force.iter().zip(&direction).map(|(f, d)| f * d).sum();
        let size: f64 = force.iter().zip(&direction).map(|(f, d)| (f * d).abs()).sum();
        assert!((slope + power).abs() < 1e-12 * size, "{D}D: dΠ {slope:e}, force {power:e}, of {size:e}");
    }
}

#[test]
fn the_force_is_minus_the_slope_of_the_energy() {
    force_is_the_slope_of_the_energy([23]);
    force_is_the_slope_of_the_energy([8, 7]);
    force_is_the_slope_of_the_energy([5, 4, 5]);
}

fn momenta_are_kept<const D: usize>(counts: [usize; D]) {
    let mut model = model(counts, 0.2, 1.0);
    let state = random(&mut model, SPACING, 6);
    let force = forces(&mut model, &state);
    let (mut sum, mut moment, mut size, mut arm) = (Vector::<D>::zeros(), Tensor::<D>::zeros(), 0.0, 0.0);
    for a in 0..model.particles() {
        let (f, x) = (vector_at::<D>(&force, a), model.position(&state, a));
        sum += f;
        moment += x * f.transpose() - f * x.transpose();
        size += f.norm();
        arm += f.norm() * x.norm();
    }
    println!("{D}D: total force {:.1e}, total moment {:.1e}", sum.norm() / size, moment.norm() / arm);
    assert!(sum.norm() < 1e-14 * size);
    assert!(moment.norm() < 1e-14 * arm);
}

#[test]
fn forces_and_their_moments_add_up_to_zero() {
    momenta_are_kept([23]);
    momenta_are_kept([8, 9]);
    momenta_are_kept([5, 6, 4]);
}

#[test]
fn threads_do_not_change_a_bit() {
    let results: Vec<(Vec<f64>, f64)> = [1, 2, 3]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let mut model = model([40, 30], 0.2, 2.0);
                let state = random(&mut model, 0.1 * SPACING, 1);
                let force = forces(&mut model, &state);
                let energy = model.energies(&state).hourglass;
                (force, energy)
            })
        })
        .collect();
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}

#[test]
fn one_body_may_have_it_and_another_not() {
    let mut two = setup(particles([6, 5], SPACING, 0.1), SPACING, linear());
    let count = two.particles.positions.len();
    let mut other = particles([6, 5], SPACING, 0.1);
    two.particles.positions.append(&mut other.positions);
    two.particles.volumes.append(&mut other.volumes);
    two.particles.kernel_volumes.append(&mut other.kernel_volumes);
    two.bodies.push(Body { particles: count..2 * count, hourglass: Some(2.0), ..two.bodies[0].clone() });
    two.constraints = vec![[Constraint::Free; 2]; 2 * count];
    two.initial.displacement = vec![Vector::zeros(); 2 * count];
    two.initial.velocity = vec![Vector::zeros(); 2 * count];
    let mut both = Model::<2>::new(two, None, None).expect("model");
    let mut single = model([6, 5], 0.1, 2.0);
    let state = random(&mut single, 0.1, 3);
    let mut joined = both.initial_state().expect("state");
    joined[..2 * count].copy_from_slice(&state[..2 * count]);
    joined[2 * count..4 * count].copy_from_slice(&state[..2 * count]);
    let (expected, found) = (forces(&mut single, &state), forces(&mut both, &joined));
    assert!(found[..2 * count].iter().all(|f| *f == 0.0));
    let (expected, found) = (&expected[..], &found[2 * count..]);
    // The second body's separations are the same numbers, its weights too.
    assert_eq!(expected, found);
    assert_eq!(both.hourglass().map(|c| c.entries()), single.hourglass().map(|c| c.entries()));
    let at = both.check_point(0.0, 0.02, &joined, 0.01, 3).expect("check point");
    let differences = both.compare_with_differences(&at).expect("differences");
    assert!(differences.largest_error < 2e-6 && differences.outside_pattern < 1e-9, "{differences:?}");
}
