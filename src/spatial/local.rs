//! A frame near a model, in which its coordinates are neither far from 0 nor tiny nor huge.

use super::aabb::Aabb;
use crate::numeric::vector::{Vec3, add, sub};

/// A local origin and a power of two: `local = (p - origin) / 2^exponent`.
///
/// Local coordinates are below 2 in size, so that squares and cubes of lengths neither over- nor
/// underflow. The scaling is exact, and so is the shift wherever the model is far from 0 for its
/// size. The origin is a multiple of a power of two no smaller than the model: a model around 0
/// is not shifted at all, and moving a model by such multiples changes no local coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalFrame {
    origin: Vec3,
    exponent: i32,
}

impl LocalFrame {
    /// The frame of a model with these bounds; the identity for empty bounds.
    pub fn around(bounds: Aabb) -> Self {
        let mut frame = LocalFrame {
            origin: [0.0; 3],
            exponent: 0,
        };
        if bounds.is_empty() {
            return frame;
        }
        // Half the extent does not overflow where the extent would.
        let half = (0..3)
            .map(|a| bounds.hi[a] * 0.5 - bounds.lo[a] * 0.5)
            .fold(0.0, f64::max);
        let centre = bounds.centre();
        if half == 0.0 {
            frame.origin = centre;
            return frame;
        }
        frame.exponent = exponent_above(half) + 1;
        frame.origin = centre.map(|c| {
            let steps = times_power_of_two(c, -frame.exponent).round();
            let origin = times_power_of_two(steps, frame.exponent);
            if origin.is_finite() { origin } else { 0.0 }
        });
        frame
    }

    /// A local length of 1 is `2^exponent` in the model's unit.
    pub fn exponent(&self) -> i32 {
        self.exponent
    }

    /// A point of the model in local coordinates.
    #[inline]
    pub fn to_local(&self, p: Vec3) -> Vec3 {
        sub(p, self.origin).map(|c| times_power_of_two(c, -self.exponent))
    }

    /// The point of the model with these local coordinates.
    #[inline]
    pub fn from_local(&self, p: Vec3) -> Vec3 {
        add(p.map(|c| times_power_of_two(c, self.exponent)), self.origin)
    }

    /// A local length in the model's unit.
    pub fn length(&self, local: f64) -> f64 {
        times_power_of_two(local, self.exponent)
    }

    /// A local area in the square of the model's unit.
    pub fn area(&self, local: f64) -> f64 {
        times_power_of_two(local, 2 * self.exponent)
    }

    /// A local volume in the cube of the model's unit.
    pub fn volume(&self, local: f64) -> f64 {
        times_power_of_two(local, 3 * self.exponent)
    }
}

/// A frame in which the corner of a model's box is at 0 and its longest side is from 1/2 to 1.
///
/// The difference from the corner moves with the model, and scaling by powers of two is exact: what
/// is left depends on neither place nor size, and where the differences are exact, on nothing else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerFrame {
    origin: Vec3,
    exponent: i32,
}

impl CornerFrame {
    /// The frame of points in this box, which is finite; the identity for an empty one.
    pub fn around(bounds: Aabb) -> Self {
        CornerFrame::with_margin(bounds, 0.0)
    }

    /// The frame of points in this box of which each has something so long around it: the corner is
    /// that of the points, the longest side with the margin is from 1/2 to 1.
    pub fn with_margin(points: Aabb, margin: f64) -> Self {
        let side = |of: fn(f64, f64) -> f64| {
            let sides = (0..3).map(|a| of(points.hi[a], points.lo[a]));
            sides.fold(0.0, f64::max)
        };
        let longest = side(|hi, lo| hi - lo) + 2.0 * margin;
        // Half the extent does not overflow where the extent does.
        let half = side(|hi, lo| hi * 0.5 - lo * 0.5) + margin;
        let exponent = match longest {
            0.0 => 0,
            _ if longest.is_finite() => exponent_above(longest),
            _ => exponent_above(half) + 1,
        };
        CornerFrame {
            origin: match points.is_empty() {
                true => [0.0; 3],
                false => points.lo,
            },
            exponent,
        }
    }

    /// A point of the model in local coordinates.
    #[inline]
    pub fn to_local(&self, p: Vec3) -> Vec3 {
        std::array::from_fn(|a| {
            let difference = p[a] - self.origin[a];
            // Halves where the difference overflows and the result does not; and 0 has one sign.
            if difference.is_finite() {
                times_power_of_two(difference, -self.exponent) + 0.0
            } else {
                times_power_of_two(p[a] * 0.5 - self.origin[a] * 0.5, 1 - self.exponent)
            }
        })
    }

