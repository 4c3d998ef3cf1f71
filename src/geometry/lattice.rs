//! Lattices that fill a box.
//!
//! `vertex`: particles at the corners of the cells, so that the outer ones lie *on* the boundary; the
//! quadrature volume is that of the part of their cells inside the box: a half at faces, a quarter at edges,
//! an eighth at corners. `cell`: particles in the centres of the cells, with full volumes. In both, the weight
//! of the kernel sums is the volume of a cell, and the volumes add up to that of the box. Every direction may
//! have its own layout: `vertex` along a beam and `cell` across it.
//!
//! Every outer particle carries one [`Face`] per side of the box it belongs to, with its share of the area:
//! the areas of a side add up to that of the side.

use nalgebra::SVector;

use crate::setup::{Face, Particles, Side};

/// Where particles sit in the cells of a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Layout {
    /// On the corners: the outer particles lie on the boundary.
    #[default]
    Vertex,
    /// In the centres: the outer particles lie half a spacing inside.
    Cell,
}

/// The layout of every direction; one for all converts into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layouts<const D: usize>(pub [Layout; D]);

impl<const D: usize> From<Layout> for Layouts<D> {
    fn from(layout: Layout) -> Self {
        Self([layout; D])
    }
}

impl<const D: usize> From<[Layout; D]> for Layouts<D> {
    fn from(layouts: [Layout; D]) -> Self {
        Self(layouts)
    }
}

/// A box filled with a regular lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxLattice<const D: usize> {
    lower: [f64; D],
    upper: [f64; D],
    cells: [usize; D],
    layout: [Layout; D],
}

/// Why a box cannot be filled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LatticeError {
    /// A corner is not finite, or the upper one does not lie above the lower one.
    #[error("the box has no extent along {axis}: from {lower} to {upper}", axis = ["x", "y", "z"][*.axis])]
    NoExtent {
        /// Direction.
        axis: usize,
        /// Lower end, m.
        lower: f64,
        /// Upper end, m.
        upper: f64,
    },
    /// A spacing that is not a positive number.
    #[error("a spacing of {0} m is impossible")]
    Spacing(f64),
    /// Fewer than two particles in a direction: no gradient could be formed.
    #[error("{count} particle(s) along {axis}, where at least 2 are needed", axis = ["x", "y", "z"][*.axis])]
    TooFew {
        /// Direction.
        axis: usize,
        /// Particles in that direction.
        count: usize,
        /// Extent of the box in that direction, m.
        extent: f64,
    },
}

