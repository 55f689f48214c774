//! Runs of cells that lie on the right side of lines and planes, with what rounding leaves open.
//!
//! Every constraint is an affine function that must not be negative. It is evaluated in f64 with a
//! proven bound on its error, and solved for one coordinate; cells nearer to the boundary than that
//! bound are *possible* but not *certain*, and the caller decides them by an exact predicate. On
//! generic input none is left open, so exactness costs nothing.

use crate::numeric::predicates::orient2d;
use wide::f64x4;

/// Unit roundoff of f64.
const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Cells `possible.0..=possible.1` may satisfy all constraints; `certain.0..=certain.1` do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// Outside of this no cell does.
    pub possible: (i32, i32),
    /// Inside of this every cell does.
    pub certain: (i32, i32),
}

/// A pair that holds nothing, and still nothing after any intersection.
const NONE: (i32, i32) = (i32::MAX, i32::MIN);

impl Span {
    /// No cell at all.
    pub const EMPTY: Span = Span {
        possible: NONE,
        certain: NONE,
    };

    /// All of a range for certain.
    pub fn all((first, last): (i32, i32)) -> Self {
        Span {
            possible: (first, last),
            certain: (first, last),
        }
    }

    /// Whether no cell is possible.
    #[inline]
    pub fn is_empty(self) -> bool {
        self.possible.0 > self.possible.1
    }

    /// What satisfies both.
    #[inline]
    pub fn and(self, other: Span) -> Self {
        let both = |a: (i32, i32), b: (i32, i32)| (a.0.max(b.0), a.1.min(b.1));
        Span {
            possible: both(self.possible, other.possible),
            certain: both(self.certain, other.certain),
        }
    }

    /// The same possibilities, none of them certain.
    #[inline]
    pub fn doubtful(self) -> Self {
        Span {
            certain: NONE,
            ..self
        }
    }

    /// Whether a cell is certain.
    #[inline]
    pub fn is_certain(self, cell: i32) -> bool {
        self.certain.0 <= cell && cell <= self.certain.1
    }
}

/// Adding this rounds a number below 2^31 to the nearest integer and leaves it in the low bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// The nearest integer, as a number and as an index, of `x` kept within what a cell index can be.
///
/// A plain cast would check for numbers that do not fit, which doubles the cost of a hot loop.
#[inline(always)]
pub fn nearest(x: f64) -> (f64, f64, i32) {
    let x = if x > -1e9 { x } else { -1e9 };
    let x = if x < 1e9 { x } else { 1e9 };
    let shifted = x + ROUNDER;
    (x, shifted - ROUNDER, shifted.to_bits() as i32)
}

/// Smallest integer not below `x`, kept within what a cell index can be.
#[inline(always)]
pub fn ceil(x: f64) -> i32 {
    let (x, rounded, index) = nearest(x);
    index + i32::from(rounded < x)
}

/// Largest integer not above `x`, kept within what a cell index can be.
#[inline(always)]
pub fn floor(x: f64) -> i32 {
    let (x, rounded, index) = nearest(x);
    index - i32::from(rounded > x)
}

/// [`ceil`] of four numbers, as numbers.
#[inline(always)]
pub fn ceil4(x: f64x4) -> f64x4 {
    let (x, rounded) = nearest4(x);
    rounded + (rounded.simd_lt(x) & f64x4::ONE)
}

/// [`floor`] of four numbers, as numbers.
#[inline(always)]
pub fn floor4(x: f64x4) -> f64x4 {
    let (x, rounded) = nearest4(x);
    rounded - (rounded.simd_gt(x) & f64x4::ONE)
}

/// The nearest integers of four numbers, as numbers, and the first three of them as indices; the latter
/// for numbers below 2^31.
#[inline(always)]
pub fn nearest_index(x: f64x4) -> (f64x4, [i32; 3]) {
    let shifted = x + f64x4::splat(ROUNDER);
    let [i, j, k, _] = shifted.to_array();
    // There the lowest bits of the number are those of the integer.
    let index = [i, j, k].map(|c| c.to_bits() as i32);
    (shifted - f64x4::splat(ROUNDER), index)
}

