//! The scene: discs, meshes and spheres with their materials, in one frame.

use super::cover::{Cover, Scratch};
use super::disc::{self, Discs, Origin, Ray};
use super::params::{Ground, Light, Material, Params};
use super::plane::Plane;
use super::tree::Visits;
use crate::camera::{Camera, Size, THREE_QUARTER};
use crate::error::{Error, Fault, Result};
use crate::image::colour::{CLAY, to_linear};
use crate::mesh::Mesh;
use crate::mesh::tracer::{self, Tracer};
use crate::numeric::vector::{Vec3, add, cross, dot, normalize, scale, sub};
use crate::points::Splats;
use crate::progress::Progress;
use crate::render::view::{Shot, frame, is_near, upper_left};
use crate::spatial::aabb::Aabb;
use crate::spatial::local::CornerFrame;

/// A ball, in the file's unit.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct Sphere {
    /// Its centre.
    pub centre: [f64; 3],
    /// Its radius.
    pub radius: f64,
}

/// What is drawn. Objects are numbered: first the covers, then the meshes, then the spheres.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Surfaces covered by discs.
    pub covers: Vec<Splats>,
    /// Surfaces of triangles.
    pub meshes: Vec<Mesh>,
    /// Balls.
    pub spheres: Vec<Sphere>,
    /// What objects look like, by number; those beyond the end look like [`Material::DEFAULT`].
    pub materials: Vec<Material>,
    /// The surface that all covers together stand for, where it is known.
    pub reference: Option<Mesh>,
}

/// The shape of an object in the frame.
#[derive(Debug)]
pub(super) enum Shape {
    Cover(Cover),
    Mesh(Box<Triangles>),
    Sphere(Vec3, f64),
}

#[derive(Debug)]
pub(super) struct Triangles {
    mesh: Mesh,
    tracer: Tracer,
}

/// An object in the frame.
#[derive(Debug)]
pub(super) struct Object {
    pub shape: Shape,
    pub material: Material,
    /// The light that it sends back where the shape says nothing else.
    colour: Vec3,
}

/// What a ray sees.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    pub t: f64,
    /// Where it stands in [`Stage::objects`].
    pub object: usize,
    pub item: u32,
    /// The unit normal that shades, and that of the disc, triangle or ball; both point outwards.
    pub normal: Vec3,
    pub plane: Vec3,
    pub colour: Vec3,
    /// Discs around the hit; 0 for other objects.
    pub around: u32,
    /// What they are off by at most.
    pub error: f64,
    /// The sine of the angle by which normals turn on the disc.
    pub lean: f64,
}

/// Normals that turn further on a disc say nothing of its sides.
const MOST_LEAN: f64 = 0.5;

impl Sight {
    /// Whether a ray comes to it from outside.
    ///
    /// At an outline discs stand out and show their backs, though the surface that they stand for
    /// turns away there and shows none: a back counts only where the normal that shades points away
    /// too, by more than normals turn on the disc. A ray from within comes to every back.
    pub fn is_outside(&self, ray: &Ray) -> bool {
        let from = ray.from.filter(|from| from.object == self.object);
        let inside = from.is_some_and(|from| from.side < 0.0);
        dot(self.plane, ray.direction) < 0.0
            || !inside && dot(self.normal, ray.direction) < self.lean
    }
}

/// A lamp in the frame: where it is, and its light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lamp {
    pub place: Vec3,
    pub light: Vec3,
}

/// Everything in one frame, ready for rays.
#[derive(Debug)]
pub(super) struct Stage {
    pub local: CornerFrame,
    pub objects: Vec<Object>,
    pub bounds: Aabb,
    pub lamps: Vec<Lamp>,
    pub lights: Vec<Light>,
    pub camera: Camera,
    pub up: Vec3,
    pub plane: Option<Plane>,
    /// The mesh of [`Scene::reference`] in the frame.
    pub reference: Option<Object>,
}

