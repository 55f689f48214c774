//! The key light: one distant lamp with a soft shadow.

use super::{Vec3f, dot};
use crate::camera::raster::rasterize;
use crate::camera::{Camera, Size};
use crate::numeric::vector::Vec3;

/// Texels along a side of the shadow map.
const MAP: usize = 1280;

/// The map sees this much, in units; the model is a ball of diameter 2.
const SEEN: f64 = 2.06;

/// Tangent of half the angle at which the lamp appears: a wide softbox.
const SOFTNESS: f32 = 0.13;

/// Samples to find what stands in the way, and to weigh it.
const SEARCH: usize = 10;
const WEIGH: usize = 12;

/// Ways that the samples are turned, one for each place in a tile.
const TURNS: usize = 16;

/// A lamp and the depth of what it sees first.
pub(super) struct KeyLight {
    /// From the model to the lamp, in the view space of the picture.
    pub direction: Vec3f,
    turn: [Vec3f; 3],
    shift: Vec3f,
    /// Distance from the lamp's plane of each texel, infinite where nothing is.
    map: Vec<f32>,
    distance: f32,
    /// For each offset, places in a disc of radius 1: those to search, then those to weigh.
    discs: [[[f32; 2]; SEARCH + WEIGH]; TURNS],
}

impl KeyLight {
    /// The lamp in a direction of the world. `centre` is the camera that frames the model, whose
    /// target is the middle of the model; `camera` is that of the picture.
    pub fn new(
        centre: &Camera,
        camera: &Camera,
        direction: Vec3,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
    ) -> KeyLight {
        let lamp = centre.from_direction(direction, camera.axes[1], SEEN);
        let size = Size {
            width: MAP,
            height: MAP,
        };
        let (turn, shift) = lamp.from_other(camera);
        KeyLight {
            direction: camera.turn(lamp.axes[2]).map(|c| c as f32),
            turn: turn.map(|row| row.map(|c| c as f32)),
            shift: shift.map(|c| c as f32),
            map: rasterize(&lamp, size, positions, triangles).depth,
            distance: lamp.distance as f32,
            discs: std::array::from_fn(|turn| {
                let offset = turn as f32 / TURNS as f32;
                std::array::from_fn(|i| match i.checked_sub(SEARCH) {
                    None => on_disc(i, SEARCH, offset),
                    Some(i) => on_disc(i, WEIGH, offset),
                })
            }),
        }
    }

    /// The share of the lamp that a place with a normal sees, 0 to 1. `offset`, from 0
    /// to 15/16, turns the samples.
    ///
    /// The further away what stands in the way, the wider the edge of its shadow.
    ///
    /// Fernando, "Percentage-closer soft shadows" (2005).
    pub fn visibility(&self, place: Vec3f, normal: Vec3f, offset: f32) -> f32 {
        let p: Vec3f = std::array::from_fn(|a| dot(self.turn[a], place) + self.shift[a]);
        let n = self.turn.map(|row| dot(row, normal));
        if n[2] <= 0.0 {
            return 0.0;
        }
        const TEXELS: f32 = MAP as f32 / SEEN as f32;
        let depth = self.distance - p[2];
        let half = MAP as f32 * 0.5;
        let middle = [half + p[0] * TEXELS, half - p[1] * TEXELS];
        // The receiver's own plane: what lies on it casts no shadow on it.
        let lean = [n[0] / n[2].max(0.1), n[1] / n[2].max(0.1)];
        let steep = (lean[0] * lean[0] + lean[1] * lean[1]).sqrt();
        let bias = (1.5 + 1.5 * steep.min(6.0)) / TEXELS;
        let disc = &self.discs[(offset * TURNS as f32) as usize % TURNS];
        let blocker = |at: &[f32; 2], radius: f32| {
            let (du, dv) = (at[0] * radius, at[1] * radius);
            let plane = depth + (lean[0] * du + lean[1] * dv).clamp(-0.2, 0.2);
            let found = self.texel(middle[0] + du * TEXELS, middle[1] - dv * TEXELS);
            (found < plane - bias - 0.012 * radius).then_some(plane - found)
        };
        let (mut gap, mut count) = (0.0, 0.0);
        let (search, weigh) = disc.split_at(SEARCH);
        for way in search.iter().filter_map(|at| blocker(at, SOFTNESS * 0.8)) {
            gap += way;
            count += 1.0;
        }
        if count == 0.0 {
            return 1.0;
        }
        let radius = (SOFTNESS * gap / count).clamp(2.5 / TEXELS, SOFTNESS * 1.2);
        let hidden = weigh
            .iter()
            .filter(|at| blocker(at, radius).is_some())
            .count();
        1.0 - hidden as f32 / WEIGH as f32
    }

    #[inline]
    fn texel(&self, x: f32, y: f32) -> f32 {
        if x < 0.0 || y < 0.0 || x >= MAP as f32 || y >= MAP as f32 {
            return f32::INFINITY;
        }
        self.map[y as usize * MAP + x as usize]
    }
}

/// Place `i` of some that cover a disc evenly: each is turned on by the golden angle (Vogel 1979).
fn on_disc(i: usize, of: usize, offset: f32) -> [f32; 2] {
    let radius = ((i as f32 + 0.5) / of as f32).sqrt();
    let (sin, cos) = (i as f32 * 2.399_963 + offset * std::f32::consts::TAU).sin_cos();
    [radius * cos, radius * sin]
}
