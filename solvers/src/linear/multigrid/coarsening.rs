//! Every other node of a lattice: the step from one coarse space to the next.

use super::tents::{Lattice, NONE};

/// Interpolation from one lattice of nodes to the one twice as fine.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coarsening {
    lattices: Vec<Lattice>,
    numbers: Vec<u32>,
    pub(super) nodes: usize,
    /// Where the coarse nodes of each fine one begin, the coarse nodes, and their weights.
    starts: Vec<u32>,
    entries: Vec<(u32, f64)>,
}

impl Coarsening {
    /// Every other node of lattices, of which `nodes` have a number.
    pub(super) fn new(fine: &[Lattice], known: &[u32], nodes: usize) -> Self {
        let (mut lattices, mut size) = (Vec::new(), 0);
        for lattice in fine {
            let counts = lattice.counts.map(|count| if count == 1 { 1 } else { count / 2 + 1 });
            lattices.push(Lattice { counts, offset: size });
            size += counts.iter().product::<usize>();
        }
        let mut out = Self { lattices, numbers: vec![NONE; size], nodes: 0, starts: vec![0], entries: Vec::new() };
        let mut ordered: Vec<(u32, usize, [usize; 3])> = Vec::with_capacity(nodes);
        for (part, lattice) in fine.iter().enumerate() {
            let [nx, ny, nz] = lattice.counts;
            for place in 0..nx * ny * nz {
                let number = known[lattice.offset + place];
                if number != NONE {
                    ordered.push((number, part, [place % nx, place / nx % ny, place / (nx * ny)]));
                }
            }
        }
        ordered.sort_unstable();
        for (_, part, node) in ordered {
            let mut corners: Vec<([usize; 3], f64)> = vec![([0; 3], 1.0)];
            for i in 0..3 {
                let half = node[i] / 2;
                corners = corners
                    .into_iter()
                    .flat_map(|(mut at, weight)| {
                        at[i] = half;
                        let mut next = at;
                        next[i] += 1;
                        if node[i] % 2 == 0 {
                            vec![(at, weight)]
                        } else {
                            vec![(at, 0.5 * weight), (next, 0.5 * weight)]
                        }
                    })
                    .collect();
            }
            for (at, weight) in corners {
                let number = &mut out.numbers[out.lattices[part].place(at)];
                if *number == NONE {
                    #[expect(clippy::cast_possible_truncation, reason = "fewer than the finer nodes")]
                    let next = out.nodes as u32;
                    *number = next;
                    out.nodes += 1;
                }
                out.entries.push((*number, weight));
            }
            #[expect(clippy::cast_possible_truncation, reason = "at most eight for every node")]
            out.starts.push(out.entries.len() as u32);
        }
        out
    }

    /// Coarse nodes and weights of a fine node.
    pub(super) fn of(&self, node: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    pub(super) fn coarser(&self) -> Self {
        Self::new(&self.lattices, &self.numbers, self.nodes)
    }

    pub(super) fn restrict(&self, dimension: usize, fine: &[f64], coarse: &mut [f64]) {
        coarse.fill(0.0);
        for (node, fine) in fine.chunks(dimension).enumerate() {
            for &(to, weight) in self.of(node) {
                let coarse = &mut coarse[to as usize * dimension..];
                coarse.iter_mut().zip(fine).for_each(|(c, f)| *c += weight * f);
            }
        }
    }

    pub(super) fn prolong(&self, dimension: usize, coarse: &[f64], fine: &mut [f64]) {
        for (node, fine) in fine.chunks_mut(dimension).enumerate() {
            for &(from, weight) in self.of(node) {
                let coarse = &coarse[from as usize * dimension..];
                fine.iter_mut().zip(coarse).for_each(|(f, c)| *f += weight * c);
            }
        }
    }
}
