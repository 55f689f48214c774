//! Documents of GeoJSON, feature by feature.

use super::Oddities;
use super::shapes::{Nested, shape};
use crate::error::Fault;
use crate::vector::{Feature, Shape};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use std::fmt;

/// What the member `crs` says.
#[derive(Debug, Default, PartialEq)]
pub enum Stated {
    /// It is not there.
    #[default]
    Nothing,
    /// That there is none.
    Null,
    /// A name.
    Named(String),
}

/// What a document holds.
#[derive(Debug, Default)]
pub struct Document {
    pub name: Option<String>,
    pub crs: Stated,
    pub features: Vec<Feature>,
}

/// Names of what a document may be.
const KINDS: [&str; 9] = [
    "FeatureCollection",
    "Feature",
    "Point",
    "MultiPoint",
    "LineString",
    "MultiLineString",
    "Polygon",
    "MultiPolygon",
    "GeometryCollection",
];

/// Whether JSON is GeoJSON by the member `type` of its root. Cost: linear, nothing is kept.
pub fn is_document(text: &[u8]) -> bool {
    #[derive(Deserialize)]
    struct Root {
        #[serde(rename = "type")]
        kind: String,
    }
    let root = serde_json::from_slice::<Root>(text);
    root.is_ok_and(|root| KINDS.contains(&root.kind.as_str()))
}

/// A feature, or a geometry, as it stands.
#[derive(Deserialize)]
struct RawFeature {
    #[serde(rename = "type")]
    kind: Option<String>,
    geometry: Option<RawGeometry>,
    properties: Option<Map<String, Value>>,
    id: Option<Value>,
}

/// A geometry as it stands.
#[derive(Deserialize)]
pub struct RawGeometry {
    #[serde(rename = "type")]
    pub kind: Option<String>,
    pub coordinates: Option<Nested>,
    pub geometries: Option<Vec<RawGeometry>>,
}

/// Reads a document.
pub fn parse(text: &[u8], oddities: &mut Oddities) -> Result<Document, Fault> {
    let mut parser = serde_json::Deserializer::from_slice(text);
    let mut root = Root {
        oddities,
        fault: None,
        document: Document::default(),
    };
    let result = (&mut root).deserialize(&mut parser);
    let fault = root.fault.take();
    let document = std::mem::take(&mut root.document);
    match (result.and_then(|()| parser.end()), fault) {
        (Ok(()), None) => Ok(document),
        (_, Some(fault)) => Err(fault),
        (Err(error), None) => {
            let text = error.to_string();
            let problem = text.split(" at line ").next().unwrap_or_default();
            match error.line() {
                0 => Err(Fault::whole(problem)),
                line => Err(Fault::line(line as u64, problem)),
            }
        }
    }
}

/// Builds a document; a fault found on the way is kept here, as the parser's errors know no features.
struct Root<'a> {
    oddities: &'a mut Oddities,
    fault: Option<Fault>,
    document: Document,
}

impl Root<'_> {
    fn feature(&mut self, raw: RawFeature) -> Result<(), Fault> {
        let index = self.document.features.len();
        let fault = |problem: String| Fault::element("feature", index, problem);
        match raw.kind.as_deref() {
            Some("Feature") => {}
            Some(kind) => return Err(fault(format!("its type is {kind:?}, not \"Feature\""))),
            None => return Err(fault("it has no type".to_owned())),
        }
        let shape = match raw.geometry {
            Some(geometry) => shape(geometry, index, self.oddities)?,
            None => Shape::Empty,
        };
        let mut properties = raw.properties.unwrap_or_default();
        if let Some(id) = raw.id.filter(|id| !id.is_null()) {
            properties.entry("id").or_insert(id);
        }
        self.document.features.push(Feature { shape, properties });
        Ok(())
    }

    /// Keeps a fault, and stops the parser.
    fn stop<E: Error>(&mut self, fault: Fault) -> E {
        self.fault = Some(fault);
        E::custom("a fault")
    }
}

impl<'de> DeserializeSeed<'de> for &mut Root<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for &mut Root<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object of GeoJSON")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut kind: Option<String> = None;
        let mut has_features = false;
        let mut geometry = None;
        let mut of_feature: Option<Option<RawGeometry>> = None;
        let mut properties = None;
        let mut id = None;
        let bare = || RawGeometry {
            kind: None,
            coordinates: None,
            geometries: None,
        };
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "type" => kind = map.next_value()?,
                "features" => {
                    has_features = true;
                    map.next_value_seed(Features(self))?;
                }
                "name" => {
                    self.document.name = map.next_value::<Value>()?.as_str().map(str::to_owned)
                }
                "crs" => match stated(&map.next_value()?) {
                    Ok(stated) => self.document.crs = stated,
                    Err(fault) => return Err(self.stop(fault)),
                },
                "geometry" => of_feature = Some(map.next_value()?),
                "properties" => properties = map.next_value()?,
                "id" => id = map.next_value()?,
                "coordinates" => {
                    geometry.get_or_insert_with(bare).coordinates = map.next_value()?;
                }
                "geometries" => geometry.get_or_insert_with(bare).geometries = map.next_value()?,
                _ => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        let lone = |geometry, properties, id| RawFeature {
            kind: Some("Feature".to_owned()),
            geometry,
            properties,
            id,
        };
        let done = match kind.as_deref() {
            Some("FeatureCollection") if has_features => Ok(()),
            Some("FeatureCollection") => Err(Fault::whole("a FeatureCollection without features")),
            Some("Feature") => self.feature(lone(of_feature.flatten(), properties, id)),
            Some(name) if KINDS.contains(&name) => {
                let geometry = RawGeometry {
                    kind: kind.clone(),
                    ..geometry.unwrap_or_else(bare)
                };
                self.feature(lone(Some(geometry), None, None))
            }
            Some(other) => Err(Fault::whole(format!(
                "its type is {other:?}, which GeoJSON has not"
            ))),
            None => Err(Fault::whole("has no type, and so is no GeoJSON")),
        };
        done.map_err(|fault| self.stop(fault))
    }
}

/// The member `features`.
struct Features<'a, 'b>(&'a mut Root<'b>);

impl<'de> DeserializeSeed<'de> for Features<'_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Features<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an array of features")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while let Some(raw) = seq.next_element::<RawFeature>()? {
            if let Err(fault) = self.0.feature(raw) {
                return Err(self.0.stop(fault));
            }
        }
        Ok(())
    }
}

/// `{"type": "name", "properties": {"name": "..."}}`, and its predecessor with a number.
fn stated(value: &Value) -> Result<Stated, Fault> {
    let properties = &value["properties"];
    match (value, &properties["name"], &properties["code"]) {
        (Value::Null, ..) => Ok(Stated::Null),
        (_, Value::String(name), _) => Ok(Stated::Named(name.clone())),
        (_, _, Value::Number(code)) => Ok(Stated::Named(format!("EPSG:{code}"))),
        _ => Err(Fault::whole("crs: has no name")),
    }
}
