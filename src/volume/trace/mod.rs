//! Rays through voxels.
//!
//! One rule decides for all methods: a ray hits a set voxel when a point of it within its reach lies
//! in the voxel's closed cube, swollen on all sides by [`GridRay`]'s slack. So a ray along a face, an
//! edge or through a corner meets all voxels that touch there. The crossing of each plane is one
//! subtraction and one product, which rounding keeps in order; the cube of an octree node therefore
//! always spans those of its voxels, and no method can miss what another finds.

mod dda;

pub use dda::any_set;

use crate::numeric::vector::Vec3;

/// By how much voxels are swollen for rays from near by, in voxels: far more than coordinates and
/// crossings are rounded by, far less than could be seen.
const SLACK: f64 = 1.0 / (1u64 << 30) as f64;

/// By how much of the distance of its origin for rays from far away.
const FAR_SLACK: f64 = 1.0 / (1u64 << 49) as f64;

/// A ray in grid coordinates: voxel (i, j, k) is the cube from (i, j, k) to (i + 1, j + 1, k + 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridRay {
    /// The place at parameter 0.
    pub origin: Vec3,
    /// From the place at parameter 0 to that at 1; of any length.
    direction: Vec3,
    /// One over each component of the direction; 0 where it has no finite inverse.
    inverse: Vec3,
    /// The first and the last parameter that count, both included.
    pub reach: [f64; 2],
    /// What cubes are swollen by.
    slack: f64,
}

/// What a ray took to answer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Visits {
    /// Octree nodes whose children were looked at, bricks included.
    pub nodes: u64,
    /// Voxels whose bit was looked at.
    pub voxels: u64,
}

impl std::ops::AddAssign for Visits {
    fn add_assign(&mut self, more: Visits) {
        self.nodes += more.nodes;
        self.voxels += more.voxels;
    }
}

impl GridRay {
    /// A ray from numbers that are finite; a reach is held to finite numbers.
    ///
    /// A component of the direction so small that it has no finite inverse counts as 0.
    pub fn new(origin: Vec3, direction: Vec3, reach: [f64; 2]) -> Self {
        let inverse = direction.map(|d| {
            let inverse = 1.0 / d;
            if inverse.is_finite() { inverse } else { 0.0 }
        });
        let far = origin.iter().fold(0.0f64, |far, c| far.max(c.abs()));
        GridRay {
            origin,
            direction,
            inverse,
            reach: reach.map(|t| t.clamp(-f64::MAX, f64::MAX)),
            slack: SLACK.max(FAR_SLACK * far),
        }
    }

    /// Where the ray is at a parameter.
    #[inline]
    pub(super) fn at(&self, t: f64, axis: usize) -> f64 {
        self.origin[axis] + t * self.direction[axis]
    }

    /// What places that [`GridRay::at`] gives within a grid may be off by, and far more.
    #[inline]
    pub(super) fn haze(&self) -> f64 {
        self.slack * 64.0
    }

    /// The direction, 0 across the planes that it never crosses.
    #[inline]
    pub(super) fn crossing(&self) -> Vec3 {
        let known = |a: usize| self.inverse[a] != 0.0;
        std::array::from_fn(|a| if known(a) { self.direction[a] } else { 0.0 })
    }

    /// Whether planes across an axis are crossed upwards (1), downwards (-1) or never (0).
    #[inline]
    pub(super) fn sign(&self, axis: usize) -> i32 {
        i32::from(self.inverse[axis] > 0.0) - i32::from(self.inverse[axis] < 0.0)
    }

    /// The parameters at which the ray enters and leaves the swollen slab from `lo` to `hi` across an
    /// axis; an interval that is empty where it never does.
    #[inline]
    pub(super) fn slab(&self, axis: usize, lo: f64, hi: f64) -> [f64; 2] {
        let (lo, hi) = (lo - self.slack, hi + self.slack);
        let (o, inverse) = (self.origin[axis], self.inverse[axis]);
        if inverse > 0.0 {
            [(lo - o) * inverse, (hi - o) * inverse]
        } else if inverse < 0.0 {
            [(hi - o) * inverse, (lo - o) * inverse]
        } else if lo <= o && o <= hi {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            [f64::INFINITY, f64::NEG_INFINITY]
        }
    }

    /// The parameters within reach at which the ray is in the swollen cube from `lo` with this edge;
    /// empty (the first above the second) where it is not.
    #[inline]
    pub(super) fn cuboid(&self, lo: Vec3, edges: Vec3) -> [f64; 2] {
        let [mut first, mut last] = self.reach;
        for a in 0..3 {
            let [enter, leave] = self.slab(a, lo[a], lo[a] + edges[a]);
            first = first.max(enter);
            last = last.min(leave);
        }
        [first, last]
    }

    /// Whether the ray hits a voxel: the rule itself.
    #[inline]
    pub fn hits(&self, voxel: [usize; 3]) -> bool {
        let [first, last] = self.cuboid(voxel.map(|c| c as f64), [1.0; 3]);
        first <= last
    }
}

#[cfg(test)]
mod tests;
