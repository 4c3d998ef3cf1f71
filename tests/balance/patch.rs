//! Force patch tests: constant and linear stresses are in balance with their boundary tractions, on every cloud.

use super::*;

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
