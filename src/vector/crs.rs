//! What coordinates on a map mean.

mod definition;
mod reproject;
#[cfg(test)]
mod tests;
mod wkt;

pub use reproject::Reprojector;

use crate::error::Fault;
use definition::{Definition, known};
use std::fmt;

/// A coordinate reference system.
#[derive(Debug, Clone, PartialEq)]
pub struct Crs {
    /// Its name, or its definition where it has none.
    pub name: String,
    /// Its number in the EPSG registry, where it is known.
    pub epsg: Option<u32>,
}

impl Crs {
    /// Longitude and latitude in degrees on WGS 84 (EPSG:4326), in this order as files have them.
    pub fn lon_lat() -> Self {
        Crs::from_epsg(4326)
    }

    /// The system of a number in the EPSG registry; one without a name of its own is called by its number.
    pub fn from_epsg(code: u32) -> Self {
        let name = known(code).map(|def| wkt::first_name(def.wkt).to_owned());
        Crs {
            name: name.unwrap_or_else(|| format!("EPSG:{code}")),
            epsg: Some(code),
        }
    }

    /// The system that a text names or defines: `EPSG:32733`, a URN or an address of the OGC, WKT of either
    /// version, or a string of PROJ.
    ///
    /// The definition becomes the name where it has no number in the EPSG registry and is that of none.
    /// Errs where the text is none of these. Cost: a definition in WKT without a number is compared
    /// with all that are known, some milliseconds.
    pub fn parse(text: &str) -> Result<Self, Fault> {
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0' || c == '\u{feff}');
        if let Some(code) = code_in(text) {
            return Ok(Crs::from_epsg(code));
        }
        if text.contains("+proj") || text.contains("+init") {
            return Ok(Crs {
                name: text.to_owned(),
                epsg: None,
            });
        }
        if text.contains('[') || text.contains('(') {
            return Crs::from_wkt(text);
        }
        let shown: String = text.chars().take(60).collect();
        let problem = format!("{shown:?} is no coordinate reference system that is known");
        Err(Fault::whole(problem).with_hint("give it as EPSG:CODE, in WKT or as a string of PROJ"))
    }

    /// The system that WKT, of version 1 (also that of ESRI) or 2, defines.
    fn from_wkt(text: &str) -> Result<Self, Fault> {
        let root = wkt::parse(text)?;
        let system = root.horizontal();
        if let Some(code) = system.epsg() {
            let name = system.name().map(str::to_owned);
            let crs = Crs::from_epsg(code);
            return Ok(match known(code) {
                Some(_) => crs,
                None => Crs {
                    name: name.unwrap_or(crs.name),
                    ..crs
                },
            });
        }
        Ok(match definition::identify(system) {
            Some(code) => Crs::from_epsg(code),
            None => Crs {
                name: text.to_owned(),
                epsg: None,
            },
        })
    }

    /// What it is called in messages: the name inside its definition where that is all there is.
    pub fn title(&self) -> &str {
        match self.epsg {
            None if self.name.contains('[') => wkt::first_name(&self.name),
            _ => &self.name,
        }
    }

    /// Whether coordinates are longitudes and latitudes in degrees; none where its definition is not known.
    pub fn is_geographic(&self) -> Option<bool> {
        self.definition().map(|d| d.is_geographic())
    }

    /// How many metres its unit of length is; none where it has angles, or its definition is not known.
    pub fn metres_in_unit(&self) -> Option<f64> {
        let definition = self.definition()?;
        (!definition.is_geographic()).then_some(definition.to_metre)
    }

    /// Its definition as a string of PROJ, if it is known.
    pub fn proj_string(&self) -> Option<String> {
        if let Some(def) = self.epsg.and_then(known) {
            return Some(def.proj4.to_owned());
        }
        if self.name.contains("+proj") {
            return Some(self.name.clone());
        }
        let root = wkt::parse(&self.name).ok()?;
        definition::proj_string(root.horizontal())
    }

    /// Its definition in WKT, if there is one: what a `.prj` file holds.
    pub fn to_wkt(&self) -> Option<&str> {
        match self.epsg.and_then(known) {
            Some(def) => Some(def.wkt),
            None => self.name.contains('[').then_some(self.name.as_str()),
        }
    }

    fn definition(&self) -> Option<Definition> {
        Definition::of(&self.proj_string()?)
    }

    /// Whether both give a place the same coordinates: their numbers are the same, or their names, or all
    /// terms of their definitions, the datum included.
    pub fn same(&self, other: &Crs) -> bool {
        if self.epsg.is_some() && self.epsg == other.epsg || self.name == other.name {
            return true;
        }
        match (self.definition(), other.definition()) {
            (Some(a), Some(b)) => a.is_same(&b) && a.datum == b.datum,
            _ => false,
        }
    }
}

impl fmt::Display for Crs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let title = self.title();
        match self.epsg {
            Some(code) if title == format!("EPSG:{code}") => f.write_str(title),
            Some(code) => write!(f, "EPSG:{code} ({title})"),
            None => f.write_str(title),
        }
    }
}

/// The number in `EPSG:32733`, `urn:ogc:def:crs:EPSG::32733` and
/// `http://www.opengis.net/def/crs/EPSG/0/32733`; longitude and latitude of the OGC have that of WGS 84.
fn code_in(text: &str) -> Option<u32> {
    let upper = text.to_ascii_uppercase();
    if upper.contains('[') || upper.contains('+') {
        return None;
    }
    if upper.contains("CRS84") {
        return Some(4326);
    }
    let (_, rest) = upper.split_once("EPSG")?;
    let digits = rest.rsplit([':', '/', '#']).next()?;
    digits.trim().parse().ok()
}
