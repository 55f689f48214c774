//! Which voxel centres are inside: by parity, and by winding number.
//!
//! Both come from one list: where the lines through voxel centres along x cross the surface. The
//! parity of a centre is that of the crossings before it. Its winding number is the sum of the
//! signs of these crossings, less what the surface's border takes away (see [`super::winding`]),
//! which is nothing for a closed surface. So a closed mesh costs one pass over its triangles, and
//! parity and winding number agree or disagree by whole numbers.

use super::raster::{Counts, Surface};
use super::triangle::Clip;
use super::winding::{Border, Step};
use super::{Fill, Lattice, Mode};
use super::{lines, near_lines};
use crate::progress::Progress;
use crate::volume::bits::BitGrid;
use crate::volume::octree::{TILE, Tile};
use rayon::prelude::*;
use std::ops::Range;

/// Triangles per task.
const CHUNK: usize = 1024;

/// A run of voxels `x0..x1` in a row of a tile row: `row` is `64 z + y` within it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Run {
    row: u32,
    x0: u32,
    x1: u32,
}

/// The voxels whose centres are inside, as runs along x.
#[derive(Debug, Clone)]
pub struct Filling {
    dims: [usize; 3],
    /// For each row of tiles along x, `tz * tiles_y + ty`, its runs by row and place.
    rows: Vec<Vec<Run>>,
    /// Centres that parity and winding number judge differently.
    pub disagreeing: u64,
    /// Whether the surface was taken inside out, because it encloses more negative than positive space.
    pub inverted: bool,
    /// What was counted on the way; nothing unless the surface itself sets no voxels.
    pub counts: Counts,
}

/// What a tile holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TileState {
    /// Nothing.
    Empty,
    /// Everything.
    Full,
    /// Something.
    Mixed,
}

/// The runs of a row of tiles along x.
pub struct TileRow<'a> {
    runs: &'a [Run],
    /// Rows that fill each tile, and rows that touch it.
    covered: Vec<(u32, u32)>,
}

impl TileRow<'_> {
    /// What tile `tx` holds.
    pub fn state(&self, tx: usize) -> TileState {
        match self.covered[tx] {
            (_, 0) => TileState::Empty,
            (full, _) if full as usize == TILE * TILE => TileState::Full,
            _ => TileState::Mixed,
        }
    }

    /// Sets the voxels of tile `tx`.
    pub fn set(&self, tx: usize, tile: &mut Tile) {
        let (lo, hi) = ((tx * TILE) as u32, ((tx + 1) * TILE) as u32);
        for run in self.runs.iter().filter(|r| r.x0 < hi && r.x1 > lo) {
            let (x0, x1) = (run.x0.max(lo) - lo, run.x1.min(hi) - 1 - lo);
            tile.set_run(
                x0 as usize,
                x1 as usize,
                run.row as usize % TILE,
                run.row as usize / TILE,
            );
        }
    }
}

impl Filling {
    /// The centres that are inside the surface by `rule`.
    pub fn new(
        surface: &Surface,
        rule: Fill,
        lattice: &Lattice,
        border: &Border,
        progress: &dyn Progress,
    ) -> Self {
        let dims = lattice.dims;
        let (crossings, counts) = crossings(surface, dims, progress);
        let [_, ty, tz] = dims.map(|d| d.div_ceil(TILE));
        progress.stage("fill", 2 * (ty * tz) as u64);
        let steps: Vec<Vec<Step>> = (0..ty * tz)
            .into_par_iter()
            .map(|row| {
                let steps = border.steps([row % ty, row / ty], dims);
                progress.advance(1);
                steps
            })
            .collect();
        let inverted = enclosed(&crossings.keys, &steps, dims[0]) < 0;
        let made: Vec<(Vec<Run>, u64)> = crossings
            .groups()
            .zip(&steps)
            .map(|(keys, steps)| {
                let made = tile_row(keys, steps, dims[0] as u32, rule, inverted);
                progress.advance(1);
                made
            })
            .collect();
        let disagreeing = made.iter().map(|(_, n)| n).sum();
        Filling {
            dims,
            rows: made.into_iter().map(|(runs, _)| runs).collect(),
            disagreeing,
            inverted,
            counts,
        }
    }

