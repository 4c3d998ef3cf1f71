//! Lattices bent into shape: a map of a box carries its cells along.
//!
//! The corners of the cells go where the map sends them; between them every cell is the multilinear image of
//! a cube (in 2D a quadrilateral), and the body is the union of these cells. Its integrals are exact:
//!
//! ```text
//! Σ_a V_a = |Ω|      Σ_a V_a X_a = ∫ X dV      Σ_f a_f N_f = 0      Σ_f a_f N_f ⊗ X_f = |Ω| I
//! ```
//!
//! `vertex` directions share volume and area by the shape functions of the cells, `V_a = ∫ φ_a dV`; in `cell`
//! directions particles sit at the centroids of the slices, and faces with a turning normal have several
//! points. With both, the moments are those of the cells for every mix of layouts: that is what balanced
//! weights ask for.

use nalgebra::SVector;

use super::lattice::{BoxLattice, Layout, advance};
use super::multilinear::{gauss, image, slope};
use crate::setup::{Face, Particles, Side};
use crate::tensor::{Vector, cofactor, determinant};

/// Pieces of a face whose normals differ by less are one piece.
const SAME_NORMAL: f64 = 1e-11;

/// A lattice with the places of the corners of its cells.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedLattice<const D: usize> {
    lattice: BoxLattice<D>,
    /// Corners of the cells, first direction fastest.
    corners: Vec<Vector<D>>,
    /// `|Ω|`, m^D.
    volume: f64,
    /// Longest edge of a cell, m.
    longest: f64,
}

/// Why a box cannot be bent like that.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MapError<const D: usize> {
    /// The map has no finite value there.
    #[error("the map sends {from:?} to {to:?}")]
    NotFinite {
        /// Place in the box, m.
        from: [f64; D],
        /// Its image.
        to: [f64; D],
    },
    /// A cell is turned inside out, or has no volume.
    #[error("the cell around {around:?} is turned inside out")]
    Folded {
        /// Place in the box, m.
        around: [f64; D],
    },
}

impl<const D: usize> MappedLattice<D> {
    /// Bends a lattice. The map is asked for the corners of the cells only.
    ///
    /// # Errors
    /// [`MapError`] if an image is not finite or a cell has no positive volume.
    pub fn new(lattice: BoxLattice<D>, map: impl Fn(Vector<D>) -> Vector<D>) -> Result<Self, MapError<D>> {
        Self::shaken(lattice, 0.0, || 0.0, map)
    }

    /// Bends a lattice whose inner corners were moved by up to `amount` spacings in every direction;
    /// `noise` gives numbers between −1 and 1. The boundary stays where it is.
    ///
    /// # Errors
    /// Those of [`MappedLattice::new`].
    pub fn shaken(
        lattice: BoxLattice<D>,
        amount: f64,
        mut noise: impl FnMut() -> f64,
        map: impl Fn(Vector<D>) -> Vector<D>,
    ) -> Result<Self, MapError<D>> {
        let (cells, spacings) = (lattice.cells(), lattice.spacings());
        let counts = cells.map(|cells| cells + 1);
        let total = counts.iter().product();
        let mut corners = Vec::with_capacity(total);
        let mut index = [0; D];
        for _ in 0..total {
            let mut from = lattice.corner(&index);
            if (0..D).all(|axis| index[axis] > 0 && index[axis] < cells[axis]) {
                from += Vector::from_fn(|axis, _| amount * spacings[axis] * noise());
            }
            let to = map(from);
            if !to.iter().all(|coordinate| coordinate.is_finite()) {
                return Err(MapError::NotFinite { from: from.into(), to: to.into() });
            }
            corners.push(to);
            advance(&mut index, &counts);
        }
        Self { lattice, corners, volume: 0.0, longest: 0.0 }.measured()
    }

    /// Measures the cells, and refuses those that are inside out.
    fn measured(mut self) -> Result<Self, MapError<D>> {
        let (mut volume, mut longest) = (0.0, 0.0_f64);
        for cell in cells(&self.lattice.cells()) {
            let corners = self.cell(&cell);
            let ends = |code: usize| SVector::from_fn(|axis, _| (code >> axis & 1) as f64);
            let smallest =
                (0..1 << D).map(|code| determinant(&slope(&corners, &ends(code)))).fold(f64::INFINITY, f64::min);
            if smallest <= 0.0 || smallest.is_nan() {
                let [low, high] = [cell, cell.map(|index| index + 1)].map(|index| self.lattice.corner(&index));
                return Err(MapError::Folded { around: ((low + high) / 2.0).into() });
            }
            for (place, weight) in gauss::<D>() {
                volume += weight * determinant(&slope(&corners, &place));
            }
            for code in 0..1_usize << D {
                for axis in (0..D).filter(|axis| code >> axis & 1 == 0) {
                    longest = longest.max((corners[code | 1 << axis] - corners[code]).norm());
                }
            }
        }
        (self.volume, self.longest) = (volume, longest);
        Ok(self)
    }

