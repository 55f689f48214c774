//! Soft shadows of area lights: rays through voxels, and exact rays beside them.
//!
//! After Forest, Barthe and Paulin (Real-Time Hierarchical Binary-Scene Voxelization, 2009), who
//! answer shadow rays by an octree of voxels, and never measured what that costs in accuracy.
//!
//! A voxel that the surface sets would shade that surface itself. A ray therefore goes by triangles
//! until it has left the voxels of the surface on which it starts, and by voxels from there: that is
//! after `(|n_x| + |n_y| + |n_z|) / cos` voxels for a plane of normal n that it leaves at this
//! angle; one voxel of height is added for surfaces that bend upwards, and the way held between [`NEAR_LEAST`] and [`NEAR_MOST`]. So in conservative mode no ray can miss a
//! blocker. The paper has no such part; to ignore what is near instead ([`Near::Skip`]) is faster,
//! and lets light through where things touch.

mod cast;
mod picture;
mod trade;

pub use cast::{NEAR_LEAST, NEAR_MOST};
pub use trade::TRADE;

use crate::camera::{Camera, Size, THREE_QUARTER};
use crate::error::{Error, Fault, Result};
use crate::image::raster::Raster;
use crate::mesh::Mesh;
use crate::mesh::tracer::Tracer;
use crate::numeric::vector::{Vec3, add, cross, length, normalize, scale, sub};
use crate::progress::Progress;
use crate::report::{Accuracy, Modelled, Warning};
use crate::spatial::aabb::Aabb;
use crate::spatial::local::{exponent_above, times_power_of_two};
use crate::volume::trace::Visits;
use crate::volume::voxelize::{self, Mode, Storage, voxelize};
use crate::volume::{Data, Volume};
use cast::{Caster, Tally};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// How shadow rays are answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// By the octree of the voxels.
    Octree,
    /// Voxel by voxel.
    Dda,
    /// By the triangles: the reference.
    Exact,
}

impl Method {
    /// The names of all values.
    pub const NAMES: &'static [&'static str] = &["octree", "dda", "exact"];

    /// The name of this value.
    pub fn name(self) -> &'static str {
        match self {
            Method::Octree => "octree",
            Method::Dda => "dda",
            Method::Exact => "exact",
        }
    }

    /// The value of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "octree" => Some(Method::Octree),
            "dda" => Some(Method::Dda),
            "exact" => Some(Method::Exact),
            _ => None,
        }
    }
}

/// What a ray through voxels does before it has left those of the surface it starts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Near {
    /// It goes by the triangles.
    Exact,
    /// It passes everything.
    Skip,
}

impl Near {
    /// The names of all values.
    pub const NAMES: &'static [&'static str] = &["skip", "exact"];

    /// The name of this value.
    pub fn name(self) -> &'static str {
        match self {
            Near::Exact => "exact",
            Near::Skip => "skip",
        }
    }

    /// The value of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "exact" => Some(Near::Exact),
            "skip" => Some(Near::Skip),
            _ => None,
        }
    }
}

/// A ball that gives light, in the mesh's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Light {
    /// Its centre.
    pub centre: [f64; 3],
    /// Its radius; 0 is a point, whose shadows are hard.
    pub radius: f64,
}

/// Where a picture is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct View {
    /// Where the viewer is, in the mesh's unit.
    pub eye: [f64; 3],
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// The direction that is up in the picture, and across the ground.
    pub up: [f64; 3],
    /// Angle from the bottom of the picture to its top, in degrees.
    pub fov_deg: f64,
}

/// What [`draw`] and [`bake`] are asked for.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// How shadow rays are answered.
    pub method: Method,
    /// Voxels along the longest side of the model.
    pub resolution: u32,
    /// Which voxels the surface sets: `three-axis` or `conservative`.
    pub mode: Mode,
    /// What rays through voxels do near the surface they start on.
    pub near: Near,
    /// Shadow rays for each pixel, or vertex, and light.
    pub rays: u32,
    /// The lights; one to the upper left of the viewer where none is given.
    pub lights: Vec<Light>,
    /// The camera; a three-quarter view of the model on its ground, y up, where none is given.
    pub camera: Option<View>,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// What the places of the rays' ends are drawn from.
    pub seed: u64,
    /// Whether errors are measured against exact rays.
    #[serde(skip)]
    pub verify: bool,
    /// Bytes that the voxels may take.
    #[serde(skip)]
    pub max_memory: u64,
}

/// Most pixels along a side of a picture.
pub const MOST_PIXELS: u32 = 16_384;

