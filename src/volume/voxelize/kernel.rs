//! Which voxels a triangle sets: the three rules, exact.
//!
//! Triangles come in grid coordinates, in which voxel `(i, j, k)` is the cube from `(i, j, k)` to
//! `(i + 1, j + 1, k + 1)`. From there on every decision is the one rational arithmetic would make.
//!
//! * [`overlap`]: the closed triangle meets the closed cube (Schwarz and Seidel 2010; the separating
//!   axes of Akenine-Moller 2001). 26-separating.
//! * [`columns`]: the triangle meets the line through the voxel centres along one axis, in this
//!   voxel (Forest, Barthe, Paulin 2009, section 2). The union over three axes is the set of voxels
//!   whose crosshair meets the surface (Laine 2013): 6-separating.
//! * [`crossings`]: like columns along x, but each line is met by exactly one of the triangles that
//!   share an edge, for inside and outside.

use super::octants::{self, Small};
use super::span::{Edges, Plane, Sample, Span, ceil, ceil4, floor, floor4, nearest_index, side};
use crate::numeric::predicates::{orient2d, orient3d};
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

/// Beyond this many voxels a triangle's rounding errors are too large for solved runs to help.
const LARGE: f64 = (1u64 << 36) as f64;

fn pick(q: &Triangle, u: usize, v: usize) -> [[f64; 2]; 3] {
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
fn least(q: &Triangle, a: usize) -> f64 {
    min(min(q[0][a], q[1][a]), q[2][a])
}

#[inline(always)]
fn greatest(q: &Triangle, a: usize) -> f64 {
    max(max(q[0][a], q[1][a]), q[2][a])
}

/// The triangle relative to a corner of the grid, its normal, and a bound on all coordinates of
/// triangle and cells: what the span constraints are made from.
struct Local {
    q: Triangle,
    n: Vec3,
    reach: f64,
}

impl Local {
    #[inline]
    fn new(q: &Triangle, range: [(i32, i32); 3]) -> Self {
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
    fn sign(&self, q: &Triangle, axis: usize) -> i32 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        side(self.n[axis], self.reach, pick(q, u, v))
    }

    #[inline]
    fn edges(&self, (u, v): (usize, usize), side: i32, sample: Sample, width: i32) -> Edges {
        Edges::new(pick(&self.q, u, v), side, sample, self.reach, (0, width))
    }
}

/// How many cells a triangle's closed bounds meet, as far as it decides how its voxels are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// None in the clip.
    Outside,
    /// At most two along each axis, all in the clip.
    Pairs,
    /// At most [`octants::EDGE`] along each axis, all in the clip.
    Few,
    /// More, or not all of them in the clip, or rounding could make them more.
    Many,
}

/// Where a triangle is in the grid.
#[derive(Clone, Copy)]
pub struct Place {
    /// The cells of its closed bounds.
    pub extent: Extent,
    /// The first of them; of no meaning for [`Extent::Many`].
    pub first: [i32; 3],
    /// How many there are after the first along each axis.
    spans: [i32; 3],
    /// The triangle, seen from the first.
    pub small: Small,
}

/// Coordinates from the grid's, where rounded differently, are off by less than this many voxels.
pub const NEAR: f64 = 1e-9;
/// Up to this many corners inside of a triangle's bounds are cheaper to look at than rows are to solve.
const FEW: usize = 36;

impl Place {
    /// Where the triangle is. Within a grid of 2^16 voxels, `lanes` may be off by [`NEAR`].
    #[inline(always)]
    pub fn new(lanes: &Lanes, clip: &Clip) -> Self {
        let (one, half) = (f64x4::ONE, f64x4::splat(0.5));
        let least = lanes[0].fast_min(lanes[1]).fast_min(lanes[2]);
        let greatest = lanes[0].fast_max(lanes[1]).fast_max(lanes[2]);
        // The first and the last cell along each axis: away from the planes between cells, those
        // whose closed sides the bounds meet are those that hold their ends.
        let (low, first) = nearest_index(least - half);
        let (high, last) = nearest_index(greatest - half);
        let off = (least - low - half)
            .abs()
            .fast_max((greatest - high - half).abs());
        let near = off.simd_gt(f64x4::splat(0.5 - NEAR));
        let out = low.simd_gt(clip.high) | high.simd_lt(clip.low);
        let clipped = near | low.simd_lt(clip.low) | high.simd_gt(clip.high);
        let spans = high - low;
        let above = |limit: f64x4| spans.simd_gt(limit).to_bitmask() & 7 != 0;
        let extent = if (clipped | out).to_bitmask() & 7 != 0 {
            let surely_out = near.to_bitmask() & 7 == 0 && out.to_bitmask() & 7 != 0;
            [Extent::Many, Extent::Outside][usize::from(surely_out)]
        } else {
            let more = usize::from(above(one)) + usize::from(above(f64x4::splat(MOST_SPAN)));
            [Extent::Pairs, Extent::Few, Extent::Many][more]
        };
        Place {
            extent,
            first,
            spans: std::array::from_fn(|a| last[a].wrapping_sub(first[a])),
            small: Small::new(lanes, low),
        }
    }

