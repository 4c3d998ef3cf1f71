//! Where the entries of the tangent are: its pattern, and the place of every part of a row, found once per run.

use std::sync::Arc;

use nicolson_solvers::linear::SparsePattern;

use super::Model;
use crate::discretisation::Neighbourhood;

/// Pattern of the entries and where the parts of a row go.
#[derive(Debug, Clone)]
pub struct Slots {
    pattern: Arc<SparsePattern>,
    /// First value of every particle's rows, and the number of values.
    pub(super) values: Vec<usize>,
    /// Two-rings, in compressed rows.
    ring_starts: Vec<usize>,
    rings: Vec<u32>,
    /// For every entry (a, c): where the slots of c's neighbours in a's ring begin.
    slot_starts: Vec<usize>,
    slots: Vec<u32>,
    /// First particle and first entry that it knows.
    first: (usize, usize),
}

impl Slots {
    /// The pattern.
    pub fn pattern(&self) -> &Arc<SparsePattern> {
        &self.pattern
    }

    /// Slots of c's neighbours in a's ring, for the entry (a, c).
    pub(super) fn of_entry(&self, entry: usize) -> &[u32] {
        let entry = entry - self.first.1;
        &self.slots[self.slot_starts[entry]..self.slot_starts[entry + 1]]
    }

    /// Particles that the rows of `a` couple to, ascending.
    pub(super) fn ring(&self, a: usize) -> &[u32] {
        let a = a - self.first.0;
        &self.rings[self.ring_starts[a]..self.ring_starts[a + 1]]
    }

    /// Position of a neighbour of `a` in a's ring.
    pub(super) fn position(&self, a: usize, neighbour: usize) -> usize {
        self.ring(a).partition_point(|&e| (e as usize) < neighbour)
    }
}

impl<const D: usize> Model<D> {
    /// Pattern and slots, built at the first request: an explicit run never pays for them.
    pub(super) fn slots(&self) -> &Slots {
        self.linearisation.slots.get_or_init(|| self.build_slots())
    }

    /// The slots of one particle alone, for the matrix-free path, which keeps none.
    pub(super) fn slots_of(&self, a: usize) -> Slots {
        let neighbourhood = &self.gradient.neighbourhood;
        let rings = neighbourhood.two_ring(a);
        let (mut slot_starts, mut slots) = (vec![0], Vec::new());
        for &c in neighbourhood.of(a) {
            slots.extend(walk(&rings, neighbourhood, c as usize));
            slot_starts.push(slots.len());
        }
        Slots {
            pattern: Arc::new(SparsePattern::new(vec![0], Vec::new())),
            values: Vec::new(),
            ring_starts: vec![0, rings.len()],
            rings,
            slot_starts,
            slots,
            first: (a, neighbourhood.row(a).start),
        }
    }

    fn build_slots(&self) -> Slots {
        let (n, neighbourhood) = (self.particles(), &self.gradient.neighbourhood);
        let (mut ring_starts, mut rings) = (vec![0], Vec::new());
        let (mut slot_starts, mut slots) = (Vec::with_capacity(neighbourhood.pairs() + 1), Vec::new());
        let (mut values, mut offsets, mut columns) = (vec![0], vec![0], Vec::new());
        for a in 0..n {
            let ring = neighbourhood.two_ring(a);
            for &c in neighbourhood.of(a) {
                slot_starts.push(slots.len());
                slots.extend(walk(&ring, neighbourhood, c as usize));
            }
            self.push_rows(a, &ring, &mut offsets, &mut columns);
            values.push(columns.len());
            rings.extend_from_slice(&ring);
            ring_starts.push(rings.len());
        }
        slot_starts.push(slots.len());
        Slots {
            pattern: Arc::new(SparsePattern::new(offsets, columns)),
            values,
            ring_starts,
            rings,
            slot_starts,
            slots,
            first: (0, 0),
        }
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

/// Positions of c's neighbours in a sorted ring that contains them all.
fn walk(ring: &[u32], neighbourhood: &Neighbourhood, c: usize) -> Vec<u32> {
    let mut position = 0;
    neighbourhood
        .of(c)
        .iter()
        .map(|&e| {
            while ring[position] < e {
                position += 1;
            }
            position as u32
        })
        .collect()
}
