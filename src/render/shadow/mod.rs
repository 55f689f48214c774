//! Soft shadows of area lights: rays through voxels, and exact rays beside them.
//!
//! After Forest, Barthe and Paulin (Real-Time Hierarchical Binary-Scene Voxelization, 2009), who
//! answer shadow rays by an octree of voxels, and never measured what that costs in accuracy.
//!
//! A voxel that the surface sets would shade that surface itself. A ray therefore goes by triangles
//! until it is higher over the surface on which it starts than any of its voxels: those of a plane
//! with normal n reach `|n_x| + |n_y| + |n_z|` voxels over it, and one more is added for surfaces that
//! bend upwards. What is on this first part is met exactly, and what is beyond by its voxels, so in
//! conservative mode no ray misses a blocker. The paper has no such part; to pass what is near instead
//! ([`Near::Skip`]) is faster, and lets light through where things touch.

mod cast;
mod params;
mod picture;
mod stats;
mod trade;

pub use super::view::{MOST_PIXELS, Shot, View};
pub use cast::NEAR_LEAST;
pub use params::{Light, MOST_RAYS, Method, Near, Params, REFERENCE_RAYS};
pub use stats::{Stats, Verified};
pub use trade::TRADE;

use super::view::{frame, is_near, upper_left};
use crate::camera::{Camera, Size, THREE_QUARTER};
use crate::error::{Error, Fault, Result};
use crate::image::raster::Raster;
use crate::mesh::Mesh;
use crate::mesh::tracer::Tracer;
use crate::numeric::vector::{Vec3, add, cross, normalize, scale, sub};
use crate::progress::Progress;
use crate::report::{Modelled, Warning};
use crate::spatial::aabb::Aabb;
use crate::spatial::local::CornerFrame;
use crate::volume::octree::RayTree;
use crate::volume::voxelize::{self, Lazy, Mode, voxelize};
use crate::volume::{Data, Volume};
use cast::{Caster, Grid, Tally, Voxels};
use rayon::prelude::*;

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
    let caster = model.caster(params, progress)?;
    let (raster, tally) = picture::draw(&model, &caster, params, progress);
    let mut stats = model.stats(params, &caster, tally);
    stats.camera = Some(
        params
            .camera
            .map_or_else(|| Shot::of(&model.camera, &model.local), Shot::from),
    );
    Ok((raster, stats))
}

