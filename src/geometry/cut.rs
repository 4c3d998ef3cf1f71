//! Lattices cut by the surface of a region: cells inside are whole, those on the surface count with what is inside.
//!
//! Every cell on the surface is divided into small simplices, whose part inside is a polyhedron with corners where the
//! surface crosses their edges. The body is the union of these polyhedra, so its volumes, moments and faces agree:
//!
//! ```text
//! Σ_a V_a = |Ω|      Σ_a V_a X_a = ∫ X dV      Σ_f a_f N_f = 0      Σ_f a_f N_f ⊗ X_f = |Ω| I
//! ```
//!
//! A closed triangulated surface is its own boundary: its triangles are cut by the cells instead, exactly
//! ([`clip`](super::clip)). Where an exact volume is known, the whole is scaled to it.

use rayon::prelude::*;

use super::assemble::{CutReport, assemble};
use super::clip::clip;
use super::region::Region;
use super::simplex::{Corner, Level, Part, add_simplex, permutations};
use crate::setup::Particles;
use crate::tensor::{Tensor, Vector};

/// Values below this part of a cell are on the surface.
const ON_SURFACE: f64 = 1e-9;
/// Small cells per cell and direction; for regions whose value is expensive, the last.
const DIVISIONS: [usize; 4] = [16, 16, 4, 2];
/// A part of a cell by which a region may stick out of whole ones.
const SLACK: f64 = 1e-6;

/// A lattice of cubes, aligned with the axes or turned, around a region.
#[derive(Debug, Clone)]
pub struct CutLattice<const D: usize> {
    region: Region<D>,
    /// Whether a value asks a triangulated surface: then there are fewer of them.
    is_costly: bool,
    /// Columns are the directions of the lattice.
    turn: Tensor<D>,
    /// Lower corner in the directions of the lattice, m.
    origin: Vector<D>,
    spacing: f64,
    cells: [usize; D],
    /// Bounds of the region, in cells from the origin.
    bounds: (Vector<D>, Vector<D>),
}

/// Why a region cannot be filled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CutError {
    /// It has no end.
    #[error("the shape has no end along {axis}", axis = ["x", "y", "z"][*.0])]
    Unbounded(usize),
    /// Nothing is inside.
    #[error("nothing is inside the shape")]
    Empty,
    /// A spacing that is not positive or as large as the shape.
    #[error("a spacing of {spacing} m does not fit a shape that is {extent} m long")]
    Spacing {
        /// Distance of particles, m.
        spacing: f64,
        /// Smallest extent, m.
        extent: f64,
    },
}

impl<const D: usize> CutLattice<D> {
    /// A lattice around a region. Its cells are centred on the bounding box, whose sides are then sides of cells if
    /// the spacing divides it; with `corner`, a corner of cells lies there, m. `turn` has the directions of the lattice
    /// as columns.
    ///
    /// # Errors
    /// [`CutError`] if the region has no end, is empty, or no larger than the spacing.
    pub fn new(region: Region<D>, spacing: f64, turn: Tensor<D>, corner: Option<Vector<D>>) -> Result<Self, CutError> {
        let (lower, upper) = region.bounds();
        if let Some(axis) = (0..D).find(|axis| !(lower[*axis].is_finite() && upper[*axis].is_finite())) {
            return Err(CutError::Unbounded(axis));
        }
        let extent = (upper - lower).min();
        if extent.is_nan() || extent <= 0.0 {
            return Err(CutError::Empty);
        }
        if !(spacing > 0.0 && spacing < extent) {
            return Err(CutError::Spacing { spacing, extent });
        }
        let (lower, upper) = turned_bounds(&region, &turn, (lower, upper));
        let mut cells = [0; D];
        let mut origin = Vector::zeros();
        for axis in 0..D {
            let extent = (upper[axis] - lower[axis]) / spacing;
            match corner.map(|corner| (turn.transpose() * corner)[axis]) {
                None => {
                    let count = (extent - SLACK).ceil().max(1.0);
                    cells[axis] = count as usize;
                    origin[axis] = (lower[axis] + upper[axis] - count * spacing) / 2.0;
                }
                Some(corner) => {
                    let first = ((lower[axis] - corner) / spacing + SLACK).floor();
                    origin[axis] = corner + first * spacing;
                    cells[axis] = ((upper[axis] - origin[axis]) / spacing - SLACK).ceil().max(1.0) as usize;
                }
            }
        }
        let bounds = ((lower - origin) / spacing, (upper - origin) / spacing);
        let is_costly = has_surface(&region);
        Ok(Self { region, is_costly, turn, origin, spacing, cells, bounds })
    }

