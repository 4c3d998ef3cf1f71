//! Entries of the tangent on a pattern that is fixed for the whole run.
//!
//! Row a couples to its two-ring. Its blocks are summed in a buffer that stays in the first cache ([`Row`]), and then
//! written in one pass; each row is written by its owner, so that threads share nothing, and the order of all sums is
//! fixed. The buffers are kept: only the first assembly allocates.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nicolson_solvers::linear::{SparseMatrix, SparsePattern, StoredTangent, Symmetry};

use super::rows::Row;
use super::{Model, Unknowns};

/// Particles assembled as one piece of work.
const PIECE: usize = 64;

/// The part of the tangent that couples direct neighbours only: the other entries are dropped, which
/// makes a far better preconditioner than lumping them onto the diagonal.
pub type OneRing = StoredTangent;

/// Buffers of rows that wait for the next assembly, one per thread at most.
#[derive(Debug, Default)]
pub struct Buffers<const D: usize>(Mutex<Vec<Row<D>>>);

impl<const D: usize> Clone for Buffers<D> {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<const D: usize> Buffers<D> {
    fn take(&self) -> Option<Row<D>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop()
    }

    fn put(&self, row: Row<D>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(row);
    }
}

impl<const D: usize> Model<D> {
    /// The tangent at the last linearised point as a matrix of its own.
    pub fn tangent_matrix(&self) -> SparseMatrix {
        let mut matrix = SparseMatrix::zeros(self.slots().pattern());
        self.assemble(matrix.values_mut());
        matrix
    }

    /// The one-ring part of the tangent at the last linearised point. Only its own entries are ever
    /// stored, so it serves the matrix-free path where the whole tangent would not fit.
    pub(super) fn one_ring(&self) -> OneRing {
        let pattern = self.linearisation.one_ring_pattern.get_or_init(|| Arc::new(self.one_ring_pattern()));
        let mut values = vec![0.0; pattern.entries()];
        self.assemble_range(0..self.particles(), pattern, &|a| (self.gradient.neighbourhood.of(a), None), &mut values);
        OneRing::new(pattern, values, Symmetry::General)
    }

    /// Writes all entries.
    pub(super) fn assemble(&self, values: &mut [f64]) {
        let slots = self.slots();
        self.assemble_range(0..self.particles(), slots.pattern(), &|a| (slots.ring(a), Some(slots.of(a))), values);
    }

    /// Writes the rows of a range of particles, which couple to the members that are given, with the slots of their
    /// neighbours' neighbours.
    fn assemble_range<'a>(
        &'a self,
        range: Range<usize>,
        pattern: &SparsePattern,
        members: &(impl Fn(usize) -> (&'a [u32], Option<&'a [u32]>) + Sync),
        values: &mut [f64],
    ) {
        let first = |a: usize| pattern.offsets()[self.unknowns.starts()[a]];
        if range.len() > PIECE {
            let middle = range.start + range.len() / 2;
            let (left, right) = values.split_at_mut(first(middle) - first(range.start));
            rayon::join(
                || self.assemble_range(range.start..middle, pattern, members, left),
                || self.assemble_range(middle..range.end, pattern, members, right),
            );
            return;
        }
        let buffers = &self.linearisation.buffers;
        let mut row = buffers.take().unwrap_or_else(|| Row::new(self.particles()));
        let mut rest = values;
        for a in range {
            let (own, tail) = rest.split_at_mut(first(a + 1) - first(a));
            rest = tail;
            if own.is_empty() {
                continue;
            }
            let (members, slots) = members(a);
            self.derive_row(a, members, slots, &mut row);
            self.write_rows(a, members, &row, own);
        }
        buffers.put(row);
    }

    /// Writes the rows of particle `a` from its blocks.
    fn write_rows(&self, a: usize, members: &[u32], row: &Row<D>, values: &mut [f64]) {
        if values.len() == D * D * members.len() && !row.mixed {
            // Every component of every member is an unknown.
            let width = D * members.len();
            for (m, block) in row.blocks().iter().enumerate() {
                for (k, column) in block.data.0.iter().enumerate() {
                    for (i, value) in column.iter().enumerate() {
                        values[i * width + m * D + k] = *value;
                    }
                }
            }
            return;
        }
        let mut out = values.iter_mut();
        let mut put = |value: f64| {
            if let Some(slot) = out.next() {
                *slot = value;
            }
        };
        let velocity = |e: u32, k: usize| self.unknowns.velocity(e as usize, k).is_some();
        if !row.mixed {
            for i in (0..D).filter(|&i| velocity(a as u32, i)) {
                for (&e, block) in members.iter().zip(row.blocks()) {
                    (0..D).filter(|&k| velocity(e, k)).for_each(|k| put(block[(i, k)]));
                }
            }
            return;
        }
        let s = self.linearisation.shift;
        let full = self.unknowns.kind() == Unknowns::Full;
        let mass = self.masses[a];
        for i in (0..D).filter(|&i| velocity(a as u32, i)) {
            for (slot, &e) in (1..).zip(members) {
                let own = e as usize == a;
                let (through, direct, volume) = (&row.through[slot], &row.direct[slot], &row.volume[slot]);
                for k in (0..D).filter(|&k| velocity(e, k)) {
                    let inertia = if own && i == k { mass } else { 0.0 };
                    let eliminated = if full { 0.0 } else { s * through[(i, k)] };
                    put(inertia - s * (direct[(i, k)] + eliminated));
                }
                put(-s * volume.force[i] / self.volume_unit(e as usize));
                (0..D).filter(|&k| full && velocity(e, k)).for_each(|k| put(-s * s * through[(i, k)]));
            }
        }
        let unit = mass * self.volume_unit(a);
        for (&e, volume) in members.iter().zip(&row.volume[1..]) {
            for k in (0..D).filter(|&k| velocity(e, k)) {
                let eliminated = if full { 0.0 } else { s * volume.rate_by_displacement[k] };
                put(-unit * s * (volume.rate_by_velocity[k] + eliminated));
            }
            let own = if e as usize == a { 1.0 } else { 0.0 };
            put(unit * (own - s * volume.rate_by_volume) / self.volume_unit(e as usize));
            (0..D)
                .filter(|&k| full && velocity(e, k))
                .for_each(|k| put(-unit * s * s * volume.rate_by_displacement[k]));
        }
        if full {
            for _ in (0..D).filter(|&i| velocity(a as u32, i)) {
                put(-mass);
                put(mass);
            }
        }
    }
}
