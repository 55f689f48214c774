//! The levels of the pyramid over the voxels, counted and not kept.

use super::LevelStats;
use crate::volume::Volume;
use crate::volume::bits::BitGrid;
use crate::volume::octree::Census;
use rayon::prelude::*;

/// The levels of the octree.
pub fn octree_levels(census: &Census, dims: [usize; 3]) -> Vec<LevelStats> {
    let level = |(level, nodes): (usize, &u64)| LevelStats {
        level: level as u32,
        dims: dims.map(|d| d.div_ceil(1 << level) as u64),
        nodes: *nodes,
    };
    census.nodes.iter().enumerate().map(level).collect()
}

/// The levels of the pyramid that halves x and y and keeps z (Forest et al. 2009, section 3).
///
/// A slice is halved on its own, so that one pyramid over one slice is held at a time and thread.
pub fn column_levels(volume: &Volume) -> Vec<LevelStats> {
    let [nx, ny, nz] = volume.frame.dims;
    let count = nx.max(ny).max(1).next_power_of_two().trailing_zeros() as usize + 1;
    const SLICES: usize = 16;
    let nodes = (0..nz.div_ceil(SLICES))
        .into_par_iter()
        .map(|chunk| {
            let depth = SLICES.min(nz - chunk * SLICES);
            let mut level = BitGrid::new([nx, ny, depth]);
            volume.read_bit_slices(chunk * SLICES, &mut level);
            let mut nodes = vec![0; count];
            for count in &mut nodes {
                *count = level
                    .words()
                    .iter()
                    .map(|w| u64::from(w.count_ones()))
                    .sum();
                level = halved(&level);
            }
            nodes
        })
        .reduce(
            || vec![0; count],
            |a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect(),
        );
    let level = |(level, nodes): (usize, u64)| LevelStats {
        level: level as u32,
        dims: [
            nx.div_ceil(1 << level) as u64,
            ny.div_ceil(1 << level) as u64,
            nz as u64,
        ],
        nodes,
    };
    nodes.into_iter().enumerate().map(level).collect()
}

/// Each voxel of the result is the OR of four: two along x, two along y.
fn halved(from: &BitGrid) -> BitGrid {
    let [nx, ny, nz] = from.dims();
    let mut to = BitGrid::new([nx.div_ceil(2), ny.div_ceil(2), nz]);
    for z in 0..nz {
        for y in 0..ny {
            let row = to.row_mut(y / 2, z);
            for (i, word) in from.row(y, z).iter().enumerate() {
                row[i / 2] |= halved_word(*word) << (i % 2 * 32);
            }
        }
    }
    to
}

/// Bit `i` of the result is bit `2 i` or bit `2 i + 1`.
fn halved_word(word: u64) -> u64 {
    let mut w = (word | word >> 1) & 0x5555_5555_5555_5555;
    for (shift, mask) in [
        (1, 0x3333_3333_3333_3333),
        (2, 0x0f0f_0f0f_0f0f_0f0f),
        (4, 0x00ff_00ff_00ff_00ff),
        (8, 0x0000_ffff_0000_ffff),
        (16, 0x0000_0000_ffff_ffff),
    ] {
        w = (w | w >> shift) & mask;
    }
    w
}
