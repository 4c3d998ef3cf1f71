//! Who is within whose support: a cell-list search in the reference configuration.
//!
//! No cap on the number of neighbours. Symmetric by construction: the test on `|X_b − X_a|²` gives
//! the same bits for (a, b) and (b, a). A particle is its own neighbour. Rows are in owner order with
//! ascending neighbours, so every sum over neighbours has a fixed order.

use rayon::prelude::*;

use crate::tensor::Vector;

/// Neighbour lists in compressed rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Neighbourhood {
    offsets: Vec<usize>,
    neighbours: Vec<u32>,
    twins: Vec<u32>,
}

impl Neighbourhood {
    /// Finds all pairs closer than `radius[body]`, within each body. Bodies are ranges of particles
    /// that together cover all positions; particles of different bodies never interact. Particles of one of the `cells`
    /// are neighbours, however far apart.
    pub fn search<'a, const D: usize>(
        positions: &[Vector<D>],
        bodies: &[(std::ops::Range<usize>, f64)],
        cells: impl IntoIterator<Item = &'a [u32]>,
    ) -> Self {
        let (mut offsets, mut neighbours) = (Vec::with_capacity(positions.len() + 1), Vec::new());
        offsets.push(0);
        for (range, radius) in bodies {
            // Pairs exactly at the edge of the support have weight zero; rounding must not decide
            // over them.
            let reach = radius * (1.0 - 1e-9);
            let parts = search_body(positions, range.clone(), reach);
            neighbours.reserve(parts.iter().map(|part| part.neighbours.len()).sum());
            for part in &parts {
                for length in &part.lengths {
                    offsets.push(offsets[offsets.len() - 1] + *length as usize);
                }
                neighbours.extend_from_slice(&part.neighbours);
            }
        }
        add_missing(&mut offsets, &mut neighbours, cells);
        let twins = twins(&offsets, &neighbours);
        Self { offsets, neighbours, twins }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there is no particle.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of ordered pairs, self-pairs included.
    pub fn pairs(&self) -> usize {
        self.neighbours.len()
    }

    /// Entries of the row of particle `a`.
    pub fn row(&self, a: usize) -> std::ops::Range<usize> {
        self.offsets[a]..self.offsets[a + 1]
    }

    /// The neighbour of an entry.
    pub fn neighbour(&self, entry: usize) -> usize {
        self.neighbours[entry] as usize
    }

    /// Neighbours of particle `a`, itself included, ascending.
    pub fn of(&self, a: usize) -> &[u32] {
        &self.neighbours[self.row(a)]
    }

    /// The entry `(b, a)` that belongs to the entry `(a, b)`.
    pub fn twin(&self, entry: usize) -> usize {
        self.twins[entry] as usize
    }

    /// The entries `(b, a)` of the neighbours of a particle, in the order of its row.
    pub fn twins_of(&self, a: usize) -> &[u32] {
        &self.twins[self.row(a)]
    }

    /// Entry of a particle with itself.
    pub fn own_entry(&self, a: usize) -> usize {
        self.offsets[a] + self.of(a).partition_point(|&c| (c as usize) < a)
    }

    /// Every particle reached through the neighbours of `a`'s neighbours, ascending, itself included:
    /// the row of the displacement tangent.
    pub fn two_ring(&self, a: usize) -> Vec<u32> {
        let mut ring: Vec<u32> = self.of(a).iter().flat_map(|&b| self.of(b as usize).iter().copied()).collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }
}

/// Adds the pairs of particles that share a cell and are not in each other's rows.
fn add_missing<'a>(offsets: &mut Vec<usize>, neighbours: &mut Vec<u32>, cells: impl IntoIterator<Item = &'a [u32]>) {
    let mut missing = Vec::new();
    for cell in cells {
        for &a in cell {
            let row = &neighbours[offsets[a as usize]..offsets[a as usize + 1]];
            missing.extend(cell.iter().filter(|b| row.binary_search(b).is_err()).map(|&b| (a, b)));
        }
    }
    if missing.is_empty() {
        return;
    }
    missing.sort_unstable();
    missing.dedup();
    let mut all = Vec::with_capacity(neighbours.len() + missing.len());
    let mut starts = Vec::with_capacity(offsets.len());
    starts.push(0);
    let mut more = missing.into_iter().peekable();
    for (a, bounds) in offsets.windows(2).enumerate() {
        let start = all.len();
        all.extend_from_slice(&neighbours[bounds[0]..bounds[1]]);
        let own = all.len();
        all.extend(std::iter::from_fn(|| more.next_if(|&(owner, _)| owner as usize == a)).map(|(_, b)| b));
        if all.len() > own {
            all[start..].sort_unstable();
        }
        starts.push(all.len());
    }
    (*offsets, *neighbours) = (starts, all);
}

/// The entries `(b, a)` of all entries `(a, b)`: rows are symmetric and ascending, so that the entries of row b are met
/// in their order.
fn twins(offsets: &[usize], neighbours: &[u32]) -> Vec<u32> {
    let mut next: Vec<u32> = offsets.iter().map(|&start| start as u32).collect();
    let twin = |&b: &u32| {
        let next = &mut next[b as usize];
        *next += 1;
        *next - 1
    };
    neighbours.iter().map(twin).collect()
}

