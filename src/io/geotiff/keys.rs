//! Where the cells of a GeoTIFF are, and in which reference system.

use super::{BESIDE, File, damaged};
use crate::error::Fault;
use crate::io::source::Source;
use crate::io::world;
use crate::report::Warning;
use crate::terrain::Transform;
use crate::vector::crs::Crs;
use tiff::tags::Tag;

/// Numbers of keys.
pub const MODEL_TYPE: u16 = 1024;
pub const RASTER_TYPE: u16 = 1025;
pub const CITATION: u16 = 1026;
pub const GEOGRAPHIC: u16 = 2048;
pub const GEOGRAPHIC_CITATION: u16 = 2049;
pub const PROJECTED: u16 = 3072;
pub const PROJECTED_CITATION: u16 = 3073;
/// The value that stands for one of the user's own.
pub const USER_DEFINED: u16 = 32767;
/// The tag with the texts of keys.
pub const TEXTS: u16 = 34737;

/// The tags that say where a raster is.
#[derive(Debug, Default)]
pub struct Keys {
    scale: Vec<f64>,
    tie: Vec<f64>,
    matrix: Vec<f64>,
    directory: Vec<u16>,
    texts: String,
}

impl Keys {
    /// Reads the tags. Errs where one is there and damaged.
    pub fn of(file: &mut File) -> Result<Self, Fault> {
        let numbers = |file: &mut File, tag| match file.find_tag(tag).map_err(damaged)? {
            Some(value) => value.into_f64_vec().map_err(damaged),
            None => Ok(Vec::new()),
        };
        let directory = file
            .find_tag(Tag::GeoKeyDirectoryTag)
            .and_then(|value| value.map_or(Ok(Vec::new()), |value| value.into_u16_vec()));
        Ok(Keys {
            scale: numbers(file, Tag::ModelPixelScaleTag)?,
            tie: numbers(file, Tag::ModelTiepointTag)?,
            matrix: numbers(file, Tag::ModelTransformationTag)?,
            directory: directory.map_err(damaged)?,
            texts: file
                .get_tag_ascii_string(Tag::from_u16_exhaustive(TEXTS))
                .unwrap_or_default(),
        })
    }

    /// The entries of the directory: key, tag, count, value.
    fn entries(&self) -> impl Iterator<Item = &[u16; 4]> {
        self.directory.as_chunks().0.iter().skip(1)
    }

    fn short(&self, key: u16) -> Option<u16> {
        let mut entries = self.entries();
        entries.find_map(|[k, tag, _, value]| (*k == key && *tag == 0).then_some(*value))
    }

    fn text(&self, key: u16) -> Option<&str> {
        let [_, _, count, start] = self
            .entries()
            .find(|[k, tag, ..]| *k == key && *tag == TEXTS)?;
        let start = usize::from(*start);
        let text = self.texts.get(start..start + usize::from(*count))?;
        Some(text.trim_end_matches(['|', '\0', ' ']))
    }

    /// Where the cells are: by the tags, else by a world file beside, else in cells from the lower left,
    /// with a warning.
    pub fn transform(
        &self,
        source: &Source,
        rows: u32,
        warnings: &mut Vec<Warning>,
    ) -> Result<Transform, Fault> {
        let stated = match (
            self.matrix.as_slice(),
            self.scale.as_slice(),
            self.tie.as_slice(),
        ) {
            ([a, b, _, x, d, e, _, y, ..], ..) => Some(Transform {
                origin: [*x, *y],
                across: [*a, *d],
                down: [*b, *e],
            }),
            (_, [wide, high, ..], [column, row, _, x, y, ..]) => {
                let corner = [x - column * wide, y + row * high];
                Some(Transform::north_up(corner, [*wide, *high]))
            }
            _ => None,
        };
        if let Some(mut transform) = stated {
            if self.short(RASTER_TYPE) == Some(2) {
                // What is given is the place of the first cell's centre.
                transform.origin = transform.place(-0.5, -0.5);
            }
            return Ok(transform);
        }
        if let Some(transform) = world::beside(source, BESIDE)? {
            return Ok(transform);
        }
        if self.tie.len() > 6 {
            let points = self.tie.len() as u64 / 6;
            let message = "ground control points, which give no place of cells; they are counted from the lower left";
            warnings.push(Warning::new("no-georeference", message, points, None));
        } else {
            world::warn_of_none(warnings);
        }
        Ok(world::of_cells(rows as usize))
    }

    /// The reference system, if the keys name one: by its number, else by a citation.
    pub fn crs(&self, warnings: &mut Vec<Warning>) -> Option<Crs> {
        let number = |key| {
            self.short(key)
                .filter(|code| *code != USER_DEFINED && *code != 0)
        };
        let is_projected = self.short(MODEL_TYPE) == Some(1)
            || self.short(MODEL_TYPE).is_none() && self.short(PROJECTED).is_some();
        let code = match is_projected {
            true => number(PROJECTED),
            false => number(GEOGRAPHIC),
        };
        if let Some(code) = code {
            return Some(Crs::from_epsg(u32::from(code)));
        }
        let keys = [PROJECTED_CITATION, CITATION, GEOGRAPHIC_CITATION];
        let keys = if is_projected { &keys[..2] } else { &keys[1..] };
        let mut citations = keys.iter().filter_map(|key| self.text(*key));
        let text = citations.find(|text| !text.is_empty())?;
        let text = text.split_once("PE String = ").map_or(text, |(_, wkt)| wkt);
        Some(Crs::parse(text).unwrap_or_else(|_| {
            let message = format!(
                "a coordinate reference system of the user's own, {text:?}; only its name is read"
            );
            warnings.push(Warning::new("unknown-crs", message, 1, None));
            Crs {
                name: text.to_owned(),
                epsg: None,
            }
        }))
    }
}
