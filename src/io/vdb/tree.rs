//! The bits of a volume in the shape of OpenVDB's tree.

use crate::io::samples;
use crate::volume::bits::BitGrid;
use crate::volume::octree::Cell;
use crate::volume::{Data, Volume};
use std::collections::{BTreeMap, BTreeSet};

/// Edges of a leaf, a lower and an upper node, in voxels.
const LEAF: usize = 8;
const LOWER: usize = 128;
const UPPER: usize = 4096;

/// The values of a leaf: bit `64 x + 8 y + z`, so one word for each x.
pub type Leaf = [u64; 8];

/// A cube of 128^3 voxels: 16^3 slots, each a leaf, a tile that is set, or nothing.
#[derive(Debug, Clone)]
pub struct Lower {
    /// Slots that are set whole.
    pub tiles: [u64; 64],
    /// Leaves by slot.
    pub leaves: BTreeMap<u16, Leaf>,
}

/// A cube of 4096^3 voxels: 32^3 slots, each a lower node, a tile that is set, or nothing.
#[derive(Debug, Clone)]
pub struct Upper {
    /// Slots that are set whole.
    pub tiles: [u64; 512],
    /// Lower nodes by slot.
    pub nodes: BTreeMap<u16, Box<Lower>>,
}

/// The whole tree. Nodes are sorted as OpenVDB visits them: by x, then y, then z.
#[derive(Debug, Clone, Default)]
pub struct Tree {
    /// Upper nodes by corner, in voxels.
    pub nodes: BTreeMap<[usize; 3], Box<Upper>>,
    /// Corners of cubes of 4096^3 that are set whole.
    pub tiles: BTreeSet<[usize; 3]>,
}

/// The slot of a point in a node of edge `1 << log` slots of edge `slot` voxels.
fn slot(p: [usize; 3], slot: usize, log: u32) -> usize {
    let [x, y, z] = p.map(|c| c / slot % (1 << log));
    x << (2 * log) | y << log | z
}

/// The inverse of [`slot`]: lower corner of a slot, in voxels, from the corner of its node.
fn corner(slot: u16, edge: usize, log: u32) -> [usize; 3] {
    let (slot, mask) = (usize::from(slot), (1 << log) - 1);
    [slot >> (2 * log), slot >> log & mask, slot & mask].map(|c| c * edge)
}

