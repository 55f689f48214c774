//! What is asked for.

use crate::error::{Error, Result, number};
use crate::image::colour::{Srgb, WHITE};
use crate::render::view::{MOST_PIXELS, TOO_FAR, View};
use crate::trade::named;
use schemars::JsonSchema;
use serde::Serialize;

/// How rays find discs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Accelerator {
    /// By a hierarchy of boxes, eight to a node.
    Bvh,
    /// By the paper's octree, made only where rays go.
    Octree,
}

named!(Accelerator {
    Bvh = "bvh",
    Octree = "octree"
});

/// Which hits a ray leaves out that starts on a disc.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SelfHit {
    /// Those on discs that overlap the one it starts on and agree with it.
    Overlap,
    /// Those near its start: within twice the error of the discs there.
    Ball,
}

named!(SelfHit {
    Overlap = "overlap",
    Ball = "ball"
});

/// What is averaged where discs overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Blend {
    /// Nothing: the disc whose centre is nearest stands alone.
    None,
    /// Normals and colours.
    Normals,
    /// Normals, colours and the way along the ray.
    Depth,
}

named!(Blend {
    None = "none",
    Normals = "normals",
    Depth = "depth"
});

/// What lies under the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ground {
    /// Nothing.
    None,
    /// A plane in the colour of the background, seen by the shadows on it.
    Shadow,
    /// A plane of squares.
    Checker,
}

named!(Ground {
    None = "none",
    Shadow = "shadow",
    Checker = "checker"
});

/// How an object looks.
///
/// What it sends back is `1 - mirror - transparent` of what Phong's model gives, `mirror` of what
/// is seen in it, `transparent` of what is seen through it, and the highlight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Material {
    /// Its colour, sRGB bytes; null takes those of the file, and clay where it has none.
    pub colour: Option<Srgb>,
    /// Share of the colour that is there without a lamp.
    pub ambient: f64,
    /// Share of the colour that a lamp from straight above adds.
    pub diffuse: f64,
    /// Brightness of the highlight.
    pub specular: f64,
    /// Exponent of the highlight: the larger, the smaller it is.
    pub shininess: f64,
    /// Share of light that is reflected as by a mirror.
    pub mirror: f64,
    /// Share of light that passes and is refracted.
    pub transparent: f64,
    /// Index of refraction of what is inside.
    pub index: f64,
}

impl Material {
    /// Dull clay.
    pub const DEFAULT: Material = Material {
        colour: None,
        ambient: 0.3,
        diffuse: 0.72,
        specular: 0.12,
        shininess: 32.0,
        mirror: 0.0,
        transparent: 0.0,
        index: 1.5,
    };

    /// Lacquer: a bright highlight and a faint mirror.
    pub const GLOSS: Material = Material {
        specular: 0.5,
        shininess: 80.0,
        mirror: 0.1,
        ..Material::DEFAULT
    };

    /// Polished metal.
    pub const MIRROR: Material = Material {
        specular: 0.5,
        shininess: 200.0,
        mirror: 0.9,
        ..Material::DEFAULT
    };

    /// Crystal.
    pub const GLASS: Material = Material {
        specular: 0.6,
        shininess: 200.0,
        mirror: 0.1,
        transparent: 0.9,
        ..Material::DEFAULT
    };

    /// Materials by name.
    pub const NAMED: [(&'static str, Material); 4] = [
        ("clay", Material::DEFAULT),
        ("gloss", Material::GLOSS),
        ("mirror", Material::MIRROR),
        ("glass", Material::GLASS),
    ];

    /// The names of all but the colour.
    pub const NUMBERS: [&'static str; 7] = [
        "ambient",
        "diffuse",
        "specular",
        "shininess",
        "mirror",
        "transparent",
        "index",
    ];

    /// The number of a name.
    pub fn number_mut(&mut self, name: &str) -> Option<&mut f64> {
        Some(match name {
            "ambient" => &mut self.ambient,
            "diffuse" => &mut self.diffuse,
            "specular" => &mut self.specular,
            "shininess" => &mut self.shininess,
            "mirror" => &mut self.mirror,
            "transparent" => &mut self.transparent,
            "index" => &mut self.index,
            _ => return None,
        })
    }

    /// Errs, in words for the option, where a number is out of its range.
    pub fn check(&self) -> Result<(), String> {
        let range = |name: &str, value: f64, [low, high]: [f64; 2]| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            let [value, low, high] = [value, low, high].map(number);
            Err(format!("{name} {value} is not from {low} to {high}"))
        };
        range("ambient", self.ambient, [0.0, 1.0])?;
        range("diffuse", self.diffuse, [0.0, 1.0])?;
        range("specular", self.specular, [0.0, 10.0])?;
        range("shininess", self.shininess, [1.0, 1e5])?;
        range("mirror", self.mirror, [0.0, 1.0])?;
        range("transparent", self.transparent, [0.0, 1.0])?;
        range("index", self.index, [0.1, 10.0])?;
        let sum = self.mirror + self.transparent;
        if sum > 1.0 {
            let sum = number(sum);
            return Err(format!("mirror and transparent together are {sum}, over 1"));
        }
        Ok(())
    }
}

