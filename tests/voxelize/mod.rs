//! What the voxelizer makes, judged with the measures and files of the layers above it.

mod counts;
mod extremes;
#[path = "../../src/volume/voxelize/tests/unit.rs"]
mod unit;

use scantle::error::Error;
use scantle::mesh::Mesh;
use scantle::progress::Silent;
use scantle::volume::Volume;
use scantle::volume::bits::BitGrid;
use scantle::volume::voxelize::{Fill, Mode, Params, Size, Stats, Storage, voxelize};
use unit::{run, set_voxels, unit, voxels};

fn warned(stats: &Stats, code: &str) -> Option<u64> {
    stats
        .warnings
        .iter()
        .find(|w| w.code == code)
        .map(|w| w.count)
}
