//! Wavefront OBJ.
//!
//! Read by a parser of our own, because the `tobj` crate renumbers vertices model by model, drops
//! those that no face uses, and names no line in its errors.
//!
//! Objects and groups are merged; vertices, faces, lines and points keep the order of the file.
//! Texture coordinates, normals (which belong to corners) and materials are left out, each with a
//! counted warning; `mtllib` is never opened. A vertex may be `x y z`, `x y z w` (divided by w),
//! `x y z r g b` or `x y z r g b a`. A file of vertices alone is a cloud of points, and as many normals
//! in it are theirs.
//!
//! The text is cut into parts at line ends. A first pass counts the lines and vertices of each, so
//! that the second can parse all parts at once and still knows its line and how many vertices
//! stand before it.

mod normals;
#[cfg(test)]
mod tests;

use super::text::{self, Words, finite, integer, push_number, shown, spill, words};
use crate::error::Fault;
use crate::io::source::Source;
use crate::mesh::polygon::set_faces;
use crate::mesh::{Mesh, Polygons};
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::{self, Write};

/// Bytes that one task parses.
const PART: usize = 1 << 17;

/// Reads vertices, faces, polylines and points.
///
/// # Errors
///
/// A number that is none or is not finite, an index that is 0 or refers to a vertex that is not
/// defined, and a file without vertices, with the line.
///
/// # Cost
///
/// Linear in the bytes, on all threads.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Fault> {
    let text = source.bytes();
    let end = text::line_end(text);
    let parts = cut(text, end, PART);
    let counts: Vec<(u64, u64)> = parts.par_iter().map(|part| count(part, end)).collect();
    let total: u64 = counts.iter().map(|(_, vertices)| vertices).sum();
    if u32::try_from(total).is_err() {
        return Err(Fault::whole(format!(
            "has {total} vertices, but at most {} can be held",
            u32::MAX
        )));
    }
    let mut before = (0, 0);
    let starts: Vec<(u64, u64)> = counts
        .iter()
        .map(|(lines, vertices)| {
            let start = before;
            before = (start.0 + lines, start.1 + vertices);
            start
        })
        .collect();
    let parsed: Vec<Result<Part, Fault>> = parts
        .par_iter()
        .zip(&starts)
        .map(|(part, (lines, vertices))| Part::parse(part, end, *lines, *vertices, total))
        .collect();
    // The fault that stands first in the file is the one reported.
    let parsed = parsed.into_iter().collect::<Result<Vec<_>, _>>()?;
    if total == 0 {
        return Err(Fault::whole("holds no vertices")
            .with_hint("is it an OBJ file? its vertices are lines such as: v 0.5 1 -2"));
    }
    let normals = normals::of_cloud(&parts, end, &starts, &parsed)?;
    let mut mesh = merge(&parsed, normals.is_some(), warnings)?;
    mesh.normals = normals;
    Ok(mesh)
}

/// Cuts a text after line ends into parts of about `size` bytes; never within a continued line.
fn cut(text: &[u8], end: u8, size: usize) -> Vec<&[u8]> {
    let mut parts = Vec::with_capacity(text.len() / size + 1);
    let mut rest = text;
    while rest.len() > size {
        let mut at = size;
        loop {
            match rest[at..].iter().position(|b| *b == end) {
                Some(found) => at += found + 1,
                None => at = rest.len(),
            }
            let line = rest[..at].strip_suffix(&[end]).unwrap_or(&rest[..at]);
            if at == rest.len() || !is_continued(line) {
                break;
            }
        }
        let (part, after) = rest.split_at(at);
        parts.push(part);
        rest = after;
    }
    if !rest.is_empty() {
        parts.push(rest);
    }
    parts
}

fn is_continued(line: &[u8]) -> bool {
    line.strip_suffix(b"\r").unwrap_or(line).ends_with(b"\\")
}

/// The lines of a part, joined where they end with `\`.
struct Statements<'a> {
    lines: text::Lines<'a>,
}