/// Most rays for a pixel and a light.
pub const MOST_RAYS: u32 = 1 << 20;

/// Rays for each pixel and light of the reference against which [`Params::verify`] measures.
pub const REFERENCE_RAYS: u32 = 64;

impl Params {
    /// What holds when nothing is said.
    pub const DEFAULT: Params = Params {
        method: Method::Octree,
        resolution: 256,
        mode: Mode::Conservative,
        near: Near::Exact,
        rays: 16,
        lights: Vec::new(),
        camera: None,
        size: [1024, 768],
        seed: 0,
        verify: false,
        max_memory: u64::MAX,
    };

    /// Errs where a value is out of its range, or a camera looks nowhere.
    pub fn check(&self) -> Result<()> {
        let range = |option, value: u32, most: u32| {
            if (1..=most).contains(&value) {
                return Ok(());
            }
            Err(Error::parameter(
                option,
                value,
                format!("is not in 1..={most}"),
            ))
        };
        range("rays", self.rays, MOST_RAYS)?;
        range("size", self.size[0], MOST_PIXELS)?;
        range("size", self.size[1], MOST_PIXELS)?;
        if !matches!(self.mode, Mode::ThreeAxis | Mode::Conservative) {
            let problem = "lets light through walls; use three-axis or conservative";
            return Err(Error::parameter("mode", self.mode.name(), problem));
        }
        for light in &self.lights {
            light.check()?;
        }
        self.camera.as_ref().map_or(Ok(()), View::check)
    }
}

impl Light {
    fn check(&self) -> Result<()> {
        let [x, y, z] = self.centre;
        let wrong = |problem: &str| {
            let text = format!("{x:?},{y:?},{z:?},{:?}", self.radius);
            Err(Error::parameter("light", text, problem))
        };
        if !self.centre.iter().all(|c| c.is_finite()) || !self.radius.is_finite() {
            return wrong("has a number that is not finite");
        }
        if self.radius < 0.0 {
            return wrong("the radius is negative");
        }
        Ok(())
    }
}

impl View {
    fn check(&self) -> Result<()> {
        let all = [self.eye, self.target, self.up].concat();
        let wrong = |problem: &str| {
            let mut words: Vec<String> = all.iter().map(|v| format!("{v:?}")).collect();
            words.push(format!("{:?}", self.fov_deg));
            Err(Error::parameter("camera", words.join(","), problem))
        };
        if !all.iter().all(|v| v.is_finite()) || !self.fov_deg.is_finite() {
            return wrong("has a number that is not finite");
        }
        let back = sub(self.eye, self.target);
        if length(back) == 0.0 {
            return wrong("the eye is the target, so there is no direction to look in");
        }
        if !length(back).is_finite() {
            return wrong("the distance from the eye to the target overflows");
        }
        if length(self.up) == 0.0 {
            return wrong("up has no length");
        }
        if length(cross(normalize(self.up), normalize(back))) < 1e-6 {
            return wrong("up is parallel to the direction of view");
        }
        if !(self.fov_deg > 0.0 && self.fov_deg < 170.0) {
            return wrong("the angle of view is not above 0 and below 170 degrees");
        }
        Ok(())
    }
}

/// What was seen of the voxels on the way.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Voxels {
    /// Voxels along x, y, z.
    pub dims: [u64; 3],
    /// Edge of a voxel, in the mesh's unit.
    pub spacing: f64,
    /// Voxels set.
    pub set_voxels: u64,
    /// Octree nodes whose children rays looked at; 0 for `dda`.
    pub nodes_visited: u64,
    /// Voxels whose bit rays looked at.
    pub voxels_visited: u64,
}

/// How shadows differ from those of exact rays.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Verified {
    /// Pixels, or vertices, at least one of whose rays is answered otherwise than by triangles.
    pub differing: u64,
    /// Those with a ray that passes a blocker.
    pub light_leaks: u64,
    /// Those with a ray that is blocked by nothing.
    pub false_shadows: u64,
    /// Rays that pass a blocker.
    pub leaking_rays: u64,
    /// Rays that are blocked by nothing.
    pub falsely_blocked_rays: u64,
    /// Mean difference of the blocked share, sign left aside, from that of the same rays by triangles.
    pub mean_difference: f64,
    /// Mean difference from the blocked share of other rays by triangles, [`REFERENCE_RAYS`] for
    /// each light: what the voxels and the number of rays are off by together.
    pub mean_error: f64,
    /// Octree nodes that the same rays visit without the depth mask; null but for `octree`.
    pub nodes_without_mask: Option<u64>,
    /// Voxels that the same rays cross one by one; null for `exact`.
    pub voxels_crossed: Option<u64>,
}

