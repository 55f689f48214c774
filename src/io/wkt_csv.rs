//! CSV with a column of well-known text: a feature on each row.
//!
//! Source: RFC 4180 (Shafranovich 2005) for the table; OGC 06-103r4, section 7, for the text.

use super::geojson::stem;
use super::refusal::Refusal;
use super::source::Source;
use super::text;
use super::{json::unmarked, prj};
use crate::error::Fault;
use crate::report::{Tally, Warning};
use crate::vector::crs::Crs;
use crate::vector::{Feature, Layer, Polygon, Shape, Vec2};
use serde_json::{Map, Number, Value};

/// Names of columns of well-known text, in lower case.
const NAMES: [&str; 7] = [
    "wkt",
    "geometry",
    "geom",
    "the_geom",
    "wkt_geom",
    "shape",
    "wkb_geometry",
];
/// Words that well-known text starts with.
const KINDS: [&str; 7] = [
    "POINT",
    "LINESTRING",
    "POLYGON",
    "MULTIPOINT",
    "MULTILINESTRING",
    "MULTIPOLYGON",
    "GEOMETRYCOLLECTION",
];

/// Rows of a table, in which quotes keep marks and ends of lines.
struct Rows<'a> {
    rest: &'a [u8],
    mark: u8,
    line: u64,
}

impl<'a> Rows<'a> {
    fn new(text: &'a [u8]) -> Self {
        let first = text.split(|b| *b == b'\n').next().unwrap_or_default();
        let count = |mark: u8| first.iter().filter(|b| **b == mark).count();
        let mark = [b',', b';', b'\t', b'|']
            .into_iter()
            .rev()
            .max_by_key(|mark| count(*mark));
        Rows {
            rest: text,
            mark: mark.unwrap_or(b','),
            line: 1,
        }
    }

    /// The next row with anything in it, and its first line.
    fn next(&mut self) -> Result<Option<(u64, Vec<String>)>, Fault> {
        while let [b'\r' | b'\n', rest @ ..] = self.rest {
            self.line += u64::from(self.rest[0] == b'\n');
            self.rest = rest;
        }
        if self.rest.is_empty() {
            return Ok(None);
        }
        let line = self.line;
        let mut cells = Vec::new();
        loop {
            let cell = self.cell(line)?;
            cells.push(String::from_utf8_lossy(&cell).into_owned());
            match self.rest {
                [mark, rest @ ..] if *mark == self.mark => self.rest = rest,
                _ => return Ok(Some((line, cells))),
            }
        }
    }

    fn cell(&mut self, line: u64) -> Result<Vec<u8>, Fault> {
        let [b'"', rest @ ..] = self.rest else {
            let is_end = |b: &u8| *b == self.mark || matches!(*b, b'\r' | b'\n');
            let end = self.rest.iter().position(is_end).unwrap_or(self.rest.len());
            let (cell, rest) = self.rest.split_at(end);
            self.rest = rest;
            return Ok(cell.to_vec());
        };
        self.rest = rest;
        let mut cell = Vec::new();
        loop {
            let end = self.rest.iter().position(|b| *b == b'"');
            let end = end.ok_or_else(|| Fault::line(line, "quotes that do not end"))?;
            let part = &self.rest[..end];
            self.line += part.iter().filter(|b| **b == b'\n').count() as u64;
            cell.extend(part);
            self.rest = &self.rest[end + 1..];
            match self.rest {
                [b'"', rest @ ..] => {
                    cell.push(b'"');
                    self.rest = rest;
                }
                _ => return Ok(cell),
            }
        }
    }
}

/// The column of well-known text: by its name, or by what stands in it first.
fn column_of(names: &[String], first: Option<&[String]>) -> Option<usize> {
    let is_name = |name: &String| NAMES.contains(&name.trim().to_ascii_lowercase().as_str());
    let is_text = |cell: &String| kind_of(cell).is_some();
    let texts = first.and_then(|row| row.iter().position(is_text));
    texts.or_else(|| names.iter().position(is_name))
}

