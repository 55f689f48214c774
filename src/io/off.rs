//! OFF, the Object File Format of Geomview, in its text form.
//!
//! The keyword is `OFF` after any of `ST` (texture coordinates, skipped), `C` (colours) and `N`
//! (normals); a file may do without it. Each vertex and each face is a line. Colours are 0 to 255
//! when any in the file exceeds 1, else 0 to 1. Colours of faces are left out with a counted
//! warning. A file of vertices alone is a cloud of points.

use super::text::{Lines, finite, integer, push_number, shown, spill, triple, words};
use crate::error::Fault;
use crate::io::source::Source;
use crate::mesh::polygon::set_faces;
use crate::mesh::{Mesh, Polygons};
use crate::report::{Tally, Warning};
use std::io::{self, Write};

/// What a vertex has beside its position.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Kind {
    texture: bool,
    colors: bool,
    normals: bool,
}

/// Reads vertices and faces.
///
/// # Errors
///
/// A file that ends before what its counts announce, a number that is none or is not finite, and
/// an index that is out of range, with the line; the binary form, and more than three dimensions.
///
/// # Cost
///
/// Linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Fault> {
    let mut lines = Lines::new(source.bytes());
    let (kind, counts) = read_header(&mut lines)?;
    let mut notes = Notes::default();
    let mut mesh = read_vertices(&mut lines, kind, counts.vertices, &mut notes)?;
    let faces = read_faces(&mut lines, counts, &mut notes)?;
    if mesh.positions.is_empty() {
        return Err(Fault::whole("holds no vertices"));
    }
    set_faces(&mut mesh, faces, warnings)?;
    if mesh.is_empty() {
        mesh.points = (0..mesh.positions.len() as u32).collect();
    }
    if lines.next_filled().is_some() {
        notes.after.note(lines.number());
    }
    notes.warn(warnings);
    Ok(mesh)
}

/// Whether a text starts with the keyword of an OFF file.
pub fn has_keyword(text: &[u8]) -> bool {
    words(text)
        .next()
        .is_some_and(|word| keyword(word).is_some())
}

/// The prefix of a keyword: what stands before `OFF`.
fn keyword(word: &[u8]) -> Option<&[u8]> {
    let mut prefix = word.strip_suffix(b"OFF")?;
    let whole = prefix;
    for part in [&b"ST"[..], b"C", b"N", b"4", b"n"] {
        prefix = prefix.strip_prefix(part).unwrap_or(prefix);
    }
    prefix.is_empty().then_some(whole)
}

/// Vertices and faces announced, and the line that says so.
#[derive(Debug, Clone, Copy)]
struct Counts {
    vertices: u64,
    faces: u64,
}

fn read_header(lines: &mut Lines) -> Result<(Kind, Counts), Fault> {
    let nothing = || Fault::whole("holds no counts of vertices and faces");
    let first = lines.next_filled().ok_or_else(nothing)?;
    let line = lines.number();
    let mut rest = words(first);
    let mut peeked = rest.clone();
    let word = peeked.next().unwrap_or_default();
    let mut kind = Kind::default();
    if let Some(prefix) = keyword(word) {
        rest = peeked;
        if prefix.ends_with(b"4") || prefix.ends_with(b"n") {
            return Err(Fault::line(
                line,
                format!(
                    "{} holds points of more than three dimensions",
                    String::from_utf8_lossy(word)
                ),
            ));
        }
        kind = Kind {
            texture: prefix.starts_with(b"ST"),
            colors: prefix.contains(&b'C'),
            normals: prefix.contains(&b'N'),
        };
    } else if integer(word).is_none() {
        return Err(Fault::line(
            line,
            format!(
                "expected the keyword OFF or the counts, found {}",
                shown(word)
            ),
        ));
    }
    if rest.clone().next() == Some(b"BINARY") {
        return Err(Fault::line(line, "binary OFF is not read")
            .with_hint("convert it to text with the program that made it, or to PLY"));
    }
    if rest.clone().next().is_none() {
        rest = words(lines.next_filled().ok_or_else(nothing)?);
    }
    let line = lines.number();
    let mut count = |what: &str| {
        let word = rest
            .next()
            .ok_or_else(|| Fault::line(line, format!("the count of {what} is missing")))?;
        integer(word)
            .and_then(|n| u64::try_from(n).ok())
            .ok_or_else(|| Fault::line(line, format!("{} is no count of {what}", shown(word))))
    };
    let counts = Counts {
        vertices: count("vertices")?,
        faces: count("faces")?,
    };
    Ok((kind, counts))
}

