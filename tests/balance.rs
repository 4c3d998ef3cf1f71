//! Balanced weights: exact for linear fields and for constant and linear stress, second order, local.

#[path = "balance/patch.rs"]
mod patch;
#[path = "balance/reach.rs"]
mod reach;
mod support;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use nicolson::discretisation::{DiscretisationError, Gradient};
use nicolson::geometry::{BoxLattice, Layout, Layouts, MappedLattice, RingLattice, stencil_volumes};
use nicolson::model::{Model, Noise};
use nicolson::scene::Scene;
use nicolson::setup::*;
use nicolson::simulation::{RunOptions, Silent, run};
use nicolson::tensor::{Tensor, Vector};
use support::{linear, setup};

const EXACT: f64 = 1e-11;

/// A box away from the origin, with cells that are not quite cubes.
fn lattice<const D: usize>(counts: [usize; D], layout: Layout) -> BoxLattice<D> {
    let lower = std::array::from_fn(|i| 3.0 - i as f64);
    let upper = std::array::from_fn(|i| lower[i] + 0.1 * counts[i] as f64 * (1.0 + 0.05 * i as f64));
    BoxLattice::with_counts(lower, upper, counts, layout).expect("a possible box")
}

/// Particles of a lattice, those without a face shaken by up to `shake` spacings.
fn cloud<const D: usize>(lattice: &BoxLattice<D>, shake: f64) -> Particles<D> {
    let mut particles = lattice.particles();
    let mut noise = Noise::new(3);
    let mut inside = vec![true; particles.positions.len()];
    particles.faces.iter().for_each(|face| inside[face.particle] = false);
    for (position, _) in particles.positions.iter_mut().zip(inside).filter(|(_, inside)| *inside) {
        *position += Vector::<D>::from_fn(|_, _| noise.next() * shake * lattice.mean_spacing());
    }
    particles
}

fn gradient<const D: usize>(
    particles: &Particles<D>,
    spacing: f64,
    smoothing: f64,
    weights: WeightChoice,
) -> Result<Gradient<D>, DiscretisationError> {
    let mut bodies = setup(particles.clone(), spacing, linear()).bodies;
    bodies[0].smoothing = smoothing;
    bodies[0].weights = weights;
    Gradient::build(&bodies, particles)
}

/// `Σ_b V_b T_b g_ba` of a stress field: minus the internal force.
fn forces<const D: usize>(
    gradient: &Gradient<D>,
    particles: &Particles<D>,
    stress: impl Fn(&Vector<D>) -> Tensor<D>,
) -> Vec<Vector<D>> {
    let scaled: Vec<Tensor<D>> =
        particles.positions.iter().zip(&particles.volumes).map(|(x, volume)| stress(x) * *volume).collect();
    (0..scaled.len()).map(|a| gradient.transposed_of(a, &scaled)).collect()
}

/// Volumes of the trapezoid rule for particles on a line.
fn trapezoid(particles: &mut Particles<1>) {
    let x: Vec<f64> = particles.positions.iter().map(|x| x[0]).collect();
    for (a, volume) in particles.volumes.iter_mut().enumerate() {
        *volume = (x[(a + 1).min(x.len() - 1)] - x[a.saturating_sub(1)]) / 2.0;
    }
}

/// A tensor without symmetry, of magnitude one.
fn general<const D: usize>(seed: u64) -> Tensor<D> {
    let mut noise = Noise::new(seed);
    Tensor::from_fn(|_, _| noise.next())
}

/// Largest error of the gradients of a linear field.
fn gradient_error<const D: usize>(gradient: &Gradient<D>, particles: &Particles<D>) -> f64 {
    let slope = general::<D>(1);
    let field: Vec<f64> = particles
        .positions
        .iter()
        .flat_map(|x| (slope * x + Vector::repeat(0.7)).iter().copied().collect::<Vec<_>>())
        .collect();
    (0..particles.positions.len()).map(|a| (gradient.of(a, &field) - slope).amax()).fold(0.0, f64::max)
}

