//! Discs in the scene's frame, and a ray against one of them.

use crate::error::{Error, Fault, Result};
use crate::image::colour::Linear;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use crate::points::{Splat, Splats};
use crate::spatial::aabb::Aabb;
use crate::spatial::local::CornerFrame;
use rayon::prelude::*;

/// A ray. Its direction is of unit length, so that `t` is a distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    /// Hits are beyond it; below 0 where the ray was moved towards the scene.
    pub least: f64,
    /// What it started on.
    pub from: Option<Origin>,
}

impl Ray {
    pub fn at(&self, t: f64) -> Vec3 {
        add(self.origin, scale(self.direction, t))
    }
}

/// What a ray started on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    /// The object, by number.
    pub object: usize,
    /// The disc or the triangle.
    pub item: u32,
    /// 1 where it leaves on the side to which the normal points, else -1.
    pub side: f64,
    /// Whether the normal that shades is on the ray's side, and the disc's own on the other: the
    /// surface that the disc stands for curves away from the ray, which starts under it.
    pub under: bool,
    /// Nothing of the same object is met within this distance; 0 for the rule of overlapping discs.
    pub ball: f64,
}

/// What a ray meets of a disc.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Plate {
    pub centre: Vec3,
    pub normal: Vec3,
    /// The square of the radius; 0 for a disc that no ray meets.
    pub square: f64,
}

/// Where a ray meets a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    pub t: f64,
    /// The square of the distance to the centre in radii: u^2 + v^2.
    pub off: f64,
    pub disc: u32,
}

impl Plate {
    pub fn new(splat: &Splat) -> Plate {
        Plate {
            centre: splat.centre,
            normal: splat.normal,
            square: splat.radius * splat.radius,
        }
    }

    /// The way to the disc's plane and the square of the distance to its centre there, in radii;
    /// `None` where the ray misses.
    ///
    /// Source: the paper, section 4.3. A ray in the plane has no finite way, and misses.
    #[inline(always)]
    pub fn meet(&self, ray: &Ray) -> Option<(f64, f64)> {
        let t = dot(self.normal, sub(self.centre, ray.origin)) / dot(self.normal, ray.direction);
        let square = {
            let away = sub(add(ray.origin, scale(ray.direction, t)), self.centre);
            dot(away, away)
        };
        let off = square / self.square;
        // Written so that no number that is none passes.
        (t > ray.least && t < f64::INFINITY && off <= 1.0).then_some((t, off))
    }
}

/// The discs of one object in the scene's frame.
#[derive(Debug, Clone)]
pub(super) struct Discs {
    pub splats: Vec<Splat>,
    pub plates: Vec<Plate>,
    /// The light that each sends back.
    pub colours: Option<Vec<Linear>>,
    /// The box around all.
    pub bounds: Aabb,
}

/// Errs where a disc is none: a number that is not finite, a radius below 0, a normal of no length.
pub(super) fn check(splats: &Splats) -> Result<()> {
    let wrong =
        |i: usize, problem: String| Err(Error::Geometry(Fault::element("splat", i, problem)));
    for (i, s) in splats.splats.iter().enumerate() {
        let vectors = [s.centre, s.normal, s.tangent, s.field].concat();
        let others = [s.radius, s.error, s.slopes[0], s.slopes[1]];
        if !vectors.iter().chain(&others).all(|c| c.is_finite()) {
            return wrong(i, "has a number that is not finite".to_owned());
        }
        if s.radius < 0.0 {
            return wrong(i, format!("the radius is {:?}, below 0", s.radius));
        }
        if length(s.normal) == 0.0 {
            return wrong(i, "the normal has no length".to_owned());
        }
    }
    Ok(())
}

impl Discs {
    pub fn new(splats: &Splats, local: &CornerFrame) -> Discs {
        let splats_here: Vec<Splat> = splats
            .splats
            .par_iter()
            .map(|splat| localized(splat, local))
            .collect();
        let plates: Vec<Plate> = splats_here.par_iter().map(Plate::new).collect();
        let bounds = splats_here
            .par_chunks(1 << 14)
            .map(|part| part.iter().fold(Aabb::EMPTY, |b, s| b.union(s.bounds())))
            .reduce(|| Aabb::EMPTY, Aabb::union);
        let linear = |c: &[f32; 4]| [c[0], c[1], c[2]].map(to_light);
        Discs {
            colours: splats
                .colors
                .as_ref()
                .map(|all| all.iter().map(linear).collect()),
            splats: splats_here,
            plates,
            bounds,
        }
    }

    /// Whether a ray that started on a disc leaves out a hit on another, or the same.
    ///
    /// Discs that overlap stand for one piece of surface, of which each is a little above the other
    /// in places: what the ray meets of them is left out where the two agree, where the start is as
    /// near to the other as both are off, and where the ray would come from below a surface that it
    /// has just left. A ray that starts under the surface leaves out all that it meets from below.
    #[inline]
    pub fn is_own(&self, from: &Origin, ray: &Ray, disc: u32) -> bool {
        if disc == from.item {
            return true;
        }
        let (a, b) = (
            &self.splats[from.item as usize],
            &self.splats[disc as usize],
        );
        let from_below = dot(b.normal, ray.direction) * from.side > 0.0;
        if from.under && from_below {
            return true;
        }
        let off = a.error + b.error;
        let apart = sub(a.centre, b.centre);
        let reach = a.radius + b.radius + off;
        dot(apart, apart) <= reach * reach
            && (from_below
                || dot(a.normal, b.normal) > AGREES
                || dot(b.normal, sub(ray.origin, b.centre)).abs() <= off)
    }
}

/// The cosine above which the normals of two discs agree: 60 degrees.
const AGREES: f64 = 0.5;

/// The light of a stored colour, 0 to 1 on the sRGB curve (IEC 61966-2-1).
pub(super) fn to_light(v: f32) -> f32 {
    if v <= 0.040_45 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// A disc in the scene's frame, its axes of unit length and at right angles.
fn localized(splat: &Splat, local: &CornerFrame) -> Splat {
    let normal = normalize(splat.normal);
    let flat = sub(splat.tangent, scale(normal, dot(splat.tangent, normal)));
    // A tangent along the normal says nothing: any across will do.
    let tangent = if length(flat) > 1e-6 * length(splat.tangent) {
        normalize(flat)
    } else {
        across(normal)
    };
    Splat {
        centre: local.to_local(splat.centre),
        normal,
        tangent,
        radius: local.length_to_local(splat.radius),
        slopes: splat.slopes.map(|slope| local.length_from_local(slope)),
        error: local.length_to_local(splat.error),
        ..*splat
    }
}

/// A unit vector at a right angle to another.
pub(super) fn across(n: Vec3) -> Vec3 {
    let least = (0..3).fold(0, |l, a| if n[a].abs() < n[l].abs() { a } else { l });
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    normalize(cross(n, axis))
}
