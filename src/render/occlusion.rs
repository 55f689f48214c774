//! Ambient occlusion in screen space, and the filter that evens out samples.

use super::{Vec3f, dot, mix, sub, tile};
use crate::camera::raster::{GBuffer, NOTHING};
use crate::camera::{Camera, Size};
use crate::numeric::vector::{Vec3, cross, normalize};
use rayon::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI};

/// Planes through the viewing axis that each sample looks along; the 4 x 4 samples of a tile look
/// along different ones.
const SLICES: usize = 1;

/// Places looked at on either side in each plane.
const STEPS: usize = 9;

/// The samples of a picture in view space.
pub(super) struct Samples {
    /// Columns and rows.
    pub size: Size,
    /// Index of the triangle, [`NOTHING`] where the ground shows.
    pub triangle: Vec<u32>,
    /// Where the surface is; a place on the ground where there is none.
    pub place: Vec<Vec3f>,
    /// Its unit normal, towards the viewer; 0 where there is none.
    pub normal: Vec<Vec3f>,
}

impl Samples {
    /// The samples of a buffer. `ground` gives the place on the ground behind a place on the screen.
    pub fn new(
        buffer: GBuffer,
        camera: &Camera,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        ground: impl Fn(Vec3) -> Vec3f + Sync,
    ) -> Samples {
        let size = buffer.size;
        let sample = |at: usize| -> (Vec3f, Vec3f) {
            let [x, y] = [at % size.width, at / size.width].map(|c| c as f64 + 0.5);
            let id = buffer.triangle[at];
            if id == NOTHING {
                return (
                    ground(camera.from_screen(x, y, camera.distance, size)),
                    [0.0; 3],
                );
            }
            let place = camera.from_screen(x, y, f64::from(buffer.depth[at]), size);
            let [a, b, c] = triangles[id as usize].map(|v| camera.to_view(positions[v as usize]));
            let along = |p: Vec3, q: Vec3| crate::numeric::vector::sub(q, p);
            let normal = normalize(cross(along(a, b), along(a, c)));
            let towards = crate::numeric::vector::dot(normal, camera.to_viewer(place));
            let sign = if towards < 0.0 { -1.0 } else { 1.0 };
            (place.map(|v| v as f32), normal.map(|v| (v * sign) as f32))
        };
        let (place, normal) = (0..size.width * size.height)
            .into_par_iter()
            .map(sample)
            .unzip();
        Samples {
            size,
            triangle: buffer.triangle,
            place,
            normal,
        }
    }

    /// Whether a sample shows the surface.
    #[inline]
    pub fn is_hit(&self, at: usize) -> bool {
        self.triangle[at] != NOTHING
    }

