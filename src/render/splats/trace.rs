//! What a ray brings back: Phong's model, and what is reflected and refracted.

use super::cover::Scratch;
use super::disc::{Origin, Ray};
use super::params::{Material, Params, SelfHit};
use super::scene::{Object, Shape, Sight, Stage, origin};
use super::tree::Visits;
use crate::image::colour::to_linear;
use crate::numeric::vector::{Vec3, add, dot, length, normalize, scale, sub};
use crate::render::shade::shoulder;
use schemars::JsonSchema;
use serde::Serialize;

/// With [`SelfHit::Ball`] the ball is never smaller than this share of the scene's longest side,
/// which is between 1/2 and 1.
const LEAST_BALL: f64 = 1e-5;

/// Of the ambient light this share comes from below.
const FROM_BELOW: f64 = 0.6;

/// Rays by what they are for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Rays {
    /// Through pixels.
    pub primary: u64,
    /// To lights.
    pub shadow: u64,
    /// Mirrored, at the limit of the depth too, where they end.
    pub reflect: u64,
    /// Bent on the way in or out.
    pub refract: u64,
}

impl Rays {
    /// All of them.
    pub fn sum(&self) -> u64 {
        self.primary + self.shadow + self.reflect + self.refract
    }
}

/// What rays told.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    pub rays: Rays,
    pub visits: Visits,
    /// Primary rays that see discs, and the discs around their first hits.
    pub on_discs: u64,
    pub around: u64,
    /// Primary rays that see anything.
    pub hits: u64,
    /// Reflected rays that start outside on discs and meet discs of the same object.
    pub again: u64,
}

impl Tally {
    pub fn add(&mut self, more: &Tally) {
        self.rays.primary += more.rays.primary;
        self.rays.shadow += more.rays.shadow;
        self.rays.reflect += more.rays.reflect;
        self.rays.refract += more.rays.refract;
        self.visits.add(&more.visits);
        self.on_discs += more.on_discs;
        self.around += more.around;
        self.hits += more.hits;
        self.again += more.again;
    }
}

/// Follows rays; holds what one thread needs.
pub(super) struct Follower<'a> {
    pub stage: &'a Stage,
    pub params: &'a Params,
    pub hits: Scratch,
    pub tally: Tally,
}

impl<'a> Follower<'a> {
    pub fn new(stage: &'a Stage, params: &'a Params) -> Self {
        Follower {
            stage,
            params,
            hits: Scratch::new(),
            tally: Tally::default(),
        }
    }

    /// What a ray sees first, the ground left aside.
    pub fn see(&mut self, ray: &Ray) -> Option<Sight> {
        let (hits, visits) = (&mut self.hits, &mut self.tally.visits);
        self.stage.see(ray, self.params, |_| true, hits, visits)
    }

    /// What a ray sees first of the covers.
    pub fn see_covers(&mut self, ray: &Ray) -> Option<Sight> {
        let (hits, visits) = (&mut self.hits, &mut self.tally.visits);
        let covers = |object: &Object| matches!(object.shape, Shape::Cover(_));
        self.stage.see(ray, self.params, covers, hits, visits)
    }

    /// The light that a ray through a pixel brings back.
    pub fn primary(&mut self, ray: &Ray) -> Vec3 {
        self.tally.rays.primary += 1;
        let sight = self.see(ray);
        if let Some(sight) = &sight {
            self.tally.hits += 1;
            self.tally.on_discs += u64::from(sight.around > 0);
            self.tally.around += u64::from(sight.around);
        }
        self.seen(ray, sight, self.params.depth)
    }

