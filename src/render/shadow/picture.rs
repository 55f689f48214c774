//! The picture: what each pixel shows, and in which light.

use super::cast::{Caster, Rays, Start, Tally};
use super::{Light, Model, Params};
use crate::camera::{Camera, Size};
use crate::image::colour::{CLAY, Linear, to_linear};
use crate::image::raster::Raster;
use crate::mesh::Mesh;
use crate::mesh::tracer::Ray;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::progress::Progress;
use crate::render::shade::{BOUNCE, KEY, SKY, shoulder};
use crate::render::{smoothstep, view};
use rayon::prelude::*;

/// How dark a shadow on the ground is.
const CAST: f32 = 0.5;

/// Share of the light of the sky that the model gets, for nothing hides the sky here.
const AMBIENT: f32 = 0.62;

/// The ground takes shadow in full up to this far from under the middle of the model, and none from
/// twice as far on, in radii of the model.
const GROUND: f64 = 2.5;

/// Where a line of sight ends.
#[derive(Clone, Copy)]
enum Seen {
    Model(Start, Vec3),
    /// With how much of its shadow is drawn.
    Ground(Start, f32),
    Nothing,
}

/// The plane under the lowest vertex, seen from above only.
struct Ground {
    up: Vec3,
    height: f64,
    middle: Vec3,
    radius: f64,
}

impl Ground {
    fn new(mesh: &Mesh, up: Vec3) -> Ground {
        let bounds = mesh.bounds();
        let heights = mesh.positions.iter().map(|p| dot(*p, up));
        Ground {
            up,
            height: heights.fold(f64::INFINITY, f64::min),
            middle: bounds.centre(),
            radius: (0.5 * bounds.diagonal()).max(f64::MIN_POSITIVE),
        }
    }

    /// The place where a line from a point falls on it.
    fn under(&self, from: Vec3, direction: Vec3) -> Option<Vec3> {
        let falling = dot(direction, self.up);
        let way = (self.height - dot(from, self.up)) / falling;
        (falling < 0.0 && way > 0.0 && way.is_finite()).then(|| add(from, scale(direction, way)))
    }

    /// How much of a shadow is drawn at a place of the ground, 0 to 1.
    fn nearness(&self, place: Vec3) -> f32 {
        let away = sub(place, self.middle);
        let along = sub(away, scale(self.up, dot(away, self.up)));
        let far = length(along) / (GROUND * self.radius);
        1.0 - smoothstep(1.0, 2.0, far as f32)
    }
}

/// The camera that has the model and its shadow on the ground in the picture.
pub(super) fn framed(
    framing: &Camera,
    mesh: &Mesh,
    lights: &[Light],
    up: Vec3,
    size: Size,
) -> Camera {
    let ground = Ground::new(mesh, up);
    let mut points = mesh.positions.clone();
    for light in lights {
        let cast = mesh.positions.iter().filter_map(|p| {
            let place = ground.under(*p, sub(*p, light.centre))?;
            (ground.nearness(place) == 1.0).then_some(place)
        });
        points.extend(cast);
    }
    framing.fitted(framing.seen(&points), size.aspect())
}

/// Draws the model, with four samples per pixel.
pub(super) fn draw(
    model: &Model,
    caster: &Caster,
    params: &Params,
    progress: &dyn Progress,
) -> (Raster, Tally) {
    let [width, height] = params.size.map(|side| side as usize);
    let painter = Painter {
        model,
        caster,
        ground: Ground::new(&model.mesh, model.up),
        fine: Size {
            width: 2 * width,
            height: 2 * height,
        },
    };
    progress.stage("trace", height as u64);
    let rows: Vec<(Vec<Linear>, Tally)> = (0..height)
        .into_par_iter()
        .map(|y| {
            let row = painter.row(y, width);
            progress.advance(1);
            row
        })
        .collect();
    let mut tally = Tally::default();
    let mut pixels = Vec::with_capacity(4 * width * height);
    for (row, told) in rows {
        pixels.extend(row);
        tally.add(&told);
    }
    (Raster::from_pixels(2 * width, pixels).halved(), tally)
}

struct Painter<'a> {
    model: &'a Model,
    caster: &'a Caster<'a>,
    ground: Ground,
    /// Two by two samples for each pixel.
    fine: Size,
}

impl Painter<'_> {
    /// The two rows of samples of a row of pixels.
    fn row(&self, y: usize, width: usize) -> (Vec<Linear>, Tally) {
        let mut samples = vec![[1.0; 3]; 4 * width];
        let mut tally = Tally::default();
        for x in 0..width {
            let seen: [Seen; 4] = std::array::from_fn(|s| self.seen(2 * x + s % 2, 2 * y + s / 2));
            let starts = seen.iter().filter_map(|seen| match seen {
                Seen::Model(start, _) | Seen::Ground(start, _) => Some(*start),
                Seen::Nothing => None,
            });
            let starts: Vec<Start> = starts.collect();
            if starts.is_empty() {
                continue;
            }
            let rays = self.caster.rays(&starts, (y * width + x) as u64);
            tally.note(&rays);
            let mut start = 0;
            for (s, seen) in seen.iter().enumerate() {
                let sample = &mut samples[s / 2 * 2 * width + 2 * x + s % 2];
                match seen {
                    Seen::Model(_, normal) => *sample = self.clay(*normal, &rays, start),
                    Seen::Ground(_, near) => {
                        let hidden = 1.0 - rays.open(start) as f32;
                        *sample = [1.0 - CAST * near * hidden; 3];
                    }
                    Seen::Nothing => continue,
                }
                start += 1;
            }
        }
        (samples, tally)
    }

    fn seen(&self, x: usize, y: usize) -> Seen {
        let ray = self.sight(x as f64 + 0.5, y as f64 + 0.5);
        if let Some(hit) = self.model.tracer.closest(&ray) {
            let [a, b, c] = self.model.mesh.corners(hit.triangle as usize);
            let (e, f) = (sub(b, a), sub(c, a));
            // By the triangle rather than by the way from the eye, which may be long.
            let place = add(a, add(scale(e, hit.u), scale(f, hit.v)));
            let normal = normalize(cross(e, f));
            let normal = if dot(normal, ray.direction) > 0.0 {
                scale(normal, -1.0)
            } else {
                normal
            };
            return Seen::Model(self.caster.start(place, normal, true), normal);
        }
        let place = self.ground.under(ray.origin, ray.direction);
        match place.map(|place| (place, self.ground.nearness(place))) {
            Some((place, near)) if near > 0.0 => {
                Seen::Ground(self.caster.start(place, self.ground.up, false), near)
            }
            _ => Seen::Nothing,
        }
    }

    /// The line of sight through a place of the screen.
    fn sight(&self, x: f64, y: f64) -> Ray {
        let (origin, direction, near) = view::sight(&self.model.camera, x, y, self.fine);
        Ray {
            origin,
            direction,
            reach: [near, f64::INFINITY],
        }
    }

    /// The light that a sample of the model sends to the viewer.
    fn clay(&self, normal: Vec3, rays: &Rays, start: usize) -> Linear {
        let facing = rays.seen(start) as f32;
        let above = (0.5 + 0.5 * dot(normal, self.model.up)) as f32;
        let albedo = to_linear(CLAY);
        std::array::from_fn(|c| {
            let ambient = AMBIENT * (BOUNCE[c] + (SKY[c] - BOUNCE[c]) * above);
            shoulder(albedo[c] * (ambient + KEY[c] * facing))
        })
    }
}