    /// The share of the sky, weighted by the cosine, that is open above a sample, 0 to 1.
    ///
    /// What is further than `radius` (in units) does not count. In each plane through the viewing
    /// axis the horizon is sought on either side; the light between the two is a closed formula.
    ///
    /// Jimenez, Wu, Pesce and Jarabo, "Practical real-time strategies for accurate indirect
    /// occlusion" (2016).
    pub fn ambient(&self, at: usize, camera: &Camera, radius: f32) -> f32 {
        let (x, y) = (at % self.size.width, at / self.size.width);
        let (place, normal) = (self.place[at], self.normal[at]);
        let viewer = camera.to_viewer(place.map(f64::from)).map(|v| v as f32);
        let depth = camera.distance - f64::from(place[2]);
        let reach = radius * camera.magnification(self.size, depth) as f32;
        let turn = tile(x, y);
        let jitter = tile(y + 1, x + 2);
        let mut open = 0.0;
        for slice in 0..SLICES {
            let angle = (slice as f32 + turn) / SLICES as f32 * PI;
            let (sin, cos) = angle.sin_cos();
            let along = [cos, sin, 0.0];
            let axis = [
                along[1] * viewer[2] - along[2] * viewer[1],
                along[2] * viewer[0] - along[0] * viewer[2],
                along[0] * viewer[1] - along[1] * viewer[0],
            ];
            let off = dot(normal, axis) / dot(axis, axis).max(1e-12);
            let in_plane: Vec3f = std::array::from_fn(|a| normal[a] - axis[a] * off);
            let length = dot(in_plane, in_plane).sqrt().max(1e-6);
            let cos_n = (dot(in_plane, viewer) / length).clamp(-1.0, 1.0);
            let tilt = cos_n.acos() * dot(along, in_plane).signum();
            let sin_n = tilt.sin();
            let mut horizon = [0.0; 2];
            for (side, sign) in [1.0, -1.0f32].into_iter().enumerate() {
                // The cosine of the tilt and a right angle more or less.
                let low = -sign * sin_n;
                let mut highest = low;
                for step in 0..STEPS {
                    let far = (step as f32 + jitter) / STEPS as f32;
                    let pixels = (far * far * reach + 1.4) * sign;
                    let Some(other) = self.at(x as f32 + cos * pixels, y as f32 - sin * pixels)
                    else {
                        break;
                    };
                    let to = sub(self.place[other], place);
                    let distance = dot(to, to).sqrt().max(1e-9);
                    let weight = ((radius - distance) / (0.7 * radius)).clamp(0.0, 1.0);
                    let cosine = dot(to, viewer) / distance;
                    highest = highest.max(mix(low, cosine, weight));
                }
                horizon[side] = highest.clamp(-1.0, 1.0).acos() * sign;
            }
            for h in horizon {
                let h = tilt + (h - tilt).clamp(-FRAC_PI_2, FRAC_PI_2);
                let arc = cos_n + 2.0 * h * sin_n - (2.0 * h - tilt).cos();
                open += length * arc * 0.25;
            }
        }
        (open / SLICES as f32).clamp(0.0, 1.0)
    }

    /// The sample nearest to a place on the screen, if there is one.
    #[inline]
    fn at(&self, x: f32, y: f32) -> Option<usize> {
        let (x, y) = ((x + 0.5).floor(), (y + 0.5).floor());
        let inside =
            x >= 0.0 && y >= 0.0 && x < self.size.width as f32 && y < self.size.height as f32;
        inside.then(|| y as usize * self.size.width + x as usize)
    }

    /// The mean of values over the samples around each that lie on the same smooth surface.
    ///
    /// The window is four samples wide, its ends taken by half: what repeats every four is gone.
    pub fn smoothed(&self, values: &[[f32; 2]], camera: &Camera) -> Vec<[f32; 2]> {
        const ENDS: [f32; 5] = [0.5, 1.0, 1.0, 1.0, 0.5];
        let (width, height) = (self.size.width as isize, self.size.height as isize);
        let pixel =
            (camera.unit / camera.magnification(self.size, camera.distance) / camera.unit) as f32;
        let mean = |at: usize| {
            if !self.is_hit(at) && values[at] == [0.0, 1.0] {
                // White ground: most of many pictures.
                return values[at];
            }
            let (x, y) = (at as isize % width, at as isize / width);
            let (mut sum, mut weights) = ([0.0; 2], 0.0);
            for (j, wy) in (-2..=2).zip(ENDS) {
                for (i, wx) in (-2..=2).zip(ENDS) {
                    if !(0..width).contains(&(x + i)) || !(0..height).contains(&(y + j)) {
                        continue;
                    }
                    let other = ((y + j) * width + x + i) as usize;
                    if self.is_hit(at) != self.is_hit(other) {
                        continue;
                    }
                    let weight = wx * wy * self.likeness(at, other, pixel);
                    for c in 0..2 {
                        sum[c] += weight * values[other][c];
                    }
                    weights += weight;
                }
            }
            sum.map(|s| s / weights)
        };
        (0..values.len()).into_par_iter().map(mean).collect()
    }

    /// 1 for samples of one smooth surface, 0 for samples of different ones.
    #[inline]
    fn likeness(&self, at: usize, other: usize, pixel: f32) -> f32 {
        if !self.is_hit(at) || at == other {
            return 1.0;
        }
        let apart = sub(self.place[other], self.place[at]);
        let off_plane = dot(apart, self.normal[at]).abs();
        let turned = dot(self.normal[at], self.normal[other]);
        let near = (1.0 - off_plane / (3.0 * pixel)).max(0.0);
        near * ((turned - 0.6) / 0.3).clamp(0.0, 1.0)
    }
}
