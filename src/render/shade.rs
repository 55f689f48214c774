//! Clay in soft light: the look of all pictures of geometry.

use super::ground::Ground;
use super::light::KeyLight;
use super::occlusion::Samples;
use super::{Vec3f, dot, mix, smoothstep, tile};
use crate::camera::raster::rasterize;
use crate::camera::{Camera, Size};
use crate::image::colour::Linear;
use crate::image::raster::Raster;
use crate::numeric::vector::{Vec3, add, cross, normalize, scale};
use crate::spatial::aabb::Aabb;
use rayon::prelude::*;

/// How far ambient occlusion looks, in units (the model is a ball of radius 1).
const AMBIENT_RADIUS: f32 = 0.5;

/// Light of the lamp, of the sky above and of what the ground gives back.
pub(super) const KEY: Linear = [1.02, 0.985, 0.93];
pub(super) const SKY: Linear = [0.46, 0.48, 0.51];
pub(super) const BOUNCE: Linear = [0.31, 0.30, 0.285];

/// How dark the shadow on the ground is: under the model, and where the lamp is hidden.
const CONTACT: f32 = 0.62;
const CAST: f32 = 0.16;

/// Edges of squares are drawn in full from this many pixels on, and not at all below half as many.
const READABLE: f32 = 8.0;

/// What is drawn: triangles in one colour or a few.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// Places in the world.
    pub positions: &'a [Vec3],
    /// Triangles; both sides are alike.
    pub triangles: &'a [[u32; 3]],
    /// Colours of the material, each with the first triangle that has it; the first of them with 0.
    pub colours: &'a [(usize, Linear)],
    /// Whether triangles 2 f and 2 f + 1 are `[a, b, c]` and `[a, c, d]` of a parallelogram, as
    /// [`crate::volume::surface::boundary_faces`] makes them, whose edges are to be drawn.
    pub squares: bool,
}

impl Subject<'_> {
    /// The colour of a triangle.
    #[inline]
    fn colour_of(&self, triangle: usize) -> Linear {
        let after = self
            .colours
            .partition_point(|(first, _)| *first <= triangle);
        let run = after.checked_sub(1).and_then(|run| self.colours.get(run));
        run.map_or([1.0; 3], |(_, colour)| *colour)
    }
}

/// Draws a subject on a white ground.
///
/// `up` is a direction of the world; the ground lies under the lowest vertex. Four samples per
/// pixel. The same on any number of threads. Cost: linear in the triangles and in the pixels.
pub fn render(subject: &Subject, camera: &Camera, size: Size, up: Vec3) -> Raster {
    let fine = Size {
        width: size.width * 2,
        height: size.height * 2,
    };
    let (positions, triangles) = (subject.positions, subject.triangles);
    let centre = Camera::framing(&Aabb::around(positions), camera.axes[2], up, 1.0);
    // All cameras share one unit, that of the model, so that shadows look alike at any zoom.
    let camera = &rescaled(camera, centre.unit);
    let up = normalize(up);
    let ground = Ground::new(&centre, camera, up, positions, triangles);
    let lamp = lamp_direction(camera, up);
    let key = KeyLight::new(&centre, camera, lamp, positions, triangles);
    let buffer = rasterize(camera, fine, positions, triangles);
    let behind = |place| ground.behind(camera, place);
    let samples = Samples::new(buffer, camera, positions, triangles, behind);
    let fade = |at: usize| ground.nearness(samples.place[at]) * edge_fade(at, fine);
    let light: Vec<[f32; 2]> = (0..samples.place.len())
        .into_par_iter()
        .map(|at| {
            let offset = tile(at % fine.width, at / fine.width);
            let place = samples.place[at];
            if samples.is_hit(at) {
                let open = samples.ambient(at, camera, AMBIENT_RADIUS);
                [open, key.visibility(place, samples.normal[at], offset)]
            } else {
                [
                    ground.shade(place),
                    key.visibility(place, ground.up, offset),
                ]
            }
        })
        .collect();
    let light = samples.smoothed(&light, camera);
    let pixels = (0..light.len())
        .into_par_iter()
        .map(|at| {
            if samples.is_hit(at) {
                let ink = edge_ink(subject, camera, &samples, at);
                let colour = subject.colour_of(samples.triangle[at] as usize);
                material(colour, samples.normal[at], light[at], &key, &ground)
                    .map(|c| c * (1.0 - 0.42 * ink))
            } else {
                let [hidden, lit] = light[at];
                [mix(1.0, shadow(hidden, lit), fade(at)); 3]
            }
        })
        .collect();
    Raster::from_pixels(fine.width, pixels).halved()
}