/// What was drawn or baked.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Lights, those of the default included.
    pub lights: Vec<Light>,
    /// Pixels, or vertices, from which a shadow ray was cast.
    pub shaded: u64,
    /// Shadow rays cast; none goes to a light behind the surface.
    pub shadow_rays: u64,
    /// Those that something blocks.
    pub blocked_rays: u64,
    /// The voxels; null for `exact`.
    pub voxels: Option<Voxels>,
    /// What `--verify` measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verified: Option<Verified>,
    #[serde(skip)]
    method: Method,
    #[serde(skip)]
    guarded: bool,
    #[serde(skip)]
    modelled: Modelled,
    /// What looks wrong.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

/// Draws the mesh under its lights, on a white ground that takes its shadow.
///
/// Four samples per pixel see the mesh through [`Tracer`]; the shadow rays of a pixel are spread
/// over them, and end on the disc that each light shows. Where they end depends on the seed and the
/// pixel alone: equal input gives equal bytes on any number of threads, and a model scaled by a
/// power of two or moved exactly gives the same picture. Both sides of triangles are alike: a camera
/// inside the mesh sees its inside, which no light from outside reaches. All lights together are as
/// bright as one, at any distance.
///
/// Errs for parameters out of range, for a mesh without triangles or whose extent overflows, and
/// where the voxels would not fit in `max_memory`. Cost: building, then four rays and `rays` per
/// light for each pixel.
pub fn draw(mesh: &Mesh, params: &Params, progress: &dyn Progress) -> Result<(Raster, Stats)> {
    let model = Model::new(mesh, params, progress)?;
    let caster = model.caster(params);
    let (raster, tally) = picture::draw(&model, &caster, params, progress);
    let stats = model.stats(params, &caster, tally);
    Ok((raster, stats))
}

/// The mesh with the share of the lights that each vertex sees as its colour, from black to white.
///
/// Light comes at the angle of the vertex's normal, the mean of those of its triangles weighted by
/// area: what falls behind it does not count, and of the rest the cosine. Vertices of no triangle
/// are black. Errs and costs as [`draw`], with vertices for pixels.
pub fn bake(mesh: &Mesh, params: &Params, progress: &dyn Progress) -> Result<(Mesh, Stats)> {
    let model = Model::new(mesh, params, progress)?;
    let caster = model.caster(params);
    progress.stage("trace", model.mesh.positions.len() as u64);
    let normals = model.normals();
    let found: Vec<(f64, Tally)> = (0..normals.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|v| {
            let mut tally = Tally::default();
            let start = caster.start(model.mesh.positions[v], normals[v], true);
            let rays = caster.rays(&[start], v as u64);
            tally.note(&rays);
            progress.advance(1);
            (rays.seen(0), tally)
        })
        .collect();
    let mut baked = mesh.clone();
    let grey = |light: f64| {
        let light = light.clamp(0.0, 1.0) as f32;
        [light, light, light, 1.0]
    };
    baked.colors = Some(found.iter().map(|(light, _)| grey(*light)).collect());
    let tally = found.into_iter().fold(Tally::default(), |mut all, (_, t)| {
        all.add(&t);
        all
    });
    let stats = model.stats(params, &caster, tally);
    Ok((baked, stats))
}

/// The way to coordinates in which the model's box starts at 0 and its longest side is from 1/2 to 1.
///
/// The difference from the box's corner moves with the model, and scaling by powers of two is exact:
/// what is left depends on neither place nor size.
#[derive(Debug, Clone, Copy)]
struct Local {
    origin: Vec3,
    exponent: i32,
}

impl Local {
    fn point(&self, p: Vec3) -> Vec3 {
        sub(p, self.origin).map(|c| times_power_of_two(c, -self.exponent))
    }

    fn length(&self, length: f64) -> f64 {
        times_power_of_two(length, -self.exponent)
    }
}

/// The mesh in local coordinates, its triangles laid out for rays, and its voxels.
struct Model {
    local: Local,
    /// Triangles alone; vertices that none uses are put where one is that is used.
    mesh: Mesh,
    tracer: Tracer,
    grid: Option<(Volume, voxelize::Stats)>,
    lights: Vec<Light>,
    camera: Camera,
    up: Vec3,
}

