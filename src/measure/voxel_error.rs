//! How far voxels are from the surface they stand for.
//!
//! Distances are measured by exact closest points, outsides by a flood fill, insides by winding
//! number: none of it is the code that set the voxels.

mod room;

use super::surface::{Elements, Surface};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, add, cross, length, scale, sub};
use crate::progress::Progress;
use crate::report::Accuracy;
use crate::spatial::aabb::Aabb;
use crate::spatial::bvh::Bvh;
use crate::spatial::local::LocalFrame;
use crate::volume::bits::BitGrid;
use crate::volume::octree::Octree;
use crate::volume::voxelize::{self, Fill, Lattice, Mode, Storage, touches};
use crate::volume::{Data, Volume};
use rayon::prelude::*;
use room::Room;
use schemars::JsonSchema;
use serde::Serialize;

/// Distance between samples of the surface, in voxels.
const SAMPLING: f64 = 1.0 / 8.0;
/// A sample is up to this many voxels beside the surface, by the rounding of its coordinates in a
/// grid of 2^16 voxels, and so is a distance of this size no distance.
const SAMPLE_ROUNDING: f64 = 1e-10;
/// Primitives per task.
const CHUNK: usize = 1024;

/// The measured error of a voxelization. Lengths are in voxels.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct VoxelError {
    /// Largest distance from the centre of a set voxel to the model (E1); 0 for centres inside of a
    /// filled one.
    pub to_surface_max: f64,
    /// Mean of the same.
    pub to_surface_mean: f64,
    /// Largest distance from a sample of the surface to the nearest set voxel (E2); null when none is
    /// set.
    pub from_surface_max: Option<f64>,
    /// Samples of the surface: no triangle has a point farther than 1/8 voxel from one.
    pub samples: u64,
    /// Triangles none of whose voxels is set (E3).
    pub missed_triangles: u64,
    /// Their share of the surface's area.
    pub missed_area: f64,
    /// Voxels whose centre is inside but that a flood from outside reaches through faces (E4); null
    /// for a surface that is open or not all in the grid.
    pub leaks: Option<u64>,
    /// Voxels that the surface sets by the rule used.
    pub surface_voxels: u64,
    /// Voxels that three-axis voxelization sets.
    pub three_axis_voxels: u64,
    /// Voxels that conservative voxelization sets.
    pub conservative_voxels: u64,
    /// Voxels that the rule used sets and conservative voxelization does not: 0, or a bug.
    pub not_conservative: u64,
}

