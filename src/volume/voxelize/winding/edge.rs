//! One border edge: the strip from it to infinity, and what it sweeps as the eye moves.

use super::super::lines::beside;
use crate::mesh::distance::point_segment;
use crate::numeric::predicates::{orient2d, orient3d};
use crate::numeric::vector::{Vec3, cross, dot, length, scale, sub};
use std::f64::consts::PI;

/// Roundings of an angle between unit vectors, generously.
const ANGLE: f64 = 16.0 * f64::EPSILON;
/// A path along which rounding adds up to more than this is not followed.
const LOST: f64 = 1e-7;

/// A border edge in grid coordinates; it counts `times`-fold.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// Where it starts.
    pub a: Vec3,
    /// Where it ends.
    pub b: Vec3,
    /// How much more often the surface passes it this way than the other; never 0.
    pub times: f64,
}

/// What a path past an edge sweeps, and how wrong rounding may have made it.
#[derive(Debug, Clone, Copy)]
pub struct Swept {
    /// The share in the winding number.
    pub value: f64,
    /// Its error.
    pub rounding: f64,
}

impl Edge {
    /// The share of the strip from this edge to infinity along +x in the winding number at `p`.
    pub fn taken(&self, p: Vec3) -> f64 {
        let (u, v) = (sub(self.a, p), sub(self.b, p));
        let (lu, lv) = (length(u), length(v));
        let turn = self.turn(p);
        if turn == 0 || lu == 0.0 || lv == 0.0 {
            return 0.0;
        }
        // On the ray from an end the strip takes what it takes beside it, on the side to which
        // `beside` moves the point, +y: half of the lune between the ray and the strip.
        let on_ray = |w: Vec3| w[1] == 0.0 && w[2] == 0.0 && w[0] < 0.0;
        for (end, other) in [(u, v), (v, u)] {
            if on_ray(end) {
                let lune = other[2].abs().atan2(-other[1]);
                return self.times * lune * f64::from(turn) / (2.0 * PI);
            }
        }
        // Van Oosterom and Strackee (1983), with the unit vector of +x as the third corner.
        // The exact turn gives the sign, also to a volume that is rounding error or 0.
        let volume = cross(v, u)[0].abs() / (lu * lv);
        let cosines = 1.0 + dot(u, v) / (lu * lv) + u[0] / lu + v[0] / lv;
        self.times * volume.copysign(f64::from(turn)).atan2(cosines) / (2.0 * PI)
    }

    /// On which side of the plane of the strip `p` is; 0 only where the edge runs along x.
    #[inline]
    pub fn turn(&self, p: Vec3) -> i32 {
        // The strip is wound against the edge: b, a, infinity.
        beside([self.b[1], self.b[2]], [self.a[1], self.a[2]], [p[1], p[2]])
    }

    /// How the strip's share jumps between two points, in units of `times`, beyond what is swept on
    /// the straight way between them: -1, 0 or 1, exact.
    ///
    /// Both ends are moved by (e, e^2) in y and z, as [`beside`] moves them.
    pub fn jump(&self, from: Vec3, to: Vec3) -> i32 {
        let way = self.turn(to) - self.turn(from);
        if way == 0 {
            return 0;
        }
        let (a, b) = ([self.a[1], self.a[2]], [self.b[1], self.b[2]]);
        let (p, q) = ([from[1], from[2]], [to[1], to[2]]);
        if left(p, q, a) == left(p, q, b) {
            return 0;
        }
        // The lines cross when seen along x. The strip is passed where the way runs on the far side.
        let way = way / 2;
        if orient3d(from, to, self.a, self.b) == way {
            way
        } else {
            0
        }
    }

    /// The share of the parallelogram that this edge sweeps when the eye moves `from` a point `to`
    /// another, as long as the edge is apart from the way between them.
    ///
    /// Summed over a closed border this is the change of the sum of [`Edge::taken`], up to
    /// [`Edge::jump`]; edge by edge it is not, since a strip also turns with the rays that bound it,
    /// which cancel only among neighbours. So some edges can be followed and others not.
    pub fn swept(&self, from: Vec3, to: Vec3) -> f64 {
        let [(v1, c1), (v2, c2)] = self.half_angles(from, to);
        // A flat quadrilateral has a solid angle below 2 pi: one arc tangent does for both halves.
        self.times * angle(v1 * c2 + v2 * c1, c1 * c2 - v1 * v2) / (2.0 * PI)
    }

