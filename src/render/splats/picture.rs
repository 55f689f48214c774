//! The picture: rays through pixels.

use super::disc::Ray;
use super::params::Params;
use super::scene::{Sight, Stage};
use super::trace::{Follower, Tally};
use super::tree::clip_to;
use crate::camera::Size;
use crate::image::colour::Linear;
use crate::image::raster::Raster;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{add, length, scale};
use crate::progress::Progress;
use crate::render::view;
use rayon::prelude::*;

/// Draws what the camera sees.
pub(super) fn draw(stage: &Stage, params: &Params, progress: &dyn Progress) -> (Raster, Tally) {
    let [width, height] = params.size.map(|side| side as usize);
    let eye = Eye::new(stage, params);
    let rows: Vec<(Vec<Linear>, Tally)> = (0..height)
        .into_par_iter()
        .map(|y| {
            let row = eye.row(y, width);
            progress.advance(1);
            row
        })
        .collect();
    let mut tally = Tally::default();
    let mut pixels = Vec::with_capacity(width * height);
    for (row, told) in rows {
        pixels.extend(row);
        tally.add(&told);
    }
    (Raster::from_pixels(width, pixels), tally)
}

/// A camera with its pixels.
pub(super) struct Eye<'a> {
    stage: &'a Stage,
    params: &'a Params,
    size: Size,
}

/// What is seen of the covers in the middle of a pixel.
pub(super) struct Middle {
    pub ray: Ray,
    pub sight: Option<Sight>,
}

impl<'a> Eye<'a> {
    pub fn new(stage: &'a Stage, params: &'a Params) -> Self {
        let [width, height] = params.size.map(|side| side as usize);
        Eye {
            stage,
            params,
            size: Size { width, height },
        }
    }

    fn row(&self, y: usize, width: usize) -> (Vec<Linear>, Tally) {
        let mut follower = Follower::new(self.stage, self.params);
        let row = (0..width).map(|x| self.pixel(x, y, &mut follower));
        let row = row.collect();
        (row, follower.tally)
    }

    /// The mean over one ray in each square of a lattice; in the middle where there is one.
    fn pixel(&self, x: usize, y: usize, follower: &mut Follower) -> Linear {
        let n = self.params.samples;
        if n == 1 {
            let ray = self.ray(x as f64 + 0.5, y as f64 + 0.5);
            return follower.primary(&ray).map(|c| c as f32);
        }
        let mut rng = Rng::new(self.params.seed, (y * self.size.width + x) as u64);
        let mut sum = [0.0; 3];
        for i in 0..n * n {
            let part = |i: u32, unit: f64| (f64::from(i) + unit) / f64::from(n);
            let (u, v) = (part(i % n, rng.unit()), part(i / n, rng.unit()));
            let ray = self.ray(x as f64 + u, y as f64 + v);
            // What is brighter than the screen counts as white: outlines stay smooth.
            sum = add(sum, follower.primary(&ray).map(|c| c.min(1.0)));
        }
        scale(sum, 1.0 / f64::from(n * n)).map(|c| c as f32)
    }

    /// The ray through a place of the screen, moved to where it enters the box around the scene:
    /// coordinates of a far eye would have few digits left for the scene.
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let (origin, direction, near) = view::sight(&self.stage.camera, x, y, self.size);
        let long = length(direction);
        let mut ray = Ray {
            origin,
            direction: scale(direction, 1.0 / long),
            least: near * long,
            from: None,
        };
        let moved = clip_to(self.stage.bounds, origin, ray.direction).unwrap_or(0.0);
        ray.origin = ray.at(moved);
        ray.least -= moved;
        ray
    }

    /// What is seen of the covers in the middle of each pixel, row by row.
    pub fn middles<T: Send>(&self, told: impl Fn(&Middle) -> T + Sync) -> Vec<T> {
        let rows: Vec<Vec<T>> = (0..self.size.height)
            .into_par_iter()
            .map(|y| {
                let mut follower = Follower::new(self.stage, self.params);
                let middle = |x: usize| {
                    let ray = self.ray(x as f64 + 0.5, y as f64 + 0.5);
                    let sight = follower.see_covers(&ray);
                    told(&Middle { ray, sight })
                };
                (0..self.size.width).map(middle).collect()
            })
            .collect();
        rows.into_iter().flatten().collect()
    }
}
