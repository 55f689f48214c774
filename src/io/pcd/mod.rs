//! PCD, the point cloud data of the Point Cloud Library, of versions 0.5 to 0.7.
//!
//! Read are the fields `x`, `y`, `z`, `normal_x` to `normal_z`, `rgb` and `rgba` (four bytes packed in a
//! float or a whole number) and `classification`, from text, from binary rows and from binary columns
//! packed with LZF. Other fields are stepped over, with a counted warning. Binary files are little endian.
//!
//! Clouds of depth cameras keep a pixel without a depth as a point that is NaN: such a file is refused,
//! but for a source that skips such points. The pose of the sensor is not applied.

mod header;
mod lzf;
#[cfg(test)]
mod tests;
mod values;
mod write;

pub use header::is_document;
pub use write::write;

use super::cloud::{self, SKIP};
use super::refusal::{RAISE, Refusal, expect_room};
use super::source::Source;
use super::text::{Lines, Words, number, shown, words};
use crate::error::Fault;
use crate::mesh::Mesh;
use crate::report::{Tally, Warning};
use header::{Encoding, Field, Header, Scalar};
use rayon::prelude::*;
use values::{Column, Layout};

/// Bytes before the data of a packed file: how many there are, and how many they stand for.
const SIZES: usize = 8;

/// Reads the points in the order of the file, each with its normal, colour and class where it has them.
///
/// # Errors
///
/// A header that is not one or has no field x, y or z, with the line; fewer points than it states, with
/// the byte or line; packed data that is damaged, with the byte; a text value that is no number; no
/// points at all; more than the source may hold. Numbers that are not finite are left to the caller,
/// but for those of text files, whose line is named unless the source skips bad points.
///
/// # Cost
///
/// Linear in the bytes; binary points on all threads.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Refusal> {
    let header = Header::parse(source.bytes())?;
    let layout = Layout::new(&header)?;
    let (normals, class) = (layout.normal.is_some(), layout.class.is_some());
    let row = cloud::bytes_of(normals, layout.color.is_some(), class);
    if header.encoding != Encoding::Ascii {
        // Points of text take room as they are found.
        check_bytes(&header, source)?;
        cloud::expect_points(header.points, row, source.limit())?;
    }
    let mesh = match header.encoding {
        Encoding::Ascii => text_points(&header, &layout, row, source, warnings)?,
        Encoding::Binary => {
            let columns = values::by_rows(&header.fields);
            let bytes = &source.bytes()[header.data..];
            let length = stride(&header.fields) * header.points as usize;
            warn_of_trailing(&bytes[length..], warnings);
            points_of(bytes, header.points as usize, &columns, &layout, warnings)
        }
        Encoding::Compressed => {
            let columns = values::by_fields(&header.fields, header.points as usize);
            let bytes = unpacked(&header, row, source, warnings)?;
            points_of(&bytes, header.points as usize, &columns, &layout, warnings)
        }
    };
    cloud::warn_of_ignored(&layout.ignored(&header.fields), warnings);
    if header.is_moved {
        let message = "the pose of the sensor (VIEWPOINT) is not applied";
        warnings.push(Warning::new("ignored-viewpoint", message, 1, None));
    }
    Ok(cloud::of_all(mesh)?)
}

/// Bytes of a point. Fields and their numbers are few enough for the sum.
fn stride(fields: &[Field]) -> usize {
    fields.iter().map(Field::bytes).sum()
}

/// Errs where a binary file ends before its points do.
fn check_bytes(header: &Header, source: &Source) -> Result<(), Fault> {
    let bytes = source.bytes();
    let there = bytes.len() - header.data;
    let whole = (there / stride(&header.fields)) as u64;
    if header.encoding == Encoding::Binary && whole < header.points {
        let points = header.points;
        let problem = format!("the file ends after {whole} of {points} points");
        return Err(Fault::byte(bytes.len(), problem));
    }
    Ok(())
}

/// The library that PCD is of fills up the last page with zeros, of which there is nothing to say.
fn warn_of_trailing(bytes: &[u8], warnings: &mut Vec<Warning>) {
    if bytes.iter().any(|byte| *byte != 0) {
        let message = "bytes follow the last point; not read";
        let count = bytes.len() as u64;
        warnings.push(Warning::new("trailing-bytes", message, count, None));
    }
}