#[derive(Default)]
struct Notes {
    face_colors: Tally,
    textures: Tally,
    extra: Tally,
    after: Tally,
}

impl Notes {
    fn warn(self, warnings: &mut Vec<Warning>) {
        self.textures.warn(
            "ignored-texture-coordinates",
            "texture coordinates are not read",
            warnings,
        );
        self.face_colors.warn(
            "ignored-face-colours",
            "colours of faces are not read",
            warnings,
        );
        self.extra.warn(
            "extra-values",
            "a vertex has more numbers than its keyword asks for; not read",
            warnings,
        );
        self.after.warn(
            "trailing-lines",
            "lines follow the last face; not read",
            warnings,
        );
    }
}

fn ends_early(lines: &Lines, read: usize, count: u64, what: &str) -> Fault {
    Fault::line(
        lines.number(),
        format!("the file ends after {read} of {count} {what}"),
    )
}

/// Room for `count` rows of at least `bytes` bytes, but for no more than can still come.
fn capacity(lines: &Lines, count: u64, bytes: usize) -> usize {
    let most = lines.bytes_left() / bytes + 1;
    usize::try_from(count).map_or(most, |count| count.min(most))
}

fn read_vertices(
    lines: &mut Lines,
    kind: Kind,
    count: u64,
    notes: &mut Notes,
) -> Result<Mesh, Fault> {
    let room = capacity(lines, count, "0 0 0\n".len());
    let mut positions = Vec::with_capacity(room);
    let mut normals = Vec::with_capacity(if kind.normals { room } else { 0 });
    let mut colors = Vec::with_capacity(if kind.colors { room } else { 0 });
    while (positions.len() as u64) < count {
        let Some(text) = lines.next_filled() else {
            return Err(ends_early(lines, positions.len(), count, "vertices"));
        };
        let line = lines.number();
        let mut words = words(text);
        positions.push(triple(&mut words, line, "vertex")?);
        if kind.normals {
            normals.push(triple(&mut words, line, "normal")?);
        }
        let left = words.clone().count();
        let rest = left.saturating_sub(if kind.texture { 2 } else { 0 });
        if kind.colors {
            if !(3..=4).contains(&rest) {
                return Err(Fault::line(
                    line,
                    format!("colour has {rest} numbers, but 3 or 4 are needed"),
                ));
            }
            // NaN marks an alpha that is not given, until it is known what stands for opaque.
            let mut color = [0.0, 0.0, 0.0, f64::NAN];
            for (c, word) in color.iter_mut().zip(words.by_ref().take(rest)) {
                *c = finite(word, line)?;
            }
            colors.push(color);
        } else if rest > 0 {
            notes.extra.note(line);
        }
        if kind.texture {
            notes.textures.note(line);
        }
    }
    if u32::try_from(positions.len()).is_err() {
        return Err(Fault::whole(format!(
            "has {} vertices, but at most {} can be held",
            positions.len(),
            u32::MAX
        )));
    }
    Ok(Mesh {
        positions,
        normals: kind.normals.then_some(normals),
        colors: kind.colors.then(|| to_unit(&colors)),
        ..Mesh::default()
    })
}

/// Colours from 0 to 1, whichever way they are stored.
fn to_unit(colors: &[[f64; 4]]) -> Vec<[f32; 4]> {
    let scale = if colors.as_flattened().iter().any(|c| *c > 1.0) {
        255.0
    } else {
        1.0
    };
    let unit = |c: f64| {
        if c.is_nan() { 1.0 } else { (c / scale) as f32 }
    };
    colors.iter().map(|color| color.map(unit)).collect()
}