/// Measures what [`voxelize::voxelize`] made of `mesh` with `params`.
///
/// Cost: a nearest-element search for every set voxel and, outside of them, for every sample of the
/// surface, of which there are about 64 to a voxel face. Memory: three to five more grids, a copy of
/// the mesh, and trees over its elements and over the runs of set voxels; [`crate::error::Error::Limit`] refuses
/// what of it would go over `params.max_memory`.
pub fn measure(
    mesh: &Mesh,
    made: &Volume,
    params: &voxelize::Params,
    lattice: &Lattice,
    progress: &dyn Progress,
) -> Result<VoxelError> {
    let again = |mode: Mode, fill: Fill| {
        let grid = if matches!(made.data, Data::Sparse(_)) {
            Storage::Sparse
        } else {
            Storage::Dense
        };
        let params = voxelize::Params {
            mode,
            fill,
            grid,
            ..params.clone()
        };
        voxelize::voxelize(mesh, &params, &crate::progress::Silent)
    };
    progress.stage("verify", 0);
    let room = Room::new(mesh, made, params, lattice)?;
    let (conservative, three_axis) = (
        again(Mode::Conservative, Fill::None)?.0,
        again(Mode::ThreeAxis, Fill::None)?.0,
    );
    let surface_only = match params.mode {
        Mode::Conservative | Mode::None => None,
        mode => Some(again(mode, Fill::None)?.0),
    };
    let by_rule = match params.mode {
        Mode::None => None,
        Mode::Conservative => Some(&conservative),
        _ => surface_only.as_ref(),
    };
    let solid = match params.fill {
        Fill::None => None,
        fill => Some(again(Mode::None, fill)?.0),
    };
    let grid_mesh = Mesh {
        positions: mesh
            .positions
            .par_iter()
            .map(|p| lattice.to_grid(*p))
            .collect(),
        triangles: mesh.triangles.clone(),
        segments: mesh.segments.clone(),
        points: mesh.points.clone(),
        ..Mesh::default()
    };
    let (to_surface_max, to_surface_mean) = to_surface(&grid_mesh, made, solid.as_ref())?;
    let (from_surface_max, samples) = from_surface(&grid_mesh, made, lattice.dims, &room)?;
    let (missed_triangles, missed_area) = missed(&grid_mesh, made, lattice.dims);
    let inside_grid = {
        let bounds = grid_mesh.bounds();
        (0..3).all(|a| bounds.lo[a] > 0.0 && bounds.hi[a] < lattice.dims[a] as f64)
    };
    let leaks = if inside_grid && !mesh.triangles.is_empty() {
        let (inside, stats) = again(Mode::None, Fill::Winding)?;
        let closed = stats.border_edges == Some(0);
        by_rule
            .filter(|_| closed)
            .map(|surface| leaks(surface, &inside))
    } else {
        None
    };
    let surface_voxels = by_rule.map_or(0, Volume::count_set);
    Ok(VoxelError {
        to_surface_max,
        to_surface_mean,
        from_surface_max,
        samples,
        missed_triangles,
        missed_area,
        leaks,
        surface_voxels,
        three_axis_voxels: three_axis.count_set(),
        conservative_voxels: conservative.count_set(),
        not_conservative: by_rule.map_or(0, |surface| outside_of(surface, &conservative)),
    })
}

impl VoxelError {
    /// The proven bounds with what was reached, and before the last the measures that have no bound
    /// but 0.
    ///
    /// `bounds` are those of [`voxelize::Stats::bounds`], for voxels of edge `h` in the mesh's unit.
    pub fn accuracy(&self, mut bounds: Vec<Accuracy>, h: f64) -> Vec<Accuracy> {
        let either_way = self
            .from_surface_max
            .map(|back| self.to_surface_max.max(back) * h);
        let reached = [Some(self.to_surface_max), self.from_surface_max, either_way];
        for (accuracy, reached) in bounds.iter_mut().zip(reached) {
            accuracy.reached = reached;
            accuracy.verified = reached.is_some();
        }
        let last = bounds.split_off(bounds.len().min(2));
        let closed = self.leaks.is_some();
        let conservative = bounds.get(1).is_some_and(|b| b.bound == Some(0.0));
        let mut count = |measure: &str,
                         unit: &str,
                         bound: Option<f64>,
                         reached: Option<u64>,
                         reference: &str| {
            bounds.push(Accuracy {
                measure: measure.to_owned(),
                unit: unit.to_owned(),
                bound,
                reached: reached.map(|n| n as f64),
                reference: reference.to_owned(),
                verified: reached.is_some(),
            });
        };
        let exact = "exact closed triangle-box test";
        let missed = Some(self.missed_triangles);
        count(
            "triangles none of whose voxels is set",
            "triangle",
            conservative.then_some(0.0),
            missed,
            exact,
        );
        let flood = "flood fill from outside against winding number";
        count(
            "voxels inside that a flood from outside reaches",
            "voxel",
            closed.then_some(0.0),
            self.leaks,
            flood,
        );
        count(
            "voxels that the surface does not touch",
            "voxel",
            Some(0.0),
            Some(self.not_conservative),
            exact,
        );
        bounds.extend(last);
        bounds
    }
}

