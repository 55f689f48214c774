//! Rays against the triangles of a mesh: the closest hit, or whether there is one.

mod packet;
mod triangle;

use super::Mesh;
use crate::numeric::vector::Vec3;
use crate::spatial::aabb::Aabb;
use crate::spatial::local::{LocalFrame, exponent_above, times_power_of_two};
use crate::spatial::wide_bvh::{LEAF, NONE, Slabs, WideBvh};
use packet::{Filter, Packet, Verdict};
use rayon::prelude::*;
use std::ops::ControlFlow;
use triangle::{Meeting, Sheared, is_degenerate};

/// The indices of a triangle's corners and of itself.
type Face = ([u32; 3], u32);

/// A ray, or a segment of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts, in the mesh's unit.
    pub origin: Vec3,
    /// Where it goes; of any length but 0.
    pub direction: Vec3,
    /// Least and largest `t` of a hit, inclusive; may be infinite.
    pub reach: [f64; 2],
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index of the triangle.
    pub triangle: u32,
    /// The point is `origin + t direction`.
    pub t: f64,
    /// Share of the triangle's second corner: the point is `(1 - u - v) a + u b + v c`.
    pub u: f64,
    /// Share of the triangle's third corner.
    pub v: f64,
}

/// The triangles of a mesh, laid out for rays.
///
/// Watertight: a ray that passes a closed mesh through an edge or a corner meets it. Hits are the
/// same whatever the order of the triangles, up to their indices; moving and scaling mesh and rays
/// alike changes nothing but `t`, and not even that where it is exact. Triangles whose corners lie
/// on one line are never hit, and neither are those that a ray sees edge-on.
#[derive(Debug, Clone)]
pub struct Tracer {
    frame: LocalFrame,
    /// The box around all triangles. This, and all that follows, is in the local frame.
    bounds: Aabb,
    tree: WideBvh,
    packets: Vec<Packet>,
    /// By leaf the indices of the corners and of the triangles themselves.
    faces: Vec<[Face; LEAF]>,
    /// Those of triangles alone, in the order in which the groups name them first: what a ray
    /// needs together lies together.
    corners: Vec<Vec3>,
}

impl Tracer {
    /// Lays out the triangles of a mesh; its coordinates are finite and its indices in range
    /// ([`Mesh::check`]), and it has fewer than 2^31 triangles.
    ///
    /// Vertices of no triangle have no influence. The same layout comes from any number of
    /// threads. Cost: O(n log n) time and about 75 bytes per triangle.
    pub fn new(mesh: &Mesh) -> Self {
        let bounds = bounds_of_triangles(mesh);
        let frame = LocalFrame::around(bounds);
        let corners: Vec<Vec3> = mesh
            .positions
            .par_iter()
            .map(|p| frame.to_local(*p))
            .collect();
        let triangle = |t: u32| mesh.triangles[t as usize].map(|v| corners[v as usize]);
        let (tree, leaves) = WideBvh::build(mesh.triangles.len() as u32, |t| {
            let triangle = triangle(t);
            if is_degenerate(triangle) {
                Aabb::EMPTY
            } else {
                Aabb::around(&triangle)
            }
        });
        let packets = leaves
            .par_iter()
            .map(|leaf| Packet::new(leaf.map(|t| (t != NONE).then(|| triangle(t)))))
            .collect();
        let face = |t: u32| match mesh.triangles.get(t as usize) {
            Some(vertices) => (*vertices, t),
            None => ([0; 3], NONE),
        };
        let mut faces: Vec<[Face; LEAF]> = leaves.par_iter().map(|leaf| leaf.map(face)).collect();
        let corners = in_order_of_use(&mut faces, &corners);
        Tracer {
            frame,
            bounds: Aabb {
                lo: frame.to_local(bounds.lo),
                hi: frame.to_local(bounds.hi),
            },
            tree,
            packets,
            faces,
            corners,
        }
    }

