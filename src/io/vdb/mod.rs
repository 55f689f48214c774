//! OpenVDB, one grid of bool named `voxels`; written, not read.
//!
//! The tree is OpenVDB's usual one (`Tree_bool_5_4_3`): a root of cubes of 4096 voxels, each of
//! 32^3 cubes of 128, each of 16^3 cubes of 8, the leaves. Voxels that are set are active and
//! true; the background is false. Cubes of 8, 128 or 4096 that are all set become tiles. Index
//! (0, 0, 0) is the centre of voxel (0, 0, 0), as in scantle. Within a node z runs fastest, then y,
//! then x. Source: K. Museth, "VDB: High-resolution sparse volumes with dynamic topology", ACM
//! TOG 32(3), 2013; the file format (version 224) as OpenVDB 10 reads it.

mod tree;

use crate::numeric::vector::scale;
use crate::volume::{Frame, Volume};
use std::io::{self, Write};
use tree::{Extent, Tree, count, mask_of};

/// First bytes.
pub const MAGIC: &[u8] = b" BDV\0\0\0\0";

/// Version of the file format, and of the library that wrote it first.
const FORMAT: u32 = 224;
const LIBRARY: [u32; 2] = [10, 0];

/// Only active values of a node are stored (`COMPRESS_ACTIVE_MASK`); the others are background.
const ACTIVE_MASK: u32 = 2;

/// Writes the bits of a volume (numbers other than 0 count as set).
///
/// Memory: about 100 bytes for each leaf of 8^3 voxels in which some but not all are set, and for a
/// dense volume for each that is set whole. Dense and sparse volumes of equal bits give the same
/// bytes.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    let tree = Tree::of(volume);
    let mut head = Vec::new();
    head.extend(MAGIC);
    put(
        &mut head,
        &[FORMAT, LIBRARY[0], LIBRARY[1]].map(u32::to_le_bytes),
    );
    head.push(1); // the offsets of the grid follow
    head.extend(b"00000000-0000-0000-0000-000000000000"); // a UUID, the same in every run
    head.extend(0u32.to_le_bytes()); // no metadata of the file
    head.extend(1u32.to_le_bytes()); // one grid
    text(&mut head, "voxels");
    text(&mut head, "Tree_bool_5_4_3");
    text(&mut head, ""); // not an instance of another grid
    let mut start = Vec::new();
    start.extend(ACTIVE_MASK.to_le_bytes());
    metadata(&mut start, &tree.extent());
    transform(&mut start, &volume.frame);
    let mut topology = Counter(0);
    write_topology(&tree, &mut topology)?;
    let grid_at = head.len() as u64 + 24;
    let blocks_at = grid_at + start.len() as u64 + topology.0;
    let end = blocks_at + tree.leaf_count() * LEAF_BYTES;
    put(&mut head, &[grid_at, blocks_at, end].map(u64::to_le_bytes));
    out.write_all(&head)?;
    out.write_all(&start)?;
    write_topology(&tree, out)?;
    write_leaves(&tree, out)
}

/// Counts what would be written.
struct Counter(u64);