/// The centres of the set voxels, a slice at a time.
fn centres(volume: &Volume, z: usize) -> Vec<Vec3> {
    let [nx, ny, _] = volume.frame.dims;
    let mut slice = BitGrid::new([nx, ny, 1]);
    volume.read_bit_slices(z, &mut slice);
    let mut found = Vec::new();
    for y in 0..ny {
        for (i, word) in slice.row(y, 0).iter().enumerate() {
            let mut rest = *word;
            while rest != 0 {
                let x = 64 * i + rest.trailing_zeros() as usize;
                found.push([x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5]);
                rest &= rest - 1;
            }
        }
    }
    found
}

/// E1: largest and mean distance from the centres of set voxels to the model.
fn to_surface(mesh: &Mesh, made: &Volume, solid: Option<&Volume>) -> Result<(f64, f64)> {
    if made.count_set() == 0 {
        return Ok((0.0, 0.0));
    }
    let elements = Elements::of(mesh, "to verify")?;
    let frame = LocalFrame::around(elements.bounds(mesh));
    let surface = Surface::new(mesh, elements, &frame);
    let [nx, ny, nz] = made.frame.dims;
    let (mut largest, mut sum, mut count) = (0.0f64, 0.0, 0u64);
    let mut filled = BitGrid::new([nx, ny, 1]);
    for z in 0..nz {
        let mut points = centres(made, z);
        count += points.len() as u64;
        if let Some(solid) = solid {
            solid.read_bit_slices(z, &mut filled);
            points.retain(|p| !filled.get(p[0] as usize, p[1] as usize, 0));
        }
        for hit in surface.nearest_of(&points, |p| frame.to_local(*p)) {
            let distance = frame.length(hit.distance);
            largest = largest.max(distance);
            sum += distance;
        }
    }
    Ok((largest, sum / count.max(1) as f64))
}

/// E2: largest distance from samples of the surface to the nearest set voxel, and their number.
///
/// Samples outside of the grid count for nothing: no voxel could be there.
fn from_surface(
    mesh: &Mesh,
    made: &Volume,
    dims: [usize; 3],
    room: &Room,
) -> Result<(Option<f64>, u64)> {
    let cells = cells(made, room)?;
    if cells.is_empty() {
        return Ok((None, 0));
    }
    let bvh = Bvh::build(cells.len() as u32, |i| cells[i as usize]);
    let count = mesh.triangles.len();
    let of_chunk = |chunk: usize| {
        let (mut worst, mut samples) = (0.0f64, 0);
        for t in chunk * CHUNK..((chunk + 1) * CHUNK).min(count) {
            for_each_sample(mesh.corners(t), &mut |p| {
                if (0..3).any(|a| p[a] < 0.0 || p[a] > dims[a] as f64) {
                    return;
                }
                samples += 1;
                // Looking only for what is nearer than needed settles most samples at the root.
                let found =
                    bvh.nearest(p, f64::INFINITY, |i| cells[i as usize].distance_squared(p));
                worst = worst.max(found.map_or(0.0, |n| n.distance_squared.sqrt()));
            });
        }
        (worst, samples)
    };
    let parts: Vec<(f64, u64)> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(of_chunk)
        .collect();
    let worst = parts.iter().fold(0.0f64, |m, p| m.max(p.0));
    let worst = if worst <= SAMPLE_ROUNDING { 0.0 } else { worst };
    Ok((Some(worst), parts.iter().map(|p| p.1).sum()))
}

/// The closed boxes of the set voxels, runs along x joined.
fn cells(made: &Volume, room: &Room) -> Result<Vec<Aabb>> {
    let [nx, ny, nz] = made.frame.dims;
    let mut slice = BitGrid::new([nx, ny, 1]);
    let mut found = Vec::new();
    for z in 0..nz {
        made.read_bit_slices(z, &mut slice);
        for y in 0..ny {
            for (x0, x1) in runs(slice.row(y, 0), nx, true) {
                let lo = [x0 as f64, y as f64, z as f64];
                found.push(Aabb {
                    lo,
                    hi: [x1 as f64, lo[1] + 1.0, lo[2] + 1.0],
                });
            }
        }
        room.expect(found.len())?;
    }
    Ok(found)
}

