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

mod member;

use nalgebra::SVector;

use super::lattice::{BoxLattice, Layout, advance};
use super::multilinear::{gauss, image, slope};
use crate::setup::{Face, Particles, Side};
use crate::tensor::{Vector, cofactor, determinant};
use member::{Member, anchor, shape, shape_across, sliced};

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
mod tests;