impl<'a> Statements<'a> {
    /// The next statement and the number of its first line.
    #[inline]
    fn next(&mut self) -> Option<(u64, Cow<'a, [u8]>)> {
        let line = self.lines.next()?;
        let number = self.lines.number();
        // A comment may end with `\` by chance, as names of folders do.
        if line.ends_with(b"\\") && !line.trim_ascii_start().starts_with(b"#") {
            return Some((number, self.join(line)));
        }
        Some((number, Cow::Borrowed(line)))
    }

    fn join(&mut self, first: &[u8]) -> Cow<'a, [u8]> {
        let mut joined = Vec::new();
        let mut line = first;
        while let Some(open) = line.strip_suffix(b"\\") {
            joined.extend_from_slice(open);
            joined.push(b' ');
            line = self.lines.next().unwrap_or_default();
        }
        joined.extend_from_slice(line);
        Cow::Owned(joined)
    }
}

fn statements(part: &[u8], end: u8, lines_before: u64) -> Statements<'_> {
    Statements {
        lines: text::Lines::with_end(part, end, lines_before),
    }
}

/// Lines and vertices of a part.
fn count(part: &[u8], end: u8) -> (u64, u64) {
    let mut vertices = 0;
    let mut statements = statements(part, end, 0);
    while let Some((_, statement)) = statements.next() {
        vertices += u64::from(words(&statement).next() == Some(b"v"));
    }
    (statements.lines.number(), vertices)
}

/// What one part of the text holds.
#[derive(Default)]
struct Part {
    positions: Vec<Vec3>,
    /// Of all vertices of the part, or empty when none has a colour.
    colors: Vec<[f32; 4]>,
    faces: Polygons,
    segments: Vec<[u32; 2]>,
    points: Vec<u32>,
    notes: Notes,
}

/// What is counted for warnings; places are lines.
#[derive(Default)]
struct Notes {
    textures: Tally,
    normals: Tally,
    materials: Tally,
    others: Tally,
    extra: Tally,
    forward: Tally,
    weights: Tally,
    colored: Tally,
    bare: Tally,
    short_lines: Tally,
}

/// Where a statement stands.
#[derive(Clone, Copy)]
struct Place {
    line: u64,
    so_far: u64,
    total: u64,
}

impl Part {
    fn parse(
        text: &[u8],
        end: u8,
        lines_before: u64,
        vertices_before: u64,
        total: u64,
    ) -> Result<Part, Fault> {
        let mut part = Part::default();
        let mut indices = Vec::new();
        let mut statements = statements(text, end, lines_before);
        while let Some((line, statement)) = statements.next() {
            let mut words = words(&statement);
            let Some(keyword) = words.next() else {
                continue;
            };
            let place = Place {
                line,
                so_far: vertices_before + part.positions.len() as u64,
                total,
            };
            match keyword {
                b"v" => part.vertex(words, line)?,
                b"f" | b"fo" => {
                    part.indices("face", words, place, &mut indices)?;
                    part.faces.push(&indices);
                }
                b"l" => {
                    part.indices("line", words, place, &mut indices)?;
                    part.segments
                        .extend(indices.windows(2).map(|w| [w[0], w[1]]));
                    if indices.len() < 2 {
                        part.notes.short_lines.note(line);
                    }
                }
                b"p" => {
                    part.indices("point", words, place, &mut indices)?;
                    part.points.extend_from_slice(&indices);
                }
                b"vt" => part.notes.textures.note(line),
                b"vn" => part.notes.normals.note(line),
                b"usemtl" | b"mtllib" => part.notes.materials.note(line),
                b"o" | b"g" | b"s" => {}
                _ if keyword[0] == b'#' => {}
                _ => part.notes.others.note(line),
            }
        }
        Ok(part)
    }