/// The runs `x0..x1` of bits that are set, or not, in a row of `nx`.
fn runs(row: &[u64], nx: usize, set: bool) -> Vec<(u32, u32)> {
    let mut found: Vec<(u32, u32)> = Vec::new();
    for (i, word) in row.iter().enumerate() {
        let mut rest = if set { *word } else { !word };
        let base = 64 * i;
        if base + 64 > nx {
            rest &= u64::MAX >> (base + 64 - nx);
        }
        while rest != 0 {
            let start = rest.trailing_zeros() as usize;
            let length = (!(rest >> start)).trailing_zeros() as usize;
            let (x0, x1) = ((base + start) as u32, (base + start + length) as u32);
            match found.last_mut().filter(|run| run.1 == x0) {
                Some(run) => run.1 = x1,
                None => found.push((x0, x1)),
            }
            rest = if start + length >= 64 {
                0
            } else {
                rest & u64::MAX << (start + length)
            };
        }
    }
    found
}

/// Points of a triangle such that none is farther than [`SAMPLING`] from one of them.
fn for_each_sample(corners: [Vec3; 3], f: &mut impl FnMut(Vec3)) {
    let [a, b, c] = corners;
    let (u, v) = (sub(b, a), sub(c, a));
    let longest = length(u).max(length(v)).max(length(sub(c, b)));
    let steps = (longest / SAMPLING).ceil().clamp(1.0, 1e6) as u32;
    for i in 0..=steps {
        for j in 0..=steps - i {
            let (s, t) = (
                f64::from(i) / f64::from(steps),
                f64::from(j) / f64::from(steps),
            );
            f(add(a, add(scale(u, s), scale(v, t))));
        }
    }
}

/// E3: triangles none of whose voxels is set, and their share of the area.
fn missed(mesh: &Mesh, made: &Volume, dims: [usize; 3]) -> (u64, f64) {
    let held = Held::of(made);
    let count = mesh.triangles.len();
    let parts: Vec<(u64, f64, f64)> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let (mut missed, mut area, mut all) = (0, 0.0, 0.0);
            for t in chunk * CHUNK..((chunk + 1) * CHUNK).min(count) {
                let corners @ [a, b, c] = mesh.corners(t);
                let size = length(cross(sub(b, a), sub(c, a)));
                all += size;
                if !has_set_voxel(&corners, &held, dims) {
                    missed += 1;
                    area += size;
                }
            }
            (missed, area, all)
        })
        .collect();
    let (missed, area, all) = parts
        .iter()
        .fold((0, 0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1, s.2 + p.2));
    (missed, if all > 0.0 { area / all } else { 0.0 })
}

/// Whether one of the voxels that a triangle touches is set; true for one outside of the grid.
fn has_set_voxel(corners: &[Vec3; 3], held: &Held, dims: [usize; 3]) -> bool {
    let bounds = Aabb::around(corners);
    if (0..3).any(|a| bounds.hi[a] < 0.0 || bounds.lo[a] > dims[a] as f64) {
        return true;
    }
    let range: [(i32, i32); 3] = std::array::from_fn(|a| {
        (
            (bounds.lo[a].ceil() as i32 - 1).max(0),
            (bounds.hi[a].floor() as i32).min(dims[a] as i32 - 1),
        )
    });
    let mut touched = false;
    for z in range[2].0..=range[2].1 {
        for y in range[1].0..=range[1].1 {
            for x in range[0].0..=range[0].1 {
                let set = held.get(x as usize, y as usize, z as usize);
                if (set || !touched) && touches(corners, [x, y, z], 1) {
                    if set {
                        return true;
                    }
                    touched = true;
                }
            }
        }
    }
    !touched
}