    /// Cells along each axis.
    #[inline(always)]
    pub fn size(&self) -> [usize; 3] {
        self.spans.map(|s| s as usize + 1)
    }

    /// A number below [`SHAPES`] that is the same for triangles of the same size.
    #[inline(always)]
    pub fn shape(&self) -> usize {
        let [x, y, z] = self.spans.map(|s| s as usize);
        x + octants::EDGE * (y + octants::EDGE * z)
    }

    /// The voxels of a triangle of at most [`Extent::Few`], as [`Small::cells`] has them, and whether it
    /// surely has an area; none where it has too many corners within its bounds or only exact
    /// arithmetic can tell.
    #[inline(always)]
    pub fn cells(&self) -> Option<([u64; octants::EDGE], bool)> {
        let corners = self.spans.map(|s| s.max(1) as usize);
        if corners.iter().product::<usize>() > FEW {
            return None;
        }
        self.small.cells(self.size(), octants::EDGE)
    }
}

/// The number of sizes that a triangle of at most [`Extent::Few`] can have.
pub const SHAPES: usize = octants::EDGE * octants::EDGE * octants::EDGE;
/// The largest difference of the cells along an axis for [`Extent::Few`].
const MOST_SPAN: f64 = (octants::EDGE - 1) as f64;

/// Calls `emit(x0, x1, y, z)` for every run of voxels whose closed cubes the closed triangle meets.
///
/// Triangles without area are met as the segments or points they are. `rows` is working memory.
/// Cost: in the number of rows that the triangle's bounds span, plus a constant.
#[inline(always)]
pub fn overlap(
    lanes: &Lanes,
    clip: &Clip,
    rows: &mut Vec<Span>,
    emit: &mut impl FnMut(i32, i32, i32, i32),
) {
    let place = Place::new(lanes, clip);
    let done = match place.extent {
        Extent::Outside => true,
        Extent::Pairs => {
            let seen = place.small.pairs();
            if !seen.doubtful {
                pairs(seen.octants, place.first, emit);
            }
            !seen.doubtful
        }
        Extent::Few => match place.cells() {
            Some((cells, _)) => {
                slices(&cells, place.first, emit);
                true
            }
            None => false,
        },
        Extent::Many => false,
    };
    if !done {
        overlap_exact(lanes, clip, rows, emit);
    }
}