    #[inline]
    fn vertex(&mut self, mut words: Words, line: u64) -> Result<(), Fault> {
        let mut position = text::triple(&mut words, line, "vertex")?;
        let mut rest = [0.0; 4];
        let mut count = 0;
        for word in words {
            if word[0] == b'#' {
                break;
            }
            if count < rest.len() {
                rest[count] = finite(word, line)?;
            }
            count += 1;
        }
        let [r, g, b, a] = rest.map(|c| c as f32);
        let color = match count {
            3 => Some([r, g, b, 1.0]),
            4 => Some([r, g, b, a]),
            _ => None,
        };
        if count == 1 && rest[0] != 1.0 {
            position = divided(position, rest[0], line)?;
            self.notes.weights.note(line);
        }
        if count == 2 || count > 4 {
            self.notes.extra.note(line);
        }
        self.color(color, line);
        self.positions.push(position);
        Ok(())
    }

    /// Notes the colour of the vertex about to be added.
    fn color(&mut self, color: Option<[f32; 4]>, line: u64) {
        match color {
            Some(color) => {
                self.notes.colored.note(line);
                self.colors.resize(self.positions.len(), WHITE);
                self.colors.push(color);
            }
            None => {
                self.notes.bare.note(line);
                if !self.colors.is_empty() {
                    self.colors.push(WHITE);
                }
            }
        }
    }

    #[inline]
    fn indices(
        &mut self,
        what: &str,
        words: Words,
        place: Place,
        indices: &mut Vec<u32>,
    ) -> Result<(), Fault> {
        indices.clear();
        for word in words {
            if word[0] == b'#' {
                break;
            }
            let (index, is_forward) = vertex_index(what, word, place)?;
            if is_forward {
                self.notes.forward.note(place.line);
            }
            indices.push(index);
        }
        Ok(())
    }
}

const WHITE: [f32; 4] = [1.0; 4];

fn divided(position: Vec3, w: f64, line: u64) -> Result<Vec3, Fault> {
    let divided = position.map(|c| c / w);
    if divided.iter().all(|c| c.is_finite()) {
        Ok(divided)
    } else {
        let [x, y, z] = position;
        Err(Fault::line(
            line,
            format!("vertex ({x}, {y}, {z}) divided by its weight {w} is not finite"),
        ))
    }
}

/// The vertex that a corner refers to, from 0, and whether it is defined only later.
#[inline]
fn vertex_index(what: &str, word: &[u8], place: Place) -> Result<(u32, bool), Fault> {
    let digits = match word.iter().position(|b| *b == b'/') {
        Some(slash) => &word[..slash],
        None => word,
    };
    let number = integer(digits).ok_or_else(|| {
        Fault::line(
            place.line,
            format!("{what} has the corner {}, which is no index", shown(word)),
        )
    })?;
    let index = if number < 0 {
        i128::from(place.so_far) + i128::from(number)
    } else {
        i128::from(number) - 1
    };
    if number == 0 {
        return Err(Fault::line(
            place.line,
            format!("{what} refers to vertex 0, but vertices count from 1"),
        ));
    }
    if index < 0 || index >= i128::from(place.total) {
        return Err(Fault::line(
            place.line,
            format!(
                "{what} refers to vertex {number}, but only {} are defined so far",
                place.so_far
            ),
        ));
    }
    // In range of `total`, which is known to fit.
    Ok((index as u32, index >= i128::from(place.so_far)))
}

fn merge(parts: &[Part], has_normals: bool, warnings: &mut Vec<Warning>) -> Result<Mesh, Fault> {
    let mut faces = Polygons::default();
    let corners = parts.iter().map(|p| p.faces.corners.len()).sum();
    let count: usize = parts.iter().map(|p| p.faces.len()).sum();
    faces.corners.reserve_exact(corners);
    faces.starts.reserve_exact(count + 1);
    faces.starts.push(0);
    let mut mesh = Mesh::default();
    mesh.positions
        .reserve_exact(parts.iter().map(|p| p.positions.len()).sum());
    for part in parts {
        mesh.positions.extend_from_slice(&part.positions);
        mesh.segments.extend_from_slice(&part.segments);
        mesh.points.extend_from_slice(&part.points);
        // Offsets that do not fit are refused by `set_faces`.
        let base = faces.corners.len() as u32;
        faces.starts.extend(
            part.faces
                .starts
                .iter()
                .skip(1)
                .map(|s| s.wrapping_add(base)),
        );
        faces.corners.extend_from_slice(&part.faces.corners);
    }
    if parts.iter().any(|p| !p.colors.is_empty()) {
        let mut colors = Vec::with_capacity(mesh.positions.len());
        let mut vertices = 0;
        for part in parts {
            vertices += part.positions.len();
            colors.extend_from_slice(&part.colors);
            colors.resize(vertices, WHITE);
        }
        mesh.colors = Some(colors);
    }
    set_faces(&mut mesh, faces, warnings)?;
    if mesh.is_empty() {
        mesh.points = (0..mesh.positions.len() as u32).collect();
    }
    warn(parts, has_normals, warnings);
    Ok(mesh)
}