impl<const D: usize> BoxLattice<D> {
    /// A lattice with a spacing as near to the wanted one as divides the box.
    ///
    /// # Errors
    /// [`LatticeError`] if the box or the spacing is impossible.
    pub fn with_spacing(
        lower: [f64; D],
        upper: [f64; D],
        spacing: f64,
        layout: impl Into<Layouts<D>>,
    ) -> Result<Self, LatticeError> {
        let layout = layout.into().0;
        let extent = extents(&lower, &upper)?;
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(LatticeError::Spacing(spacing));
        }
        // The cast saturates; `particle_count` reports what does not fit.
        let cells = extent.map(|extent| (extent / spacing).round() as usize);
        Self { lower, upper, cells, layout }.checked()
    }

    /// A lattice with given numbers of particles per direction.
    ///
    /// # Errors
    /// [`LatticeError`] if the box is impossible or a number is less than 2.
    pub fn with_counts(
        lower: [f64; D],
        upper: [f64; D],
        counts: [usize; D],
        layout: impl Into<Layouts<D>>,
    ) -> Result<Self, LatticeError> {
        let layout = layout.into().0;
        let extent = extents(&lower, &upper)?;
        // Before the subtraction below: a vertex lattice of 0 or 1 particles has no cells.
        if let Some(axis) = counts.iter().position(|count| *count < 2) {
            return Err(LatticeError::TooFew { axis, count: counts[axis], extent: extent[axis] });
        }
        let cells = std::array::from_fn(|axis| counts[axis] - usize::from(layout[axis] == Layout::Vertex));
        Self { lower, upper, cells, layout }.checked()
    }

    fn checked(self) -> Result<Self, LatticeError> {
        let least = self.layout.map(|layout| if layout == Layout::Vertex { 1 } else { 2 });
        match (0..D).find(|axis| self.cells[*axis] < least[*axis]) {
            Some(axis) => {
                Err(LatticeError::TooFew { axis, count: self.cells[axis], extent: self.upper[axis] - self.lower[axis] })
            }
            None => Ok(self),
        }
    }

    /// Lower corner, m.
    pub fn lower(&self) -> SVector<f64, D> {
        self.lower.into()
    }

    /// Upper corner, m.
    pub fn upper(&self) -> SVector<f64, D> {
        self.upper.into()
    }

    /// Distances of neighbouring particles per direction, m.
    pub fn spacings(&self) -> [f64; D] {
        std::array::from_fn(|axis| (self.upper[axis] - self.lower[axis]) / self.cells[axis] as f64)
    }

    /// Geometric mean of the spacings, m: the edge of a cube with the volume of a cell.
    pub fn mean_spacing(&self) -> f64 {
        let spacings = self.spacings();
        // Equal spacings must come back unharmed by the root.
        if spacings.iter().all(|spacing| *spacing == spacings[0]) {
            return spacings[0];
        }
        spacings.iter().product::<f64>().powf(1.0 / D as f64)
    }

    /// Cells per direction.
    pub fn cells(&self) -> [usize; D] {
        self.cells
    }

    /// Layout per direction.
    pub fn layout(&self) -> [Layout; D] {
        self.layout
    }

    /// Number of particles; `None` if it does not fit a machine word.
    pub fn particle_count(&self) -> Option<usize> {
        (0..D).try_fold(1_usize, |product, axis| product.checked_mul(self.cells[axis].checked_add(self.more(axis))?))
    }

    /// Number of particles as a plain number, for messages about those that are too many.
    pub fn approximate_count(&self) -> f64 {
        (0..D).map(|axis| self.cells[axis] as f64 + self.more(axis) as f64).product()
    }

    /// Particles per direction.
    pub(super) fn counts(&self) -> [usize; D] {
        std::array::from_fn(|axis| self.cells[axis] + self.more(axis))
    }

    /// By how much particles outnumber cells in a direction.
    fn more(&self, axis: usize) -> usize {
        usize::from(self.layout[axis] == Layout::Vertex)
    }

    /// Positions, volumes and faces; X runs fastest. Allocates [`BoxLattice::particle_count`] particles.
    pub fn particles(&self) -> Particles<D> {
        let spacings = self.spacings();
        let kernel_volume: f64 = spacings.iter().product();
        let counts = self.counts();
        let total = counts.iter().product();
        let mut particles = Particles {
            positions: Vec::with_capacity(total),
            volumes: Vec::with_capacity(total),
            kernel_volumes: vec![kernel_volume; total],
            faces: Vec::new(),
            cells: self.vertex_cells(),
        };
        let mut index = [0; D];
        for particle in 0..total {
            particles.positions.push(SVector::from_fn(|axis, _| self.coordinate(axis, index[axis])));
            let share: [f64; D] = std::array::from_fn(|axis| match self.layout[axis] {
                Layout::Vertex if index[axis] == 0 || index[axis] == self.cells[axis] => 0.5,
                _ => 1.0,
            });
            particles.volumes.push(kernel_volume * share.iter().product::<f64>());
            for axis in 0..D {
                let area: f64 =
                    (0..D).filter(|other| *other != axis).map(|other| spacings[other] * share[other]).product();
                let sides = [(0, -1.0), (counts[axis] - 1, 1.0)];
                for (end, sign) in sides.into_iter().filter(|(end, _)| index[axis] == *end) {
                    let mut normal = SVector::zeros();
                    normal[axis] = sign;
                    let mut point = particles.positions[particle];
                    point[axis] = if end == 0 { self.lower[axis] } else { self.upper[axis] };
                    let side = Some(Side { axis, upper: end != 0 });
                    particles.faces.push(Face { particle, normal, area, point, side });
                }
            }
            advance(&mut index, &counts);
        }
        particles
    }

    /// The cells by their particles, where all of these are corners; see [`Particles::cells`].
    pub(super) fn vertex_cells(&self) -> Vec<u32> {
        if self.layout.contains(&Layout::Cell) {
            return Vec::new();
        }
        let counts = self.counts();
        let mut index = [0; D];
        let mut corners = Vec::with_capacity(self.cells.iter().product::<usize>() << D);
        for _ in 0..self.cells.iter().product() {
            for code in 0..1_usize << D {
                let flat = (0..D).rev().fold(0, |flat, axis| flat * counts[axis] + index[axis] + (code >> axis & 1));
                corners.push(flat as u32);
            }
            advance(&mut index, &self.cells);
        }
        corners
    }

    /// Corner of the cells with that index.
    pub(super) fn corner(&self, index: &[usize; D]) -> SVector<f64, D> {
        SVector::from_fn(|axis, _| self.vertex(axis, index[axis]))
    }

    /// One coordinate of a particle.
    fn coordinate(&self, axis: usize, index: usize) -> f64 {
        let (lower, upper) = (self.lower[axis], self.upper[axis]);
        match self.layout[axis] {
            Layout::Vertex => self.vertex(axis, index),
            Layout::Cell => lower + (upper - lower) * ((index as f64 + 0.5) / self.cells[axis] as f64),
        }
    }

    /// One coordinate of a corner of the cells; the ends are exactly those of the box.
    fn vertex(&self, axis: usize, index: usize) -> f64 {
        let (lower, upper) = (self.lower[axis], self.upper[axis]);
        let cells = self.cells[axis];
        if index == cells { upper } else { lower + (upper - lower) * (index as f64 / cells as f64) }
    }
}

