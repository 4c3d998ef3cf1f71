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

mod division;

use super::assemble::{CutReport, assemble};
use super::clip::clip;
use super::region::Region;
use crate::setup::Particles;
use crate::tensor::{Tensor, Vector};

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
mod tests;