impl Model {
    fn new(mesh: &Mesh, params: &Params, progress: &dyn Progress) -> Result<Model> {
        params.check()?;
        if mesh.triangles.is_empty() {
            return Err(Error::Geometry(Fault::whole(
                "has no triangles, which alone cast and take shadows",
            )));
        }
        progress.stage("layout", 0);
        let (local, mesh) = localized(mesh)?;
        let tracer = Tracer::new(&mesh);
        let grid = match params.method {
            Method::Exact => None,
            method => {
                let asked = voxelize::Params {
                    size: voxelize::Size::Resolution(params.resolution),
                    mode: params.mode,
                    grid: if method == Method::Octree {
                        Storage::Sparse
                    } else {
                        Storage::Auto
                    },
                    // A margin would only make the tree's root larger.
                    pad: 0,
                    max_memory: params.max_memory,
                    ..voxelize::Params::DEFAULT
                };
                Some(voxelize(&mesh, &asked, progress)?)
            }
        };
        let up = params.camera.map_or([0.0, 1.0, 0.0], |view| view.up);
        let up = normalize(up);
        let bounds = mesh.bounds();
        let direction = params
            .camera
            .map_or(THREE_QUARTER, |view| sub(view.eye, view.target));
        let framing = Camera::framing(&bounds, direction, up, 1.0);
        let given = params.lights.iter().map(|light| Light {
            centre: local.point(light.centre),
            radius: local.length(light.radius),
        });
        let mut lights: Vec<Light> = given.collect();
        if lights.is_empty() {
            lights.push(default_light(&framing, bounds, up));
        }
        let size = Size {
            width: params.size[0] as usize,
            height: params.size[1] as usize,
        };
        let camera = match params.camera {
            Some(view) => {
                let (eye, target) = (local.point(view.eye), local.point(view.target));
                Camera::look_at(eye, target, up, view.fov_deg.to_radians())
            }
            None => picture::framed(&framing, &mesh, &lights, up, size),
        };
        Ok(Model {
            local,
            mesh,
            tracer,
            grid,
            lights,
            camera,
            up,
        })
    }

    fn caster<'a>(&'a self, params: &'a Params) -> Caster<'a> {
        let grid = self.grid.as_ref();
        let grid = grid.map(|(volume, made)| (&volume.data, made.lattice()));
        Caster::new(&self.tracer, grid, &self.lights, params)
    }

    /// A unit normal for each vertex; 0 where none is known.
    fn normals(&self) -> Vec<Vec3> {
        let mut sums = vec![[0.0; 3]; self.mesh.positions.len()];
        for (t, triangle) in self.mesh.triangles.iter().enumerate() {
            let [a, b, c] = self.mesh.corners(t);
            let area = cross(sub(b, a), sub(c, a));
            for v in triangle {
                let sum = &mut sums[*v as usize];
                *sum = add(*sum, area);
            }
        }
        sums.into_iter().map(normalize).collect()
    }

    fn stats(&self, params: &Params, caster: &Caster, tally: Tally) -> Stats {
        let world = |p: Vec3| {
            add(
                p.map(|c| times_power_of_two(c, self.local.exponent)),
                self.local.origin,
            )
        };
        let lights: Vec<Light> = if params.lights.is_empty() {
            let back = |light: &Light| Light {
                centre: world(light.centre),
                radius: times_power_of_two(light.radius, self.local.exponent),
            };
            self.lights.iter().map(back).collect()
        } else {
            params.lights.clone()
        };
        let triangles = self.mesh.triangles.len() as u64;
        let voxels = self.grid.as_ref().map(|(_, made)| Voxels {
            dims: made.dims,
            spacing: times_power_of_two(made.spacing[0], self.local.exponent),
            set_voxels: made.set_voxels,
            nodes_visited: tally.visits.nodes,
            voxels_visited: tally.visits.voxels,
        });
        let modelled = match (&self.grid, params.method) {
            (Some((_, made)), Method::Octree) => made.modelled(),
            (Some((volume, made)), _) => {
                let count = volume.frame.len() as u64;
                let bytes = match &volume.data {
                    Data::Sparse(tree) => tree.bytes(),
                    _ => made.dense_bytes,
                };
                Modelled::new("voxels", count, count, bytes)
            }
            (None, _) => Modelled::new("triangles", triangles, triangles, self.tracer.bytes()),
        };
        let mut warnings = Vec::new();
        caster.lights_in_voxels().warn(
            "light-in-voxel",
            "lights whose centre lies in a voxel of the surface, from where no light comes",
            &mut warnings,
        );
        Stats {
            triangles,
            lights,
            shaded: tally.shaded,
            shadow_rays: tally.rays,
            blocked_rays: tally.blocked,
            voxels,
            verified: params.verify.then(|| tally.verified(params.method)),
            method: params.method,
            guarded: params.mode == Mode::Conservative && params.near == Near::Exact,
            modelled,
            warnings,
        }
    }
}

