//! Grids whose coordinates are those of the file: for the tests here, and those of `tests/voxelize`,
//! which include this file and see the library from outside. What it names is in the module above.

use super::{BitGrid, Fill, Mesh, Mode, Params, Silent, Size, Stats, Volume, voxelize};

/// The parameters that make voxels of edge 1 from the origin on, so that file coordinates are grid
/// coordinates.
pub fn unit(dims: [usize; 3], mode: Mode, fill: Fill) -> Params {
    let [x, y, z] = dims.map(|d| d as f64);
    Params {
        size: Size::VoxelSize(1.0),
        bounds: Some([0.0, 0.0, 0.0, x, y, z]),
        mode,
        fill,
        ..Params::DEFAULT
    }
}

pub fn run(mesh: &Mesh, params: &Params) -> (BitGrid, Stats) {
    let (volume, stats) = voxelize(mesh, params, &Silent).expect("a grid");
    (bits(&volume), stats)
}

pub fn bits(volume: &Volume) -> BitGrid {
    let mut grid = BitGrid::new(volume.frame.dims);
    volume.read_bit_slices(0, &mut grid);
    grid
}

/// The coordinates of all voxels of a grid.
pub fn voxels(dims: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [nx, ny, nz] = dims;
    (0..nx * ny * nz).map(move |i| [i % nx, i / nx % ny, i / nx / ny])
}

pub fn set_voxels(grid: &BitGrid) -> Vec<[usize; 3]> {
    voxels(grid.dims())
        .filter(|[x, y, z]| grid.get(*x, *y, *z))
        .collect()
}