/// [`overlap`] for triangles that span many voxels, leave the clip, or pass too near to a corner.
#[inline(never)]
pub fn overlap_exact(
    lanes: &Lanes,
    clip: &Clip,
    rows: &mut Vec<Span>,
    emit: &mut impl FnMut(i32, i32, i32, i32),
) {
    // The first and the last cell along each axis: those whose closed sides the bounds meet.
    let low = ceil4(lanes[0].fast_min(lanes[1]).fast_min(lanes[2])) - f64x4::ONE;
    let high = floor4(lanes[0].fast_max(lanes[1]).fast_max(lanes[2]));
    if (low.simd_gt(clip.high) | high.simd_lt(clip.low)).to_bitmask() != 0 {
        return;
    }
    let whole = |c: f64x4| {
        let [x, y, z, _] = c.to_array();
        [x as i32, y as i32, z as i32]
    };
    let (q, first, last) = (&corners(lanes), whole(low), whole(high));
    let range: [(i32, i32); 3] =
        std::array::from_fn(|a| (first[a].max(clip.lo[a]), last[a].min(clip.hi[a])));
    let several = (0..3).fold(0, |bits, a| bits | usize::from(first[a] < last[a]) << a);
    let [x, y, z] = range;
    // A connected set inside a slab one cell thick meets a cell exactly where its projection does,
    // and inside a row of cells it meets every cell between its ends.
    if several.count_ones() <= 1 {
        for k in z.0..=z.1 {
            for j in y.0..=y.1 {
                emit(x.0, x.1, j, k);
            }
        }
        return;
    }
    let local = Local::new(q, range);
    if local.reach > LARGE {
        return descend(q, range, emit);
    }
    let width = range.map(|r| r.1 - r.0);
    let mut settle = |span: Span, j: i32, k: i32| {
        let span = Span {
            possible: (
                span.possible.0.saturating_add(x.0),
                span.possible.1.saturating_add(x.0),
            ),
            certain: (
                span.certain.0.saturating_add(x.0),
                span.certain.1.saturating_add(x.0),
            ),
        };
        settle_run(
            span,
            |i| touches(q, [i, j, k], 1),
            |x0, x1| emit(x0, x1, j, k),
        );
    };
    let project = |u: usize, v: usize| {
        local.edges(
            (u, v),
            local_side(&local, q, u, v),
            Sample::Square,
            width[u],
        )
    };
    match several {
        0b011 => {
            let xy = project(0, 1);
            (0..=width[1]).for_each(|j| settle(xy.row(j), y.0 + j, z.0));
        }
        0b101 => {
            let xz = project(0, 2);
            (0..=width[2]).for_each(|k| settle(xz.row(k), y.0, z.0 + k));
        }
        0b110 => {
            let yz = project(1, 2);
            for k in 0..=width[2] {
                let span = yz.row(k);
                for j in span.possible.0..=span.possible.1 {
                    let run = Span::all((0, 0));
                    settle(
                        if span.is_certain(j) {
                            run
                        } else {
                            run.doubtful()
                        },
                        y.0 + j,
                        z.0 + k,
                    );
                }
            }
        }
        _ => {
            let (xy, xz, yz) = (project(0, 1), project(0, 2), project(1, 2));
            let signs = [local.sign(q, 0), local.sign(q, 1), local.sign(q, 2)];
            // The plane of a triangle along two axes says no more than its bounds, and that of a
            // triangle without area says nothing.
            let slanted = signs.iter().filter(|s| **s != 0).count() > 1;
            let plane =
                slanted.then(|| Plane::new(local.n, signs, local.q[0], local.reach, (0, width[0])));
            rows.clear();
            rows.extend((0..=width[1]).map(|j| xy.row(j)));
            for k in 0..=width[2] {
                let (across, along) = (yz.row(k), xz.row(k));
                if along.is_empty() {
                    continue;
                }
                for j in across.possible.0..=across.possible.1 {
                    let mut span = along.and(rows[j as usize]);
                    if let Some(plane) = plane.as_ref().filter(|_| !span.is_empty()) {
                        span = span.and(plane.row(j, k));
                    }
                    settle(
                        if across.is_certain(j) {
                            span
                        } else {
                            span.doubtful()
                        },
                        y.0 + j,
                        z.0 + k,
                    );
                }
            }
        }
    }
}

/// Emits the voxels of a mask of octants.
#[inline(always)]
pub fn pairs(mask: u8, base: [i32; 3], emit: &mut impl FnMut(i32, i32, i32, i32)) {
    for row in 0..4 {
        let pair = i32::from(mask) >> (2 * row) & 3;
        if pair != 0 {
            let (first, last) = (i32::from(pair == 2), i32::from(pair != 1));
            emit(
                base[0] + first,
                base[0] + last,
                base[1] + (row & 1),
                base[2] + (row >> 1),
            );
        }
    }
}

/// Emits the voxels of slices of eight by eight, from `base` on.
#[inline(always)]
pub fn slices(
    slices: &[u64; octants::EDGE],
    base: [i32; 3],
    emit: &mut impl FnMut(i32, i32, i32, i32),
) {
    for (z, slice) in (base[2]..).zip(slices) {
        let mut slice = *slice;
        // What a convex set touches of a row is one run.
        while slice != 0 {
            let row = slice.trailing_zeros() as i32 >> 3;
            let cells = (slice >> (8 * row) & 0xff) as u32;
            let first = cells.trailing_zeros() as i32;
            let last = 31 - cells.leading_zeros() as i32;
            emit(base[0] + first, base[0] + last, base[1] + row, z);
            slice &= !(0xff << (8 * row));
        }
    }
}

