//! The parts of a surface that do not touch, and what each encloses.

use super::fair::{Fair, Inflate};
use super::region::Region;
use crate::numeric::vector::{Vec3, cross, dot, sub};
use crate::volume::isosurface::{NONE, Surface, axis_of};
use rayon::prelude::*;
use std::collections::BTreeMap;
use wide::f32x4;

/// Triangles that one thread sums at a time; fixed, so that sums never follow the threads.
const CHUNK: usize = 1 << 13;

/// The farthest that a part is moved at once, in the smallest spacing: its normals hold no farther.
const FARTHEST: f64 = 0.25;

/// What is enclosed is held to this share, where the regions allow it.
const CLOSE: f64 = 1e-5;

/// A part is left where a round brings it no closer than this share.
const GAIN: f64 = 0.95;

/// Most rounds of filling.
const ROUNDS: usize = 20;

/// The parts of a surface, numbered by their first vertices.
pub(super) struct Parts {
    /// The part of each vertex.
    of: Vec<u32>,
    /// Where there are labels, which are the parts then, that on the other side; else empty.
    outside: Vec<u32>,
    /// Vertices of each.
    pub sizes: Vec<u64>,
    /// Voxels within each, less those of a cavity; `None` for those that are open.
    pub voxels: Vec<Option<i64>>,
    /// The first place of each, from which its volume is summed.
    origins: Vec<[i32; 3]>,
}

impl Parts {
    /// Labels, that of the rest first; without them, vertices of one polygon belong together. Cost: near
    /// linear.
    pub(super) fn find(surface: &Surface) -> Parts {
        if !surface.sides.is_empty() {
            return Parts::labels(surface);
        }
        let mut parent: Vec<u32> = (0..surface.len() as u32).collect();
        fn root(parent: &mut [u32], mut v: u32) -> u32 {
            while parent[v as usize] != v {
                let above = parent[parent[v as usize] as usize];
                parent[v as usize] = above;
                v = above;
            }
            v
        }
        let mut corners = &surface.loops.corners[..];
        for length in &surface.loops.lengths {
            let (polygon, rest) = corners.split_at(usize::from(*length));
            corners = rest;
            let mut low = root(&mut parent, polygon[0]);
            for v in &polygon[1..] {
                let other = root(&mut parent, *v);
                let (least, most) = (low.min(other), low.max(other));
                parent[most as usize] = least;
                low = least;
            }
        }
        let mut parts = Parts {
            of: vec![0; surface.len()],
            outside: Vec::new(),
            sizes: Vec::new(),
            voxels: Vec::new(),
            origins: Vec::new(),
        };
        for v in 0..surface.len() {
            // Roots are the lowest of their part, so the parent of any other has its number by now.
            let up = parent[v] as usize;
            let part = if up == v {
                parts.sizes.push(0);
                parts.voxels.push(Some(0));
                parts.origins.push(surface.places[v]);
                parts.sizes.len() as u32 - 1
            } else {
                parts.of[up]
            };
            parts.of[v] = part;
            let part = part as usize;
            parts.sizes[part] += 1;
            if surface.is_on_edge(v) && surface.links[v].contains(&NONE) {
                parts.voxels[part] = None;
            }
        }
        parts.count_voxels(surface);
        parts
    }

    fn labels(surface: &Surface) -> Parts {
        let side = |i: usize| surface.sides.iter().map(|s| u32::from(s[i])).collect();
        let count = surface.sides.iter().map(|s| usize::from(s[0]) + 1).max();
        let count = count.unwrap_or(0);
        let mut parts = Parts {
            of: side(0),
            outside: side(1),
            sizes: vec![0; count],
            voxels: vec![Some(0); count],
            origins: vec![surface.places.first().copied().unwrap_or_default(); count],
        };
        for sides in &surface.sides {
            for side in sides {
                parts.sizes[usize::from(*side)] += 1;
            }
        }
        parts.count_voxels(surface);
        // There is no end to what lies outside of all labels.
        parts.voxels[0] = None;
        parts
    }

    /// A face between voxels has its middle at a vertex, and a box of voxels ends at its faces: voxels
    /// are what the faces across x enclose, in whole numbers.
    fn count_voxels(&mut self, surface: &Surface) {
        let mut doubled = vec![0i64; self.len()];
        for (v, place) in surface.places.iter().enumerate() {
            if surface.is_on_edge(v) && axis_of(*place) == 0 {
                let part = self.of[v] as usize;
                let from = i64::from(place[0]) - i64::from(self.origins[part][0]);
                let signed = if surface.lower_inside[v] { from } else { -from };
                doubled[part] += signed;
                if let Some(other) = self.outside.get(v) {
                    doubled[*other as usize] -= signed;
                }
            }
        }
        for (voxels, doubled) in self.voxels.iter_mut().zip(doubled) {
            *voxels = voxels.map(|_| doubled / 2);
        }
    }

    /// The part inside of a vertex, and that outside.
    fn sides(&self, vertex: usize) -> (usize, Option<usize>) {
        let outside = self.outside.get(vertex).map(|part| *part as usize);
        (self.of[vertex] as usize, outside)
    }

