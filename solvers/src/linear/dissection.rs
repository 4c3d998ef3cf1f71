//! Nested dissection: an order of elimination for symmetric factors, from where the unknowns are.
//!
//! A set of points is cut across its longest extent near the middle; the points of one side that couple to the other
//! are the *separator*, which is eliminated last, so that elimination on either side fills nothing on the other. The
//! separator is as wide as the coupling reaches, whatever that is: it is found in the pattern. Both sides are
//! treated alike, until they are so small that a separator would be most of them. On a lattice of n points this is
//! optimal up to a constant, with O(n log n) entries in a plane and O(n^{4/3}) in space (A. George, *SIAM J. Numer.
//! Anal.* 10 (1973) 345–363; J. R. Gilbert and R. E. Tarjan, *Numer. Math.* 50 (1987) 377–404).
//!
//! Only points are ordered; the unknowns of a point follow each other.

use super::SparsePattern;

/// Where the unknowns of an operator are: a point for each of its [blocks](super::Tangent::blocks).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Places {
    /// Number of space dimensions.
    pub dimension: usize,
    /// Coordinates of one point after the other.
    pub coordinates: Vec<f64>,
}

/// Sets of at most this many points are not cut.
const LEAF: usize = 24;
/// Nor are sets of which a separator would be this part or more.
const LARGEST_SEPARATOR: f64 = 0.5;
/// A cut may lie this far from the middle, as a part of the set, to fall into a gap between layers.
const OFF_CENTRE: f64 = 0.1;

/// Which points couple, in compressed rows.
struct Graph {
    offsets: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// The couplings of blocks of unknowns.
    fn new(pattern: &SparsePattern, blocks: &[usize]) -> Self {
        let count = blocks.len().saturating_sub(1);
        let mut block_of = vec![0_u32; pattern.size()];
        for b in 0..count {
            block_of[blocks[b]..blocks[b + 1]].fill(b as u32);
        }
        let mut last = vec![u32::MAX; count];
        let (mut offsets, mut neighbours) = (Vec::with_capacity(count + 1), Vec::new());
        offsets.push(0);
        for b in 0..count {
            for unknown in blocks[b]..blocks[b + 1] {
                for &column in pattern.row(unknown) {
                    let other = block_of[column];
                    if other != b as u32 && last[other as usize] != b as u32 {
                        last[other as usize] = b as u32;
                        neighbours.push(other);
                    }
                }
            }
            offsets.push(neighbours.len());
        }
        Self { offsets, neighbours }
    }

    fn of(&self, point: u32) -> &[u32] {
        &self.neighbours[self.offsets[point as usize]..self.offsets[point as usize + 1]]
    }
}

/// The work of a dissection.
struct Dissection<'a> {
    graph: Graph,
    places: &'a Places,
    /// Largest distance of two points that couple, per direction.
    reach: Vec<f64>,
    /// Mark of the side that a point is on in the present cut.
    side: Vec<u32>,
    mark: u32,
    order: Vec<u32>,
}

/// The order in which nested dissection eliminates the unknowns; entry `k` is the unknown that is eliminated as
/// number `k`. `None` if the places do not fit the blocks.
pub(super) fn nested_dissection(pattern: &SparsePattern, blocks: &[usize], places: &Places) -> Option<Vec<usize>> {
    let count = blocks.len().checked_sub(1)?;
    let dimension = places.dimension;
    if dimension == 0 || places.coordinates.len() != count * dimension || blocks.last() != Some(&pattern.size()) {
        return None;
    }
    let graph = Graph::new(pattern, blocks);
    let mut reach = vec![0.0_f64; dimension];
    for a in 0..count {
        for &b in graph.of(a as u32) {
            for (axis, reach) in reach.iter_mut().enumerate() {
                *reach = reach.max(places.at(b, axis) - places.at(a as u32, axis));
            }
        }
    }
    let points: Vec<u32> = (0..count as u32).filter(|&b| blocks[b as usize] < blocks[b as usize + 1]).collect();
    let order = Vec::with_capacity(points.len());
    let mut work = Dissection { graph, places, reach, side: vec![0; count], mark: 0, order };
    work.dissect(points);
    Some(work.order.iter().flat_map(|&b| blocks[b as usize]..blocks[b as usize + 1]).collect())
}

