//! Triangles that span at most four voxels along each axis: all 64 at once.
//!
//! The same constraints as in [`super::span`], but evaluated for every cell instead of solved: four
//! cells to a vector, the outcome one bit each. In a box this small one bound on the rounding error
//! holds for all triangles. This is most of the work of a fine mesh.

use super::kernel::Triangle;
use super::span::side;
use crate::numeric::vector::{Vec3, sub};
use wide::f64x4;

/// Most voxels along an axis.
pub const EDGE: i32 = 4;
/// Bounds all coordinates within the box, and one more.
const REACH: f64 = 5.0;
/// Rounding of an edge's and of a plane's value; derived where `span` has the same numbers.
const EDGE_ERROR: f64 = 64.0 * f64::EPSILON * REACH * REACH;
const PLANE_ERROR: f64 = 512.0 * f64::EPSILON * REACH * REACH * REACH;

/// Voxels of the box, bit `x + 4 y + 16 z`: outside of `possible` none is touched, all of `certain`
/// are.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    /// May be touched.
    pub possible: u64,
    /// Are touched.
    pub certain: u64,
}

/// The voxels that a triangle touches among the `size` voxels from `base` on, which hold all of it;
/// `several` has a bit for each axis along which there is more than one, and there are two or three.
#[inline]
pub fn touched(q: &Triangle, base: [i32; 3], size: [i32; 3], several: usize) -> Cells {
    let base = base.map(f64::from);
    let local = q.map(|p| sub(p, base));
    let all = within(size);
    // Seen along an axis with several cells, a slab one cell thick says nothing more, so one
    // projection settles it.
    let (may, must) = match several {
        0b110 => project::<1, 2>(q, &local, size).0,
        0b101 => project::<2, 0>(q, &local, size).0,
        0b011 => project::<0, 1>(q, &local, size).0,
        _ => {
            let (yz, x) = project::<1, 2>(q, &local, size);
            let (zx, y) = project::<2, 0>(q, &local, size);
            let (xy, z) = project::<0, 1>(q, &local, size);
            let mut cells = Cells {
                possible: all & yz.0 & zx.0 & xy.0,
                certain: all & yz.1 & zx.1 & xy.1,
            };
            let (n, signs) = ([x.0, y.0, z.0], [x.1, y.1, z.1]);
            if usize::from(x.1 != 0) + usize::from(y.1 != 0) + usize::from(z.1 != 0) > 1 {
                plane(&mut cells, n, signs, local[0], size);
            }
            return cells;
        }
    };
    Cells {
        possible: all & may,
        certain: all & must,
    }
}

/// The voxels that the projection onto axes `U` and `V` leaves possible and certain; and the normal's
/// component along the third axis with its exact sign.
#[inline(always)]
fn project<const U: usize, const V: usize>(
    q: &Triangle,
    local: &Triangle,
    size: [i32; 3],
) -> ((u64, u64), (f64, i32)) {
    let [a, b, c] = [
        [local[0][U], local[0][V]],
        [local[1][U], local[1][V]],
        [local[2][U], local[2][V]],
    ];
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let side = side(
        area,
        REACH,
        [[q[0][U], q[0][V]], [q[1][U], q[1][V]], [q[2][U], q[2][V]]],
    );
    let (may, must) = edges([a, b, c], side, size[U], size[V]);
    ((spread::<U>(may), spread::<U>(must)), (area, side))
}

/// The bits of all voxels in a box.
#[inline(always)]
fn within([x, y, z]: [i32; 3]) -> u64 {
    const X: [u64; 5] = [
        0,
        0x1111_1111_1111_1111,
        0x3333_3333_3333_3333,
        0x7777_7777_7777_7777,
        u64::MAX,
    ];
    const Y: [u64; 5] = [
        0,
        0x000f_000f_000f_000f,
        0x00ff_00ff_00ff_00ff,
        0x0fff_0fff_0fff_0fff,
        u64::MAX,
    ];
    const Z: [u64; 5] = [0, 0xffff, 0xffff_ffff, 0xffff_ffff_ffff, u64::MAX];
    X[x as usize] & Y[y as usize] & Z[z as usize]
}

