//! The parts of a surface that do not touch, and what each encloses.

mod fill;

use super::fair::Inflate;
use crate::numeric::vector::{Vec3, cross, dot, sub};
use crate::volume::isosurface::{NONE, Surface, axis_of};
use rayon::prelude::*;
use std::collections::BTreeMap;
use wide::f32x4;

/// Triangles that one thread sums at a time; fixed, so that sums never follow the threads.
const CHUNK: usize = 1 << 13;

/// The farthest that a part is moved at once, in the smallest spacing: its normals hold no farther.
const FARTHEST: f64 = 0.25;

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

    /// What each part of the surface of marching cubes encloses, in voxels, its polygons split at their
    /// first corners; sums of whole numbers.
    pub(super) fn enclosed(&self, surface: &Surface) -> Vec<f64> {
        let chunks = surface.loops.chunks();
        let partial: Vec<BTreeMap<u32, i64>> = chunks
            .into_par_iter()
            .map(|(lengths, mut corners)| {
                let mut sums = BTreeMap::new();
                let (mut current, mut sum) = ((0, None), 0);
                let mut flush = |(inside, outside): (u32, Option<u32>), sum: i64| {
                    *sums.entry(inside).or_insert(0) += sum;
                    if let Some(outside) = outside {
                        *sums.entry(outside).or_insert(0) -= sum;
                    }
                };
                for length in lengths {
                    let (polygon, rest) = corners.split_at(usize::from(*length));
                    corners = rest;
                    let parts = self.parts_of(surface, polygon);
                    if parts != current {
                        flush(current, std::mem::take(&mut sum));
                        current = parts;
                    }
                    sum += self.doubled(surface, polygon);
                }
                flush(current, sum);
                sums
            })
            .collect();
        let mut all = vec![0i64; self.len()];
        for (part, sum) in partial.into_iter().flatten() {
            all[part as usize] += sum;
        }
        // Places are doubled, and a triangle and the origin make a sixth of their determinant.
        all.into_iter().map(|sum| sum as f64 / 48.0).collect()
    }

    /// 48 times what lies between a polygon and the origin of its part.
    #[inline]
    fn doubled(&self, surface: &Surface, polygon: &[u32]) -> i64 {
        let first = surface.places[polygon[0] as usize];
        let from = self.origins[self.of[polygon[0] as usize] as usize];
        // Differences within a cell are 2 at most.
        let to = |v: u32| -> [i32; 3] {
            let place = surface.places[v as usize];
            std::array::from_fn(|a| place[a] - first[a])
        };
        let mut normal = [0i32; 3];
        let mut b = to(polygon[1]);
        for v in &polygon[2..] {
            let c = to(*v);
            normal[0] += b[1] * c[2] - b[2] * c[1];
            normal[1] += b[2] * c[0] - b[0] * c[2];
            normal[2] += b[0] * c[1] - b[1] * c[0];
            b = c;
        }
        (0..3)
            .map(|a| i64::from(normal[a]) * (i64::from(first[a]) - i64::from(from[a])))
            .sum()
    }

    /// The part inside of a triangle or polygon, and where there are labels that outside.
    #[inline]
    fn parts_of(&self, surface: &Surface, corners: &[u32]) -> (u32, Option<u32>) {
        match surface.sides_of(corners) {
            Some([inside, outside]) => (u32::from(inside), Some(u32::from(outside))),
            None => (self.of[corners[0] as usize], None),
        }
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
        let origin = |v: usize| self.origins[self.of[v] as usize];
        surface.on_grid_from(origin, metric, offset)
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
        let parts = self.parts.parts_of(self.surface, &triangle);
        if parts != self.current {
            self.flush();
            self.current = parts;
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
