use approx::assert_relative_eq;

use super::*;
use crate::tensor::Tensor;

/// What the faces enclose and what the particles add up to must agree, to the first moments.
fn consistent<const D: usize>(mapped: &MappedLattice<D>, what: &str) {
    let particles = mapped.particles();
    assert_eq!(Some(particles.positions.len()), mapped.lattice().particle_count());
    let volume: f64 = particles.volumes.iter().sum();
    assert_relative_eq!(volume, mapped.volume(), max_relative = 1e-13);
    let (mut sum, mut enclosed) = (Vector::<D>::zeros(), Tensor::<D>::zeros());
    for face in &particles.faces {
        assert_relative_eq!(face.normal.norm(), 1.0, max_relative = 1e-13);
        sum += face.normal * face.area;
        enclosed += face.normal * face.point.transpose() * face.area;
    }
    assert!(sum.norm() < 1e-13, "{what}: {sum}");
    assert!((enclosed - Tensor::identity() * volume).norm() < 1e-13 * volume.max(1.0), "{what}: {enclosed}");
    // The centroid by a quadrature of its own: four tetrahedra or triangles would be another way; the
    // product of volumes and positions must be that of the cells.
    let mut moment = Vector::<D>::zeros();
    for cell in cells(&mapped.lattice.cells()) {
        let corners = mapped.cell(&cell);
        for (place, weight) in gauss::<D>() {
            moment += image(&corners, &place) * (weight * determinant(&slope(&corners, &place)));
        }
    }
    let found = particles.positions.iter().zip(&particles.volumes).fold(Vector::zeros(), |sum, (x, v)| sum + x * *v);
    assert!((found - moment).norm() < 1e-13 * volume.max(1.0), "{what}: {found} instead of {moment}");
}

fn layouts<const D: usize>() -> Vec<[Layout; D]> {
    let layout = |bit: usize| if bit == 0 { Layout::Vertex } else { Layout::Cell };
    (0..1_usize << D).map(|code| std::array::from_fn(|axis| layout(code >> axis & 1))).collect()
}

#[test]
fn volumes_moments_and_faces_agree_in_every_layout() {
    let mut noise = 0.3;
    let mut shake = || {
        noise = (noise * 17.0 + 0.37) % 1.0;
        2.0 * noise - 1.0
    };
    for layout in layouts::<1>() {
        let lattice = BoxLattice::with_counts([0.5], [2.0], [7], layout).unwrap();
        let mapped = MappedLattice::shaken(lattice, 0.3, &mut shake, |x| x.map(|x| x * x)).unwrap();
        assert_relative_eq!(mapped.volume(), 3.75, max_relative = 1e-14);
        consistent(&mapped, "1D");
    }
    for layout in layouts::<2>() {
        let lattice = BoxLattice::with_counts([1.0, 0.0], [2.0, 1.0], [6, 5], layout).unwrap();
        let trapezoid = |x: Vector<2>| Vector::<2>::new(x[0], x[1] * (2.0 - 0.5 * x[0]));
        let mapped = MappedLattice::shaken(lattice.clone(), 0.2, &mut shake, trapezoid).unwrap();
        // Straight sides: the cells fill the trapezoid itself.
        assert_relative_eq!(mapped.volume(), 1.25, max_relative = 1e-13);
        consistent(&mapped, "trapezoid");
        let sector = |x: Vector<2>| Vector::<2>::new(x[0] * x[1].cos(), x[0] * x[1].sin());
        consistent(&MappedLattice::shaken(lattice, 0.2, &mut shake, sector).unwrap(), "sector");
    }
    for layout in layouts::<3>() {
        let lattice = BoxLattice::with_counts([0.0; 3], [1.0, 2.0, 1.0], [4, 5, 3], layout).unwrap();
        let twisted = |x: Vector<3>| {
            let (sin, cos) = (0.4 * x[1]).sin_cos();
            Vector::<3>::new(cos * x[0] - sin * x[2], x[1] + 0.1 * x[0] * x[2], sin * x[0] + cos * x[2])
        };
        consistent(&MappedLattice::shaken(lattice, 0.2, &mut shake, twisted).unwrap(), "twisted");
    }
}

#[test]
fn the_identity_gives_the_box_back() {
    for layout in layouts::<2>() {
        let lattice = BoxLattice::with_counts([1.0, 0.0], [2.0, 1.0], [6, 5], layout).unwrap();
        let (flat, mapped) = (lattice.particles(), MappedLattice::new(lattice, |x| x).unwrap().particles());
        assert_eq!(flat.faces.len(), mapped.faces.len());
        for (a, b) in flat.positions.iter().zip(&mapped.positions) {
            assert!((a - b).norm() < 1e-14);
        }
        for (a, b) in flat.faces.iter().zip(&mapped.faces) {
            assert_eq!((a.particle, a.side), (b.particle, b.side));
            assert!((a.normal * a.area - b.normal * b.area).norm() < 1e-14 && (a.point - b.point).norm() < 1e-14);
        }
        let volumes = |particles: &Particles<2>| [particles.volumes.clone(), particles.kernel_volumes.clone()].concat();
        for (a, b) in volumes(&flat).iter().zip(volumes(&mapped)) {
            assert!((a - b).abs() < 1e-15);
        }
    }
}

#[test]
fn the_end_of_a_beam_lies_on_the_cylinder() {
    let lattice = BoxLattice::with_counts([0.25, 0.19], [0.6, 0.21], [71, 5], Layout::Vertex).unwrap();
    let map = |x: Vector<2>| {
        let start = 0.2 + (0.05_f64.powi(2) - (x[1] - 0.2).powi(2)).sqrt();
        Vector::<2>::new(0.6 - (0.6 - x[0]) * (0.6 - start) / 0.35, x[1])
    };
    let particles = MappedLattice::new(lattice, map).unwrap().particles();
    let clamped: Vec<usize> = (0..5).map(|row| row * 71).collect();
    for &particle in &clamped {
        let from_centre = particles.positions[particle] - Vector::<2>::new(0.2, 0.2);
        assert_relative_eq!(from_centre.norm(), 0.05, max_relative = 1e-13);
        assert!(particles.faces.iter().any(|face| face.particle == particle
            && face.side == Some(Side { axis: 0, upper: false })
            && (face.point - particles.positions[particle]).norm() < 1e-15));
    }
    assert_relative_eq!(particles.positions[0][0], 0.248_989_795, max_relative = 1e-8);
    assert_relative_eq!(particles.positions[70][0], 0.6, max_relative = 1e-15);
}

#[test]
fn impossible_maps_are_refused() {
    let lattice = BoxLattice::with_counts([0.0; 2], [1.0; 2], [4, 4], Layout::Cell).unwrap();
    let mirrored = MappedLattice::new(lattice.clone(), |x| Vector::<2>::new(-x[0], x[1]));
    assert!(matches!(mirrored, Err(MapError::Folded { .. })));
    let pole = MappedLattice::new(lattice, |x| x.map(|x| 1.0 / x));
    assert!(matches!(pole, Err(MapError::NotFinite { .. })));
}
