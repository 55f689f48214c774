//! Four triangles in `f32`, to rule out at once those that a ray misses by far.

use super::triangle::Sheared;
use crate::numeric::vector::{Vec3, sub};
use wide::f32x4;

/// What rounding to `f32` moves a sheared corner by, for coordinates below 2 and origins below 4:
/// thirty halves of an ulp of 1, rounded up.
const SLACK: f64 = 1.0 / (1u64 << 19) as f64;

/// Four triangles; missing ones have corners that are NaN, which no ray meets.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(super) struct Packet {
    /// Of each corner its three coordinates.
    corners: [[f32x4; 3]; 3],
    /// The largest side of each triangle's box, rounded up.
    sizes: f32x4,
}

impl Packet {
    pub fn new(triangles: [Option<[Vec3; 3]>; 4]) -> Self {
        let lanes = |value: &dyn Fn(&[Vec3; 3]) -> f32| {
            f32x4::new(triangles.map(|t| t.as_ref().map_or(f32::NAN, value)))
        };
        Packet {
            corners: std::array::from_fn(|corner| {
                std::array::from_fn(|axis| lanes(&|t| t[corner][axis] as f32))
            }),
            sizes: lanes(&|[a, b, c]| {
                let sides = [sub(*a, *b), sub(*b, *c), sub(*c, *a)];
                let largest = sides.iter().flatten().fold(0.0, |s: f64, d| s.max(d.abs()));
                (largest as f32).next_up()
            }),
        }
    }
}

/// A ray made ready for packets.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    axes: [usize; 3],
    origin: [f32x4; 3],
    shear: [f32x4; 2],
    /// Error of an edge function for a triangle of size `s`: `(constant + s (linear + s square))`.
    constant: f32x4,
    linear: f32x4,
}

/// Rounding of an edge function itself, relative to the square of a triangle's size.
const SQUARE: f32 = 16.0 * f32::EPSILON;

impl Filter {
    /// The ray from `origin`, below 4 in size and off by up to `error`, as `ray` is sheared.
    pub fn new(ray: &Sheared, origin: Vec3, error: f64) -> Self {
        let slack = SLACK + 2.0 * error;
        let splat = |v: f64| f32x4::splat(v as f32);
        Filter {
            axes: ray.axes,
            origin: ray.axes.map(|a| splat(origin[a])),
            shear: ray.shear.map(splat),
            constant: splat(20.0 * slack * slack),
            linear: splat(10.0 * slack),
        }
    }

    /// The triangles, as bits, that the ray's line may meet.
    ///
    /// If it meets one, its sheared corners are within twice the triangle's size `s` of the ray,
    /// and each coordinate is off by `slack` at most; then an edge function, the difference of two
    /// products of these, is off by less than `8 slack s + 14 slack^2 + 2^-20 s^2`.
    #[inline(always)]
    pub fn candidates(&self, packet: &Packet) -> u32 {
        let [x, y, z] = self.axes;
        let see = |corner: usize| {
            let p = &packet.corners[corner];
            let along = p[z] - self.origin[2];
            [
                (p[x] - self.origin[0]) - self.shear[0] * along,
                (p[y] - self.origin[1]) - self.shear[1] * along,
            ]
        };
        let [a, b, c] = [see(0), see(1), see(2)];
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let square = f32x4::splat(SQUARE);
        let error = self.constant + packet.sizes * (self.linear + packet.sizes * square);
        let least = u.fast_min(v).fast_min(w);
        let most = u.fast_max(v).fast_max(w);
        // Both comparisons are false for NaN.
        (least.simd_ge(-error) | most.simd_le(error)).to_bitmask()
    }
}