    /// The light of what a ray sees, with so many bounces left.
    fn seen(&mut self, ray: &Ray, sight: Option<Sight>, depth: u32) -> Vec3 {
        let ground = self.stage.plane.as_ref().and_then(|plane| {
            let t = plane.under(ray.origin, ray.direction)?;
            let before = t > ray.least && sight.is_none_or(|sight| t < sight.t);
            let place = ray.at(t);
            let near = plane.nearness(place);
            (before && near > 0.0).then_some((place, near))
        });
        match (ground, sight) {
            (Some((place, near)), _) => self.on_ground(place, near),
            (None, Some(sight)) => self.on_object(ray, &sight, depth),
            (None, None) => self.nothing(ray.direction),
        }
    }

    /// What is seen where nothing is: the background, and upwards the sky.
    fn nothing(&self, direction: Vec3) -> Vec3 {
        let [background, sky] =
            [self.params.background, self.params.sky].map(|c| to_linear(c).map(f64::from));
        let high = dot(direction, self.stage.up).max(0.0).sqrt();
        add(scale(background, 1.0 - high), scale(sky, high))
    }

    fn on_ground(&mut self, place: Vec3, near: f64) -> Vec3 {
        let (mut lit, mut whole) = ([0.0; 3], [0.0; 3]);
        let stage = self.stage;
        for lamp in &stage.lamps {
            let passes = self.passes(place, lamp.place, None);
            lit = add(lit, scale(lamp.light, passes));
            whole = add(whole, lamp.light);
        }
        // A colour that no lamp has casts no shadow.
        let share = |c: usize| {
            if whole[c] > 0.0 {
                lit[c] / whole[c]
            } else {
                1.0
            }
        };
        let Some(plane) = &stage.plane else {
            return lit;
        };
        plane.light(place, near, [share(0), share(1), share(2)])
    }

    /// The share of a lamp's light that comes to a place.
    fn passes(&mut self, place: Vec3, lamp: Vec3, from: Option<Origin>) -> f64 {
        let way = sub(lamp, place);
        let reach = length(way);
        if reach == 0.0 {
            return 1.0;
        }
        self.tally.rays.shadow += 1;
        let ray = Ray {
            origin: place,
            direction: scale(way, 1.0 / reach),
            least: 0.0,
            from,
        };
        self.stage.passes(&ray, reach, &mut self.tally.visits)
    }

    fn on_object(&mut self, ray: &Ray, sight: &Sight, depth: u32) -> Vec3 {
        let material = self.stage.objects[sight.object].material;
        let side = if sight.is_outside(ray) { 1.0 } else { -1.0 };
        let normal = facing(scale(sight.normal, side), ray.direction);
        let place = ray.at(sight.t);
        let spot = Spot {
            place,
            normal,
            side,
            direction: ray.direction,
        };
        let [own, highlight] = self.phong(sight, &spot, &material);
        let dull = 1.0 - material.mirror - material.transparent;
        let light = add(scale(own, dull), highlight);
        // Phong's light may be above 1; what is mirrored is as bright as what it shows.
        let mut light = light.map(|c| f64::from(shoulder(c as f32)));
        if material.mirror > 0.0 {
            let seen = self.reflected(sight, &spot, depth);
            light = add(light, scale(seen, material.mirror));
        }
        if material.transparent > 0.0 {
            let seen = self.refracted(sight, &spot, material.index, depth);
            light = add(light, scale(seen, material.transparent));
        }
        light
    }

    /// Phong's light: of the surface, and the highlight.
    fn phong(&mut self, sight: &Sight, spot: &Spot, material: &Material) -> [Vec3; 2] {
        let above = 0.5 + 0.5 * dot(spot.normal, self.stage.up);
        let ambient = material.ambient * (FROM_BELOW + (1.0 - FROM_BELOW) * above);
        let (mut facing, mut highlight) = ([ambient; 3], [0.0; 3]);
        let mirrored = mirror(spot.direction, spot.normal);
        let stage = self.stage;
        for lamp in &stage.lamps {
            let to = normalize(sub(lamp.place, spot.place));
            let cosine = dot(spot.normal, to);
            if cosine <= 0.0 {
                continue;
            }
            let from = self.leaving(sight, spot.side, to);
            let passes = self.passes(spot.place, lamp.place, Some(from));
            if passes == 0.0 {
                continue;
            }
            facing = add(
                facing,
                scale(lamp.light, passes * material.diffuse * cosine),
            );
            let shine = dot(mirrored, to).max(0.0).powf(material.shininess);
            highlight = add(
                highlight,
                scale(lamp.light, passes * material.specular * shine),
            );
        }
        let own = std::array::from_fn(|c| sight.colour[c] * facing[c]);
        [own, highlight]
    }

