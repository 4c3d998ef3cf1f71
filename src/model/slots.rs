//! Where the entries of the tangent are: its pattern and the rings behind it, found once per run.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use nicolson_solvers::linear::SparsePattern;
use rayon::prelude::*;

use super::Model;

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
        let (n, neighbourhood) = (self.particles(), &self.gradient.neighbourhood);
        let found: Vec<(Vec<u32>, Vec<u32>)> = (0..n)
            .into_par_iter()
            .map(|a| {
                let ring = neighbourhood.two_ring(a);
                let slots = neighbourhood.of(a).iter().flat_map(|&c| walk(&ring, neighbourhood.of(c as usize)));
                let slots = slots.collect();
                (ring, slots)
            })
            .collect();
        let (mut known, mut slot_starts, mut slots) = (HashMap::new(), Vec::with_capacity(n), Vec::new());
        let (mut ring_starts, mut rings) =
            (vec![0], Vec::with_capacity(found.iter().map(|(ring, _)| ring.len()).sum()));
        let (mut offsets, mut columns) = (vec![0], Vec::new());
        for (a, (ring, own)) in found.iter().enumerate() {
            slot_starts.push(*known.entry(own.as_slice()).or_insert_with(|| {
                let start = slots.len();
                slots.extend_from_slice(own);
                start
            }));
            self.push_rows(a, ring, &mut offsets, &mut columns);
            rings.extend_from_slice(ring);
            ring_starts.push(rings.len());
        }
        Slots { pattern: Arc::new(SparsePattern::new(offsets, columns)), ring_starts, rings, slot_starts, slots }
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

/// Places, from 1, of ascending particles in a sorted ring that contains them all.
fn walk<'a>(ring: &'a [u32], particles: &'a [u32]) -> impl Iterator<Item = u32> + 'a {
    let mut place = 0;
    particles.iter().map(move |&e| {
        while ring[place] < e {
            place += 1;
        }
        place as u32 + 1
    })
}
