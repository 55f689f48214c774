//! The dense grid of bits.

use rayon::prelude::*;
use std::sync::atomic::AtomicU64;

/// A grid of bits: each row along x fills whole 64-bit words, bit `x % 64` of word `x / 64`; rows
/// follow each other along y, then z. Bits past the end of a row are 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BitGrid {
    dims: [usize; 3],
    stride: usize,
    words: Vec<u64>,
}

impl BitGrid {
    /// A grid of zeros. The memory is touched only where it is later written.
    pub fn new(dims: [usize; 3]) -> Self {
        let stride = dims[0].div_ceil(64);
        BitGrid {
            dims,
            stride,
            words: vec![0; stride * dims[1] * dims[2]],
        }
    }

    /// Bytes that a grid of these dims takes, without making it.
    pub fn bytes_for(dims: [usize; 3]) -> u128 {
        dims[0].div_ceil(64) as u128 * 8 * dims[1] as u128 * dims[2] as u128
    }

    /// Voxels along x, y, z.
    #[inline]
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Words in a row.
    #[inline]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// All words, rows in order.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// All words, for writing; bits past the end of a row must stay 0.
    pub fn words_mut(&mut self) -> &mut [u64] {
        &mut self.words
    }

    /// The words as cells that many threads may set bits in.
    pub fn atomic_words(&mut self) -> &[AtomicU64] {
        bytemuck_atomic(&mut self.words)
    }

    /// The words of one row.
    #[inline]
    pub fn row(&self, y: usize, z: usize) -> &[u64] {
        let at = (z * self.dims[1] + y) * self.stride;
        &self.words[at..at + self.stride]
    }

    /// The words of one row, for writing.
    #[inline]
    pub fn row_mut(&mut self, y: usize, z: usize) -> &mut [u64] {
        let at = (z * self.dims[1] + y) * self.stride;
        &mut self.words[at..at + self.stride]
    }

    /// The bit of a voxel.
    #[inline]
    pub fn get(&self, x: usize, y: usize, z: usize) -> bool {
        self.row(y, z)[x / 64] >> (x % 64) & 1 == 1
    }

    /// Sets the bit of a voxel.
    #[inline]
    pub fn set(&mut self, x: usize, y: usize, z: usize) {
        self.row_mut(y, z)[x / 64] |= 1 << (x % 64);
    }

    /// Sets voxels `x0..x1` of a row.
    pub fn set_run(&mut self, x0: usize, x1: usize, y: usize, z: usize) {
        set_run(self.row_mut(y, z), x0, x1);
    }

    /// Makes every bit 0.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Number of bits that are set.
    pub fn count(&self) -> u64 {
        self.words
            .par_chunks(1 << 14)
            .map(|c| c.iter().map(|w| u64::from(w.count_ones())).sum::<u64>())
            .sum()
    }

    /// Becomes the slices of `from` from `z0` on; x and y dims are the same.
    pub fn copy_slices(&mut self, from: &BitGrid, z0: usize) {
        let slice = self.stride * self.dims[1];
        let length = self.words.len();
        self.words
            .copy_from_slice(&from.words[z0 * slice..z0 * slice + length]);
    }
}

/// Sets bits `x0..x1` of a row of words.
#[inline]
pub fn set_run(row: &mut [u64], x0: usize, x1: usize) {
    if x0 >= x1 {
        return;
    }
    let (first, last) = (x0 / 64, (x1 - 1) / 64);
    let low = u64::MAX << (x0 % 64);
    let high = u64::MAX >> (63 - (x1 - 1) % 64);
    if first == last {
        row[first] |= low & high;
    } else {
        row[first] |= low;
        row[first + 1..last].fill(u64::MAX);
        row[last] |= high;
    }
}

#[allow(unsafe_code)]
fn bytemuck_atomic(words: &mut [u64]) -> &[AtomicU64] {
    // AtomicU64 has the size and, on the targets with 64-bit atomics of full alignment that the
    // assertion admits, the alignment of u64; the exclusive borrow keeps all other access away.
    const { assert!(align_of::<AtomicU64>() == align_of::<u64>() && size_of::<AtomicU64>() == 8) };
    unsafe { &*(std::ptr::from_mut(words) as *const [AtomicU64]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_set_what_they_say() {
        for (x0, x1) in [
            (0, 0),
            (0, 1),
            (3, 64),
            (63, 65),
            (64, 128),
            (5, 200),
            (0, 200),
        ] {
            let mut grid = BitGrid::new([200, 2, 2]);
            grid.set_run(x0, x1, 1, 1);
            for x in 0..200 {
                assert_eq!(grid.get(x, 1, 1), (x0..x1).contains(&x));
            }
            assert_eq!(grid.count(), (x1 - x0) as u64);
        }
    }

    #[test]
    fn a_clear_grid_has_the_stated_size() {
        assert_eq!(BitGrid::bytes_for([512; 3]), 16_777_216);
        assert_eq!(BitGrid::bytes_for([128; 3]), 262_144);
        assert_eq!(BitGrid::new([65, 2, 3]).words().len(), 12);
    }
}
