//! Distances from a point to segments and triangles.

use crate::numeric::vector::{Vec3, add, dot, scale, sub};

/// The point of something that is closest to another point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// Where it is.
    pub point: Vec3,
    /// Square of the distance to it.
    pub distance_squared: f64,
}

/// Square of the sine of the angle at a corner below which another corner is tried as the base of
/// barycentric coordinates: they have lost more than a third of their digits there.
const NEEDLE: f64 = 1e-10;

/// The point of segment `a b` closest to `p`.
///
/// A segment of no length is a point. Coordinates are near unit size: their squares neither over-
/// nor underflow. Source: Ericson 2005, "Real-Time Collision Detection", section 5.1.2.
pub fn point_segment(p: Vec3, a: Vec3, b: Vec3) -> Closest {
    let (ab, ap) = (sub(b, a), sub(p, a));
    let along = along_segment(ap, ab);
    at(a, ap, scale(ab, along))
}

/// Where on `a b` the closest point is: 0 at `a`, 1 at `b`.
#[inline]
fn along_segment(ap: Vec3, ab: Vec3) -> f64 {
    let square = dot(ab, ab);
    let along = dot(ap, ab);
    if along <= 0.0 || square <= 0.0 {
        0.0
    } else if along >= square {
        1.0
    } else {
        along / square
    }
}

/// The closest point is `offset` away from `a`, and `p` is `ap` away.
#[inline]
fn at(a: Vec3, ap: Vec3, offset: Vec3) -> Closest {
    let gap = sub(ap, offset);
    Closest {
        point: add(a, offset),
        distance_squared: dot(gap, gap),
    }
}

/// The point of the closed triangle closest to `p`.
///
/// Always a point of the triangle up to rounding, so that the distance is never too small by more
/// than that; triangles that are segments or points are measured as such, and flat ones by their
/// edges too. Coordinates are near unit size, as for [`point_segment`]. Source: Ericson 2005,
/// "Real-Time Collision Detection", section 5.1.5.
#[inline]
pub fn point_triangle(p: Vec3, corners: [Vec3; 3]) -> Closest {
    let base = Base::new(corners);
    // The comparison is false for a triangle without area and for one whose squares underflow.
    if base.area > NEEDLE * base.bb * base.cc {
        return base.closest(p);
    }
    point_flat_triangle(p, corners)
}

/// A triangle seen from its corner `a`.
struct Base {
    a: Vec3,
    ab: Vec3,
    ac: Vec3,
    bb: f64,
    bc: f64,
    cc: f64,
    /// Square of twice the area.
    area: f64,
}

impl Base {
    #[inline]
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        let (ab, ac) = (sub(b, a), sub(c, a));
        let (bb, bc, cc) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
        Base {
            a,
            ab,
            ac,
            bb,
            bc,
            cc,
            area: bb * cc - bc * bc,
        }
    }

    #[inline]
    fn closest(&self, p: Vec3) -> Closest {
        let ap = sub(p, self.a);
        let (v, w) = self.barycentric(dot(self.ab, ap), dot(self.ac, ap));
        at(self.a, ap, add(scale(self.ab, v), scale(self.ac, w)))
    }

    /// Weights of `b` and `c` at the closest point, from the scalar products of their edges with
    /// the vector from `a`.
    #[inline]
    fn barycentric(&self, bp: f64, cp: f64) -> (f64, f64) {
        let Base {
            bb, bc, cc, area, ..
        } = *self;
        if bp <= 0.0 && cp <= 0.0 {
            return (0.0, 0.0);
        }
        // The same products from `b` and from `c`.
        let (b_from_b, c_from_b) = (bp - bb, cp - bc);
        if b_from_b >= 0.0 && c_from_b <= b_from_b {
            return (1.0, 0.0);
        }
        let (b_from_c, c_from_c) = (bp - bc, cp - cc);
        if c_from_c >= 0.0 && b_from_c <= c_from_c {
            return (0.0, 1.0);
        }
        let w = bb * cp - bc * bp;
        if w <= 0.0 && bp >= 0.0 && b_from_b <= 0.0 {
            return (bp / bb, 0.0);
        }
        let v = cc * bp - bc * cp;
        if v <= 0.0 && cp >= 0.0 && c_from_c <= 0.0 {
            return (0.0, cp / cc);
        }
        let (to_c, to_b) = (c_from_b - b_from_b, b_from_c - c_from_c);
        if area - v - w <= 0.0 && to_c >= 0.0 && to_b >= 0.0 && to_c + to_b > 0.0 {
            let w = to_c / (to_c + to_b);
            return (1.0 - w, w);
        }
        let v = (v / area).clamp(0.0, 1.0);
        (v, (w / area).clamp(0.0, 1.0 - v))
    }
}

