//! What measuring voxels against their model takes of the memory that there is.

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::spatial::aabb::Aabb;
use crate::volume::bits::BitGrid;
use crate::volume::voxelize::{Fill, Lattice, Mode, Params};
use crate::volume::{Data, Volume};

/// What the reference takes of the memory that there is.
pub struct Room {
    needed: u128,
    limit: u64,
}

impl Room {
    /// Bytes for each item of a tree while it is built, and for a box.
    const PER_RUN: u128 = 56 + size_of::<Aabb>() as u128;
    /// Bytes for each element: indices of the copy and of the tree, corners, the tree's own.
    const PER_ELEMENT: u128 = 2 * 12 + 72 + 56;
    /// Bytes for each vertex: its place in the copy, and that in the tree with its index.
    const PER_VERTEX: u128 = 24 + 32;

    /// The grids, where their size is known beforehand, and the mesh.
    pub fn new(mesh: &Mesh, made: &Volume, params: &Params, lattice: &Lattice) -> Result<Room> {
        let surface = params.mode != Mode::None && params.fill != Fill::None;
        let inside = !mesh.triangles.is_empty();
        let grids = 3 + u128::from(surface) + u128::from(inside);
        let grid = match made.data {
            Data::Sparse(_) => 0,
            _ => BitGrid::bytes_for(lattice.dims),
        };
        let elements = mesh.triangles.len() + mesh.segments.len() + mesh.points.len();
        let room = Room {
            needed: grids * grid
                + elements as u128 * Room::PER_ELEMENT
                + mesh.positions.len() as u128 * Room::PER_VERTEX,
            limit: params.max_memory,
        };
        room.expect(0)?;
        Ok(room)
    }

    /// Errs when a tree over so many runs of voxels more is too much.
    pub fn expect(&self, runs: usize) -> Result<()> {
        let needed = self.needed + runs as u128 * Room::PER_RUN;
        if needed <= u128::from(self.limit) {
            return Ok(());
        }
        let hint = Some("raise --max-memory, or leave --verify out");
        Err(Error::over_memory("verifying", needed, self.limit, hint))
    }
}