/// Particles that one thread takes at a time.
const CHUNK: usize = 2048;

/// The rows of some consecutive particles.
struct Part {
    lengths: Vec<u32>,
    neighbours: Vec<u32>,
}

/// Cell-list search of one body.
fn search_body<const D: usize>(positions: &[Vector<D>], range: std::ops::Range<usize>, reach: f64) -> Vec<Part> {
    let points = &positions[range.clone()];
    if points.is_empty() {
        return Vec::new();
    }
    let mut lower = points[0];
    let mut upper = points[0];
    for p in points {
        lower = lower.inf(p);
        upper = upper.sup(p);
    }
    // Cells no smaller than the reach, and no more cells than particles need.
    let longest = (upper - lower).max();
    let cell = reach.max(longest / 1024.0).max(f64::MIN_POSITIVE);
    let counts: [usize; D] = std::array::from_fn(|i| ((upper[i] - lower[i]) / cell) as usize + 1);
    let index_of = |p: &Vector<D>| -> [usize; D] {
        std::array::from_fn(|i| (((p[i] - lower[i]) / cell) as usize).min(counts[i] - 1))
    };
    let flat = |index: [usize; D]| (0..D).rev().fold(0, |flat, i| flat * counts[i] + index[i]);

    let total: usize = counts.iter().product();
    let mut starts = vec![0usize; total + 1];
    let cells: Vec<usize> = points.par_iter().map(|p| flat(index_of(p))).collect();
    for &c in &cells {
        starts[c + 1] += 1;
    }
    for c in 0..total {
        starts[c + 1] += starts[c];
    }
    let mut next = starts.clone();
    let mut members = vec![0u32; points.len()];
    for (i, &c) in cells.iter().enumerate() {
        members[next[c]] = i as u32;
        next[c] += 1;
    }

    // Beside each other what is read together.
    let sorted: Vec<Vector<D>> = members.iter().map(|&m| points[m as usize]).collect();
    let row_of = |p: &Vector<D>, row: &mut Vec<u32>| {
        let centre = index_of(p);
        // Cells beside each other in the first direction follow each other.
        let along = centre[0].saturating_sub(1)..(centre[0] + 2).min(counts[0]);
        for step in 0..3usize.pow(D as u32 - 1) {
            let mut rest = step;
            let mut index = [0usize; D];
            let mut inside = true;
            for i in 1..D {
                let shifted = centre[i] + rest % 3;
                rest /= 3;
                inside &= shifted >= 1 && shifted <= counts[i];
                index[i] = shifted.wrapping_sub(1);
            }
            if !inside {
                continue;
            }
            let first = flat(index);
            let near = starts[first + along.start]..starts[first + along.end];
            for (x, &m) in sorted[near.clone()].iter().zip(&members[near]) {
                if (x - p).norm_squared() < reach * reach {
                    row.push(range.start as u32 + m);
                }
            }
        }
        row.sort_unstable();
    };
    points
        .par_chunks(CHUNK)
        .map(|points| {
            let (mut lengths, mut neighbours) = (Vec::with_capacity(points.len()), Vec::new());
            let mut row = Vec::new();
            for p in points {
                row.clear();
                row_of(p, &mut row);
                lengths.push(row.len() as u32);
                neighbours.extend_from_slice(&row);
            }
            Part { lengths, neighbours }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(n: usize) -> Vec<Vector<2>> {
        (0..n)
            .map(|i| {
                let s = i as f64;
                Vector::<2>::new((s * 0.754_877_666).fract(), (s * 0.569_840_290_9).fract())
            })
            .collect()
    }

    #[test]
    fn the_search_finds_exactly_the_pairs_of_a_direct_test() {
        let points = cloud(400);
        let table = Neighbourhood::search(&points, &[(0..250, 0.13), (250..400, 0.2)], []);
        for a in 0..400 {
            let (body, reach) = if a < 250 { (0..250, 0.13) } else { (250..400, 0.2) };
            let expected: Vec<u32> =
                body.filter(|&b| (points[b] - points[a]).norm() < reach * (1.0 - 1e-9)).map(|b| b as u32).collect();
            assert_eq!(table.of(a), expected);
            assert_eq!(table.neighbour(table.own_entry(a)), a);
            for k in table.row(a) {
                assert_eq!(table.neighbour(table.twin(k)), a);
                assert!(table.row(table.neighbour(k)).contains(&table.twin(k)));
            }
        }
    }

    #[test]
    fn ring_sizes_match_the_known_table_for_lattices() {
        // benchmarks.md: support 2.4 spacings: 21 and 69 in 2D; support 2: 9 and 25.
        let points: Vec<Vector<2>> = (0..15 * 15).map(|i| Vector::<2>::new((i % 15) as f64, (i / 15) as f64)).collect();
        let centre = 7 * 15 + 7;
        for (support, one, two) in [(2.0, 9, 25), (2.4, 21, 69), (3.0, 25, 81)] {
            let table = Neighbourhood::search(&points, &[(0..points.len(), support)], []);
            assert_eq!(table.of(centre).len(), one);
            assert_eq!(table.two_ring(centre).len(), two);
        }
    }
}