/// [`point_triangle`] for a triangle with a very sharp angle at its first corner, or no area.
#[cold]
fn point_flat_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> Closest {
    let square = |u: Vec3, v: Vec3| dot(sub(u, v), sub(u, v));
    let (ab, bc, ca) = (square(a, b), square(b, c), square(c, a));
    // The largest angle is opposite the longest edge.
    let base = Base::new(if ca >= ab && ca >= bc {
        [b, c, a]
    } else if ab >= bc {
        [c, a, b]
    } else {
        [a, b, c]
    });
    if base.area > NEEDLE * base.bb * base.cc {
        return base.closest(p);
    }
    let mut best = point_segment(p, a, b);
    let mut take = |other: Closest| {
        if other.distance_squared < best.distance_squared {
            best = other;
        }
    };
    take(point_segment(p, b, c));
    take(point_segment(p, a, c));
    if base.area > 0.0 {
        take(base.closest(p));
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::numeric::vector::lerp;
    use proptest::prelude::*;

    const UNIT: [Vec3; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn each_region_has_its_closest_point() {
        for (p, wanted) in [
            ([-1.0, -1.0, 2.0], [0.0, 0.0, 0.0]),
            ([2.0, -0.5, 0.0], [1.0, 0.0, 0.0]),
            ([-0.5, 3.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.5, -1.0, 1.0], [0.5, 0.0, 0.0]),
            ([-1.0, 0.25, 1.0], [0.0, 0.25, 0.0]),
            ([1.0, 1.0, 0.0], [0.5, 0.5, 0.0]),
            ([0.25, 0.25, -3.0], [0.25, 0.25, 0.0]),
        ] {
            let found = point_triangle(p, UNIT);
            assert_eq!(found.point, wanted);
            assert_eq!(found.distance_squared, dot(sub(p, wanted), sub(p, wanted)));
        }
    }

    #[test]
    fn degenerate_triangles_are_segments_and_points() {
        let (a, b) = ([0.1, 0.2, 0.3], [0.7, -0.4, 0.5]);
        let middle = lerp(a, b, 0.4);
        for p in [[0.0; 3], [1.0, 1.0, 1.0], [0.4, 0.0, 0.4]] {
            let segment = point_segment(p, a, b).distance_squared;
            for triangle in [
                [a, b, b],
                [a, a, b],
                [a, b, a],
                [a, middle, b],
                [b, a, middle],
            ] {
                let found = point_triangle(p, triangle).distance_squared;
                assert!((found - segment).abs() < 1e-15, "{triangle:?}");
            }
            let point = dot(sub(p, a), sub(p, a));
            assert_eq!(point_triangle(p, [a; 3]).distance_squared, point);
        }
    }

    #[test]
    fn corners_are_at_distance_0_exactly() {
        for i in 0..1000 {
            let mut rng = Rng::new(2, i);
            let t: [Vec3; 3] = std::array::from_fn(|_| std::array::from_fn(|_| rng.unit()));
            for corner in t {
                assert_eq!(point_triangle(corner, t).distance_squared, 0.0, "{t:?}");
            }
        }
    }

    /// Golden section in both barycentric directions: slow, and other code than the code judged.
    fn by_search(p: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
        let to_segment = |u: Vec3, v: Vec3| {
            minimum(|t| {
                let gap = sub(p, lerp(u, v, t));
                dot(gap, gap)
            })
        };
        minimum(|t| to_segment(lerp(a, b, t), lerp(a, c, t)))
    }

    fn minimum(f: impl Fn(f64) -> f64) -> f64 {
        let ratio = (5f64.sqrt() - 1.0) / 2.0;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let (l, h) = (high - ratio * (high - low), low + ratio * (high - low));
            if f(l) < f(h) { high = h } else { low = l }
        }
        f(low).min(f(high)).min(f(0.0)).min(f(1.0))
    }

    proptest! {
        #[test]
        fn triangles_of_any_shape_agree_with_a_search(seed in any::<u64>(), flat in 0i32..16, far in 0i32..4) {
            let mut rng = Rng::new(seed, 0);
            let mut t: [Vec3; 3] = std::array::from_fn(|_| std::array::from_fn(|_| rng.range(-1.0, 1.0)));
            // From well shaped down to needles and caps.
            let squeeze = 10f64.powi(-flat);
            let on_line = if seed % 2 == 0 { t[0] } else { lerp(t[0], t[1], 0.3) };
            t[2] = lerp(on_line, t[2], squeeze);
            t.rotate_left((seed % 3) as usize);
            let p: Vec3 = std::array::from_fn(|_| rng.range(-1.0, 1.0) * 10f64.powi(-far));
            let found = point_triangle(p, t);
            let wanted = by_search(p, t).sqrt();
            let distance = found.distance_squared.sqrt();
            prop_assert!((distance - wanted).abs() < 2e-8, "{distance} {wanted}");
            let gap = sub(p, found.point);
            prop_assert!((dot(gap, gap).sqrt() - distance).abs() < 1e-15);
        }
    }
}
