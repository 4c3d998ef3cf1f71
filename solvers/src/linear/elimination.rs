//! The order in which a symmetric factorisation eliminates, from where the unknowns are.
//!
//! *Nested dissection*: a set of points is cut across its longest extent near the middle; the points of one side that couple to the other
//! are the *separator*, which is eliminated last, so that elimination on either side fills nothing on the other. The
//! separator is as wide as the coupling reaches, whatever that is: it is found in the pattern. Both sides are
//! treated alike, until they are so small that a separator would be most of them. On a lattice of n points this is
//! optimal up to a constant, with O(n log n) entries in a plane and O(n^{4/3}) in space (A. George, *SIAM J. Numer.
//! Anal.* 10 (1973) 345–363; J. R. Gilbert and R. E. Tarjan, *Numer. Math.* 50 (1987) 377–404).
//!
//! *Sweep*: from one end of the longest direction to the other. *Minimum degree*: P. R. Amestoy, T. A. Davis and I. S. Duff,
//! *SIAM J. Matrix Anal. Appl.* 17 (1996) 886–905.
//!
//! Only points are ordered; the unknowns of a point follow each other.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::SparsePattern;

/// Where the unknowns of an operator are: a point for each of its [blocks](super::Tangent::blocks).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Places {
    /// Number of space dimensions.
    pub dimension: usize,
    /// Coordinates of one point after the other.
    pub coordinates: Vec<f64>,
}

/// Points up to which minimum degree is tried: beyond, it has never won, and takes longest.
const LARGEST_MINIMUM_DEGREE: usize = 20_000;
/// Sets of at most this many points are not cut.
const LEAF: usize = 12;
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

    /// Multiplications of a factorisation with one unknown per point: the sum of the squares of the lengths of its
    /// columns, found by walking the elimination tree (Davis 2006, §4.3).
    fn multiplications(&self, order: &[u32]) -> f64 {
        const NONE: u32 = u32::MAX;
        let mut rank = vec![NONE; self.offsets.len() - 1];
        (0..).zip(order).for_each(|(k, &point)| rank[point as usize] = k);
        let (mut parent, mut seen) = (vec![NONE; order.len()], vec![NONE; order.len()]);
        let mut length = vec![1_u32; order.len()];
        for (k, &point) in (0..).zip(order) {
            seen[k as usize] = k;
            for &other in self.of(point) {
                let mut i = rank[other as usize];
                // Points that are not in the order have no rank, and pass as later ones.
                while i < k && seen[i as usize] != k {
                    let at = i as usize;
                    seen[at] = k;
                    length[at] += 1;
                    if parent[at] == NONE {
                        parent[at] = k;
                    }
                    i = parent[at];
                }
            }
        }
        length.iter().map(|&length| f64::from(length).powi(2)).sum()
    }

    /// Minimum degree of the points of an order; `None` if faer refuses.
    fn minimum_degree(&self, points: &[u32]) -> Option<Vec<u32>> {
        let n = points.len();
        let mut rank = vec![usize::MAX; self.offsets.len() - 1];
        let mut sorted = points.to_vec();
        sorted.sort_unstable();
        sorted.iter().enumerate().for_each(|(k, &point)| rank[point as usize] = k);
        let (mut offsets, mut rows) = (vec![0], Vec::with_capacity(self.neighbours.len()));
        for &point in &sorted {
            let start = rows.len();
            rows.extend(self.of(point).iter().map(|&q| rank[q as usize]).filter(|&q| q != usize::MAX));
            rows[start..].sort_unstable();
            offsets.push(rows.len());
        }
        let matrix = SymbolicSparseColMatRef::new_checked(n, n, &offsets, None, &rows);
        let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
        let mut memory = MemBuffer::try_new(amd::order_scratch::<usize>(n, rows.len())).ok()?;
        amd::order(&mut order, &mut inverse, matrix, amd::Control::default(), MemStack::new(&mut memory)).ok()?;
        Some(order.into_iter().map(|k| sorted[k]).collect())
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

/// An order with few multiplications; entry `k` is the unknown that is eliminated as number `k`. `None` if the places do
/// not fit the blocks.
///
/// Nested dissection wins in space, and in planes from some ten thousand points; minimum degree up to there; a sweep in
/// beams that are a few reaches wide. So all are tried on the graph of points, which is small beside that of unknowns, and
/// their multiplications counted.
pub(super) fn elimination_order(pattern: &SparsePattern, blocks: &[usize], places: &Places) -> Option<Vec<usize>> {
    let count = blocks.len().checked_sub(1)?;
    let dimension = places.dimension;
    if dimension == 0 || places.coordinates.len() != count * dimension || blocks.last() != Some(&pattern.size()) {
        return None;
    }
    let points: Vec<u32> = (0..count as u32).filter(|&b| blocks[b as usize] < blocks[b as usize + 1]).collect();
    let dissection = Dissection::new(Graph::new(pattern, blocks), places);
    let sweep = dissection.sorted(points.clone()).0;
    let small = points.len() <= LARGEST_MINIMUM_DEGREE;
    let Dissection { graph, order, .. } = dissection.of(points);
    let mut candidates = vec![order, sweep];
    if small {
        candidates.extend(graph.minimum_degree(&candidates[0]));
    }
    let counts = candidates.into_iter().map(|order| (graph.multiplications(&order), order));
    let (_, order) = counts.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(order.iter().flat_map(|&b| blocks[b as usize]..blocks[b as usize + 1]).collect())
}

impl Places {
    fn at(&self, point: u32, axis: usize) -> f64 {
        self.coordinates[point as usize * self.dimension + axis]
    }
}

impl<'a> Dissection<'a> {
    fn new(graph: Graph, places: &'a Places) -> Self {
        let count = graph.offsets.len() - 1;
        let mut reach = vec![0.0_f64; places.dimension];
        for a in 0..count as u32 {
            for &b in graph.of(a) {
                for (axis, reach) in reach.iter_mut().enumerate() {
                    *reach = reach.max(places.at(b, axis) - places.at(a, axis));
                }
            }
        }
        Self { graph, places, reach, side: vec![0; count], mark: 0, order: Vec::new() }
    }

    fn of(mut self, points: Vec<u32>) -> Self {
        self.dissect(points);
        self
    }

    /// Points in the order of the direction in which they extend most, with that direction and extent.
    fn sorted(&self, mut points: Vec<u32>) -> (Vec<u32>, usize, f64) {
        let (axis, extent) = self.longest_axis(&points);
        let place = |point: u32| self.places.at(point, axis);
        points.sort_unstable_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        (points, axis, extent)
    }

    /// Orders a set of points: one side, the other side, what lies between.
    fn dissect(&mut self, points: Vec<u32>) {
        let (points, axis, extent) = self.sorted(points);
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