/// The first word of well-known text, without its number of a reference system.
fn kind_of(cell: &str) -> Option<&'static str> {
    let text = without_number(cell).1;
    let upper: String = text.chars().take_while(char::is_ascii_alphabetic).collect();
    let upper = upper.to_ascii_uppercase();
    let stem = upper.trim_end_matches(['Z', 'M']);
    KINDS.into_iter().find(|kind| *kind == stem)
}

/// `SRID=4326;` taken off, with its number.
fn without_number(cell: &str) -> (Option<u32>, &str) {
    let cell = cell.trim();
    match cell.get(..5) {
        Some(start) if start.eq_ignore_ascii_case("SRID=") => match cell[5..].split_once(';') {
            Some((number, rest)) => (number.trim().parse().ok(), rest.trim_start()),
            None => (None, cell),
        },
        _ => (None, cell),
    }
}

/// Whether a text is a table with such a column, by its first two rows.
pub fn is_document(text: &[u8]) -> bool {
    let mut rows = Rows::new(unmarked(text));
    let (Ok(Some((_, names))), Ok(second)) = (rows.next(), rows.next()) else {
        return false;
    };
    let second = second.map(|(_, cells)| cells);
    let is_named = names
        .iter()
        .any(|name| NAMES[..5].contains(&name.trim().to_ascii_lowercase().as_str()));
    is_named || second.is_some_and(|row| row.iter().any(|cell| kind_of(cell).is_some()))
}

/// Reads a table whose first row has names. The other columns are properties: numbers where they are
/// written as JSON writes them, null where empty, else text.
///
/// The column is the first whose value starts as well-known text, or has one of the usual names. Coordinates
/// beyond two are left out, rings closed, each with a counted warning. The reference system is that of the
/// text (`SRID=4326;`), or of a `.prj` file beside. Errs, with the line, where text cannot be read. Cost:
/// linear.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Layer, Refusal> {
    let mut rows = Rows::new(unmarked(source.bytes()));
    let (_, names) = rows
        .next()?
        .ok_or_else(|| Fault::whole("has no row of names"))?;
    let mut pending = rows.next()?;
    let first = pending.as_ref().map(|(_, cells)| cells.as_slice());
    let column = column_of(&names, first).ok_or_else(|| {
        let hint = "name the column wkt or geometry";
        Fault::line(1, "no column holds well-known text").with_hint(hint)
    })?;
    let mut layer = Layer {
        name: stem(source),
        crs: prj::beside(source, warnings),
        features: Vec::new(),
    };
    let (mut heights, mut unclosed) = (Tally::default(), Tally::default());
    while let Some((line, cells)) = pending {
        let index = layer.features.len() as u64;
        let (number, text) = without_number(cells.get(column).map_or("", String::as_str));
        if let (Some(number), None) = (number, &layer.crs) {
            layer.crs = Some(Crs::from_epsg(number));
        }
        let mut parser = Parser::new(text, line);
        let shape = if text.is_empty() {
            Shape::Empty
        } else {
            parser.shape()?
        };
        if parser.has_heights {
            heights.note(index);
        }
        if parser.is_unclosed {
            unclosed.note(index);
        }
        let mut properties = Map::new();
        for (at, name) in names.iter().enumerate().filter(|(at, _)| *at != column) {
            let cell = cells.get(at).map_or("", String::as_str);
            properties.insert(name.trim().to_owned(), value(cell));
        }
        layer.features.push(Feature { shape, properties });
        pending = rows.next()?;
    }
    heights.warn(
        "dropped-heights",
        "features with coordinates beyond two, which are left out",
        warnings,
    );
    unclosed.warn(
        "unclosed-rings",
        "features with rings whose end is not their start; closed",
        warnings,
    );
    Ok(layer)
}

fn value(cell: &str) -> Value {
    if cell.is_empty() {
        return Value::Null;
    }
    let number = serde_json::from_str::<Number>(cell.trim());
    number.map_or_else(|_| Value::from(cell), Value::Number)
}