    /// The lattice before it was bent.
    pub fn lattice(&self) -> &BoxLattice<D> {
        &self.lattice
    }

    /// Volume of the body, m^D.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Edge of a cube with the volume of the average cell, m.
    pub fn mean_spacing(&self) -> f64 {
        let cells: f64 = self.lattice.cells().iter().map(|cells| *cells as f64).product();
        (self.volume / cells).powf(1.0 / D as f64)
    }

    /// Longest edge of a cell, m.
    pub fn longest_edge(&self) -> f64 {
        self.longest
    }

    /// Positions, volumes and faces; the first direction runs fastest.
    pub fn particles(&self) -> Particles<D> {
        let counts = self.lattice.counts();
        let total = counts.iter().product();
        let mut particles = Particles {
            positions: vec![Vector::zeros(); total],
            volumes: vec![0.0; total],
            kernel_volumes: Vec::with_capacity(total),
            faces: Vec::new(),
            cells: self.lattice.vertex_cells(),
        };
        let mut shifts = vec![Vector::<D>::zeros(); total];
        let mut pieces: Vec<Face<D>> = Vec::new();
        for cell in cells(&self.lattice.cells()) {
            let corners = self.cell(&cell);
            for member in self.members() {
                let particle = flat(&counts, &self.index(&cell, &member));
                let own = anchor(&member, None);
                particles.positions[particle] = image(&corners, &own);
                for (place, weight) in gauss::<D>() {
                    let share = weight * determinant(&slope(&corners, &place)) * shape(&member, &place);
                    particles.volumes[particle] += share;
                    shifts[particle] += (image(&corners, &place) - image(&corners, &sliced(&member, &place))) * share;
                }
            }
            self.faces_of(&cell, &corners, &mut pieces);
        }
        for (particle, shift) in shifts.into_iter().enumerate() {
            particles.positions[particle] += shift / particles.volumes[particle];
        }
        let mut index = [0; D];
        for volume in &particles.volumes {
            let share: f64 = (0..D).map(|axis| if self.at_end(axis, index[axis]) { 0.5 } else { 1.0 }).product();
            particles.kernel_volumes.push(volume / share);
            advance(&mut index, &counts);
        }
        particles.faces = joined(pieces);
        particles
    }

    /// Whether a particle of a vertex direction has cells on one side only.
    fn at_end(&self, axis: usize, index: usize) -> bool {
        self.lattice.layout()[axis] == Layout::Vertex && (index == 0 || index == self.lattice.cells()[axis])
    }

    /// Corners of a cell; bit `i` of their number says which end of direction `i`.
    fn cell(&self, cell: &[usize; D]) -> Vec<Vector<D>> {
        let counts = self.lattice.cells().map(|cells| cells + 1);
        let corner = |code: usize| self.corners[flat(&counts, &std::array::from_fn(|i| cell[i] + (code >> i & 1)))];
        (0..1 << D).map(corner).collect()
    }

    /// The particles that share a cell: per direction one end of it, or its middle.
    fn members(&self) -> Vec<[Member; D]> {
        let mut members = vec![[Member::Middle; D]];
        for axis in (0..D).filter(|axis| self.lattice.layout()[*axis] == Layout::Vertex) {
            let with = |end: Member| {
                members.iter().map(move |member| {
                    let mut member = *member;
                    member[axis] = end;
                    member
                })
            };
            members = with(Member::Lower).chain(with(Member::Upper)).collect();
        }
        members
    }

    fn index(&self, cell: &[usize; D], member: &[Member; D]) -> [usize; D] {
        std::array::from_fn(|axis| cell[axis] + usize::from(member[axis] == Member::Upper))
    }

