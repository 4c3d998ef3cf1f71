//! Rows that repeat: on a lattice, consecutive particles have the same neighbours, relative to themselves, with the
//! same weights. A run of them needs one row, and its sums are sums of shifted copies of the field, which are
//! contiguous in memory: no table is read but one row, and the loops become vector instructions.
//!
//! Weights of a run agree up to the rounding of positions, `ε |X|/Δx`; within that they are made equal to the bit,
//! which changes results by rounding, once, for every path. Sums take their terms in the order of the row in both
//! paths, without fused multiply-add: the same bits, whether a particle is in a run or not.
//!
//! Rejected: stencils shared by particles that do not follow each other in the numbering (walls across the first
//! direction of a lattice). They would save memory, not time: their neighbours are not contiguous.

use std::ops::Range;

use rayon::prelude::*;

use super::Neighbourhood;
use crate::tensor::Vector;

/// Numbers that are summed together: a piece shorter than this goes row by row.
pub const TILE: usize = 16;
/// Particles within which a run is looked for by one thread; runs end there.
const CHUNK: usize = 1 << 14;
/// Rows of their own.
const NONE: u32 = u32::MAX;
/// Different stencils that are kept; a body with more of them is not a lattice.
const MOST: usize = 4096;

/// One row for many particles: neighbours relative to the particle, and weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Stencil<const D: usize> {
    /// `b − a`, and the weight.
    pub entries: Vec<(i32, [f64; D])>,
}

/// Particles up to `end` that share a stencil, or have none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Segment {
    end: u32,
    stencil: u32,
}

/// All runs of a numbering, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Runs<const D: usize> {
    segments: Vec<Segment>,
    stencils: Vec<Stencil<D>>,
    covered: usize,
}

impl<const D: usize> Runs<D> {
    /// Finds runs of particles whose rows differ by less than `tolerance(a)`, 1/m. `weight` gives that of an entry.
    pub fn find(
        rows: &Neighbourhood,
        weight: impl Fn(usize) -> Vector<D> + Sync,
        tolerance: impl Fn(usize) -> f64 + Sync,
    ) -> Self {
        let n = rows.len();
        let same = |a: usize, b: usize| same_row(rows, a, b, &weight, tolerance(a));
        let chunks: Vec<Vec<Range<usize>>> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| runs_within(chunk * CHUNK..((chunk + 1) * CHUNK).min(n), &same))
            .collect();
        let mut found = Self::default();
        let mut last = 0;
        for run in chunks.into_iter().flatten() {
            let Some(stencil) = found.stencil_of(rows, run.start, &weight, tolerance(run.start)) else { break };
            found.push(run.start, NONE);
            found.push(run.end, stencil);
            found.covered += run.len();
            last = run.end;
        }
        if last < n {
            found.push(n, NONE);
        }
        found
    }

    /// No run at all among `n` particles.
    pub fn none(n: usize) -> Self {
        let mut runs = Self::default();
        runs.push(n, NONE);
        runs
    }

    /// Particles that are in runs.
    pub fn covered(&self) -> usize {
        self.covered
    }

    /// The pieces of a range of particles, and their stencils.
    pub fn pieces(&self, range: Range<usize>) -> impl Iterator<Item = (Range<usize>, Option<&Stencil<D>>)> {
        let first = self.segments.partition_point(|segment| segment.end as usize <= range.start);
        let mut start = range.start;
        self.segments[first..].iter().map_while(move |segment| {
            let piece = start..(segment.end as usize).min(range.end);
            start = piece.end;
            (!piece.is_empty()).then(|| (piece, self.stencils.get(segment.stencil as usize)))
        })
    }

    fn push(&mut self, end: usize, stencil: u32) {
        let start = self.segments.last().map_or(0, |segment| segment.end);
        if end as u32 > start {
            self.segments.push(Segment { end: end as u32, stencil });
        }
    }

    /// Number of the stencil of a row, a new one if there is none like it; `None` if there are too many.
    fn stencil_of(
        &mut self,
        rows: &Neighbourhood,
        a: usize,
        weight: &impl Fn(usize) -> Vector<D>,
        tolerance: f64,
    ) -> Option<u32> {
        let entry = |entry: usize| ((rows.neighbour(entry) as i64 - a as i64) as i32, weight(entry).into());
        let wanted: Vec<(i32, [f64; D])> = rows.row(a).map(entry).collect();
        let like = |stencil: &Stencil<D>| {
            stencil.entries.len() == wanted.len()
                && stencil.entries.iter().zip(&wanted).all(|((offset, g), (other, h))| {
                    offset == other && g.iter().zip(h).all(|(g, h)| (g - h).abs() <= tolerance)
                })
        };
        if let Some(found) = self.stencils.iter().rposition(like) {
            return Some(found as u32);
        }
        if self.stencils.len() == MOST {
            return None;
        }
        self.stencils.push(Stencil { entries: wanted });
        Some((self.stencils.len() - 1) as u32)
    }
}

