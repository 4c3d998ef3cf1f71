use std::sync::Arc;

use super::super::surface::tests::round;
use super::super::{Surface, Triangle};
use super::*;
use crate::tensor::outer;

/// What must hold for every filled region: returns volume error and distance of the centres, in spacings.
fn check<const D: usize>(lattice: &CutLattice<D>, volume: f64, centre: Vector<D>) -> (CutReport, f64, f64) {
    let (particles, report) = lattice.particles().unwrap();
    let found: f64 = particles.volumes.iter().sum();
    let moment: Vector<D> = particles.positions.iter().zip(&particles.volumes).map(|(x, v)| x * *v).sum();
    if report.has_faces {
        let (mut open, mut enclosed) = (Vector::<D>::zeros(), Tensor::<D>::zeros());
        for face in &particles.faces {
            open += face.normal * face.area;
            enclosed += outer(&face.normal, &(face.point - centre)) * face.area;
            assert!((face.normal.norm() - 1.0).abs() < 1e-12);
        }
        assert!(open.norm() < 1e-11, "{open}");
        assert!((enclosed - Tensor::identity() * found).norm() < 1e-10 * found, "{enclosed} {found}");
    }
    let cell = lattice.spacing().powi(D as i32);
    let least = particles.volumes.iter().fold(f64::INFINITY, |least, v| least.min(v / cell));
    assert!(report.thin > 0 || least > 0.49, "{least}");
    (report.clone(), report.found / volume - 1.0, (moment / found - centre).norm() / lattice.spacing())
}

fn flat<const D: usize>(region: Region<D>, spacing: f64) -> CutLattice<D> {
    CutLattice::new(region, spacing, Tensor::identity(), None).unwrap()
}

fn inside(triangles: Vec<Triangle>) -> Region<3> {
    Region::Inside(Arc::new(Surface::new(triangles)))
}

/// An L of unit width with arms of length 3 and 2, not on the planes of any lattice.
pub fn bracket() -> Vec<Triangle> {
    let outline = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let at = |[x, y]: [f64; 2], z: f64| -> Vector<3> { [x, y, z].into() };
    let mut triangles = Vec::new();
    for (k, a) in outline.iter().enumerate() {
        let b = &outline[(k + 1) % 6];
        triangles.push([at(*a, 0.0), at(*b, 0.0), at(*b, 1.0)]);
        triangles.push([at(*a, 0.0), at(*b, 1.0), at(*a, 1.0)]);
    }
    for [i, j, k] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
        triangles.push([at(outline[i], 1.0), at(outline[j], 1.0), at(outline[k], 1.0)]);
        triangles.push([at(outline[i], 0.0), at(outline[k], 0.0), at(outline[j], 0.0)]);
    }
    triangles
}

#[test]
fn volumes_at_twenty_particles_across() {
    use std::f64::consts::PI;
    let none = Vector::<3>::zeros();
    let ball = Region::Shell { centre: none, inner: 0.0, outer: 1.0 };
    let (report, off, centre) = check(&flat(ball, 0.1), 4.0 / 3.0 * PI, none);
    assert!(off.abs() < 5e-4 && centre < 1e-9 && report.has_faces, "{off} {centre}");
    // The same as triangles: those of the surface, exactly, and 0.5 % of the ball itself.
    let sphere = inside(round(80, 40, None));
    let exact = sphere.volume().unwrap();
    let (report, off, centre) = check(&flat(sphere, 0.1), exact, none);
    assert!(off.abs() < 1e-5 && centre < 1e-4 && report.has_faces, "{off} {centre}");
    assert!((exact / (4.0 / 3.0 * PI) - 1.0).abs() < 5e-3);
    let torus = inside(round(100, 50, Some(0.4)));
    let (report, off, centre) = check(&flat(torus, 2.8 / 20.0), 2.0 * PI * PI * 0.16, none);
    assert!(off.abs() < 5e-3 && centre < 1e-2 && report.has_faces, "{off} {centre}");
    let middle = Vector::from([(3.0 * 1.5 + 0.5) / 4.0, (3.0 * 0.5 + 1.5) / 4.0, 0.5]);
    let (report, off, centre) = check(&flat(inside(bracket()), 3.0 / 20.0), 4.0, middle);
    assert!(off.abs() < 1e-5 && centre < 1e-4 && report.has_faces, "{off} {centre}");
    assert_eq!(report.thin, 0);
}

