//! The plane under the scene, seen from above.

use super::params::{Ground, Params};
use crate::image::colour::to_linear;
use crate::numeric::vector::{Vec3, cross, dot, length, normalize, scale, sub};
use crate::render::smoothstep;
use crate::spatial::aabb::Aabb;

/// How dark a shadow on the plane is.
const CAST: f64 = 0.5;

/// It takes shadow in full up to this far from under the middle of the scene, and none from twice
/// as far on, in radii of the scene.
const REACH: f64 = 2.5;

/// Squares of the checkered plane along the radius of the scene.
const SQUARES: f64 = 2.0;

/// The light that the squares send back.
const TILES: [f64; 2] = [0.26, 0.72];

/// A plane under the lowest point.
#[derive(Debug)]
pub(super) struct Plane {
    pub up: Vec3,
    height: f64,
    middle: Vec3,
    radius: f64,
    across: [Vec3; 2],
    checker: bool,
    background: Vec3,
}

impl Plane {
    pub fn new(points: &[Vec3], bounds: Aabb, up: Vec3, params: &Params) -> Plane {
        let heights = points.iter().map(|p| dot(*p, up));
        let right = super::disc::across(up);
        Plane {
            up,
            height: heights.fold(f64::INFINITY, f64::min),
            middle: bounds.centre(),
            radius: (0.5 * bounds.diagonal()).max(f64::MIN_POSITIVE),
            across: [right, normalize(cross(up, right))],
            checker: params.ground == Ground::Checker,
            background: to_linear(params.background).map(f64::from),
        }
    }

    /// How far along a line the plane is, met from above; may be below 0.
    pub fn under(&self, from: Vec3, direction: Vec3) -> Option<f64> {
        let falling = dot(direction, self.up);
        let way = (self.height - dot(from, self.up)) / falling;
        (falling < 0.0 && way.is_finite()).then_some(way)
    }

    /// How much of a shadow is drawn at a place, 0 to 1.
    pub fn nearness(&self, place: Vec3) -> f64 {
        let away = sub(place, self.middle);
        let along = sub(away, scale(self.up, dot(away, self.up)));
        let far = length(along) / (REACH * self.radius);
        1.0 - f64::from(smoothstep(1.0, 2.0, far as f32))
    }

    /// The light that a place sends back that gets a share of the lamps', by colour, from 0 to 1.
    pub fn light(&self, place: Vec3, near: f64, lit: Vec3) -> Vec3 {
        let shadow = lit.map(|lit| 1.0 - CAST * near * (1.0 - lit));
        let own = if self.checker {
            let square = |axis: Vec3| {
                let along = dot(sub(place, self.middle), axis);
                (along * SQUARES / self.radius).floor() as i64
            };
            let tile = (square(self.across[0]) + square(self.across[1])).rem_euclid(2);
            let tile = TILES[tile as usize];
            // It fades into the background like the shadows on it.
            self.background.map(|b| b + (tile - b) * near)
        } else {
            self.background
        };
        std::array::from_fn(|c| own[c] * shadow[c])
    }
}