#[inline(always)]
fn nearest4(x: f64x4) -> (f64x4, f64x4) {
    let x = x.fast_max(f64x4::splat(-1e9)).fast_min(f64x4::splat(1e9));
    (x, x + f64x4::splat(ROUNDER) - f64x4::splat(ROUNDER))
}

/// `a u + b v + d >= 0`, to be solved for `u`.
#[derive(Debug, Clone, Copy)]
struct Line {
    a: f64,
    b: f64,
    d: f64,
    /// `-1 / a`, or 0 where `a` is too small for `u` to matter.
    solve: f64,
}

/// Where the cells of a raster are sampled against a projected triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sample {
    /// The whole closed square `[u, u + 1] x [v, v + 1]` counts.
    Square,
    /// Only its centre counts.
    Centre,
}

/// The edges of a triangle projected along an axis, as constraints on cells `(u, v)`.
///
/// Cells are counted from a base that the caller chose near the triangle, so that the numbers, and
/// with them the errors, stay small. Edges along u or v are left out: the triangle's bounds, which
/// the caller has applied, say the same.
#[derive(Debug, Clone, Copy)]
pub struct Edges {
    lines: [Line; 3],
    count: usize,
    error: f64,
    margin: f64,
    width: (i32, i32),
}

impl Edges {
    /// The edges of the triangle `q` (relative to the base), whose orientation is `side` (1 for
    /// counter-clockwise, -1 for clockwise, 0 for a triangle seen edge on).
    ///
    /// `reach` bounds all coordinates of triangle and cells; `u` is the range of cells to tell apart.
    #[inline]
    pub fn new(q: [[f64; 2]; 3], side: i32, sample: Sample, reach: f64, u: (i32, i32)) -> Self {
        // Coefficients of size 2 reach, each up to 4 roundoffs of reach off, times coordinates of
        // size reach that may be one off; with the rounding of three sums, 54 in all at most.
        let error = 128.0 * ROUNDOFF * reach * reach;
        let sign = if side < 0 { -1.0 } else { 1.0 };
        let extent = f64::from(u.1 - u.0);
        let empty = Line {
            a: 0.0,
            b: 0.0,
            d: 0.0,
            solve: 0.0,
        };
        let mut edges = Edges {
            lines: [empty; 3],
            count: 0,
            error,
            margin: 0.0,
            width: u,
        };
        for i in 0..3 {
            let (from, to) = (q[i], q[(i + 1) % 3]);
            let (eu, ev) = (to[0] - from[0], to[1] - from[1]);
            if eu == 0.0 || ev == 0.0 {
                continue;
            }
            let (a, b) = (-sign * ev, sign * eu);
            let inside = match sample {
                Sample::Square => a.max(0.0) + b.max(0.0),
                Sample::Centre => 0.5 * (a + b),
            };
            let d = inside - a * from[0] - b * from[1];
            let mut line = Line {
                a,
                b,
                d,
                solve: 0.0,
            };
            if a.abs() * extent > error {
                line.solve = -1.0 / a;
                edges.margin = edges.margin.max(error * line.solve.abs());
            }
            edges.lines[edges.count] = line;
            edges.count += 1;
        }
        edges.margin = edges.margin * 1.5 + 8.0 * ROUNDOFF * reach;
        edges
    }

