//! Coordinates of GeoJSON as shapes.

use super::Oddities;
use super::document::RawGeometry;
use crate::error::Fault;
use crate::vector::{Polygon, Shape, Vec2};
use serde::Deserialize;
use serde::de::{Deserializer, SeqAccess, Visitor};
use std::fmt;

/// Arrays of arrays of numbers, as they stand.
#[derive(Debug)]
pub enum Nested {
    Number(f64),
    List(Vec<Nested>),
    /// Anything else, by its name.
    Other(&'static str),
}

impl<'de> Deserialize<'de> for Nested {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NestedVisitor)
    }
}

struct NestedVisitor;

impl<'de> Visitor<'de> for NestedVisitor {
    type Value = Nested;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("coordinates: numbers and arrays of them")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Nested, E> {
        Ok(Nested::Number(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Nested, E> {
        Ok(Nested::Number(value as f64))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Nested, E> {
        Ok(Nested::Number(value as f64))
    }

    fn visit_unit<E>(self) -> Result<Nested, E> {
        Ok(Nested::Other("null"))
    }

    fn visit_bool<E>(self, _: bool) -> Result<Nested, E> {
        Ok(Nested::Other("a truth value"))
    }

    fn visit_str<E>(self, _: &str) -> Result<Nested, E> {
        Ok(Nested::Other("text"))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Nested, A::Error> {
        let mut list = Vec::with_capacity(seq.size_hint().unwrap_or(0).min(4096));
        while let Some(next) = seq.next_element()? {
            list.push(next);
        }
        Ok(Nested::List(list))
    }
}

/// Reads the coordinates of one feature.
struct Reader<'a> {
    index: usize,
    has_heights: bool,
    is_unclosed: bool,
    oddities: &'a mut Oddities,
}

/// The shape of a geometry.
pub fn shape(raw: RawGeometry, index: usize, oddities: &mut Oddities) -> Result<Shape, Fault> {
    let mut reader = Reader {
        index,
        has_heights: false,
        is_unclosed: false,
        oddities,
    };
    let shape = reader.shape(raw)?;
    if reader.has_heights {
        reader.oddities.heights.note(index as u64);
    }
    if reader.is_unclosed {
        reader.oddities.unclosed.note(index as u64);
    }
    Ok(shape)
}

impl Reader<'_> {
    fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::element("feature", self.index, problem)
    }

    fn shape(&mut self, raw: RawGeometry) -> Result<Shape, Fault> {
        let kind = raw
            .kind
            .ok_or_else(|| self.fault("its geometry has no type"))?;
        if kind == "GeometryCollection" {
            return self.collection(raw.geometries.unwrap_or_default());
        }
        let Some(coordinates) = raw.coordinates else {
            return Err(self.fault(format!("a {kind} without coordinates")));
        };
        let Nested::List(list) = coordinates else {
            return Err(self.fault(format!("the coordinates of its {kind} are no array")));
        };
        if list.is_empty() {
            return Ok(Shape::Empty);
        }
        let shape = match kind.as_str() {
            "Point" => Shape::Points(vec![self.place(&list, "the point")?]),
            "MultiPoint" => Shape::Points(self.places(&list, "the points")?),
            "LineString" => Shape::Lines(vec![self.line(&list, 0)?]),
            "MultiLineString" => {
                let lines = self.lists(&list, "line")?;
                let lines = lines.into_iter().filter(|(_, line)| !line.is_empty());
                let lines = lines.map(|(number, line)| self.line(line, number));
                Shape::Lines(lines.collect::<Result<_, _>>()?)
            }
            "Polygon" => Shape::Polygons(self.polygon(&list, "")?.into_iter().collect()),
            "MultiPolygon" => {
                let mut polygons = Vec::with_capacity(list.len());
                for (number, polygon) in self.lists(&list, "polygon")? {
                    let of = format!("polygon {number}, ");
                    polygons.extend(self.polygon(polygon, &of)?);
                }
                Shape::Polygons(polygons)
            }
            other => {
                return Err(self.fault(format!(
                    "its geometry is a {other:?}, which GeoJSON has not"
                )));
            }
        };
        Ok(match shape {
            Shape::Lines(all) if all.is_empty() => Shape::Empty,
            Shape::Polygons(all) if all.is_empty() => Shape::Empty,
            shape => shape,
        })
    }

    /// Geometries of one kind are one shape.
    fn collection(&mut self, geometries: Vec<RawGeometry>) -> Result<Shape, Fault> {
        let mut all = Shape::Empty;
        for raw in geometries {
            match (&mut all, self.shape(raw)?) {
                (_, Shape::Empty) => {}
                (all @ Shape::Empty, shape) => *all = shape,
                (Shape::Points(all), Shape::Points(more)) => all.extend(more),
                (Shape::Lines(all), Shape::Lines(more)) => all.extend(more),
                (Shape::Polygons(all), Shape::Polygons(more)) => all.extend(more),
                _ => {
                    let fault = self.fault("a collection of geometries of several kinds");
                    return Err(fault.with_hint("make each of them a feature of its own"));
                }
            }
        }
        Ok(all)
    }

    fn lists<'n>(
        &self,
        list: &'n [Nested],
        what: &str,
    ) -> Result<Vec<(usize, &'n [Nested])>, Fault> {
        let list = list.iter().enumerate();
        list.map(|(number, nested)| match nested {
            Nested::List(list) => Ok((number, list.as_slice())),
            Nested::Number(_) => {
                Err(self.fault(format!("{what} {number} is a number, not an array")))
            }
            Nested::Other(kind) => {
                Err(self.fault(format!("{what} {number} is {kind}, not an array")))
            }
        })
        .collect()
    }

    fn place(&mut self, list: &[Nested], of: &str) -> Result<Vec2, Fault> {
        let mut place = [0.0; 2];
        if list.len() < 2 {
            let count = list.len();
            return Err(self.fault(format!(
                "{of} has {count} coordinates, at least 2 are needed"
            )));
        }
        self.has_heights |= list.len() > 2;
        for (coordinate, nested) in place.iter_mut().zip(list) {
            *coordinate = match nested {
                Nested::Number(value) if value.is_finite() => *value,
                Nested::Number(_) => return Err(self.fault(format!("{of} is not finite"))),
                Nested::List(_) => {
                    return Err(self.fault(format!("{of} has an array for a number")));
                }
                Nested::Other(kind) => {
                    return Err(self.fault(format!("{of} has {kind} for a number")));
                }
            };
        }
        Ok(place)
    }

    fn places(&mut self, list: &[Nested], of: &str) -> Result<Vec<Vec2>, Fault> {
        let mut places = Vec::with_capacity(list.len());
        for (number, nested) in list.iter().enumerate() {
            let Nested::List(list) = nested else {
                return Err(self.fault(format!("place {number} of {of} is no array of numbers")));
            };
            match list.as_slice() {
                [Nested::Number(x), Nested::Number(y)] if x.is_finite() && y.is_finite() => {
                    places.push([*x, *y]);
                }
                list => places.push(self.place(list, &format!("place {number} of {of}"))?),
            }
        }
        Ok(places)
    }

    fn line(&mut self, list: &[Nested], number: usize) -> Result<Vec<Vec2>, Fault> {
        let places = self.places(list, &format!("line {number}"))?;
        if places.len() < 2 {
            let has = places.len();
            let plural = if has == 1 { "" } else { "s" };
            return Err(self.fault(format!(
                "line {number} has {has} place{plural}, at least 2 are needed"
            )));
        }
        Ok(places)
    }

    /// A polygon, if it has any ring.
    fn polygon(&mut self, list: &[Nested], of: &str) -> Result<Option<Polygon>, Fault> {
        let mut rings = Vec::with_capacity(list.len());
        for (number, list) in self.lists(list, "ring")? {
            if list.is_empty() {
                continue;
            }
            let mut ring = self.places(list, &format!("{of}ring {number}"))?;
            match (ring.first(), ring.last()) {
                (Some(first), Some(last)) if first == last && ring.len() > 1 => {
                    ring.pop();
                }
                _ => self.is_unclosed = true,
            }
            if ring.len() < 3 {
                let has = ring.len();
                let plural = if has == 1 { "" } else { "s" };
                return Err(self.fault(format!(
                    "{of}ring {number} has {has} place{plural}, at least 3 are needed"
                )));
            }
            rings.push(ring);
        }
        Ok((!rings.is_empty()).then_some(Polygon { rings }))
    }
}
