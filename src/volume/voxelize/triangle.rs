//! Triangles and boxes in grid coordinates, and what every rule asks of them.
//!
//! Voxel `(i, j, k)` is the cube from `(i, j, k)` to `(i + 1, j + 1, k + 1)`.

use super::span::{Edges, Sample, side};
use crate::numeric::vector::{Vec3, cross, sub};
use wide::f64x4;

/// A triangle in grid coordinates.
pub type Triangle = [Vec3; 3];

/// The same, each corner in a vector whose fourth number is 0.
pub type Lanes = [f64x4; 3];

/// The corners of a triangle in vectors.
#[inline(always)]
pub fn corners(lanes: &Lanes) -> Triangle {
    lanes.map(|lane| {
        let [x, y, z, _] = lane.to_array();
        [x, y, z]
    })
}

/// A box of voxels. Nothing outside is set.
#[derive(Debug, Clone, Copy)]
pub struct Clip {
    lo: [i32; 3],
    hi: [i32; 3],
    /// The same with a fourth axis of one cell, which never clips.
    low: f64x4,
    high: f64x4,
}

impl Clip {
    /// The voxels from `lo` to `hi`, both included.
    pub fn new(lo: [i32; 3], hi: [i32; 3]) -> Self {
        let lanes =
            |c: [i32; 3], fourth: f64| f64x4::new([c[0].into(), c[1].into(), c[2].into(), fourth]);
        Clip {
            lo,
            hi,
            low: lanes(lo, -2.0),
            high: lanes(hi, 2.0),
        }
    }

    /// The first voxel.
    pub fn lo(&self) -> [i32; 3] {
        self.lo
    }

    /// The last voxel.
    pub fn hi(&self) -> [i32; 3] {
        self.hi
    }

    /// The first voxel in a vector whose fourth number never clips.
    #[inline(always)]
    pub fn lower(&self) -> f64x4 {
        self.low
    }

    /// The last voxel, so too.
    #[inline(always)]
    pub fn upper(&self) -> f64x4 {
        self.high
    }

    /// The lower sides of the first voxel and the upper sides of the last.
    #[inline(always)]
    pub fn sides(&self) -> [f64x4; 2] {
        [self.low, self.high + f64x4::ONE]
    }

    /// All voxels of a grid.
    pub fn grid(dims: [usize; 3]) -> Self {
        Clip::new([0; 3], dims.map(|d| d as i32 - 1))
    }
}

/// Coordinates from the grid's, where rounded differently, are off by less than this many voxels.
pub const NEAR: f64 = 1e-9;

pub fn pick(q: &Triangle, u: usize, v: usize) -> [[f64; 2]; 3] {
    [[q[0][u], q[0][v]], [q[1][u], q[1][v]], [q[2][u], q[2][v]]]
}

/// The smaller number; unlike `f64::min` it need not care for NaN.
#[inline(always)]
pub fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger number.
#[inline(always)]
pub fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
pub fn least(q: &Triangle, a: usize) -> f64 {
    min(min(q[0][a], q[1][a]), q[2][a])
}

#[inline(always)]
pub fn greatest(q: &Triangle, a: usize) -> f64 {
    max(max(q[0][a], q[1][a]), q[2][a])
}

/// The triangle relative to a corner of the grid, its normal, and a bound on all coordinates of
/// triangle and cells: what the span constraints are made from.
pub struct Local {
    pub q: Triangle,
    pub n: Vec3,
    pub reach: f64,
}

impl Local {
    #[inline]
    pub fn new(q: &Triangle, range: [(i32, i32); 3]) -> Self {
        let base = range.map(|r| f64::from(r.0));
        let local = q.map(|p| sub(p, base));
        let mut reach = 0.0f64;
        for p in &local {
            reach = reach.max(p[0].abs()).max(p[1].abs()).max(p[2].abs());
        }
        for r in range {
            reach = reach.max(f64::from(r.1 - r.0));
        }
        let n = cross(sub(local[1], local[0]), sub(local[2], local[0]));
        Local {
            q: local,
            n,
            reach: reach + 1.0,
        }
    }

    /// The exact sign of a component of the normal.
    #[inline]
    pub fn sign(&self, q: &Triangle, axis: usize) -> i32 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        side(self.n[axis], self.reach, pick(q, u, v))
    }

    #[inline]
    pub fn edges(&self, (u, v): (usize, usize), side: i32, sample: Sample, width: i32) -> Edges {
        Edges::new(pick(&self.q, u, v), side, sample, self.reach, (0, width))
    }
}

/// The orientation of the projection onto `(u, v)`.
#[inline]
pub fn local_side(local: &Local, q: &Triangle, u: usize, v: usize) -> i32 {
    // (x, z) is the mirror image of the cyclic (z, x).
    if (u, v) == (0, 2) {
        -local.sign(q, 1)
    } else {
        local.sign(q, 3 - u - v)
    }
}

/// Whether all three projections of the triangle have no area: its corners lie on one line.
/// `reach` bounds all its coordinates.
#[inline(always)]
pub fn is_degenerate(q: &Triangle, reach: f64) -> bool {
    let area = |u: usize, v: usize| {
        let (e, f) = (
            [q[1][u] - q[0][u], q[1][v] - q[0][v]],
            [q[2][u] - q[0][u], q[2][v] - q[0][v]],
        );
        side(e[0] * f[1] - e[1] * f[0], reach, pick(q, u, v))
    };
    area(0, 1) == 0 && area(1, 2) == 0 && area(2, 0) == 0
}
