//! GeoJSON: features on a map.
//!
//! Source: RFC 7946 (Butler and others 2016); the member `crs` is that of its predecessor
//! (The GeoJSON Format Specification, 2008, section 3).

mod document;
mod shapes;
#[cfg(test)]
mod tests;
mod write;

pub use document::is_document;
pub use write::{write, write_raised};

use super::json::unmarked;
use super::refusal::Refusal;
use super::source::Source;
use crate::error::Fault;
use crate::report::{Tally, Warning};
use crate::vector::Layer;
use crate::vector::crs::Crs;

/// What is put right while it is read, by feature.
#[derive(Debug, Default)]
pub(super) struct Oddities {
    /// Places with a third coordinate, which is dropped.
    pub heights: Tally,
    /// Rings whose end is not their start.
    pub unclosed: Tally,
}

impl Oddities {
    /// Adds a warning of each kind.
    pub fn warn(&self, warnings: &mut Vec<Warning>) {
        let message = "features with coordinates beyond two, which are left out";
        self.heights.warn("dropped-heights", message, warnings);
        let message = "features with rings whose end is not their start; closed";
        self.unclosed.warn("unclosed-rings", message, warnings);
    }
}

/// Reads a feature collection, a feature or a bare geometry.
///
/// Null geometries and those without coordinates are [`Shape::Empty`]; collections of geometries are
/// taken apart where all are of one kind. Coordinates are longitudes and latitudes on WGS 84 unless the
/// member `crs` says otherwise; where it is null, none is known. Errs, with the feature, where numbers are
/// missing, not finite or no numbers, a line has one place or a ring two, and where geometries of several
/// kinds are in one collection. Cost: linear; one feature at a time is held beside the result.
///
/// [`Shape::Empty`]: crate::vector::Shape::Empty
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Layer, Refusal> {
    let text = unmarked(source.bytes());
    let mut oddities = Oddities::default();
    let read = document::parse(text, &mut oddities)?;
    let crs = match read.crs {
        document::Stated::Nothing => Some(Crs::lon_lat()),
        document::Stated::Null => None,
        document::Stated::Named(name) => match Crs::parse(&name) {
            Ok(crs) => Some(crs),
            Err(fault) => {
                let Fault { problem, hint, .. } = fault;
                return Err(Fault {
                    hint,
                    ..Fault::whole(format!("crs: {problem}"))
                }
                .into());
            }
        },
    };
    oddities.warn(warnings);
    Ok(Layer {
        name: read.name.unwrap_or_else(|| stem(source)),
        crs,
        features: read.features,
    })
}

/// The name of a file without its folder and ending.
pub(super) fn stem(source: &Source) -> String {
    let stem = source.path().file_stem().unwrap_or_default();
    let stem = stem.to_string_lossy();
    stem.split('.').next().unwrap_or_default().to_owned()
}