fn warn(parts: &[Part], has_normals: bool, warnings: &mut Vec<Warning>) {
    let mut note = |field: fn(&Notes) -> Tally, code: &str, message: &str| {
        let mut sum = Tally::default();
        parts.iter().for_each(|p| sum.add(field(&p.notes)));
        sum.warn(code, message, warnings);
    };
    note(
        |n| n.textures,
        "ignored-texture-coordinates",
        "texture coordinates are not read",
    );
    if !has_normals {
        note(
            |n| n.normals,
            "ignored-normals",
            "normals of corners are not read",
        );
    }
    note(
        |n| n.materials,
        "ignored-materials",
        "materials and their libraries are not read",
    );
    note(
        |n| n.others,
        "ignored-statements",
        "a statement other than v, f, l, p; not read",
    );
    note(
        |n| n.extra,
        "extra-values",
        "a vertex has more numbers than a position, a weight or a colour; not read",
    );
    note(
        |n| n.weights,
        "weighted-vertices",
        "a vertex has a weight other than 1; divided by it",
    );
    note(
        |n| n.forward,
        "forward-references",
        "an index refers to a vertex that is defined only later",
    );
    note(
        |n| n.short_lines,
        "short-lines",
        "a line has fewer than two vertices; left out",
    );
    if parts.iter().any(|p| !p.notes.colored.is_empty()) {
        note(
            |n| n.bare,
            "missing-colours",
            "a vertex has no colour where others have; made white",
        );
    }
}

/// Writes vertices with their colours, faces as stored, segments and points.
///
/// Numbers are the shortest decimals that read back as the same 64-bit numbers. Normals are left
/// out. Points are listed only where vertices alone would not say it.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let mut text = b"# scantle\n".to_vec();
    let with_alpha = mesh
        .colors
        .as_ref()
        .is_some_and(|colors| colors.iter().any(|c| c[3] != 1.0));
    for (v, position) in mesh.positions.iter().enumerate() {
        text.push(b'v');
        for c in position {
            text.push(b' ');
            push_number(&mut text, *c);
        }
        if let Some(colors) = &mesh.colors {
            for c in &colors[v][..if with_alpha { 4 } else { 3 }] {
                text.push(b' ');
                push_number(&mut text, f64::from(*c));
            }
        }
        text.push(b'\n');
        spill(&mut text, out)?;
    }
    match &mesh.polygons {
        Some(polygons) => polygons
            .iter()
            .try_for_each(|face| statement(&mut text, b'f', face, out))?,
        None => mesh
            .triangles
            .iter()
            .try_for_each(|face| statement(&mut text, b'f', face, out))?,
    }
    for segment in &mesh.segments {
        statement(&mut text, b'l', segment, out)?;
    }
    if !mesh.is_cloud() {
        for point in &mesh.points {
            statement(&mut text, b'p', &[*point], out)?;
        }
    }
    out.write_all(&text)
}

fn statement(
    text: &mut Vec<u8>,
    keyword: u8,
    vertices: &[u32],
    out: &mut dyn Write,
) -> io::Result<()> {
    text.push(keyword);
    for v in vertices {
        write!(text, " {}", u64::from(*v) + 1)?;
    }
    text.push(b'\n');
    spill(text, out)
}
