//! Four triangles of a leaf in 96 bytes: corners on a lattice of the leaf's own, to decide at once
//! which of them a ray misses and which it meets beyond doubt.

use super::triangle::Sheared;
use crate::numeric::vector::{Vec3, sub};
use crate::spatial::aabb::Aabb;
use crate::spatial::local::{exponent_above, times_power_of_two};
use wide::{f32x4, i32x4};

/// Digits of a coordinate on the lattice.
const DIGITS: i32 = 16;
/// The finest lattice: what a ray itself may be off by stays below it.
const FINEST: i32 = -40;
/// Marks a place without a triangle.
const MISSING: u32 = 1 << 31;

/// Four triangles whose corners are rounded to a lattice, so that a leaf takes two lines of cache.
///
/// All four lanes of a word hold two coordinates: of each axis that of the first and the second
/// corner; the third corner's x and y; its z, and [`MISSING`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Packet {
    corner: [f32; 3],
    /// The lattice's step, a power of two.
    step: f32,
    words: [i32x4; 5],
}

const _: () = assert!(size_of::<Packet>() == 96);

impl Packet {
    pub fn new(triangles: [Option<[Vec3; 3]>; 4]) -> Self {
        let bounds = Aabb::around(triangles.iter().flatten().flatten());
        let corner = bounds.lo.map(|c| (c as f32).next_down());
        let from = corner.map(f64::from);
        let size = sub(bounds.hi, from).iter().fold(0.0, |s: f64, d| s.max(*d));
        // A little more, so that the largest coordinate is not rounded up to one more digit.
        let larger = size * (1.0 + 2.0 / f64::from(1 << DIGITS));
        let exponent = (exponent_above(larger) - DIGITS).max(FINEST);
        let place = |c: f64| times_power_of_two(c, -exponent).round() as u32;
        let mut words = [[0u32; 4]; 5];
        for (lane, triangle) in triangles.iter().enumerate() {
            let Some([a, b, c]) = triangle.map(|t| t.map(|p| sub(p, from).map(place))) else {
                words[4][lane] = MISSING;
                continue;
            };
            for axis in 0..3 {
                words[axis][lane] = a[axis] | b[axis] << DIGITS;
            }
            words[3][lane] = c[0] | c[1] << DIGITS;
            words[4][lane] = c[2];
        }
        Packet {
            corner,
            step: times_power_of_two(1.0, exponent) as f32,
            words: words.map(|w| i32x4::new(w.map(|v| v as i32))),
        }
    }
}

/// What is known of the triangles of a packet, as bits.
pub(super) struct Verdict {
    /// Those that the ray may meet.
    pub open: u32,
    /// Those of them that it meets beyond doubt.
    pub met: u32,
}

/// A ray made ready for packets.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    axes: [usize; 3],
    /// By how many bits a third corner's coordinates are shifted in their words.
    shifts: [i32; 2],
    origin: Vec3,
    shear: [f64; 2],
    error: f64,
}

impl Filter {
    /// The ray from `origin`, off by up to `error`, as `ray` is sheared.
    #[inline(always)]
    pub fn new(ray: &Sheared, origin: Vec3, error: f64) -> Self {
        let shift = |a: usize| if a == 1 { DIGITS } else { 0 };
        Filter {
            axes: ray.axes,
            shifts: [shift(ray.axes[0]), shift(ray.axes[1])],
            origin: ray.axes.map(|a| origin[a]),
            shear: ray.shear,
            error,
        }
    }

    /// Which triangles the ray meets where its main coordinate, from the origin, is in `span`.
    ///
    /// On the lattice a corner is off by half a step along each axis, and as much again by the
    /// shear; to which `error` adds. So an edge function, the difference of two products of
    /// sheared coordinates, is off by `spread` times the sum of these at most, and a little more
    /// where they are so large that `f32` rounds them. Where all have one sign, what the main
    /// coordinate is off by is the share of that error in their sum, of the lattice's extent.
    #[inline(always)]
    pub fn look(&self, packet: &Packet, span: [f64; 2]) -> Verdict {
        let [x, y, z] = self.axes;
        let finer = f64::from(f32::from_bits((254 << 23) - packet.step.to_bits()));
        let along = f64::from(packet.corner[z]) - self.origin[2];
        let across = |i: usize| {
            let o = self.origin[i] + along * self.shear[i] - f64::from(packet.corner[self.axes[i]]);
            f32x4::splat((o * finer) as f32)
        };
        let (ox, oy) = (across(0), across(1));
        let shear = self.shear.map(|s| f32x4::splat(s as f32));
        let fuzz = (self.error * finer) as f32 * 4.0;
        let spread = f32x4::splat(1.2 + fuzz);

        let low = i32x4::splat((1 << DIGITS) - 1);
        let float = f32x4::from_i32x4;
        let words = &packet.words;
        let first = |axis: usize| float(words[axis] & low);
        let second = |axis: usize| float((words[axis] >> DIGITS) & low);
        let third = |axis: usize, shift: i32| float((words[3 + axis / 2] >> shift) & low);
        let see = |px: f32x4, py: f32x4, pz: f32x4| {
            [(px - ox) - shear[0] * pz, (py - oy) - shear[1] * pz]
        };
        let az = first(z);
        let bz = second(z);
        let cz = third(z, if z == 1 { DIGITS } else { 0 });
        let a = see(first(x), first(y), az);
        let b = see(second(x), second(y), bz);
        let c = see(third(x, self.shifts[0]), third(y, self.shifts[1]), cz);
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let sum =
            ((a[0].abs() + a[1].abs()) + (b[0].abs() + b[1].abs())) + (c[0].abs() + c[1].abs());
        let error = sum * (spread + sum * f32x4::splat(8.0 * f32::EPSILON))
            + f32x4::splat(4.0) * (spread * spread);
        let least = u.fast_min(v).fast_min(w);
        let most = u.fast_max(v).fast_max(w);
        let total = u + v + w;
        let inverse = f32x4::ONE / total;
        let depth = (u * az + v * bz + w * cz) * inverse;
        let off =
            error * inverse.abs() * f32x4::splat((2 << DIGITS) as f32) + f32x4::splat(2.0 + fuzz);
        let end = |i: usize| f32x4::splat(((span[i] - along) * finer) as f32);
        let (start, end) = (end(0), end(1));
        // All comparisons are false for NaN.
        let apart = (depth + off).simd_lt(start) | (depth - off).simd_gt(end);
        let within = (depth - off).simd_ge(start) & (depth + off).simd_le(end);
        let seen = total.abs().simd_gt(error * f32x4::splat(8.0));
        let touched = least.simd_ge(-error) | most.simd_le(error);
        let crossed = least.simd_gt(error) | most.simd_lt(-error);
        let missing = words[4].to_bitmask();
        Verdict {
            open: touched.to_bitmask() & !(apart & seen).to_bitmask() & !missing,
            met: (crossed & within & seen).to_bitmask() & !missing,
        }
    }
}
