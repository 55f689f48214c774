//! What was drawn, and how exact it is.

use super::cast::Tally;
use super::{Light, Method, REFERENCE_RAYS, Shot, trade};
use crate::report::{Accuracy, Modelled, Warning};
use crate::volume::trace::Visits;
use schemars::JsonSchema;
use serde::Serialize;

/// What was seen of the voxels on the way.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Voxels {
    /// Voxels along x, y, z.
    pub dims: [u64; 3],
    /// Edge of a voxel, in the mesh's unit.
    pub spacing: f64,
    /// Voxels set; where the octree is made only as far as rays go, those that are known.
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
    /// Mean difference from the blocked share of other rays by triangles: [`REFERENCE_RAYS`] for each
    /// light, and where these disagree four times as many, or four times those asked for if that is
    /// more. It is what the voxels and the number of rays are off by together.
    pub mean_error: f64,
    /// Octree nodes that the same rays visit without the depth mask; null but for `octree`, and where it
    /// is made lazily.
    pub nodes_without_mask: Option<u64>,
    /// Voxels that the same rays cross one by one; null for `exact`, and for an octree
    /// made lazily.
    pub voxels_crossed: Option<u64>,
}

/// What was drawn or baked.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Lights, those of the default included.
    pub lights: Vec<Light>,
    /// The camera, that of the default included; null where nothing was drawn.
    pub camera: Option<Shot>,
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
    pub(super) method: Method,
    #[serde(skip)]
    pub(super) guarded: bool,
    #[serde(skip)]
    pub(super) modelled: Modelled,
    /// What looks wrong.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

impl Stats {
    /// The errors: bounds, and with `verify` what was measured. The first is the one that [`super::TRADE`]
    /// names.
    pub fn accuracy(&self) -> Vec<Accuracy> {
        // No place, no error: neither 0 nor any other.
        let verified = self.verified.as_ref().filter(|_| self.shaded > 0);
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
                format!(
                    "{REFERENCE_RAYS} other rays per light, and more in half shadow, by watertight triangles"
                ),
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
    pub(super) fn verified(&self, method: Method, lazy: bool) -> Verified {
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
            nodes_without_mask: (method == Method::Octree && !lazy).then_some(nodes),
            voxels_crossed: (voxels && !lazy).then_some(self.crossed.voxels),
        }
    }
}
