//! The sparse grid of bits: an octree over bricks of 4 x 4 x 4 voxels.
//!
//! The tree is built from tiles of 64^3 voxels in Morton order, each made on its own, so that a
//! grid is never held densely. A cube whose voxels are all set is one bit in its parent.

mod rays;

pub use rays::{Masks as RayMasks, Nodes, RayTree, any_hit, below};

use super::bits::{BitGrid, set_run};
use crate::error::Fault;
use rayon::prelude::*;

/// Edge of a tile in voxels.
pub const TILE: usize = 64;
/// Most voxels along an axis, so that a tile's Morton key takes 30 bits.
pub const MAX_DIM: usize = 1 << 16;
/// Bricks in a tile.
const BRICKS: usize = 4096;
/// Levels of nodes in a tile: edges 8, 16, 32 and 64.
const HEIGHTS: usize = 4;

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

/// A sparse grid of bits.
///
/// Child `c` of a node lies at `(c & 1, c >> 1 & 1, c >> 2)` half edges from its lower corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Octree {
    dims: [usize; 3],
    /// From the root down; the children of the last level are bricks.
    levels: Vec<Level>,
    bricks: Vec<u64>,
}

/// The nodes of one edge, in Morton order.
#[derive(Debug, Clone, Default, PartialEq)]
struct Level {
    /// Which children are nodes (or bricks) of their own.
    mixed: Vec<u8>,
    /// Which children are all set.
    full: Vec<u8>,
    /// Index of the first child in the next level (or among the bricks).
    first: Vec<u32>,
}

/// How many nodes a grid has, whether or not they are stored.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Census {
    /// Cubes of edge `2^level` that hold a set voxel; the last is the cube around the whole grid.
    pub nodes: Vec<u64>,
    /// Of those, the ones inside a larger cube (of edge 4 or more) whose voxels are all set.
    pub implied: u64,
    /// Cubes of edge `2^level` (2 or more) with some voxels set and some not.
    pub mixed: Vec<u64>,
    /// Whether some cube of edge 4 is all set.
    pub solid: bool,
}

impl Census {
    /// Bytes of the tree's child masks as a file holds them: see `io::svo`.
    pub fn mask_bytes(&self) -> u64 {
        if self.solid {
            // Two masks a node, but one where the children are voxels.
            self.mixed.iter().skip(2).map(|n| 2 * n).sum::<u64>()
                + self.mixed.get(1).copied().unwrap_or(0)
        } else {
            self.nodes.iter().skip(1).sum()
        }
    }

    /// Nodes of all levels, voxels included, that no larger full cube stands for.
    pub fn made(&self) -> u64 {
        self.nodes.iter().sum::<u64>() - self.implied
    }
}

/// The bits of one tile while it is made: bricks in Morton order.
#[derive(Debug, Clone)]
pub struct Tile(Box<[u64; BRICKS]>);