/// Reads the text of one shape.
struct Parser<'a> {
    rest: &'a str,
    line: u64,
    has_heights: bool,
    is_unclosed: bool,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str, line: u64) -> Self {
        Parser {
            rest: text.trim(),
            line,
            has_heights: false,
            is_unclosed: false,
        }
    }

    fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::line(self.line, problem)
    }

    fn word(&mut self) -> &'a str {
        let text = self.rest.trim_start();
        let end = text
            .find(|c: char| !c.is_ascii_alphabetic())
            .unwrap_or(text.len());
        self.rest = &text[end..];
        &text[..end]
    }

    fn takes(&mut self, mark: char) -> bool {
        match self.rest.trim_start().strip_prefix(mark) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn shape(&mut self) -> Result<Shape, Fault> {
        let kind = kind_of(self.rest);
        let word = self.word();
        let kind = kind
            .ok_or_else(|| self.fault(format!("{} is no shape", text::shown(word.as_bytes()))))?;
        let mut before = self.rest;
        let mut next = self.word().to_ascii_uppercase();
        if ["Z", "M", "ZM"].contains(&next.as_str()) {
            before = self.rest;
            next = self.word().to_ascii_uppercase();
        }
        if next == "EMPTY" {
            return Ok(Shape::Empty);
        }
        self.rest = before;
        let shape = match kind {
            "POINT" => Shape::Points(self.list(|parser| parser.place())?),
            "MULTIPOINT" => Shape::Points(self.list(|parser| {
                let is_wrapped = parser.takes('(');
                let place = parser.place()?;
                match is_wrapped && !parser.takes(')') {
                    true => Err(parser.fault("a bracket that does not end")),
                    false => Ok(place),
                }
            })?),
            "LINESTRING" => Shape::Lines(vec![self.line()?]),
            "MULTILINESTRING" => Shape::Lines(self.list(Parser::line)?),
            "POLYGON" => Shape::Polygons(vec![self.polygon()?]),
            "MULTIPOLYGON" => Shape::Polygons(self.list(Parser::polygon)?),
            _ => {
                let fault = self.fault("a collection of geometries, which is not read");
                return Err(fault.with_hint("make each of them a feature of its own"));
            }
        };
        let rest = self.rest.trim();
        match rest.is_empty() {
            true => Ok(shape),
            false => Err(self.fault(format!(
                "{} stands after the shape",
                text::shown(rest.as_bytes())
            ))),
        }
    }

    /// `(a, b, c)`.
    fn list<T>(
        &mut self,
        mut one: impl FnMut(&mut Self) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        if !self.takes('(') {
            let rest: String = self.rest.chars().take(20).collect();
            return Err(self.fault(format!("a bracket is missing before {rest:?}")));
        }
        let mut all = vec![one(self)?];
        while self.takes(',') {
            all.push(one(self)?);
        }
        match self.takes(')') {
            true => Ok(all),
            false => Err(self.fault("a bracket that does not end")),
        }
    }

    fn place(&mut self) -> Result<Vec2, Fault> {
        let end = self.rest.find([',', '(', ')']).unwrap_or(self.rest.len());
        let (words, rest) = self.rest.split_at(end);
        self.rest = rest;
        let numbers = text::words(words.as_bytes()).map(|word| text::finite(word, self.line));
        let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
        self.has_heights |= numbers.len() > 2;
        match numbers[..] {
            [x, y] | [x, y, _] | [x, y, _, _] => Ok([x, y]),
            _ => Err(self.fault(format!(
                "a place has {} coordinates, 2 are needed",
                numbers.len()
            ))),
        }
    }

    fn line(&mut self) -> Result<Vec<Vec2>, Fault> {
        let line = self.list(Parser::place)?;
        match line.len() {
            1 => Err(self.fault("a line has 1 place, at least 2 are needed")),
            _ => Ok(line),
        }
    }

    fn polygon(&mut self) -> Result<Polygon, Fault> {
        let rings = self.list(|parser| {
            let mut ring = parser.list(Parser::place)?;
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            } else {
                parser.is_unclosed = true;
            }
            match ring.len() {
                0..3 => Err(parser.fault(format!(
                    "a ring has {} places, at least 3 are needed",
                    ring.len()
                ))),
                _ => Ok(ring),
            }
        })?;
        Ok(Polygon { rings })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<(Layer, Vec<Warning>), Fault> {
        let source =
            Source::from_bytes("a.csv", text.into()).map_err(|e| Fault::whole(e.to_string()))?;
        let mut warnings = Vec::new();
        let layer = read(&source, &mut warnings).map_err(Refusal::fault)?;
        layer.check()?;
        Ok((layer, warnings))
    }

    #[test]
    fn every_shape_is_read() {
        let text = "id;shape_of;name\r\n\
            1;SRID=32733;\"x\"\n";
        assert!(!is_document(text.as_bytes()));
        let text = "id,wkt,name\n\
            1,POINT(1 2),a\n\
            002,\"LINESTRING Z (0 0 5, 1 1 5)\",\"b \"\"c\"\"\"\n\
            3,\"MULTIPOINT ((1 2), 3 4)\",\n\
            4,\"Polygon((0 0, 4 0, 4 4, 0 0), (1 1, 2 1, 2 2))\",d\n\
            5,MULTIPOLYGON EMPTY,e\n\
            6,,f\n\
            7,\"MULTILINESTRING((0 0, 1 1), (2 2,3 3))\",g\n\
            8,\"MULTIPOLYGON(((0 0, 4 0, 4 4, 0 0)))\",h\n";
        assert!(is_document(text.as_bytes()));
        let (layer, warnings) = parsed(text).expect("a layer");
        let shapes: Vec<&Shape> = layer.features.iter().map(|f| &f.shape).collect();
        assert_eq!(shapes[0], &Shape::Points(vec![[1.0, 2.0]]));
        assert_eq!(shapes[1], &Shape::Lines(vec![vec![[0.0, 0.0], [1.0, 1.0]]]));
        assert_eq!(shapes[2], &Shape::Points(vec![[1.0, 2.0], [3.0, 4.0]]));
        assert_eq!(
            shapes[3]
                .parts()
                .iter()
                .map(|p| p.len())
                .collect::<Vec<_>>(),
            [3, 3]
        );
        assert_eq!((shapes[4], shapes[5]), (&Shape::Empty, &Shape::Empty));
        assert_eq!(shapes[6].parts().len(), 2);
        assert_eq!(shapes[7].parts().len(), 1);
        assert_eq!(layer.features[1].properties["id"], "002");
        assert_eq!(layer.features[1].properties["name"], "b \"c\"");
        assert_eq!(layer.features[2].properties["id"], 3);
        let codes: Vec<_> = warnings
            .iter()
            .map(|w| (w.code.as_str(), w.first))
            .collect();
        assert_eq!(
            codes,
            [("dropped-heights", Some(1)), ("unclosed-rings", Some(3))]
        );
    }

    #[test]
    fn faults_name_the_line() {
        let said = |wkt: &str| {
            parsed(&format!("wkt\n\n{wkt}\n"))
                .expect_err("a fault")
                .to_string()
        };
        for (wkt, message) in [
            ("POINT(1)", "3: a place has 1 coordinates, 2 are needed"),
            ("POINT(1 x)", "3: \"x\" is not a number"),
            (
                "\"LINESTRING(1 2)\"",
                "3: a line has 1 place, at least 2 are needed",
            ),
            (
                "\"POLYGON((0 0, 1 1, 0 0))\"",
                "3: a ring has 2 places, at least 3 are needed",
            ),
            ("CIRCLE(1 2)", "3: \"CIRCLE\" is no shape"),
            (
                "\"POLYGON((0 0, 1 1, 0 1, 0 0)\"",
                "3: a bracket that does not end",
            ),
            ("POINT(1 2) 3", "3: \"3\" stands after the shape"),
            ("POINT 1 2", "3: a bracket is missing before \" 1 2\""),
            ("\"POINT(1 2)", "3: quotes that do not end"),
        ] {
            assert_eq!(said(wkt), message);
        }
    }
}