    /// Number of centres inside.
    pub fn count(&self) -> u64 {
        self.rows
            .par_iter()
            .map(|runs| runs.iter().map(|r| u64::from(r.x1 - r.x0)).sum::<u64>())
            .sum()
    }

    /// The runs of one row of tiles.
    pub fn tile_row(&self, ty: usize, tz: usize) -> TileRow<'_> {
        let runs = self.rows[tz * self.dims[1].div_ceil(TILE) + ty].as_slice();
        let mut covered = vec![(0, 0); self.dims[0].div_ceil(TILE)];
        // Several runs of one row may touch a tile; each counts, which only ever makes "touched" larger.
        for run in runs {
            for tx in run.x0 as usize / TILE..=(run.x1 as usize - 1) / TILE {
                let full = run.x0 as usize <= tx * TILE && run.x1 as usize >= (tx + 1) * TILE;
                covered[tx].0 += u32::from(full);
                covered[tx].1 += 1;
            }
        }
        TileRow { runs, covered }
    }

    /// Sets the voxels in a dense grid.
    pub fn set(&self, grid: &mut BitGrid) {
        let [_, ny, _] = self.dims;
        let tiles_y = ny.div_ceil(TILE);
        let stride = grid.stride();
        grid.words_mut()
            .par_chunks_mut(stride * ny)
            .enumerate()
            .for_each(|(z, slice)| {
                for ty in 0..tiles_y {
                    let runs = self.rows[z / TILE * tiles_y + ty].as_slice();
                    let first = (z % TILE * TILE) as u32;
                    let from = runs.partition_point(|r| r.row < first);
                    for run in runs[from..]
                        .iter()
                        .take_while(|r| r.row < first + TILE as u32)
                    {
                        let y = ty * TILE + run.row as usize % TILE;
                        let row = &mut slice[y * stride..(y + 1) * stride];
                        crate::volume::bits::set_run(row, run.x0 as usize, run.x1 as usize);
                    }
                }
            });
    }
}

/// A crossing is packed as row of tiles, row within it, voxel, and direction, so that sorting the
/// numbers sorts the crossings.
const ROW_SHIFT: u32 = 32;

fn crossings(surface: &Surface, dims: [usize; 3], progress: &dyn Progress) -> (Crossings, Counts) {
    let clip = Clip::grid(dims);
    let [_, ty, tz] = dims.map(|d| d.div_ceil(TILE));
    let packing = Packing {
        nx: dims[0] as i32,
        tiles_y: ty as u64,
    };
    let count = surface.triangle_count();
    progress.stage("crossings", count as u64);
    let (chunks, counts): (Vec<Vec<u64>>, Vec<Counts>) = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let triangles = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
            let length = triangles.len() as u64;
            let made = chunk_crossings(surface, triangles, &clip, packing);
            progress.advance(length);
            made
        })
        .unzip();
    let counts = counts.into_iter().fold(Counts::default(), Counts::and);
    (Crossings::sort(&chunks, ty * tz), counts)
}

/// All crossings, sorted.
struct Crossings {
    keys: Vec<u64>,
    /// Where each row of tiles begins, and where the last one ends.
    starts: Vec<usize>,
}