/// The columns of a packed file; `row` is how many bytes a point takes besides.
fn unpacked(
    header: &Header,
    row: usize,
    source: &Source,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<u8>, Refusal> {
    let bytes = source.bytes();
    let data = &bytes[header.data..];
    let size = |at: usize| data.get(at..).and_then(<[u8]>::first_chunk::<4>).copied();
    let (Some(packed), Some(length)) = (size(0), size(4)) else {
        let problem = format!("the {SIZES} bytes before the packed data are cut short");
        return Err(Fault::byte(bytes.len(), problem).into());
    };
    let [packed, length] = [packed, length].map(|size| u32::from_le_bytes(size) as usize);
    let Some(data) = data[SIZES..].get(..packed) else {
        let there = data.len() - SIZES;
        let problem = format!("the file ends after {there} of {packed} bytes of packed data");
        return Err(Fault::byte(bytes.len(), problem).into());
    };
    let kept: usize = header
        .fields
        .iter()
        .filter(|field| !field.is_padding())
        .map(Field::bytes)
        .sum();
    let needed = kept as u128 * u128::from(header.points);
    if needed != length as u128 {
        let points = header.points;
        let problem = format!(
            "the packed data is of {length} bytes, but {points} points of {kept} bytes are {needed}"
        );
        return Err(Fault::byte(header.data + 4, problem).into());
    }
    if length > lzf::most(packed) {
        let problem = format!("{packed} bytes of packed data cannot stand for {length}");
        return Err(Fault::byte(header.data, problem).into());
    }
    let all = needed + row as u128 * u128::from(header.points);
    let what = || format!("unpacking {} points", header.points);
    expect_room(what, all, source.limit(), RAISE)?;
    let place = |(at, problem): (usize, String)| Fault::byte(header.data + SIZES + at, problem);
    let columns = lzf::unpack(data, length).map_err(place)?;
    warn_of_trailing(&bytes[header.data + SIZES + packed..], warnings);
    Ok(columns)
}

/// The points of binary data, of which there is enough.
fn points_of(
    bytes: &[u8],
    count: usize,
    columns: &[Column],
    layout: &Layout,
    warnings: &mut Vec<Warning>,
) -> Mesh {
    let points = || (0..count).into_par_iter().with_min_len(1 << 13);
    let triples = |fields: [usize; 3]| -> Vec<[f64; 3]> {
        let columns = fields.map(|field| columns[field]);
        let triple = |i| columns.map(|column| column.value(bytes, i));
        points().map(triple).collect()
    };
    let packed = layout.color.map(|field| -> Vec<u32> {
        let column = columns[field];
        points().map(|i| column.bits(bytes, i) as u32).collect()
    });
    let classes = layout.class.map(|field| -> Vec<f64> {
        let column = columns[field];
        points().map(|i| column.value(bytes, i)).collect()
    });
    Mesh {
        positions: triples(layout.position),
        normals: layout.normal.map(triples),
        colors: packed.map(|packed| values::colors(&packed, layout.has_alpha)),
        classes: classes.and_then(|classes| cloud::classes(&classes, warnings)),
        ..Mesh::default()
    }
}

/// The points of a text, of which each is a line.
struct Texts<'a> {
    header: &'a Header,
    layout: &'a Layout,
    skips_bad: bool,
    mesh: Mesh,
    packed: Vec<u32>,
    classes: Vec<f64>,
    /// Colours that were printed as a number which is none.
    lost: Tally,
}