impl Sphere {
    fn check(&self) -> Result<()> {
        let wrong = |problem: &str| {
            let [x, y, z] = self.centre;
            let text = format!("{x:?},{y:?},{z:?},{:?}", self.radius);
            Err(Error::parameter("sphere", text, problem))
        };
        if !self.centre.iter().all(|c| c.is_finite()) || !self.radius.is_finite() {
            return wrong("has a number that is not finite");
        }
        if self.radius <= 0.0 {
            return wrong("the radius is not above 0");
        }
        Ok(())
    }
}

impl Scene {
    /// How many objects there are.
    pub fn objects(&self) -> usize {
        self.covers.len() + self.meshes.len() + self.spheres.len()
    }

    fn material(&self, number: usize) -> Material {
        let given = self.materials.get(number).copied();
        given.unwrap_or(Material::DEFAULT)
    }

    fn check(&self) -> Result<()> {
        self.covers.iter().try_for_each(disc::check)?;
        self.spheres.iter().try_for_each(Sphere::check)?;
        if self.materials.len() > self.objects() {
            let problem = match self.objects() {
                1 => "there is one object, number 0".to_owned(),
                count => format!("there are {count} objects, counted from 0"),
            };
            let last = self.materials.len() - 1;
            return Err(Error::parameter("material", last, problem));
        }
        for (number, material) in self.materials.iter().enumerate() {
            material
                .check()
                .map_err(|problem| Error::parameter("material", number, problem))?;
        }
        Ok(())
    }

    /// The frame of all that is drawn, and of the reference; errs where there is nothing.
    ///
    /// It is that of points alone: what stands around them rounds differently at another place.
    pub(super) fn local(&self) -> Result<CornerFrame> {
        let discs = || self.covers.iter().flat_map(|cover| &cover.splats);
        let meshes = self.meshes.iter().chain(&self.reference).map(used_bounds);
        let centres = discs().map(|s| &s.centre);
        let centres = centres.chain(self.spheres.iter().map(|s| &s.centre));
        let points = meshes.fold(Aabb::around(centres), Aabb::union);
        if points.is_empty() {
            let problem = "has nothing to draw: no discs, no triangles and no spheres";
            return Err(Error::Geometry(Fault::whole(problem)));
        }
        let radii = discs().map(|s| s.radius);
        let radii = radii.chain(self.spheres.iter().map(|s| s.radius));
        frame(points, radii.fold(0.0, f64::max))
    }
}

/// The box around the corners of triangles.
fn used_bounds(mesh: &Mesh) -> Aabb {
    let corners = mesh.triangles.iter().flatten();
    corners.fold(Aabb::EMPTY, |b, v| b.with(mesh.positions[*v as usize]))
}

impl Triangles {
    fn new(mesh: &Mesh, local: &CornerFrame) -> Triangles {
        let mut mesh = mesh.clone();
        for p in &mut mesh.positions {
            *p = local.to_local(*p);
        }
        Triangles {
            tracer: Tracer::new(&mesh),
            mesh,
        }
    }

    /// The mesh in the frame.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }
}

impl Object {
    fn new(shape: Shape, material: Material) -> Object {
        let colour = to_linear(material.colour.unwrap_or(CLAY)).map(f64::from);
        Object {
            shape,
            material,
            colour,
        }
    }

    /// Whether the material takes the colours of the file.
    fn takes_colours(&self) -> bool {
        self.material.colour.is_none()
    }
}

impl Stage {
    pub fn new(scene: &Scene, params: &Params, progress: &dyn Progress) -> Result<Stage> {
        params.check()?;
        scene.check()?;
        progress.stage("layout", 0);
        let local = scene.local()?;
        let shapes = shapes(scene, params, &local);
        let objects = shapes.into_iter().enumerate();
        let objects: Vec<Object> = objects
            .map(|(number, shape)| Object::new(shape, scene.material(number)))
            .collect();
        let reference = scene.reference.as_ref().map(|mesh| {
            let shape = Shape::Mesh(Box::new(Triangles::new(mesh, &local)));
            Object::new(shape, scene.material(0))
        });
        let all = objects.iter().chain(&reference);
        let bounds = all.fold(Aabb::EMPTY, |all, object| all.union(object.bounds()));
        let up = normalize(params.camera.map_or([0.0, 1.0, 0.0], |view| view.up));
        let direction = params
            .camera
            .map_or(THREE_QUARTER, |view| sub(view.eye, view.target));
        let framing = Camera::framing(&bounds, direction, up, 1.0);
        let (lights, places) = placed_lights(params, &local, &framing, bounds, up)?;
        let points = outline(&objects);
        let plane =
            (params.ground != Ground::None).then(|| Plane::new(&points, bounds, up, params));
        let camera = match params.camera {
            Some(view) => view.camera(&local)?,
            None => framed(&framing, points, plane.as_ref(), &places, params.size),
        };
        Ok(Stage {
            local,
            objects,
            bounds: widened(bounds),
            lamps: lamps(&lights, &places),
            lights,
            camera,
            up,
            plane,
            reference,
        })
    }