    /// What a ray starts on that leaves a place on a side of it.
    fn leaving(&self, sight: &Sight, side: f64, direction: Vec3) -> Origin {
        let ball = match self.params.self_hit {
            SelfHit::Overlap => 0.0,
            SelfHit::Ball => (2.0 * sight.error).max(LEAST_BALL),
        };
        let under = dot(sight.plane, direction) * side <= 0.0;
        origin(sight, side, under, ball)
    }

    fn reflected(&mut self, sight: &Sight, spot: &Spot, depth: u32) -> Vec3 {
        self.tally.rays.reflect += 1;
        let direction = normalize(mirror(spot.direction, spot.normal));
        let from = self.leaving(sight, spot.side, direction);
        let outside = spot.side > 0.0;
        self.bounced(spot.place, direction, from, depth, outside)
    }

    fn refracted(&mut self, sight: &Sight, spot: &Spot, index: f64, depth: u32) -> Vec3 {
        let ratio = if spot.side > 0.0 { 1.0 / index } else { index };
        match bent(spot.direction, spot.normal, ratio) {
            Some(direction) => {
                self.tally.rays.refract += 1;
                let from = self.leaving(sight, -spot.side, direction);
                self.bounced(spot.place, direction, from, depth, false)
            }
            None => self.reflected(sight, spot, depth),
        }
    }

    /// What a ray sees after a bounce; where none is left, what it would with nothing in the way.
    fn bounced(
        &mut self,
        place: Vec3,
        direction: Vec3,
        from: Origin,
        depth: u32,
        outside: bool,
    ) -> Vec3 {
        if depth == 0 {
            return self.nothing(direction);
        }
        let ray = Ray {
            origin: place,
            direction,
            least: 0.0,
            from: Some(from),
        };
        let sight = self.see(&ray);
        let again = sight.is_some_and(|s| s.object == from.object && s.around > 0);
        self.tally.again += u64::from(outside && again);
        self.seen(&ray, sight, depth - 1)
    }
}

/// Where light is gathered.
struct Spot {
    place: Vec3,
    /// Towards the viewer.
    normal: Vec3,
    /// 1 on the side to which the surface's normals point, else -1.
    side: f64,
    /// From the viewer.
    direction: Vec3,
}

/// The normal, turned as little as makes it no longer point away from the viewer: a field of normals
/// does so at an outline, where a mirrored ray would go into the surface.
fn facing(normal: Vec3, direction: Vec3) -> Vec3 {
    let away = dot(normal, direction);
    if away <= 0.0 {
        return normal;
    }
    let turned = normalize(sub(normal, scale(direction, away)));
    if dot(turned, turned) > 0.5 {
        turned
    } else {
        scale(direction, -1.0)
    }
}

/// A direction mirrored at a plane.
pub(super) fn mirror(direction: Vec3, normal: Vec3) -> Vec3 {
    sub(direction, scale(normal, 2.0 * dot(direction, normal)))
}

/// The direction after a surface, where the indices before and after have this ratio; `None` where
/// all is reflected. Snell's law.
pub(super) fn bent(direction: Vec3, normal: Vec3, ratio: f64) -> Option<Vec3> {
    let cosine = -dot(direction, normal);
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    let inner = (square > 0.0).then(|| square.sqrt())?;
    let along = scale(normal, ratio * cosine - inner);
    Some(normalize(add(scale(direction, ratio), along)))
}
