//! Jacobi and block Jacobi: `M` is the diagonal, or the diagonal blocks, of `A`. Saad (2003), §10.2 and
//! §12.2.

use super::super::factor::check_entries;
use super::super::iteration::ApproximateInverse;
use super::super::{LinearCounts, LinearError, Tangent};
use super::unsuitable;
use crate::vector::first_not_finite;

/// A pivot below this fraction of the largest entry of its block makes the block singular.
const SINGULAR_PIVOT: f64 = 1e-14;

/// Explicit inverses of diagonal blocks (a block is small: the unknowns of one particle).
#[derive(Debug, Default)]
pub(in super::super) struct BlockInverses {
    /// Boundaries of the blocks.
    bounds: Vec<usize>,
    /// Where the inverse of each block starts, row by row.
    starts: Vec<usize>,
    inverses: Vec<f64>,
}

impl BlockInverses {
    /// Inverses of blocks of equal size, given by rows. Those that are not positive definite are replaced by their
    /// diagonals' magnitudes: this serves smoothers.
    pub(in super::super) fn uniform(size: usize, blocks: Vec<f64>) -> Self {
        let count = blocks.len() / (size * size).max(1);
        Self::definite((0..=count).map(|k| k * size).collect(), blocks)
    }

    /// The same for blocks with the given boundaries.
    pub(in super::super) fn definite(bounds: Vec<usize>, mut blocks: Vec<f64>) -> Self {
        let mut starts = vec![0];
        for bounds in bounds.windows(2) {
            let (start, size) = (starts[starts.len() - 1], bounds[1] - bounds[0]);
            let block = &mut blocks[start..start + size * size];
            let diagonal: Vec<f64> = (0..size).map(|i| block[i * size + i].abs()).collect();
            if invert(block, size, true).is_err() {
                block.fill(0.0);
                for (i, value) in diagonal.into_iter().enumerate() {
                    block[i * size + i] = if value > 0.0 { 1.0 / value } else { 1.0 };
                }
            }
            starts.push(start + size * size);
        }
        Self { bounds, starts, inverses: blocks }
    }

    /// `z = D⁻¹ r`.
    pub(in super::super) fn apply(&self, r: &[f64], z: &mut [f64]) {
        for (bounds, &start) in self.bounds.windows(2).zip(&self.starts) {
            let size = bounds[1] - bounds[0];
            let r = &r[bounds[0]..bounds[1]];
            for (i, z) in z[bounds[0]..bounds[1]].iter_mut().enumerate() {
                let row = &self.inverses[start + i * size..start + (i + 1) * size];
                *z = row.iter().zip(r).map(|(a, r)| a * r).sum();
            }
        }
    }

    /// Stored numbers.
    pub(in super::super) fn entries(&self) -> usize {
        self.inverses.len()
    }
}

/// The preconditioner.
pub(super) struct BlockJacobi {
    pointwise: bool,
    definite: bool,
    blocks: BlockInverses,
    values: Vec<f64>,
}

impl BlockJacobi {
    /// Every unknown is a block.
    pub(super) fn pointwise(definite: bool) -> Self {
        Self::new(true, definite)
    }

    /// The blocks are those of the operator.
    pub(super) fn blockwise(definite: bool) -> Self {
        Self::new(false, definite)
    }

    fn new(pointwise: bool, definite: bool) -> Self {
        Self { pointwise, definite, blocks: BlockInverses::default(), values: Vec::new() }
    }

    /// Lays out the blocks.
    fn lay_out(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        let n = tangent.size();
        self.blocks.bounds.clear();
        let blocks = tangent.blocks();
        if self.pointwise || blocks.is_empty() {
            self.blocks.bounds.extend(0..=n);
        } else {
            let valid = blocks.first() == Some(&0)
                && blocks.last() == Some(&n)
                && blocks.windows(2).all(|bounds| bounds[0] <= bounds[1]);
            if !valid {
                return Err(unsuitable(&self.name(), "the blocks do not cover the unknowns in order"));
            }
            self.blocks.bounds.extend_from_slice(blocks);
        }
        self.blocks.starts.clear();
        self.blocks.starts.push(0);
        let mut end = 0;
        for bounds in self.blocks.bounds.windows(2) {
            end += (bounds[1] - bounds[0]).pow(2);
            self.blocks.starts.push(end);
        }
        self.blocks.inverses.clear();
        self.blocks.inverses.resize(end, 0.0);
        Ok(())
    }
}