/// A point that gives light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Light {
    /// Where it is, in the file's unit.
    pub place: [f64; 3],
    /// Its colour, sRGB bytes.
    pub colour: Srgb,
}

impl Light {
    fn wrong(&self, problem: &str) -> Error {
        let [x, y, z] = self.place;
        Error::parameter("light", format!("{x:?},{y:?},{z:?}"), problem)
    }

    pub(super) fn too_far(&self) -> Error {
        self.wrong(TOO_FAR)
    }
}

/// What [`super::draw`] is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// The camera; a three-quarter view of the scene, y up, where none is given.
    pub camera: Option<View>,
    /// The lights; one to the upper left of the viewer where none is given.
    pub lights: Vec<Light>,
    /// How often a ray may be reflected or refracted.
    pub depth: u32,
    /// How rays find discs.
    pub accelerator: Accelerator,
    /// Rays along each side of a pixel: `samples^2` for each.
    pub samples: u32,
    /// Which hits a ray leaves out that starts on a disc.
    pub self_hit: SelfHit,
    /// What is averaged where discs overlap.
    pub blend: Blend,
    /// What lies under the scene.
    pub ground: Ground,
    /// What is seen where nothing is, sRGB bytes; and of the sky at the horizon.
    pub background: Srgb,
    /// What is seen straight up where nothing is, sRGB bytes.
    pub sky: Srgb,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// What the places of several rays in a pixel are drawn from.
    pub seed: u64,
    /// Whether the tree is checked against every disc, and the picture against the finest setting.
    pub verify: bool,
}

/// Most bounces of a ray.
pub const MOST_DEPTH: u32 = 64;

/// Most rays along a side of a pixel.
pub const MOST_SAMPLES: u32 = 32;

/// Bounces, and rays along a side of a pixel, of the finest setting.
const FINEST_DEPTH: u32 = 8;
const FINEST_SAMPLES: u32 = 4;

impl Params {
    /// What holds when nothing is said.
    pub const DEFAULT: Params = Params {
        camera: None,
        lights: Vec::new(),
        depth: 2,
        accelerator: Accelerator::Bvh,
        samples: 1,
        self_hit: SelfHit::Overlap,
        blend: Blend::Normals,
        ground: Ground::Shadow,
        background: WHITE,
        sky: [148, 186, 226],
        size: [1024, 768],
        seed: 0,
        verify: false,
    };

    /// The same picture as exact as discs make it: what [`Params::verify`] compares with.
    pub fn finest(&self) -> Params {
        Params {
            depth: self.depth.max(FINEST_DEPTH),
            samples: self.samples.max(FINEST_SAMPLES),
            blend: Blend::Depth,
            self_hit: SelfHit::Overlap,
            ..self.clone()
        }
    }

    /// Errs where a value is out of its range, or a camera looks nowhere.
    pub fn check(&self) -> Result<()> {
        let range = |option, value: u32, least: u32, most: u32| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            let problem = format!("is not in {least}..={most}");
            Err(Error::parameter(option, value, problem))
        };
        range("depth", self.depth, 0, MOST_DEPTH)?;
        range("samples", self.samples, 1, MOST_SAMPLES)?;
        range("size", self.size[0], 1, MOST_PIXELS)?;
        range("size", self.size[1], 1, MOST_PIXELS)?;
        for light in &self.lights {
            if !light.place.iter().all(|c| c.is_finite()) {
                return Err(light.wrong("has a number that is not finite"));
            }
        }
        self.camera.as_ref().map_or(Ok(()), View::check)
    }
}
