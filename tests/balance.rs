//! Balanced weights: exact for linear fields and for constant and linear stress, second order, local.

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
fn force_patch_test_on_trapezoids_sectors_and_shaken_cells() {
    let trapezoid = |x: Vector<2>| Vector::<2>::new(x[0], (x[1] - 2.0) * (1.0 - 0.2 * (x[0] - 3.0)));
    let sector = |x: Vector<2>| Vector::<2>::new(x[0] * (x[1] / 3.0).cos(), x[0] * (x[1] / 3.0).sin());
    for (what, shake, smoothing) in [("trapezoid", 0.0, 1.2), ("shaken trapezoid", 0.2, 1.2), ("again", 0.2, 1.5)] {
        let mapped = bent([12, 10], shake, trapezoid);
        keeps_promises(what, &mapped.particles(), mapped.mean_spacing(), smoothing);
    }
    for shake in [0.0, 0.2] {
        let mapped = bent([12, 10], shake, sector);
        keeps_promises("sector", &mapped.particles(), mapped.mean_spacing(), 1.2);
        let mapped = bent([12, 10], shake, |x| x);
        keeps_promises("shaken box", &mapped.particles(), mapped.mean_spacing(), 1.2);
    }
    let wedge =
        |x: Vector<3>| Vector::<3>::new(x[0], x[1] * (1.0 - 0.1 * (x[0] - 3.0)), x[2] * (1.0 - 0.1 * (x[0] - 3.0)));
    for shake in [0.0, 0.2] {
        let mapped = bent([6, 7, 6], shake, wedge);
        keeps_promises("wedge", &mapped.particles(), mapped.mean_spacing(), 1.2);
    }
}

