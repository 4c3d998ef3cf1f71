//! Matrices of small blocks, one block for every pair of nodes.

use rayon::prelude::*;

use super::coarsening::Coarsening;

/// Rows of a product that one thread takes at a time.
const ROWS: usize = 64;

/// A symmetric matrix of `d × d` blocks in compressed rows of nodes.
#[derive(Debug, Clone)]
pub struct CoarseMatrix {
    dimension: usize,
    rows: Vec<Row>,
}

#[derive(Debug, Clone, Default)]
struct Row {
    columns: Vec<u32>,
    /// Blocks by rows, in the order of the columns.
    blocks: Vec<f64>,
}

impl CoarseMatrix {
    /// A matrix of zeros.
    pub fn zeros(dimension: usize, nodes: usize) -> Self {
        Self { dimension, rows: vec![Row::default(); nodes] }
    }

    /// Number of components of a node.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    pub(super) fn nodes(&self) -> usize {
        self.rows.len()
    }

    pub(super) fn size(&self) -> usize {
        self.rows.len() * self.dimension
    }

    /// Stored numbers.
    pub(super) fn entries(&self) -> usize {
        self.rows.iter().map(|row| row.blocks.len()).sum()
    }

    /// The block of two nodes by rows, to be added to; its mirror image is the caller's to add, too.
    pub fn block_mut(&mut self, row: usize, column: usize) -> &mut [f64] {
        let size = self.dimension * self.dimension;
        let row = &mut self.rows[row];
        #[expect(clippy::cast_possible_truncation, reason = "nodes are counted in 32 bits")]
        let column = column as u32;
        let place = match row.columns.binary_search(&column) {
            Ok(place) => place,
            Err(place) => {
                row.columns.insert(place, column);
                let start = place * size;
                row.blocks.splice(start..start, std::iter::repeat_n(0.0, size));
                place
            }
        };
        &mut row.blocks[place * size..(place + 1) * size]
    }

    /// Columns and blocks of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, &[f64])> {
        let Row { columns, blocks } = &self.rows[row];
        columns.iter().map(|&c| c as usize).zip(blocks.chunks(self.dimension * self.dimension))
    }

    /// Makes the matrix symmetric to the bit, and regular: components without a point get a one, and functions that
    /// are dependent on the points a tiny shift, which acts on nothing that P can see.
    pub(super) fn finish(&mut self, shift: f64) {
        let d = self.dimension;
        for row in 0..self.rows.len() {
            let columns = self.rows[row].columns.clone();
            for column in columns.into_iter().map(|c| c as usize).filter(|&c| c > row) {
                let upper = self.block_mut(row, column).to_vec();
                let lower = self.block_mut(column, row);
                let mut mean = upper.clone();
                for i in 0..d {
                    for j in 0..d {
                        mean[i * d + j] = 0.5 * (upper[i * d + j] + lower[j * d + i]);
                        lower[j * d + i] = mean[i * d + j];
                    }
                }
                self.block_mut(row, column).copy_from_slice(&mean);
            }
            let own = self.block_mut(row, row);
            for i in 0..d {
                for j in 0..i {
                    let mean = 0.5 * (own[i * d + j] + own[j * d + i]);
                    (own[i * d + j], own[j * d + i]) = (mean, mean);
                }
                own[i * d + i] = if own[i * d + i] > 0.0 { own[i * d + i] * (1.0 + shift) } else { 1.0 };
            }
        }
        // The rows have grown by doubling.
        for row in &mut self.rows {
            row.columns.shrink_to_fit();
            row.blocks.shrink_to_fit();
        }
    }

    /// `out = A v`.
    pub(super) fn apply(&self, v: &[f64], out: &mut [f64]) {
        match self.dimension {
            1 => self.product::<1>(v, out),
            2 => self.product::<2>(v, out),
            _ => self.product::<3>(v, out),
        }
    }

    fn product<const D: usize>(&self, v: &[f64], out: &mut [f64]) {
        out.par_chunks_mut(ROWS * D).enumerate().for_each(|(chunk, out)| {
            for (row, out) in self.rows[chunk * ROWS..].iter().zip(out.chunks_mut(D)) {
                let mut sum = [0.0; D];
                for (column, block) in row.columns.iter().zip(row.blocks.chunks_exact(D * D)) {
                    let v = &v[*column as usize * D..*column as usize * D + D];
                    for (sum, block) in sum.iter_mut().zip(block.chunks_exact(D)) {
                        *sum += block.iter().zip(v).map(|(a, v)| a * v).sum::<f64>();
                    }
                }
                out.copy_from_slice(&sum);
            }
        });
    }

    /// The diagonal blocks, by rows.
    pub(super) fn diagonal_blocks(&self) -> Vec<f64> {
        let size = self.dimension * self.dimension;
        let mut out = Vec::with_capacity(self.rows.len() * size);
        for row in 0..self.rows.len() {
            match self.row(row).find(|(column, _)| *column == row) {
                Some((_, block)) => out.extend_from_slice(block),
                None => out.extend(std::iter::repeat_n(0.0, size)),
            }
        }
        out
    }

    /// `Pᵀ A P` on the next coarser lattice.
    pub(super) fn coarsened(&self, coarsening: &Coarsening) -> Self {
        let mut out = Self::zeros(self.dimension, coarsening.nodes);
        for row in 0..self.rows.len() {
            for (column, block) in self.row(row) {
                for &(i, own) in coarsening.of(row) {
                    for &(j, other) in coarsening.of(column) {
                        let weight = own * other;
                        let target = out.block_mut(i as usize, j as usize);
                        target.iter_mut().zip(block).for_each(|(t, b)| *t += weight * b);
                    }
                }
            }
        }
        out
    }
}