/// The bits of a volume, however it holds them.
enum Held<'a> {
    Dense(&'a BitGrid),
    Sparse(&'a Octree),
    Neither,
}

impl<'a> Held<'a> {
    fn of(volume: &'a Volume) -> Self {
        match &volume.data {
            Data::Bits(grid) => Held::Dense(grid),
            Data::Sparse(tree) => Held::Sparse(tree),
            _ => Held::Neither,
        }
    }

    fn get(&self, x: usize, y: usize, z: usize) -> bool {
        match self {
            Held::Dense(grid) => grid.get(x, y, z),
            Held::Sparse(tree) => tree.get(x, y, z),
            Held::Neither => false,
        }
    }
}

/// Number of voxels set in `a` and not in `b`.
fn outside_of(a: &Volume, b: &Volume) -> u64 {
    let [nx, ny, nz] = a.frame.dims;
    let (mut of_a, mut of_b) = (BitGrid::new([nx, ny, 1]), BitGrid::new([nx, ny, 1]));
    let mut count = 0;
    for z in 0..nz {
        a.read_bit_slices(z, &mut of_a);
        b.read_bit_slices(z, &mut of_b);
        count += of_a
            .words()
            .iter()
            .zip(of_b.words())
            .map(|(a, b)| u64::from((a & !b).count_ones()))
            .sum::<u64>();
    }
    count
}

/// E4: voxels of `inside` that a flood from outside reaches through faces of voxels that are not set
/// in `surface`.
///
/// Free runs along x are joined with those they touch in the rows before; what is joined with a run
/// at the border of the grid is outside. Cost: in the rows and the runs.
fn leaks(surface: &Volume, inside: &Volume) -> u64 {
    let [nx, ny, nz] = surface.frame.dims;
    let mut slice = BitGrid::new([nx, ny, 1]);
    // Set 0 is the outside.
    let mut sets: Vec<u32> = vec![0];
    let mut rows: Vec<Vec<(u32, u32)>> = Vec::with_capacity(ny * nz);
    let mut firsts: Vec<u32> = Vec::with_capacity(ny * nz);
    for z in 0..nz {
        surface.read_bit_slices(z, &mut slice);
        for y in 0..ny {
            let free = runs(slice.row(y, 0), nx, false);
            let first = sets.len() as u32;
            sets.extend(first..first + free.len() as u32);
            for (i, run) in free.iter().enumerate() {
                if run.0 == 0
                    || run.1 as usize == nx
                    || y == 0
                    || z == 0
                    || y + 1 == ny
                    || z + 1 == nz
                {
                    join(&mut sets, 0, first + i as u32);
                }
            }
            let row = z * ny + y;
            for before in [(y > 0).then(|| row - 1), (z > 0).then(|| row - ny)]
                .into_iter()
                .flatten()
            {
                let (mut i, mut j) = (0, 0);
                while i < free.len() && j < rows[before].len() {
                    let (a, b) = (free[i], rows[before][j]);
                    if a.0 < b.1 && b.0 < a.1 {
                        join(&mut sets, first + i as u32, firsts[before] + j as u32);
                    }
                    if a.1 <= b.1 {
                        i += 1;
                    } else {
                        j += 1;
                    }
                }
            }
            rows.push(free);
            firsts.push(first);
        }
    }
    let mut leaks = 0;
    for z in 0..nz {
        inside.read_bit_slices(z, &mut slice);
        for y in 0..ny {
            let row = z * ny + y;
            for (i, run) in rows[row].iter().enumerate() {
                if find(&mut sets, firsts[row] + i as u32) == 0 {
                    leaks += (run.0..run.1)
                        .filter(|x| slice.get(*x as usize, y, 0))
                        .count() as u64;
                }
            }
        }
    }
    leaks
}

fn find(sets: &mut [u32], mut at: u32) -> u32 {
    while sets[at as usize] != at {
        let up = sets[sets[at as usize] as usize];
        sets[at as usize] = up;
        at = up;
    }
    at
}

fn join(sets: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(sets, a), find(sets, b));
    sets[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests;
