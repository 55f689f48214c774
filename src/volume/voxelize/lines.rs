//! Which lines through voxel centres a triangle meets, exact.
//!
//! * [`columns`]: the triangle meets the line through the voxel centres along one axis, in this
//!   voxel (Forest, Barthe, Paulin 2009, section 2). The union over three axes is the set of voxels
//!   whose crosshair meets the surface (Laine 2013): 6-separating.
//! * [`crossings`]: like columns along x, but each line is met by exactly one of the triangles that
//!   share an edge, for inside and outside.
//!
//! Every decision is the one rational arithmetic would make.

use super::span::{Sample, ceil, floor};
use super::triangle::{Clip, Local, Triangle, greatest, least, local_side, pick};
use crate::numeric::predicates::{orient2d, orient3d};
use crate::numeric::vector::Vec3;

/// Calls `emit(voxel)` for every voxel in which the triangle meets the line through the voxel
/// centres along `axis`; edges and corners belong to the triangle.
///
/// A point on the face between two voxels belongs to the upper one, on the upper face of the grid
/// (of `dims` voxels) to the last. A triangle seen edge on meets no line.
#[inline]
pub fn columns(
    q: &Triangle,
    axis: usize,
    dims: [usize; 3],
    clip: &Clip,
    emit: &mut impl FnMut([i32; 3]),
) {
    let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
    let centres = |a: usize| {
        (
            ceil(least(q, a) - 0.5).max(clip.lo()[a]),
            floor(greatest(q, a) - 0.5).min(clip.hi()[a]),
        )
    };
    let mut ranges = [(0, 0); 3];
    (ranges[u], ranges[v]) = (centres(u), centres(v));
    ranges[axis] = (floor(least(q, axis)), floor(greatest(q, axis)));
    if ranges[u].0 > ranges[u].1 || ranges[v].0 > ranges[v].1 {
        return;
    }
    let closed = |p: [[f64; 2]; 3], turn: i32, at: [f64; 2]| {
        (0..3).all(|i| turn * orient2d(p[i], p[(i + 1) % 3], at) >= 0)
    };
    each_line(q, axis, ranges, closed, &mut |local, turn, cell| {
        let point = |k: i32| on_line(axis, cell, f64::from(k));
        // The plane is met at or above height k when the point there is not beyond it.
        let reached = |k: i32| turn * orient3d(q[0], q[1], q[2], point(k)) <= 0;
        let mut k = height(local, axis, cell, ranges, 0.0, ranges[axis], reached);
        let last = dims[axis] as i32;
        if k == last && orient3d(q[0], q[1], q[2], point(last)) == 0 {
            k = last - 1;
        }
        if k >= clip.lo()[axis] && k <= clip.hi()[axis] {
            let mut voxel = [0; 3];
            (voxel[u], voxel[v], voxel[axis]) = (cell[0], cell[1], k);
            emit(voxel);
        }
    });
}

/// Calls `emit(x, y, z, turn)` for every line through voxel centres along x that crosses the
/// triangle: `x` is the first voxel whose centre is not before the crossing (it may lie outside of
/// the grid), `turn` is 1 where the triangle faces +x and -1 where it faces -x.
///
/// Lines that meet an edge or a corner are decided as if moved by (e, e^2) along (y, z) for an
/// infinitely small e, so of the triangles around it they cross as many as a line beside it.
#[inline]
pub fn crossings(q: &Triangle, clip: &Clip, emit: &mut impl FnMut(i32, i32, i32, i32)) {
    let centres = |a: usize| {
        (
            ceil(least(q, a) - 0.5).max(clip.lo()[a]),
            (ceil(greatest(q, a) - 0.5) - 1).min(clip.hi()[a]),
        )
    };
    let within = (floor(least(q, 0)) - 1, ceil(greatest(q, 0)) + 1);
    let ranges = [within, centres(1), centres(2)];
    if ranges[1].0 > ranges[1].1 || ranges[2].0 > ranges[2].1 {
        return;
    }
    let half_open = |p: [[f64; 2]; 3], turn: i32, at: [f64; 2]| {
        (0..3).all(|i| turn * beside(p[i], p[(i + 1) % 3], at) > 0)
    };
    each_line(q, 0, ranges, half_open, &mut |local, turn, cell| {
        let point = |k: i32| on_line(0, cell, f64::from(k) - 0.5);
        // Centre k - 1 is before the crossing: the largest such k is the first not before it.
        let before = |k: i32| turn * orient3d(q[0], q[1], q[2], point(k)) < 0;
        emit(
            height(local, 0, cell, ranges, 0.5, within, before),
            cell[0],
            cell[1],
            turn,
        );
    });
}