/// The orientation of the projection onto `(u, v)`.
#[inline]
fn local_side(local: &Local, q: &Triangle, u: usize, v: usize) -> i32 {
    // (x, z) is the mirror image of the cyclic (z, x).
    if (u, v) == (0, 2) {
        -local.sign(q, 1)
    } else {
        local.sign(q, 3 - u - v)
    }
}

/// Emits the certain run, and of the rest what the exact test accepts.
#[inline]
fn settle_run(span: Span, exact: impl Fn(i32) -> bool, mut emit: impl FnMut(i32, i32)) {
    let (first, last) = span.possible;
    let (low, high) = (span.certain.0.max(first), span.certain.1.min(last));
    let mut ask = |from: i32, to: i32| {
        for i in from..=to {
            if exact(i) {
                emit(i, i);
            }
        }
    };
    if low <= high {
        ask(first, low - 1);
        ask(high + 1, last);
        emit(low, high);
    } else if first <= last {
        ask(first, last);
    }
}

/// Halves a box of voxels until the exact test is left with single ones.
fn descend(q: &Triangle, range: [(i32, i32); 3], emit: &mut impl FnMut(i32, i32, i32, i32)) {
    let longest = range.iter().map(|r| r.1 - r.0 + 1).max().unwrap_or(1);
    let mut stack = vec![(
        range.map(|r| r.0),
        (longest as u32).next_power_of_two() as i32,
    )];
    while let Some((at, edge)) = stack.pop() {
        if (0..3).any(|a| at[a] > range[a].1) || !touches(q, at, edge) {
            continue;
        }
        if edge == 1 {
            emit(at[0], at[0], at[1], at[2]);
            continue;
        }
        let half = edge / 2;
        for child in 0..8 {
            stack.push((
                std::array::from_fn(|a| at[a] + (child >> a & 1) * half),
                half,
            ));
        }
    }
}

/// Whether the closed triangle meets the closed cube of this edge, by exact predicates alone.
pub fn touches(q: &Triangle, at: [i32; 3], edge: i32) -> bool {
    let lo = at.map(f64::from);
    let hi = at.map(|c| f64::from(c) + f64::from(edge));
    if (0..3).any(|a| greatest(q, a) < lo[a] || least(q, a) > hi[a]) {
        return false;
    }
    let mut signs = [0; 3];
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let p = pick(q, u, v);
        signs[axis] = orient2d(p[0], p[1], p[2]);
        let turn = if signs[axis] < 0 { -1 } else { 1 };
        for i in 0..3 {
            let (from, to) = (p[i], p[(i + 1) % 3]);
            // The corner of the square that lies farthest to the inner side of the edge.
            let inner = [
                if turn > 0 {
                    from[1] > to[1]
                } else {
                    to[1] > from[1]
                },
                if turn > 0 {
                    to[0] > from[0]
                } else {
                    from[0] > to[0]
                },
            ];
            let corner = [
                if inner[0] { hi[u] } else { lo[u] },
                if inner[1] { hi[v] } else { lo[v] },
            ];
            if from != to && turn * orient2d(from, to, corner) < 0 {
                return false;
            }
        }
    }
    if signs == [0; 3] {
        return true;
    }
    let far = std::array::from_fn(|a| if signs[a] > 0 { hi[a] } else { lo[a] });
    let near = std::array::from_fn(|a| if signs[a] > 0 { lo[a] } else { hi[a] });
    orient3d(q[0], q[1], q[2], far) >= 0 && orient3d(q[0], q[1], q[2], near) <= 0
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
            ceil(least(q, a) - 0.5).max(clip.lo[a]),
            floor(greatest(q, a) - 0.5).min(clip.hi[a]),
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
        if k >= clip.lo[axis] && k <= clip.hi[axis] {
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
            ceil(least(q, a) - 0.5).max(clip.lo[a]),
            (ceil(greatest(q, a) - 0.5) - 1).min(clip.hi[a]),
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
