//! What is asked for.

use crate::error::{Error, Result};
use crate::numeric::vector::Vec3;
use crate::trade::named;
use schemars::JsonSchema;
use serde::Serialize;

/// A length: absolute, or a share of the diagonal of the cloud's box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Length {
    /// In the cloud's unit.
    Absolute(f64),
    /// Times the diagonal: 0.001 is a thousandth.
    OfDiagonal(f64),
}

impl Length {
    /// The length of its name: `0.1`, or `0.5%` of the diagonal.
    pub fn from_name(name: &str) -> Option<Self> {
        match name.strip_suffix('%') {
            Some(percent) => Some(Length::OfDiagonal(
                percent.trim().parse::<f64>().ok()? / 100.0,
            )),
            None => name.parse().ok().map(Length::Absolute),
        }
    }

    /// The name of this length.
    pub fn name(self) -> String {
        match self {
            Length::Absolute(length) => crate::error::number(length),
            Length::OfDiagonal(share) => format!("{}%", crate::error::number(share * 100.0)),
        }
    }

    /// The number without its unit.
    pub fn value(self) -> f64 {
        match self {
            Length::Absolute(value) | Length::OfDiagonal(value) => value,
        }
    }

    /// The length, where the diagonal is known in the same unit.
    pub fn of(self, diagonal: f64) -> f64 {
        match self {
            Length::Absolute(length) => length,
            Length::OfDiagonal(share) => share * diagonal,
        }
    }

    fn check(self, option: &'static str) -> Result<()> {
        if self.value() > 0.0 && self.value().is_finite() {
            return Ok(());
        }
        let problem = "must be a number above 0";
        Err(Error::parameter(option, self.name(), problem))
    }
}

/// In which order points start discs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Along Morton's curve, which the order of the file does not change.
    Morton,
    /// As in the file.
    File,
    /// At random, by this seed; the order of the file does not change it.
    Random(u64),
}

impl Order {
    /// The order of a name: `morton`, `file`, `random:SEED`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "morton" => Some(Order::Morton),
            "file" => Some(Order::File),
            _ => match name.split_once(':')? {
                ("random", seed) => seed.parse().ok().map(Order::Random),
                _ => None,
            },
        }
    }

    /// The name of this order.
    pub fn name(self) -> String {
        match self {
            Order::Morton => "morton".to_owned(),
            Order::File => "file".to_owned(),
            Order::Random(seed) => format!("random:{seed}"),
        }
    }
}

/// Which discs are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Cover {
    /// One from each point that none before it covers near its centre, as in the paper.
    Paper,
    /// Of those, always the one that serves most of what is left.
    Greedy,
}
named! { Cover { Paper = "paper", Greedy = "greedy" } }

/// How normals get one outside.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Orient {
    /// By a minimum spanning tree over neighbours; each part by its extremal points.
    Mst,
    /// Towards a place from which all points were seen, in the cloud's coordinates.
    Viewpoint(Vec3),
    /// As given; estimated ones upwards along z.
    Keep,
}

impl Orient {
    /// The way of a name: `mst`, `viewpoint:X,Y,Z`, `keep`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "mst" => Some(Orient::Mst),
            "keep" => Some(Orient::Keep),
            _ => match name.split_once(':')? {
                ("viewpoint", place) => {
                    let numbers: Vec<f64> = place
                        .split(',')
                        .map(|c| c.trim().parse().ok().filter(|c: &f64| c.is_finite()))
                        .collect::<Option<_>>()?;
                    numbers.try_into().ok().map(Orient::Viewpoint)
                }
                _ => None,
            },
        }
    }

    /// The name of this way.
    pub fn name(self) -> String {
        match self {
            Orient::Mst => "mst".to_owned(),
            Orient::Viewpoint([x, y, z]) => format!("viewpoint:{x},{y},{z}"),
            Orient::Keep => "keep".to_owned(),
        }
    }
}

/// How a cloud is covered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// Points are at most so far above or below a disc that covers them.
    pub delta: Length,
    /// Points covered within this share of a disc's radius start no disc, from 0 to 1.
    pub perc: f64,
    /// Neighbours that normals are estimated from.
    pub neighbors: usize,
    /// Largest radius.
    pub max_radius: Length,
    /// In which order points start discs.
    pub order: Order,
    /// Which discs are kept.
    pub cover: Cover,
    /// How normals get one outside.
    pub orient: Orient,
    /// Whether given normals keep their sign though many disagree with their neighbours.
    pub trust_normals: bool,
}

impl Params {
    /// A thousandth of the diagonal, twenty percent, sixteen neighbours.
    pub const DEFAULT: Params = Params {
        delta: Length::OfDiagonal(0.001),
        perc: 0.2,
        neighbors: 16,
        max_radius: Length::OfDiagonal(0.05),
        order: Order::Morton,
        cover: Cover::Paper,
        orient: Orient::Mst,
        trust_normals: false,
    };

    /// Fewest and most neighbours.
    pub const NEIGHBORS: std::ops::RangeInclusive<usize> =
        3..=crate::points::normals::MOST_NEIGHBOURS;

    /// Errs when a value is out of its range.
    pub fn check(&self) -> Result<()> {
        self.delta.check("delta")?;
        self.max_radius.check("max-radius")?;
        if !(0.0..=1.0).contains(&self.perc) {
            return Err(Error::parameter("perc", self.perc, "must be from 0 to 1"));
        }
        if !Self::NEIGHBORS.contains(&self.neighbors) {
            let problem = format!(
                "must be from {} to {}",
                Self::NEIGHBORS.start(),
                Self::NEIGHBORS.end()
            );
            return Err(Error::parameter("neighbors", self.neighbors, problem));
        }
        if let Orient::Viewpoint(place) = self.orient
            && !place.iter().all(|c| c.is_finite())
        {
            let problem = "the viewpoint must be three numbers";
            return Err(Error::parameter("orient", self.orient.name(), problem));
        }
        Ok(())
    }
}
