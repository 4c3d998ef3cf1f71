//! The hourglass control: an energy that vanishes for affine motion, its force, its tangent, what it conserves, and
//! what it does to the spectrum of a bar.

#![allow(clippy::print_stdout, reason = "the measured table is a result, shown by --nocapture")]

mod support;

use std::path::Path;

use nalgebra::{DMatrix, SymmetricEigen};
use nicolson::geometry::{BoxLattice, Layout};
use nicolson::material::Material;
use nicolson::model::{CheckPoint, Model, Noise, Terms, Unknowns};
use nicolson::scene::Scene;
use nicolson::setup::*;
use nicolson::tensor::{Tensor, Vector, vector_at};
use nicolson_solvers::nonlinear::NonlinearProblem;
use nicolson_solvers::time::{StageSystem, System};
use support::scenes::{distance, number, orders, outcome, prepared, report};
use support::{fluid, linear, particles, setup};

const SPACING: f64 = 0.25;
const ALONE: Terms = Terms { hourglass: true, ..Terms::NONE };

/// A free body on a perturbed lattice.
fn model<const D: usize>(counts: [usize; D], shake: f64, hourglass: f64) -> Model<D> {
    let mut setup = setup(particles(counts, SPACING, shake), SPACING, linear());
    setup.bodies[0].hourglass = hourglass;
    Model::new(setup, None, Some(1.0)).expect("model")
}

/// State with given displacements.
fn displaced<const D: usize>(model: &mut Model<D>, place: impl Fn(&Vector<D>) -> Vector<D>) -> Vec<f64> {
    let mut state = model.initial_state().expect("state");
    for (a, x) in model.setup().particles.positions.iter().enumerate() {
        for i in 0..D {
            state[a * D + i] = place(x)[i] - x[i];
        }
    }
    state
}

fn random<const D: usize>(model: &mut Model<D>, amount: f64, seed: u64) -> Vec<f64> {
    let mut state = model.initial_state().expect("state");
    let (n, mut noise) = (model.particles() * D, Noise::new(seed));
    state[..n].iter_mut().for_each(|u| *u += amount * noise.next());
    state
}

fn forces<const D: usize>(model: &mut Model<D>, state: &[f64]) -> Vec<f64> {
    let mut out = Vec::new();
    model.select_terms(ALONE);
    model.forces_at(0.0, state, &mut out).expect("forces");
    model.select_terms(Terms::ALL);
    out
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

fn digits(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:.2e}")).collect::<Vec<_>>().join(" ")
}

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
        setup.bodies[0].hourglass = 2.0;
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