    /// What a ray sees first of some objects.
    #[inline]
    pub fn see(
        &self,
        ray: &Ray,
        params: &Params,
        some: impl Fn(&Object) -> bool,
        hits: &mut Scratch,
        visits: &mut Visits,
    ) -> Option<Sight> {
        let mut first: Option<Sight> = None;
        for (at, object) in self.objects.iter().enumerate().filter(|(_, o)| some(o)) {
            let limit = first.map_or(f64::INFINITY, |s| s.t);
            let seen = object.see(at, ray, limit, params, hits, visits);
            if let Some(seen) = seen.filter(|seen| seen.t < limit) {
                first = Some(seen);
            }
        }
        first
    }

    /// The share of light that passes along a ray up to `reach`. What is transparent takes its
    /// share once.
    pub fn passes(&self, ray: &Ray, reach: f64, visits: &mut Visits) -> f64 {
        let mut share = 1.0;
        for (at, object) in self.objects.iter().enumerate() {
            if object.blocks(at, ray, reach, visits) {
                share *= object.material.transparent;
                if share == 0.0 {
                    break;
                }
            }
        }
        share
    }

    /// Where the picture is taken from, in the file's unit.
    pub fn shot(&self, params: &Params) -> Shot {
        let own = || Shot::of(&self.camera, &self.local);
        params.camera.map_or_else(own, Shot::from)
    }

    /// The same with the reference in place of all covers; `None` where there is none.
    pub fn exact(mut self) -> Option<Stage> {
        let reference = self.reference.take()?;
        let others = self.objects.into_iter();
        let others = others.filter(|object| !matches!(object.shape, Shape::Cover(_)));
        self.objects = std::iter::once(reference).chain(others).collect();
        Some(self)
    }
}

fn shapes(scene: &Scene, params: &Params, local: &CornerFrame) -> Vec<Shape> {
    let covers = scene.covers.iter().map(|splats| {
        let discs = Discs::new(splats, local);
        Shape::Cover(Cover::new(discs, params.accelerator))
    });
    let meshes = scene.meshes.iter();
    let meshes = meshes.map(|mesh| Shape::Mesh(Box::new(Triangles::new(mesh, local))));
    let spheres = scene.spheres.iter();
    let spheres =
        spheres.map(|s| Shape::Sphere(local.to_local(s.centre), local.length_to_local(s.radius)));
    covers.chain(meshes).chain(spheres).collect()
}

/// The lights in the file's unit, and where they are in the frame.
fn placed_lights(
    params: &Params,
    local: &CornerFrame,
    framing: &Camera,
    bounds: Aabb,
    up: Vec3,
) -> Result<(Vec<Light>, Vec<Vec3>)> {
    let places = params
        .lights
        .iter()
        .map(|light| local.to_local(light.place));
    let places: Vec<Vec3> = places.collect();
    if let Some(far) = places.iter().position(|place| !is_near(*place)) {
        return Err(params.lights[far].too_far());
    }
    if !places.is_empty() {
        return Ok((params.lights.clone(), places));
    }
    let way = scale(upper_left(framing, up), 4.0 * framing.unit);
    let place = add(bounds.centre(), way);
    let light = Light {
        place: local.from_local(place),
        colour: [255; 3],
    };
    Ok((vec![light], vec![place]))
}

