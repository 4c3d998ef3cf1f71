//! Where the entries of the tangent are: its pattern and the rings behind it, found once per run.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use nicolson_solvers::linear::SparsePattern;
use rayon::prelude::*;

use super::Model;

/// Particles whose rings are found at a time: what they have before it is shared takes room.
const CHUNK: usize = 4096;

/// Pattern of the entries, and whose they are.
#[derive(Debug, Clone)]
pub struct Slots {
    pattern: Arc<SparsePattern>,
    /// Two-rings, in compressed rows.
    ring_starts: Vec<usize>,
    rings: Vec<u32>,
    /// Where the slots of a particle begin; particles whose rings look alike, as in a lattice, share them.
    slot_starts: Vec<usize>,
    slots: Vec<u32>,
}

impl Slots {
    /// The pattern.
    pub fn pattern(&self) -> &Arc<SparsePattern> {
        &self.pattern
    }

    /// Particles that the rows of `a` couple to, ascending.
    pub(super) fn ring(&self, a: usize) -> &[u32] {
        &self.rings[self.ring_range(a)]
    }

    /// For every neighbour c of `a`, and every neighbour e of c: the place of e in a's ring, counted from 1.
    #[inline]
    pub(super) fn of(&self, a: usize) -> &[u32] {
        &self.slots[self.slot_starts[a]..]
    }

    /// Where the ring of `a` lies among all rings.
    pub(super) fn ring_range(&self, a: usize) -> Range<usize> {
        self.ring_starts[a]..self.ring_starts[a + 1]
    }
}

impl<const D: usize> Model<D> {
    /// Pattern and rings, built at the first request: an explicit run never pays for them.
    pub(super) fn slots(&self) -> &Slots {
        self.linearisation.slots.get_or_init(|| self.build_slots())
    }

    fn build_slots(&self) -> Slots {
        let n = self.particles();
        let (mut ring_starts, mut rings) = (vec![0], Vec::new());
        let (mut known, mut slot_starts, mut slots) = (HashMap::new(), Vec::with_capacity(n), Vec::new());
        let (mut offsets, mut columns) = (vec![0], Vec::new());
        for first in (0..n).step_by(CHUNK) {
            let found: Vec<(Vec<u32>, Vec<u32>)> = (first..n.min(first + CHUNK))
                .into_par_iter()
                .with_min_len(CHUNK / 16)
                .map_init(|| vec![0; n], |place, a| self.ring_and_slots(a, place))
                .collect();
            for (a, (ring, own)) in (first..).zip(found) {
                self.push_rows(a, &ring, &mut offsets, &mut columns);
                rings.extend_from_slice(&ring);
                ring_starts.push(rings.len());
                let start = known.get(own.as_slice()).copied().unwrap_or_else(|| {
                    let start = slots.len();
                    slots.extend_from_slice(&own);
                    known.insert(own, start);
                    start
                });
                slot_starts.push(start);
            }
        }
        Slots { pattern: Arc::new(SparsePattern::new(offsets, columns)), ring_starts, rings, slot_starts, slots }
    }

    /// The two-ring of a particle, and the places in it, from 1, of the neighbours of all its neighbours. `place` is zero
    /// for all particles, before and after.
    fn ring_and_slots(&self, a: usize, place: &mut [u32]) -> (Vec<u32>, Vec<u32>) {
        let near = &self.gradient.neighbourhood;
        let reached = || near.of(a).iter().flat_map(|&c| near.of(c as usize));
        let mut ring = Vec::new();
        for &e in reached() {
            if place[e as usize] == 0 {
                place[e as usize] = 1;
                ring.push(e);
            }
        }
        ring.sort_unstable();
        for (slot, &e) in (1..).zip(&ring) {
            place[e as usize] = slot;
        }
        let slots = reached().map(|&e| place[e as usize]).collect();
        ring.iter().for_each(|&e| place[e as usize] = 0);
        (ring, slots)
    }

    /// The velocity unknown that belongs to a displacement unknown; `None` for other unknowns.
    fn displacement_row(&self, a: usize, unknown: usize) -> Option<usize> {
        (0..D).find(|&i| self.unknowns.displacement(a, i) == Some(unknown)).and_then(|i| self.unknowns.velocity(a, i))
    }

    pub(super) fn one_ring_pattern(&self) -> SparsePattern {
        let (mut offsets, mut columns) = (vec![0], Vec::new());
        for a in 0..self.particles() {
            self.push_rows(a, self.gradient.neighbourhood.of(a), &mut offsets, &mut columns);
        }
        SparsePattern::new(offsets, columns)
    }

    /// Appends the rows of particle `a`, which couples to the given particles.
    fn push_rows(&self, a: usize, coupled: &[u32], offsets: &mut Vec<usize>, columns: &mut Vec<usize>) {
        let row: Vec<usize> = coupled.iter().flat_map(|&e| self.unknowns.of(e as usize)).collect();
        for unknown in self.unknowns.of(a) {
            match self.displacement_row(a, unknown) {
                Some(velocity) => columns.extend([velocity, unknown]),
                None => columns.extend_from_slice(&row),
            }
            offsets.push(columns.len());
        }
    }
}
