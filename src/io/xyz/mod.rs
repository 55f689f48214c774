//! Points as text: a point on each line, parted by blanks, commas or semicolons.
//!
//! The first line may name the columns, also after `#` or `//`: `x`, `y`, `z`, `nx`, `ny`, `nz`, `r`, `g`,
//! `b` (or `red`, `green`, `blue`), `alpha` and `class` are read, in any case and order. Without names the
//! first three are the position. Of six and more the next three are a normal where all of them have unit
//! length to 0.001, else a colour; nine have both. A first line of one number, as `.pts` files have it, is
//! how many points follow; of seven columns the fourth then is an intensity, which is not read.
//!
//! Colours are bytes from 0 to 255; shares where none is above 1 and one is not whole; and of 16 bits where
//! one is above 255.

mod columns;
#[cfg(test)]
mod tests;
mod write;

pub use write::{write, write_csv};

use super::cloud::{self, SKIP};
use super::refusal::Refusal;
use super::source::Source;
use super::text::{Lines, integer, line_end, number, shown, uncommented, words};
use crate::error::Fault;
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, length};
use crate::report::{Tally, Warning};
use columns::{Columns, Role, are_names, are_values, no_columns, split_of};

/// How far from 1 the length of a normal may be that no column is named after.
const UNIT: f64 = 1e-3;

/// How the values of a line are parted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Split {
    Blanks,
    At(u8),
}

impl Split {
    /// Replaces `values` with those of a line.
    fn of<'a>(self, line: &'a [u8], values: &mut Vec<&'a [u8]>) {
        values.clear();
        match self {
            Split::Blanks => values.extend(words(line)),
            Split::At(separator) => {
                let parts = line.split(|b| *b == separator).map(<[u8]>::trim_ascii);
                values.extend(parts);
                // A separator may end the line too.
                if values.len() > 1 && values.last().is_some_and(|last| last.is_empty()) {
                    values.pop();
                }
            }
        }
    }
}

/// The values of a line, parted as its separators tell.
fn values_of(line: &[u8]) -> Vec<&[u8]> {
    let mut values = Vec::new();
    split_of(line).of(line, &mut values);
    values
}

/// The lines that are no comments, and the last of those at the start that may name the columns.
struct Rows<'a> {
    lines: Lines<'a>,
    names: Option<&'a [u8]>,
}

impl<'a> Rows<'a> {
    fn new(text: &'a [u8]) -> Self {
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        Rows {
            lines: Lines::new(text),
            names: None,
        }
    }

    /// The next line with values, trimmed.
    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            let line = self.lines.next()?.trim_ascii();
            let comment = line.strip_prefix(b"#").or_else(|| line.strip_prefix(b"//"));
            match comment {
                None if line.is_empty() => {}
                None => return Some(uncommented(line).trim_ascii_end()),
                Some(comment) => {
                    if are_names(&values_of(comment)) {
                        self.names = Some(comment);
                    }
                }
            }
        }
    }
}

/// Whether a text begins as one of points does: with names of columns, or with three or at least six
/// numbers, maybe after a line of one.
pub fn is_document(text: &[u8]) -> bool {
    let mut rows = Rows::new(text);
    let first = rows.next().map(values_of).unwrap_or_default();
    if let [word] = first[..]
        && integer(word).is_some()
    {
        let second = rows.next().map(values_of).unwrap_or_default();
        return second.len() >= 3 && second.iter().all(|word| number(word).is_some());
    }
    are_names(&first) || are_values(&first)
}

/// Reads points, with normals, colours and classes where there are columns of them.
///
/// # Errors
///
/// A first line with neither numbers nor the names x, y and z; a row with fewer values than the first; a
/// value that is no number, or is not finite unless the source skips such points; all with the line. No
/// points at all; more than the source may hold.
///
/// # Cost
///
/// Linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Refusal> {
    let mut rows = Rows::new(source.bytes());
    let mut line = rows.next();
    let mut stated = None;
    if let Some([word]) = line.map(values_of).as_deref() {
        stated = integer(word).filter(|count| *count >= 0);
        if stated.is_some() {
            line = rows.next();
        }
    }
    let Some(first) = line else {
        return Err(Fault::whole("holds no points").into());
    };
    let is_pts = stated.is_some()
        || source
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("pts"));
    let split = split_of(first);
    let (columns, has_names) = columns_of(first, &rows, is_pts)?;
    if has_names {
        line = rows.next();
    }
    let mut points = Points::new(columns, source)?;
    let mut values = Vec::new();
    while let Some(row) = line {
        split.of(row, &mut values);
        points.push(&values, row, rows.lines.number())?;
        line = rows.next();
    }
    let mesh = points.finish(warnings);
    if let Some(stated) = stated.filter(|stated| *stated as u64 != mesh.positions.len() as u64) {
        let count = mesh.positions.len();
        let message =
            format!("the first line states {stated} points, but {count} follow; those are read");
        warnings.push(Warning::new("other-count", message, 1, None));
    }
    Ok(cloud::of_all(mesh)?)
}

/// What the columns are, by the first line that is no comment, and whether that has their names.
fn columns_of(first: &[u8], rows: &Rows, is_pts: bool) -> Result<(Columns, bool), Fault> {
    let values = values_of(first);
    let line = rows.lines.number();
    let is_number = |word: &[u8]| number(word).is_some();
    if !values.first().is_some_and(|word| is_number(word)) {
        if values.iter().skip(1).any(|word| is_number(word)) {
            let problem = format!("{} is not a number", shown(values[0]));
            return Err(no_columns(problem, line));
        }
        let named = Columns::named(&values).map_err(|problem| no_columns(problem, line))?;
        return Ok((named, true));
    }
    if values.len() < 3 {
        let problem = format!(
            "has {} values, but 3 are needed: {}",
            values.len(),
            shown(first)
        );
        return Err(no_columns(problem, line));
    }
    let names = rows.names.map(values_of).unwrap_or_default();
    let named = Columns::named(&names)
        .ok()
        .filter(|_| names.len() == values.len());
    let columns = named.unwrap_or_else(|| Columns::counted(values.len(), is_pts));
    Ok((columns, false))
}

