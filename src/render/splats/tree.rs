//! The discs that a ray meets: by boxes, by the octree, or one by one.

use super::boxes::Boxes;
use super::disc::{Discs, Hit, Plate, Ray};
use super::octree::Octree;
use crate::numeric::vector::Vec3;
use crate::spatial::aabb::Aabb;
use crate::spatial::local::{exponent_above, times_power_of_two};
use crate::spatial::wide_bvh::Slabs;
use std::ops::ControlFlow;

/// How the discs of an object are found.
#[derive(Debug)]
pub(super) enum Tree {
    Boxes(Boxes),
    Octree(Box<Octree>),
    /// One by one: the reference.
    Each,
}

/// What rays looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Visits {
    /// Discs.
    pub tests: u64,
    /// Leaves.
    pub leaves: u64,
}

impl Visits {
    pub fn add(&mut self, more: &Visits) {
        self.tests += more.tests;
        self.leaves += more.leaves;
    }
}

impl Tree {
    /// Calls `visit` for the discs that the ray meets by `limit`, in any order, until it breaks off;
    /// `visit` returns the limit from there on, which never grows.
    ///
    /// A disc that is met beyond the limit is passed by, and one that is met by the limit never; an
    /// octree names a disc once for each leaf that holds it. Cost: O(log n) where discs overlap
    /// little, and O(n) one by one.
    #[inline]
    pub fn walk(
        &self,
        discs: &Discs,
        ray: &Ray,
        limit: f64,
        visits: &mut Visits,
        mut visit: impl FnMut(Hit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        if let Tree::Each = self {
            return each(&discs.plates, ray, limit, visits, visit);
        }
        let Some(aim) = Aim::new(discs.bounds, ray, limit) else {
            return ControlFlow::Continue(());
        };
        match self {
            Tree::Boxes(boxes) => boxes.walk(ray, &aim, limit, visits, visit),
            Tree::Octree(octree) => octree.walk(&discs.splats, ray, limit, visits, &mut visit),
            Tree::Each => ControlFlow::Continue(()),
        }
    }
}

fn each(
    plates: &[Plate],
    ray: &Ray,
    limit: f64,
    visits: &mut Visits,
    mut visit: impl FnMut(Hit) -> ControlFlow<(), f64>,
) -> ControlFlow<()> {
    let mut far = limit;
    visits.tests += plates.len() as u64;
    for (disc, plate) in (0u32..).zip(plates) {
        match plate.meet(ray) {
            Some((t, off)) if t <= far => far = visit(Hit { t, off, disc })?,
            _ => {}
        }
    }
    ControlFlow::Continue(())
}

/// The part of a ray near a box, made ready for boxes.
#[derive(Debug, Clone)]
pub(super) struct Aim {
    entry: Vec3,
    direction: Vec3,
    /// Where boxes see the ray's origin, and where the ray leaves the box around everything.
    start: f64,
    end: f64,
    /// What `t` and each coordinate may be off by.
    error: f64,
    /// Boxes count `t` in steps of `2^-exponent`.
    exponent: i32,
}

impl Aim {
    /// `None` for a ray that misses the box by more than a margin.
    #[inline]
    pub fn new(bounds: Aabb, ray: &Ray, limit: f64) -> Option<Aim> {
        let size = |v: Vec3| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let far = size(ray.origin);
        let [start, end] = clip(bounds, ray, far, limit)?;
        let exponent = exponent_above(size(ray.direction)) - 1;
        let entry = ray.at(start);
        Some(Aim {
            entry,
            direction: ray.direction.map(|c| times_power_of_two(c, -exponent)),
            start,
            end,
            error: SOME_ROUNDINGS * (far + 2.0 * start.abs() + 4.0),
            exponent,
        })
    }

    #[inline(always)]
    pub fn slabs(&self) -> Slabs {
        Slabs::new(self.entry, self.direction, self.error)
    }

    /// `t` as boxes count, rounded up.
    #[inline(always)]
    pub fn limit(&self, t: f64) -> f32 {
        let far = times_power_of_two(t.min(self.end) - self.start, self.exponent);
        (far * (1.0 + 4.0 * f64::from(f32::EPSILON)) + 2.0 * self.error + 1e-30) as f32
    }
}

/// Sixteen roundings.
const SOME_ROUNDINGS: f64 = 8.0 * f64::EPSILON;

/// The part of a ray in which it may be inside a box that is a little larger, not before its origin
/// or its least `t`; `None` where there is none. `far` is the largest coordinate of the origin.
#[inline]
pub(super) fn clip(bounds: Aabb, ray: &Ray, far: f64, limit: f64) -> Option<[f64; 2]> {
    /// Directions flatter than this against an axis do not leave the margin.
    const FLAT: f64 = 1e-200;
    let margin = 1.0 / (1u64 << 20) as f64 + far / (1u64 << 40) as f64;
    let (mut start, mut end) = (ray.least.max(0.0), limit);
    for a in 0..3 {
        let lo = bounds.lo[a] - margin - ray.origin[a];
        let hi = bounds.hi[a] + margin - ray.origin[a];
        if ray.direction[a].abs() < FLAT {
            if lo > 0.0 || hi < 0.0 {
                return None;
            }
            continue;
        }
        let inverse = 1.0 / ray.direction[a];
        let (lo, hi) = (lo * inverse, hi * inverse);
        start = lo.min(hi).max(start);
        end = lo.max(hi).min(end);
    }
    (start <= end).then_some([start, end])
}

/// How far ahead a line enters a box; 0 where it starts inside, `None` where it misses.
pub(super) fn clip_to(bounds: Aabb, origin: Vec3, direction: Vec3) -> Option<f64> {
    let (mut start, mut end) = (0.0_f64, f64::INFINITY);
    for a in 0..3 {
        if direction[a] == 0.0 {
            if origin[a] < bounds.lo[a] || origin[a] > bounds.hi[a] {
                return None;
            }
            continue;
        }
        let lo = (bounds.lo[a] - origin[a]) / direction[a];
        let hi = (bounds.hi[a] - origin[a]) / direction[a];
        start = start.max(lo.min(hi));
        end = end.min(lo.max(hi));
    }
    (start <= end && start.is_finite()).then_some(start)
}