fn tangent_is_exact<const D: usize>(counts: [usize; D]) {
    let stabilisation = Stabilisation {
        tau_v: 0.5,
        tau_p: 0.7,
        deformed_wave_speed: true,
        corrected_gradient: false,
        interface: InterfaceChoice::Constant,
        stress_jump: false,
    };
    for (law, stabilisation) in [(linear(), None), (fluid(), None), (fluid(), Some(stabilisation))] {
        for unknowns in [None, Some(Unknowns::VelocityJacobian), Some(Unknowns::Full)] {
            let mut setup = setup(particles(counts, SPACING, 0.1), SPACING, law);
            setup.bodies[0].hourglass = 1.7;
            setup.stabilisation = stabilisation;
            for (constraint, x) in setup.constraints.iter_mut().zip(&setup.particles.positions) {
                if x[D - 1] == 0.0 {
                    constraint[D - 1] = Constraint::Fixed;
                }
            }
            setup.constraints[0] = [Constraint::Fixed; D];
            let mut model = Model::<D>::new(setup, unknowns, None).expect("model");
            let what = format!("{D}D {law:?} {stabilisation:?} {:?}", model.unknowns());
            let state = model.initial_state().expect("state");
            let at = model.check_point(0.0, 0.02, &state, 0.04, 3).expect("check point");
            let selections = model.term_selections();
            assert!(selections.iter().any(|(name, _)| *name == "hourglass"));
            for selection in selections {
                let report = model.taylor(&at, selection, &[1e-2, 1e-3, 1e-4, 1e-5], 11).expect("Taylor");
                for block in &report.blocks {
                    assert!(block.deviation(200.0) < 0.01, "{what}, {}: {block:?}", selection.0);
                    assert!(selection.0 != "hourglass" || block.is_linear(), "{what}: {block:?}");
                }
            }
            let mut points = vec![at.clone()];
            if model.unknowns() == Unknowns::Velocity {
                points.push(CheckPoint { conserving: true, ..at });
            }
            for at in points {
                let differences = model.compare_with_differences(&at).expect("differences");
                assert!(differences.largest_error < 2e-6, "{what}: {differences:?}");
                assert!(differences.outside_pattern < 1e-9, "{what}: {differences:?}");
                model.linearise(&at.unknowns).expect("linearise");
                let matrix = model.tangent_matrix();
                let mut noise = Noise::new(5);
                let v: Vec<f64> = at.unknowns.iter().map(|_| noise.next()).collect();
                let (mut action, mut product) = (vec![0.0; v.len()], vec![0.0; v.len()]);
                model.tangent().apply(&v, &mut action);
                matrix.apply(&v, &mut product);
                let error = distance(&product, &action);
                assert!(error < 1e-12, "{what}: action and entries differ by {error:e}");
            }
        }
    }
}

#[test]
fn the_tangent_is_exact_in_one_dimension() {
    tangent_is_exact([12]);
}

#[test]
fn the_tangent_is_exact_in_two_dimensions() {
    tangent_is_exact([6, 5]);
}

