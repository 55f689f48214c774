//! Exact signs: which side of a line or a plane a point is on, with no rounding.
//!
//! All return -1, 0 or 1. They are exact as long as no product of three coordinate differences
//! over- or underflows (Shewchuk 1997; the arithmetic is the `robust` crate's).

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
}
