//! What the parts of a linear solve cost, from counts.
//!
//! A choice between solvers by the clock would make results depend on the load of the machine. So costs are *counted*
//! (multiplications and entries of a factor, entries of an operator, iterations) and the counts are turned into seconds
//! with fixed rates, measured once (`benches/factors.rs 2d-1 2d-10 3d-1 3d-4`, processor time of one core of an AMD EPYC). On another
//! machine the rates differ, but they differ together: only ratios matter, and near a tie either choice is good. The same
//! scene therefore makes the same choices everywhere, for any number of threads.

use super::{Places, Tangent};

/// Seconds per multiplication of a numeric factorisation, and per entry of the factor: 0.048 s for 10⁹ and 4·10⁶ (10⁴
/// particles in 2D), 0.30 s for 1.1·10¹⁰ and 1.2·10⁷ (4·10³ in 3D).
const MULTIPLICATION: f64 = 2.1e-11;
const FACTORED_ENTRY: f64 = 6e-9;
/// Seconds per entry of the factor in a solve: two sweeps at the speed of memory.
const SOLVED_ENTRY: f64 = 2.5e-9;
/// Seconds per entry of an operator of which nothing is known but its entries: a product, and writing it.
const PRODUCT_ENTRY: f64 = 1e-9;
const WRITTEN_ENTRY: f64 = 1e-9;
/// Seconds per unknown of what an iteration does besides the product: vectors and a block-diagonal preconditioner.
const VECTORS: f64 = 1e-8;
/// LU against LDLᵀ on the same pattern, per multiplication (most of it is that LU must order for all choices of pivots)
/// and per entry.
const LU_MULTIPLICATIONS: f64 = 10.0;
const LU_ENTRIES: f64 = 2.0;

/// Cost of an operator's own work, in the seconds of the reference machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// One product, without entries.
    pub action: f64,
    /// Writing all entries.
    pub assembly: f64,
    /// Number of entries, exact or estimated before there is a pattern.
    pub entries: f64,
}

/// Size of a symmetric factor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct FactorSize {
    pub multiplications: f64,
    pub entries: f64,
}

impl FactorSize {
    /// Adds a front: columns that are eliminated together with rows below them.
    pub(super) fn add(&mut self, columns: f64, below: f64) {
        let (k, m) = (columns, below);
        // Σ_{i=1}^{k} (m + i)², and the block as it is stored.
        self.multiplications += k * m * m + m * k * (k + 1.0) + k * (k + 1.0) * (2.0 * k + 1.0) / 6.0;
        self.entries += k * (k + m);
    }

    pub(super) fn factorisation(&self) -> f64 {
        self.multiplications * MULTIPLICATION + self.entries * FACTORED_ENTRY
    }

    pub(super) fn solve(&self) -> f64 {
        self.entries * SOLVED_ENTRY
    }

    /// Memory of factor and workspace, bytes.
    pub(super) fn bytes(&self) -> f64 {
        // The workspace of the largest front is a part of the factor itself.
        self.entries * 8.0 * 1.25
    }

    /// What nested dissection of a box with these points would give.
    ///
    /// Boxes are halved across their longest side by separators `reach` layers wide. The rows below a separator are those of
    /// the separators around its box, as far as they are within reach.
    fn of_box(sides: &[f64], reach: f64, unknowns: f64) -> Self {
        let mut size = Self::default();
        size.dissect(&mut sides.to_vec(), &mut vec![[false; 2]; sides.len()], reach, unknowns);
        size
    }

    fn dissect(&mut self, sides: &mut Vec<f64>, open: &mut Vec<[bool; 2]>, reach: f64, unknowns: f64) {
        let points: f64 = sides.iter().product();
        let around: f64 = sides
            .iter()
            .zip(open.iter())
            .map(|(side, open)| points / side * reach * open.iter().filter(|open| **open).count() as f64)
            .sum();
        let mut axis = 0;
        for k in 1..sides.len() {
            if sides[k] > sides[axis] {
                axis = k;
            }
        }
        let side = sides[axis];
        if side <= 2.0 * reach || points <= 12.0 {
            return self.add(points * unknowns, around * unknowns);
        }
        self.add(points / side * reach * unknowns, around * unknowns);
        let before = open[axis];
        sides[axis] = 0.5 * (side - reach);
        for half in [[before[0], true], [true, before[1]]] {
            open[axis] = half;
            self.dissect(sides, open, reach, unknowns);
        }
        (sides[axis], open[axis]) = (side, before);
    }
}