impl Crossings {
    /// Sorts them by row of tiles first, then each row of tiles on its own.
    fn sort(chunks: &[Vec<u64>], tile_rows: usize) -> Self {
        let mut starts = vec![0; tile_rows + 1];
        for key in chunks.iter().flatten() {
            starts[(key >> ROW_SHIFT) as usize + 1] += 1;
        }
        for row in 0..tile_rows {
            starts[row + 1] += starts[row];
        }
        let mut keys = vec![0; starts[tile_rows]];
        let mut next = starts.clone();
        for key in chunks.iter().flatten() {
            let place = &mut next[(key >> ROW_SHIFT) as usize];
            keys[*place] = *key;
            *place += 1;
        }
        let mut groups = Vec::with_capacity(tile_rows);
        let mut rest = keys.as_mut_slice();
        for row in 0..tile_rows {
            let (group, after) = rest.split_at_mut(starts[row + 1] - starts[row]);
            groups.push(group);
            rest = after;
        }
        groups
            .into_par_iter()
            .for_each_init(Vec::new, |room, group| sort_tile_row(group, room));
        Crossings { keys, starts }
    }

    /// Those of each row of tiles.
    fn groups(&self) -> impl IndexedParallelIterator<Item = &[u64]> {
        self.starts
            .par_windows(2)
            .map(|ends| &self.keys[ends[0]..ends[1]])
    }
}

/// Sorts the crossings of one row of tiles: they are few in each of its many rows.
fn sort_tile_row(keys: &mut [u64], room: &mut Vec<u64>) {
    if keys.len() < TILE * TILE / 8 {
        return keys.sort_unstable();
    }
    let mut ends = [0u32; TILE * TILE + 1];
    for key in keys.iter() {
        ends[row_of(*key) as usize + 1] += 1;
    }
    for row in 0..TILE * TILE {
        ends[row + 1] += ends[row];
    }
    room.clear();
    room.extend_from_slice(keys);
    for key in room.iter() {
        let place = &mut ends[row_of(*key) as usize];
        keys[*place as usize] = *key;
        *place += 1;
    }
    keys.chunk_by_mut(|a, b| row_of(*a) == row_of(*b))
        .for_each(<[u64]>::sort_unstable);
}

/// Packs crossings for a grid; see [`ROW_SHIFT`].
#[derive(Clone, Copy)]
struct Packing {
    nx: i32,
    tiles_y: u64,
}

impl Packing {
    /// The number for a crossing, and whether it is within reach of a voxel.
    #[inline(always)]
    fn key(self, [x, y, z]: [i32; 3], leaves: bool) -> (u64, bool) {
        let tile = TILE as u64;
        let (at, y, z) = (x.max(0) as u64, y as u64, z as u64);
        let tile_row = z / tile * self.tiles_y + y / tile;
        let row = z % tile * tile + y % tile;
        let key = tile_row << ROW_SHIFT | row << 20 | at << 1 | u64::from(leaves);
        (key, x < self.nx)
    }
}

/// The crossings of some triangles, and, where nobody else looks at all triangles, their count.
fn chunk_crossings(
    surface: &Surface,
    triangles: Range<usize>,
    clip: &Clip,
    packing: Packing,
) -> (Vec<u64>, Counts) {
    let to_count = surface.mode() == Mode::None;
    let (mut keys, mut counts) = (Vec::new(), Counts::default());
    // Those that may cross a line, found before they are looked at closely.
    let mut reached = Vec::with_capacity(CHUNK);
    // Those for exact arithmetic, and those that may have no area.
    let (mut exact, mut flat) = (Vec::new(), Vec::new());
    for (index, near) in triangles.clone().zip(surface.near_lanes(triangles)) {
        let reach = near_lines::reach(&near, clip);
        if to_count && (reach.unknown || !near_lines::has_area(&near)) {
            flat.push(index);
        }
        if reach.unknown {
            exact.push(index);
        } else if !reach.none {
            reached.push((index, near, reach));
        }
    }
    for (index, near, reach) in &reached {
        let reversed = surface.is_reversed(*index);
        let start = keys.len();
        let (mut length, mut doubtful) = (start, false);
        keys.resize(start + reach.len(), 0);
        for crossing in near_lines::crossings(near, reach) {
            doubtful |= crossing.doubtful;
            let (key, is_seen) = packing.key(crossing.at, crossing.leaves != reversed);
            keys[length] = key;
            length += usize::from(crossing.is_there & is_seen);
        }
        keys.truncate(if doubtful { start } else { length });
        if doubtful {
            exact.push(*index);
        }
    }
    for index in exact {
        let reversed = surface.is_reversed(index);
        lines::crossings(&surface.primitive(index), clip, &mut |x, y, z, turn| {
            let (key, is_seen) = packing.key([x, y, z], (turn > 0) != reversed);
            if is_seen {
                keys.push(key);
            }
        });
    }
    for index in flat {
        counts = counts.and(surface.count(index, &surface.lanes(index)));
    }
    (keys, counts)
}