    /// An upper bound of the number of particles, as a plain number.
    pub fn approximate_count(&self) -> f64 {
        self.cells.iter().map(|count| *count as f64).product()
    }

    /// Distance of particles, m.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Cells per direction.
    pub(super) fn cells(&self) -> [usize; D] {
        self.cells
    }

    /// Bounds of the region, in cells from the origin.
    pub(super) fn bounds(&self) -> &(Vector<D>, Vector<D>) {
        &self.bounds
    }

    /// Direction of the lattice to direction in space.
    pub(super) fn direction(&self, along: &Vector<D>) -> Vector<D> {
        self.turn * along
    }

    /// Place in cells from the origin to place in space, m.
    pub(super) fn place(&self, cells: &Vector<D>) -> Vector<D> {
        self.turn * (self.origin + cells * self.spacing)
    }

    /// Place in space to place in cells from the origin.
    pub(super) fn in_cells(&self, place: &Vector<D>) -> Vector<D> {
        (self.turn.transpose() * place - self.origin) / self.spacing
    }

    /// Number of the cell with these indices; the first direction runs fastest.
    pub(super) fn number(&self, index: &[usize; D]) -> usize {
        (0..D).rev().fold(0, |number, axis| number * self.cells[axis] + index[axis])
    }

    /// Indices of a cell.
    pub(super) fn index(&self, mut number: usize) -> [usize; D] {
        std::array::from_fn(|axis| {
            let index = number % self.cells[axis];
            number /= self.cells[axis];
            index
        })
    }

    /// Fills the region.
    ///
    /// # Errors
    /// [`CutError::Empty`].
    pub fn particles(&self) -> Result<(Particles<D>, CutReport), CutError> {
        let mut is_sound = true;
        let mut parts = None;
        if let Region::Inside(surface) = &self.region {
            parts = if surface.is_closed() { clip(self, surface) } else { None };
            is_sound = parts.is_some();
        }
        let parts = parts.unwrap_or_else(|| self.divide());
        assemble(self, parts, self.region.volume(), is_sound)
    }

    /// Parts of the cells inside, in the order of their numbers.
    fn divide(&self) -> Vec<(usize, Part<D>)> {
        let divisions = DIVISIONS[if self.is_costly { 3 } else { D - 1 }];
        let rows = self.cells[1..].iter().product::<usize>();
        let row = |row: usize| {
            let cells = (row * self.cells[0]..(row + 1) * self.cells[0]).filter_map(|number| {
                let part = self.part(&self.index(number), divisions);
                (part.volume > 0.0).then_some((number, part))
            });
            cells.collect::<Vec<_>>()
        };
        (0..rows).into_par_iter().map(row).collect::<Vec<_>>().concat()
    }

