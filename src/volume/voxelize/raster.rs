//! The surface of a mesh in the coordinates of a grid, and its voxels in a sparse grid, tile by tile.

use super::Mode;
use super::fill::{Filling, TileState};
use super::lattice::Lattice;
use super::lines::columns;
use super::overlap::overlap;
use super::span::Span;
use super::triangle::{Clip, Lanes, Triangle, corners, is_degenerate};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::progress::Progress;
use crate::volume::octree::{Octree, Part, TILE, Tile, tile_key};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use wide::f64x4;

/// Primitives per task; fixed, so that results never follow the threads.
pub(super) const CHUNK: usize = 4096;

/// The surface of a mesh in the coordinates of a grid: triangles, then segments, then points.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    mesh: &'a Mesh,
    lattice: Lattice,
    mode: Mode,
    reversed: &'a [bool],
    /// Bounds all coordinates.
    reach: f64,
}

/// What was counted on the way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Triangles whose corners lie on one line.
    pub degenerate: u64,
    /// The first of them.
    pub first: Option<u64>,
}

impl Counts {
    pub(super) fn and(self, other: Counts) -> Counts {
        let first = [self.first, other.first].into_iter().flatten().min();
        Counts {
            degenerate: self.degenerate + other.degenerate,
            first,
        }
    }
}

impl<'a> Surface<'a> {
    /// The surface of `mesh` under a rule.
    pub fn new(mesh: &'a Mesh, lattice: Lattice, mode: Mode) -> Self {
        let bounds = mesh.used_bounds();
        let corners = if bounds.is_empty() {
            [[0.0; 3]; 2]
        } else {
            [bounds.lo, bounds.hi]
        };
        // Rounding keeps the order, so nothing in the mesh is beyond its corners.
        let reach = corners
            .iter()
            .flat_map(|p| lattice.to_grid(*p))
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        Surface {
            mesh,
            lattice,
            mode,
            reversed: &[],
            reach,
        }
    }

    /// The same with some triangles taken the other way round, which matters to crossings only.
    pub fn reversing(self, reversed: &'a [bool]) -> Self {
        Surface { reversed, ..self }
    }

    /// Whether a triangle is taken the other way round.
    #[inline]
    pub fn is_reversed(&self, triangle: usize) -> bool {
        self.reversed.get(triangle).copied().unwrap_or(false)
    }

