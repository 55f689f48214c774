//! How far voxels are from the surface they stand for.
//!
//! What is measured is the grid as it was made, by other code than set its voxels: distances by exact
//! closest points, touch by the closed triangle-box test for each voxel alone, insides by solid
//! angles, outsides by a flood fill. Three things are shared with
//! the voxelizer and not judged here: the way from file to grid coordinates, the triangle-box test
//! itself, and which way round a fill takes the triangles. The leaks (E4) of a grid take the inside
//! from filling again, and those of a filled one its surface voxels too; the plain numbers of
//! voxels of other modes come from voxelizing again.

mod room;

use super::surface::{Elements, Surface};
use crate::error::{Error, Fault, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, add, cross, length, scale, sub};
use crate::progress::Progress;
use crate::report::Accuracy;
use crate::spatial::aabb::Aabb;
use crate::spatial::bvh::Bvh;
use crate::spatial::local::LocalFrame;
use crate::volume::bits::BitGrid;
use crate::volume::octree::Octree;
use crate::volume::voxelize::{self, Fill, Lattice, Mode, Orientation, Storage, touches};
use crate::volume::{Data, Volume};
use rayon::prelude::*;
use room::Room;
use schemars::JsonSchema;
use serde::Serialize;

mod filled;

use filled::{Inside, missed_inside};

/// Distance between samples of the surface, in voxels.
const SAMPLING: f64 = 1.0 / 8.0;
/// A sample is up to this many voxels beside the surface, by the rounding of its coordinates in a
/// grid of 2^16 voxels, and so is a distance of this size no distance.
const SAMPLE_ROUNDING: f64 = 1e-10;
/// The voxels on the surface of a ball within a voxel, and around one.
const WITHIN: f64 = 0.5;
const AROUND: f64 = 0.866_025_403_784_438_6;
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
    /// Largest distance from a sample of the model to the nearest set voxel (E2): of its triangles,
    /// segments and points, and of the inside of a filled one; null when no voxel is set or no sample
    /// lies in the grid.
    pub from_surface_max: Option<f64>,
    /// Samples of triangles, segments and points in the grid: none of these has a point farther than
    /// 1/8 voxel from one.
    pub samples: u64,
    /// Sampled voxels of a filled grid, of 65536 drawn evenly from all with seed 0, whose centre is
    /// inside by its winding number; null without a fill.
    pub inside_samples: Option<u64>,
    /// Those of them that are not set: 0, or a bug; null without a fill.
    pub inside_missed: Option<u64>,
    /// Triangles none of whose voxels is set (E3).
    pub missed_triangles: u64,
    /// Their share of the surface's area; null for a model without triangles.
    pub missed_area: Option<f64>,
    /// Voxels whose centre is inside but that a flood from outside reaches through faces (E4); null
    /// for a surface that is open or not all in the grid.
    pub leaks: Option<u64>,
    /// Set voxels; of a filled grid those that the surface sets again by the rule used.
    pub surface_voxels: u64,
    /// Voxels that three-axis voxelization sets.
    pub three_axis_voxels: u64,
    /// Voxels that conservative voxelization sets.
    pub conservative_voxels: u64,
    /// Set voxels that no part of the model touches and, of a filled one, whose centre is not inside.
    pub not_conservative: u64,
}