fn read_faces(lines: &mut Lines, counts: Counts, notes: &mut Notes) -> Result<Polygons, Fault> {
    let mut faces = Polygons::default();
    let room = capacity(lines, counts.faces, "0\n".len());
    // Most files are of triangles: "3 0 1 2\n".
    faces.starts.reserve(room.min(lines.bytes_left() / 8 + 2));
    let mut face = Vec::new();
    while (faces.len() as u64) < counts.faces {
        let Some(text) = lines.next_filled() else {
            return Err(ends_early(lines, faces.len(), counts.faces, "faces"));
        };
        let line = lines.number();
        let mut words = words(text);
        let word = words.next().unwrap_or_default();
        let corners = integer(word)
            .and_then(|n| u64::try_from(n).ok())
            .ok_or_else(|| Fault::line(line, format!("{} is no count of corners", shown(word))))?;
        face.clear();
        while (face.len() as u64) < corners {
            let Some(word) = words.next() else {
                return Err(Fault::line(
                    line,
                    format!("face has {} corners of {corners}", face.len()),
                ));
            };
            face.push(vertex_index(word, line, counts.vertices)?);
        }
        if words.next().is_some() {
            notes.face_colors.note(line);
        }
        faces.push(&face);
    }
    Ok(faces)
}

fn vertex_index(word: &[u8], line: u64, vertices: u64) -> Result<u32, Fault> {
    let index = integer(word).ok_or_else(|| {
        Fault::line(
            line,
            format!("face has the corner {}, which is no index", shown(word)),
        )
    })?;
    u32::try_from(index)
        .ok()
        .filter(|v| u64::from(*v) < vertices)
        .ok_or_else(|| {
            Fault::line(
                line,
                format!("face refers to vertex {index}, but there are {vertices}"),
            )
        })
}