    /// The cells `u` of row `v` that satisfy all edges.
    #[inline]
    pub fn row(&self, v: i32) -> Span {
        let v = f64::from(v);
        let (mut low, mut high) = (-1e9_f64, 1e9_f64);
        let mut doubt = false;
        for line in &self.lines[..self.count] {
            let g = line.b * v + line.d;
            let at = g * line.solve;
            if line.solve == 0.0 {
                // `u` moves the value by less than the error: the row is in, out or open as a whole.
                if g < -3.0 * self.error {
                    return Span::EMPTY;
                }
                doubt |= g <= 3.0 * self.error;
            } else if line.a > 0.0 {
                low = low.max(at);
            } else {
                high = high.min(at);
            }
        }
        let span = solved(low, high, self.margin, self.width);
        if doubt { span.doubtful() } else { span }
    }
}

/// The integers of `low..=high`, where both bounds are known up to `margin`, within a range.
#[inline]
fn solved(low: f64, high: f64, margin: f64, within: (i32, i32)) -> Span {
    let limit = |first: i32, last: i32| (first.max(within.0), last.min(within.1));
    Span {
        possible: limit(ceil(low - margin), floor(high + margin)),
        certain: limit(ceil(low + margin), floor(high - margin)),
    }
}

/// The plane of a triangle, as two constraints on voxels: their closed boxes meet it.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    n: [f64; 3],
    /// Constant terms of the box corner farthest along the normal, which must not be below the
    /// plane, and of the nearest, which must not be above.
    d: [f64; 2],
    solve: f64,
    error: f64,
    margin: f64,
    width: (i32, i32),
}

impl Plane {
    /// The plane through `origin` with normal `n`, both relative to the base of the cells; `signs`
    /// are the exact signs of the normal's components.
    #[inline]
    pub fn new(n: [f64; 3], signs: [i32; 3], origin: [f64; 3], reach: f64, x: (i32, i32)) -> Self {
        // A normal of size 8 reach^2, up to 48 roundoffs of reach^2 off, times coordinates of size
        // reach, five times over; with the rounding of the sums, 500 in all at most.
        let error = 1024.0 * ROUNDOFF * reach * reach * reach;
        let mut d = [0.0; 2];
        for axis in 0..3 {
            let far = if signs[axis] > 0 { 1.0 } else { 0.0 };
            d[0] += n[axis] * (far - origin[axis]);
            d[1] += n[axis] * (1.0 - far - origin[axis]);
        }
        let mut plane = Plane {
            n,
            d,
            solve: 0.0,
            error,
            margin: 0.0,
            width: x,
        };
        if n[0].abs() * f64::from(x.1 - x.0) > error {
            plane.solve = -1.0 / n[0];
            plane.margin = 1.5 * error * plane.solve.abs() + 8.0 * ROUNDOFF * reach;
        }
        plane
    }

    /// The voxels `x` of row `(y, z)` whose boxes meet the plane.
    #[inline]
    pub fn row(&self, y: i32, z: i32) -> Span {
        let g = self.n[1] * f64::from(y) + self.n[2] * f64::from(z);
        let (far, near) = (g + self.d[0], g + self.d[1]);
        if self.solve == 0.0 {
            let slack = 3.0 * self.error;
            if far < -slack || near > slack {
                return Span::EMPTY;
            }
            let span = Span::all(self.width);
            return if far <= slack || near >= -slack {
                span.doubtful()
            } else {
                span
            };
        }
        let (a, b) = (far * self.solve, near * self.solve);
        let (low, high) = if self.n[0] > 0.0 { (a, b) } else { (b, a) };
        solved(low, high, self.margin, self.width)
    }
}

/// The exact orientation of a projected triangle: from `area` (its signed double area) where that
/// is beyond its rounding error, else by predicate on the coordinates `q` as given.
#[inline(always)]
pub fn side(area: f64, reach: f64, q: [[f64; 2]; 3]) -> i32 {
    // Two products of differences of size 2 reach, each difference up to 4 roundoffs of reach off: 48.
    let error = 64.0 * ROUNDOFF * reach * reach;
    if area > error {
        1
    } else if area < -error {
        -1
    } else {
        orient2d(q[0], q[1], q[2])
    }
}
