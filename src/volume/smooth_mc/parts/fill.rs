//! What is enclosed is brought to what the voxels hold.

use super::{CHUNK, FARTHEST, Parts, Sum, single};
use crate::numeric::vector::{Vec3, sub};
use crate::volume::isosurface::Surface;
use crate::volume::smooth_mc::fair::Fair;
use crate::volume::smooth_mc::region::Region;
use rayon::prelude::*;
use std::borrow::Cow;
use wide::f32x4;

/// What is enclosed is held to this share, where the regions allow it.
const CLOSE: f64 = 5e-5;

/// A part is left where a round brings it no closer than this share.
const GAIN: f64 = 0.95;

/// What is asked of a part that stays behind is at most so many times what it misses.
const MOST_BEHIND: f64 = 8.0;

/// Most rounds of filling.
const ROUNDS: usize = 20;

/// A part that keeps less than this share of what marching cubes encloses is put back before it is filled.
const COLLAPSED: f64 = 0.5;

impl Parts {
    /// Moves each part along its normals until it encloses its voxels, as far as the regions let it.
    /// Returns what each part encloses then, in voxels.
    ///
    /// `kept` is what marching cubes encloses, where nothing may vanish: parts that lost most of it, having
    /// turned over or gone flat, have no normals to follow, and start from there.
    ///
    /// Vertices at the ends of their regions follow less than the others, so that each round asks for
    /// more by as much as the part stayed behind in the last one. A round costs a pass over the triangles
    /// of the parts that are not filled.
    pub(in crate::volume::smooth_mc) fn fill(
        &self,
        surface: &Surface,
        triangles: &[[u32; 3]],
        metric: Vec3,
        regions: &(dyn Fn(usize) -> Region + Sync),
        kept: Option<&[f64]>,
        offsets: &mut [Vec3],
    ) -> Vec<f64> {
        let voxel = metric[0] * metric[1] * metric[2];
        let mut parts: Vec<Filling> = vec![Filling::default(); self.len()];
        let mut around = Cow::Borrowed(triangles);
        let mut placed = self.placed(surface, metric, &|v| offsets[v]);
        let mut normals = Vec::new();
        for round in 0..=ROUNDS {
            let sums = self.sum_placed(surface, &around, &placed);
            for (part, (filling, sum)) in parts.iter_mut().zip(&sums).enumerate() {
                let wanted = self.voxels[part].map(|v| v as f64 * voxel);
                // Where labels meet, both sides ask and hinder each other.
                filling.round(sum, wanted, self.outside.is_empty());
            }
            if let (0, Some(kept), true) = (round, kept, self.outside.is_empty()) {
                self.put_back(&mut parts, kept, metric, &mut placed, offsets);
            }
            if round == ROUNDS || !parts.iter().any(|part| part.open) {
                break;
            }
            let moves = |v: usize| {
                let (inside, outside) = self.sides(v);
                parts[inside].open || outside.is_some_and(|part| parts[part].open)
            };
            let left = |(part, size): (usize, &u64)| if parts[part].open { *size } else { 0 };
            let left: u64 = self.sizes.iter().enumerate().map(left).sum();
            // There are two triangles for each vertex; to copy them pays where many are dropped.
            if 4 * left < around.len() as u64 {
                // With labels, what is left on one side may be open on the other.
                let of = |t: &&[u32; 3]| t.iter().any(|v| moves(*v as usize));
                let rest = around.par_iter().with_min_len(CHUNK).filter(of).copied();
                around = Cow::Owned(rest.collect());
            }
            if normals.is_empty() {
                normals = normals_of(surface, metric, regions, offsets);
            }
            let by = |v: usize| {
                let (inside, outside) = self.sides(v);
                parts[inside].by() - outside.map_or(0.0, |part| parts[part].by())
            };
            offsets
                .par_iter_mut()
                .zip(&mut placed)
                .zip(&normals)
                .enumerate()
                .with_min_len(CHUNK)
                .filter(|(v, _)| moves(*v))
                .for_each(|(v, ((offset, placed), normal))| {
                    let by = by(v);
                    let wanted = |a: usize| offset[a] + f64::from(normal[a]) * by / metric[a];
                    let moved = regions(v).project(std::array::from_fn(wanted), metric);
                    let d = sub(moved, *offset);
                    for a in 0..3 {
                        placed[a] += d[a] * metric[a];
                    }
                    *offset = moved;
                });
        }
        if self.outside.is_empty() {
            parts.iter().map(|part| part.volume / voxel).collect()
        } else {
            // The sums of labels that were left are not whole.
            self.enclosed_by(surface, triangles, |v| offsets[v])
        }
    }

