//! GeoJSON as it is written: a feature on a line.

use crate::io::text::{push_number, spill};
use crate::vector::crs::Crs;
use crate::vector::{Feature, Layer, Raised, Shape};
use serde_json::Value;
use std::io::{self, Write};

/// Writes a feature collection.
///
/// Rings are closed, and go round as RFC 7946 asks: outer ones counter-clockwise, holes clockwise. A
/// reference system other than longitude and latitude on WGS 84 is the member `crs`, as GDAL writes it.
pub fn write(layer: &Layer, out: &mut dyn Write) -> io::Result<()> {
    document(layer, out, |text, index| {
        match &layer.features[index].shape {
            Shape::Empty => text.extend(b"null"),
            Shape::Points(points) => push_points(text, points),
            Shape::Lines(lines) => push_lines(text, lines),
            Shape::Polygons(polygons) => {
                let polygons: Vec<_> = polygons.iter().map(|p| p.rings.as_slice()).collect();
                push_polygons(text, &polygons);
            }
        }
    })
}

/// Writes a feature collection with heights: the properties, the name and the reference system of a layer,
/// with other shapes for its features, in their order.
///
/// Errs where there are not as many shapes as features.
pub fn write_raised(layer: &Layer, shapes: &[Raised], out: &mut dyn Write) -> io::Result<()> {
    let (features, given) = (layer.features.len(), shapes.len());
    if features != given {
        let problem = format!("{given} shapes for {features} features");
        return Err(io::Error::other(problem));
    }
    document(layer, out, |text, index| match &shapes[index] {
        Raised::Empty => text.extend(b"null"),
        Raised::Points(points) => push_points(text, points),
        Raised::Lines(lines) => push_lines(text, lines),
        Raised::Polygons(polygons) => {
            let polygons: Vec<_> = polygons.iter().map(Vec::as_slice).collect();
            push_polygons(text, &polygons);
        }
    })
}

fn document(
    layer: &Layer,
    out: &mut dyn Write,
    geometry: impl Fn(&mut Vec<u8>, usize),
) -> io::Result<()> {
    let name = Value::from(layer.name.as_str());
    write!(
        out,
        "{{\n\"type\": \"FeatureCollection\",\n\"name\": {name},\n"
    )?;
    if let Some(crs) = stated(layer.crs.as_ref()) {
        writeln!(out, "\"crs\": {crs},")?;
    }
    out.write_all(b"\"features\": [")?;
    let mut text = Vec::new();
    for (index, Feature { properties, .. }) in layer.features.iter().enumerate() {
        text.extend(if index > 0 { ",\n".as_bytes() } else { b"\n" });
        text.extend(b"{\"type\": \"Feature\", \"properties\": ");
        serde_json::to_writer(&mut text, properties)?;
        text.extend(b", \"geometry\": ");
        geometry(&mut text, index);
        text.push(b'}');
        spill(&mut text, out)?;
    }
    out.write_all(&text)?;
    out.write_all(b"\n]\n}\n")
}

/// The member `crs`; that of longitude and latitude is left out.
fn stated(crs: Option<&Crs>) -> Option<Value> {
    let name = match crs {
        None => return Some(Value::Null),
        Some(Crs {
            epsg: Some(4326), ..
        }) => return None,
        Some(Crs {
            epsg: Some(code), ..
        }) => format!("urn:ogc:def:crs:EPSG::{code}"),
        Some(crs) => crs.name.clone(),
    };
    Some(serde_json::json!({"type": "name", "properties": {"name": name}}))
}

fn open(text: &mut Vec<u8>, kind: &str) {
    text.extend(b"{\"type\": \"");
    text.extend(kind.as_bytes());
    text.extend(b"\", \"coordinates\": ");
}

/// `[a, b, c]`.
fn list<T>(text: &mut Vec<u8>, all: impl IntoIterator<Item = T>, push: impl Fn(&mut Vec<u8>, T)) {
    text.push(b'[');
    for (number, one) in all.into_iter().enumerate() {
        if number > 0 {
            text.extend(b", ");
        }
        push(text, one);
    }
    text.push(b']');
}

fn push_place<P: AsRef<[f64]>>(text: &mut Vec<u8>, place: &P) {
    list(text, place.as_ref(), |text, value| {
        push_number(text, *value)
    });
}

/// One alone is no array of one.
fn one_or_more<T>(text: &mut Vec<u8>, kind: &str, all: &[T], push: impl Fn(&mut Vec<u8>, &T)) {
    match all {
        [one] => {
            open(text, kind);
            push(text, one);
        }
        all => {
            open(text, &format!("Multi{kind}"));
            list(text, all, push);
        }
    }
    text.push(b'}');
}

fn push_points<P: AsRef<[f64]>>(text: &mut Vec<u8>, points: &[P]) {
    one_or_more(text, "Point", points, push_place);
}

fn push_lines<P: AsRef<[f64]>>(text: &mut Vec<u8>, lines: &[Vec<P>]) {
    one_or_more(text, "LineString", lines, |text, line| {
        list(text, line, push_place);
    });
}

fn push_polygons<P: AsRef<[f64]>>(text: &mut Vec<u8>, polygons: &[&[Vec<P>]]) {
    one_or_more(text, "Polygon", polygons, |text, rings| {
        list(text, rings.iter().enumerate(), |text, (number, ring)| {
            push_ring(text, ring, number == 0);
        });
    });
}

/// A ring from its first place, the way round that its role asks for, and closed.
fn push_ring<P: AsRef<[f64]>>(text: &mut Vec<u8>, ring: &[P], is_outer: bool) {
    let flat: Vec<_> = ring
        .iter()
        .map(|p| [p.as_ref()[0], p.as_ref()[1]])
        .collect();
    let is_left = crate::vector::twice_area(&flat) >= 0.0;
    let Some((first, rest)) = ring.split_first() else {
        text.extend(b"[]");
        return;
    };
    let ends = std::iter::once(first);
    if is_left == is_outer {
        list(text, ends.clone().chain(rest).chain(ends), push_place);
    } else {
        list(
            text,
            ends.clone().chain(rest.iter().rev()).chain(ends),
            push_place,
        );
    }
}
