//! Where small triangles cross the lines through voxel centres along x.
//!
//! Most triangles of a fine mesh lie between those lines, and of the others most cross one well
//! away from their edges and from any centre. These are decided in plain arithmetic with an error
//! bound; the rest is left to [`crossings`](super::lines::crossings), which is exact.

use super::span::{nearest, nearest_index};
use super::triangle::{Clip, Lanes, NEAR, Triangle, corners, max, min};
use crate::numeric::vector::Vec3;
use wide::f64x4;

/// Most voxels along an axis of a small triangle.
const SMALL: f64 = 16.0;
/// Coordinates relative to the triangle's lowest corner are below [`SMALL`], each off by less than
/// [`NEAR`] voxels: so twice the area of a triangle between two of its corners and a centre is off by
/// less than 8 of their products.
const AREA_ERROR: f64 = 8.0 * SMALL * NEAR;

/// The lines along x that a triangle's bounds meet.
#[derive(Clone, Copy)]
pub struct Reach {
    /// Their first voxels along y and z.
    first: [i32; 2],
    /// How many there are along y and z.
    count: [i32; 2],
    /// Whether there may be others: the triangle leaves the grid, is not small, or begins or ends too
    /// near to a centre.
    pub unknown: bool,
    /// Whether there is none.
    pub none: bool,
}

impl Reach {
    /// How many lines there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        (self.count[0] * self.count[1]) as usize
    }
}

/// Which lines the bounds of a triangle meet; its corners may be off by [`NEAR`] voxels.
#[inline(always)]
pub fn reach(q: &Lanes, clip: &Clip) -> Reach {
    let least = q[0].fast_min(q[1]).fast_min(q[2]);
    let greatest = q[0].fast_max(q[1]).fast_max(q[2]);
    // The first centre above a coordinate is in the voxel of the integer nearest to it.
    let (low, first) = nearest_index(least);
    let (high, last) = nearest_index(greatest);
    let half = f64x4::splat(0.5);
    let off = (least - low).abs().fast_max((greatest - high).abs());
    let near = off.simd_gt(half - f64x4::splat(NEAR));
    let [lower, upper] = clip.sides();
    let far = (greatest - least).simd_gt(f64x4::splat(SMALL - 2.0))
        | least.simd_lt(lower)
        | greatest.simd_gt(upper);
    let unknown = near.to_bitmask() & 6 | far.to_bitmask() & 7 != 0;
    Reach {
        first: [first[1], first[2]],
        count: [
            last[1].wrapping_sub(first[1]),
            last[2].wrapping_sub(first[2]),
        ],
        unknown,
        none: !unknown & (high.simd_eq(low).to_bitmask() & 6 != 0),
    }
}

/// Whether a triangle that [`reach`] knows surely has an area.
#[inline(always)]
pub fn has_area(q: &Lanes) -> bool {
    let (u, v) = (q[1] - q[0], q[2] - q[0]);
    let turned = |p: f64x4| {
        let [x, y, z, w] = p.to_array();
        f64x4::new([y, z, x, w])
    };
    let normal = u * turned(v) - turned(u) * v;
    let surely = normal.abs().simd_gt(f64x4::splat(AREA_ERROR));
    surely.to_bitmask() & 7 != 0
}

/// A crossing of a line.
#[derive(Clone, Copy)]
pub struct Crossing {
    /// The voxel: along x the first whose centre is not before the crossing.
    pub at: [i32; 3],
    /// Whether the line leaves the surface there: the triangle faces +x.
    pub leaves: bool,
    /// Whether there is a crossing at all.
    pub is_there: bool,
    /// Whether only exact arithmetic can tell.
    pub doubtful: bool,
}

/// What the lines within a triangle's reach have of it, by the rules of [`crossings`](super::lines::crossings).
#[inline(always)]
pub fn crossings(q: &Lanes, reach: &Reach) -> impl Iterator<Item = Crossing> {
    let ([y0, z0], [ny, nz]) = (reach.first, reach.count);
    let base = f64x4::new([0.0, y0.into(), z0.into(), 0.0]);
    let triangle = corners(&q.map(|corner| corner - base));
    (0..nz).flat_map(move |z| {
        (0..ny).map(move |y| {
            let crossing = crossing(&triangle, y, z);
            let [x, ..] = crossing.at;
            Crossing {
                at: [x, y0 + y, z0 + z],
                ..crossing
            }
        })
    })
}

/// What the line through the centres of voxels `(y, z)` has of a triangle.
#[inline(always)]
fn crossing([a, b, c]: &Triangle, y: i32, z: i32) -> Crossing {
    let (u, v) = (f64::from(y) + 0.5, f64::from(z) + 0.5);
    let beside = |p: &Vec3, q: &Vec3| (p[1] - u) * (q[2] - v) - (p[2] - v) * (q[1] - u);
    let (wa, wb, wc) = (beside(b, c), beside(c, a), beside(a, b));
    let (least, greatest) = (min(wa, min(wb, wc)), max(wa, max(wb, wc)));
    let leaves = least > AREA_ERROR;
    let is_there = leaves | (greatest < -AREA_ERROR);
    let is_beside = (least < -AREA_ERROR) & (greatest > AREA_ERROR);
    // The first centre behind it, that of voxel k at k + 1/2. Without branches, so also where there is
    // none.
    let area = wa + wb + wc;
    let x = (wb * (b[0] - a[0]) + wc * (c[0] - a[0])) / area + a[0];
    let error = NEAR + 8.0 * SMALL * AREA_ERROR / area.abs();
    let (_, off, k) = nearest(x);
    let is_sure = (x - off).abs() < 0.5 - error;
    Crossing {
        at: [k, y, z],
        leaves,
        is_there,
        doubtful: !(is_beside | (is_there & is_sure)),
    }
}
