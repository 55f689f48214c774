//! Pictures of what was made.
//!
//! A picture is drawn deferred: the z-buffer of [`crate::camera::raster`] says what each of four
//! samples per pixel shows, then light is worked out per sample. There are no rays and no random
//! numbers. [`shadow`] and [`splats`] trace rays instead, whose random ends are drawn by the pixel's
//! index. Either way
//! equal input gives equal bytes on any number of threads.

mod ground;
mod light;
mod occlusion;
pub mod preview;
pub mod shade;
pub mod shadow;
pub mod splats;
pub mod view;

/// A point or a vector in view space, in the precision of a picture.
pub(crate) type Vec3f = [f32; 3];

#[inline]
pub(crate) fn dot(a: Vec3f, b: Vec3f) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn sub(a: Vec3f, b: Vec3f) -> Vec3f {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(crate) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// 0 below `from`, 1 above `to`, smooth in between.
#[inline]
pub(crate) fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The 16 offsets of a 4 x 4 tile of samples, from 0 up to 15/16, as evenly spread as can be
/// (Bayer 1973). Whatever is drawn with them is evened out by the mean over any 4 x 4 samples.
#[inline]
pub(crate) fn tile(x: usize, y: usize) -> f32 {
    const ORDER: [u8; 16] = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5];
    f32::from(ORDER[(y % 4) * 4 + x % 4]) / 16.0
}
