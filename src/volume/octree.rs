//! The sparse grid of bits.

use super::bits::BitGrid;

/// A cube of the grid that holds something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    /// All voxels of the cube with this lower corner and edge (4 or more, in voxels) are set.
    Full {
        /// Lower corner.
        min: [usize; 3],
        /// Edge in voxels, a power of two.
        edge: usize,
    },
    /// Some voxels of a cube of edge 4 are set: bit `x + 4 y + 16 z` for the voxel at `min + (x, y, z)`.
    Brick {
        /// Lower corner.
        min: [usize; 3],
        /// One bit per voxel.
        bits: u64,
    },
}

/// Bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Octree {
    dims: [usize; 3],
}

impl Octree {
    /// Voxels along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The octree of a dense grid.
    pub fn from_bits(_grid: &BitGrid) -> Self {
        todo!()
    }

    /// Number of voxels set.
    pub fn count(&self) -> u64 {
        todo!()
    }

    /// The bit of a voxel.
    pub fn get(&self, _x: usize, _y: usize, _z: usize) -> bool {
        todo!()
    }

    /// Calls `f` for every cell, in Morton order.
    pub fn visit(&self, _f: &mut dyn FnMut(Cell)) {
        todo!()
    }

    /// Copies the slices from `z0` on into `out`.
    pub fn read_slices(&self, _z0: usize, _out: &mut BitGrid) {
        todo!()
    }
}