/// Writes vertices and faces as stored; with colours as COFF, from 0 to 1.
///
/// Numbers are the shortest decimals that read back as the same 64-bit numbers. Normals, segments
/// and points beside faces are left out.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let keyword = if mesh.colors.is_some() { "COFF" } else { "OFF" };
    let mut text = Vec::new();
    writeln!(
        text,
        "{keyword}\n{} {} 0",
        mesh.positions.len(),
        mesh.face_count()
    )?;
    for (v, position) in mesh.positions.iter().enumerate() {
        for (axis, c) in position.iter().enumerate() {
            if axis > 0 {
                text.push(b' ');
            }
            push_number(&mut text, *c);
        }
        if let Some(colors) = &mesh.colors {
            for c in &colors[v] {
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
            .try_for_each(|face| write_face(&mut text, face, out))?,
        None => mesh
            .triangles
            .iter()
            .try_for_each(|face| write_face(&mut text, face, out))?,
    }
    out.write_all(&text)
}

fn write_face(text: &mut Vec<u8>, face: &[u32], out: &mut dyn Write) -> io::Result<()> {
    write!(text, "{}", face.len())?;
    for v in face {
        write!(text, " {v}")?;
    }
    text.push(b'\n');
    spill(text, out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::roundtrip::{self, Content};
    use proptest::prelude::*;

    fn read_text(text: &str) -> Result<(Mesh, Vec<Warning>), Fault> {
        let source = Source::from_bytes("test.off", text.into()).unwrap();
        let mut warnings = Vec::new();
        read(&source, &mut warnings).map(|mesh| (mesh, warnings))
    }

    fn message(text: &str) -> String {
        read_text(text).unwrap_err().to_string()
    }

    #[test]
    fn keywords_are_told() {
        for word in [
            "OFF",
            "COFF",
            "NOFF",
            "CNOFF",
            "STCNOFF",
            "4OFF",
            "STCN4nOFF",
        ] {
            assert!(has_keyword(format!("{word} 3 1 0\n").as_bytes()), "{word}");
        }
        for word in ["", "off", "NCOFF", "OFFICE", "XOFF"] {
            assert!(!has_keyword(word.as_bytes()), "{word}");
        }
    }

    #[test]
    fn counts_stand_on_either_line_or_alone() {
        let body = "0 0 0\n1 0 0\n\n# half way\n0 1 0 # last\n3 0 1 2\n";
        for head in ["OFF\n3 1 3\n", "OFF 3 1\n", "# made by hand\n\n3 1 0\n"] {
            let (mesh, warnings) = read_text(&format!("{head}{body}")).unwrap();
            assert_eq!(
                (mesh.positions.len(), &mesh.triangles[..]),
                (3, &[[0, 1, 2]][..])
            );
            assert!(warnings.is_empty());
        }
    }

    #[test]
    fn variants_have_colours_normals_and_texture_coordinates() {
        let (mesh, warnings) = read_text(
            "STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 51 255 .5 .5\n1 0 0 0 0 1 0 0 0 .5 .5\n\
             0 1 0 0 0 1 255 255 255 .5 .5\n3 0 1 2 255 0 0\n",
        )
        .unwrap();
        assert_eq!(mesh.normals.unwrap(), [[0.0, 0.0, 1.0]; 3]);
        let colors = [[1.0, 0.0, 0.2, 1.0], [0.0, 0.0, 0.0, 1.0], [1.0; 4]];
        assert_eq!(mesh.colors.unwrap(), colors);
        let codes: Vec<_> = warnings.iter().map(|w| (&*w.code, w.count)).collect();
        let expected = [
            ("ignored-texture-coordinates", 3),
            ("ignored-face-colours", 1),
        ];
        assert_eq!(codes, expected);
        let (mesh, _) = read_text("COFF 1 0 0\n1 2 3 0.5 1 0 0.25\n").unwrap();
        assert_eq!(mesh.colors.unwrap(), [[0.5, 1.0, 0.0, 0.25]]);
        assert_eq!(mesh.points, [0]);
    }

    #[test]
    fn faults_name_the_line_and_the_numbers() {
        assert_eq!(
            message("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
            "5: face refers to vertex 3, but there are 3"
        );
        assert_eq!(
            message("OFF 3 1 0\n0 0 0\n1 0 0\n"),
            "3: the file ends after 2 of 3 vertices"
        );
        assert_eq!(
            message("OFF 1152921504606846976 1 0\n0 0 0\n"),
            "2: the file ends after 1 of 1152921504606846976 vertices"
        );
        assert_eq!(
            message("OFF 1 1 0\n0 0 0\n4000000000 0 0\n"),
            "3: face has 2 corners of 4000000000"
        );
        assert_eq!(message("OFF BINARY\n"), "1: binary OFF is not read");
        assert_eq!(
            message("4OFF 1 0 0\n"),
            "1: 4OFF holds points of more than three dimensions"
        );
        assert_eq!(
            message("hello\n"),
            "1: expected the keyword OFF or the counts, found \"hello\""
        );
        assert_eq!(message("OFF -1 0 0\n"), "1: \"-1\" is no count of vertices");
    }

    proptest! {
        #[test]
        fn what_was_written_reads_back(mesh in roundtrip::mesh(Content {
            normals: false, classes: false, segments: false, points: false, ..Content::ALL
        })) {
            let mut bytes = Vec::new();
            write(&mesh, &mut bytes).unwrap();
            let (back, warnings) = read_text(&String::from_utf8(bytes).unwrap()).unwrap();
            prop_assert!(roundtrip::only_about_faces(&warnings), "{:?}", warnings);
            prop_assert_eq!(back, mesh);
        }

        #[test]
        fn no_text_makes_it_panic(text in "(ST)?C?N?(OFF)?\n?( ?[0-9]{0,2}){0,3}\n((-?[0-9.e]{0,4} ){0,8}\n){0,8}") {
            let _ = read_text(&text);
        }
    }
}
