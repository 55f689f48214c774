//! How far a result is from where it should be.

use super::motion::Motion;
use crate::anim::Clip;
use crate::error::Result;
use crate::image::samples::Image;
use crate::measure::animation_error::animation_error;
use crate::measure::{image_difference, mesh_distance};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::progress::Silent;
use crate::spatial::aabb::Aabb;
use crate::spatial::bvh::Bvh;
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Frame, Volume};
use crate::with_samples;
use rayon::prelude::*;

/// How far a result drifted. Lengths are in the unit of the untouched input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Voxels set in one result and not in the other; `None` where results have no voxels.
    pub differing: Option<u64>,
    /// Largest distance from something in one result to the nearest in the other; `None` where one
    /// of both is empty and the other is not. For pictures and animations in the unit of their error.
    pub distance: Option<f64>,
    /// How far the whole stands from where it should: what the rounding of a grid's origin moves it
    /// by. Not part of `distance`.
    pub place: f64,
}

impl Drift {
    /// That of nothing from nothing.
    pub const NONE: Drift = Drift {
        differing: None,
        distance: Some(0.0),
        place: 0.0,
    };

    /// That of something from nothing, or the reverse: no distance tells it.
    pub const ALL: Drift = Drift {
        distance: None,
        ..Drift::NONE
    };
}

/// How far voxels drifted: `changed` is what became of the input moved by `motion`.
///
/// A voxel of one grid is compared with the voxel of the other that holds its centre, moved along;
/// both ways. Numbers other than 0 count as set. Cost: linear in the voxels that are set, and a search
/// for each that differs.
pub fn volume_drift(reference: &Volume, changed: &Volume, motion: &Motion) -> Drift {
    let there = Alignment::between(&reference.frame, &changed.frame, motion, true);
    let back = Alignment::between(&changed.frame, &reference.frame, motion, false);
    let edge = length(reference.frame.axes[0]);
    let forth = one_way(reference, changed, &there);
    let again = one_way(changed, reference, &back);
    let largest = match (forth.farthest, again.farthest) {
        (Some(a), Some(b)) => Some(a.max(b) * edge),
        _ => None,
    };
    Drift {
        differing: Some(forth.missing + again.missing),
        distance: largest,
        place: there.off_grid(reference.frame.dims) * edge,
    }
}

/// How far a mesh drifted: `changed` is what became of the input moved by `motion`.
///
/// Errs where a mesh has no vertices. Cost: that of [`mesh_distance::compare`].
pub fn mesh_drift(reference: &Mesh, changed: &Mesh, motion: &Motion) -> Result<Drift> {
    let mut undone = changed.clone();
    let positions = &mut undone.positions;
    positions.iter_mut().for_each(|p| *p = motion.undo(*p));
    let params = mesh_distance::Params::DEFAULT;
    let difference = mesh_distance::compare(reference, &undone, &params, &Silent)?;
    Ok(Drift {
        differing: None,
        distance: Some(difference.hausdorff),
        place: 0.0,
    })
}

/// How far a picture drifted, which is to stay as it is: the largest difference of a channel, where
/// 1 is full, in place of a distance.
///
/// Errs where the pictures are of different sizes. Cost: that of [`image_difference::compare`].
pub fn image_drift(reference: &Image, changed: &Image) -> Result<Drift> {
    let difference = image_difference::compare(reference, changed, &Silent)?;
    Ok(Drift {
        differing: None,
        distance: Some(difference.max / 255.0),
        place: 0.0,
    })
}

/// How far an animation drifted: `changed` is what became of the input moved by `motion`, its vertices
/// those of the reference that `order` names. In percent of frames drawn together to their centroids, in
/// place of a distance; see [`animation_error`]. It is `None` where those have no extent and there is a
/// drift.
///
/// Errs where the animations have not as many vertices and frames. Cost: linear.
pub fn clip_drift(
    reference: &Clip,
    changed: &Clip,
    motion: &Motion,
    order: Option<&[usize]>,
) -> Result<Drift> {
    let undone = changed.positions.iter().map(|p| motion.undo(*p)).collect();
    let undone = Clip::cloud(changed.vertices(), undone, changed.start, changed.rate);
    let error = match order {
        None => animation_error(reference, &undone)?,
        Some(order) => {
            let frames = (0..reference.frames()).map(|f| reference.frame(f));
            let positions = frames.flat_map(|at| order.iter().map(|v| at[*v])).collect();
            let there = Clip::cloud(order.len(), positions, reference.start, reference.rate);
            animation_error(&there, &undone)?
        }
    };
    Ok(Drift {
        distance: error.kg_centroid_percent,
        ..Drift::NONE
    })
}

/// The way from the indices of one grid to those of another: `offset + i columns`.
struct Alignment {
    columns: [Vec3; 3],
    offset: Vec3,
}

