//! Exact signs: which side of a line, a plane or a sphere a point is on, with no rounding.
//!
//! All return -1, 0 or 1. [`orient2d`] and [`orient3d`] are exact as long as no product of three
//! coordinate differences over- or underflows (Shewchuk 1997; the arithmetic is the `robust`
//! crate's). [`side_of_plane`] and [`power3d`] are exact for all finite numbers: a floating-point
//! filter with a proven bound answers nearly all calls, whole numbers the rest.

use super::{double, exact};
use robust::{Coord, Coord3D};

#[inline]
fn sign(value: f64) -> i32 {
    i32::from(value > 0.0) - i32::from(value < 0.0)
}

/// 1 when `a`, `b`, `c` turn counter-clockwise, -1 when clockwise, 0 when they lie on one line.
#[inline]
pub fn orient2d(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i32 {
    let at = |p: [f64; 2]| Coord { x: p[0], y: p[1] };
    sign(robust::orient2d(at(a), at(b), at(c)))
}

/// 1 when `p` lies on the side of the plane `a`, `b`, `c` that `(b - a) x (c - a)` points to, -1
/// when on the other side, 0 when on the plane.
#[inline]
pub fn orient3d(a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> i32 {
    let at = |p: [f64; 3]| Coord3D {
        x: p[0],
        y: p[1],
        z: p[2],
    };
    // Shewchuk's sign is positive below the plane.
    -sign(robust::orient3d(at(a), at(b), at(c), at(p)))
}

/// Products below this may have lost bits to underflow, and the filters do not trust them.
const SMALLEST: f64 = 1e-250;

/// Largest of the absolute values.
#[inline(always)]
fn largest<const N: usize>(values: [f64; N]) -> f64 {
    values.into_iter().fold(0.0, |most, v| v.abs().max(most))
}

/// As [`orient3d`], for all finite numbers, and faster where the answer is clear.
#[inline]
pub fn side_of_plane(a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> i32 {
    let [ax, ay, az] = [a[0] - p[0], a[1] - p[1], a[2] - p[2]];
    let [bx, by, bz] = [b[0] - p[0], b[1] - p[1], b[2] - p[2]];
    let [cx, cy, cz] = [c[0] - p[0], c[1] - p[1], c[2] - p[2]];
    let det = az * (bx * cy - by * cx) + bz * (cx * ay - cy * ax) + cz * (ax * by - ay * bx);
    // Six products of three, each with up to eight roundings: 48 half units in the last place.
    let size = largest([ax, bx, cx]) * largest([ay, by, cy]) * largest([az, bz, cz]);
    let bound = 5.5e-15 * size;
    if det.abs() > bound && size > SMALLEST {
        // The rows end in `p`, so the sign is turned.
        return if det > 0.0 { -1 } else { 1 };
    }
    if size < EXACT && [a, b, c, p].iter().flatten().all(|value| is_whole(*value)) {
        return -sign(det);
    }
    -exact::orient3d([a, b, c], p)
}

/// Sums of 24 products of this size are exact, if their terms are whole.
const EXACT: f64 = (1u64 << 48) as f64;

/// Whether a number below 2^51 is whole; false above.
#[inline(always)]
fn is_whole(value: f64) -> bool {
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    (value + SHIFT) - SHIFT == value && value.abs() < (1u64 << 51) as f64
}

/// 1 when `p` is closer, in power distance, to the sphere orthogonal to the weighted points `a`, `b`,
/// `c`, `d` than they are, -1 when further, 0 when it is orthogonal too.
///
/// Points are `[x, y, z, weight]`, and `d` lies on the side of `a`, `b`, `c` that [`orient3d`] calls 1.
/// With equal weights: 1 inside the sphere through the four points, -1 outside.
#[inline]
pub fn power3d(a: [f64; 4], b: [f64; 4], c: [f64; 4], d: [f64; 4], p: [f64; 4]) -> i32 {
    let [ax, ay, az, aw] = [a[0] - p[0], a[1] - p[1], a[2] - p[2], a[3] - p[3]];
    let [bx, by, bz, bw] = [b[0] - p[0], b[1] - p[1], b[2] - p[2], b[3] - p[3]];
    let [cx, cy, cz, cw] = [c[0] - p[0], c[1] - p[1], c[2] - p[2], c[3] - p[3]];
    let [dx, dy, dz, dw] = [d[0] - p[0], d[1] - p[1], d[2] - p[2], d[3] - p[3]];
    let (ab, bc, cd) = (ax * by - ay * bx, bx * cy - by * cx, cx * dy - cy * dx);
    let (da, ac, bd) = (dx * ay - dy * ax, ax * cy - ay * cx, bx * dy - by * dx);
    let abc = az * bc - bz * ac + cz * ab;
    let bcd = bz * cd - cz * bd + dz * bc;
    let cda = cz * da + dz * ac + az * cd;
    let dab = dz * ab + az * bd + bz * da;
    let squares = [
        ax * ax + ay * ay + az * az,
        bx * bx + by * by + bz * bz,
        cx * cx + cy * cy + cz * cz,
        dx * dx + dy * dy + dz * dz,
    ];
    let [al, bl, cl, dl] = [
        squares[0] - aw,
        squares[1] - bw,
        squares[2] - cw,
        squares[3] - dw,
    ];
    let det = (dl * abc - cl * dab) + (bl * cda - al * bcd);
    // 24 products of four, each with up to twenty roundings: 480 half units in the last place.
    let size = largest([ax, bx, cx, dx])
        * largest([ay, by, cy, dy])
        * largest([az, bz, cz, dz])
        * (largest(squares) + largest([aw, bw, cw, dw]));
    if det.abs() > 6e-14 * size && size > SMALLEST {
        return if det > 0.0 { -1 } else { 1 };
    }
    power3d_unclear([a, b, c, d], p, det, size)
}

/// Answers where rounding may have decided: for small whole numbers there was none, else two doubles
/// may be enough, else big integers.
#[cold]
fn power3d_unclear(points: [[f64; 4]; 4], p: [f64; 4], det: f64, size: f64) -> i32 {
    let is_exact = |q: &[f64; 4]| {
        let weight = q[3] == p[3] || (is_whole(q[3]) && is_whole(p[3]));
        weight && q[..3].iter().all(|value| is_whole(*value))
    };
    if size < EXACT && is_exact(&p) && points.iter().all(is_exact) {
        return -sign(det);
    }
    if size > SMALLEST && size < 1e300 {
        let det = double::power3d(points, p);
        // 24 products of at most twenty roundings of 2^-102 each, with room.
        if det.abs() > 2e-28 * size {
            return if det > 0.0 { -1 } else { 1 };
        }
    }
    -exact::power3d(points, p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientations_follow_the_right_hand_rule() {
        assert_eq!(orient2d([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]), 1);
        assert_eq!(orient2d([0.0, 0.0], [0.0, 1.0], [1.0, 0.0]), -1);
        let (a, b, c) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert_eq!(orient3d(a, b, c, [0.3, 0.3, 1e-300]), 1);
        assert_eq!(orient3d(a, b, c, [0.3, 0.3, -1e-300]), -1);
        assert_eq!(orient3d(a, b, c, [7.0, -9.0, 0.0]), 0);
    }

    #[test]
    fn one_ulp_decides() {
        let p = [0.1, 0.1];
        assert_eq!(orient2d([0.0, 0.0], [1.0, 1.0], p), 0);
        assert_eq!(orient2d([0.0, 0.0], [1.0, 1.0], [0.1, 0.1f64.next_up()]), 1);
    }

    use num_bigint::BigInt;
    use num_rational::BigRational;

    fn rational(value: f64) -> BigRational {
        BigRational::from_float(value).expect("finite")
    }

    /// The determinant by its definition, over rationals.
    fn determinant(rows: &[Vec<BigRational>]) -> BigRational {
        if rows.is_empty() {
            return BigRational::from_integer(BigInt::from(1));
        }
        let mut sum = BigRational::from_integer(BigInt::from(0));
        for (k, row) in rows.iter().enumerate() {
            let others: Vec<Vec<_>> = rows
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != k)
                .map(|(_, other)| other[1..].to_vec())
                .collect();
            let term = row[0].clone() * determinant(&others);
            sum = if k % 2 == 0 { sum + term } else { sum - term };
        }
        sum
    }

    fn sign_of(value: &BigRational) -> i32 {
        let zero = BigRational::from_integer(BigInt::from(0));
        i32::from(*value > zero) - i32::from(*value < zero)
    }

    /// Near-degenerate sets of all sizes: lattices, rounded spheres, mixed exponents.
    fn awkward(kind: u64, index: u64) -> [[f64; 4]; 5] {
        let draw = |k: u64| crate::numeric::rng::Rng::new(kind, index * 64 + k).unit();
        std::array::from_fn(|q| {
            let q = q as u64;
            let whole = |k: u64| (draw(4 * q + k) * 4.0).floor();
            let free = |k: u64| draw(4 * q + k) - 0.5;
            match kind {
                0 => [free(0), free(1), free(2), free(3)],
                1 => [whole(0), whole(1), whole(2), 0.0],
                2 => [
                    whole(0) * 0.1,
                    whole(1) * 0.1,
                    whole(2) * 0.1,
                    whole(3) * 0.01,
                ],
                3 => {
                    let v = [free(0), free(1), free(2)];
                    let l = crate::numeric::vector::length(v);
                    [v[0] / l, v[1] / l, v[2] / l, 0.0]
                }
                4 => [free(0) * 1e-90, free(1) * 1e90, whole(2), free(3) * 1e-200],
                5 => [whole(0) * 5e-324, whole(1) * 5e-324, whole(2) * 5e-324, 0.0],
                6 => [
                    whole(0) * 1e100,
                    whole(1) * 1e100,
                    whole(2) * 1e100,
                    whole(3) * 1e200,
                ],
                _ => [whole(0), whole(1), whole(2) * 1e-17, whole(3) * 1e-40],
            }
        })
    }

    #[test]
    fn signs_are_those_of_rational_numbers() {
        for kind in 0..8 {
            let mut seen = [0; 3];
            for index in 0..400 {
                let [a, b, c, d, p] = awkward(kind, index);
                let place = |q: [f64; 4]| [q[0], q[1], q[2]];
                let row = |q: [f64; 4]| -> Vec<BigRational> {
                    (0..3).map(|k| rational(q[k]) - rational(p[k])).collect()
                };
                let expected = -sign_of(&determinant(&[row(a), row(b), row(c)]));
                let got = side_of_plane(place(a), place(b), place(c), place(p));
                assert_eq!(got, expected, "{kind} {index}");
                let lifted = |q: [f64; 4]| {
                    let mut row = row(q);
                    let square = row.iter().fold(rational(0.0), |s, v| s + v * v);
                    row.push(square - (rational(q[3]) - rational(p[3])));
                    row
                };
                let expected =
                    -sign_of(&determinant(&[lifted(a), lifted(b), lifted(c), lifted(d)]));
                assert_eq!(power3d(a, b, c, d, p), expected, "{kind} {index}");
                seen[(expected + 1) as usize] += 1;
            }
            assert!(seen[0] > 0 && seen[2] > 0, "{kind}: {seen:?}");
        }
    }

    #[test]
    fn inside_the_sphere_is_positive() {
        let [a, b, c] = [[0.0; 4], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]];
        let d = [0.0, 0.0, 1.0, 0.0];
        let place = |q: [f64; 4]| [q[0], q[1], q[2]];
        assert_eq!(orient3d(place(a), place(b), place(c), place(d)), 1);
        assert_eq!(power3d(a, b, c, d, [0.5, 0.5, 0.5, 0.0]), 1);
        assert_eq!(power3d(a, b, c, d, [1.0, 1.0, 1.0, 0.0]), 0);
        assert_eq!(power3d(a, b, c, d, [2.0, 1.0, 1.0, 0.0]), -1);
        // A heavier point reaches further.
        assert_eq!(power3d(a, b, c, d, [1.0, 1.0, 1.0, 1e-9]), 1);
    }
}
