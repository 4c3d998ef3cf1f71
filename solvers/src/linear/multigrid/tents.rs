//! Tent functions on lattices: the coarse space of particles.

use rayon::prelude::*;

use super::coarsening::Coarsening;

/// Marks a component that is no unknown, and a node that no unknown sees.
pub(super) const NONE: u32 = u32::MAX;

/// Where the unknowns are: components of vectors at points in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    /// Number of coordinates and components, 1 to 3.
    pub dimension: usize,
    /// Positions of the points, m; coordinates beyond the dimension are not read.
    pub positions: Vec<[f64; 3]>,
    /// The unknowns of every point's components, `u32::MAX` where there is none.
    pub unknowns: Vec<[u32; 3]>,
    /// Consecutive points that interact with each other only, and their spacing, m.
    pub parts: Vec<(std::ops::Range<usize>, f64)>,
}

/// The lattice of one part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lattice {
    /// Nodes in every direction.
    pub(super) counts: [usize; 3],
    /// First entry in the table of nodes.
    pub(super) offset: usize,
}

impl Lattice {
    /// Place of a node in the table of nodes.
    pub(super) fn place(&self, node: [usize; 3]) -> usize {
        self.offset + (node[2] * self.counts[1] + node[1]) * self.counts[0] + node[0]
    }
}

/// Place of a point in its lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seat {
    part: u32,
    cell: [u16; 3],
    fraction: [f32; 3],
}

/// Tent functions (products of hats) on a lattice around every part. They add up to one and contain every linear
/// function, so translations are in their span exactly, rotations too, whatever the present configuration, and so
/// are all smooth motions nearly. Restricted to the free components of the points they span the coarse space.
#[derive(Debug, Clone, PartialEq)]
pub struct Tents {
    pub(super) dimension: usize,
    pub(super) lattices: Vec<Lattice>,
    seats: Vec<Seat>,
    unknowns: Vec<[u32; 3]>,
    /// Number of every node of the lattices, or [`NONE`].
    pub(super) numbers: Vec<u32>,
    pub(super) nodes: usize,
}

/// The tents that do not vanish at a point: up to eight nodes and values.
#[derive(Debug, Clone, Copy)]
pub struct PointTents {
    nodes: [u32; 8],
    values: [f64; 8],
    length: usize,
}

impl PointTents {
    /// Nodes and values, of which none is zero.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.nodes[..self.length].iter().map(|&node| node as usize).zip(self.values[..self.length].iter().copied())
    }
}

impl Tents {
    /// Lattices of a spacing of `ratio` times that of the points. `None` for a part with more than 65535 cells in a
    /// row, or points that are not finite.
    pub fn new(geometry: Geometry, ratio: f64) -> Option<Self> {
        let Geometry { dimension, positions, unknowns, parts } = geometry;
        let mut seats = Vec::with_capacity(positions.len());
        let (mut lattices, mut offset) = (Vec::new(), 0);
        for (part, (range, spacing)) in parts.into_iter().enumerate() {
            let (size, points) = (ratio * spacing, &positions[range]);
            let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for point in points {
                for i in 0..dimension {
                    lower[i] = lower[i].min(point[i]);
                    upper[i] = upper[i].max(point[i]);
                }
            }
            let mut counts = [1; 3];
            for i in (0..dimension).filter(|_| !points.is_empty()) {
                let cells = ((upper[i] - lower[i]) / size).floor() + 1.0;
                if !(1.0..65535.0).contains(&cells) {
                    return None;
                }
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 1 and 65535")]
                let cells = cells as usize;
                counts[i] = cells + 1;
                // As much beyond the body at both ends.
                #[expect(clippy::cast_precision_loss, reason = "below 65536")]
                let beyond = cells as f64 * size - (upper[i] - lower[i]);
                lower[i] -= 0.5 * beyond;
            }
            seats.extend(points.iter().map(|point| {
                let (mut cell, mut fraction) = ([0; 3], [0.0; 3]);
                for i in 0..dimension {
                    let place = (point[i] - lower[i]) / size;
                    #[expect(clippy::cast_precision_loss, reason = "below 65536")]
                    let base = place.floor().clamp(0.0, (counts[i] - 2) as f64);
                    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the lattice")]
                    let (base16, rest) = (base as u16, (place - base).clamp(0.0, 1.0) as f32);
                    (cell[i], fraction[i]) = (base16, rest);
                }
                #[expect(clippy::cast_possible_truncation, reason = "as many parts as bodies")]
                let part = part as u32;
                Seat { part, cell, fraction }
            }));
            lattices.push(Lattice { counts, offset });
            offset += counts.iter().product::<usize>();
        }
        let mut tents = Self { dimension, lattices, seats, unknowns, numbers: vec![0; offset], nodes: 0 };
        let mut seen = vec![false; offset];
        for point in 0..tents.seats.len() {
            if tents.unknowns[point].iter().any(|&unknown| unknown != NONE) {
                let seat = &tents.seats[point];
                tents.corners(seat, |place, _| seen[place] = true);
            }
        }
        for (number, seen) in tents.numbers.iter_mut().zip(seen) {
            *number = NONE;
            if seen {
                #[expect(clippy::cast_possible_truncation, reason = "fewer nodes than points times eight")]
                let next = tents.nodes as u32;
                *number = next;
                tents.nodes += 1;
            }
        }
        Some(tents)
    }

