//! What was drawn, and how exact it is.

use super::params::Light;
use super::trace::Rays;
use crate::render::view::Shot;
use crate::report::{Accuracy, Modelled, Warning};
use schemars::JsonSchema;
use serde::Serialize;

/// The hierarchy of boxes over the discs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct BvhStats {
    /// Its leaves, of up to four discs.
    pub leaves: u64,
}

/// The octree of the discs, as far as it was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct OctreeStats {
    /// Nodes and leaves.
    pub nodes: u64,
    /// Leaves among them.
    pub leaves: u64,
    /// Depth of the deepest leaf; that of the whole is 0.
    pub depth: u64,
    /// Discs in leaves, each counted in every leaf that holds it.
    pub refs: u64,
    /// Those for each disc of the scene.
    pub refs_per_splat: f64,
}

/// How rays through the tree compare with rays that try every disc.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Checked {
    /// Rays that were traced both ways: some through pixels, and those mirrored where they hit.
    pub rays: u64,
    /// Those that see another disc, or the same with another bit in its way, normal or colour.
    pub differing: u64,
}

/// What was drawn.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Discs of all objects.
    pub splats: u64,
    /// Triangles of all objects.
    pub triangles: u64,
    /// Spheres.
    pub spheres: u64,
    /// The lights, that of the default included.
    pub lights: Vec<Light>,
    /// The camera, that of the default included.
    pub camera: Shot,
    /// Rays traced.
    pub rays: Rays,
    /// Primary rays that see an object.
    pub hits: u64,
    /// Reflected rays that leave the outer side of an object of discs and meet it again, as they may
    /// where it is hollow.
    pub reflected_again: u64,
    /// Discs that a ray was tested against, in the mean over all rays.
    pub tests_per_ray: f64,
    /// Leaves of the tree that a ray looked into, in the mean over all rays.
    pub leaves_per_ray: f64,
    /// Discs met around the first hit, in the mean over the primary rays that see discs; null where
    /// none does.
    pub discs_per_hit: Option<f64>,
    /// The hierarchy of boxes; null for `octree`.
    pub bvh: Option<BvhStats>,
    /// The octree; null for `bvh`.
    pub octree: Option<OctreeStats>,
    /// What `--verify` found of the tree.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checked: Option<Checked>,
    #[serde(skip)]
    pub(super) modelled: Modelled,
    /// What looks wrong.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

impl Stats {
    /// The error of the tree: rays that see what they would not by trying every disc.
    pub fn accuracy(&self) -> Accuracy {
        let share = |c: Checked| c.differing as f64 / c.rays.max(1) as f64;
        Accuracy {
            measure: "rays that the tree answers otherwise".to_owned(),
            unit: "share of rays".to_owned(),
            bound: Some(0.0),
            reached: self.checked.filter(|c| c.rays > 0).map(share),
            reference: "rays that try every disc".to_owned(),
            verified: self.checked.is_some_and(|c| c.rays > 0),
        }
    }

    /// How much of the full model was built.
    pub fn modelled(&self) -> Modelled {
        self.modelled.clone()
    }
}
