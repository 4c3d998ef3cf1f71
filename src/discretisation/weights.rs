//! Gradient weights on the neighbour lists, with rows that repeat stored once.
//!
//! On a lattice nearly all rows have the same weights, and a row of 57 neighbours in 3D takes 1.4 kB. So rows that are the
//! same to the bit share their place. Every entry of the neighbour lists then finds its weight with one number per
//! particle: the distance from its place in the lists to that in the table.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use super::Neighbourhood;
use crate::tensor::Vector;

/// Rows after which a body that repeats nothing is taken for a cloud.
const TRIED: usize = 4096;
/// Share of different rows above which sharing is not worth its search.
const MOSTLY_DIFFERENT: f64 = 0.9;

/// Weights `g_ab`, 1/m.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Weights<const D: usize> {
    table: Vec<Vector<D>>,
    /// From a particle's entries in the neighbour lists back to those of its row in the table.
    back: Vec<u32>,
}

impl<const D: usize> Weights<D> {
    /// One weight for every entry of the neighbour lists, none of them shared.
    pub(super) fn of_entries(table: Vec<Vector<D>>, rows: &Neighbourhood) -> Self {
        Self { table, back: vec![0; rows.len()] }
    }

    /// The weights of all entries, before any is shared.
    pub(super) fn entries_mut(&mut self) -> &mut [Vector<D>] {
        &mut self.table
    }

    /// Weights that are stored.
    pub fn stored(&self) -> usize {
        self.table.len()
    }

    /// Weights of the entries of a particle's row.
    #[inline(always)]
    pub fn row(&self, a: usize, entries: Range<usize>) -> &[Vector<D>] {
        let back = self.back[a] as usize;
        &self.table[entries.start - back..entries.end - back]
    }

    /// Weight of one entry of the row of particle `a`.
    #[inline(always)]
    pub fn at(&self, a: usize, entry: usize) -> &Vector<D> {
        &self.table[entry - self.back[a] as usize]
    }

    /// Shares rows that are the same to the bit: they move down in place, so that no second table is needed.
    pub(super) fn share(&mut self, rows: &Neighbourhood) {
        let mut known: HashMap<u64, Vec<Range<usize>>> = HashMap::new();
        let (mut end, mut last) = (0, 0..0);
        for a in 0..rows.len() {
            let row = rows.row(a);
            if a == TRIED && end as f64 > MOSTLY_DIFFERENT * row.start as f64 {
                break;
            }
            if !self.same(&row, &last) {
                let alike = known.entry(self.hash(&row)).or_default();
                last = match alike.iter().find(|other| self.same(&row, other)) {
                    Some(other) => other.clone(),
                    None => {
                        self.table.copy_within(row.clone(), end);
                        alike.push(end..end + row.len());
                        let own = end..end + row.len();
                        end = own.end;
                        own
                    }
                };
            }
            self.back[a] = (row.start - last.start) as u32;
            if a + 1 == rows.len() {
                self.table.truncate(end);
                self.table.shrink_to_fit();
                return;
            }
        }
        // Not all rows were looked at: the rest moves down as it is.
        let done = rows.len().min(TRIED);
        if done < rows.len() {
            let rest = rows.row(done).start;
            self.table.copy_within(rest.., end);
            self.table.truncate(self.table.len() - (rest - end));
            self.table.shrink_to_fit();
            self.back[done..].fill((rest - end) as u32);
        }
    }

    fn same(&self, row: &Range<usize>, other: &Range<usize>) -> bool {
        let bits = |range: &Range<usize>| self.table[range.clone()].iter().flatten().map(|w| w.to_bits());
        row.len() == other.len() && bits(row).eq(bits(other))
    }

    fn hash(&self, row: &Range<usize>) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.table[row.clone()].iter().flatten().for_each(|weight| weight.to_bits().hash(&mut hasher));
        hasher.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of points, of which each sees those beside it; weights by `kind(a)`.
    fn shared(n: usize, kind: impl Fn(usize) -> f64) -> (Neighbourhood, Vec<Vector<1>>, Weights<1>) {
        let positions: Vec<Vector<1>> = (0..n).map(|a| Vector::repeat(a as f64)).collect();
        let rows = Neighbourhood::search(&positions, &[(0..n, 1.5)], std::iter::empty());
        let all: Vec<Vector<1>> = (0..n)
            .flat_map(|a| rows.row(a).map(move |entry| (a, entry)))
            .map(|(a, entry)| Vector::repeat(kind(a) * (rows.neighbour(entry) as f64 - a as f64)))
            .collect();
        let mut weights = Weights::of_entries(all.clone(), &rows);
        weights.share(&rows);
        (rows, all, weights)
    }

    fn check((rows, all, weights): &(Neighbourhood, Vec<Vector<1>>, Weights<1>)) {
        for a in 0..rows.len() {
            assert_eq!(weights.row(a, rows.row(a)), &all[rows.row(a)], "row {a}");
            for entry in rows.row(a) {
                assert_eq!(weights.at(a, entry), &all[entry]);
            }
        }
    }

    #[test]
    fn rows_that_repeat_are_stored_once() {
        let lattice = shared(100, |_| 0.5);
        check(&lattice);
        // Both ends and the inside.
        assert_eq!(lattice.2.stored(), 2 + 3 + 2);
        let mixed = shared(100, |a| [0.5, 0.25][a / 7 % 2]);
        check(&mixed);
        assert!(mixed.2.stored() < 20, "{}", mixed.2.stored());
    }

    #[test]
    fn clouds_keep_every_row() {
        let cloud = shared(3 * TRIED, |a| 1.0 + a as f64);
        check(&cloud);
        assert_eq!(cloud.2.stored(), cloud.1.len());
        // A lattice behind a cloud goes unnoticed, and stays what it is.
        let behind = shared(3 * TRIED, |a| if a < TRIED { 1.0 + a as f64 } else { 1.0 });
        check(&behind);
    }
}