/// The mesh with the share of the lights that each vertex sees as its colour, from black to white.
///
/// Light comes at the angle of the vertex's normal, the mean of those of its triangles weighted by
/// area: what falls behind it does not count, and of the rest the cosine. Vertices of no triangle
/// are black. Errs and costs as [`draw`], with vertices for pixels.
pub fn bake(mesh: &Mesh, params: &Params, progress: &dyn Progress) -> Result<(Mesh, Stats)> {
    let model = Model::new(mesh, params, progress)?;
    let caster = model.caster(params, progress)?;
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

/// The mesh in local coordinates, its triangles laid out for rays, and its voxels.
struct Model {
    local: CornerFrame,
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
        let grid = if params.method == Method::Exact || params.lazy {
            None
        } else {
            Some(voxelize(&mesh, &params.voxels(), progress)?)
        };
        let up = params.camera.map_or([0.0, 1.0, 0.0], |view| view.up);
        let up = normalize(up);
        let bounds = mesh.bounds();
        let direction = params
            .camera
            .map_or(THREE_QUARTER, |view| sub(view.eye, view.target));
        let framing = Camera::framing(&bounds, direction, up, 1.0);
        let given = params.lights.iter().map(|light| Light {
            centre: local.to_local(light.centre),
            radius: local.length_to_local(light.radius),
        });
        let mut lights: Vec<Light> = given.collect();
        for (light, asked) in lights.iter().zip(&params.lights) {
            if !is_near(light.centre) || !is_near([light.radius; 3]) {
                return Err(asked.too_far());
            }
        }
        if lights.is_empty() {
            lights.push(default_light(&framing, bounds, up));
        }
        let size = Size {
            width: params.size[0] as usize,
            height: params.size[1] as usize,
        };
        let camera = match params.camera {
            Some(view) => view.camera(&local)?,
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

    fn caster<'a>(&'a self, params: &'a Params, progress: &dyn Progress) -> Result<Caster<'a>> {
        let grid = match &self.grid {
            None if params.lazy => {
                let lazy = Lazy::new(&self.mesh, &params.voxels(), progress)?;
                Some((lazy.lattice(), Voxels::Lazy(Box::new(lazy))))
            }
            None => None,
            Some((volume, made)) => {
                let voxels = match &volume.data {
                    Data::Sparse(tree) if params.method == Method::Octree => {
                        Voxels::Octree(RayTree::new(tree), tree)
                    }
                    data => Voxels::Each(data),
                };
                Some((made.lattice(), voxels))
            }
        };
        let grid = grid.map(|(lattice, voxels)| Grid { lattice, voxels });
        Ok(Caster::new(&self.tracer, grid, &self.lights, params))
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
        let lights: Vec<Light> = if params.lights.is_empty() {
            let back = |light: &Light| Light {
                centre: self.local.from_local(light.centre),
                radius: self.local.length_from_local(light.radius),
            };
            self.lights.iter().map(back).collect()
        } else {
            params.lights.clone()
        };
        let triangles = self.mesh.triangles.len() as u64;
        let (set_voxels, modelled) = self.made(caster);
        let voxels = caster.grid().map(|grid| stats::Voxels {
            dims: grid.lattice.dims.map(|d| d as u64),
            spacing: self.local.length_from_local(grid.lattice.h),
            set_voxels,
            nodes_visited: tally.visits.nodes,
            voxels_visited: tally.visits.voxels,
        });
        let mut warnings = Vec::new();
        caster.lights_in_voxels().warn(
            "light-in-voxel",
            "lights whose centre lies in a voxel of the surface, from where no light comes",
            &mut warnings,
        );
        if tally.shaded == 0 {
            let message = "no place is seen that light could reach: there is no shadow to judge";
            warnings.push(Warning::new("nothing-shaded", message, 1, None));
        }
        Stats {
            triangles,
            lights,
            camera: None,
            shaded: tally.shaded,
            shadow_rays: tally.rays,
            blocked_rays: tally.blocked,
            voxels,
            verified: params
                .verify
                .then(|| tally.verified(params.method, params.lazy)),
            method: params.method,
            guarded: params.mode == Mode::Conservative && params.near == Near::Exact,
            modelled,
            warnings,
        }
    }
}

impl Model {
    /// How many voxels are set, and how much of the full model was made.
    fn made(&self, caster: &Caster) -> (u64, Modelled) {
        let grid = caster.grid().map(|grid| &grid.voxels);
        match (grid, &self.grid) {
            (Some(Voxels::Lazy(lazy)), _) => (lazy.extent().set_voxels, lazy.modelled()),
            (Some(Voxels::Octree(tree, _)), Some((_, made))) => {
                let bytes = tree.bytes();
                let modelled = made.modelled();
                (made.set_voxels, Modelled { bytes, ..modelled })
            }
            (_, Some((volume, made))) => {
                let count = volume.frame.len() as u64;
                let bytes = match &volume.data {
                    Data::Sparse(tree) => tree.bytes(),
                    _ => made.dense_bytes,
                };
                (
                    made.set_voxels,
                    Modelled::new("voxels", count, count, bytes),
                )
            }
            (_, None) => {
                let triangles = self.mesh.triangles.len() as u64;
                let bytes = self.tracer.bytes();
                (0, Modelled::new("triangles", triangles, triangles, bytes))
            }
        }
    }
}

/// The triangles of a mesh in local coordinates.
fn localized(mesh: &Mesh) -> Result<(CornerFrame, Mesh)> {
    let mut used = vec![false; mesh.positions.len()];
    for v in mesh.triangles.iter().flatten() {
        used[*v as usize] = true;
    }
    let of_triangles = mesh.positions.iter().zip(&used);
    let bounds = Aabb::around(of_triangles.filter(|(_, used)| **used).map(|(p, _)| p));
    let local = frame(bounds, 0.0)?;
    let first = mesh
        .triangles
        .first()
        .map_or([0.0; 3], |t| mesh.positions[t[0] as usize]);
    let place = |(p, used): (&Vec3, &bool)| local.to_local(if *used { *p } else { first });
    let positions = mesh.positions.iter().zip(&used).map(place).collect();
    let triangles = mesh.triangles.clone();
    Ok((local, Mesh::from_triangles(positions, triangles)))
}

/// The light of no other: to the upper left of the viewer, four radii of the model away.
fn default_light(framing: &Camera, bounds: Aabb, up: Vec3) -> Light {
    let way = 4.0 * framing.unit;
    Light {
        centre: add(bounds.centre(), scale(upper_left(framing, up), way)),
        radius: 0.16 * way,
    }
}

#[cfg(test)]
mod tests;
