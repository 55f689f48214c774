//! Pictures of surfaces that are covered by discs: Phong's light, shadows, mirrors and glass.
//!
//! After Linsen, Müller and Rosenthal, "Splat-based ray tracing of point clouds" (WSCG 2007). A ray
//! meets the discs around its first hit; of these the one counts whose centre is nearest in radii,
//! and their normals are blended, so that a surface of flat discs shades like a smooth one. The
//! discs are found by a hierarchy of boxes or by the paper's octree; both answer every ray with
//! the very bits that trying all discs gives.
//!
//! Three things of the paper are put right. Its octree tests four corners of a disc that span a
//! quarter of it. It chooses among the hits in one cell, which may lie outside the cell, or on
//! another layer of the surface. And its rays leave out all hits near their start, which loses
//! shadows where things touch and keeps false ones where discs are large; [`SelfHit::Overlap`]
//! leaves out what overlaps the disc that the ray starts on.

mod boxes;
mod cover;
mod disc;
mod octree;
mod params;
mod picture;
mod plane;
mod scene;
mod stats;
mod trace;
mod trade;
mod tree;

pub use params::{
    Accelerator, Blend, Ground, Light, MOST_DEPTH, MOST_SAMPLES, Material, Params, SelfHit,
};
pub use scene::{Scene, Sphere};
pub use stats::{BvhStats, Checked, OctreeStats, Stats};
pub use trace::Rays;
pub use trade::TRADE;

use crate::error::Result;
use crate::image::raster::Raster;
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use crate::progress::Progress;
use crate::report::{self, Modelled, Warning};
use cover::{Cover, Scratch};
use disc::Ray;
use picture::{Eye, Middle};
use rayon::prelude::*;
use scene::{Shape, Stage};
use trace::{Tally, mirror};
use tree::{Tree, Visits};

/// Tests of discs that checking the tree may cost.
const CHECK_TESTS: u64 = 1 << 31;

/// Most rays that check the tree, and as many again that are mirrored.
const CHECK_RAYS: u64 = 1 << 14;

/// A picture, and what it is judged by.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// The light of each pixel.
    pub light: Raster,
    /// What is seen in the middle of each pixel, row by row; only where the scene has a
    /// reference.
    pub looks: Vec<Look>,
    /// The same picture of the scene's reference, or else with [`Params::verify`] of the finest
    /// setting.
    pub exact: Option<Raster>,
    /// The scene's reference in the frame of the looks.
    pub surface: Option<Mesh>,
    /// Length of the diagonal of the scene's box in that frame.
    pub diagonal: f64,
}

/// What is seen of the covers in the middle of a pixel, in a frame in which the scene is between 1/2
/// and 1 long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// A place on the line of sight, near the scene.
    pub origin: Vec3,
    /// Unit vector away from the viewer.
    pub direction: Vec3,
    /// From the origin to what is seen; infinite where nothing is.
    pub depth: f64,
    /// The unit normal that shades, pointing outwards; 0 where nothing is seen.
    pub normal: Vec3,
    /// Whether it is seen from outside; discs that stand out at an outline are, whatever side they show.
    pub outside: bool,
}

/// Draws a scene, and says what it took.
///
/// Equal input gives equal bytes on any number of threads; a scene scaled by a power of two or
/// moved exactly, with its lights and its camera, gives the same picture. All lights together are at
/// most as bright as one, at any distance. Both sides of a surface are drawn.
///
/// Errs for parameters out of range, for discs that are none, for a scene without anything to draw or
/// whose extent overflows. Cost: O(n log n) for the tree, then for each pixel a ray, and for each hit
/// one to each light and up to two more until `depth` bounces are done.
pub fn draw(scene: &Scene, params: &Params, progress: &dyn Progress) -> Result<(Drawing, Stats)> {
    let stage = Stage::new(scene, params, progress)?;
    progress.stage("trace", u64::from(params.size[1]));
    let (light, tally) = picture::draw(&stage, params, progress);
    let mut stats = stats_of(scene, &stage, params, &tally);
    if params.verify {
        progress.stage("check", 0);
        stats.checked = Some(checked(&stage, params));
    }
    let looks = if stage.reference.is_some() {
        progress.stage("look", 0);
        Eye::new(&stage, params).middles(look)
    } else {
        Vec::new()
    };
    let surface = stage
        .reference
        .as_ref()
        .and_then(|object| match &object.shape {
            Shape::Mesh(triangles) => Some(triangles.mesh().clone()),
            _ => None,
        });
    let diagonal = stage.bounds.diagonal();
    let exact = if surface.is_some() {
        progress.stage("reference", u64::from(params.size[1]));
        let exact = stage.exact();
        exact.map(|stage| picture::draw(&stage, params, progress).0)
    } else if params.verify {
        progress.stage("reference", u64::from(params.size[1]));
        Some(picture::draw(&stage, &params.finest(), progress).0)
    } else {
        None
    };
    let drawing = Drawing {
        light,
        looks,
        exact,
        surface,
        diagonal,
    };
    Ok((drawing, stats))
}