    /// Number of triangles among the primitives; they come first.
    pub fn triangle_count(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// Number of primitives whose voxels are set; none where only a fill sets any.
    pub fn len(&self) -> usize {
        if self.mode == Mode::None {
            return 0;
        }
        self.mesh.triangles.len() + self.mesh.segments.len() + self.mesh.points.len()
    }

    /// A primitive as a triangle, which for a segment or a point has no area.
    #[inline]
    pub fn primitive(&self, index: usize) -> Triangle {
        corners(&self.lanes(index))
    }

    #[inline(always)]
    pub(super) fn lanes(&self, index: usize) -> Lanes {
        let to_grid = self.lattice.in_lanes();
        let at = |v: u32| to_grid(self.mesh.positions[v as usize]);
        let triangles = self.mesh.triangles.len();
        if let Some(t) = self.mesh.triangles.get(index) {
            return [at(t[0]), at(t[1]), at(t[2])];
        }
        match self.mesh.segments.get(index - triangles) {
            Some(s) => [at(s[0]), at(s[1]), at(s[1])],
            None => [at(self.mesh.points[index - triangles - self.mesh.segments.len()]); 3],
        }
    }

    /// The corners of the triangles in a range, within the grid less than 2^-34 voxels from where
    /// [`Surface::lanes`] has them.
    #[inline(always)]
    pub(super) fn near_lanes(&self, triangles: Range<usize>) -> impl Iterator<Item = Lanes> {
        let to_grid = self.lattice.near_lanes();
        let positions = &self.mesh.positions;
        self.mesh.triangles[triangles]
            .iter()
            .map(move |t| t.map(|v| to_grid(positions[v as usize])))
    }

    fn is_point(&self, index: usize) -> bool {
        index >= self.mesh.triangles.len() + self.mesh.segments.len()
    }

    /// The rule by which voxels are set.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Emits the runs `(x0, x1, y, z)` of voxels that a primitive sets within `clip`.
    #[inline(always)]
    pub fn set(
        &self,
        index: usize,
        lanes: &Lanes,
        clip: &Clip,
        rows: &mut Vec<Span>,
        emit: &mut impl FnMut(i32, i32, i32, i32),
    ) {
        let axes: &[usize] = match self.mode {
            Mode::Conservative if self.is_point(index) => {
                self.set_point(&corners(lanes), clip, emit);
                &[]
            }
            Mode::Conservative => {
                overlap(lanes, clip, rows, emit);
                &[]
            }
            mode => mode.axes().unwrap_or(&[]),
        };
        let q = &corners(lanes);
        for axis in axes {
            columns(q, *axis, self.lattice.dims, clip, &mut |[x, y, z]| {
                emit(x, x, y, z)
            });
        }
    }

    /// A point sets the voxel that holds it: on a face between two the upper one, on the upper face
    /// of the grid the last.
    fn set_point(&self, q: &Triangle, clip: &Clip, emit: &mut impl FnMut(i32, i32, i32, i32)) {
        let mut at = [0; 3];
        for a in 0..3 {
            at[a] = super::span::floor(q[0][a]);
            if q[0][a] == self.lattice.dims[a] as f64 {
                at[a] -= 1;
            }
            if at[a] < clip.lo()[a] || at[a] > clip.hi()[a] {
                return;
            }
        }
        emit(at[0], at[0], at[1], at[2]);
    }

    #[inline]
    pub(super) fn count(&self, index: usize, lanes: &Lanes) -> Counts {
        let is_triangle = index < self.mesh.triangles.len();
        if is_triangle && is_degenerate(&corners(lanes), self.reach) {
            Counts {
                degenerate: 1,
                first: Some(index as u64),
            }
        } else {
            Counts::default()
        }
    }

    /// The octree of the surface and of what `filling` adds, made one tile of 64^3 voxels per thread
    /// at a time. Errs when the tree itself would go over `limit` bytes.
    ///
    /// Cost: the primitives, once for every tile they touch; memory: eight bytes for each such
    /// pair, and the tree.
    pub fn rasterize_sparse(
        &self,
        filling: Option<&Filling>,
        limit: u64,
        progress: &dyn Progress,
    ) -> Result<(Octree, Counts)> {
        let (pairs, counts) = self.bin(progress);
        let tile_rows = tile_rows(&pairs, filling, self.lattice.dims);
        let used = AtomicU64::new(8 * pairs.len() as u64);
        progress.stage("rasterize", pairs.len() as u64);
        let made: Vec<Vec<(u32, Part)>> = tile_rows
            .par_iter()
            .map_init(Worker::default, |worker, (row, pairs)| {
                if used.load(Ordering::Relaxed) > limit {
                    return Vec::new();
                }
                let parts = self.tile_row(*row, pairs, filling, worker);
                used.fetch_add(parts.iter().map(|p| p.1.bytes()).sum(), Ordering::Relaxed);
                progress.advance(pairs.len() as u64);
                parts
            })
            .collect();
        if used.into_inner() > limit {
            let [x, y, z] = self.lattice.dims;
            // How much more it would be depends on when a thread noticed.
            return Err(Error::Limit {
                what: format!("the sparse grid of {x} x {y} x {z} voxels"),
                needed: format!("more than {limit} bytes"),
                limit: format!("{limit} bytes"),
                hint: Some("lower --resolution, or raise --max-memory".to_owned()),
            });
        }
        drop(pairs);
        let mut parts: Vec<(u32, Part)> = made.into_iter().flatten().collect();
        parts.sort_unstable_by_key(|(key, _)| *key);
        Ok((
            Octree::from_parts(
                self.lattice.dims,
                parts.into_iter().map(|(_, part)| part).collect(),
            ),
            counts,
        ))
    }

    /// Which primitive touches which tile: `tile << 32 | primitive`, sorted; a tile is
    /// `z << 20 | y << 10 | x`.
    fn bin(&self, progress: &dyn Progress) -> (Vec<u64>, Counts) {
        let count = self.len();
        progress.stage("bin", count as u64);
        let clip = Clip::grid(self.lattice.dims.map(|d| d.div_ceil(TILE)));
        let (chunks, counts): (Vec<Vec<u64>>, Vec<Counts>) = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Vec::new, |rows, chunk| {
                let mut pairs = Vec::with_capacity(CHUNK + CHUNK / 4);
                let mut counts = Counts::default();
                let last = ((chunk + 1) * CHUNK).min(count);
                for index in chunk * CHUNK..last {
                    let lanes = self.lanes(index);
                    counts = counts.and(self.count(index, &lanes));
                    // Scaling by a power of two is exact, so a tile is found by the same closed test
                    // as a voxel, and no voxel of a tile can be missed.
                    let scaled = lanes.map(|lane| lane * f64x4::splat(1.0 / TILE as f64));
                    overlap(&scaled, &clip, rows, &mut |x0, x1, y, z| {
                        for x in x0..=x1 {
                            let tile = (z as u64) << 20 | (y as u64) << 10 | x as u64;
                            pairs.push(tile << 32 | index as u64);
                        }
                    });
                }
                progress.advance((last - chunk * CHUNK) as u64);
                (pairs, counts)
            })
            .unzip();
        let mut pairs = chunks.concat();
        drop(chunks);
        pairs.par_sort_unstable();
        (
            pairs,
            counts.into_iter().fold(Counts::default(), Counts::and),
        )
    }