    /// Visits the corners of the cell of a seat: places in the table of nodes, and values that are not zero.
    fn corners(&self, seat: &Seat, mut visit: impl FnMut(usize, f64)) {
        let lattice = &self.lattices[seat.part as usize];
        for corner in 0..1_usize << self.dimension {
            let (mut node, mut value) = ([0; 3], 1.0);
            for (i, node) in node.iter_mut().enumerate().take(self.dimension) {
                let (upper, fraction) = (corner >> i & 1, f64::from(seat.fraction[i]));
                *node = usize::from(seat.cell[i]) + upper;
                value *= if upper == 1 { fraction } else { 1.0 - fraction };
            }
            if value != 0.0 {
                visit(lattice.place(node), value);
            }
        }
    }

    /// The tents at a point. Nodes that no unknown sees are left out.
    pub fn at(&self, point: usize) -> PointTents {
        let mut out = PointTents { nodes: [0; 8], values: [0.0; 8], length: 0 };
        self.corners(&self.seats[point], |place, value| {
            let node = self.numbers[place];
            if node != NONE {
                (out.nodes[out.length], out.values[out.length]) = (node, value);
                out.length += 1;
            }
        });
        out
    }

    /// Number of nodes that have unknowns.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.seats.len()
    }

    /// Whether a component of a point is an unknown.
    pub fn is_free(&self, point: usize, component: usize) -> bool {
        self.unknowns[point][component] != NONE
    }

    /// Points in the order of their cells, and where each cell begins.
    pub fn cells(&self) -> (Vec<u32>, Vec<usize>) {
        #[expect(clippy::cast_possible_truncation, reason = "points are counted in 32 bits")]
        let mut order: Vec<u32> = (0..self.seats.len() as u32).collect();
        let key = |point: u32| {
            let seat = &self.seats[point as usize];
            (seat.part, seat.cell[2], seat.cell[1], seat.cell[0])
        };
        order.sort_by_key(|&point| key(point));
        let mut starts = Vec::new();
        for (k, &point) in order.iter().enumerate() {
            if k == 0 || key(order[k - 1]) != key(point) {
                starts.push(k);
            }
        }
        starts.push(order.len());
        (order, starts)
    }

    /// `coarse = Pᵀ fine`.
    pub(super) fn restrict(&self, fine: &[f64], coarse: &mut [f64]) {
        coarse.fill(0.0);
        let d = self.dimension;
        for (point, unknowns) in self.unknowns.iter().enumerate() {
            if unknowns[..d].iter().all(|&unknown| unknown == NONE) {
                continue;
            }
            for (node, value) in self.at(point).iter() {
                for (i, &unknown) in unknowns[..d].iter().enumerate().filter(|(_, u)| **u != NONE) {
                    coarse[node * d + i] += value * fine[unknown as usize];
                }
            }
        }
    }

    /// `fine += P coarse`. Every unknown belongs to exactly one point.
    pub(super) fn prolong(&self, coarse: &[f64], fine: &mut [f64], work: &mut Vec<[f64; 3]>) {
        let d = self.dimension;
        (0..self.seats.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|point| {
                let mut sum = [0.0; 3];
                for (node, value) in self.at(point).iter() {
                    sum[..d].iter_mut().zip(&coarse[node * d..]).for_each(|(sum, c)| *sum += value * c);
                }
                sum
            })
            .collect_into_vec(work);
        for (unknowns, sum) in self.unknowns.iter().zip(work.iter()) {
            for (&unknown, sum) in unknowns[..d].iter().zip(sum).filter(|(u, _)| **u != NONE) {
                fine[unknown as usize] += sum;
            }
        }
    }

    /// Point and component of every unknown.
    pub(super) fn owners(&self, size: usize) -> Vec<(u32, u8)> {
        let mut owners = vec![(NONE, 0); size];
        for (point, unknowns) in self.unknowns.iter().enumerate() {
            for (i, &unknown) in unknowns[..self.dimension].iter().enumerate().filter(|(_, u)| **u != NONE) {
                #[expect(clippy::cast_possible_truncation, reason = "points are counted in 32 bits")]
                let owner = (point as u32, i as u8);
                owners[unknown as usize] = owner;
            }
        }
        owners
    }

    /// The next coarser lattices: every other node.
    pub(super) fn coarser(&self) -> Coarsening {
        Coarsening::new(&self.lattices, &self.numbers, self.nodes)
    }
}

#[cfg(test)]
mod tests;
