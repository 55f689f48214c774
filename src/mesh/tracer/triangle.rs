//! One ray against one triangle, with exact decisions.

use super::{larger, smaller};
use crate::numeric::predicates::orient2d;
use crate::numeric::vector::{Vec3, sub};
use crate::spatial::local::{exponent_above, times_power_of_two};

/// Below this share of the products that it is the difference of, a triangle's projected area has
/// lost too many digits, and is computed again with twice as many.
const CANCELLED: f64 = 1.0 / (1u64 << 16) as f64;
/// Below 2^-900 products may have underflowed.
const TINY: f64 = f64::from_bits((1023 - 900) << 52);

/// A ray seen along its own main axis.
#[derive(Debug, Clone)]
pub(super) struct Sheared {
    pub origin: Vec3,
    /// The axes across, and last the one along which the ray is steepest.
    pub axes: [usize; 3],
    /// How far the ray moves along each axis across for one step along its main axis; at most 1.
    pub shear: [f64; 2],
    /// The direction's component along the main axis.
    pub along: f64,
}

/// Where the ray meets the triangle, `origin + t direction = (1 - u - v) a + u b + v c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Meeting {
    pub t: f64,
    pub u: f64,
    pub v: f64,
}

impl Sheared {
    /// A ray whose direction is finite and not zero.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let size = direction.map(f64::abs);
        let z = (1..3).fold(0, |z, a| if size[a] > size[z] { a } else { z });
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let along = direction[z];
        Sheared {
            origin,
            axes,
            shear: [direction[axes[0]] / along, direction[axes[1]] / along],
            along,
        }
    }

    /// A point as the ray sees it: two coordinates across, 0 on the ray, and one along.
    ///
    /// A function of the point alone: triangles that share a corner see it in one place.
    #[inline(always)]
    fn see(&self, p: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        let d = sub(p, self.origin);
        [
            d[x] - self.shear[0] * d[z],
            d[y] - self.shear[1] * d[z],
            d[z],
        ]
    }

    /// Where the ray's line meets the closed triangle; `None` also where it sees no area.
    ///
    /// Each corner is rounded once, in [`Sheared::see`]; what follows is decided exactly for the
    /// rounded corners. So a line that passes a fan of triangles around a corner inside its rim
    /// meets at least one of them. Source: Woop, Benthin, Wald 2013, "Watertight ray/triangle
    /// intersection".
    #[inline(always)]
    pub fn meet(&self, corners: [Vec3; 3]) -> Option<Meeting> {
        let [a, b, c] = corners;
        let (a, b, c) = (self.see(a), self.see(b), self.see(c));
        let (cb, bc) = (c[0] * b[1], c[1] * b[0]);
        let (ac, ca) = (a[0] * c[1], a[1] * c[0]);
        let (ba, ab) = (b[0] * a[1], b[1] * a[0]);
        // Rounding is monotone: a difference that is not 0 has the sign of the exact one.
        let weights = [cb - bc, ac - ca, ba - ab];
        let least = smaller(weights[0], smaller(weights[1], weights[2]));
        let most = larger(weights[0], larger(weights[1], weights[2]));
        if least < 0.0 && most > 0.0 {
            return None;
        }
        let products = cb.abs() + bc.abs() + ac.abs() + ca.abs() + ba.abs() + ab.abs();
        let area = (weights[0] + weights[1] + weights[2]).abs();
        let lost = area <= CANCELLED * products || area < TINY;
        if lost || least == 0.0 || most == 0.0 {
            return self.meet_exactly([a, b, c]);
        }
        Some(self.at(weights, [a[2], b[2], c[2]]))
    }

    /// [`Sheared::meet`] for a line that is very close to an edge's, or sees the triangle edge-on.
    #[cold]
    fn meet_exactly(&self, [a, b, c]: [Vec3; 3]) -> Option<Meeting> {
        let differences = [
            Difference::of_products([c[0], b[1]], [c[1], b[0]]),
            Difference::of_products([a[0], c[1]], [a[1], c[0]]),
            Difference::of_products([b[0], a[1]], [b[1], a[0]]),
        ];
        let negative = differences.iter().any(|d| d.value < 0.0);
        let positive = differences.iter().any(|d| d.value > 0.0);
        if negative == positive {
            return None;
        }
        let exponent = differences
            .iter()
            .filter(|d| d.value != 0.0)
            .map(|d| d.exponent)
            .max()?;
        let weights = differences.map(|d| times_power_of_two(d.value, d.exponent - exponent));
        Some(self.at(weights, [a[2], b[2], c[2]]))
    }

    /// The point with these weights, which are not all 0 and none of which has another's sign.
    #[inline(always)]
    fn at(&self, weights: [f64; 3], along: Vec3) -> Meeting {
        let [a, b, c] = weights;
        let sum = a + b + c;
        Meeting {
            t: (a * along[0] + b * along[1] + c * along[2]) / sum / self.along,
            u: b / sum,
            v: c / sum,
        }
    }
}