fn voxel(key: u64) -> u32 {
    (key >> 1 & 0x7_ffff) as u32
}

fn row_of(key: u64) -> u32 {
    (key >> 20 & 0xfff) as u32
}

/// 1 for a crossing into the surface, -1 for one out of it.
fn step(key: u64) -> i64 {
    1 - 2 * (key & 1) as i64
}

/// The sum of the winding numbers, each rounded (a half up), over all voxels of the grid.
fn enclosed(keys: &[u64], steps: &[Vec<Step>], nx: usize) -> i64 {
    let crossed: i64 = keys
        .par_iter()
        .map(|key| step(*key) * (nx as i64 - i64::from(voxel(*key))))
        .sum();
    let length = |steps: &[Step], i: usize| {
        let next = steps.get(i + 1).filter(|next| next.row == steps[i].row);
        next.map_or(nx as i64, |next| i64::from(next.x)) - i64::from(steps[i].x)
    };
    let taken: i64 = steps
        .par_iter()
        .map(|steps| {
            (0..steps.len())
                .map(|i| (steps[i].doubled >> 1) * length(steps, i))
                .sum::<i64>()
        })
        .sum();
    crossed - taken
}

/// The runs of one row of tiles, and the number of centres that the two rules judge differently.
fn tile_row(keys: &[u64], steps: &[Step], nx: u32, rule: Fill, inverted: bool) -> (Vec<Run>, u64) {
    let mut runs: Vec<Run> = Vec::new();
    let mut disagreeing = 0;
    let (mut key, mut next) = (0, 0);
    loop {
        let row = match (
            keys.get(key).map(|k| row_of(*k)),
            steps.get(next).map(|s| s.row),
        ) {
            (None, None) => break,
            (a, b) => a.unwrap_or(u32::MAX).min(b.unwrap_or(u32::MAX)),
        };
        // Walk both lists along the row: between two events all is constant.
        let (mut winding, mut odd, mut taken) = (0i64, false, 0i64);
        let mut x = 0;
        while x < nx {
            while keys
                .get(key)
                .is_some_and(|k| row_of(*k) == row && voxel(*k) <= x)
            {
                winding += step(keys[key]);
                odd = !odd;
                key += 1;
            }
            while steps.get(next).is_some_and(|s| s.row == row && s.x <= x) {
                taken = steps[next].doubled;
                next += 1;
            }
            let until = |at: Option<u32>| at.unwrap_or(nx).min(nx);
            let end = until(
                keys.get(key)
                    .filter(|k| row_of(**k) == row)
                    .map(|k| voxel(*k)),
            )
            .min(until(steps.get(next).filter(|s| s.row == row).map(|s| s.x)));
            // The winding number is above one half (below minus one half where the surface is inside
            // out); a half itself is outside.
            let doubled = 2 * winding - taken;
            let wound = if inverted {
                doubled <= -2
            } else {
                doubled >= 2
            };
            if wound != odd {
                disagreeing += u64::from(end - x);
            }
            if if rule == Fill::Parity { odd } else { wound } {
                match runs.last_mut().filter(|r| r.row == row && r.x1 == x) {
                    Some(run) => run.x1 = end,
                    None => runs.push(Run {
                        row,
                        x0: x,
                        x1: end,
                    }),
                }
            }
            x = end;
        }
    }
    (runs, disagreeing)
}