#[test]
fn the_tangent_is_exact_in_three_dimensions() {
    tangent_is_exact([4, 3, 3]);
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
fn a_spinning_body_keeps_its_momenta() {
    let base = [
        ("boundary", "[]"),
        ("body.0.spacing", "0.5"),
        ("body.0.hourglass", "2"),
        ("initial.velocity", r#"["-2*(Y-2.5) + 0.5*(X-1.5)^2 + 0.3", "2*(X-1.5) - 0.2*(Y-2.5)"]"#),
        ("time.end", "0.5"),
        ("time.scheme", "midpoint"),
        ("newton.relative_tolerance", "1e-13"),
    ];
    let report = report("impact-hyperelastic", &[&base[..], &[("stabilisation.tau_v", "0")]].concat());
    let (linear, angular) = (report.linear_momentum_drift.unwrap(), report.angular_momentum_drift.unwrap());
    println!("spinning block, mid-point: linear momentum drifts by {linear:.1e}, angular by {angular:.1e}");
    assert!(linear < 1e-13 && angular < 1e-13, "{linear:e} {angular:e}");
    assert!(report.energy.hourglass_max_fraction.unwrap() > 0.01, "the control must be at work");
}

#[test]
fn the_energy_momentum_scheme_conserves_the_total() {
    let base = [
        ("boundary", "[]"),
        ("body.0.hourglass", "2"),
        ("initial.velocity", r#"["-2*(Y-2.5) + 0.5*(X-1.5)^2", "2*(X-1.5)"]"#),
        ("time.scheme", "energy_momentum"),
        ("time.end", "1"),
    ];
    let plain = [("stabilisation.tau_v", "0")];
    for (name, more) in [
        ("impact-hyperelastic", [("body.0.spacing", "0.5"), ("time.step", "0.05")]),
        ("impact-elastic", [("body.0.spacing", "0.5"), ("time.step", "0.1")]),
    ] {
        let report = report(name, &[&base[..], &more, &plain].concat());
        let (drift, fraction) = (report.energy.max_relative_drift.unwrap(), report.energy.hourglass_max_fraction);
        println!("{name}, energy–momentum: |ΔE|/E {drift:.1e}, hourglass fraction {fraction:.2?}");
        assert!(drift < 1e-10, "{name}: {drift:e}");
        assert!(fraction.unwrap() > 0.01, "{name}: the control must be at work");
    }
    let velocity = r#"["0.3*Y*Z", "-0.2*X^2", "-0.5*sin(pi*Z/5)*(1+X*Y)"]"#;
    let block = [("hourglass", "2"), ("time.scheme", "energy_momentum"), ("initial.velocity", velocity)];
    let more = [("boundary", "[]"), ("time.end", "0.1"), ("time.step", "0.01"), ("body.0.spacing", "0.5")];
    let report = report("block-piston", &[&block[..], &more].concat());
    let drift = report.energy.max_relative_drift.unwrap();
    println!("3D block, energy–momentum: |ΔE|/E {drift:.1e}, {:.2?}", report.energy.hourglass_max_fraction);
    assert!(drift < 1e-10, "{drift:e}");
    assert!(report.energy.hourglass_max_fraction.unwrap() > 0.01, "the control must be at work");
}

#[test]
fn a_linear_scene_stays_linear_and_its_tangent_symmetric() {
    let control = [("hourglass", "2"), ("body.0.smoothing", "1.2")];
    let report = report("bar-smooth", &control);
    assert_eq!(report.newton.iterations, report.steps.accepted);
    assert_eq!((report.linear.analyses, report.linear.factorisations), (1, 1));
    assert!(report.energy.max_relative_drift.unwrap() < 1e-11, "{:?}", report.energy);
    let model = prepared::<1>("bar-smooth", &control).model;
    assert!(model.is_linear());
    assert_eq!(
        nicolson_solvers::linear::Tangent::symmetry(&model),
        nicolson_solvers::linear::Symmetry::PositiveDefinite
    );
}

#[test]
fn explicit_and_implicit_agree() {
    let base = [("hourglass", "2"), ("time.end", "0.25"), ("body.0.spacing", "0.5")];
    let run = |scheme: &str, step: &str| {
        outcome("impact-hyperelastic", &[&base[..], &[("time.scheme", scheme), ("time.step", step)]].concat()).state
    };
    let n = run("rk4", "0.0025");
    let particles = n.len() / 5;
    let gap = |step: &str| distance(&n[..2 * particles], &run("crank_nicolson", step)[..2 * particles]);
    let gaps = [gap("0.0125"), gap("0.00625")];
    println!("Crank–Nicolson against RK4, displacements: {}", digits(&gaps));
    assert!(gaps[1] < 1e-3, "{gaps:?}");
    assert!((orders(&[2.0, 1.0], &gaps)[0] - 2.0).abs() < 0.2, "{gaps:?}");
}

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
    let law = Material::linear_volumetric(1.0, 1.0);
    let lattice = BoxLattice::with_counts([0.0], [1.0], [count], Layout::Vertex).expect("a lattice");
    let mut setup = setup(lattice.particles(), spacing, law);
    setup.bodies[0].smoothing = smoothing;
    setup.bodies[0].weights = weights;
    setup.bodies[0].hourglass = hourglass;
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
            setup.bodies[0].hourglass = hourglass;
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
fn what_is_off_costs_nothing() {
    assert!(prepared::<2>("impact-elastic", &[]).model.hourglass().is_none());
    assert!(prepared::<1>("bar-smooth", &[("hourglass", "0")]).model.hourglass().is_none());
    let on = prepared::<1>("bar-smooth", &[("hourglass", "1")]);
    let pairs = on.model.gradient().neighbourhood.pairs();
    assert_eq!(on.model.hourglass().map(|control| control.entries()), Some(pairs));
    let report = report("bar-smooth", &[("time.end", "0.1")]);
    assert_eq!(report.energy.hourglass_max_fraction, None);
}

#[test]
fn one_body_may_have_it_and_another_not() {
    let mut two = setup(particles([6, 5], SPACING, 0.1), SPACING, linear());
    let count = two.particles.positions.len();
    let mut other = particles([6, 5], SPACING, 0.1);
    two.particles.positions.append(&mut other.positions);
    two.particles.volumes.append(&mut other.volumes);
    two.particles.kernel_volumes.append(&mut other.kernel_volumes);
    two.bodies.push(Body { particles: count..2 * count, hourglass: 2.0, ..two.bodies[0].clone() });
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

const SCENE: &str = "dimension = 2\nHERE\n[[body]]\nspacing = 0.5\nshape.box = { lower = [0, 0], upper = [2, 2] }\nBODY\n\
                     material.linear_volumetric = { density = 1000, bulk_modulus = 1e6 }\n[time]\nend = 1\nstep = 0.1\n";

fn read(scene: &str, body: &str) -> Result<(f64, Vec<String>), String> {
    let text = SCENE.replace("HERE", scene).replace("BODY", body);
    let scene = Scene::parse(&text, "scene.toml", Path::new(""), &[]).map_err(|errors| errors.to_string())?;
    let (setup, warnings) = scene.setup::<2>().map_err(|errors| errors.to_string())?;
    Ok((setup.bodies[0].hourglass, warnings))
}

#[test]
fn scenes_choose_it() {
    assert_eq!(read("", "").unwrap(), (0.0, vec![]), "a fluid has none");
    assert_eq!(read("hourglass = \"none\"", "").unwrap(), (0.0, vec![]));
    assert_eq!(read("hourglass = false", "").unwrap().0, 0.0);
    assert_eq!(read("hourglass = 1", "").unwrap().0, 1.0);
    assert_eq!(read("hourglass = 0.5", "hourglass = 2.5").unwrap().0, 2.5, "the body wins");
    assert_eq!(read("hourglass = 0.5", "hourglass = \"none\"").unwrap().0, 0.0);
    let (_, warnings) = read("hourglass = 0.5", "").unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("fluid") && warnings[0].contains(":2:"), "{warnings:?}");
    for (wrong, word) in [
        ("-1", "zero or positive"),
        ("nan", "zero or positive"),
        ("inf", "zero or positive"),
        ("true", "coefficient"),
        ("\"some\"", "coefficient"),
        ("[1]", "coefficient"),
    ] {
        for (place, line) in [(true, ":2:"), (false, ":6:")] {
            let key = format!("hourglass = {wrong}");
            let outcome = if place { read(&key, "") } else { read("", &key) };
            let error = outcome.expect_err(wrong);
            assert!(error.contains(line) && error.contains(word), "{error}");
        }
    }
}

#[test]
fn much_energy_in_the_control_is_said_once() {
    let saw = [("hourglass", "1"), ("body.0.smoothing", "1.2"), ("time.end", "0.2")];
    let smooth = report("bar-smooth", &saw);
    let warnings = |report: &nicolson::output::Report| -> Vec<String> {
        report.warnings.iter().filter(|warning| warning.contains("hourglass control")).cloned().collect()
    };
    assert_eq!(warnings(&smooth), Vec::<String>::new());
    assert!(smooth.energy.hourglass_max_fraction.unwrap() < 1e-3, "{:?}", smooth.energy);
    let step = number(0.002);
    let rough =
        report("bar-smooth", &[&saw[..], &[("initial.velocity", "[\"cos(4*pi*X)\"]"), ("time.step", &step)]].concat());
    let fraction = rough.energy.hourglass_max_fraction.unwrap();
    println!(
        "smooth {:.1e}, sawtooth {fraction:.2}: {:?}",
        smooth.energy.hourglass_max_fraction.unwrap(),
        warnings(&rough)
    );
    assert!(fraction > 0.05);
    let warnings = warnings(&rough);
    assert_eq!(warnings.len(), 1);
    for word in ["at t = ", " %", "lower `hourglass`"] {
        assert!(warnings[0].contains(word), "{warnings:?}");
    }
}