/// The same camera with another unit of view space.
fn rescaled(camera: &Camera, unit: f64) -> Camera {
    use crate::camera::Lens;
    let factor = camera.unit / unit;
    Camera {
        unit,
        distance: camera.distance * factor,
        lens: match camera.lens {
            Lens::Orthographic { height } => Lens::Orthographic {
                height: height * factor,
            },
            lens => lens,
        },
        ..*camera
    }
}

/// The lamp stands to the upper left of the viewer, somewhat in front of the model.
fn lamp_direction(camera: &Camera, up: Vec3) -> Vec3 {
    let right = normalize(cross(up, camera.axes[2]));
    let front = cross(right, up);
    add(up, add(scale(right, -0.60), scale(front, 0.30)))
}

/// What of white the ground shows.
fn shadow(hidden: f32, lit: f32) -> f32 {
    (1.0 - CONTACT * hidden.powf(1.15)) * (1.0 - CAST * (1.0 - lit))
}

/// 0 at the edge of the picture, 1 well inside: shadows never end at an edge.
fn edge_fade(at: usize, size: Size) -> f32 {
    let within = |at: usize, count: usize, share: f32| {
        let near = at.min(count - 1 - at) as f32 / count as f32;
        smoothstep(0.0, share, near)
    };
    within(at % size.width, size.width, 0.16) * within(at / size.width, size.height, 0.07)
}

/// The light that a material of one colour sends to the viewer.
fn material(
    colour: Linear,
    normal: Vec3f,
    [open, lit]: [f32; 2],
    key: &KeyLight,
    ground: &Ground,
) -> Linear {
    let facing = dot(normal, key.direction).max(0.0) * lit;
    let above = 0.5 + 0.5 * dot(normal, ground.up);
    std::array::from_fn(|c| {
        let albedo = colour[c];
        // Light that is lost once comes back between bright walls (Jimenez et al. 2016).
        let (a, b, d) = (
            2.0404 * albedo - 0.3324,
            -4.7951 * albedo + 0.6417,
            2.7552 * albedo + 0.6903,
        );
        let open = open.max(((open * a + b) * open + d) * open);
        let ambient = mix(BOUNCE[c], SKY[c], above) * open;
        shoulder(albedo * (ambient + KEY[c] * facing))
    })
}

/// Light with a soft shoulder instead of a hard white.
pub(super) fn shoulder(light: f32) -> f32 {
    if light < 0.7 {
        light
    } else {
        0.7 + 0.3 * (1.0 - (-(light - 0.7) / 0.3).exp())
    }
}