    /// Puts parts that have collapsed back to where marching cubes has them.
    fn put_back(
        &self,
        parts: &mut [Filling],
        kept: &[f64],
        metric: Vec3,
        placed: &mut [Vec3],
        offsets: &mut [Vec3],
    ) {
        let voxel = metric[0] * metric[1] * metric[2];
        let mut any = false;
        for (part, (filling, kept)) in parts.iter_mut().zip(kept).enumerate() {
            if let Some(voxels) = self.voxels[part] {
                filling.collapsed = filling.volume * kept.signum() < COLLAPSED * kept.abs() * voxel;
                if filling.collapsed {
                    filling.restart(kept * voxel, voxels as f64 * voxel);
                    any = true;
                }
            }
        }
        if any {
            let collapsed = |v: usize| parts[self.of[v] as usize].collapsed;
            let all = offsets.par_iter_mut().zip(placed).enumerate();
            all.with_min_len(CHUNK)
                .filter(|(v, _)| collapsed(*v))
                .for_each(|(_, (offset, placed))| {
                    for a in 0..3 {
                        placed[a] -= offset[a] * metric[a];
                    }
                    *offset = [0.0; 3];
                });
        }
    }
}

/// The outward direction at each vertex.
fn normals_of(
    surface: &Surface,
    metric: Vec3,
    regions: &(dyn Fn(usize) -> Region + Sync),
    offsets: &[Vec3],
) -> Vec<[f32; 3]> {
    let fair = Fair::new(surface, metric, 0.5, regions);
    let at: Vec<f32x4> = offsets
        .par_iter()
        .with_min_len(CHUNK)
        .map(|o| single(*o, metric))
        .collect();
    let normal = |v: usize| {
        let [x, y, z, _] = fair.normal(&at, v).to_array();
        [x, y, z]
    };
    (0..surface.len())
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(normal)
        .collect()
}

/// How a part is filled.
#[derive(Debug, Clone, Copy)]
struct Filling {
    open: bool,
    /// Whether it was put back.
    collapsed: bool,
    /// What it encloses.
    volume: f64,
    /// How much is missing.
    missing: f64,
    /// How far it was asked to move.
    by: f64,
    /// What that would enclose more, if all its vertices went so far.
    asked: f64,
}

impl Default for Filling {
    fn default() -> Self {
        Filling {
            open: true,
            collapsed: false,
            volume: 0.0,
            missing: f64::INFINITY,
            by: 0.0,
            asked: 0.0,
        }
    }
}

impl Filling {
    /// How far the part is to be moved outwards.
    fn by(&self) -> f64 {
        if self.open { self.by } else { 0.0 }
    }

    /// It was put back, where it encloses `volume`. One that small is moved as far as may be at once.
    fn restart(&mut self, volume: f64, wanted: f64) {
        let missing = wanted - volume;
        self.open = missing.abs() > CLOSE * wanted.abs();
        self.volume = volume;
        self.missing = missing;
        self.by = FARTHEST.copysign(missing);
        self.asked = 0.0;
    }

    /// After a round, which brought it to `sum`; `alone` where no part hinders another.
    fn round(&mut self, sum: &Sum, wanted: Option<f64>, alone: bool) {
        if !self.open {
            // No longer summed.
            return;
        }
        let gained = sum.volume - self.volume;
        self.volume = sum.volume;
        let wanted = wanted.unwrap_or(sum.volume);
        let missing = wanted - sum.volume;
        self.open =
            missing.abs() > CLOSE * wanted.abs() && missing.abs() < GAIN * self.missing.abs();
        self.missing = missing;
        let behind = if alone && self.asked != 0.0 {
            self.asked / gained
        } else {
            1.0
        };
        // One that went back or hardly followed says nothing of what is to come.
        let behind = if behind > 0.0 {
            behind.clamp(1.0, MOST_BEHIND)
        } else {
            1.0
        };
        let by = behind * missing / sum.area;
        self.by = if by.is_finite() {
            by.clamp(-FARTHEST, FARTHEST)
        } else {
            0.0
        };
        self.asked = self.by * sum.area;
    }
}