    /// What is inside of a cell.
    fn part(&self, index: &[usize; D], divisions: usize) -> Part<D> {
        let lower = Vector::<D>::from_fn(|axis, _| index[axis] as f64);
        let centre = self.raw(&lower.add_scalar(0.5));
        let reach = 0.5 * (D as f64).sqrt() * (1.0 + SLACK);
        if centre >= reach {
            return Part::default();
        }
        if centre <= -reach {
            return Part::whole(&lower);
        }
        let side = divisions + 1;
        let offset = |mut code: usize, base: usize| -> [usize; D] {
            std::array::from_fn(|_| {
                let digit = code % base;
                code /= base;
                digit
            })
        };
        let samples: Vec<Corner<D>> = (0..side.pow(D as u32))
            .map(|code| {
                let at = offset(code, side);
                // A point that cells share has the same bits in all of them.
                let x = Vector::from_fn(|axis, _| index[axis] as f64 + at[axis] as f64 / divisions as f64);
                Corner { x, value: self.value(&x) }
            })
            .collect();
        if samples.iter().all(|sample| sample.value < 0.0) {
            return Part::whole(&lower);
        }
        let mut part = Part::default();
        let orders = permutations::<D>();
        for code in 0..divisions.pow(D as u32) {
            let first = offset(code, divisions);
            for order in orders {
                let mut at = first;
                let mut corners = [Corner { x: lower, value: 0.0 }; 4];
                for (step, corner) in corners.iter_mut().enumerate().take(D + 1) {
                    if step > 0 {
                        at[order[step - 1]] += 1;
                    }
                    *corner = samples[(0..D).rev().fold(0, |number, axis| number * side + at[axis])];
                }
                add_simplex(&mut part, &corners[..=D], self);
            }
        }
        part
    }

    /// The value at a place in cells, in cells.
    fn raw(&self, cells: &Vector<D>) -> f64 {
        self.region.value(&self.place(cells)) / self.spacing
    }
}

impl<const D: usize> Level<D> for CutLattice<D> {
    /// Where the surface crosses an edge between a point inside and one that is not (Illinois method).
    fn crossing(&self, a: &Corner<D>, b: &Corner<D>) -> Vector<D> {
        let (mut low, mut high) = ((0.0, a.value), (1.0, b.value));
        let at = |t: f64| a.x + (b.x - a.x) * t;
        if a.value == 0.0 {
            return a.x;
        }
        if b.value == 0.0 {
            return b.x;
        }
        if self.is_costly {
            // A distance, which is linear but for the curvature.
            return at(a.value / (a.value - b.value));
        }
        let mut t = 0.5;
        for _ in 0..40 {
            t = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let value = self.raw(&at(t));
            if value.abs() <= 1e-3 * ON_SURFACE || high.0 - low.0 < ON_SURFACE {
                break;
            }
            if (value < 0.0) == (low.1 < 0.0) {
                low = (t, value);
                high.1 /= 2.0;
            } else {
                high = (t, value);
                low.1 /= 2.0;
            }
        }
        at(t)
    }

    fn value(&self, cells: &Vector<D>) -> f64 {
        let value = self.raw(cells);
        if value.abs() > ON_SURFACE { value } else { 0.0 }
    }
}

/// Whether the value asks a triangulated surface.
fn has_surface<const D: usize>(region: &Region<D>) -> bool {
    match region {
        Region::Inside(_) => true,
        Region::Union(parts) | Region::Intersection(parts) | Region::Difference(parts) => parts.iter().any(has_surface),
        _ => false,
    }
}

/// Bounds in the directions of the lattice.
fn turned_bounds<const D: usize>(
    region: &Region<D>,
    turn: &Tensor<D>,
    bounds: (Vector<D>, Vector<D>),
) -> (Vector<D>, Vector<D>) {
    if *turn == Tensor::<D>::identity() {
        return bounds;
    }
    let none = (Vector::repeat(f64::INFINITY), Vector::repeat(f64::NEG_INFINITY));
    let widened = |(lower, upper): (Vector<D>, Vector<D>), point: Vector<D>| {
        let point = turn.transpose() * point;
        (lower.inf(&point), upper.sup(&point))
    };
    if let Region::Inside(surface) = region {
        let corners = surface.triangles().iter().flatten();
        return corners.map(|corner| Vector::from_fn(|axis, _| corner[axis])).fold(none, widened);
    }
    let corner = |code: usize| Vector::from_fn(|axis, _| if code >> axis & 1 == 0 { bounds.0 } else { bounds.1 }[axis]);
    (0..1_usize << D).map(corner).fold(none, widened)
}

#[cfg(test)]
mod tests {
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
        let (_, off, centre) =
            check(&CutLattice::new(plate, 0.1, turn, None).unwrap(), 4.0 - PI * 0.09, Vector::zeros());
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
}