/// Everything that balanced weights promise where particles lie on the boundary.
fn patch<const D: usize>(counts: [usize; D], shake: f64, smoothing: f64) {
    let what = format!("{D}D {counts:?}, shaken by {shake}, smoothing {smoothing}");
    let lattice = lattice(counts, Layout::Vertex);
    promises(&what, &lattice, &cloud(&lattice, shake), smoothing);
}

fn promises<const D: usize>(what: &str, lattice: &BoxLattice<D>, particles: &Particles<D>, smoothing: f64) {
    keeps_promises(what, particles, lattice.mean_spacing(), smoothing);
}

/// The traction that the faces of a particle gather from a stress at their points, and the edges it is on.
fn tractions<const D: usize>(
    particles: &Particles<D>,
    stress: impl Fn(&Vector<D>) -> Tensor<D>,
) -> Vec<(Vector<D>, bool)> {
    let mut gathered = vec![(Vector::<D>::zeros(), false); particles.positions.len()];
    let mut first: Vec<Option<Vector<D>>> = vec![None; gathered.len()];
    for face in &particles.faces {
        let (sum, edge) = &mut gathered[face.particle];
        *sum += stress(&face.point) * face.normal * face.area;
        *edge |= first[face.particle].get_or_insert(face.normal).dot(&face.normal) < 0.86;
    }
    gathered
}

fn keeps_promises<const D: usize>(what: &str, particles: &Particles<D>, spacing: f64, smoothing: f64) {
    keeps_promises_by(WeightChoice::Balanced, what, particles, spacing, smoothing);
}

fn keeps_promises_by<const D: usize>(
    weights: WeightChoice,
    what: &str,
    particles: &Particles<D>,
    spacing: f64,
    smoothing: f64,
) {
    let gradient = gradient(particles, spacing, smoothing, weights).expect(what);
    let error = gradient_error(&gradient, particles);
    assert!(error < EXACT, "{what}: linear fields off by {error:e}");

    let area = spacing.powi(D as i32 - 1);
    let constant = general::<D>(2);
    let slopes: [Tensor<D>; D] = std::array::from_fn(|j| general(10 + j as u64));
    let count = particles.positions.len() as f64;
    let centre = particles.positions.iter().sum::<Vector<D>>() / count;
    // Relative to the centre, so that the stress is of magnitude one.
    let linear = |x: &Vector<D>| (0..D).fold(constant, |sum, j| sum + slopes[j] * (x - centre)[j]);
    let divergence = (0..D).fold(Vector::<D>::zeros(), |sum, j| sum + slopes[j].column(j));
    let of_constant = forces(&gradient, particles, |_| constant);
    let of_linear = forces(&gradient, particles, linear);
    let (flat, sloped) = (tractions(particles, |_| constant), tractions(particles, linear));
    for a in 0..particles.positions.len() {
        let error = (of_constant[a] - flat[a].0).amax() / area;
        assert!(error < EXACT, "{what}: particle {a} is off by {error:e} under constant stress");
        // Cells load their boundary by shape functions: a linear traction by its integral, not by its value.
        let by_value = weights == WeightChoice::Balanced || flat[a].0.norm() == 0.0;
        if by_value && (!flat[a].1 || D == 1) {
            let error = (of_linear[a] - sloped[a].0 + divergence * particles.volumes[a]).amax() / area;
            assert!(error < EXACT, "{what}: particle {a} is off by {error:e} under linear stress");
        }
    }
}