    /// The pieces of boundary of a cell. In a vertex direction a piece acts on the particle's line, in
    /// a cell direction at the points of the quadrature.
    fn faces_of(&self, cell: &[usize; D], corners: &[Vector<D>], pieces: &mut Vec<Face<D>>) {
        let counts = self.lattice.counts();
        for axis in 0..D {
            let ends = [(0, Member::Lower), (self.lattice.cells()[axis] - 1, Member::Upper)];
            for (_, end) in ends.into_iter().filter(|(last, _)| cell[axis] == *last) {
                let upper = end == Member::Upper;
                let sign = if upper { 1.0 } else { -1.0 };
                let carries = |member: &&[Member; D]| member[axis] == end || member[axis] == Member::Middle;
                for member in self.members().iter().filter(carries) {
                    let particle = flat(&counts, &self.index(cell, member));
                    let mut tangential = *member;
                    tangential[axis] = end;
                    // The direction across has one point only: every second one of the rule counts twice.
                    for (mut place, weight) in gauss::<D>().into_iter().filter(|(place, _)| place[axis] < 0.5) {
                        place[axis] = if upper { 1.0 } else { 0.0 };
                        let share = 2.0 * weight * shape_across(&tangential, axis, &place);
                        let area = cofactor(&slope(corners, &place)).column(axis) * (sign * share);
                        let point = image(corners, &anchor(&tangential, Some(&place)));
                        let size = area.norm();
                        let side = Some(Side { axis, upper });
                        pieces.push(Face { particle, normal: area / size, area: size, point, side });
                    }
                }
            }
        }
    }
}

/// Where a particle sits in a cell, along one direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Member {
    Lower,
    Middle,
    Upper,
}

/// Place in the unit cube: the ends in vertex directions; in cell directions that of `free`, or the middle.
fn anchor<const D: usize>(member: &[Member; D], free: Option<&Vector<D>>) -> Vector<D> {
    Vector::from_fn(|axis, _| match member[axis] {
        Member::Lower => 0.0,
        Member::Upper => 1.0,
        Member::Middle => free.map_or(0.5, |place| place[axis]),
    })
}

/// A place of the unit cube moved to the middle of the slices, in cell directions.
fn sliced<const D: usize>(member: &[Member; D], place: &Vector<D>) -> Vector<D> {
    Vector::from_fn(|axis, _| if member[axis] == Member::Middle { 0.5 } else { place[axis] })
}

/// Share of a particle in a place of the unit cube.
fn shape<const D: usize>(member: &[Member; D], place: &Vector<D>) -> f64 {
    shape_across(member, D, place)
}

/// [`shape`] without one direction.
fn shape_across<const D: usize>(member: &[Member; D], without: usize, place: &Vector<D>) -> f64 {
    (0..D)
        .filter(|axis| *axis != without)
        .map(|axis| match member[axis] {
            Member::Lower => 1.0 - place[axis],
            Member::Upper => place[axis],
            Member::Middle => 1.0,
        })
        .product()
}

/// All cells, first direction fastest.
fn cells<const D: usize>(counts: &[usize; D]) -> impl Iterator<Item = [usize; D]> {
    let counts = *counts;
    let mut index = [0; D];
    (0..counts.iter().product::<usize>()).map(move |_| {
        let here = index;
        advance(&mut index, &counts);
        here
    })
}

fn flat<const D: usize>(counts: &[usize; D], index: &[usize; D]) -> usize {
    (0..D).rev().fold(0, |flat, axis| flat * counts[axis] + index[axis])
}

/// Pieces in the order of their particles and sides; those of one side with one normal become one, at their
/// common centre.
fn joined<const D: usize>(mut pieces: Vec<Face<D>>) -> Vec<Face<D>> {
    let key = |face: &Face<D>| (face.particle, face.side.map(|side| (side.axis, side.upper)));
    pieces.sort_by_key(key);
    let mut faces: Vec<Face<D>> = Vec::new();
    let mut start = 0;
    for piece in pieces {
        if faces.get(start).is_none_or(|first| key(first) != key(&piece)) {
            start = faces.len();
        }
        let same = |face: &&mut Face<D>| (face.normal - piece.normal).norm() <= SAME_NORMAL;
        match faces[start..].iter_mut().find(same) {
            Some(face) => {
                let both = face.normal * face.area + piece.normal * piece.area;
                let area = face.area + piece.area;
                face.point += (piece.point - face.point) * (piece.area / area);
                (face.normal, face.area) = (both.normalize(), both.norm());
            }
            None => faces.push(piece),
        }
    }
    faces
}

#[cfg(test)]
mod tests {
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
        let found =
            particles.positions.iter().zip(&particles.volumes).fold(Vector::zeros(), |sum, (x, v)| sum + x * *v);
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
            let volumes =
                |particles: &Particles<2>| [particles.volumes.clone(), particles.kernel_volumes.clone()].concat();
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
}