impl Places {
    fn at(&self, point: u32, axis: usize) -> f64 {
        self.coordinates[point as usize * self.dimension + axis]
    }
}

impl Dissection<'_> {
    /// Orders a set of points: one side, the other side, what lies between.
    fn dissect(&mut self, mut points: Vec<u32>) {
        let (axis, extent) = self.longest_axis(&points);
        let place = |point: u32| self.places.at(point, axis);
        points.sort_unstable_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        // Coinciding points, and places that are no numbers, have no sides.
        if points.len() <= LEAF || extent.is_nan() || extent <= 0.0 {
            self.order.extend(points);
            return;
        }
        let cut = self.gap(&points, axis);
        let separator = self.separator(&points, cut, axis);
        if separator.len() as f64 >= LARGEST_SEPARATOR * points.len() as f64 {
            self.order.extend(points);
            return;
        }
        let mut is_separating = separator.iter().copied().peekable();
        let (mut low, mut high) = (Vec::with_capacity(cut), Vec::with_capacity(points.len() - cut));
        for (k, &point) in points.iter().enumerate() {
            if is_separating.next_if(|&s| s == point).is_some() {
                continue;
            }
            if k < cut { low.push(point) } else { high.push(point) }
        }
        drop(points);
        self.dissect(low);
        self.dissect(high);
        self.order.extend(separator);
    }

    /// The direction in which a set is longest, and how long.
    fn longest_axis(&self, points: &[u32]) -> (usize, f64) {
        let extent = |axis: usize| {
            let range = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &point| {
                let x = self.places.at(point, axis);
                (low.min(x), high.max(x))
            });
            range.1 - range.0
        };
        (0..self.places.dimension)
            .map(|axis| (axis, extent(axis)))
            .fold((0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best })
    }

    /// Where to cut sorted points: in the widest gap about the middle, of equal ones the nearest to it.
    fn gap(&self, points: &[u32], axis: usize) -> usize {
        let middle = points.len() / 2;
        let slack = ((points.len() as f64 * OFF_CENTRE) as usize).max(1);
        let width = |k: usize| self.places.at(points[k], axis) - self.places.at(points[k - 1], axis);
        let (mut best, mut widest) = (middle, width(middle));
        for off in 1..=slack {
            for k in [middle - off.min(middle - 1), (middle + off).min(points.len() - 1)] {
                // A gap must be wider by more than rounding to be worth less balance.
                if width(k) > widest * (1.0 + 1e-6) {
                    (best, widest) = (k, width(k));
                }
            }
        }
        best
    }

    /// The points of one side that couple to the other, of the side where they are fewer.
    fn separator(&mut self, points: &[u32], cut: usize, axis: usize) -> Vec<u32> {
        let (low_mark, high_mark) = (self.mark + 1, self.mark + 2);
        self.mark += 2;
        let line = self.places.at(points[cut], axis);
        let last = self.places.at(points[cut - 1], axis);
        let reach = self.reach[axis];
        let begin = points.partition_point(|&p| self.places.at(p, axis) < line - reach * (1.0 + 1e-9));
        let end = points.partition_point(|&p| self.places.at(p, axis) <= last + reach * (1.0 + 1e-9));
        for (range, mark) in [(begin..cut, low_mark), (cut..end, high_mark)] {
            points[range].iter().for_each(|&p| self.side[p as usize] = mark);
        }
        let touching = |range: std::ops::Range<usize>, other: u32| -> Vec<u32> {
            let touches = |&p: &u32| self.graph.of(p).iter().any(|&q| self.side[q as usize] == other);
            points[range].iter().copied().filter(touches).collect()
        };
        let (low, high) = (touching(begin..cut, high_mark), touching(cut..end, low_mark));
        if low.len() < high.len() || (low.len() == high.len() && cut > points.len() - cut) { low } else { high }
    }
}