/// No equations: exact on bent and shaken cells of any size, with diagonals longer than the support of the kernel.
#[test]
fn force_patch_test_with_the_weights_of_cells() {
    let cells = |what: &str, particles: &Particles<2>, spacing: f64| {
        keeps_promises_by(WeightChoice::Cells, what, particles, spacing, 1.0);
    };
    let trapezoid = |x: Vector<2>| Vector::<2>::new(x[0], (x[1] - 2.0) * (1.0 - 0.2 * (x[0] - 3.0)));
    let sector = |x: Vector<2>| Vector::<2>::new(x[0] * (x[1] / 3.0).cos(), x[0] * (x[1] / 3.0).sin());
    for shake in [0.0, 0.2, 0.25] {
        for (what, mapped) in [
            ("box", bent([12, 10], shake, |x| x)),
            ("trapezoid", bent([12, 10], shake, trapezoid)),
            ("sector", bent([12, 10], shake, sector)),
        ] {
            cells(what, &mapped.particles(), mapped.mean_spacing());
        }
        let wedge = bent([6, 7, 6], shake, |x| {
            Vector::<3>::new(x[0], x[1] * (1.0 - 0.1 * (x[0] - 3.0)), x[2] * (1.0 - 0.1 * (x[0] - 3.0)))
        });
        keeps_promises_by(WeightChoice::Cells, "wedge", &wedge.particles(), wedge.mean_spacing(), 1.0);
    }
    let bar = lattice([20], Layout::Vertex);
    keeps_promises_by(WeightChoice::Cells, "bar", &bar.particles(), bar.mean_spacing(), 1.0);
    // Where they are not those of the kernel, only the changes are larger.
    let wide = lattice([12, 10], Layout::Vertex);
    keeps_promises_by(WeightChoice::Cells, "wide kernel", &wide.particles(), wide.mean_spacing(), 1.2);
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
fn force_patch_test_on_rings_discs_and_tubes() {
    let ring =
        |radii, height, shake: f64| (RingLattice::new([1.0, 2.0], radii, height, 0.1).expect("a possible ring"), shake);
    for (lattice, shake) in [ring([0.5, 1.0], None, 0.0), ring([0.5, 1.0], None, 0.2), ring([0.0, 1.0], None, 0.0)] {
        let mut noise = Noise::new(9);
        let particles = lattice.particles::<2>(shake, || noise.next());
        keeps_promises(&format!("{lattice:?} shaken {shake}"), &particles, lattice.mean_spacing(), 1.2);
    }
    let (lattice, _) = ring([0.2, 0.5], Some([0.0, 0.5]), 0.0);
    keeps_promises("tube", &lattice.particles::<3>(0.0, || 0.0), lattice.mean_spacing(), 1.2);
}

#[test]
fn force_patch_test_in_one_dimension() {
    for smoothing in [1.0, 1.2, 1.5] {
        patch([20], 0.0, smoothing);
    }
    // A body without edges must integrate linear stress exactly; on a line the trapezoid rule does.
    let lattice = lattice([20], Layout::Vertex);
    let mut particles = cloud(&lattice, 0.15);
    trapezoid(&mut particles);
    for smoothing in [1.0, 1.2, 1.5] {
        promises(&format!("shaken bar, smoothing {smoothing}"), &lattice, &particles, smoothing);
    }
}

#[test]
fn force_patch_test_in_two_dimensions() {
    for smoothing in [1.0, 1.2, 1.5] {
        patch([11, 14], 0.0, smoothing);
        patch([11, 14], 0.1, smoothing);
        patch([11, 14], 0.2, smoothing);
    }
}

#[test]
fn force_patch_test_in_three_dimensions() {
    patch([7, 6, 8], 0.0, 1.0);
    patch([6, 6, 6], 0.0, 1.2);
    patch([7, 6, 8], 0.1, 1.0);
}

/// Where faces lie half a spacing outside the particles, forces of a constant stress stay within reach of
/// the boundary, and have the resultant and the moments of the tractions.
fn cell_patch<const D: usize>(counts: [usize; D], smoothing: f64) {
    let lattice = lattice(counts, Layout::Cell);
    let particles = lattice.particles();
    let spacing = lattice.mean_spacing();
    let gradient = gradient(&particles, spacing, smoothing, WeightChoice::Balanced).expect("enough neighbours");
    assert!(gradient_error(&gradient, &particles) < EXACT);
    let stress = general::<D>(2);
    let forces = forces(&gradient, &particles, |_| stress);
    let (mut sum, mut moment) = (Vector::<D>::zeros(), Tensor::<D>::zeros());
    let carries = |a: usize| particles.faces.iter().any(|face| face.particle == a);
    for (a, force) in forces.iter().enumerate() {
        sum += force;
        moment += force * particles.positions[a].transpose();
        if !gradient.neighbourhood.of(a).iter().any(|&b| carries(b as usize)) {
            assert!(force.amax() < EXACT * spacing.powi(D as i32 - 1), "particle {a}: {force}");
        }
    }
    let volume: f64 = particles.volumes.iter().sum();
    assert!(sum.amax() < EXACT && (moment - stress * volume).amax() < EXACT * volume.max(1.0), "{sum} {moment}");
}

#[test]
fn the_cell_layout_balances_at_a_distance() {
    cell_patch([20], 1.2);
    cell_patch([12, 10], 1.2);
    cell_patch([12, 10], 1.5);
    cell_patch([6, 6, 6], 1.2);
}

/// `(largest change of Q beside the boundary, largest change far inside)`, over the largest weight.
fn changes(count: usize, smoothing: f64) -> (f64, f64) {
    let lattice = BoxLattice::with_counts([0.0; 2], [2.5; 2], [count; 2], Layout::Vertex).expect("a possible box");
    let particles = lattice.particles();
    let build = |weights| gradient(&particles, lattice.mean_spacing(), smoothing, weights).expect("weights");
    let (seed, balanced) = (build(WeightChoice::Separate), build(WeightChoice::Balanced));
    let (mut largest, mut outer, mut inner) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (a, x) in particles.positions.iter().enumerate() {
        let volume = particles.volumes[a];
        for entry in seed.neighbourhood.row(a) {
            let change = (balanced.weights.at(a, entry) - seed.weights.at(a, entry)).amax() * volume;
            largest = largest.max(seed.weights.at(a, entry).amax() * volume);
            outer = outer.max(change);
            if x.iter().all(|x| (0.75..=1.75).contains(x)) {
                inner = inner.max(change);
            }
        }
    }
    (outer / largest, inner / largest)
}

#[test]
fn the_change_stays_at_the_boundary() {
    // At h = Δx a band is enough: the interior keeps its bits.
    for count in [21, 41] {
        let (outer, inner) = changes(count, 1.0);
        assert!(outer < 0.12 && inner == 0.0, "{count}: {outer} {inner}");
    }
    // A wider stencil moves everything a little, and no more on finer lattices.
    for count in [21, 41] {
        let (outer, inner) = changes(count, 1.2);
        assert!(outer < 0.2 && inner < 0.055, "{count}: {outer} {inner}");
    }
}

/// Part of the particles that take part, with the volumes of the cells and with those that suit the stencil.
fn bands<const D: usize>(counts: [usize; D], layout: impl Into<Layouts<D>>, smoothing: f64) -> (f64, f64) {
    let lattice = BoxLattice::with_counts([0.0; D], [1.0; D], counts, layout).expect("a possible box");
    let spacing = lattice.mean_spacing();
    let mut particles = lattice.particles();
    let part = |particles: &Particles<D>| {
        let built = gradient(particles, spacing, smoothing, WeightChoice::Auto).expect("weights");
        let report = &built.balance[0];
        assert!(gradient_error(&built, particles) < EXACT);
        if report.balanced { report.band as f64 / particles.positions.len() as f64 } else { f64::NAN }
    };
    let before = part(&particles);
    stencil_volumes(&lattice, KernelChoice::CubicSpline, smoothing * spacing, &mut particles).expect("small shares");
    (before, part(&particles))
}

#[test]
fn volumes_that_suit_the_stencil_keep_the_change_at_the_boundary() {
    for smoothing in [1.2, 1.5] {
        let (all, some) = bands([40], Layout::Vertex, smoothing);
        assert!(all == 1.0 && some == 0.4, "{all} {some}");
        let (all, some) = bands([41, 40], Layout::Vertex, smoothing);
        assert!(all == 1.0 && some < 0.76, "{all} {some}");
        let (all, some) = bands([81, 80], Layout::Vertex, smoothing);
        assert!(all == 1.0 && some < 0.44, "{all} {some}");
    }
    // Nine-point rows cannot be balanced with full cells, but with these; wider ones need no more than a band.
    let (full, suited) = bands([41, 40], Layout::Cell, 1.0);
    assert!(full.is_nan() && suited < 0.55, "{full} {suited}");
    let (full, suited) = bands([41, 40], Layout::Cell, 1.2);
    assert!(full == 1.0 && suited < 0.64, "{full} {suited}");
    // Corners of mixed layouts need more than a band, but can be balanced too.
    let (full, suited) = bands([41, 40], [Layout::Vertex, Layout::Cell], 1.0);
    assert!(full.is_nan() && suited == 1.0, "{full} {suited}");
}

#[test]
fn second_order_holds_with_volumes_that_suit_the_stencil() {
    let errors = [10, 20, 40].map(|cells| suited_piston(1.2, cells));
    for (error, measured) in errors.iter().zip([0.0342, 0.00861, 0.002163]) {
        assert!((error / measured - 1.0).abs() < 0.02, "{errors:?}");
    }
    let orders = [order(errors[0], errors[1]), order(errors[1], errors[2])];
    assert!(orders.iter().all(|order| *order > 1.9), "{errors:?} {orders:?}");
}

/// L2 error of the displacement after one period, relative to the amplitude.
fn piston(weights: &str, smoothing: f64, cells: usize) -> f64 {
    piston_with(weights, smoothing, cells, ("output.plots", "false".into()))
}

/// The same with inner particles moved by part of a spacing.
fn shaken_piston(weights: &str, smoothing: f64, cells: usize, shake: f64) -> f64 {
    piston_with(weights, smoothing, cells, ("body.0.perturb", format!("{{ amount = {shake} }}")))
}

/// The same with balanced weights and volumes that suit the stencil.
fn suited_piston(smoothing: f64, cells: usize) -> f64 {
    piston_with("balanced", smoothing, cells, ("body.0.volumes", "\"stencil\"".into()))
}

fn piston_with(weights: &str, smoothing: f64, cells: usize, more: (&str, String)) -> f64 {
    let period = 4.0 * 2.5 / (1e3_f64 / 1.4).sqrt();
    let overrides = [
        ("body.0.weights", format!("\"{weights}\"")),
        ("body.0.smoothing", smoothing.to_string()),
        ("body.0.spacing", (2.5 / cells as f64).to_string()),
        more,
        // Fourth order at a third of the stable step: the error is that of space.
        ("time.scheme", "\"rk4\"".into()),
        ("time.step", (period / (16 * cells) as f64).to_string()),
        ("time.end", period.to_string()),
        ("output.interval", period.to_string()),
    ]
    .map(|(key, value)| (key.to_owned(), value));
    let text = include_str!("../examples/piston-elastic.toml");
    let scene = Scene::parse(text, "piston-elastic.toml", Path::new("examples"), &overrides).expect("scene");
    let outcome = run(&scene, &RunOptions::default(), &mut Silent, &AtomicBool::new(false)).expect("run");
    // The mean square of sin over a quarter of a wave is a half.
    let amplitude = period / std::f64::consts::TAU / 2.0_f64.sqrt();
    outcome.report.errors["displacement"].l2 / amplitude
}

fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

#[test]
fn the_elastic_piston_converges_with_second_order() {
    // (weights, smoothing, errors measured at 11², 21², 41²)
    let table = [
        ("balanced", 1.0, [0.0259, 0.00646, 0.001615]),
        ("balanced", 1.2, [0.0262, 0.00649, 0.001618]),
        ("cells", 1.0, [0.0259, 0.00646, 0.001615]),
        ("separate", 1.0, [0.106, 0.0743, 0.0526]),
        ("single", 1.0, [0.122, 0.073, 0.048]),
    ];
    for (weights, smoothing, expected) in table {
        let errors = [10, 20, 40].map(|cells| piston(weights, smoothing, cells));
        let what = format!("{weights}, smoothing {smoothing}: {errors:?}");
        for (error, expected) in errors.iter().zip(expected) {
            assert!((error / expected - 1.0).abs() < 0.02, "{what}");
        }
        let orders = [order(errors[0], errors[1]), order(errors[1], errors[2])];
        if matches!(weights, "balanced" | "cells") {
            assert!(orders.iter().all(|order| *order > 1.9), "{what}: {orders:?}");
        } else {
            assert!(orders.iter().all(|order| *order < 0.8), "{what}: {orders:?}");
        }
    }
}

#[test]
fn the_elastic_piston_converges_on_shaken_cells() {
    let errors = [10, 20, 40].map(|cells| shaken_piston("balanced", 1.2, cells, 0.2));
    for (error, measured) in errors.iter().zip([0.0376, 0.01133, 0.00365]) {
        assert!((error / measured - 1.0).abs() < 0.02, "{errors:?}");
    }
    let orders = [order(errors[0], errors[1]), order(errors[1], errors[2])];
    assert!(orders.iter().all(|order| *order > 1.5), "{errors:?} {orders:?}");
    // Cells want no more than the nine nearest.
    let cells = [10, 20, 40].map(|cells| shaken_piston("cells", 1.0, cells, 0.2));
    for (error, measured) in cells.iter().zip([0.0405, 0.0121, 0.00322]) {
        assert!((error / measured - 1.0).abs() < 0.02, "{cells:?}");
    }
    assert!(order(cells[0], cells[1]) > 1.7 && order(cells[1], cells[2]) > 1.85, "{cells:?}");
    // The source's force does not converge there at all.
    let loose = [10, 20].map(|cells| shaken_piston("separate", 1.2, cells, 0.2));
    assert!(loose[1] > loose[0], "{loose:?}");
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