fn text_points(
    header: &Header,
    layout: &Layout,
    row: usize,
    source: &Source,
    warnings: &mut Vec<Warning>,
) -> Result<Mesh, Refusal> {
    let text = &source.bytes()[header.data..];
    let mut lines = Lines::with_end(text, b'\n', header.lines);
    let mut texts = Texts {
        header,
        layout,
        skips_bad: source.skips_bad(),
        mesh: Mesh {
            normals: layout.normal.map(|_| Vec::new()),
            ..Mesh::default()
        },
        packed: Vec::new(),
        classes: Vec::new(),
        lost: Tally::default(),
    };
    // Of each value at least a digit and a blank are there.
    let most = (text.len() / (2 * header.fields.len()) + 1) as u64;
    cloud::expect_points(header.points.min(most), row, source.limit())?;
    let mut extra = Tally::default();
    for index in 0..header.points {
        let Some(line) = lines.by_ref().find(|line| !line.trim_ascii().is_empty()) else {
            let points = header.points;
            let problem = format!("the file ends after {index} of {points} points");
            return Err(Fault::line(lines.number(), problem).into());
        };
        let mut values = words(line);
        texts.point(&mut values, lines.number())?;
        if values.next().is_some() {
            extra.note(lines.number());
        }
    }
    let message = "a line has more values than the points have fields; not read";
    extra.warn("extra-values", message, warnings);
    let mut after = Tally::default();
    while let Some(line) = lines.next() {
        if !line.trim_ascii().is_empty() {
            after.note(lines.number());
        }
    }
    let message = "lines follow the last point; not read";
    after.warn("trailing-lines", message, warnings);
    Ok(texts.finish(warnings))
}

impl Texts<'_> {
    /// Takes the point of a line.
    fn point(&mut self, values: &mut Words, line: u64) -> Result<(), Fault> {
        let (mut position, mut normal) = ([0.0; 3], [0.0; 3]);
        for (at, field) in self.header.fields.iter().enumerate() {
            for _ in 0..field.count {
                let word = values.next().ok_or_else(|| {
                    let index = self.mesh.positions.len();
                    let problem = format!("point {index} has fewer values than it has fields");
                    Fault::line(line, problem)
                })?;
                let is_it = |field: &usize| *field == at;
                if self.layout.color == Some(at) {
                    self.color(word, field.scalar, line)?;
                } else if self.layout.class == Some(at) {
                    self.classes.push(value(word, line)?);
                } else if let Some(axis) = self.layout.position.iter().position(is_it) {
                    position[axis] = self.finite(word, line)?;
                } else if let Some(axis) = self.layout.normal.iter().flatten().position(is_it) {
                    normal[axis] = self.finite(word, line)?;
                }
            }
        }
        self.mesh.positions.push(position);
        if let Some(normals) = &mut self.mesh.normals {
            normals.push(normal);
        }
        Ok(())
    }

    fn finite(&self, word: &[u8], line: u64) -> Result<f64, Fault> {
        let value = value(word, line)?;
        if value.is_finite() || self.skips_bad {
            return Ok(value);
        }
        let index = self.mesh.positions.len();
        let problem = format!("point {index} has {}, which is not finite", shown(word));
        Err(Fault::line(line, problem).with_hint(SKIP))
    }

    /// A packed colour: a float of its bits, or the whole number that they are, whatever the type says.
    fn color(&mut self, word: &[u8], scalar: Scalar, line: u64) -> Result<(), Fault> {
        let is_whole = |word: &[u8]| word.iter().all(u8::is_ascii_digit);
        let number = value(word, line)?;
        let bits = if scalar != Scalar::F32 || is_whole(word) {
            number as i64 as u32
        } else {
            (number as f32).to_bits()
        };
        if number.is_nan() {
            self.lost.note(line);
        }
        self.packed.push(if number.is_nan() { 0 } else { bits });
        Ok(())
    }

    fn finish(mut self, warnings: &mut Vec<Warning>) -> Mesh {
        let message = "colours that were printed as NaN; black is taken";
        self.lost.warn("unknown-colours", message, warnings);
        let has_alpha = self.layout.has_alpha;
        let packed = self.layout.color.map(|_| &self.packed);
        self.mesh.colors = packed.map(|packed| values::colors(packed, has_alpha));
        let classes = self.layout.class.map(|_| &self.classes);
        self.mesh.classes = classes.and_then(|classes| cloud::classes(classes, warnings));
        self.mesh
    }
}

fn value(word: &[u8], line: u64) -> Result<f64, Fault> {
    let problem = || format!("{} is not a number", shown(word));
    number(word).ok_or_else(|| Fault::line(line, problem()))
}