#[test]
fn set_operations_and_turned_lattices() {
    use std::f64::consts::PI;
    let square = Region::<2>::Box { lower: [-1.0, -1.0].into(), upper: [1.0, 1.0].into() };
    let hole = Region::Shell { centre: Vector::zeros(), inner: 0.0, outer: 0.3 };
    let plate = Region::Difference(vec![square.clone(), hole]);
    let (_, off, centre) = check(&flat(plate.clone(), 0.1), 4.0 - PI * 0.09, Vector::zeros());
    assert!(off.abs() < 1e-5 && centre < 1e-9, "{off} {centre}");
    let (sin, cos) = 0.3_f64.sin_cos();
    let turn = Tensor::<2>::new(cos, -sin, sin, cos);
    let (_, off, centre) = check(&CutLattice::new(plate, 0.1, turn, None).unwrap(), 4.0 - PI * 0.09, Vector::zeros());
    assert!(off.abs() < 1e-4 && centre < 1e-3, "{off} {centre}");
    // Two boxes that touch are one: no faces between them.
    let left = Region::<3>::Box { lower: [0.0, 0.0, 0.0].into(), upper: [1.0, 1.0, 1.0].into() };
    let right = Region::<3>::Box { lower: [1.0, 0.0, 0.0].into(), upper: [2.0, 1.0, 1.0].into() };
    let both = flat(Region::Union(vec![left, right]), 0.25);
    let (report, off, _) = check(&both, 2.0, [1.0, 0.5, 0.5].into());
    assert!(off.abs() < 1e-12 && report.merged == 0);
    let particles = both.particles().unwrap().0;
    assert_eq!(particles.positions.len(), 8 * 4 * 4);
    assert!((particles.faces.iter().map(|face| face.area).sum::<f64>() - 10.0).abs() < 1e-12);
    assert!(particles.faces.iter().all(|face| face.side.is_some()));
    // The same as the lattice of a box.
    let whole = super::super::BoxLattice::with_spacing([-1.0; 2], [1.0; 2], 0.2, super::super::Layout::Cell);
    let (cut, whole) = (flat(square, 0.2).particles().unwrap().0, whole.unwrap().particles());
    assert_eq!(cut.positions.len(), whole.positions.len());
    assert!(cut.positions.iter().zip(&whole.positions).all(|(a, b)| (a - b).norm() < 1e-14));
    assert_eq!(cut.faces.len(), whole.faces.len());
}

#[test]
fn open_surfaces_are_filled_without_faces() {
    let closed = round(60, 30, None);
    let open: Vec<Triangle> = closed.iter().enumerate().filter(|(i, _)| i % 97 != 5).map(|(_, t)| *t).collect();
    let lattice = flat(inside(open), 0.2);
    let (report, off, centre) = check(&lattice, Surface::new(closed).volume(), Vector::zeros());
    assert!(!report.has_faces && report.exact.is_none());
    assert!(off.abs() < 5e-3 && centre < 0.1, "{off} {centre}");
    // Two spheres that overlap are closed, but count twice where they meet.
    let mut twice = round(30, 15, None);
    twice.extend(round(30, 15, None).into_iter().map(|t| t.map(|x| x + Vector::from([0.5, 0.0, 0.0]))));
    let (particles, report) = flat(inside(twice), 0.2).particles().unwrap();
    assert!(!report.has_faces);
    let lens = std::f64::consts::PI / 12.0 * (4.0 + 0.5) * (2.0_f64 - 0.5).powi(2);
    let union = 8.0 / 3.0 * std::f64::consts::PI - lens;
    // As much less as the polyhedron holds less than the ball.
    let union = union * Surface::new(round(30, 15, None)).volume() / (4.0 / 3.0 * std::f64::consts::PI);
    let off = particles.volumes.iter().sum::<f64>() / union - 1.0;
    assert!(off.abs() < 0.01, "{off}");
}

#[test]
fn impossible_regions_are_refused() {
    let plane = Region::<2>::HalfSpace { point: Vector::zeros(), normal: [0.0, 1.0].into() };
    let new = |region, spacing| CutLattice::new(region, spacing, Tensor::identity(), None);
    assert_eq!(new(plane, 0.1).unwrap_err(), CutError::Unbounded(0));
    let disc = |x: f64| Region::<2>::Shell { centre: [x, 0.0].into(), inner: 0.0, outer: 1.0 };
    for spacing in [0.0, -1.0, f64::NAN, 3.0] {
        assert!(matches!(new(disc(0.0), spacing), Err(CutError::Spacing { .. })));
    }
    assert_eq!(new(Region::Intersection(vec![disc(0.0), disc(3.0)]), 0.1).unwrap_err(), CutError::Empty);
    let nothing = new(Region::Difference(vec![disc(0.0), disc(0.0)]), 0.1).unwrap();
    assert_eq!(nothing.particles().unwrap_err(), CutError::Empty);
}
