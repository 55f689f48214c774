//! The white ground that a model stands on: seen only by the shadow on it.

use super::{Vec3f, dot, mix, smoothstep};
use crate::camera::raster::rasterize;
use crate::camera::{Camera, Lens, Size};
use crate::numeric::vector::{Vec3, scale};
use rayon::prelude::*;

/// Cells along a side of the underside of the model.
const CELLS: usize = 72;

/// The underside is this wide, in units.
const UNDERSIDE: f32 = 2.02;

/// Points along a side of the field of shade, and its width in units.
const FIELD: usize = 112;
const REACH: f32 = 4.4;

/// A plane under the model, and how much of the sky the model hides from each place on it.
pub(super) struct Ground {
    /// Up, in the view space of the picture.
    pub up: Vec3f,
    /// Height of the plane along `up`.
    height: f32,
    turn: [Vec3f; 3],
    shift: Vec3f,
    /// Hidden share of the sky, 0 to 1.
    field: Vec<f32>,
}

impl Ground {
    /// The ground under a model. `centre` frames the model and has its middle for target.
    ///
    /// What is hidden is the sum over the cells of the model's underside of their form factors:
    /// exact for what is seen from below but for overlaps near steep sides.
    pub fn new(
        centre: &Camera,
        camera: &Camera,
        up: Vec3,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
    ) -> Ground {
        let below = centre.from_direction(scale(up, -1.0), camera.axes[1], f64::from(UNDERSIDE));
        let size = Size {
            width: CELLS,
            height: CELLS,
        };
        let lowest = below.seen(positions).hi[2];
        let lowest = if lowest.is_finite() { lowest } else { 0.0 };
        let underside = rasterize(&below, size, positions, triangles);
        let cell = UNDERSIDE / CELLS as f32;
        let first = below.distance as f32 - lowest as f32;
        let cells: Vec<Vec3f> = (0..CELLS * CELLS)
            .filter(|at| underside.depth[*at].is_finite())
            .map(|at| {
                let [x, y] = [at % CELLS, at / CELLS].map(|c| c as f32 + 0.5 - CELLS as f32 * 0.5);
                [x * cell, -y * cell, underside.depth[at] - first]
            })
            .collect();
        let field = (0..FIELD * FIELD)
            .into_par_iter()
            .map(|at| {
                let [x, y] =
                    [at % FIELD, at / FIELD].map(|c| (c as f32 / (FIELD - 1) as f32 - 0.5) * REACH);
                hidden([x, y], &cells, cell)
            })
            .collect();
        let (turn, shift) = below.from_other(camera);
        let up = camera.turn(below.axes[2]).map(|c| -c as f32);
        Ground {
            up,
            // In the lower camera's view space the plane is at z = lowest, and up is -z.
            height: shift[2] as f32 - lowest as f32,
            turn: turn.map(|row| row.map(|c| c as f32)),
            shift: shift.map(|c| c as f32),
            field,
        }
    }

    /// The place on the ground behind a place of view space, seen through the lens; far away where
    /// the line of sight misses the ground.
    pub fn behind(&self, camera: &Camera, place: Vec3) -> Vec3f {
        let away = camera.to_viewer(place).map(|c| -c as f32);
        let from = match camera.lens {
            Lens::Orthographic { .. } => place.map(|c| c as f32),
            Lens::Perspective { .. } => [0.0, 0.0, camera.distance as f32],
        };
        let falling = dot(away, self.up);
        let way = (self.height - dot(from, self.up)) / falling;
        if falling > -1e-4 || way > 1e4 {
            return [0.0, 0.0, -1e4];
        }
        std::array::from_fn(|a| from[a] + away[a] * way)
    }

    /// 1 under the model, 0 where its shadow is to have ended, smooth in between.
    pub fn nearness(&self, place: Vec3f) -> f32 {
        let [x, y] = [0, 1].map(|a| dot(self.turn[a], place) + self.shift[a]);
        1.0 - smoothstep(0.75, 1.7, (x * x + y * y).sqrt())
    }

    /// The share of the sky that the model hides from a place on the ground, 0 to 1.
    pub fn shade(&self, place: Vec3f) -> f32 {
        let at = [0, 1].map(|a| {
            let along = dot(self.turn[a], place) + self.shift[a];
            (along / REACH + 0.5) * (FIELD - 1) as f32
        });
        let last = (FIELD - 1) as f32;
        if !at.iter().all(|c| (0.0..last).contains(c)) {
            return 0.0;
        }
        let [i, j] = at.map(|c| c as usize);
        let [u, v] = at.map(f32::fract);
        let row = |j: usize| mix(self.field[j * FIELD + i], self.field[j * FIELD + i + 1], u);
        mix(row(j), row(j + 1), v)
    }
}

/// The share of the sky over a point of the ground that cells at some height hide.
fn hidden(point: [f32; 2], cells: &[Vec3f], cell: f32) -> f32 {
    let area = cell * cell;
    let sum: f32 = cells
        .iter()
        .map(|[x, y, height]| {
            // A cell that touches the ground still hides what is under it.
            let h2 = height.max(0.4 * cell).powi(2);
            let r2 = (x - point[0]).powi(2) + (y - point[1]).powi(2) + h2;
            h2 * area / (std::f32::consts::PI * r2 * r2)
        })
        .sum();
    sum.min(1.0)
}
