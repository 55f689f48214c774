//! Which voxels a triangle touches: the closed triangle meets the closed cube.
//!
//! The test is that of Schwarz and Seidel (2010), with the separating axes of Akenine-Moller (2001).
//! 26-separating. Every decision is the one rational arithmetic would make.

use super::octants::{self, Small};
use super::span::{Plane, Sample, Span, ceil4, floor4, nearest_index};
use super::triangle::{
    Clip, Lanes, Local, NEAR, Triangle, corners, greatest, least, local_side, pick,
};
use crate::numeric::predicates::{orient2d, orient3d};
use wide::f64x4;

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

/// Up to this many corners inside of a triangle's bounds are cheaper to look at than rows are to solve.
const FEW: usize = 36;

/// The largest difference of the cells along an axis for [`Extent::Few`].
const MOST_SPAN: f64 = (octants::EDGE - 1) as f64;

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
        let out = low.simd_gt(clip.upper()) | high.simd_lt(clip.lower());
        let clipped = near | low.simd_lt(clip.lower()) | high.simd_gt(clip.upper());
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

/// Beyond this many voxels a triangle's rounding errors are too large for solved runs to help.
const LARGE: f64 = (1u64 << 36) as f64;

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
    if (low.simd_gt(clip.upper()) | high.simd_lt(clip.lower())).to_bitmask() != 0 {
        return;
    }
    let whole = |c: f64x4| {
        let [x, y, z, _] = c.to_array();
        [x as i32, y as i32, z as i32]
    };
    let (q, first, last) = (&corners(lanes), whole(low), whole(high));
    let range: [(i32, i32); 3] =
        std::array::from_fn(|a| (first[a].max(clip.lo()[a]), last[a].min(clip.hi()[a])));
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