/// Whether two rows have the same neighbours relative to their particles, with the same weights.
fn same_row<const D: usize>(
    rows: &Neighbourhood,
    a: usize,
    b: usize,
    weight: &impl Fn(usize) -> Vector<D>,
    tolerance: f64,
) -> bool {
    let (own, other) = (rows.of(a), rows.of(b));
    let shift = (b as u32).wrapping_sub(a as u32);
    own.len() == other.len()
        && own.iter().zip(other).all(|(x, y)| x.wrapping_add(shift) == *y)
        && rows.row(a).zip(rows.row(b)).all(|(x, y)| (weight(x) - weight(y)).amax() <= tolerance)
}

/// Runs that are long enough to be worth it.
fn runs_within(particles: Range<usize>, same: &impl Fn(usize, usize) -> bool) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = particles.start;
    while start < particles.end {
        let length = (start + 1..particles.end).take_while(|&a| same(start, a)).count() + 1;
        if length >= TILE {
            runs.push(start..start + length);
        }
        start += length;
    }
    runs
}

/// `out[d] += g_d · field` along a run, with `start` the first particle.
#[inline(always)]
pub fn gather<const D: usize>(stencil: &Stencil<D>, start: usize, field: &[f64], out: [&mut [f64]; D]) {
    let length = out[0].len();
    let mut at = 0;
    while at < length {
        // The last tile reaches back over what is done: the same numbers again.
        let tile = at.min(length - TILE);
        let mut sums = [[0.0; TILE]; D];
        for (offset, weights) in &stencil.entries {
            let first = (start * D + tile).wrapping_add_signed(*offset as isize * D as isize);
            let Some(values) = field.get(first..).and_then(|rest| rest.first_chunk::<TILE>()) else { return };
            for d in 0..D {
                let (sums, weight) = (&mut sums[d], weights[d]);
                for lane in 0..TILE {
                    sums[lane] += weight * values[lane];
                }
            }
        }
        for d in 0..D {
            out[d][tile..tile + TILE].copy_from_slice(&sums[d]);
        }
        at = tile + TILE;
    }
}

/// `out = Σ g_d · field[d]` along a run: the other way.
#[inline(always)]
pub fn spread<const D: usize>(stencil: &Stencil<D>, start: usize, fields: &[Vec<f64>; D], out: &mut [f64]) {
    let length = out.len();
    let mut at = 0;
    while at < length {
        let tile = at.min(length - TILE);
        let mut sums = [0.0; TILE];
        for (offset, weights) in &stencil.entries {
            let first = (start * D + tile).wrapping_add_signed(*offset as isize * D as isize);
            for d in 0..D {
                let Some(values) = fields[d].get(first..).and_then(|rest| rest.first_chunk::<TILE>()) else { return };
                for lane in 0..TILE {
                    sums[lane] += weights[d] * values[lane];
                }
            }
        }
        out[tile..tile + TILE].copy_from_slice(&sums);
        at = tile + TILE;
    }
}