/// Measures what [`voxelize::voxelize`] made of `mesh` with `params`, on the `lattice` and with the
/// `orientation` that its figures name.
///
/// Errs as voxelizing does, for set voxels of a mesh without elements, and with
/// [`crate::error::Error::Limit`] where it would go over `params.max_memory`. Cost: a nearest-element
/// search for every set voxel and, outside of them, for every sample of the surface, of which there
/// are about 64 to a voxel face; a winding number for every set voxel and sample of a filled grid.
/// Memory: three to four more grids, a copy of the mesh, and trees over its elements and over the
/// runs of set voxels.
pub fn measure(
    mesh: &Mesh,
    made: &Volume,
    params: &voxelize::Params,
    lattice: &Lattice,
    orientation: &Orientation,
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
    let surface_only = match (params.mode, params.fill) {
        (Mode::None, _) | (_, Fill::None) => None,
        (mode, _) => Some(again(mode, Fill::None)?.0),
    };
    let by_rule = match (params.mode, params.fill) {
        (Mode::None, _) => None,
        (_, Fill::None) => Some(made),
        _ => surface_only.as_ref(),
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
    let inside = Inside::of(&grid_mesh, params.fill, orientation);
    let there = to_surface(&grid_mesh, made, inside.as_ref())?;
    let cells = Cells::of(made, &room)?;
    let (mut from_surface_max, samples) = from_surface(&grid_mesh, &cells, lattice.dims);
    let filled = inside.map(|inside| missed_inside(&grid_mesh, made, &cells, &inside));
    if let Some(filled) = filled.as_ref().filter(|filled| filled.samples > 0) {
        from_surface_max = match (from_surface_max, filled.farthest) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
    }
    let (missed_triangles, missed_area) = missed(&grid_mesh, made, lattice.dims);
    let inside_grid = {
        let bounds = grid_mesh.used_bounds();
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
        to_surface_max: there.max,
        to_surface_mean: there.mean,
        from_surface_max,
        samples,
        inside_samples: filled.as_ref().map(|filled| filled.samples),
        inside_missed: filled.as_ref().map(|filled| filled.missed),
        missed_triangles,
        missed_area,
        leaks,
        surface_voxels,
        three_axis_voxels: three_axis.count_set(),
        conservative_voxels: conservative.count_set(),
        not_conservative: there.untouched,
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
        let proven = bounds.first().is_some_and(|first| first.bound.is_some());
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
        // Of a model without triangles none can be missed.
        let missed = self.missed_area.map(|_| self.missed_triangles);
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
            proven.then_some(0.0),
            Some(self.not_conservative),
            if self.inside_missed.is_some() {
                "exact closed triangle-box test, and winding number inside"
            } else {
                exact
            },
        );
        if let Some(missed) = self.inside_missed {
            count(
                "sampled voxels inside that are not set",
                "voxel",
                proven.then_some(0.0),
                Some(missed),
                "winding number at 65536 voxels drawn with seed 0",
            );
        }
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

/// E1, and the set voxels that are neither touched nor inside.
#[derive(Default)]
struct There {
    max: f64,
    mean: f64,
    untouched: u64,
}

/// Distances from the centres of set voxels to the model.
fn to_surface(mesh: &Mesh, made: &Volume, inside: Option<&Inside>) -> Result<There> {
    if made.count_set() == 0 {
        return Ok(There::default());
    }
    let elements = Elements::all_of(mesh);
    if elements.corners.is_empty() {
        let problem = "voxels are set, but the model has nothing that could set them";
        return Err(Error::Geometry(Fault::whole(problem)));
    }
    let frame = LocalFrame::around(elements.bounds(mesh));
    let surface = Surface::new(mesh, elements, &frame);
    let touched = |p: Vec3| {
        let local = [-WITHIN, WITHIN].map(|w| frame.to_local(p.map(|c| c + w)));
        let at = p.map(|c| c.floor() as i32);
        surface.any_overlapping(&Aabb::around(&local), |element| {
            let corners = surface.indices[element as usize];
            touches(&corners.map(|v| mesh.positions[v as usize]), at, 1)
        })
    };
    let mut found = There::default();
    let (mut sum, mut count) = (0.0, 0u64);
    for z in 0..made.frame.dims[2] {
        let points = centres(made, z);
        count += points.len() as u64;
        let hits = surface.nearest_of(&points, |p| frame.to_local(*p));
        let judged: Vec<(f64, bool)> = points
            .par_iter()
            .zip(&hits)
            .map(|(p, hit)| {
                let distance = frame.length(hit.distance);
                if inside.is_some_and(|inside| inside.holds(*p, true)) {
                    return (0.0, false);
                }
                let near = distance <= WITHIN - SAMPLE_ROUNDING;
                let far = distance > AROUND + SAMPLE_ROUNDING;
                (distance, far || !near && !touched(*p))
            })
            .collect();
        for (distance, untouched) in judged {
            found.max = found.max.max(distance);
            sum += distance;
            found.untouched += u64::from(untouched);
        }
    }
    found.mean = sum / count.max(1) as f64;
    Ok(found)
}

/// The closed boxes of the set voxels, to be searched.
struct Cells {
    boxes: Vec<Aabb>,
    bvh: Bvh,
}

impl Cells {
    fn of(made: &Volume, room: &Room) -> Result<Self> {
        let boxes = cells(made, room)?;
        let bvh = Bvh::build(boxes.len() as u32, |i| boxes[i as usize]);
        Ok(Cells { boxes, bvh })
    }

    /// The distance to the nearest set voxel; none where none is set.
    fn distance(&self, p: Vec3) -> Option<f64> {
        let to = |i: u32| self.boxes[i as usize].distance_squared(p);
        let found = self.bvh.nearest(p, f64::INFINITY, to);
        found.map(|nearest| nearest.distance_squared.sqrt())
    }
}

/// E2: largest distance from samples of the elements to the nearest set voxel, and their number.
///
/// Samples outside of the grid count for nothing: no voxel could be there.
fn from_surface(mesh: &Mesh, cells: &Cells, dims: [usize; 3]) -> (Option<f64>, u64) {
    let (triangles, segments) = (mesh.triangles.len(), mesh.segments.len());
    let count = triangles + segments + mesh.points.len();
    let at = |v: u32| mesh.positions[v as usize];
    let of_chunk = |chunk: usize| {
        let (mut worst, mut samples) = (0.0f64, 0);
        let mut judge = |p: Vec3| {
            if (0..3).any(|a| p[a] < 0.0 || p[a] > dims[a] as f64) {
                return;
            }
            samples += 1;
            worst = worst.max(cells.distance(p).unwrap_or(0.0));
        };
        for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(count) {
            if i < triangles {
                for_each_sample(mesh.corners(i), &mut judge);
            } else if i < triangles + segments {
                for_each_sample_between(mesh.segments[i - triangles].map(at), &mut judge);
            } else {
                judge(at(mesh.points[i - triangles - segments]));
            }
        }
        (worst, samples)
    };
    let parts: Vec<(f64, u64)> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(of_chunk)
        .collect();
    let worst = parts.iter().fold(0.0f64, |m, p| m.max(p.0));
    let samples = parts.iter().map(|p| p.1).sum();
    if samples == 0 || cells.boxes.is_empty() {
        return (None, samples);
    }
    (
        Some(if worst <= SAMPLE_ROUNDING { 0.0 } else { worst }),
        samples,
    )
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

/// Points of a segment such that none is farther than [`SAMPLING`] from one of them.
fn for_each_sample_between([a, b]: [Vec3; 2], f: &mut impl FnMut(Vec3)) {
    let way = sub(b, a);
    let steps = (length(way) / SAMPLING).ceil().clamp(1.0, 1e6) as u32;
    for i in 0..=steps {
        f(add(a, scale(way, f64::from(i) / f64::from(steps))));
    }
}

/// E3: triangles none of whose voxels is set, and their share of the area.
fn missed(mesh: &Mesh, made: &Volume, dims: [usize; 3]) -> (u64, Option<f64>) {
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
    let share = if all > 0.0 { area / all } else { 0.0 };
    (missed, (count > 0).then_some(share))
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