/// Spreads the low ten bits of `v` to every third bit.
#[inline]
fn spread(v: u32) -> u32 {
    let mut v = v & 0x3ff;
    v = (v | v << 16) & 0x0300_00ff;
    v = (v | v << 8) & 0x0300_f00f;
    v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// The Morton key of a tile at tile coordinates below 1024: bits of x lowest.
#[inline]
pub fn tile_key(x: usize, y: usize, z: usize) -> u32 {
    spread(x as u32) | spread(y as u32) << 1 | spread(z as u32) << 2
}

/// The tile coordinates of a Morton key.
pub fn tile_at(key: u32) -> [usize; 3] {
    let gather = |v: u32| (0..10).fold(0, |sum, bit| sum | (v >> (3 * bit) & 1) << bit) as usize;
    [gather(key), gather(key >> 1), gather(key >> 2)]
}

/// `SPREAD4[i]` is `spread(i)`.
const SPREAD4: [u16; 16] = {
    let mut table = [0; 16];
    let mut i = 0;
    while i < 16 {
        table[i] = (i & 1 | (i & 2) << 2 | (i & 4) << 4 | (i & 8) << 6) as u16;
        i += 1;
    }
    table
};

#[inline]
fn brick_index(x: usize, y: usize, z: usize) -> usize {
    usize::from(SPREAD4[x] | SPREAD4[y] << 1 | SPREAD4[z] << 2)
}

impl Default for Tile {
    fn default() -> Self {
        Tile(Box::new([0; BRICKS]))
    }
}

impl Tile {
    /// Makes every bit 0.
    pub fn clear(&mut self) {
        self.0.fill(0);
    }

    /// Sets voxels `x0..=x1` of a row; coordinates within the tile.
    #[inline]
    pub fn set_run(&mut self, x0: usize, x1: usize, y: usize, z: usize) {
        let shift = (y & 3) * 4 + (z & 3) * 16;
        for brick in x0 / 4..=x1 / 4 {
            let low = x0.saturating_sub(brick * 4);
            let high = (x1 - brick * 4).min(3);
            let nibble = (0xf << low) & (0xf >> (3 - high));
            self.0[brick_index(brick, y / 4, z / 4)] |= (nibble as u64) << shift;
        }
    }

    /// Sets the voxels of a row by a word of 64 bits.
    #[inline]
    pub fn set_word(&mut self, word: u64, y: usize, z: usize) {
        let shift = (y & 3) * 4 + (z & 3) * 16;
        let mut rest = word;
        while rest != 0 {
            let brick = rest.trailing_zeros() as usize / 4;
            let nibble = word >> (4 * brick) & 0xf;
            self.0[brick_index(brick, y / 4, z / 4)] |= nibble << shift;
            rest &= !(0xf << (4 * brick));
        }
    }
}

/// A run of finished tiles, in Morton order.
#[derive(Debug, Default)]
pub struct Part {
    /// Key of each tile that holds something, and whether it is all set.
    tiles: Vec<(u32, bool)>,
    /// Nodes of edge 8, 16, 32 and 64.
    levels: [Masks; HEIGHTS],
    bricks: Vec<u64>,
}

#[derive(Debug, Default)]
struct Masks {
    mixed: Vec<u8>,
    full: Vec<u8>,
}

impl Part {
    /// Adds a tile; its key must be above all before it.
    pub fn push(&mut self, key: u32, tile: &Tile) {
        // States of the children, one byte per eight of them, from bricks up to the tile itself.
        let mut states = [[(0u8, 0u8); 512]; HEIGHTS];
        for (group, bricks) in tile.0.chunks_exact(8).enumerate() {
            let mut state = (0, 0);
            for (child, bits) in bricks.iter().enumerate() {
                match *bits {
                    0 => {}
                    u64::MAX => state.1 |= 1 << child,
                    bits => {
                        state.0 |= 1 << child;
                        self.bricks.push(bits);
                    }
                }
            }
            states[0][group] = state;
        }
        let mut count = 512;
        for height in 0..HEIGHTS {
            let masks = &mut self.levels[height];
            for node in 0..count {
                let (mixed, full) = states[height][node];
                if full == 0xff {
                    if height + 1 < HEIGHTS {
                        states[height + 1][node / 8].1 |= 1 << (node % 8);
                    }
                } else if mixed | full != 0 {
                    masks.mixed.push(mixed);
                    masks.full.push(full);
                    if height + 1 < HEIGHTS {
                        states[height + 1][node / 8].0 |= 1 << (node % 8);
                    }
                }
            }
            count /= 8;
        }
        let (mixed, full) = states[HEIGHTS - 1][0];
        if mixed | full != 0 {
            self.tiles.push((key, full == 0xff));
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let masks: usize = self
            .levels
            .iter()
            .map(|l| l.mixed.capacity() + l.full.capacity())
            .sum();
        (masks + self.bricks.capacity() * 8 + self.tiles.capacity() * 8 + size_of::<Self>()) as u64
    }

    /// Gives back the room that was not needed.
    pub fn shrink(&mut self) {
        self.tiles.shrink_to_fit();
        self.bricks.shrink_to_fit();
        for masks in &mut self.levels {
            masks.mixed.shrink_to_fit();
            masks.full.shrink_to_fit();
        }
    }

    /// Adds a tile whose voxels are all set.
    pub fn push_full(&mut self, key: u32) {
        self.tiles.push((key, true));
    }
}

impl Octree {
    /// The octree of finished tiles: parts in order, and tiles in Morton order within.
    pub fn from_parts(dims: [usize; 3], parts: Vec<Part>) -> Self {
        let mut tiles = Vec::with_capacity(parts.iter().map(|p| p.tiles.len()).sum());
        let mut low: [Level; HEIGHTS] = Default::default();
        let mut bricks = Vec::with_capacity(parts.iter().map(|p| p.bricks.len()).sum());
        for mut part in parts {
            tiles.append(&mut part.tiles);
            bricks.append(&mut part.bricks);
            for (level, masks) in low.iter_mut().zip(&mut part.levels) {
                level.mixed.append(&mut masks.mixed);
                level.full.append(&mut masks.full);
            }
        }
        let [l0, l1, l2, l3] = low;
        let mut levels = vec![l3, l2, l1, l0];
        let longest = dims.iter().copied().max().unwrap_or(1).max(1);
        let mut edge = TILE;
        while edge < longest {
            let (level, above) = parents(&tiles);
            levels.insert(0, level);
            tiles = above;
            edge *= 2;
        }
        // The root is always a node, be it of an empty or of a full grid.
        if levels[0].mixed.is_empty() {
            let full = if tiles.is_empty() { 0 } else { 0xff };
            levels[0] = Level {
                mixed: vec![0],
                full: vec![full],
                first: Vec::new(),
            };
        }
        levels.iter_mut().for_each(Level::link);
        Octree {
            dims,
            levels,
            bricks,
        }
    }

    /// The octree of a dense grid, made tile by tile.
    pub fn from_bits(grid: &BitGrid) -> Self {
        let mut keys = Vec::new();
        let [nx, ny, nz] = grid.dims().map(|d| d.div_ceil(TILE));
        for z in 0..nz {
            for y in 0..ny {
                keys.extend((0..nx).map(|x| tile_key(x, y, z)));
            }
        }
        keys.sort_unstable();
        let parts = keys
            .par_chunks(64)
            .map(|keys| {
                let mut part = Part::default();
                let mut tile = Tile::default();
                for key in keys {
                    if copy_tile(grid, tile_at(*key), &mut tile) {
                        part.push(*key, &tile);
                        tile.clear();
                    }
                }
                part
            })
            .collect();
        Octree::from_parts(grid.dims(), parts)
    }

    /// The dense form.
    pub fn to_bits(&self) -> BitGrid {
        let mut grid = BitGrid::new(self.dims);
        self.read_slices(0, &mut grid);
        grid
    }

    /// Voxels along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Bytes that the tree holds in memory.
    pub fn bytes(&self) -> u64 {
        let nodes: usize = self.levels.iter().map(|l| l.mixed.len()).sum();
        (nodes * 6 + self.bricks.len() * 8) as u64
    }

    /// Edge of the root in voxels.
    fn root_edge(&self) -> usize {
        4 << self.levels.len()
    }

    /// Number of voxels set.
    pub fn count(&self) -> u64 {
        let bits: u64 = self
            .bricks
            .par_iter()
            .map(|b| u64::from(b.count_ones()))
            .sum();
        let mut edge = self.root_edge() as u64 / 2;
        let mut sum = bits;
        for level in &self.levels {
            let full: u64 = level.full.iter().map(|m| u64::from(m.count_ones())).sum();
            sum += full * edge.pow(3);
            edge /= 2;
        }
        sum
    }

    /// The bit of a voxel. Cost: one step per level.
    pub fn get(&self, x: usize, y: usize, z: usize) -> bool {
        let mut shift = self.levels.len() as u32 + 1;
        let mut node = 0;
        for level in &self.levels {
            let child = (x >> shift & 1) | (y >> shift & 1) << 1 | (z >> shift & 1) << 2;
            if level.full[node] >> child & 1 == 1 {
                return true;
            }
            let mask = level.mixed[node];
            if mask >> child & 1 == 0 {
                return false;
            }
            node = level.first[node] as usize + (mask & ((1 << child) - 1)).count_ones() as usize;
            shift -= 1;
        }
        self.bricks[node] >> ((x & 3) + 4 * (y & 3) + 16 * (z & 3)) & 1 == 1
    }

    /// Calls `f` for every cell that holds something, in Morton order.
    pub fn visit(&self, f: &mut dyn FnMut(Cell)) {
        self.visit_slices(0, self.root_edge(), f);
    }

    /// Calls `f` for every cell that meets slices `z0..z1`, in Morton order.
    pub fn visit_slices(&self, z0: usize, z1: usize, f: &mut dyn FnMut(Cell)) {
        self.descend(0, 0, [0; 3], (z0, z1), f);
    }

    fn descend(
        &self,
        depth: usize,
        node: usize,
        min: [usize; 3],
        z: (usize, usize),
        f: &mut dyn FnMut(Cell),
    ) {
        let level = &self.levels[depth];
        let edge = (self.root_edge() >> depth) / 2;
        let (mixed, full) = (level.mixed[node], level.full[node]);
        let mut next = level.first[node] as usize;
        for child in 0..8 {
            let is_mixed = mixed >> child & 1 == 1;
            let index = next;
            next += usize::from(is_mixed);
            if !is_mixed && full >> child & 1 == 0 {
                continue;
            }
            let min = [
                min[0] + (child & 1) * edge,
                min[1] + (child >> 1 & 1) * edge,
                min[2] + (child >> 2) * edge,
            ];
            if min[2] >= z.1 || min[2] + edge <= z.0 {
                continue;
            }
            if !is_mixed {
                f(Cell::Full { min, edge });
            } else if depth + 1 < self.levels.len() {
                self.descend(depth + 1, index, min, z, f);
            } else {
                f(Cell::Brick {
                    min,
                    bits: self.bricks[index],
                });
            }
        }
    }

    /// Copies the slices from `z0` on into `out`, whose x and y dims are the tree's.
    pub fn read_slices(&self, z0: usize, out: &mut BitGrid) {
        out.clear();
        let depth = out.dims()[2];
        let z1 = z0 + depth;
        self.visit_slices(z0, z1, &mut |cell| match cell {
            Cell::Full { min, edge } => {
                for z in min[2].max(z0)..(min[2] + edge).min(z1) {
                    for y in min[1]..min[1] + edge {
                        set_run(out.row_mut(y, z - z0), min[0], min[0] + edge);
                    }
                }
            }
            Cell::Brick { min, bits } => {
                for z in min[2].max(z0)..(min[2] + 4).min(z1) {
                    let layer = bits >> (16 * (z - min[2]));
                    for y in 0..4 {
                        let nibble = layer >> (4 * y) & 0xf;
                        if nibble != 0 {
                            out.row_mut(min[1] + y, z - z0)[min[0] / 64] |= nibble << (min[0] % 64);
                        }
                    }
                }
            }
        });
    }

    /// Counts the nodes of every level.
    pub fn census(&self) -> Census {
        let mut tally = Tally::new(self.dims);
        for bits in &self.bricks {
            tally.brick(*bits);
        }
        for (depth, level) in self.levels.iter().enumerate() {
            let log = self.levels.len() - depth + 2;
            for (mixed, full) in level.mixed.iter().zip(&level.full) {
                tally.node(log, *mixed | *full != 0, u64::from(full.count_ones()));
            }
        }
        tally.finish()
    }

    /// `R`, where the root of a grid of these dims has edge `2^R`; `None` when a side is 0 or above
    /// [`MAX_DIM`].
    pub fn root_log(dims: [usize; 3]) -> Option<usize> {
        let longest = dims.iter().copied().max()?;
        let fits = dims.iter().all(|d| (1..=MAX_DIM).contains(d));
        fits.then(|| longest.max(TILE).next_power_of_two().trailing_zeros() as usize)
    }

    /// The nodes that are neither empty nor all set, level by level from the root down to edge 2, each
    /// as `(children that hold something, children that are all set)`; at edge 2 the children are
    /// voxels and the second mask is 0.
    ///
    /// Unless `solid`, all-set cubes of edge 2 are listed as nodes too; there must then be no larger
    /// ones.
    pub fn masks(&self, solid: bool) -> Vec<Vec<(u8, u8)>> {
        let masks = |l: &Level| {
            l.mixed
                .iter()
                .zip(&l.full)
                .map(|(m, f)| (m | f, *f))
                .collect()
        };
        let mut all: Vec<Vec<_>> = self.levels.iter().map(masks).collect();
        all.push(self.bricks.iter().map(|bits| halves(*bits)).collect());
        let octants = self
            .bricks
            .iter()
            .flat_map(|bits| (0..8).map(|o| octant(*bits, o)));
        all.push(
            octants
                .filter(|o| *o != 0 && !(solid && *o == 0xff))
                .map(|o| (o, 0))
                .collect(),
        );
        if !solid {
            // All-set octants are nodes of their own here, not marks in their parent.
            let quads = all.len() - 2;
            all[quads].iter_mut().for_each(|mask| mask.1 = 0);
        }
        all
    }

    /// The tree of masks as [`Octree::masks`] lists them. Errs where they do not form a tree, where a
    /// node is empty or all set, or where a voxel lies outside of `dims`.
    pub fn from_masks(dims: [usize; 3], mut masks: Vec<Vec<(u8, u8)>>) -> Result<Self, Fault> {
        if Octree::root_log(dims) != Some(masks.len()) {
            return Err(Fault::whole(format!(
                "{} levels of nodes for {dims:?} voxels",
                masks.len()
            )));
        }
        check_masks(&masks)?;
        let mut octants = masks.pop().unwrap_or_default().into_iter();
        let quads = masks.pop().unwrap_or_default();
        let bricks = quads
            .iter()
            .map(|(any, all)| {
                (0..8).filter(|o| any >> o & 1 == 1).fold(0, |bits, o| {
                    let octant = if all >> o & 1 == 1 {
                        0xff
                    } else {
                        octants.next().map_or(0, |m| m.0)
                    };
                    bits | place_octant(octant, o)
                })
            })
            .collect();
        let split = |nodes: Vec<(u8, u8)>| {
            let (mixed, full) = nodes
                .into_iter()
                .map(|(any, all)| (any & !all, all))
                .unzip();
            Level {
                mixed,
                full,
                first: Vec::new(),
            }
        };
        let mut levels: Vec<Level> = masks.into_iter().map(split).collect();
        levels.iter_mut().for_each(Level::link);
        let tree = Octree {
            dims,
            levels,
            bricks,
        };
        let mut outside = None;
        tree.visit(&mut |cell| {
            let (min, edge) = match cell {
                Cell::Full { min, edge } => (min, [edge; 3]),
                Cell::Brick { min, bits } => (min, reach(bits)),
            };
            if (0..3).any(|a| min[a] + edge[a] > dims[a]) {
                outside = outside.or(Some(min));
            }
        });
        match outside {
            Some(min) => Err(Fault::whole(format!(
                "the cube at {min:?} has voxels outside of {dims:?}"
            ))),
            None => Ok(tree),
        }
    }
}

/// Checks that masks form a tree: each level has the nodes that the one above asks for, none of
/// them empty or all set.
fn check_masks(masks: &[Vec<(u8, u8)>]) -> Result<(), Fault> {
    let wrong = |level: usize, node: usize, what: &str| {
        Err(Fault::element(
            "node",
            node,
            format!("{what}, {level} levels below the root"),
        ))
    };
    for (level, nodes) in masks.iter().enumerate() {
        for (node, (any, all)) in nodes.iter().enumerate() {
            if level > 0 && *any == 0 {
                return wrong(level, node, "is empty");
            }
            if all & !any != 0 || level > 0 && *all == 0xff {
                return wrong(level, node, "its masks contradict each other");
            }
        }
        let expected = match level {
            0 => 1,
            _ => masks[level - 1]
                .iter()
                .map(|(any, all)| (any & !all).count_ones() as usize)
                .sum(),
        };
        if nodes.len() != expected {
            if level == 0 {
                let what = format!("{} nodes at the root, not 1", nodes.len());
                return Err(Fault::whole(what));
            }
            let what = format!(
                "{} nodes, but the level above asks for {expected}",
                nodes.len()
            );
            return Err(Fault::element("level", level, what));
        }
    }
    Ok(())
}

impl Level {
    /// Finds where the children of each node begin.
    fn link(&mut self) {
        let mut next = 0;
        let first = |mask: &u8| {
            let first = next;
            next += mask.count_ones();
            first
        };
        self.first = self.mixed.iter().map(first).collect();
    }
}

/// The voxels of an octant at its place in a brick.
fn place_octant(octant: u8, child: usize) -> u64 {
    let at = (child & 1) * 2 + (child >> 1 & 1) * 8 + (child >> 2) * 32;
    let o = u64::from(octant);
    ((o & 3) | (o >> 2 & 3) << 4 | (o >> 4 & 3) << 16 | (o >> 6 & 3) << 20) << at
}

/// How many voxels along x, y, z hold all that is set in a brick.
fn reach(bits: u64) -> [usize; 3] {
    let last = |mask: u64, step: usize| {
        (1..=4usize)
            .rev()
            .find(|n| bits & mask << (step * (n - 1)) != 0)
            .unwrap_or(0)
    };
    [
        last(0x1111_1111_1111_1111, 1),
        last(0x000f_000f_000f_000f, 4),
        last(0xffff, 16),
    ]
}

/// The tree over one level of cubes: the level of their parents, and the parents' keys.
fn parents(tiles: &[(u32, bool)]) -> (Level, Vec<(u32, bool)>) {
    let mut level = Level::default();
    let mut above = Vec::new();
    for group in tiles.chunk_by(|a, b| a.0 >> 3 == b.0 >> 3) {
        let bits = |wanted: bool| {
            group
                .iter()
                .filter(|t| t.1 == wanted)
                .fold(0u8, |m, t| m | 1 << (t.0 & 7))
        };
        let (mixed, full) = (bits(false), bits(true));
        above.push((group[0].0 >> 3, full == 0xff));
        if full != 0xff {
            level.mixed.push(mixed);
            level.full.push(full);
        }
    }
    (level, above)
}

/// The 2^3 voxels of a brick's octant, bit `x + 2 y + 4 z`.
#[inline]
pub fn octant(bits: u64, child: usize) -> u8 {
    let at = (child & 1) * 2 + (child >> 1 & 1) * 8 + (child >> 2) * 32;
    let b = bits >> at;
    ((b & 3) | (b >> 4 & 3) << 2 | (b >> 16 & 3) << 4 | (b >> 20 & 3) << 6) as u8
}

/// Which octants of a brick hold something, and which are all set.
#[inline]
fn halves(bits: u64) -> (u8, u8) {
    // Fold each pair of neighbours along x, y, z onto the lower one.
    let any = bits | bits >> 1;
    let any = any | any >> 4;
    let any = any | any >> 16;
    let all = bits & bits >> 1;
    let all = all & all >> 4;
    let all = all & all >> 16;
    let gather = |b: u64| {
        ((b & 1)
            | (b >> 1 & 2)
            | (b >> 6 & 4)
            | (b >> 7 & 8)
            | (b >> 28 & 16)
            | (b >> 29 & 32)
            | (b >> 34 & 64)
            | (b >> 35 & 128)) as u8
    };
    (gather(any), gather(all))
}

/// Copies the bits of a tile; false, with the tile untouched, when none is set.
fn copy_tile(grid: &BitGrid, [tx, ty, tz]: [usize; 3], tile: &mut Tile) -> bool {
    let [_, ny, nz] = grid.dims();
    let mut any = false;
    for z in tz * TILE..nz.min((tz + 1) * TILE) {
        for y in ty * TILE..ny.min((ty + 1) * TILE) {
            let word = grid.row(y, z)[tx];
            if word != 0 {
                tile.set_word(word, y % TILE, z % TILE);
                any = true;
            }
        }
    }
    any
}

/// Counts the nodes of a dense grid of bits without storing them, a row of tiles at a time.
pub fn census(grid: &BitGrid) -> Census {
    let dims = grid.dims();
    let [nx, ny, nz] = dims.map(|d| d.div_ceil(TILE));
    let rows: Vec<(Tally, Vec<(u32, bool)>)> = (0..ny * nz)
        .into_par_iter()
        .map(|row| {
            let (y, z) = (row % ny, row / ny);
            let mut tally = Tally::new(dims);
            let mut held = Vec::new();
            let mut tiles = vec![Tile::default(); nx];
            let mut part = Part::default();
            // All tiles of the row at once, so that each line of memory is read once.
            for zz in z * TILE..dims[2].min((z + 1) * TILE) {
                for yy in y * TILE..dims[1].min((y + 1) * TILE) {
                    for (x, word) in grid
                        .row(yy, zz)
                        .iter()
                        .enumerate()
                        .filter(|(_, word)| **word != 0)
                    {
                        tiles[x].set_word(*word, yy % TILE, zz % TILE);
                    }
                }
            }
            for (x, tile) in tiles.iter().enumerate() {
                part.push(tile_key(x, y, z), tile);
                tally.part(&part);
                held.append(&mut part.tiles);
                part.bricks.clear();
                part.levels = Default::default();
            }
            (tally, held)
        })
        .collect();
    let mut tally = Tally::new(dims);
    let mut tiles = Vec::new();
    for (other, mut held) in rows {
        tally.add(&other);
        tiles.append(&mut held);
    }
    tiles.sort_unstable();
    let mut log = 7;
    while tally.nodes.len() > log {
        let (level, above) = parents(&tiles);
        for (mixed, full) in level.mixed.iter().zip(&level.full) {
            tally.node(log, *mixed | *full != 0, u64::from(full.count_ones()));
        }
        tiles = above;
        log += 1;
    }
    // A grid that is one full cube has no parent to say so.
    if tiles.first().is_some_and(|t| t.1) {
        tally.full_cubes(log - 1, 1);
    }
    tally.finish()
}

/// Counts nodes as they come.
struct Tally {
    nodes: Vec<u64>,
    mixed: Vec<u64>,
    implied: u64,
    solid: bool,
}

impl Tally {
    fn new(dims: [usize; 3]) -> Self {
        let longest = dims.iter().copied().max().unwrap_or(1).max(1);
        let levels = longest.next_power_of_two().trailing_zeros() as usize + 1;
        Tally {
            nodes: vec![0; levels],
            mixed: vec![0; levels],
            implied: 0,
            solid: false,
        }
    }

    fn bump(&mut self, log: usize, count: u64) {
        if let Some(nodes) = self.nodes.get_mut(log) {
            *nodes += count;
        }
    }

    /// A brick with some voxels set, not all.
    fn brick(&mut self, bits: u64) {
        let (any, all) = halves(bits);
        self.bump(0, u64::from(bits.count_ones()));
        self.bump(1, u64::from(any.count_ones()));
        self.bump(2, 1);
        for (log, count) in [(1, u64::from((any & !all).count_ones())), (2, 1)] {
            if let Some(mixed) = self.mixed.get_mut(log) {
                *mixed += count;
            }
        }
    }

    /// A node of edge `2^log` with `full` children that are all set; only a root has eight.
    fn node(&mut self, log: usize, any: bool, full: u64) {
        if full == 8 {
            self.full_cubes(log, 1);
        } else if any {
            self.bump(log, 1);
            if let Some(mixed) = self.mixed.get_mut(log) {
                *mixed += 1;
            }
            self.full_cubes(log - 1, full);
        }
    }

    /// `count` cubes of edge `2^log` with all voxels set.
    fn full_cubes(&mut self, log: usize, count: u64) {
        for level in 0..=log {
            let inside = count << (3 * (log - level));
            self.bump(level, inside);
            if level < log {
                self.implied += inside;
            }
        }
        self.solid |= count > 0;
    }

    fn part(&mut self, part: &Part) {
        for bits in &part.bricks {
            self.brick(*bits);
        }
        for (height, masks) in part.levels.iter().enumerate() {
            for (mixed, full) in masks.mixed.iter().zip(&masks.full) {
                self.node(
                    height + 3,
                    *mixed | *full != 0,
                    u64::from(full.count_ones()),
                );
            }
        }
    }

    fn add(&mut self, other: &Tally) {
        for (sum, more) in self.nodes.iter_mut().zip(&other.nodes) {
            *sum += more;
        }
        for (sum, more) in self.mixed.iter_mut().zip(&other.mixed) {
            *sum += more;
        }
        self.implied += other.implied;
        self.solid |= other.solid;
    }

    fn finish(self) -> Census {
        Census {
            nodes: self.nodes,
            implied: self.implied,
            mixed: self.mixed,
            solid: self.solid,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    /// A grid of blocks that are set at random.
    fn random(dims: [usize; 3], share: f64, block: usize, seed: u64) -> BitGrid {
        let mut grid = BitGrid::new(dims);
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    let index = ((z / block * 1000 + y / block) * 1000 + x / block) as u64;
                    if Rng::new(seed, index).unit() < share {
                        grid.set(x, y, z);
                    }
                }
            }
        }
        grid
    }

    fn cases() -> Vec<BitGrid> {
        let dims = [
            [200, 3, 70],
            [1, 1, 1],
            [5, 7, 3],
            [64, 64, 64],
            [130, 65, 67],
            [33, 129, 65],
        ];
        let mut all = vec![
            random([128, 128, 128], 2.0, 1, 0),
            random([8, 8, 8], 2.0, 1, 0),
            random([130, 65, 67], 0.4, 4, 5),
            random([100, 90, 80], 0.5, 16, 6),
            random([128, 64, 192], 0.5, 64, 8),
        ];
        for (seed, dims) in dims.into_iter().enumerate() {
            all.extend([0.0, 0.002, 0.3].map(|share| random(dims, share, 1, seed as u64)));
            all.push(random(dims, 0.9, 2, seed as u64));
        }
        all
    }

    /// Counts by looking at every voxel of every cube.
    fn brute_nodes(grid: &BitGrid, level: usize) -> u64 {
        let dims = grid.dims();
        let nodes = dims.map(|d| d.div_ceil(1 << level));
        let mut held = vec![false; nodes.iter().product()];
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in (0..dims[0]).filter(|x| grid.get(*x, y, z)) {
                    held[((z >> level) * nodes[1] + (y >> level)) * nodes[0] + (x >> level)] = true;
                }
            }
        }
        held.into_iter().filter(|h| *h).count() as u64
    }

    #[test]
    fn the_tree_holds_the_bits_of_the_grid() {
        for grid in cases() {
            let tree = Octree::from_bits(&grid);
            assert!(tree.to_bits() == grid, "{:?}", grid.dims());
            assert_eq!(tree.count(), grid.count());
            let [nx, ny, nz] = grid.dims();
            for i in 0..500 {
                let mut rng = Rng::new(9, i);
                let (x, y, z) = (rng.below(nx), rng.below(ny), rng.below(nz));
                assert_eq!(tree.get(x, y, z), grid.get(x, y, z), "{x} {y} {z}");
            }
            let mut part = BitGrid::new([nx, ny, nz.min(3)]);
            let z0 = nz - nz.min(3);
            tree.read_slices(z0, &mut part);
            let mut wanted = part.clone();
            wanted.copy_slices(&grid, z0);
            assert!(part == wanted);
        }
    }

    #[test]
    fn every_level_is_the_or_of_its_voxels() {
        for grid in cases() {
            let sparse = Octree::from_bits(&grid).census();
            let dense = census(&grid);
            assert_eq!(sparse, dense, "{:?}", grid.dims());
            for (level, nodes) in dense.nodes.iter().enumerate() {
                assert_eq!(
                    *nodes,
                    brute_nodes(&grid, level),
                    "{:?} level {level}",
                    grid.dims()
                );
            }
        }
    }

    #[test]
    fn masks_make_the_same_tree_and_take_the_stated_bytes() {
        for grid in cases() {
            let tree = Octree::from_bits(&grid);
            let census = tree.census();
            let masks = tree.masks(census.solid);
            // Nodes of the levels that the grid's own pyramid has; the tile may reach above it.
            let own = masks.len() + 1 - census.nodes.len();
            let width = |level: usize| {
                if census.solid && level + 1 < masks.len() {
                    2
                } else {
                    1
                }
            };
            let bytes: usize = (own..masks.len()).map(|l| masks[l].len() * width(l)).sum();
            if grid.count() > 0 && census.nodes.len() > 3 && census.mixed.last() == Some(&1) {
                assert_eq!(bytes as u64, census.mask_bytes(), "{:?}", grid.dims());
            }
            assert!(
                Octree::from_masks(grid.dims(), masks).as_ref() == Ok(&tree),
                "{:?}",
                grid.dims()
            );
        }
    }

    #[test]
    fn masks_that_are_no_tree_are_refused() {
        let tree = Octree::from_bits(&random([70, 70, 70], 0.01, 1, 1));
        let good = tree.masks(false);
        type Masks = Vec<Vec<(u8, u8)>>;
        let spoilt = |f: &dyn Fn(&mut Masks)| {
            let mut masks = good.clone();
            f(&mut masks);
            Octree::from_masks([70, 70, 70], masks)
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            spoilt(&|m| m[0][0] = (0, 0)),
            "level 1: 8 nodes, but the level above asks for 0"
        );
        assert_eq!(
            spoilt(&|m| m[2][1] = (0, 0)),
            "node 1: is empty, 2 levels below the root"
        );
        assert_eq!(
            spoilt(&|m| m[3][0] = (1, 2)),
            "node 0: its masks contradict each other, 3 levels below the root"
        );
        assert_eq!(
            spoilt(&|m| m.truncate(3)),
            "3 levels of nodes for [70, 70, 70] voxels"
        );
        let narrow = Octree::from_masks([70, 65, 70], good.clone())
            .unwrap_err()
            .to_string();
        assert!(
            narrow.ends_with("has voxels outside of [70, 65, 70]"),
            "{narrow}"
        );
    }
}