/// The points read so far.
struct Points {
    columns: Columns,
    skips_bad: bool,
    positions: Vec<Vec3>,
    groups: Vec<Vec<Vec3>>,
    alphas: Vec<f64>,
    classes: Vec<f64>,
    extra: Tally,
}

impl Points {
    /// Errs where so many lines, were all of them points, would take more than may be held.
    fn new(columns: Columns, source: &Source) -> Result<Points, Refusal> {
        let text = source.bytes();
        let end = line_end(text);
        let lines = text.iter().filter(|b| **b == end).count() + 1;
        // The shortest row has a digit and a blank for each value.
        let most = lines.min(text.len() / (2 * columns.width) + 1);
        let row = 28 + 24 * columns.groups.len() + 16 + 9;
        cloud::expect_points(most as u64, row, source.limit())?;
        let room = |has: bool| if has { most } else { 0 };
        Ok(Points {
            positions: Vec::with_capacity(most),
            groups: vec![Vec::with_capacity(most); columns.groups.len()],
            alphas: Vec::with_capacity(room(columns.alpha.is_some())),
            classes: Vec::with_capacity(room(columns.class.is_some())),
            skips_bad: source.skips_bad(),
            columns,
            extra: Tally::default(),
        })
    }

    fn push(&mut self, values: &[&[u8]], row: &[u8], line: u64) -> Result<(), Fault> {
        let width = self.columns.width;
        if values.len() < width {
            let count = values.len();
            let problem = format!("has {count} values, but {width} are needed: {}", shown(row));
            return Err(Fault::line(line, problem));
        }
        if values.len() > width {
            self.extra.note(line);
        }
        let position = self.triple(values, self.columns.position, line)?;
        for at in 0..self.groups.len() {
            let group = self.triple(values, self.columns.groups[at].1, line)?;
            self.groups[at].push(group);
        }
        self.positions.push(position);
        if let Some(column) = self.columns.alpha {
            self.alphas.push(self.value(values[column], line)?);
        }
        if let Some(column) = self.columns.class {
            self.classes.push(self.value(values[column], line)?);
        }
        Ok(())
    }

    #[inline]
    fn triple(&self, values: &[&[u8]], columns: [usize; 3], line: u64) -> Result<Vec3, Fault> {
        let [a, b, c] = columns.map(|column| self.value(values[column], line));
        Ok([a?, b?, c?])
    }

    #[inline]
    fn value(&self, word: &[u8], line: u64) -> Result<f64, Fault> {
        match number(word) {
            Some(value) if value.is_finite() || self.skips_bad => Ok(value),
            Some(_) => {
                let problem = format!("{} is not finite", shown(word));
                Err(Fault::line(line, problem).with_hint(SKIP))
            }
            None => Err(Fault::line(
                line,
                format!("{} is not a number", shown(word)),
            )),
        }
    }

    fn finish(self, warnings: &mut Vec<Warning>) -> Mesh {
        let message = "lines with more values than the first; the rest is not read";
        self.extra.warn("extra-values", message, warnings);
        cloud::warn_of_ignored(&self.columns.ignored, warnings);
        let mut mesh = Mesh {
            positions: self.positions,
            ..Mesh::default()
        };
        let alphas = self.columns.alpha.map(|_| self.alphas.as_slice());
        for ((role, columns), values) in self.columns.groups.iter().zip(self.groups) {
            let is_normal = *role == Role::Normal || *role == Role::Either && are_normals(&values);
            if is_normal && mesh.normals.is_none() {
                mesh.normals = Some(values);
                continue;
            }
            let colors = colors(&values, alphas).filter(|_| mesh.colors.is_none());
            if colors.is_none() {
                let first = columns[0] + 1;
                let message = format!(
                    "columns {first} to {} are neither normals nor colours; not read",
                    first + 2
                );
                warnings.push(Warning::new("unknown-columns", message, 3, None));
            } else {
                mesh.colors = colors;
            }
        }
        if self.columns.class.is_some() {
            mesh.classes = cloud::classes(&self.classes, warnings);
        }
        mesh
    }
}

/// Whether all have unit length, but for those that are no number.
fn are_normals(values: &[Vec3]) -> bool {
    let is_unit = |v: &Vec3| {
        let length = length(*v);
        length.is_nan() || (length - 1.0).abs() <= UNIT
    };
    values.iter().all(is_unit)
}

/// Colours of columns, with the scale that their values tell; none where they are beyond any.
fn colors(values: &[Vec3], alphas: Option<&[f64]>) -> Option<Vec<[f32; 4]>> {
    let channels = || {
        values
            .as_flattened()
            .iter()
            .chain(alphas.unwrap_or_default())
    };
    let most = channels().fold(0.0, |most: f64, value| most.max(*value));
    let has_parts = channels().any(|value| value.fract() != 0.0);
    let scale = match most {
        _ if channels().any(|value| *value < 0.0) => return None,
        ..=1.0 if has_parts => 1.0,
        ..=255.0 => 255.0,
        ..=65535.0 => 65535.0,
        _ => return None,
    };
    let color = |(v, [red, green, blue]): (usize, &Vec3)| {
        let alpha = alphas.map_or(scale, |alphas| alphas[v]);
        [*red, *green, *blue, alpha].map(|value| (value / scale) as f32)
    };
    Some(values.iter().enumerate().map(color).collect())
}