/// The lamps: all together give at most as much of any of red, green and blue as one white lamp.
fn lamps(lights: &[Light], places: &[Vec3]) -> Vec<Lamp> {
    let light = |light: &Light| to_linear(light.colour).map(f64::from);
    let sum = lights.iter().map(light).fold([0.0; 3], add);
    let most = sum.into_iter().fold(0.0, f64::max);
    let share = if most > 0.0 { 1.0 / most } else { 0.0 };
    let lamps = lights.iter().zip(places);
    lamps
        .map(|(l, place)| Lamp {
            place: *place,
            light: scale(light(l), share),
        })
        .collect()
}

/// Points of all objects' outlines.
fn outline(objects: &[Object]) -> Vec<Vec3> {
    let mut points = Vec::new();
    for object in objects {
        match &object.shape {
            Shape::Cover(cover) => {
                for s in &cover.discs.splats {
                    let axes = [s.tangent, s.bitangent()].map(|axis| scale(axis, s.radius));
                    points.extend(axes.map(|axis| add(s.centre, axis)));
                    points.extend(axes.map(|axis| sub(s.centre, axis)));
                }
            }
            Shape::Mesh(triangles) => {
                let corners = triangles.mesh.triangles.iter().flatten();
                points.extend(corners.map(|v| triangles.mesh.positions[*v as usize]));
            }
            Shape::Sphere(centre, radius) => points.extend(around(*centre, *radius)),
        }
    }
    points
}

/// Points of a sphere.
fn around(centre: Vec3, radius: f64) -> impl Iterator<Item = Vec3> {
    let step = |i: i32| f64::from(i - 2);
    let directions = (0..125).map(move |i| normalize([step(i % 5), step(i / 5 % 5), step(i / 25)]));
    directions.map(move |d| add(centre, scale(d, radius)))
}

/// The camera that has the scene and the shadows on the ground in the picture.
fn framed(
    framing: &Camera,
    mut points: Vec<Vec3>,
    plane: Option<&Plane>,
    lights: &[Vec3],
    size: [u32; 2],
) -> Camera {
    if let Some(plane) = plane {
        let count = points.len();
        for light in lights {
            for i in 0..count {
                let ray = (points[i], sub(points[i], *light));
                let cast = plane
                    .under(ray.0, ray.1)
                    .map(|way| add(ray.0, scale(ray.1, way)));
                points.extend(cast.filter(|place| plane.nearness(*place) == 1.0));
            }
        }
    }
    let size = Size {
        width: size[0] as usize,
        height: size[1] as usize,
    };
    framing.fitted(framing.seen(&points), size.aspect())
}

/// The box with room for rounding around it, in which rays are traced.
fn widened(bounds: Aabb) -> Aabb {
    const ROOM: f64 = 1.0 / (1u64 << 16) as f64;
    Aabb {
        lo: bounds.lo.map(|c| c - ROOM),
        hi: bounds.hi.map(|c| c + ROOM),
    }
}

impl Object {
    /// What a ray sees of it by `limit`.
    fn see(
        &self,
        at: usize,
        ray: &Ray,
        limit: f64,
        params: &Params,
        hits: &mut Scratch,
        visits: &mut Visits,
    ) -> Option<Sight> {
        match &self.shape {
            Shape::Cover(cover) => {
                let seen = cover.see(at, ray, limit, params.blend, hits, visits)?;
                let own = seen.colour.filter(|_| self.takes_colours());
                let splat = &cover.discs.splats[seen.disc as usize];
                let [a, b] = splat.slopes;
                let lean = splat.radius * a.hypot(b);
                Some(Sight {
                    t: seen.t,
                    object: at,
                    item: seen.disc,
                    normal: seen.normal,
                    plane: splat.normal,
                    colour: own.map_or(self.colour, |c| c.map(f64::from)),
                    around: seen.around,
                    error: seen.error,
                    lean: lean.min(MOST_LEAN),
                })
            }
            Shape::Mesh(triangles) => triangles.see(self, at, ray, limit),
            Shape::Sphere(centre, radius) => {
                let t = meet_sphere(*centre, *radius, at, ray).filter(|t| *t < limit)?;
                let normal = normalize(sub(ray.at(t), *centre));
                Some(self.plain(at, t, 0, normal, normal))
            }
        }
    }

