//! What is drawn how.

use crate::error::{Error, Result};
use crate::image::colour::Srgb;
use crate::vector::rings::Fill;
use schemars::JsonSchema;
use serde::Serialize;

/// How it is found which features a pixel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Each pixel's place on the map is looked up in an index of the features.
    Distance,
    /// Polyhedra counted in a stencil; each with z-pass where it stays clear of the near plane, else z-fail.
    Stencil,
    /// As `Stencil`, all with z-pass.
    StencilZpass,
    /// As `Stencil`, all with z-fail.
    StencilZfail,
    /// A texture over the whole terrain, so many texels wide, its nearest texel.
    Texture(u32),
}

impl Method {
    /// The method of its name: `distance`, `stencil`, `stencil-zpass`, `stencil-zfail`, `texture:SIZE`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "distance" => Some(Method::Distance),
            "stencil" => Some(Method::Stencil),
            "stencil-zpass" => Some(Method::StencilZpass),
            "stencil-zfail" => Some(Method::StencilZfail),
            _ => {
                let size = name.strip_prefix("texture:")?;
                size.parse().ok().map(Method::Texture)
            }
        }
    }

    /// Its name.
    pub fn name(self) -> String {
        match self {
            Method::Distance => "distance".to_owned(),
            Method::Stencil => "stencil".to_owned(),
            Method::StencilZpass => "stencil-zpass".to_owned(),
            Method::StencilZfail => "stencil-zfail".to_owned(),
            Method::Texture(size) => format!("texture:{size}"),
        }
    }
}

/// How close the caps of polyhedra are to the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Caps {
    /// Below and above all of the surface.
    Global,
    /// Below and above what is under each polygon and each segment of a line.
    Tight,
}

/// When a polyhedron is counted with z-fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NearRule {
    /// The eye is within its box, grown by the distance to the corners of the near plane.
    GrownBox,
    /// The eye is within its box: the paper's rule, wrong where only the near plane cuts the box.
    Box,
}

/// How an overlay is made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// How it is found which features a pixel shows.
    pub method: Method,
    /// Samples in each pixel.
    pub samples: u32,
    /// How close caps are.
    pub caps: Caps,
    /// When z-fail is used.
    pub near_rule: NearRule,
    /// Bits of a stencil counter: 32, or 8 to show where that fails.
    pub stencil_bits: u32,
}

impl Params {
    /// One exact look-up a pixel.
    pub const DEFAULT: Self = Params {
        method: Method::Distance,
        samples: 1,
        caps: Caps::Tight,
        near_rule: NearRule::GrownBox,
        stencil_bits: 32,
    };

    /// Errs where a number is out of its range.
    pub fn check(&self) -> Result<()> {
        if !(1..=64).contains(&self.samples) {
            return Err(Error::parameter(
                "samples",
                self.samples,
                "is not from 1 to 64",
            ));
        }
        if !matches!(self.stencil_bits, 8 | 32) {
            let bits = self.stencil_bits;
            return Err(Error::parameter("stencil-bits", bits, "is not 8 or 32"));
        }
        match self.method {
            Method::Texture(size) if !(1..=32_768).contains(&size) => Err(Error::parameter(
                "method",
                format!("texture:{size}"),
                "is not from 1 to 32768 texels",
            )),
            _ => Ok(()),
        }
    }
}

/// The unit of a width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// The map's.
    Map,
    /// Pixels, at the distance of each vertex.
    Pixels,
}

/// What is at the inner vertices of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Join {
    /// A disc.
    Round,
    /// The corner of the outer borders, up to four half widths away; beyond that it is cut.
    Mitre,
}

/// What is at the ends of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Cap {
    /// Nothing: it ends at its last vertex.
    Butt,
    /// A disc.
    Round,
}

/// How a feature is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Style {
    /// Its colour.
    pub colour: Srgb,
    /// From 0, not seen, to 1.
    pub opacity: f64,
    /// Width of lines, diameter of points.
    pub width: f64,
    /// The unit of the width.
    pub unit: Unit,
    /// Inner vertices of lines.
    pub join: Join,
    /// Ends of lines.
    pub cap: Cap,
    /// What the rings of a polygon cover.
    pub fill: Fill,
}

impl Style {
    /// Two pixels wide, in a colour.
    pub const fn of(colour: Srgb) -> Style {
        Style {
            colour,
            opacity: 1.0,
            width: 2.0,
            unit: Unit::Pixels,
            join: Join::Round,
            cap: Cap::Butt,
            fill: Fill::NonZero,
        }
    }

    /// Errs where a number is out of its range.
    pub fn check(&self) -> Result<()> {
        if !(0.0..=1.0).contains(&self.opacity) {
            let value = self.opacity;
            return Err(Error::parameter("opacity", value, "is not from 0 to 1"));
        }
        if !(self.width >= 0.0 && self.width.is_finite()) {
            return Err(Error::parameter("width", self.width, "is not a width"));
        }
        Ok(())
    }
}