impl BlockJacobi {
    /// Takes the blocks of the operator, from itself or from its entries.
    fn take_blocks(&mut self, tangent: &dyn Tangent) -> Result<(), LinearError> {
        if tangent.offers_diagonal_blocks() {
            let blocks = tangent.blocks();
            let length = if blocks.is_empty() {
                tangent.size()
            } else {
                blocks.windows(2).map(|bounds| (bounds[1] - bounds[0]).pow(2)).sum()
            };
            self.values.clear();
            self.values.resize(length, 0.0);
            tangent.diagonal_blocks(&mut self.values);
            if self.pointwise && !blocks.is_empty() {
                let mut start = 0;
                for bounds in blocks.windows(2) {
                    let size = bounds[1] - bounds[0];
                    (0..size).for_each(|i| self.blocks.inverses[bounds[0] + i] = self.values[start + i * size + i]);
                    start += size * size;
                }
            } else {
                self.blocks.inverses.copy_from_slice(&self.values);
            }
            self.values = Vec::new();
            return match first_not_finite(&self.blocks.inverses) {
                Some(k) => {
                    let block = self.blocks.starts.partition_point(|&start| start <= k) - 1;
                    let size = self.blocks.bounds[block + 1] - self.blocks.bounds[block];
                    Err(LinearError::EntryNotFinite {
                        row: self.blocks.bounds[block] + (k - self.blocks.starts[block]) / size,
                    })
                }
                None => Ok(()),
            };
        }
        let pattern = tangent.pattern().ok_or_else(|| LinearError::NeedsEntries { solver: self.name() })?;
        self.values.resize(pattern.entries(), 0.0);
        tangent.fill(&mut self.values);
        check_entries(pattern, &self.values)?;
        for (bounds, &start) in self.blocks.bounds.windows(2).zip(&self.blocks.starts) {
            let (first, size) = (bounds[0], bounds[1] - bounds[0]);
            let block = &mut self.blocks.inverses[start..start + size * size];
            for i in 0..size {
                let row = first + i;
                for (value, &column) in self.values[pattern.stored(row)].iter().zip(pattern.row(row)) {
                    if (first..first + size).contains(&column) {
                        block[i * size + column - first] = *value;
                    }
                }
            }
        }
        Ok(())
    }
}

impl ApproximateInverse for BlockJacobi {
    fn name(&self) -> String {
        if self.pointwise { "Jacobi" } else { "block Jacobi" }.to_owned()
    }

    fn prepare(&mut self, tangent: &dyn Tangent, counts: &mut LinearCounts) -> Result<(), LinearError> {
        self.lay_out(tangent)?;
        counts.factorisations += 1;
        self.take_blocks(tangent)?;
        for (bounds, &start) in self.blocks.bounds.windows(2).zip(&self.blocks.starts) {
            let (first, size) = (bounds[0], bounds[1] - bounds[0]);
            let block = &mut self.blocks.inverses[start..start + size * size];
            if let Err((i, value)) = invert(block, size, self.definite) {
                let unknown = Some(first + i);
                return Err(if self.definite && value < 0.0 {
                    LinearError::NotPositiveDefinite { unknown, value }
                } else if self.pointwise || size == 1 {
                    unsuitable(&self.name(), format_args!("the diagonal entry of unknown {} is zero", first + i))
                } else {
                    unsuitable(&self.name(), format_args!("the block of unknown {} is singular", first + i))
                });
            }
        }
        Ok(())
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.blocks.apply(r, z);
    }

    fn fill(&self) -> usize {
        self.blocks.entries()
    }
}

/// Replaces a dense matrix (by rows) by its inverse: Gauss–Jordan with exchange of rows, or without
/// when it must be positive definite, where every pivot is positive if and only if the matrix is.
///
/// Fails with the index and value of an unusable pivot.
fn invert(a: &mut [f64], n: usize, definite: bool) -> Result<(), (usize, f64)> {
    let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut exchanges = Vec::new();
    for k in 0..n {
        let chosen = if definite {
            k
        } else {
            (k..n).fold(k, |best, i| if a[i * n + k].abs() > a[best * n + k].abs() { i } else { best })
        };
        let pivot = a[chosen * n + k];
        let size = if definite { pivot } else { pivot.abs() };
        if size <= SINGULAR_PIVOT * largest {
            return Err((k, pivot));
        }
        if chosen != k {
            (0..n).for_each(|j| a.swap(k * n + j, chosen * n + j));
            exchanges.push((k, chosen));
        }
        a[k * n + k] = 1.0;
        (0..n).for_each(|j| a[k * n + j] /= pivot);
        for i in (0..n).filter(|&i| i != k) {
            let factor = std::mem::replace(&mut a[i * n + k], 0.0);
            (0..n).for_each(|j| a[i * n + j] -= factor * a[k * n + j]);
        }
    }
    // Exchanged rows of the matrix are exchanged columns of the inverse, last first.
    for &(k, other) in exchanges.iter().rev() {
        (0..n).for_each(|i| a.swap(i * n + k, i * n + other));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_of_a_block_with_exchanges() {
        let a = [0.0, 2.0, 1.0, 1.0, 1.0, -3.0, 4.0, 0.5, 2.0];
        let mut inverse = a;
        invert(&mut inverse, 3, false).expect("regular");
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| a[i * 3 + k] * inverse[k * 3 + j]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn indefinite_and_singular_blocks_are_refused() {
        assert_eq!(invert(&mut [1.0, 2.0, 2.0, 1.0], 2, true), Err((1, -3.0)));
        assert!(invert(&mut [1.0, 2.0, 2.0, 1.0], 2, false).is_ok());
        assert!(invert(&mut [1.0, 2.0, 2.0, 4.0], 2, false).is_err());
        assert!(invert(&mut [], 0, true).is_ok());
    }
}