    pub(super) fn len(&self) -> usize {
        self.sizes.len()
    }

    /// What each part encloses, in voxels, its polygons split at their first corners.
    pub(super) fn enclosed(
        &self,
        surface: &Surface,
        offset: impl Fn(usize) -> Vec3 + Sync,
    ) -> Vec<f64> {
        let sums = self.sum(surface, [1.0; 3], &offset);
        sums.into_iter().map(|s| s.volume).collect()
    }

    /// What each part encloses, in voxels, as these triangles do.
    pub(super) fn enclosed_by(
        &self,
        surface: &Surface,
        triangles: &[[u32; 3]],
        offset: impl Fn(usize) -> Vec3 + Sync,
    ) -> Vec<f64> {
        let sums = self.sum_triangles(surface, triangles, [1.0; 3], &offset);
        sums.into_iter().map(|s| s.volume).collect()
    }

    /// Places from the first one of each vertex's part, in units of the metric.
    fn placed(
        &self,
        surface: &Surface,
        metric: Vec3,
        offset: &(impl Fn(usize) -> Vec3 + Sync),
    ) -> Vec<Vec3> {
        (0..surface.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| {
                let (place, origin) = (surface.places[v], self.origins[self.of[v] as usize]);
                let moved = offset(v);
                let at = |a: usize| 0.5 * f64::from(place[a] - origin[a]) + moved[a];
                std::array::from_fn(|a| at(a) * metric[a])
            })
            .collect()
    }

    fn sum(
        &self,
        surface: &Surface,
        metric: Vec3,
        offset: &(impl Fn(usize) -> Vec3 + Sync),
    ) -> Vec<Sum> {
        let at = self.placed(surface, metric, offset);
        let chunks = surface.loops.chunks();
        let partial: Vec<BTreeMap<u32, Sum>> = chunks
            .into_par_iter()
            .map(|(lengths, mut corners)| {
                let mut sums = Sums::new(self, surface, &at);
                for length in lengths {
                    let (polygon, rest) = corners.split_at(usize::from(*length));
                    corners = rest;
                    for i in 1..polygon.len() - 1 {
                        sums.add([polygon[0], polygon[i], polygon[i + 1]]);
                    }
                }
                sums.done()
            })
            .collect();
        self.gather(partial)
    }

    fn sum_triangles(
        &self,
        surface: &Surface,
        triangles: &[[u32; 3]],
        metric: Vec3,
        offset: &(impl Fn(usize) -> Vec3 + Sync),
    ) -> Vec<Sum> {
        self.sum_placed(surface, triangles, &self.placed(surface, metric, offset))
    }

    fn sum_placed(&self, surface: &Surface, triangles: &[[u32; 3]], at: &[Vec3]) -> Vec<Sum> {
        let partial: Vec<BTreeMap<u32, Sum>> = triangles
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut sums = Sums::new(self, surface, at);
                for t in chunk {
                    sums.add(*t);
                }
                sums.done()
            })
            .collect();
        self.gather(partial)
    }

    fn gather(&self, partial: Vec<BTreeMap<u32, Sum>>) -> Vec<Sum> {
        let mut all = vec![Sum::default(); self.len()];
        for (part, sum) in partial.into_iter().flatten() {
            all[part as usize].volume += sum.volume;
            all[part as usize].area += sum.area;
        }
        all
    }

    /// What is to be enclosed while the surface is smoothed.
    pub(super) fn target<'a>(&'a self, surface: &'a Surface, metric: Vec3) -> Target<'a> {
        Target {
            parts: self,
            surface,
            metric,
        }
    }

    /// How far each part is to be moved outwards, in the smallest spacing.
    fn missing(&self, sums: &[Sum], metric: Vec3) -> Vec<f64> {
        let voxel = metric[0] * metric[1] * metric[2];
        let by = |(part, sum): (usize, &Sum)| {
            let wanted = self.voxels[part].map_or(sum.volume, |v| v as f64 * voxel);
            let by = (wanted - sum.volume) / sum.area;
            if by.is_finite() {
                by.clamp(-FARTHEST, FARTHEST)
            } else {
                0.0
            }
        };
        sums.iter().enumerate().map(by).collect()
    }

    /// Moves each part along its normals until it encloses its voxels, as far as the regions let it.
    pub(super) fn fill(
        &self,
        surface: &Surface,
        triangles: &[[u32; 3]],
        metric: Vec3,
        regions: &(dyn Fn(usize) -> Region + Sync),
        offsets: &mut Vec<Vec3>,
    ) {
        let fair = Fair::new(surface, metric, 0.5, regions);
        let voxel = metric[0] * metric[1] * metric[2];
        let mut left = vec![f64::INFINITY; self.len()];
        let mut around: Vec<[u32; 3]> = triangles.to_vec();
        let mut moving: Vec<u32> = (0..surface.len() as u32).collect();
        let mut at: Vec<f32x4> = offsets
            .par_iter()
            .with_min_len(CHUNK)
            .map(|o| single(*o, metric))
            .collect();
        let mut placed = self.placed(surface, metric, &|v| offsets[v]);
        for _ in 0..ROUNDS {
            let sums = self.sum_placed(surface, &around, &placed);
            let mut open = vec![false; self.len()];
            for (part, sum) in sums.iter().enumerate() {
                let wanted = self.voxels[part].map_or(sum.volume, |v| v as f64 * voxel);
                let off = (sum.volume - wanted).abs();
                // What the regions no longer let closer is left.
                open[part] = off > CLOSE * wanted.abs() && off < GAIN * left[part];
                // The sums of parts that are left are no longer whole.
                left[part] = if open[part] { off } else { 0.0 };
            }
            if !open.contains(&true) {
                break;
            }
            let moves = |v: u32| {
                let (inside, outside) = self.sides(v as usize);
                open[inside] || outside.is_some_and(|part| open[part])
            };
            // With labels, what is left on one side may be open on the other.
            around.retain(|t| t.iter().any(|v| moves(*v)));
            moving.retain(|v| moves(*v));
            let by = self.missing(&sums, metric);
            let by = |v: usize| {
                let (inside, outside) = self.sides(v);
                let of = |part: usize| if open[part] { by[part] } else { 0.0 };
                of(inside) - outside.map_or(0.0, of)
            };
            let next = |v: &u32| {
                let v = *v as usize;
                let (normal, by) = (fair.normal(&at, v).to_array(), by(v));
                let moved = |a: usize| offsets[v][a] + f64::from(normal[a]) * by / metric[a];
                regions(v).project(std::array::from_fn(moved), metric)
            };
            let moved: Vec<Vec3> = moving.par_iter().with_min_len(CHUNK).map(next).collect();
            for (v, moved) in moving.iter().zip(moved) {
                let v = *v as usize;
                let d = sub(moved, offsets[v]);
                for a in 0..3 {
                    placed[v][a] += d[a] * metric[a];
                }
                at[v] = single(moved, metric);
                offsets[v] = moved;
            }
        }
    }
}