    /// The hit of least `t` within the ray's reach; of hits at the same `t`, the triangle of
    /// smallest index.
    ///
    /// `None` also for a ray whose direction is zero, or which is not finite. It is found as if
    /// every triangle were tried: the tree leaves out only what cannot be closer. Cost: O(log n)
    /// where triangles overlap little. Source: Woop, Benthin, Wald 2013, "Watertight ray/triangle
    /// intersection", with their differences of products decided exactly.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let aim = self.aim(ray)?;
        let mut best: Option<(Meeting, u32)> = None;
        let mut limit = aim.limit(aim.reach[1]);
        let mut span = aim.span(aim.reach[1]);
        let _ = self.tree.walk(&aim.slabs, limit, |leaf, _| {
            let Verdict { mut open, .. } = aim.filter.look(&self.packets[leaf], span);
            while open != 0 {
                let lane = open.trailing_zeros() as usize % LEAF;
                open &= open - 1;
                let Some((meeting, triangle)) = self.meet(&aim, leaf, lane) else {
                    continue;
                };
                let closer = best.is_none_or(|(other, index)| {
                    meeting.t < other.t || (meeting.t == other.t && triangle < index)
                });
                if closer {
                    best = Some((meeting, triangle));
                    limit = limit.min(aim.limit(meeting.t));
                    span = aim.span(meeting.t);
                }
            }
            ControlFlow::Continue(limit)
        });
        best.map(|(meeting, triangle)| aim.hit(meeting, triangle))
    }

    /// Whether the ray hits a triangle within its reach: whether [`Tracer::closest`] finds one.
    ///
    /// Cost: that of [`Tracer::closest`] at most.
    pub fn any(&self, ray: &Ray) -> bool {
        let Some(aim) = self.aim(ray) else {
            return false;
        };
        let limit = aim.limit(aim.reach[1]);
        let span = aim.span(aim.reach[1]);
        self.tree
            .walk(&aim.slabs, limit, |leaf, limit| {
                let Verdict { open, met } = aim.filter.look(&self.packets[leaf], span);
                let doubtful =
                    |lane| open >> lane & 1 != 0 && self.meet(&aim, leaf, lane).is_some();
                if met != 0 || (open != 0 && (0..LEAF).any(doubtful)) {
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(limit)
            })
            .is_break()
    }

    /// Bytes that the layout takes.
    pub fn bytes(&self) -> u64 {
        let lists = size_of_val(self.packets.as_slice())
            + size_of_val(self.faces.as_slice())
            + size_of_val(self.corners.as_slice());
        self.tree.bytes() + lists as u64
    }

    /// Where the ray meets a leaf's triangle within its reach.
    #[inline(always)]
    fn meet(&self, aim: &Aim, leaf: usize, lane: usize) -> Option<(Meeting, u32)> {
        let (vertices, triangle) = self.faces[leaf][lane];
        let [a, b, c] = vertices;
        let corner = |v: u32| self.corners[v as usize];
        let meeting = aim.ray.meet([corner(a), corner(b), corner(c)])?;
        let within = aim.reach[0] <= meeting.t && meeting.t <= aim.reach[1];
        within.then_some((meeting, triangle))
    }

    /// The ray in the local frame, from where it enters the box around everything; `None` when it
    /// misses that.
    #[inline(always)]
    fn aim(&self, ray: &Ray) -> Option<Aim> {
        let size = |v: Vec3| larger(v[0].abs(), larger(v[1].abs(), v[2].abs()));
        let origin = self.frame.to_local(ray.origin);
        // Only of a finite number is the product with 0 no NaN.
        let finite = |v: Vec3| v[0] * 0.0 + v[1] * 0.0 + v[2] * 0.0 == 0.0;
        let length = size(ray.direction);
        if length == 0.0 || !finite(ray.direction) || !finite(origin) {
            return None;
        }
        let exponent = exponent_above(length) - 1;
        let direction = ray.direction.map(|c| times_power_of_two(c, -exponent));
        let unit = exponent - self.frame.exponent();
        let reach = ray.reach.map(|t| times_power_of_two(t, unit));
        let [start, end] = clip(self.bounds, origin, size(origin), direction, reach)?;
        let entry: Vec3 = std::array::from_fn(|a| origin[a] + start * direction[a]);
        // Some roundings of numbers as large as the origin and the way to the entry.
        let error = SOME_ROUNDINGS * (size(origin) + 2.0 * start.abs() + 4.0);
        let sheared = Sheared::new(origin, direction);
        Some(Aim {
            slabs: Slabs::new(entry, direction, error),
            filter: Filter::new(&sheared, entry, error),
            ray: sheared,
            reach,
            start,
            end,
            error,
            unit,
        })
    }
}

