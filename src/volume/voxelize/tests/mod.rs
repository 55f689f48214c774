//! Tests of the voxelizer as a library.

mod exact;
mod lazy;
mod properties;
mod unit;
mod winding;

use super::*;
use crate::progress::Silent;
use unit::{run, set_voxels, unit, voxels};

/// Whether every voxel of `a` is one of `b`.
fn is_subset(a: &BitGrid, b: &BitGrid) -> bool {
    a.dims() == b.dims() && a.words().iter().zip(b.words()).all(|(a, b)| a & !b == 0)
}

fn warned(stats: &Stats, code: &str) -> Option<u64> {
    stats
        .warnings
        .iter()
        .find(|w| w.code == code)
        .map(|w| w.count)
}