/// An offset in voxels, in single precision and the smallest spacing.
pub(super) fn single(offset: Vec3, metric: Vec3) -> f32x4 {
    let o: [f32; 3] = std::array::from_fn(|a| (offset[a] * metric[a]) as f32);
    f32x4::from([o[0], o[1], o[2], 0.0])
}

/// Volume and area.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    volume: f64,
    area: f64,
}

/// Sums over some triangles, part by part.
struct Sums<'a> {
    parts: &'a Parts,
    surface: &'a Surface,
    at: &'a [Vec3],
    all: BTreeMap<u32, Sum>,
    current: (u32, Option<u32>),
    sum: Sum,
}

impl<'a> Sums<'a> {
    fn new(parts: &'a Parts, surface: &'a Surface, at: &'a [Vec3]) -> Self {
        Sums {
            parts,
            surface,
            at,
            all: BTreeMap::new(),
            current: (0, None),
            sum: Sum::default(),
        }
    }

    #[inline]
    fn add(&mut self, triangle: [u32; 3]) {
        let (part, outside) = match self.surface.sides_of(&triangle) {
            Some([inside, outside]) => (u32::from(inside), Some(u32::from(outside))),
            None => (self.parts.of[triangle[0] as usize], None),
        };
        if (part, outside) != self.current {
            self.flush();
            self.current = (part, outside);
        }
        let [a, b, c] = triangle.map(|v| self.at[v as usize]);
        let normal = cross(sub(b, a), sub(c, a));
        self.sum.volume += dot(normal, a) / 6.0;
        self.sum.area += 0.5 * dot(normal, normal).sqrt();
    }

    fn flush(&mut self) {
        let sum = std::mem::take(&mut self.sum);
        let (inside, outside) = self.current;
        let all = self.all.entry(inside).or_default();
        all.volume += sum.volume;
        all.area += sum.area;
        if let Some(outside) = outside {
            let all = self.all.entry(outside).or_default();
            all.volume -= sum.volume;
            all.area += sum.area;
        }
    }

    fn done(mut self) -> BTreeMap<u32, Sum> {
        self.flush();
        self.all
    }
}

/// What the parts are to enclose.
pub(super) struct Target<'a> {
    parts: &'a Parts,
    surface: &'a Surface,
    metric: Vec3,
}

impl Inflate for Target<'_> {
    fn by(&self, offsets: &[f32x4]) -> Vec<f32> {
        let voxels = |v: usize| {
            let o = offsets[v].to_array();
            std::array::from_fn(|a| f64::from(o[a]) / self.metric[a])
        };
        let sums = self.parts.sum(self.surface, self.metric, &voxels);
        let by = self.parts.missing(&sums, self.metric);
        by.into_iter().map(|b| b as f32).collect()
    }

    fn shift(&self, vertex: usize, by: &[f32]) -> f32 {
        let (inside, outside) = self.parts.sides(vertex);
        by[inside] - outside.map_or(0.0, |part| by[part])
    }
}
