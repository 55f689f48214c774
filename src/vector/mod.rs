//! Features on a map: points, lines and polygons in two dimensions, with properties.

pub mod crs;
pub mod index;
pub mod inventory;
pub mod rings;

use crate::error::Fault;
use crate::report;
use crs::Crs;
use serde_json::{Map, Value};

/// A place on the map: easting and northing, or longitude and latitude in degrees.
pub type Vec2 = [f64; 2];

/// Features that were read together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layer {
    /// Its name: that of the file without its ending.
    pub name: String,
    /// What its coordinates mean; none where the file does not say.
    pub crs: Option<Crs>,
    /// Features in the order of the file; those without a usable shape have [`Shape::Empty`].
    pub features: Vec<Feature>,
}

/// A shape and what is said of it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Feature {
    /// Where it is.
    pub shape: Shape,
    /// What the file says of it, by name.
    pub properties: Map<String, Value>,
}

/// Where a feature is. Coordinates are finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Shape {
    /// Nowhere: the file has a null or an empty geometry, or one that could not be read.
    #[default]
    Empty,
    /// At one or several places.
    Points(Vec<Vec2>),
    /// Along one or several lines, each of two or more places.
    Lines(Vec<Vec<Vec2>>),
    /// Over one or several areas.
    Polygons(Vec<Polygon>),
}

/// An area with holes.
///
/// Rings are closed by themselves: the first place is not repeated at the end. The first ring is the
/// outer one, the others are holes; which way round they go is as in the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polygon {
    /// Its rings, each of three or more places.
    pub rings: Vec<Vec<Vec2>>,
}

/// A shape with a height at each place: what lies on a terrain. Its parts are as those of [`Shape`].
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Raised {
    /// Nowhere.
    #[default]
    Empty,
    /// At one or several places.
    Points(Vec<[f64; 3]>),
    /// Along one or several lines.
    Lines(Vec<Vec<[f64; 3]>>),
    /// Over one or several areas, as their rings.
    Polygons(Vec<Vec<Vec<[f64; 3]>>>),
}

impl Shape {
    /// Its points, lines or rings.
    pub fn parts(&self) -> Vec<&[Vec2]> {
        match self {
            Shape::Empty => Vec::new(),
            Shape::Points(points) => vec![points],
            Shape::Lines(lines) => lines.iter().map(Vec::as_slice).collect(),
            Shape::Polygons(polygons) => {
                let rings = polygons.iter().flat_map(|polygon| &polygon.rings);
                rings.map(Vec::as_slice).collect()
            }
        }
    }

    /// The fewest places that a part of it has.
    fn fewest(&self) -> usize {
        match self {
            Shape::Empty | Shape::Points(_) => 1,
            Shape::Lines(_) => 2,
            Shape::Polygons(_) => 3,
        }
    }
}

/// Twice the area of a ring, positive where it goes counter-clockwise; relative to its first place.
pub fn twice_area(ring: &[Vec2]) -> f64 {
    let Some([x, y]) = ring.first() else {
        return 0.0;
    };
    let at = |i: usize| {
        let [a, b] = ring[i % ring.len()];
        [a - x, b - y]
    };
    let cross = |i: usize| {
        let ([a, b], [c, d]) = (at(i), at(i + 1));
        a * d - b * c
    };
    (0..ring.len()).map(cross).sum()
}

impl Layer {
    /// Errs, with the feature, where a coordinate is not finite or a part has too few places.
    pub fn check(&self) -> Result<(), Fault> {
        for (index, feature) in self.features.iter().enumerate() {
            let fewest = feature.shape.fewest();
            for (part, places) in feature.shape.parts().into_iter().enumerate() {
                let fault = |problem: String| Err(Fault::element("feature", index, problem));
                if places.len() < fewest {
                    let has = places.len();
                    return fault(format!(
                        "part {part} has {has} places, at least {fewest} are needed"
                    ));
                }
                if let Some(at) = places.as_flattened().iter().position(|c| !c.is_finite()) {
                    let place = at / 2;
                    return fault(format!("place {place} of part {part} is not finite"));
                }
            }
        }
        Ok(())
    }

    /// All places of all features.
    pub fn places(&self) -> impl Iterator<Item = &Vec2> {
        let parts = self
            .features
            .iter()
            .flat_map(|feature| feature.shape.parts());
        parts.flatten()
    }

    /// The smallest and the largest coordinates; none where there is no place. Cost: linear.
    pub fn extent(&self) -> Option<[Vec2; 2]> {
        self.places().fold(None, |extent, place| {
            let [low, high] = extent.unwrap_or([*place; 2]);
            let fold =
                |with: Vec2, f: fn(f64, f64) -> f64| [f(with[0], place[0]), f(with[1], place[1])];
            Some([fold(low, f64::min), fold(high, f64::max)])
        })
    }

    /// The report's counts and bounds. Cost: linear in the places.
    pub fn content(&self) -> report::Content {
        report::Content {
            features: Some(self.features.len() as u64),
            places: Some(self.places().count() as u64),
            crs: self.crs.as_ref().map(ToString::to_string),
            extent: self.extent(),
            ..report::Content::default()
        }
    }
}