/// The cells `u + 4 v` of a projection, for `u < columns` and `v < rows`, that satisfy the edges:
/// possibly and certainly.
#[inline(always)]
fn edges(q: [[f64; 2]; 3], side: i32, columns: i32, rows: i32) -> (u32, u32) {
    let sign = if side < 0 { -1.0 } else { 1.0 };
    let (mut possible, mut certain) = (0xffff, 0xffff);
    let few = columns <= 2 && rows <= 2;
    for i in 0..3 {
        let (from, to) = (q[i], q[(i + 1) % 3]);
        let (eu, ev) = (to[0] - from[0], to[1] - from[1]);
        if eu == 0.0 || ev == 0.0 {
            continue;
        }
        let (a, b) = (-sign * ev, sign * eu);
        let inside = if a > 0.0 { a } else { 0.0 } + if b > 0.0 { b } else { 0.0 };
        let d = inside - a * from[0] - b * from[1];
        let (mut may, mut must) = (0, 0);
        if few {
            // Four cells are one vector.
            let value = f64x4::new([d, d + a, d + b, d + a + b]);
            let square = |bits: u32| (bits & 3) | (bits & 12) << 2;
            may = square(value.simd_ge(f64x4::splat(-EDGE_ERROR)).to_bitmask());
            must = square(value.simd_gt(f64x4::splat(EDGE_ERROR)).to_bitmask());
        } else {
            let first = f64x4::splat(d) + f64x4::splat(a) * f64x4::new([0.0, 1.0, 2.0, 3.0]);
            for v in 0..rows {
                let value = first + f64x4::splat(b * f64::from(v));
                may |= value.simd_ge(f64x4::splat(-EDGE_ERROR)).to_bitmask() << (4 * v);
                must |= value.simd_gt(f64x4::splat(EDGE_ERROR)).to_bitmask() << (4 * v);
            }
        }
        possible &= may;
        certain &= must;
    }
    (possible, certain)
}

/// The voxels above the cells of a projection whose first axis is `U`, the second the next.
#[inline(always)]
fn spread<const U: usize>(cells: u32) -> u64 {
    // One bit to four.
    const WIDE: [u64; 16] = [
        0x0000, 0x000f, 0x00f0, 0x00ff, 0x0f00, 0x0f0f, 0x0ff0, 0x0fff, 0xf000, 0xf00f, 0xf0f0,
        0xf0ff, 0xff00, 0xff0f, 0xfff0, 0xffff,
    ];
    let cells = u64::from(cells);
    let quad = |i: u32| cells >> (4 * i) & 0xf;
    match U {
        // Cells are y + 4 z: every one stands for a row along x.
        1 => {
            let wide = |i: u32| WIDE[quad(i) as usize] << (16 * i);
            wide(0) | wide(1) | wide(2) | wide(3)
        }
        // Cells are z + 4 x: turned into x + 16 z, each stands for a row along y.
        2 => {
            let column = |x: u32| (quad(x) * 0x0000_2000_4000_8001 & 0x0001_0001_0001_0001) << x;
            (column(0) | column(1) | column(2) | column(3)) * 0x1111
        }
        // Cells are x + 4 y: one slice, repeated along z.
        _ => cells * 0x0001_0001_0001_0001,
    }
}

/// Keeps the voxels whose boxes meet the plane through `origin` with normal `n`.
#[inline(always)]
fn plane(cells: &mut Cells, n: Vec3, signs: [i32; 3], origin: Vec3, size: [i32; 3]) {
    let mut d = [0.0; 2];
    for axis in 0..3 {
        let far = if signs[axis] > 0 { 1.0 } else { 0.0 };
        d[0] += n[axis] * (far - origin[axis]);
        d[1] += n[axis] * (1.0 - far - origin[axis]);
    }
    let along = f64x4::splat(n[0]) * f64x4::new([0.0, 1.0, 2.0, 3.0]);
    let (far, near) = (along + f64x4::splat(d[0]), along + f64x4::splat(d[1]));
    let (low, high) = (f64x4::splat(-PLANE_ERROR), f64x4::splat(PLANE_ERROR));
    let (mut may, mut must) = (0u64, 0u64);
    for z in 0..size[2] {
        for y in 0..size[1] {
            let row = f64x4::splat(n[1] * f64::from(y) + n[2] * f64::from(z));
            let (far, near) = (far + row, near + row);
            let at = 4 * y + 16 * z;
            may |= u64::from((far.simd_ge(low) & near.simd_le(high)).to_bitmask()) << at;
            must |= u64::from((far.simd_gt(high) & near.simd_lt(low)).to_bitmask()) << at;
        }
    }
    cells.possible &= may;
    cells.certain &= must;
}