impl Write for Counter {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.0 += buffer.len() as u64;
        Ok(buffer.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Bytes of a leaf among the blocks: its mask, its corner and its values.
const LEAF_BYTES: u64 = 64 + 12 + 64;

fn put<const N: usize>(to: &mut Vec<u8>, values: &[[u8; N]]) {
    to.extend(values.as_flattened());
}

fn text(to: &mut Vec<u8>, value: &str) {
    to.extend((value.len() as u32).to_le_bytes());
    to.extend(value.as_bytes());
}

fn metadata(to: &mut Vec<u8>, extent: &Extent) {
    let mut entries: Vec<(&str, &str, Vec<u8>)> = vec![
        ("class", "string", b"unknown".to_vec()),
        ("creator", "string", b"scantle".to_vec()),
        ("name", "string", b"voxels".to_vec()),
        ("is_saved_as_half_float", "bool", vec![0]),
        (
            "file_voxel_count",
            "int64",
            extent.count.to_le_bytes().to_vec(),
        ),
    ];
    if extent.count > 0 {
        for (name, corner) in [("file_bbox_min", extent.min), ("file_bbox_max", extent.max)] {
            entries.push((name, "vec3i", corner_bytes(corner).to_vec()));
        }
    }
    to.extend((entries.len() as u32).to_le_bytes());
    for (name, kind, value) in entries {
        text(to, name);
        text(to, kind);
        to.extend((value.len() as u32).to_le_bytes());
        to.extend(value);
    }
}

/// The map from indices to space: the plainest of OpenVDB's kinds that holds the frame.
fn transform(to: &mut Vec<u8>, frame: &Frame) {
    let spacing = frame.spacing();
    let numbers = |to: &mut Vec<u8>, values: &[f64]| {
        for value in values {
            to.extend(value.to_le_bytes());
        }
    };
    if !frame.is_straight() {
        // Points are rows in OpenVDB, so the axes are rows and the origin is the last one.
        text(to, "AffineMap");
        for axis in frame.axes {
            numbers(to, &[axis[0], axis[1], axis[2], 0.0]);
        }
        let [x, y, z] = frame.origin;
        numbers(to, &[x, y, z, 1.0]);
        return;
    }
    let uniform = spacing[0] == spacing[1] && spacing[1] == spacing[2];
    text(
        to,
        if uniform {
            "UniformScaleTranslateMap"
        } else {
            "ScaleTranslateMap"
        },
    );
    let inverse = spacing.map(|s| 1.0 / s);
    numbers(to, &frame.origin);
    numbers(to, &spacing); // scale
    numbers(to, &spacing); // size of a voxel
    numbers(to, &inverse);
    numbers(to, &inverse.map(|i| i * i));
    numbers(to, &scale(inverse, 0.5));
}

/// Masks and tiles of all nodes, depth first.
fn write_topology(tree: &Tree, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(&1u32.to_le_bytes())?; // one buffer per leaf
    out.write_all(&[0])?; // background
    out.write_all(&(tree.tiles.len() as u32).to_le_bytes())?;
    out.write_all(&(tree.nodes.len() as u32).to_le_bytes())?;
    for corner in &tree.tiles {
        out.write_all(&corner_bytes(*corner))?;
        out.write_all(&[1, 1])?; // true and active
    }
    for (corner, upper) in &tree.nodes {
        out.write_all(&corner_bytes(*corner))?;
        write_node(&mask_of::<512, _>(&upper.nodes), &upper.tiles, out)?;
        for lower in upper.nodes.values() {
            write_node(&mask_of::<64, _>(&lower.leaves), &lower.tiles, out)?;
            for leaf in lower.leaves.values() {
                out.write_all(&words(leaf))?;
            }
        }
    }
    Ok(())
}

/// An inner node: which slots hold children, which hold active tiles, and the values of the latter.
fn write_node(children: &[u64], tiles: &[u64], out: &mut dyn Write) -> io::Result<()> {
    out.write_all(&words(children))?;
    out.write_all(&words(tiles))?;
    out.write_all(&[0])?; // what is not active is background
    out.write_all(&vec![1; count(tiles) as usize])
}

/// Masks, corners and values of all leaves, in the order of the topology.
fn write_leaves(tree: &Tree, out: &mut dyn Write) -> io::Result<()> {
    tree.for_each_leaf(|corner, leaf| {
        let mask = words(leaf);
        out.write_all(&mask)?;
        out.write_all(&corner_bytes(corner))?;
        out.write_all(&mask)
    })
}

fn words(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}

/// Indices are 32 bits wide in OpenVDB; a grid of bits so long along an axis does not fit memory.
fn corner_bytes(corner: [usize; 3]) -> [u8; 12] {
    let mut bytes = [0; 12];
    for (to, c) in bytes.chunks_exact_mut(4).zip(corner) {
        to.copy_from_slice(&(c as i32).to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Data;
    use crate::volume::bits::BitGrid;

    #[test]
    fn offsets_point_at_the_grid_its_leaves_and_the_end() {
        let mut grid = BitGrid::new([20, 9, 8]);
        grid.set_run(0, 8, 3, 3);
        grid.set(19, 8, 7);
        let volume = Volume {
            frame: Frame::straight([20, 9, 8], [1.0, 2.0, 3.0], [0.5; 3]),
            data: Data::Bits(grid),
        };
        let mut bytes = Vec::new();
        write(&volume, &mut bytes).unwrap();
        assert!(bytes.starts_with(MAGIC));
        let name = b"\x0f\0\0\0Tree_bool_5_4_3\0\0\0\0";
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
        let offset = |i: usize| {
            let place = at + 8 * i;
            u64::from_le_bytes(bytes[place..place + 8].try_into().unwrap()) as usize
        };
        assert_eq!(offset(0), at + 24);
        assert_eq!(offset(2), bytes.len());
        assert_eq!(bytes.len() - offset(1), 2 * LEAF_BYTES as usize);
        // The first leaf has one voxel in each x: bit 8 y + z of its word.
        let first = &bytes[offset(1)..][..8];
        assert_eq!(first, (1u64 << 27).to_le_bytes());
        assert_eq!(
            &bytes[offset(1) + LEAF_BYTES as usize + 64..][..12],
            [16, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0]
        );
    }
}