    /// The tiles of one row of tiles along x, each with its key.
    fn tile_row(
        &self,
        row: u64,
        pairs: &[u64],
        filling: Option<&Filling>,
        worker: &mut Worker,
    ) -> Vec<(u32, Part)> {
        let (ty, tz) = ((row & 0x3ff) as usize, (row >> 10) as usize);
        let mut parts = Vec::new();
        let mut add = |tx: usize, tile: Option<&Tile>| {
            let mut part = Part::default();
            let key = tile_key(tx, ty, tz);
            match tile {
                Some(tile) => part.push(key, tile),
                None => part.push_full(key),
            }
            part.shrink();
            parts.push((key, part));
        };
        let inside = filling.map(|filling| filling.tile_row(ty, tz));
        let mut groups = pairs.chunk_by(|a, b| a >> 32 == b >> 32).peekable();
        let tiles = self.lattice.dims[0].div_ceil(TILE);
        let mut tx = 0;
        while tx < tiles {
            let touched = groups.peek().map(|g| (g[0] >> 32 & 0x3ff) as usize);
            let fills = inside.as_ref();
            match fills {
                None => match touched {
                    Some(next) => tx = next,
                    None => break,
                },
                Some(fills) if touched != Some(tx) => {
                    match fills.state(tx) {
                        TileState::Empty => {}
                        TileState::Full => add(tx, None),
                        TileState::Mixed => {
                            fills.set(tx, &mut worker.tile);
                            add(tx, Some(&worker.tile));
                            worker.tile.clear();
                        }
                    }
                    tx += 1;
                    continue;
                }
                Some(fills) => fills.set(tx, &mut worker.tile),
            }
            if let Some(group) = groups.next() {
                self.tile([tx, ty, tz], group, worker);
            }
            add(tx, Some(&worker.tile));
            worker.tile.clear();
            tx += 1;
        }
        parts
    }

    /// Sets the voxels of one tile.
    fn tile(&self, at: [usize; 3], group: &[u64], worker: &mut Worker) {
        let lo = at.map(|t| (t * TILE) as i32);
        let last = self.lattice.dims.map(|d| d as i32 - 1);
        let clip = Clip::new(
            lo,
            std::array::from_fn(|a| (lo[a] + TILE as i32 - 1).min(last[a])),
        );
        let Worker { tile, rows } = worker;
        for pair in group {
            let index = (pair & 0xffff_ffff) as usize;
            let lanes = self.lanes(index);
            self.set(index, &lanes, &clip, rows, &mut |x0, x1, y, z| {
                let within = |c: i32, a: usize| (c - lo[a]) as usize;
                tile.set_run(within(x0, 0), within(x1, 0), within(y, 1), within(z, 2));
            });
        }
    }
}

/// Working memory of a thread.
#[derive(Default)]
struct Worker {
    tile: Tile,
    rows: Vec<Span>,
}

/// The rows of tiles along x that hold something, `z << 10 | y`, each with its pairs.
fn tile_rows<'a>(
    pairs: &'a [u64],
    filling: Option<&Filling>,
    dims: [usize; 3],
) -> Vec<(u64, &'a [u64])> {
    let touched = pairs
        .chunk_by(|a, b| a >> 42 == b >> 42)
        .map(|group| (group[0] >> 42, group));
    if filling.is_none() {
        return touched.collect();
    }
    let [_, ny, nz] = dims.map(|d| d.div_ceil(TILE) as u64);
    let mut touched = touched.peekable();
    (0..nz)
        .flat_map(|z| (0..ny).map(move |y| z << 10 | y))
        .map(|row| {
            touched
                .next_if(|(next, _)| *next == row)
                .unwrap_or((row, &[]))
        })
        .collect()
}