/// The triangles of a mesh in local coordinates.
fn localized(mesh: &Mesh) -> Result<(Local, Mesh)> {
    let mut used = vec![false; mesh.positions.len()];
    for v in mesh.triangles.iter().flatten() {
        used[*v as usize] = true;
    }
    let of_triangles = mesh.positions.iter().zip(&used);
    let bounds = Aabb::around(of_triangles.filter(|(_, used)| **used).map(|(p, _)| p));
    let longest = bounds.extent().into_iter().fold(0.0, f64::max);
    if !longest.is_finite() {
        return Err(Error::Geometry(Fault::whole(format!(
            "the model spans {:?} to {:?}: its extent overflows",
            bounds.lo, bounds.hi
        ))));
    }
    let local = Local {
        origin: bounds.lo,
        exponent: if longest > 0.0 {
            exponent_above(longest)
        } else {
            0
        },
    };
    let first = mesh
        .triangles
        .first()
        .map_or([0.0; 3], |t| mesh.positions[t[0] as usize]);
    let place = |(p, used): (&Vec3, &bool)| local.point(if *used { *p } else { first });
    let positions = mesh.positions.iter().zip(&used).map(place).collect();
    let triangles = mesh.triangles.clone();
    Ok((local, Mesh::from_triangles(positions, triangles)))
}

/// The light of no other: to the upper left of the viewer, four radii of the model away.
fn default_light(framing: &Camera, bounds: Aabb, up: Vec3) -> Light {
    let right = normalize(cross(up, framing.axes[2]));
    let front = cross(right, up);
    let away = add(up, add(scale(right, -0.5), scale(front, 0.3)));
    let way = 4.0 * framing.unit;
    Light {
        centre: add(bounds.centre(), scale(normalize(away), way)),
        radius: 0.16 * way,
    }
}

impl Stats {
    /// The errors: bounds, and with `verify` what was measured. The first is the one that [`TRADE`]
    /// names.
    pub fn accuracy(&self) -> Vec<Accuracy> {
        let verified = self.verified.as_ref();
        let share = |count: u64| count as f64 / self.shaded.max(1) as f64;
        let measure =
            |measure: &str, unit: &str, bound, reached: Option<f64>, by: String| Accuracy {
                measure: measure.to_owned(),
                unit: unit.to_owned(),
                bound,
                reached,
                reference: by,
                verified: reached.is_some(),
            };
        let exact = self.method == Method::Exact;
        let zero = exact.then_some(0.0);
        let no_leak = (exact || self.guarded).then_some(0.0);
        let same = "the same rays by watertight triangles".to_owned();
        vec![
            measure(
                trade::SOFT.name,
                trade::SOFT.unit,
                None,
                verified.map(|v| v.mean_error),
                format!("{REFERENCE_RAYS} other rays per light by watertight triangles"),
            ),
            measure(
                "mean difference of the blocked share",
                "share of the light",
                zero,
                verified.map(|v| v.mean_difference),
                same.clone(),
            ),
            measure(
                "places with a light leak",
                "share of shaded places",
                no_leak,
                verified.map(|v| share(v.light_leaks)),
                same.clone(),
            ),
            measure(
                "places with false shadow",
                "share of shaded places",
                zero,
                verified.map(|v| share(v.false_shadows)),
                same,
            ),
        ]
    }

    /// How much of the full model was built.
    pub fn modelled(&self) -> Modelled {
        self.modelled.clone()
    }
}

impl Tally {
    fn verified(&self, method: Method) -> Verified {
        let voxels = method != Method::Exact;
        let mean = |sum: f64| sum / self.shaded.max(1) as f64;
        let Visits { nodes, .. } = self.unmasked;
        Verified {
            differing: self.differing,
            light_leaks: self.leaks,
            false_shadows: self.falses,
            leaking_rays: self.leaking,
            falsely_blocked_rays: self.falsely,
            mean_difference: mean(self.difference),
            mean_error: mean(self.error),
            nodes_without_mask: (method == Method::Octree).then_some(nodes),
            voxels_crossed: voxels.then_some(self.crossed.voxels),
        }
    }
}

#[cfg(test)]
mod tests;