/// A bent lattice with inner corners shaken.
fn bent<const D: usize>(counts: [usize; D], shake: f64, map: impl Fn(Vector<D>) -> Vector<D>) -> MappedLattice<D> {
    let mut noise = Noise::new(5);
    MappedLattice::shaken(lattice(counts, Layout::Vertex), shake, || noise.next(), map).expect("a possible map")
}
#[test]
fn automatic_weights_are_those_of_cells_where_the_kernel_sees_no_farther_or_the_body_is_large() {
    let build = |lattice: &BoxLattice<2>, smoothing| {
        let built = gradient(&lattice.particles(), lattice.mean_spacing(), smoothing, WeightChoice::Auto);
        built.expect("weights").balance[0].clone()
    };
    let small = lattice([12, 10], Layout::Vertex);
    let report = build(&small, 1.0);
    assert!(report.balanced && report.cells && report.iterations == 0 && report.largest_change < 0.3, "{report:?}");
    assert!(!build(&small, 1.2).cells);
    // 41 000 particles have 246 000 unknowns, more than are solved for unasked.
    let report = build(&lattice([205, 200], Layout::Vertex), 1.2);
    assert!(report.balanced && report.cells && report.note.is_empty(), "{report:?}");

    let ring = RingLattice::new([0.0, 0.0], [0.5, 1.0], None, 0.1).expect("a possible ring");
    let error = gradient(&ring.particles::<2>(0.0, || 0.0), 0.1, 1.0, WeightChoice::Cells).expect_err("no cells");
    assert!(error.reason.contains("not the corners of cells") && error.remedy.contains("balanced"), "{error}");
    let mut moved = small.particles();
    moved.positions[40] *= 1.001;
    let error = gradient(&moved, small.mean_spacing(), 1.0, WeightChoice::Cells).expect_err("other volumes");
    assert!(error.reason.contains("volumes or faces"), "{error}");
}

#[test]
fn automatic_weights_are_balanced_where_that_is_possible_and_say_why_not() {
    let lattice = lattice([12, 10], Layout::Vertex);
    let mut particles = lattice.particles();
    let build =
        |particles: &Particles<2>, weights| gradient(particles, lattice.mean_spacing(), 1.2, weights).expect("weights");
    let (auto, balanced) = (build(&particles, WeightChoice::Auto), build(&particles, WeightChoice::Balanced));
    assert_eq!(auto.weights, balanced.weights);
    let report = &auto.balance[0];
    assert!(report.balanced && report.note.is_empty() && report.body == "body", "{report:?}");
    assert!(report.missed > 0 && report.band == 120 && report.unknowns == 720 && report.iterations > 0, "{report:?}");
    assert!(report.residual < EXACT && report.largest_change > 0.0 && report.largest_change < 0.5, "{report:?}");

    let separate = build(&particles, WeightChoice::Separate);
    assert!(separate.balance.is_empty());
    particles.faces.clear();
    let auto = build(&particles, WeightChoice::Auto);
    assert_eq!(auto.weights, separate.weights);
    let report = &auto.balance[0];
    assert!(!report.balanced && report.note.contains("description of the boundary"), "{report:?}");
}

#[test]
fn what_cannot_be_balanced_is_located() {
    let refused = |particles: &Particles<2>, spacing: f64, smoothing: f64| {
        gradient(particles, spacing, smoothing, WeightChoice::Balanced).expect_err("impossible")
    };
    // Nine points per row do not fit the volumes of the cell layout.
    let cells = lattice([10, 10], Layout::Cell);
    let error = refused(&cells.particles(), cells.mean_spacing(), 1.0);
    assert!(error.place.starts_with("particle ") && error.remedy.contains("raise `smoothing`"), "{error}");

    let vertices = lattice([10, 10], Layout::Vertex);
    let spacing = vertices.mean_spacing();
    // Particles that slid along the boundary while their areas and volumes stayed.
    let mut slid = vertices.particles();
    slid.positions[4][0] += 0.2 * spacing;
    slid.faces.iter_mut().filter(|face| face.particle == 4).for_each(|face| face.point[0] += 0.2 * spacing);
    let error = refused(&slid, spacing, 1.2);
    assert!(error.to_string().contains("Σ a N ⊗ X"), "{error}");

    let mut open = vertices.particles();
    open.faces.pop();
    let error = refused(&open, spacing, 1.2);
    assert!(error.place == "body `body`" && error.reason.contains("do not close"), "{error}");

    let mut heavy = vertices.particles();
    heavy.volumes.iter_mut().for_each(|volume| *volume *= 2.0);
    assert!(refused(&heavy, spacing, 1.2).reason.contains("enclose a volume"));

    let mut points = vertices.particles();
    points.faces.clear();
    let error = refused(&points, spacing, 1.2);
    assert!(error.reason.contains("description of the boundary"), "{error}");
    assert!(error.remedy.contains("weights = \"separate\""), "{error}");

    // Volumes of the even bar on a shaken one: linear stress is integrated wrongly, and there are no edges.
    let bar = lattice([20], Layout::Vertex);
    let shaken = gradient(&cloud(&bar, 0.1), bar.mean_spacing(), 1.2, WeightChoice::Balanced).expect_err("impossible");
    assert!(shaken.place.starts_with("particle "), "{shaken}");
}

