//! What is asked for.

use crate::error::{Error, Result};
use crate::render::view::{MOST_PIXELS, TOO_FAR, View};
use crate::trade::named;
use crate::volume::voxelize::{self, Mode, Storage};
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

named!(Method { Octree = "octree", Dda = "dda", Exact = "exact" });

/// What a ray through voxels does before it has left those of the surface it starts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Near {
    /// It goes by the triangles.
    Exact,
    /// It passes everything.
    Skip,
}

named!(Near { Skip = "skip", Exact = "exact" });

/// A ball that gives light, in the mesh's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Light {
    /// Its centre.
    pub centre: [f64; 3],
    /// Its radius; 0 is a point, whose shadows are hard.
    pub radius: f64,
}

/// What [`super::draw`] and [`super::bake`] are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// How shadow rays are answered.
    pub method: Method,
    /// Voxels along the longest side of the model.
    pub resolution: u32,
    /// Whether the octree is made only where rays go.
    pub lazy: bool,
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
    pub verify: bool,
    /// Bytes that the voxels may take.
    pub max_memory: u64,
}

/// Most rays for a pixel and a light.
pub const MOST_RAYS: u32 = 1 << 20;

/// Rays for each pixel and light of the reference against which [`Params::verify`] measures; more in
/// half shadow.
pub const REFERENCE_RAYS: u32 = 64;

impl Params {
    /// What holds when nothing is said.
    pub const DEFAULT: Params = Params {
        method: Method::Octree,
        resolution: 256,
        lazy: false,
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
        if self.lazy && self.method != Method::Octree {
            let problem = "makes the octree, which --method octree alone goes by";
            return Err(Error::parameter("lazy", true, problem));
        }
        for light in &self.lights {
            light.check()?;
        }
        self.camera.as_ref().map_or(Ok(()), View::check)
    }
}

impl Params {
    /// The voxels that are asked for.
    pub(super) fn voxels(&self) -> voxelize::Params {
        voxelize::Params {
            size: voxelize::Size::Resolution(self.resolution),
            mode: self.mode,
            grid: if self.method == Method::Octree {
                Storage::Sparse
            } else {
                Storage::Auto
            },
            // A margin would only make the tree's root larger.
            pad: 0,
            max_memory: self.max_memory,
            ..voxelize::Params::DEFAULT
        }
    }
}

impl Light {
    fn wrong(&self, problem: &str) -> Error {
        let [x, y, z] = self.centre;
        let text = format!("{x:?},{y:?},{z:?},{:?}", self.radius);
        Error::parameter("light", text, problem)
    }

    pub(super) fn too_far(&self) -> Error {
        self.wrong(TOO_FAR)
    }

    fn check(&self) -> Result<()> {
        let wrong = |problem: &str| Err(self.wrong(problem));
        if !self.centre.iter().all(|c| c.is_finite()) || !self.radius.is_finite() {
            return wrong("has a number that is not finite");
        }
        if self.radius < 0.0 {
            return wrong("the radius is negative");
        }
        Ok(())
    }
}
