//! Tests of the voxelizer as a library.

mod exact;
mod lazy;
mod properties;
mod winding;

use super::*;
use crate::progress::Silent;

/// The parameters that make voxels of edge 1 from the origin on, so that file coordinates are grid
/// coordinates.
fn unit(dims: [usize; 3], mode: Mode, fill: Fill) -> Params {
    let [x, y, z] = dims.map(|d| d as f64);
    Params {
        size: Size::VoxelSize(1.0),
        bounds: Some([0.0, 0.0, 0.0, x, y, z]),
        mode,
        fill,
        ..Params::DEFAULT
    }
}

fn run(mesh: &Mesh, params: &Params) -> (BitGrid, Stats) {
    let (volume, stats) = voxelize(mesh, params, &Silent).expect("a grid");
    (bits(&volume), stats)
}

fn bits(volume: &Volume) -> BitGrid {
    let mut grid = BitGrid::new(volume.frame.dims);
    volume.read_bit_slices(0, &mut grid);
    grid
}

/// The coordinates of all voxels of a grid.
fn voxels(dims: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [nx, ny, nz] = dims;
    (0..nx * ny * nz).map(move |i| [i % nx, i / nx % ny, i / nx / ny])
}

fn set_voxels(grid: &BitGrid) -> Vec<[usize; 3]> {
    voxels(grid.dims())
        .filter(|[x, y, z]| grid.get(*x, *y, *z))
        .collect()
}

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