fn plus(a: [usize; 3], b: [usize; 3]) -> [usize; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn mark(mask: &mut [u64], slot: usize) {
    mask[slot / 64] |= 1 << (slot % 64);
}

/// Number of bits set in a mask.
pub fn count(mask: &[u64]) -> u64 {
    mask.iter().map(|w| u64::from(w.count_ones())).sum()
}

/// The mask of the slots that hold a child.
pub fn mask_of<const WORDS: usize, T>(children: &BTreeMap<u16, T>) -> [u64; WORDS] {
    let mut mask = [0; WORDS];
    for slot in children.keys() {
        mark(&mut mask, usize::from(*slot));
    }
    mask
}

impl Tree {
    /// Sorts the bits of a volume into the tree.
    pub fn of(volume: &Volume) -> Tree {
        let mut tree = Tree::default();
        match &volume.data {
            Data::Sparse(octree) => octree.visit(&mut |cell| match cell {
                Cell::Full { min, edge } => tree.add_cube(min, edge),
                Cell::Brick { min, bits } => tree.add_brick(min, bits),
            }),
            _ => {
                let Ok(()): Result<(), std::convert::Infallible> =
                    samples::for_each_slab(volume, |z, slab| {
                        tree.add_slab(z, slab);
                        Ok(())
                    });
            }
        }
        tree.settle();
        tree
    }

    fn upper(&mut self, p: [usize; 3]) -> &mut Upper {
        let key = p.map(|c| c / UPPER * UPPER);
        self.nodes.entry(key).or_insert_with(|| {
            Box::new(Upper {
                tiles: [0; 512],
                nodes: BTreeMap::new(),
            })
        })
    }

    fn lower(&mut self, p: [usize; 3]) -> &mut Lower {
        let key = slot(p, LOWER, 5) as u16;
        self.upper(p).nodes.entry(key).or_insert_with(|| {
            Box::new(Lower {
                tiles: [0; 64],
                leaves: BTreeMap::new(),
            })
        })
    }

    fn leaf(&mut self, p: [usize; 3]) -> &mut Leaf {
        let key = slot(p, LEAF, 4) as u16;
        self.lower(p).leaves.entry(key).or_default()
    }

    /// Adds a brick of 4^3 voxels: bit `x + 4 y + 16 z`.
    fn add_brick(&mut self, min: [usize; 3], mut bits: u64) {
        let [x, y, z] = min.map(|c| c % LEAF);
        let leaf = self.leaf(min);
        while bits != 0 {
            let bit = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            leaf[x + bit % 4] |= 1 << (8 * (y + bit / 4 % 4) + z + bit / 16);
        }
    }

    /// Adds a cube that is set whole, of an edge that is a power of two and at a multiple of it.
    fn add_cube(&mut self, min: [usize; 3], edge: usize) {
        if edge < LEAF {
            self.add_brick(min, u64::MAX);
            return;
        }
        let step = [UPPER, LOWER, LEAF]
            .into_iter()
            .find(|s| *s <= edge)
            .unwrap_or(LEAF);
        for x in (min[0]..min[0] + edge).step_by(step) {
            for y in (min[1]..min[1] + edge).step_by(step) {
                for z in (min[2]..min[2] + edge).step_by(step) {
                    let p = [x, y, z];
                    match step {
                        UPPER => {
                            self.tiles.insert(p);
                        }
                        LOWER => mark(&mut self.upper(p).tiles, slot(p, LOWER, 5)),
                        _ => mark(&mut self.lower(p).tiles, slot(p, LEAF, 4)),
                    }
                }
            }
        }
    }

    /// Adds up to 8 slices, the first of which is `z0`, a multiple of 8.
    fn add_slab(&mut self, z0: usize, slab: &BitGrid) {
        let [nx, ny, depth] = slab.dims();
        for y0 in (0..ny).step_by(LEAF) {
            for (w, x0) in (0..nx).step_by(64).enumerate() {
                let mut words = [0; 64];
                for (y, z) in (y0..ny.min(y0 + LEAF)).flat_map(|y| (0..depth).map(move |z| (y, z)))
                {
                    words[8 * (y - y0) + z] = slab.row(y, z)[w];
                }
                let any = words.iter().fold(0, |a, b| a | b);
                for x in (0..64).step_by(LEAF).filter(|x| any >> x & 0xff != 0) {
                    let mut leaf = [0; 8];
                    for (i, word) in words.iter().enumerate() {
                        for (k, to) in leaf.iter_mut().enumerate() {
                            *to |= (word >> (x + k) & 1) << i;
                        }
                    }
                    *self.leaf([x0 + x, y0, z0]) = leaf;
                }
            }
        }
    }

    /// Makes tiles of all cubes that are set whole, from the leaves up.
    fn settle(&mut self) {
        for upper in self.nodes.values_mut() {
            for lower in upper.nodes.values_mut() {
                let tiles = &mut lower.tiles;
                lower.leaves.retain(|slot, leaf| {
                    let full = leaf.iter().all(|w| *w == u64::MAX);
                    if full {
                        mark(tiles, usize::from(*slot));
                    }
                    !full
                });
            }
            let tiles = &mut upper.tiles;
            upper.nodes.retain(|slot, lower| {
                let full = lower.tiles.iter().all(|w| *w == u64::MAX);
                if full {
                    mark(tiles, usize::from(*slot));
                }
                !full
            });
        }
        let tiles = &mut self.tiles;
        self.nodes.retain(|corner, upper| {
            let full = upper.tiles.iter().all(|w| *w == u64::MAX);
            if full {
                tiles.insert(*corner);
            }
            !full
        });
    }

    /// Calls `f(corner, leaf)` for every leaf, in order.
    pub fn for_each_leaf<E>(
        &self,
        mut f: impl FnMut([usize; 3], &Leaf) -> Result<(), E>,
    ) -> Result<(), E> {
        for (at, upper) in &self.nodes {
            for (s, lower) in &upper.nodes {
                let at = plus(*at, corner(*s, LOWER, 5));
                for (s, leaf) in &lower.leaves {
                    f(plus(at, corner(*s, LEAF, 4)), leaf)?;
                }
            }
        }
        Ok(())
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> u64 {
        let lowers = self.nodes.values().flat_map(|upper| upper.nodes.values());
        lowers.map(|lower| lower.leaves.len() as u64).sum()
    }

    /// Smallest and largest index that is set, and how many are.
    pub fn extent(&self) -> Extent {
        let mut extent = Extent {
            min: [usize::MAX; 3],
            max: [0; 3],
            count: 0,
        };
        let Ok(()): Result<(), std::convert::Infallible> = self.for_each_leaf(|at, leaf| {
            extent.leaf(at, leaf);
            Ok(())
        });
        for (at, upper) in &self.nodes {
            for s in slots(&upper.tiles) {
                extent.cube(plus(*at, corner(s, LOWER, 5)), LOWER);
            }
            for (s, lower) in &upper.nodes {
                let at = plus(*at, corner(*s, LOWER, 5));
                for s in slots(&lower.tiles) {
                    extent.cube(plus(at, corner(s, LEAF, 4)), LEAF);
                }
            }
        }
        for at in &self.tiles {
            extent.cube(*at, UPPER);
        }
        extent
    }
}

/// The slots set in a mask, in order.
fn slots(mask: &[u64]) -> impl Iterator<Item = u16> {
    (0..mask.len() * 64)
        .filter(|s| mask[s / 64] >> (s % 64) & 1 == 1)
        .map(|s| s as u16)
}

/// The box around all voxels that are set, and their number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extent {
    /// Smallest index; larger than `max` when nothing is set.
    pub min: [usize; 3],
    /// Largest index.
    pub max: [usize; 3],
    /// Voxels that are set.
    pub count: u64,
}

impl Extent {
    fn span(&mut self, axis: usize, min: usize, max: usize) {
        self.min[axis] = self.min[axis].min(min);
        self.max[axis] = self.max[axis].max(max);
    }

    fn cube(&mut self, at: [usize; 3], edge: usize) {
        self.count += (edge as u64).pow(3);
        for (axis, c) in at.into_iter().enumerate() {
            self.span(axis, c, c + edge - 1);
        }
    }

    fn leaf(&mut self, at: [usize; 3], leaf: &Leaf) {
        self.count += count(leaf);
        let any = leaf.iter().fold(0, |a, b| a | b);
        for (i, word) in leaf.iter().enumerate() {
            if *word != 0 {
                self.span(0, at[0] + i, at[0] + i);
            }
            if any >> (8 * i) & 0xff != 0 {
                self.span(1, at[1] + i, at[1] + i);
            }
            if any >> i & 0x0101_0101_0101_0101 != 0 {
                self.span(2, at[2] + i, at[2] + i);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Frame;
    use proptest::prelude::*;

    fn dense(dims: [usize; 3], set: impl Fn([usize; 3]) -> bool) -> Volume {
        let mut grid = BitGrid::new(dims);
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in (0..dims[0]).filter(|x| set([*x, y, z])) {
                    grid.set(x, y, z);
                }
            }
        }
        Volume {
            frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
            data: Data::Bits(grid),
        }
    }

    #[test]
    fn cubes_that_are_full_become_tiles() {
        let volume = dense([136, 130, 129], |_| true);
        let tree = Tree::of(&volume);
        let upper = &tree.nodes[&[0; 3]];
        assert_eq!(count(&upper.tiles), 1);
        assert_eq!(tree.extent().count, volume.count_set());
        assert_eq!(tree.extent().max, [135, 129, 128]);
        assert!(tree.leaf_count() > 0 && tree.tiles.is_empty());
    }

    #[test]
    fn cubes_of_every_edge_land_in_their_level() {
        let mut tree = Tree::default();
        tree.add_cube([4096, 0, 0], 4096);
        tree.add_cube([0, 256, 0], 256);
        tree.add_cube([0, 0, 16], 16);
        tree.add_cube([4, 0, 0], 4);
        tree.add_brick([0, 0, 4], 1 << 63);
        tree.settle();
        assert_eq!(tree.tiles.iter().next(), Some(&[4096, 0, 0]));
        assert_eq!(count(&tree.nodes[&[0; 3]].tiles), 8);
        assert_eq!(count(&tree.nodes[&[0; 3]].nodes[&0].tiles), 8);
        assert_eq!(tree.leaf_count(), 1);
        let extent = tree.extent();
        assert_eq!(
            extent.count,
            4096u64.pow(3) + 256u64.pow(3) + 16u64.pow(3) + 65
        );
        assert_eq!((extent.min, extent.max), ([0; 3], [8191, 4095, 4095]));
    }

    proptest! {
        #[test]
        fn every_voxel_is_where_it_was(dims in prop::array::uniform3(1usize..40), seed in any::<u64>()) {
            let set = |[x, y, z]: [usize; 3]| {
                ((x + 64 * y + 4096 * z) as u64 ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63 == 1
            };
            let volume = dense(dims, set);
            let tree = Tree::of(&volume);
            let mut found = 0;
            tree.for_each_leaf(|at, leaf| {
                for bit in (0..512).filter(|b| leaf[b / 64] >> (b % 64) & 1 == 1) {
                    let p = plus(at, [bit / 64, bit / 8 % 8, bit % 8]);
                    prop_assert!(set(p) && (0..3).all(|a| p[a] < dims[a]));
                    found += 1;
                }
                Ok(())
            })?;
            prop_assert_eq!(found, volume.count_set());
            let mut bricks = Tree::default();
            for z in (0..dims[2]).step_by(4) {
                for y in (0..dims[1]).step_by(4) {
                    for x in (0..dims[0]).step_by(4) {
                        let inside = |b: &usize| {
                            let p = [x + b % 4, y + b / 4 % 4, z + b / 16];
                            (0..3).all(|a| p[a] < dims[a]) && set(p)
                        };
                        let bits = (0..64).filter(inside).fold(0, |w, b| w | 1 << b);
                        if bits != 0 {
                            bricks.add_brick([x, y, z], bits);
                        }
                    }
                }
            }
            bricks.settle();
            prop_assert_eq!(format!("{bricks:?}"), format!("{tree:?}"));
        }
    }
}