/// The side of the line `a b` on which `p` lies when moved by (e, e^2); 0 only where `a` is `b`.
#[inline]
pub fn beside(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> i32 {
    let turn = orient2d(a, b, p);
    let compare = |x: f64, y: f64| i32::from(x > y) - i32::from(x < y);
    if turn != 0 {
        turn
    } else if a[1] != b[1] {
        compare(a[1], b[1])
    } else {
        compare(b[0], a[0])
    }
}

/// The point at height `t` of the line along `axis` through the centres of `cell`.
#[inline]
fn on_line(axis: usize, cell: [i32; 2], t: f64) -> Vec3 {
    let [u, v] = cell.map(|c| f64::from(c) + 0.5);
    match axis {
        0 => [t, u, v],
        1 => [u, t, v],
        _ => [u, v, t],
    }
}

/// Calls `found(local, turn, cell)` for every line along `axis` through cell centres in `ranges`
/// that the rule `inside` finds in the projected triangle; `turn` is the sign of the normal along
/// the axis.
#[inline]
fn each_line(
    q: &Triangle,
    axis: usize,
    ranges: [(i32, i32); 3],
    inside: impl Fn([[f64; 2]; 3], i32, [f64; 2]) -> bool,
    found: &mut impl FnMut(&Local, i32, [i32; 2]),
) {
    let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
    let local = Local::new(q, ranges);
    let turn = local.sign(q, axis);
    if turn == 0 {
        return;
    }
    let seen = local_side(&local, q, u, v);
    let edges = local.edges((u, v), seen, Sample::Centre, ranges[u].1 - ranges[u].0);
    for row in 0..=ranges[v].1 - ranges[v].0 {
        let span = edges.row(row);
        for i in span.possible.0..=span.possible.1 {
            let cell = [ranges[u].0 + i, ranges[v].0 + row];
            if span.is_certain(i) || inside(pick(q, u, v), seen, cell.map(|c| f64::from(c) + 0.5)) {
                found(&local, turn, cell);
            }
        }
    }
}

/// The largest `k` in `within` for which `reached(k)` holds, which it does up to the height at
/// which the line of `cell` meets the plane, shifted up by `shift`; `reached` is asked only where
/// rounding leaves it open.
#[inline]
fn height(
    local: &Local,
    axis: usize,
    cell: [i32; 2],
    ranges: [(i32, i32); 3],
    shift: f64,
    within: (i32, i32),
    reached: impl Fn(i32) -> bool,
) -> i32 {
    let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
    let at = [
        f64::from(cell[0] - ranges[u].0) + 0.5,
        f64::from(cell[1] - ranges[v].0) + 0.5,
    ];
    let [origin, ..] = local.q;
    let slope = local.n[u] * (at[0] - origin[u]) + local.n[v] * (at[1] - origin[v]);
    let t = origin[axis] - slope / local.n[axis] + shift + f64::from(ranges[axis].0);
    // The error of the normal and of the numerator, over a normal that may itself be mostly error.
    let reach = local.reach;
    let margin = 512.0
        * f64::EPSILON
        * (reach * reach * reach / local.n[axis].abs() + reach + within.1.abs() as f64);
    let margin = if margin.is_nan() {
        f64::INFINITY
    } else {
        margin
    };
    let (mut low, mut high) = (
        floor(t - margin).max(within.0),
        floor(t + margin).min(within.1),
    );
    if t.is_nan() {
        (low, high) = within;
    }
    while low < high {
        let middle = low + (high - low + 1) / 2;
        if reached(middle) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    low
}