/// Sixteen roundings.
const SOME_ROUNDINGS: f64 = 8.0 * f64::EPSILON;

/// A ray made ready for everything that it is tested against.
struct Aim {
    ray: Sheared,
    slabs: Slabs,
    filter: Filter,
    /// Least and largest `t`; these, and all that follows, are in the local frame.
    reach: [f64; 2],
    /// Where boxes and packets see the ray's origin.
    start: f64,
    /// Where the ray leaves the box around everything, or its reach ends.
    end: f64,
    /// What `t` and each coordinate may be off by.
    error: f64,
    /// `t` is `2^unit` larger here than in the ray's own frame.
    unit: i32,
}

impl Aim {
    /// `t` as the tree's walk counts, rounded up.
    #[inline(always)]
    fn limit(&self, t: f64) -> f32 {
        let far = smaller(t, self.end) - self.start;
        (far * (1.0 + 4.0 * f64::from(f32::EPSILON)) + 2.0 * self.error + 1e-30) as f32
    }

    /// The part of the main axis, from where the ray starts, up to some `t`.
    #[inline(always)]
    fn span(&self, t: f64) -> [f64; 2] {
        let z = [self.reach[0], t].map(|t| (t - self.start) * self.ray.along);
        if self.ray.along < 0.0 {
            [z[1], z[0]]
        } else {
            z
        }
    }

    #[inline]
    fn hit(&self, meeting: Meeting, triangle: u32) -> Hit {
        Hit {
            triangle,
            t: times_power_of_two(meeting.t, -self.unit),
            u: meeting.u,
            v: meeting.v,
        }
    }
}

/// The part of `reach` in which a ray may be inside a box that is a little larger; `None` when
/// there is none. `far` is the largest coordinate of the origin in size.
#[inline(always)]
fn clip(
    bounds: Aabb,
    origin: Vec3,
    far: f64,
    direction: Vec3,
    reach: [f64; 2],
) -> Option<[f64; 2]> {
    /// Directions flatter than this against an axis do not leave the margin.
    const FLAT: f64 = 1e-200;
    let margin = 1.0 / (1u64 << 20) as f64 + far / (1u64 << 40) as f64;
    let [mut start, mut end] = reach;
    for a in 0..3 {
        let lo = bounds.lo[a] - margin - origin[a];
        let hi = bounds.hi[a] + margin - origin[a];
        if direction[a].abs() < FLAT {
            if lo > 0.0 || hi < 0.0 {
                return None;
            }
            continue;
        }
        let inverse = 1.0 / direction[a];
        let (lo, hi) = (lo * inverse, hi * inverse);
        start = larger(smaller(lo, hi), start);
        end = smaller(larger(lo, hi), end);
    }
    (start <= end).then_some([start, end])
}

/// The larger of two numbers, the second when either is NaN: one instruction, as [`f64::max`] is
/// not.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers; the second when either is NaN.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The corners that the groups name, in the order in which they do, which are renamed so.
fn in_order_of_use(faces: &mut [[Face; LEAF]], corners: &[Vec3]) -> Vec<Vec3> {
    let mut renamed = vec![NONE; corners.len()];
    let mut used = Vec::with_capacity(corners.len());
    let faces = faces.iter_mut().flatten();
    for (vertices, _) in faces.filter(|(_, triangle)| *triangle != NONE) {
        for vertex in vertices {
            let name = &mut renamed[*vertex as usize];
            if *name == NONE {
                *name = used.len() as u32;
                used.push(corners[*vertex as usize]);
            }
            *vertex = *name;
        }
    }
    used
}

/// The box around the corners of all triangles.
fn bounds_of_triangles(mesh: &Mesh) -> Aabb {
    (0..mesh.triangles.len())
        .into_par_iter()
        .fold(
            || Aabb::EMPTY,
            |b, t| mesh.corners(t).iter().fold(b, |b, p| b.with(*p)),
        )
        .reduce(|| Aabb::EMPTY, Aabb::union)
}

#[cfg(test)]
mod tests;