fn look(middle: &Middle) -> Look {
    let Middle { ray, sight } = middle;
    Look {
        origin: ray.origin,
        direction: ray.direction,
        depth: sight.map_or(f64::INFINITY, |s| s.t),
        normal: sight.map_or([0.0; 3], |s| s.normal),
        outside: sight.is_some_and(|s| s.is_outside(ray)),
    }
}

/// Some rays by the tree and by every disc.
fn checked(stage: &Stage, params: &Params) -> Checked {
    let mut all = Checked::default();
    for object in &stage.objects {
        let Shape::Cover(cover) = &object.shape else {
            continue;
        };
        let discs = cover.discs.plates.len() as u64;
        let pixels = u64::from(params.size[0]) * u64::from(params.size[1]);
        let most = (CHECK_TESTS / discs.max(1))
            .clamp(64, CHECK_RAYS)
            .min(pixels);
        let eye = Eye::new(stage, params);
        let counts: Vec<Checked> = (0..most)
            .into_par_iter()
            .map(|i| {
                let pixel = (u128::from(i) * u128::from(pixels) / u128::from(most)) as u64;
                let (x, y) = (pixel % pixels_along(params), pixel / pixels_along(params));
                let ray = eye.ray(x as f64 + 0.5, y as f64 + 0.5);
                check_ray(cover, &ray, params)
            })
            .collect();
        for count in counts {
            all.rays += count.rays;
            all.differing += count.differing;
        }
    }
    all
}

fn pixels_along(params: &Params) -> u64 {
    u64::from(params.size[0])
}

/// One ray, and the one mirrored where it hits, both ways.
fn check_ray(cover: &Cover, ray: &Ray, params: &Params) -> Checked {
    let (mut hits, mut visits) = (Scratch::new(), Visits::default());
    let mut found = Checked::default();
    let mut next = Some(*ray);
    while let Some(ray) = next.filter(|_| found.rays < 2) {
        let far = f64::INFINITY;
        let seen = cover.see(0, &ray, far, params.blend, &mut hits, &mut visits);
        found.rays += 1;
        found.differing += u64::from(seen != cover.see_one_by_one(&ray, params.blend));
        next = seen.map(|seen| Ray {
            origin: ray.at(seen.t),
            direction: mirror(ray.direction, seen.normal),
            least: 0.0,
            from: None,
        });
    }
    found
}

fn stats_of(scene: &Scene, stage: &Stage, params: &Params, tally: &Tally) -> Stats {
    let splats: u64 = scene.covers.iter().map(|c| c.splats.len() as u64).sum();
    let triangles = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
    let per_ray = |count: u64| count as f64 / tally.rays.sum().max(1) as f64;
    let mut trees = Trees::default();
    for object in &stage.objects {
        if let Shape::Cover(cover) = &object.shape {
            trees.count(cover);
        }
    }
    let octree = params.accelerator == Accelerator::Octree;
    let refs_per_splat = trees.octree.refs as f64 / splats.max(1) as f64;
    let mut warnings = Vec::new();
    trees.without_size.warn(
        "splats-without-size",
        "splats of radius 0, which no ray meets",
        &mut warnings,
    );
    if tally.hits == 0 {
        let message = "no ray through a pixel meets anything";
        warnings.push(Warning::new("nothing-seen", message, 1, None));
    }
    Stats {
        splats,
        triangles,
        spheres: scene.spheres.len() as u64,
        lights: stage.lights.clone(),
        camera: stage.shot(params),
        rays: tally.rays,
        hits: tally.hits,
        reflected_again: tally.again,
        tests_per_ray: per_ray(tally.visits.tests),
        leaves_per_ray: per_ray(tally.visits.leaves),
        discs_per_hit: (tally.on_discs > 0).then(|| tally.around as f64 / tally.on_discs as f64),
        bvh: (!octree).then_some(trees.bvh),
        octree: octree.then_some(OctreeStats {
            refs_per_splat,
            ..trees.octree
        }),
        checked: None,
        modelled: if octree {
            Modelled::new("octree nodes", trees.octree.nodes, trees.full, trees.bytes)
        } else {
            Modelled::new("splats", splats, splats, trees.bytes)
        },
        warnings,
    }
}

/// What all trees are together.
#[derive(Default)]
struct Trees {
    bvh: BvhStats,
    octree: OctreeStats,
    full: u64,
    bytes: u64,
    discs: u64,
    without_size: report::Tally,
}

impl Trees {
    fn count(&mut self, cover: &Cover) {
        for plate in &cover.discs.plates {
            if plate.square == 0.0 {
                self.without_size.note(self.discs);
            }
            self.discs += 1;
        }
        match &cover.tree {
            Tree::Boxes(boxes) => {
                let (leaves, bytes) = boxes.size();
                self.bvh.leaves += leaves;
                self.bytes += bytes;
            }
            Tree::Octree(octree) => {
                let extent = octree.extent(&cover.discs.splats);
                self.octree.nodes += extent.nodes;
                self.octree.leaves += extent.leaves;
                self.octree.depth = self.octree.depth.max(extent.depth);
                self.octree.refs += extent.refs;
                self.full += extent.full;
                self.bytes += extent.bytes;
            }
            Tree::Each => {}
        }
    }
}

#[cfg(test)]
mod tests;
