//! Shapefiles: shapes in `.shp`, what is said of them in `.dbf` beside, the reference system in `.prj`.
//!
//! Source: ESRI, "ESRI Shapefile Technical Description" (1998).

mod dbf;
mod rings;
mod shapes;
#[cfg(test)]
mod tests;

use super::geojson::stem;
use super::prj;
use super::refusal::Refusal;
use super::source::Source;
use crate::error::Fault;
use crate::report::Warning;
use crate::vector::{Feature, Layer};
use shapes::Shapes;

/// Files that reading one opens beside it.
pub const BESIDE: [&str; 3] = ["dbf", "prj", "cpg"];

/// Whether bytes start as those of a shapefile do.
pub fn is_header(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0, 0, 0x27, 0x0a]) && bytes.get(28..32) == Some(&[0xe8, 3, 0, 0])
}

/// Reads points, lines and polygons; heights and measures are left out.
///
/// Rings that go clockwise are outer ones; the others are holes of the smallest outer ring around their
/// first place, or polygons of their own where there is none. A shape that is damaged is empty, and a
/// warning counts them; so are those of which the file lacks the end. Without a `.dbf` file, features
/// have no properties. Errs where the header is damaged, or a record in the midst of the file has a
/// length that cannot be. Cost: linear; for polygons of many parts their square.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Layer, Refusal> {
    let bytes = source.bytes();
    let Shapes { shapes, kind } = shapes::read(bytes, warnings)?;
    let mut features: Vec<Feature> = shapes
        .into_iter()
        .map(|shape| Feature {
            shape,
            ..Feature::default()
        })
        .collect();
    match source.sibling("dbf")? {
        Some(table) => {
            let page = source.sibling("cpg")?;
            let rows = dbf::read(&table, page.as_deref()).map_err(|fault| {
                let Fault { problem, .. } = fault;
                Fault::whole(format!("its .dbf file: {problem}"))
            })?;
            let (has, needed) = (rows.len(), features.len());
            if has != needed {
                let message =
                    format!("rows too many or too few in the .dbf file: {has} for {needed} shapes");
                let count = has.abs_diff(needed) as u64;
                warnings.push(Warning::new("rows-of-properties", message, count, None));
            }
            for (feature, row) in features.iter_mut().zip(rows) {
                feature.properties = row;
            }
        }
        None => {
            let message = "shapes without properties: there is no .dbf file beside";
            let count = features.len() as u64;
            warnings.push(Warning::new("no-properties", message, count, None));
        }
    }
    if kind > 10 {
        let message = "heights and measures of shapes, which are left out";
        let count = features.len() as u64;
        warnings.push(Warning::new("dropped-heights", message, count, None));
    }
    Ok(Layer {
        name: stem(source),
        crs: prj::beside(source, warnings),
        features,
    })
}
