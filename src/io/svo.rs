//! scantle's sparse voxel octree.
//!
//! Little endian throughout:
//!
//! | bytes | what |
//! |---|---|
//! | 12 | `SCANTLE-SVO\n` |
//! | 4 | version, 1 |
//! | 4 | flags: bit 0, cubes of edge 4 or more that are all set are one bit of their parent |
//! | 4 | `R`: the root is a cube of edge `2^R` voxels, at least 64 |
//! | 24 | voxels along x, y, z (three u64) |
//! | 24 | centre of voxel (0, 0, 0) (three f64) |
//! | 24 | spacing (three f64) |
//! | 8 (R + 1) | number of nodes of edge `2^R`, ..., 2, then of set voxels below nodes of edge 2 |
//! | rest | the nodes, edge by edge from the root down, each edge in Morton order |
//!
//! A node is one byte, whose bit `x + 2 y + 4 z` says that this child holds something. With flag
//! bit 0, nodes of edge 4 and more are two bytes: the second says which children are all set, and
//! those have no node of their own. The children of a node of edge 2 are voxels.

use crate::error::Fault;
use crate::io::source::Source;
use crate::report::Warning;
use crate::volume::octree::Octree;
use crate::volume::{Data, Frame, Volume};
use std::borrow::Cow;
use std::io::{self, Write};

/// First bytes.
pub const MAGIC: &[u8] = b"SCANTLE-SVO\n";
const VERSION: u32 = 1;
/// Bytes before the counts.
const HEADER: usize = 12 + 3 * 4 + 9 * 8;

/// Reads an octree. Errs where counts, masks and size do not fit each other.
pub fn read(source: &Source, _warnings: &mut Vec<Warning>) -> Result<Volume, Fault> {
    let bytes = source.bytes();
    let header = bytes.get(..HEADER).ok_or_else(|| {
        Fault::byte(
            bytes.len(),
            format!("the header of {HEADER} bytes is cut short"),
        )
    })?;
    let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| header[at + i]));
    let half = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| header[at + i]));
    if !header.starts_with(MAGIC) {
        return Err(Fault::byte(0, "does not begin with \"SCANTLE-SVO\""));
    }
    let (version, flags, root) = (half(12), half(16), half(20) as usize);
    if version != VERSION {
        return Err(Fault::byte(
            12,
            format!("version {version} is not known, only {VERSION}"),
        ));
    }
    if flags > 1 {
        return Err(Fault::byte(
            16,
            format!("flags {flags:#x} are not known, only 0x1"),
        ));
    }
    let dims64: [u64; 3] = std::array::from_fn(|a| word(24 + 8 * a));
    let [x, y, z] = dims64;
    let wanted = Octree::root_log(dims64.map(|d| usize::try_from(d).unwrap_or(usize::MAX)))
        .ok_or_else(|| {
            let problem = format!("a grid of {x} x {y} x {z} voxels is out of range");
            Fault::byte(24, problem)
        })?;
    if root != wanted {
        return Err(Fault::byte(
            20,
            format!("the root has edge 2^{root}, but {x} x {y} x {z} voxels need 2^{wanted}"),
        ));
    }
    let number = |at: usize| f64::from_bits(word(at));
    let origin = std::array::from_fn(|a| number(48 + 8 * a));
    let spacing = std::array::from_fn(|a| number(72 + 8 * a));
    let solid = flags & 1 == 1;
    let levels = levels(bytes, root, solid)?;
    let dims = dims64.map(|d| d as usize);
    let tree = Octree::from_masks(dims, levels)?;
    Ok(Volume {
        frame: Frame::straight(dims, origin, spacing),
        data: Data::Sparse(tree),
    })
}

/// The masks of each edge, from the root down.
fn levels(bytes: &[u8], root: usize, solid: bool) -> Result<Vec<Vec<(u8, u8)>>, Fault> {
    let start = HEADER + 8 * (root + 1);
    let counts = bytes
        .get(HEADER..start)
        .ok_or_else(|| Fault::byte(bytes.len(), "the node counts are cut short"))?;
    let counts: Vec<u64> = counts
        .chunks_exact(8)
        .map(|c| u64::from_le_bytes(std::array::from_fn(|i| c[i])))
        .collect();
    let width = |level: usize| if solid && level + 1 < root { 2 } else { 1 };
    let needed: u128 = (0..root)
        .map(|l| u128::from(counts[l]) * width(l) as u128)
        .sum();
    let found = bytes.len() - start;
    if needed != found as u128 {
        return Err(Fault::byte(
            start,
            format!("the counts ask for {needed} bytes of nodes, but {found} are left"),
        ));
    }
    let mut at = start;
    let mut levels = Vec::with_capacity(root);
    for (level, count) in counts[..root].iter().enumerate() {
        let length = *count as usize * width(level);
        let masks = &bytes[at..at + length];
        levels.push(match width(level) {
            2 => masks.chunks_exact(2).map(|m| (m[0], m[1])).collect(),
            _ => masks.iter().map(|m| (*m, 0)).collect::<Vec<_>>(),
        });
        at += length;
    }
    let voxels: u64 = levels
        .last()
        .map_or(0, |l| l.iter().map(|m| u64::from(m.0.count_ones())).sum());
    if voxels != counts[root] {
        return Err(Fault::byte(
            start,
            format!(
                "{voxels} voxels below the last nodes, but the header says {}",
                counts[root]
            ),
        ));
    }
    Ok(levels)
}

/// Writes the bits of a volume as an octree; a dense grid is brought into that form first.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    let tree = match &volume.data {
        Data::Sparse(tree) => Cow::Borrowed(tree),
        Data::Bits(grid) => Cow::Owned(Octree::from_bits(grid)),
        _ => return Err(io::Error::other("an octree holds bits only")),
    };
    let dims = volume.frame.dims;
    let solid = tree.census().solid;
    let levels = tree.masks(solid);
    let root = levels.len();
    out.write_all(MAGIC)?;
    for half in [VERSION, u32::from(solid), root as u32] {
        out.write_all(&half.to_le_bytes())?;
    }
    for d in dims {
        out.write_all(&(d as u64).to_le_bytes())?;
    }
    for number in volume.frame.origin.iter().chain(&volume.frame.spacing()) {
        out.write_all(&number.to_le_bytes())?;
    }
    for level in &levels {
        out.write_all(&(level.len() as u64).to_le_bytes())?;
    }
    let voxels: u64 = levels
        .last()
        .map_or(0, |l| l.iter().map(|m| u64::from(m.0.count_ones())).sum());
    out.write_all(&voxels.to_le_bytes())?;
    for (index, level) in levels.iter().enumerate() {
        if solid && index + 1 < root {
            level
                .iter()
                .try_for_each(|(any, all)| out.write_all(&[*any, *all]))?;
        } else {
            level
                .iter()
                .try_for_each(|(any, _)| out.write_all(&[*any]))?;
        }
    }
    Ok(())
}