/// Weights of all entries.
fn all_weights<const D: usize>(gradient: &Gradient<D>) -> Vec<Vector<D>> {
    (0..gradient.neighbourhood.len()).flat_map(|a| gradient.weights_of(a).to_vec()).collect()
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let lattice = lattice([24, 20], Layout::Vertex);
    for smoothing in [1.0, 1.2] {
        let particles = lattice.particles();
        let bits = |threads: usize| -> Vec<u64> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let found = pool
                .install(|| gradient(&particles, lattice.mean_spacing(), smoothing, WeightChoice::Balanced))
                .expect("weights");
            all_weights(&found).iter().flat_map(|w| w.iter().map(|x| x.to_bits()).collect::<Vec<_>>()).collect()
        };
        let one = bits(1);
        assert_eq!(one, bits(2));
        assert_eq!(one, bits(3));
    }
}

#[test]
fn two_bodies_are_balanced_apart() {
    let lattice = lattice([8, 9], Layout::Vertex);
    let particles = lattice.particles();
    let count = particles.positions.len();
    let mut both = particles.clone();
    both.positions.extend(particles.positions.iter().map(|x| x + Vector::repeat(0.3)));
    both.volumes.extend(&particles.volumes);
    both.kernel_volumes.extend(&particles.kernel_volumes);
    both.faces.extend(particles.faces.iter().map(|face| Face {
        particle: face.particle + count,
        point: face.point + Vector::repeat(0.3),
        ..face.clone()
    }));
    let mut setup = setup(both, lattice.mean_spacing(), linear());
    setup.bodies[0].particles = 0..count;
    setup.bodies[0].weights = WeightChoice::Separate;
    setup.bodies.push(Body { particles: count..2 * count, weights: WeightChoice::Balanced, ..setup.bodies[0].clone() });
    let model = Model::new(setup, None, None).expect("model");
    let build = |weights| gradient(&particles, lattice.mean_spacing(), 1.2, weights).expect("weights");
    let (seed, balanced) = (build(WeightChoice::Separate), build(WeightChoice::Balanced));
    let [found, seed, balanced] = [model.gradient(), &seed, &balanced].map(all_weights);
    assert_eq!(found.len(), seed.len() + balanced.len());
    assert_eq!(found[..seed.len()], seed);
    for (found, expected) in found[seed.len()..].iter().zip(&balanced) {
        assert!((found - expected).amax() < 1e-9 * expected.amax().max(1.0));
    }
}

/// Tractions on a layout whose particles lie inside are shared by the interpolation of the face: constant stress under
/// its own boundary load is an equilibrium, to rounding.
#[test]
fn tractions_on_cell_layouts_are_those_of_the_faces() {
    let text = r#"
title = "bar of cells under tension"
dimension = 2
[[body]]
counts = [8, 5]
layout = "cell"
smoothing = 1.2
weights = "balanced"
shape.box = { lower = [1.0, 0.0], upper = [2.6, 1.0] }
material.linear_elastic = { density = 1000.0, youngs_modulus = 1e6, poissons_ratio = 0.0 }
[[boundary]]
select = "all"
fix = ["y"]
[[boundary]]
select.face = "lower_x"
fix = ["x"]
[[traction]]
face = "lower_x"
value = [-1e3, 0.0]
[[traction]]
face = "upper_x"
value = [1e3, 0.0]
[time]
scheme = "static"
step = 1.0
end = 1.0
[exact]
displacement = ["1e-3*(X - 1.1)", "0"]
"#;
    let scene = Scene::parse(text, "bar.toml", Path::new("."), &[]).expect("scene");
    let outcome = run(&scene, &RunOptions::default(), &mut Silent, &AtomicBool::new(false)).expect("run");
    let error = outcome.report.errors["displacement"].linf / 1.5e-3;
    assert!(error < 1e-10, "{error:e}");
}
