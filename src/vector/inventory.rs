//! What is in a layer, and what looks wrong in it.

use super::{Layer, Shape, Vec2, twice_area};
use crate::report::{Tally, Warning};
use schemars::JsonSchema;
use serde::Serialize;

/// What is in a layer.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Inventory {
    /// Features.
    pub features: u64,
    /// Features of points, and their points.
    pub points: [u64; 2],
    /// Features of lines, and their lines.
    pub lines: [u64; 2],
    /// Features of polygons, and their polygons.
    pub polygons: [u64; 2],
    /// Holes in polygons.
    pub holes: u64,
    /// Features without a shape.
    pub empty: u64,
    /// Places of points, lines and rings, in which the first of a ring is not repeated.
    pub places: u64,
    /// Names of properties, in the order in which they first come.
    pub properties: Vec<String>,
    /// The coordinate reference system, null where the file does not say it.
    pub crs: Option<String>,
    /// Its number in the EPSG registry, where it is known.
    pub epsg: Option<u32>,
    /// Whether coordinates are longitudes and latitudes; null where that is not known.
    pub geographic: Option<bool>,
    #[serde(skip)]
    empties: Tally,
    #[serde(skip)]
    beyond: Tally,
    #[serde(skip)]
    repeated: Tally,
    #[serde(skip)]
    flat: Tally,
}

/// Counts what is in a layer. Cost: linear in its places and properties.
pub fn inventory(layer: &Layer) -> Inventory {
    let geographic = layer.crs.as_ref().and_then(|crs| crs.is_geographic());
    let mut found = Inventory {
        features: layer.features.len() as u64,
        points: [0; 2],
        lines: [0; 2],
        polygons: [0; 2],
        holes: 0,
        empty: 0,
        places: 0,
        properties: Vec::new(),
        crs: layer.crs.as_ref().map(|crs| crs.title().to_owned()),
        epsg: layer.crs.as_ref().and_then(|crs| crs.epsg),
        geographic,
        empties: Tally::default(),
        beyond: Tally::default(),
        repeated: Tally::default(),
        flat: Tally::default(),
    };
    let mut names = std::collections::BTreeSet::new();
    for (index, feature) in (0u64..).zip(&layer.features) {
        for name in feature.properties.keys() {
            if !names.contains(name.as_str()) {
                names.insert(name.as_str());
                found.properties.push(name.clone());
            }
        }
        found.count(&feature.shape, index);
        let parts = feature.shape.parts();
        found.places += parts.iter().map(|part| part.len() as u64).sum::<u64>();
        let is_beyond = |[lon, lat]: &Vec2| lon.abs() > 360.0 || lat.abs() > 90.0;
        if geographic == Some(true) && parts.iter().any(|part| part.iter().any(is_beyond)) {
            found.beyond.note(index);
        }
        let repeats = |part: &&[Vec2]| part.windows(2).any(|pair| pair[0] == pair[1]);
        if !matches!(feature.shape, Shape::Points(_)) && parts.iter().any(repeats) {
            found.repeated.note(index);
        }
    }
    found
}

impl Inventory {
    fn count(&mut self, shape: &Shape, index: u64) {
        let (slot, parts) = match shape {
            Shape::Empty => {
                self.empty += 1;
                self.empties.note(index);
                return;
            }
            Shape::Points(points) => (&mut self.points, points.len()),
            Shape::Lines(lines) => (&mut self.lines, lines.len()),
            Shape::Polygons(polygons) => {
                let rings: usize = polygons.iter().map(|p| p.rings.len()).sum();
                self.holes += rings.saturating_sub(polygons.len()) as u64;
                let rings = polygons.iter().flat_map(|polygon| &polygon.rings);
                if rings.into_iter().any(|ring| twice_area(ring) == 0.0) {
                    self.flat.note(index);
                }
                (&mut self.polygons, polygons.len())
            }
        };
        slot[0] += 1;
        slot[1] += parts as u64;
    }

    /// What looks wrong, by the number of the feature.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut warn = |tally: Tally, code, message| tally.warn(code, message, &mut warnings);
        warn(self.empties, "empty-features", "features without a shape");
        warn(
            self.flat,
            "flat-rings",
            "features with rings that enclose no area",
        );
        warn(
            self.repeated,
            "repeated-places",
            "features with places that stand twice in a row",
        );
        let message =
            "features beyond all longitudes and latitudes, which their reference system has";
        warn(self.beyond, "not-degrees", message);
        if self.crs.is_none() && self.features > 0 {
            let message = "a layer that does not say its coordinate reference system";
            warnings.push(Warning::new("no-crs", message, 1, None));
        }
        warnings
    }
}