/// `value * 2^exponent`, the value 0 or neither tiny nor huge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Difference {
    pub value: f64,
    exponent: i32,
}

impl Difference {
    /// `p[0] p[1] - q[0] q[1]`, of the exact sign, to two roundings, at any size.
    pub fn of_products(p: [f64; 2], q: [f64; 2]) -> Self {
        let (p, q) = (Product::new(p), Product::new(q));
        let exponent = match (p.high == 0.0, q.high == 0.0) {
            (true, _) => q.exponent,
            (_, true) => p.exponent,
            _ => p.exponent.max(q.exponent),
        };
        // A product so much smaller that scaling it underflows does not change the other's sign.
        let [p, q] = [p, q].map(|x| {
            let scaled = |v| times_power_of_two(v, x.exponent - exponent);
            [scaled(x.high), scaled(x.low)]
        });
        Difference {
            value: (p[0] - q[0]) + (p[1] - q[1]),
            exponent,
        }
    }
}

/// `(high + low) * 2^exponent` exactly, `high` from 1 to 4 in size or 0.
struct Product {
    high: f64,
    low: f64,
    exponent: i32,
}

impl Product {
    fn new(factors: [f64; 2]) -> Self {
        if factors.contains(&0.0) {
            return Product {
                high: 0.0,
                low: 0.0,
                exponent: 0,
            };
        }
        let exponents = factors.map(|f| exponent_above(f.abs()) - 1);
        let [a, b] = [0, 1].map(|i| times_power_of_two(factors[i], -exponents[i]));
        let high = a * b;
        let ([a_high, a_low], [b_high, b_low]) = (halves(a), halves(b));
        let low = ((a_high * b_high - high) + a_high * b_low + a_low * b_high) + a_low * b_low;
        Product {
            high,
            low,
            exponent: exponents[0] + exponents[1],
        }
    }
}

/// A number near 1 as the sum of two of half as many digits. Source: Dekker 1971, "A floating-point
/// technique for extending the available precision", section 5.
fn halves(a: f64) -> [f64; 2] {
    let c = a * ((1u64 << 27) + 1) as f64;
    let high = c - (c - a);
    [high, a - high]
}

/// Whether the corners lie on one line, exactly.
pub(super) fn is_degenerate(corners: [Vec3; 3]) -> bool {
    // Scaled so that products of tiny coordinates do not underflow.
    let size = corners
        .iter()
        .flatten()
        .fold(0.0, |s: f64, c| s.max(c.abs()));
    if size == 0.0 {
        return true;
    }
    let scale = -exponent_above(size);
    let [a, b, c] = corners.map(|p| p.map(|x| times_power_of_two(x, scale)));
    [(0, 1), (1, 2), (2, 0)].iter().all(|&(x, y)| {
        let flat = |p: Vec3| [p[x], p[y]];
        orient2d(flat(a), flat(b), flat(c)) == 0
    })
}