    /// The point of the model with these local coordinates.
    pub fn from_local(&self, p: Vec3) -> Vec3 {
        add(p.map(|c| self.length_from_local(c)), self.origin)
    }

    /// A length of the model in the local unit.
    pub fn length_to_local(&self, length: f64) -> f64 {
        times_power_of_two(length, -self.exponent)
    }

    /// A local length in the model's unit.
    pub fn length_from_local(&self, length: f64) -> f64 {
        times_power_of_two(length, self.exponent)
    }
}

/// The smallest `e` with `value < 2^e`, for a positive finite value.
pub fn exponent_above(value: f64) -> i32 {
    let biased = |v: f64| (v.to_bits() >> 52 & 0x7ff) as i32;
    match biased(value) {
        0 => biased(value * power_of_two(64)) - 64 - 1022,
        b => b - 1022,
    }
}

/// `value * 2^exponent`: exact unless the result over- or underflows.
#[inline]
pub fn times_power_of_two(mut value: f64, mut exponent: i32) -> f64 {
    while exponent.abs() > 1000 {
        let step = exponent.signum() * 1000;
        value *= power_of_two(step);
        exponent -= step;
        if value == 0.0 || !value.is_finite() {
            return value;
        }
    }
    value * power_of_two(exponent)
}

/// `2^exponent` for exponents of normal numbers.
#[inline]
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_bracket_their_values() {
        for value in [1.0, 1.5, 0.1, 3e300, 2e-300, 5e-324, 1e-310, f64::MAX] {
            let e = exponent_above(value);
            assert!(times_power_of_two(value, -e) < 1.0, "{value:e}");
            assert!(times_power_of_two(value, 1 - e) >= 1.0, "{value:e}");
        }
    }

    #[test]
    fn local_coordinates_are_near_one_and_come_back() {
        for (lo, hi) in [
            (-1.0, 1.0),
            (1e9, 1e9 + 1.0),
            (1e-300, 3e-300),
            (-1e300, 1e300),
            (-1.7e308, 1.7e308),
            (7.0, 7.0),
            (-5e-324, 5e-324),
        ] {
            let frame = LocalFrame::around(Aabb {
                lo: [lo; 3],
                hi: [hi; 3],
            });
            for p in [lo, hi] {
                let local = frame.to_local([p; 3]);
                assert!(local[0].abs() <= 2.0, "{p:e} became {}", local[0]);
                let back = frame.from_local(local)[0];
                assert!(
                    (back - p).abs() <= (hi - lo).abs() * 1e-15,
                    "{p:e} {back:e}"
                );
            }
        }
    }

    #[test]
    fn a_corner_frame_depends_on_neither_place_nor_size() {
        for (lo, hi, scale, shift) in [
            (0.0, 3.0, 2f64.powi(-1000), 0.0),
            (0.0, 3.0, 1.0, 4096.0),
            (0.0, 3.0, 2f64.powi(1000), 0.0),
            (-1.5e308, 1.5e308, 1.0, 0.0),
            (0.0, 3.0, 5e-324, 0.0),
        ] {
            let [lo, hi] = [lo, hi].map(|c| c * scale + shift);
            let frame = CornerFrame::around(Aabb {
                lo: [lo; 3],
                hi: [hi; 3],
            });
            let side = frame.to_local([hi; 3])[0];
            assert!((0.5..=1.0).contains(&side), "{lo:e} to {hi:e} gives {side}");
            assert_eq!(frame.to_local([lo; 3]), [0.0; 3]);
            if (hi - lo).is_finite() {
                assert_eq!(side, 0.75);
                assert_eq!(frame.from_local([side; 3]), [hi; 3]);
                assert_eq!(frame.length_from_local(frame.length_to_local(hi)), hi);
            }
        }
        let wide = CornerFrame::with_margin(
            Aabb {
                lo: [1.0; 3],
                hi: [2.0; 3],
            },
            3.25,
        );
        assert_eq!(wide.to_local([1.0, 2.0, 9.0]), [0.0, 0.125, 1.0]);
    }

    #[test]
    fn a_model_around_the_origin_stays_there() {
        let frame = LocalFrame::around(Aabb {
            lo: [-0.9, 0.1, -2.0],
            hi: [1.0, 0.3, 2.0],
        });
        assert_eq!(
            frame.to_local([0.7, 0.3, 0.1]).map(|c| frame.length(c)),
            [0.7, 0.3, 0.1]
        );
    }
}
