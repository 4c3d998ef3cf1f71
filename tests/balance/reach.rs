//! How far from the boundary balancing changes weights, and the order that it gives to the elastic piston.

use super::*;

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
    let text = include_str!("../../examples/piston-elastic.toml");
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