/// How much of a sample an edge of its square covers, 0 to 1.
fn edge_ink(subject: &Subject, camera: &Camera, samples: &Samples, at: usize) -> f32 {
    if !subject.squares {
        return 0.0;
    }
    let face = samples.triangle[at] as usize / 2;
    let (Some([a, b, _]), Some([_, _, d])) = (
        subject.triangles.get(2 * face),
        subject.triangles.get(2 * face + 1),
    ) else {
        return 0.0;
    };
    let [a, b, d] = [a, b, d].map(|v| {
        let place = camera.to_view(subject.positions[*v as usize]);
        camera.to_screen(place, samples.size)
    });
    let [e, f] = [b, d].map(|p| [p[0] - a[0], p[1] - a[1]]);
    let (x, y) = (at % samples.size.width, at / samples.size.width);
    let p = [x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]];
    let area = e[0] * f[1] - e[1] * f[0];
    let (long_e, long_f) = (e[0].hypot(e[1]), f[0].hypot(f[1]));
    if area == 0.0 {
        return 0.0;
    }
    let u = (p[0] * f[1] - p[1] * f[0]) / area;
    let v = (e[0] * p[1] - e[1] * p[0]) / area;
    let inside = |t: f64| t.min(1.0 - t).max(0.0);
    let nearest = (inside(u) * area.abs() / long_f).min(inside(v) * area.abs() / long_e) as f32;
    // Samples are half a pixel apart.
    let readable = long_e.max(long_f) as f32 * 0.5;
    let strength = smoothstep(READABLE * 0.5, READABLE, readable);
    strength * (1.0 - smoothstep(0.4, 1.5, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::THREE_QUARTER;
    use crate::mesh::shapes;

    const SIZE: Size = Size {
        width: 90,
        height: 80,
    };
    const UP: Vec3 = [0.0, 1.0, 0.0];

    fn drawn(mesh: &crate::mesh::Mesh, lens: Option<f64>) -> Raster {
        let framing = Camera::framing(&mesh.bounds(), THREE_QUARTER, UP, SIZE.aspect());
        let eye = add(framing.target, scale(framing.axes[2], 4.0 * framing.unit));
        let camera = lens.map_or(framing, |fov| Camera::look_at(eye, framing.target, UP, fov));
        let subject = Subject {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            colours: &[(0, [0.5; 3])],
            squares: false,
        };
        render(&subject, &camera, SIZE, UP)
    }

    #[test]
    fn the_size_of_a_model_changes_nothing() {
        let base = shapes::torus_knot(2, 3, 0.4, 60, 20);
        let wanted = drawn(&base, None);
        for power in [-100, 100] {
            let mut mesh = base.clone();
            for p in &mut mesh.positions {
                *p = p.map(|c| c * 2f64.powi(power));
            }
            assert_eq!(drawn(&mesh, None), wanted, "{power}");
        }
    }

    #[test]
    fn a_place_far_from_the_origin_changes_next_to_nothing() {
        let base = shapes::torus_knot(2, 3, 0.4, 60, 20);
        let mut mesh = base.clone();
        for p in &mut mesh.positions {
            *p = p.map(|c| c + 1e9);
        }
        let (near, far) = (drawn(&base, None), drawn(&mesh, None));
        let apart = |(a, b): (&Linear, &Linear)| (a[1] - b[1]).abs();
        let sum: f32 = near.pixels().iter().zip(far.pixels()).map(apart).sum();
        assert!(sum / (near.pixels().len() as f32) < 2e-3, "{sum}");
    }

    #[test]
    fn a_hollow_is_darker_than_a_top_under_either_lens() {
        // Two balls that touch: the crease between them is in the shade of both.
        let mesh = shapes::joined(
            shapes::octasphere([-0.95, 0.0, 0.0], 1.0, 30),
            &shapes::octasphere([0.95, 0.0, 0.0], 1.0, 30),
        );
        for lens in [None, Some(0.5)] {
            let raster = drawn(&mesh, lens);
            let light = |p: Vec3| {
                let framing = Camera::framing(&mesh.bounds(), THREE_QUARTER, UP, SIZE.aspect());
                let eye = add(framing.target, scale(framing.axes[2], 4.0 * framing.unit));
                let camera =
                    lens.map_or(framing, |fov| Camera::look_at(eye, framing.target, UP, fov));
                let [x, y, _] = camera.to_screen(camera.to_view(p), SIZE);
                raster.pixels()[y as usize * SIZE.width + x as usize][1]
            };
            let (crease, top) = (light([0.0, 0.1, 0.3]), light([-0.95, 0.9, 0.43]));
            assert!(crease < 0.8 * top, "{crease} {top}");
        }
    }
}