fn extents<const D: usize>(lower: &[f64; D], upper: &[f64; D]) -> Result<[f64; D], LatticeError> {
    for axis in 0..D {
        let (lower, upper) = (lower[axis], upper[axis]);
        if !((upper - lower).is_finite() && upper > lower) {
            return Err(LatticeError::NoExtent { axis, lower, upper });
        }
    }
    Ok(std::array::from_fn(|axis| upper[axis] - lower[axis]))
}

/// Counts up, first index fastest.
pub(super) fn advance<const D: usize>(index: &mut [usize; D], counts: &[usize; D]) {
    for axis in 0..D {
        index[axis] += 1;
        if index[axis] < counts[axis] {
            return;
        }
        index[axis] = 0;
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn sums<const D: usize>(lattice: &BoxLattice<D>) -> (f64, [f64; D], [f64; D]) {
        let particles = lattice.particles();
        assert_eq!(Some(particles.positions.len()), lattice.particle_count());
        let (mut lower, mut upper) = ([0.0; D], [0.0; D]);
        for face in &particles.faces {
            for axis in 0..D {
                if face.normal[axis] > 0.5 {
                    upper[axis] += face.area;
                } else if face.normal[axis] < -0.5 {
                    lower[axis] += face.area;
                }
            }
        }
        (particles.volumes.iter().sum(), lower, upper)
    }

    #[test]
    fn volumes_and_areas_add_up_in_every_dimension_and_layout() {
        for layout in [Layout::Vertex, Layout::Cell] {
            let (volume, lower, upper) = sums(&BoxLattice::with_counts([1.0], [4.0], [7], layout).unwrap());
            assert_relative_eq!(volume, 3.0, max_relative = 1e-14);
            assert_eq!((lower, upper), ([1.0], [1.0]));
            let (volume, lower, upper) =
                sums(&BoxLattice::with_counts([0.0, -1.0], [3.0, 1.0], [4, 5], layout).unwrap());
            assert_relative_eq!(volume, 6.0, max_relative = 1e-14);
            for (found, expected) in lower.into_iter().chain(upper).zip([2.0, 3.0, 2.0, 3.0]) {
                assert_relative_eq!(found, expected, max_relative = 1e-14);
            }
            let lattice = BoxLattice::with_counts([0.0; 3], [1.0, 2.0, 4.0], [3, 4, 6], layout).unwrap();
            let (volume, lower, upper) = sums(&lattice);
            assert_relative_eq!(volume, 8.0, max_relative = 1e-14);
            for (found, expected) in lower.into_iter().chain(upper).zip([8.0, 4.0, 2.0, 8.0, 4.0, 2.0]) {
                assert_relative_eq!(found, expected, max_relative = 1e-14);
            }
        }
    }

    #[test]
    fn the_surface_closes() {
        // Σ a N = 0 and Σ a X ⊗ N = |Ω| I: what the balanced weights need.
        let mixed = [Layout::Vertex, Layout::Cell, Layout::Vertex];
        for layout in [[Layout::Vertex; 3], [Layout::Cell; 3], mixed] {
            let particles = BoxLattice::with_counts([0.0; 3], [1.0, 2.0, 4.0], [3, 4, 6], layout).unwrap().particles();
            let mut total = SVector::<f64, 3>::zeros();
            let mut moment = nalgebra::SMatrix::<f64, 3, 3>::zeros();
            for face in &particles.faces {
                total += face.normal * face.area;
                moment += face.point * face.normal.transpose() * face.area;
            }
            assert!(total.norm() < 1e-13);
            assert!((moment - nalgebra::SMatrix::identity() * 8.0).norm() < 1e-12);
        }
    }

    #[test]
    fn corners_edges_and_order() {
        let particles = BoxLattice::with_spacing([0.0, 0.0], [1.0, 0.5], 0.25, Layout::Vertex).unwrap().particles();
        assert_eq!(particles.positions.len(), 15);
        assert_eq!(particles.positions[1], SVector::from([0.25, 0.0]));
        assert_eq!(particles.positions[5], SVector::from([0.0, 0.25]));
        assert_eq!(particles.positions[14], SVector::from([1.0, 0.5]));
        assert_eq!(particles.volumes[0], 0.0625 / 4.0);
        assert_eq!(particles.volumes[1], 0.0625 / 2.0);
        assert_eq!(particles.volumes[6], 0.0625);
        assert_eq!(particles.faces.iter().filter(|face| face.particle == 0).count(), 2);
        assert!(particles.kernel_volumes.iter().all(|volume| *volume == 0.0625));
    }

    #[test]
    fn a_spacing_that_does_not_divide_is_adapted() {
        let lattice = BoxLattice::with_spacing([0.0], [1.0], 0.3, Layout::Cell).unwrap();
        assert_eq!(lattice.particle_count(), Some(3));
        assert_relative_eq!(lattice.mean_spacing(), 1.0 / 3.0);
        let uneven = BoxLattice::with_counts([0.0, 0.0], [1.0, 1.0], [5, 2], Layout::Vertex).unwrap();
        assert_relative_eq!(uneven.mean_spacing(), 0.5);
    }

    #[test]
    fn impossible_boxes_are_refused() {
        let lattice = |upper: f64, spacing: f64| BoxLattice::with_spacing([0.0], [upper], spacing, Layout::Vertex);
        assert!(matches!(lattice(0.0, 0.1), Err(LatticeError::NoExtent { .. })));
        assert!(matches!(lattice(f64::NAN, 0.1), Err(LatticeError::NoExtent { .. })));
        assert!(matches!(lattice(1.0, 0.0), Err(LatticeError::Spacing(_))));
        assert!(matches!(lattice(1.0, f64::INFINITY), Err(LatticeError::Spacing(_))));
        assert!(matches!(lattice(1.0, 3.0), Err(LatticeError::TooFew { count: 0, .. })));
        assert_eq!(lattice(1.0, 1e-300).unwrap().particle_count(), None);
        assert!(matches!(
            BoxLattice::with_counts([0.0], [1.0], [1], Layout::Vertex),
            Err(LatticeError::TooFew { count: 1, .. })
        ));
    }
}
