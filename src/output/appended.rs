//! The appended raw section of a VTK XML file: zlib-compressed blocks behind one underscore.
//!
//! Each array is `blocks, block size, size of the last block (0 if it is full), compressed size of
//! each block` as `u64`, then the blocks themselves, all little-endian.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

/// Uncompressed bytes per block. Larger blocks compress hardly better and cannot be done in parallel.
const BLOCK: usize = 1 << 20;

/// zlib level: beyond it time grows quickly and size hardly falls.
const LEVEL: u32 = 4;

/// Collects arrays and tells the offset that the header of the file must quote for each.
#[derive(Debug, Default)]
pub(super) struct Appended {
    bytes: Vec<u8>,
}

impl Appended {
    /// Compresses an array and returns its offset from the first byte behind the underscore.
    /// The bytes do not depend on the number of threads: the blocks are fixed.
    pub(super) fn push(&mut self, array: &[u8]) -> io::Result<usize> {
        let offset = self.bytes.len();
        let blocks = array.par_chunks(BLOCK).map(compress).collect::<io::Result<Vec<_>>>()?;
        let mut word = |value: usize| self.bytes.extend_from_slice(&(value as u64).to_le_bytes());
        word(blocks.len());
        word(BLOCK);
        word(array.len() % BLOCK);
        blocks.iter().for_each(|block| word(block.len()));
        blocks.iter().for_each(|block| self.bytes.extend_from_slice(block));
        Ok(offset)
    }

    /// All arrays, in the order of their offsets.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// One block in zlib format.
fn compress(block: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(block.len() / 2), Compression::new(LEVEL));
    encoder.write_all(block)?;
    encoder.finish()
}
