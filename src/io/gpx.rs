//! GPX: way points, routes and tracks of receivers, in longitude and latitude on WGS 84.
//!
//! Source: Topografix, "GPX 1.1 Schema Documentation" (2004).

use super::geojson::stem;
use super::refusal::Refusal;
use super::source::Source;
use super::text;
use super::xml::{Element, Reader};
use crate::error::Fault;
use crate::report::{Tally, Warning};
use crate::vector::crs::Crs;
use crate::vector::{Feature, Layer, Shape, Vec2};
use serde_json::{Map, Value};

/// Whether a text is XML with the root of GPX.
pub fn is_document(text: &[u8]) -> bool {
    text.starts_with(b"<")
        && matches!(Reader::new(text).child(), Ok(Some(root)) if local(root.name) == "gpx")
}

/// A name without its prefix.
fn local(name: &str) -> &str {
    name.rsplit(':').next().unwrap_or(name)
}

/// Reads way points as points, routes as lines, and tracks as lines of all their segments, in the order of
/// the file; `gpx` among the properties says which it is, beside the name, description and kind.
///
/// Heights and times are left out. Segments of less than two places are left out with a counted
/// warning. Errs, with the line, where XML or a coordinate is damaged. Cost: linear.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Layer, Refusal> {
    let mut reader = Reader::new(source.bytes());
    let root = reader.child()?;
    if root.is_none_or(|root| local(root.name) != "gpx") {
        return Err(Fault::whole("its root is not <gpx>").into());
    }
    let mut found = Found::default();
    let mut features = Vec::new();
    while let Some(element) = reader.child()? {
        let kind = local(element.name).to_owned();
        match kind.as_str() {
            "wpt" => {
                let place = place(&element)?;
                let mut feature = found.said(&mut reader, &kind, features.len())?;
                feature.shape = Shape::Points(vec![place]);
                features.push(feature);
            }
            "rte" | "trk" => {
                let feature = found.said(&mut reader, &kind, features.len())?;
                features.push(feature);
            }
            _ => reader.skip()?,
        }
    }
    let message = "features with heights, which are left out";
    found.heights.warn("dropped-heights", message, warnings);
    let message = "features with segments of less than two places, which are left out";
    found.short.warn("short-parts", message, warnings);
    Ok(Layer {
        name: stem(source),
        crs: Some(Crs::lon_lat()),
        features,
    })
}

fn place(element: &Element) -> Result<Vec2, Fault> {
    let coordinate = |name: &str, most: f64| {
        let word = element.need(name)?;
        match text::number(word.trim().as_bytes()) {
            Some(value) if value.abs() <= most => Ok(value),
            _ => {
                let shown = text::shown(word.as_bytes());
                Err(element.fault(format!(
                    "{name} {shown} is no number of degrees up to {most}"
                )))
            }
        }
    };
    Ok([coordinate("lon", 360.0)?, coordinate("lat", 90.0)?])
}

#[derive(Default)]
struct Found {
    heights: Tally,
    short: Tally,
}

impl Found {
    /// The rest of a way point, a route or a track.
    fn said(&mut self, reader: &mut Reader, kind: &str, index: usize) -> Result<Feature, Fault> {
        let mut properties = Map::new();
        properties.insert("gpx".to_owned(), Value::from(kind));
        let mut lines: Vec<Vec<Vec2>> = Vec::new();
        let mut has_heights = false;
        while let Some(element) = reader.child()? {
            let name = local(element.name).to_owned();
            match name.as_str() {
                "name" | "desc" | "cmt" | "type" | "sym" => {
                    let text = reader.text()?;
                    let text = String::from_utf8_lossy(&text).trim().to_owned();
                    properties.insert(name, Value::from(text));
                }
                "ele" => {
                    has_heights = true;
                    reader.skip()?;
                }
                "rtept" => {
                    if lines.is_empty() {
                        lines.push(Vec::new());
                    }
                    lines[0].push(place(&element)?);
                    has_heights |= rest_of_place(reader)?;
                }
                "trkseg" => {
                    let mut line = Vec::new();
                    while let Some(element) = reader.child()? {
                        if local(element.name) == "trkpt" {
                            line.push(place(&element)?);
                            has_heights |= rest_of_place(reader)?;
                        } else {
                            reader.skip()?;
                        }
                    }
                    lines.push(line);
                }
                _ => reader.skip()?,
            }
        }
        let all = lines.len();
        lines.retain(|line| line.len() > 1);
        if lines.len() < all {
            self.short.note(index as u64);
        }
        if has_heights {
            self.heights.note(index as u64);
        }
        let shape = if lines.is_empty() {
            Shape::Empty
        } else {
            Shape::Lines(lines)
        };
        Ok(Feature { shape, properties })
    }
}

/// Goes behind the end of a place; whether it has a height.
fn rest_of_place(reader: &mut Reader) -> Result<bool, Fault> {
    let mut has_height = false;
    while let Some(element) = reader.child()? {
        has_height |= local(element.name) == "ele";
        reader.skip()?;
    }
    Ok(has_height)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(body: &str) -> Result<(Layer, Vec<Warning>), Fault> {
        let text = format!("<?xml version=\"1.0\"?>\n<gpx version=\"1.1\">\n{body}\n</gpx>\n");
        assert!(is_document(text.as_bytes()));
        let source =
            Source::from_bytes("a.gpx", text.into()).map_err(|e| Fault::whole(e.to_string()))?;
        let mut warnings = Vec::new();
        let layer = read(&source, &mut warnings).map_err(Refusal::fault)?;
        Ok((layer, warnings))
    }

    #[test]
    fn points_routes_and_tracks() {
        let (layer, warnings) = parsed(
            "<metadata><name>x</name></metadata>
            <wpt lat=\"47.5\" lon=\"8\"><ele>400</ele><name> Hut </name></wpt>
            <rte><name>R</name><rtept lat=\"1\" lon=\"2\"/><rtept lat=\"3\" lon=\"4\"><ele>1</ele></rtept></rte>
            <trk><trkseg><trkpt lat=\"1\" lon=\"2\"/></trkseg>
            <trkseg><trkpt lat=\"1\" lon=\"2\"><time>t</time></trkpt><trkpt lat=\"3\" lon=\"4\"/></trkseg></trk>",
        )
        .expect("a layer");
        let shapes: Vec<&Shape> = layer.features.iter().map(|f| &f.shape).collect();
        let line = Shape::Lines(vec![vec![[2.0, 1.0], [4.0, 3.0]]]);
        assert_eq!(shapes, [&Shape::Points(vec![[8.0, 47.5]]), &line, &line]);
        assert_eq!(layer.features[0].properties["name"], "Hut");
        let codes: Vec<_> = warnings
            .iter()
            .map(|w| (w.code.as_str(), w.count, w.first))
            .collect();
        assert_eq!(
            codes,
            [("dropped-heights", 2, Some(0)), ("short-parts", 1, Some(2))]
        );
    }

    #[test]
    fn faults_name_the_line() {
        let said = |body: &str| parsed(body).expect_err("a fault").to_string();
        assert_eq!(
            said("<wpt lat=\"91\" lon=\"8\"/>"),
            "3: <wpt> lat \"91\" is no number of degrees up to 90"
        );
        assert!(said("<wpt lat=\"1\"/>").starts_with("3: <wpt>"));
    }
}