    /// The same for any edge, or `None` where the way passes it so near that rounding decides.
    pub fn swept_near(&self, from: Vec3, to: Vec3) -> Option<Swept> {
        let way = sub(to, from);
        // Angles are lost where an end of one comes near the other.
        let gap = |p: Vec3, a: Vec3, b: Vec3| point_segment(p, a, b).distance_squared;
        let nearest = gap(self.a, from, to)
            .min(gap(self.b, from, to))
            .min(gap(from, self.a, self.b))
            .min(gap(to, self.a, self.b))
            .sqrt();
        let reach = length(sub(self.a, from)) + length(sub(self.b, from)) + length(way);
        let rounding = self.times.abs() * ANGLE * reach / nearest;
        // Not a number is lost as well.
        if rounding.is_nan() || rounding > LOST {
            return None;
        }
        // On which side they pass is exact, so that it agrees with `jump`.
        let side = -orient3d(from, to, self.a, self.b);
        let halves = self.half_angles(from, to);
        let angles = halves.map(|(v, c)| match side {
            0 => 0.0f64.atan2(c),
            _ => v.abs().copysign(f64::from(side)).atan2(c),
        });
        let angle = angles[0] + angles[1];
        if side == 0 && angle != 0.0 {
            return None;
        }
        let value = self.times * angle / (2.0 * PI);
        Some(Swept { value, rounding })
    }

    /// Half the solid angles of the two triangles of the swept parallelogram, each as the sine and
    /// cosine of an angle, times a positive number (Van Oosterom and Strackee 1983).
    #[inline]
    fn half_angles(&self, from: Vec3, to: Vec3) -> [(f64, f64); 2] {
        let [a, b] = [sub(self.a, from), sub(self.b, from)];
        let [a1, b1] = [sub(self.a, to), sub(self.b, to)];
        let (la, lb, la1, lb1) = (length(a), length(b), length(a1), length(b1));
        let [a, b, a1, b1] = [
            scale(a, 1.0 / la),
            scale(b, 1.0 / lb),
            scale(a1, 1.0 / la1),
            scale(b1, 1.0 / lb1),
        ];
        // a . (b x b1) and a . (b1 x a1) without the cancellation of a short way.
        let along = dot(sub(from, to), cross(a, sub(self.b, self.a)));
        let diagonal = 1.0 + dot(a, b1);
        [
            (along / (lb * lb1), diagonal + dot(a, b) + dot(b, b1)),
            (along / (la1 * lb1), diagonal + dot(b1, a1) + dot(a1, a)),
        ]
    }
}

/// The angle of a vector; small ones by the series of the arc tangent, of which nothing that counts
/// is left out.
#[inline]
fn angle(y: f64, x: f64) -> f64 {
    let small = x > 0.0 && y.abs() <= 0.05 * x;
    if !small {
        return y.atan2(x);
    }
    let t = y / x;
    let s = t * t;
    let sum = 1.0 / 9.0 - s * (1.0 / 11.0);
    let sum = 1.0 / 5.0 - s * (1.0 / 7.0 - s * sum);
    t * (1.0 - s * (1.0 / 3.0 - s * sum))
}

/// The side of the line `p q` on which `c` lies when the line is moved by (e, e^2); 0 only where `p`
/// is `q`.
#[inline]
fn left(p: [f64; 2], q: [f64; 2], c: [f64; 2]) -> i32 {
    let turn = orient2d(p, q, c);
    let compare = |x: f64, y: f64| i32::from(x > y) - i32::from(x < y);
    if turn != 0 {
        turn
    } else if p[1] != q[1] {
        compare(q[1], p[1])
    } else {
        compare(p[0], q[0])
    }
}