/// Estimated costs of the ways to solve with an operator, seconds of the reference machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Costs {
    /// Entries and LDLᵀ.
    pub preparation: f64,
    /// Solve with LDLᵀ.
    pub solve: f64,
    /// Product.
    pub action: f64,
    /// An iteration without a factor.
    pub iteration: f64,
    /// Entries and LU.
    pub general: f64,
    /// Memory of LDLᵀ and entries, bytes.
    pub bytes: f64,
}

impl Costs {
    /// The costs with a factor of known or estimated size.
    pub(super) fn new(effort: &Effort, factor: &FactorSize, unknowns: usize) -> Self {
        Self {
            preparation: effort.assembly + factor.factorisation(),
            solve: factor.solve(),
            action: effort.action,
            iteration: effort.action + VECTORS * unknowns as f64,
            general: effort.assembly
                + LU_MULTIPLICATIONS * factor.multiplications * MULTIPLICATION
                + LU_ENTRIES * factor.entries * FACTORED_ENTRY,
            bytes: factor.bytes() + 24.0 * effort.entries,
        }
    }
}

/// The effort of an operator: as it says, or from its entries.
pub(super) fn effort_of(tangent: &dyn Tangent) -> Option<Effort> {
    tangent.effort().or_else(|| {
        let entries = tangent.pattern()?.entries() as f64;
        Some(Effort { action: entries * PRODUCT_ENTRY, assembly: entries * WRITTEN_ENTRY, entries })
    })
}

/// The size of a factor before there is a pattern, from where the unknowns are: as that of a box of the same points.
pub(super) fn estimated_factor(tangent: &dyn Tangent, effort: &Effort) -> Option<FactorSize> {
    let places = tangent.places()?;
    let (points, unknowns) = (tangent.blocks().len().checked_sub(1)? as f64, tangent.size() as f64);
    if points < 1.0 || unknowns < 1.0 || places.coordinates.is_empty() {
        return None;
    }
    let extents = extents(&places);
    let longest = extents.iter().copied().fold(0.0, f64::max);
    // Directions in which all points coincide are none.
    let real: Vec<f64> = extents.into_iter().filter(|extent| *extent > 1e-9 * longest).collect();
    if real.is_empty() {
        return None;
    }
    let dimension = real.len() as f64;
    // Layers of a lattice with these extents: Π (e_i / d + 1) = points.
    let (mut small, mut large) = (0.0, longest);
    for _ in 0..60 {
        let spacing = 0.5 * (small + large);
        let count: f64 = real.iter().map(|extent| extent / spacing + 1.0).product();
        if count > points { small = spacing } else { large = spacing }
    }
    let sides: Vec<f64> = real.iter().map(|extent| extent / large + 1.0).collect();
    let per_point = unknowns / points;
    let coupled = (effort.entries / (points * per_point * per_point)).max(1.0);
    let reach = (0.5 * (coupled.powf(1.0 / dimension) - 1.0)).max(1.0);
    Some(FactorSize::of_box(&sides, reach, per_point))
}

fn extents(places: &Places) -> Vec<f64> {
    (0..places.dimension)
        .map(|axis| {
            let along = places.coordinates.iter().skip(axis).step_by(places.dimension);
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
            high - low
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_front_counts_its_columns() {
        let mut size = FactorSize::default();
        size.add(3.0, 2.0);
        assert_eq!(size.multiplications, 25.0 + 16.0 + 9.0);
        assert_eq!(size.entries, 15.0);
    }

    /// Measured with nested dissection (`benches/factors.rs`): 4.1·10⁶ entries for 10⁴ particles in a square and
    /// 1.2·10⁷ for 16³ in a cube, both with two unknown layers of reach. An estimate within a factor of two will do.
    #[test]
    fn estimates_meet_measured_factors() {
        let square = FactorSize::of_box(&[100.0, 100.0], 2.0, 2.0);
        assert!((0.5..2.0).contains(&(square.entries / 4.12e6)), "{square:?}");
        assert!((0.5..2.0).contains(&(square.multiplications / 9.8e8)), "{square:?}");
        let cube = FactorSize::of_box(&[16.0, 16.0, 16.0], 2.0, 2.5);
        assert!((0.5..2.0).contains(&(cube.entries / 1.21e7)), "{cube:?}");
        assert!((0.4..2.5).contains(&(cube.multiplications / 1.11e10)), "{cube:?}");
    }
}