impl Alignment {
    /// From indices of `from` to those of `to`, which stands where the motion moves it, or, where
    /// not `along`, whence.
    fn between(from: &Frame, to: &Frame, motion: &Motion, along: bool) -> Self {
        let inverse = Motion {
            turn: std::array::from_fn(|i| std::array::from_fn(|j| motion.turn[j][i])),
            exponent: -motion.exponent,
            shift: [0.0; 3],
        };
        // The shift is taken off the far side, where it is exact or nearly so, before anything else.
        let (linear, gap) = if along {
            let still = Motion {
                shift: [0.0; 3],
                ..*motion
            };
            let gap = sub(still.apply(from.origin), sub(to.origin, motion.shift));
            (still, gap)
        } else {
            let near = inverse.apply(sub(from.origin, motion.shift));
            (inverse, sub(near, to.origin))
        };
        let index = |v: Vec3| -> Vec3 {
            // Lengths are divided out before products are made: spacings may be tiny or huge.
            let unit = to.axes.map(normalize);
            std::array::from_fn(|i| {
                let normal = cross(unit[(i + 1) % 3], unit[(i + 2) % 3]);
                let local = v.map(|c| c / length(to.axes[i]));
                dot(local, normal) / dot(unit[i], normal)
            })
        };
        Alignment {
            columns: from.axes.map(|axis| index(linear.apply(axis))),
            offset: index(gap),
        }
    }

    fn at(&self, i: Vec3) -> Vec3 {
        (0..3).fold(self.offset, |at, a| add(at, scale(self.columns[a], i[a])))
    }

    /// How far corners of the first grid are from centres of the other, in voxels.
    fn off_grid(&self, dims: [usize; 3]) -> f64 {
        let corner = |corner: usize| {
            let last = |a: usize| (corner >> a & 1) as f64 * dims[a].saturating_sub(1) as f64;
            let at = self.at([last(0), last(1), last(2)]);
            length(at.map(|c| c - c.round()))
        };
        (0..8).map(corner).fold(0.0, f64::max)
    }
}

struct OneWay {
    /// Voxels of the first that are not set in the other.
    missing: u64,
    /// The largest distance from one of those to the nearest that is set, in voxels; `None` where
    /// none is.
    farthest: Option<f64>,
}

fn one_way(from: &Volume, to: &Volume, alignment: &Alignment) -> OneWay {
    let [nx, ny, nz] = from.frame.dims;
    let missing: Vec<Vec<Vec3>> = (0..nz)
        .into_par_iter()
        .map(|z| {
            let mut slice = BitGrid::new([nx, ny, 1]);
            from.read_bit_slices(z, &mut slice);
            let mut missing = Vec::new();
            for y in 0..ny {
                for x in (0..nx).filter(|x| slice.get(*x, y, 0)) {
                    let at = alignment.at([x as f64, y as f64, z as f64]);
                    if !is_set(to, at.map(f64::round)) {
                        missing.push(at);
                    }
                }
            }
            missing
        })
        .collect();
    let count = missing.iter().map(Vec::len).sum::<usize>() as u64;
    let farthest = if count == 0 {
        Some(0.0)
    } else {
        farthest(&missing, to)
    };
    OneWay {
        missing: count,
        farthest,
    }
}

/// The largest distance in voxels from one of some places to the centre of the nearest voxel that
/// is set; `None` where none is.
fn farthest(places: &[Vec<Vec3>], to: &Volume) -> Option<f64> {
    let runs = runs(to);
    if runs.is_empty() {
        return None;
    }
    let bvh = Bvh::build(runs.len() as u32, |i| runs[i as usize]);
    let of_slice = |places: &Vec<Vec3>| {
        let to_nearest = |p: &Vec3| {
            let found = bvh.nearest(*p, f64::INFINITY, |i| {
                let run = runs[i as usize];
                let x = p[0].round().clamp(run.lo[0], run.hi[0]);
                let d = sub([x, run.lo[1], run.lo[2]], *p);
                dot(d, d)
            });
            found.map_or(0.0, |hit| hit.distance_squared.sqrt())
        };
        places.iter().map(to_nearest).fold(0.0, f64::max)
    };
    let parts: Vec<f64> = places.par_iter().map(of_slice).collect();
    Some(parts.into_iter().fold(0.0, f64::max))
}

/// The runs of set voxels along x, each as the box from its first index to its last.
fn runs(volume: &Volume) -> Vec<Aabb> {
    let [nx, ny, nz] = volume.frame.dims;
    let mut slice = BitGrid::new([nx, ny, 1]);
    let mut runs: Vec<Aabb> = Vec::new();
    for z in 0..nz {
        volume.read_bit_slices(z, &mut slice);
        for y in 0..ny {
            for x in (0..nx).filter(|x| slice.get(*x, y, 0)) {
                let at = [x as f64, y as f64, z as f64];
                let before = [at[0] - 1.0, at[1], at[2]];
                match runs.last_mut().filter(|run| run.hi == before) {
                    Some(run) => run.hi = at,
                    None => runs.push(Aabb { lo: at, hi: at }),
                }
            }
        }
    }
    runs
}

/// Whether the voxel of these indices, which are whole numbers, is there and set.
fn is_set(volume: &Volume, at: Vec3) -> bool {
    let [nx, ny, _] = volume.frame.dims;
    if !(0..3).all(|a| at[a] >= 0.0 && at[a] < volume.frame.dims[a] as f64) {
        return false;
    }
    let [x, y, z] = at.map(|c| c as usize);
    with_samples!(&volume.data, v => v[(z * ny + y) * nx + x] as f64 != 0.0, bits => match bits {
        Data::Bits(grid) => grid.get(x, y, z),
        Data::Sparse(tree) => tree.get(x, y, z),
        _ => false,
    })
}