    fn plain(&self, at: usize, t: f64, item: u32, normal: Vec3, plane: Vec3) -> Sight {
        Sight {
            t,
            object: at,
            item,
            normal,
            plane,
            colour: self.colour,
            around: 0,
            error: 0.0,
            lean: 0.0,
        }
    }

    /// The box around it.
    fn bounds(&self) -> Aabb {
        match &self.shape {
            Shape::Cover(cover) => cover.discs.bounds,
            Shape::Mesh(triangles) => used_bounds(&triangles.mesh),
            Shape::Sphere(centre, radius) => Aabb {
                lo: centre.map(|c| c - radius),
                hi: centre.map(|c| c + radius),
            },
        }
    }

    /// Whether a ray meets it before `reach`.
    fn blocks(&self, at: usize, ray: &Ray, reach: f64, visits: &mut Visits) -> bool {
        match &self.shape {
            Shape::Cover(cover) => cover.blocks(at, ray, reach, visits),
            Shape::Mesh(triangles) => triangles.tracer.any(&triangles.ray(at, ray, reach)),
            Shape::Sphere(centre, radius) => {
                meet_sphere(*centre, *radius, at, ray).is_some_and(|t| t < reach)
            }
        }
    }
}

/// Rays that start on triangles leave out what is nearer than this share of the scene: more than
/// the rounding of a place on them.
const LIFT: f64 = 1.0 / (1u64 << 34) as f64;

impl Triangles {
    fn ray(&self, at: usize, ray: &Ray, reach: f64) -> tracer::Ray {
        let own = ray.from.filter(|from| from.object == at);
        tracer::Ray {
            origin: ray.origin,
            direction: ray.direction,
            reach: [
                ray.least
                    .max(own.map_or(ray.least, |from| from.ball.max(LIFT))),
                reach,
            ],
        }
    }

    fn see(&self, object: &Object, at: usize, ray: &Ray, limit: f64) -> Option<Sight> {
        let hit = self.tracer.closest(&self.ray(at, ray, limit))?;
        let [a, b, c] = self.mesh.corners(hit.triangle as usize);
        let plane = normalize(cross(sub(b, a), sub(c, a)));
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let corners = self.mesh.triangles[hit.triangle as usize];
        let normal = self.mesh.normals.as_ref().map_or(plane, |normals| {
            let parts = corners.iter().zip(weights);
            let sum = parts.fold([0.0; 3], |sum, (v, w)| {
                add(sum, scale(normals[*v as usize], w))
            });
            let normal = normalize(sum);
            if dot(normal, plane) > 0.0 {
                normal
            } else {
                plane
            }
        });
        let mut sight = object.plain(at, hit.t, hit.triangle, normal, plane);
        if let Some(colours) = self.mesh.colors.as_ref().filter(|_| object.takes_colours()) {
            let parts = corners.iter().zip(weights);
            sight.colour = parts.fold([0.0; 3], |sum, (v, w)| {
                let [r, g, b, _] = colours[*v as usize];
                add(
                    sum,
                    scale([r, g, b].map(|c| f64::from(disc::to_light(c))), w),
                )
            });
        }
        Some(sight)
    }
}

/// The least way of a ray to a sphere, on which it may have started.
fn meet_sphere(centre: Vec3, radius: f64, at: usize, ray: &Ray) -> Option<f64> {
    let away = sub(ray.origin, centre);
    let along = dot(away, ray.direction);
    if ray.from.is_some_and(|from| from.object == at) {
        // One of the two ways is 0; the other is what is left.
        let across = -2.0 * along;
        return (across > LIFT * radius).then_some(across);
    }
    // From the point of the line that is nearest to the centre: no digits are lost far away.
    let nearest = sub(away, scale(ray.direction, along));
    let half = radius * radius - dot(nearest, nearest);
    if half < 0.0 {
        return None;
    }
    let half = half.sqrt();
    [-along - half, -along + half]
        .into_iter()
        .find(|t| *t > ray.least)
}

/// What a ray starts on that leaves a place seen by another.
pub(super) fn origin(sight: &Sight, side: f64, under: bool, ball: f64) -> Origin {
    Origin {
        object: sight.object,
        item: sight.item,
        side,
        under,
        ball,
    }
}
