//! STL, binary and ascii.
//!
//! Many binary files start with `solid` as ascii ones do, so a file is binary when its length is
//! the 84 + 50 n bytes that its count n asks for, and otherwise when it does not look like text.
//! Triangles are kept as they are stored: three vertices each, none shared. Normals and attribute
//! bytes are not read: the corners' order says which side is out.

use super::text::{Lines, shown, triple, words};
use crate::error::Fault;
use crate::io::source::Source;
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, cross, normalize};
use crate::report::Warning;
use rayon::prelude::*;
use std::io::{self, Write};

/// Bytes before the count of triangles.
const HEADER: usize = 80;
/// Bytes before the first triangle.
const START: usize = HEADER + 4;
/// Bytes of a triangle: normal, three corners, two attribute bytes.
const RECORD: usize = 50;
/// Triangles that one task reads, or that are gathered before they are written.
const TASK: usize = 1 << 13;

/// Reads triangles, three vertices each.
///
/// # Errors
///
/// A binary file that ends before the triangles it announces, with how many there are; in an ascii
/// file a word out of place or a number that is none or not finite, with the line; no triangles.
///
/// # Cost
///
/// Linear in the bytes; binary files on all threads.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Fault> {
    let bytes = source.bytes();
    let positions = if !is_binary(bytes) && is_text(bytes) {
        read_ascii(bytes, warnings)?
    } else if !is_binary(bytes) && is_other_text(bytes) {
        let start = bytes.trim_ascii_start();
        let first = shown(
            start
                .split(|b| *b == b'\n')
                .next()
                .unwrap_or(start)
                .trim_ascii_end(),
        );
        let problem =
            format!("is text that begins with {first}, where ascii STL begins with \"solid\"");
        return Err(Fault::whole(problem).with_hint("name its format with --input-format"));
    } else {
        read_binary(bytes, warnings)?
    };
    let count = positions.len() / 3;
    if count == 0 {
        return Err(Fault::whole("holds no triangles"));
    }
    if u32::try_from(positions.len()).is_err() {
        return Err(Fault::whole(format!(
            "has {count} triangles, but at most {} can be held",
            u32::MAX / 3
        )));
    }
    let triangles = (0..count as u32)
        .into_par_iter()
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    Ok(Mesh::from_triangles(positions, triangles))
}

/// Whether the length is what binary STL asks for: 84 bytes and 50 for each triangle announced.
pub fn is_binary(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|count| bytes.len() as u64 == START as u64 + RECORD as u64 * count)
}

/// The count of triangles in the header, where there is one.
fn announced(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER..START)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(count)))
}

/// Whether it starts with `solid` and goes on without the control bytes that text does not have.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    start.len() >= 5
        && start[..5].eq_ignore_ascii_case(b"solid")
        && !start.iter().take(1024).any(|b| *b < b'\t')
}

/// Whether the header of a binary file would be text with more than one line: nobody's header.
fn is_other_text(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(START)];
    let is_text = |b: &u8| matches!(b, b'\t' | b'\n' | b'\r' | b' '..=b'~');
    start.contains(&b'\n') && start.iter().all(is_text)
}

fn read_binary(bytes: &[u8], warnings: &mut Vec<Warning>) -> Result<Vec<Vec3>, Fault> {
    let Some(count) = announced(bytes) else {
        return Err(Fault::byte(
            bytes.len(),
            format!("the file ends within the {START} bytes of a binary header"),
        )
        .with_hint("an ascii file starts with: solid"));
    };
    let records = &bytes[START..];
    let whole = (records.len() / RECORD) as u64;
    if whole < count {
        return Err(Fault::byte(
            bytes.len(),
            format!("the file ends after {whole} of {count} triangles"),
        ));
    }
    // No more than the bytes hold, so it fits.
    let records = &records[..count as usize * RECORD];
    let trailing = bytes.len() - START - records.len();
    if trailing > 0 {
        warnings.push(Warning::new(
            "trailing-bytes",
            "bytes follow the last triangle; not read",
            trailing as u64,
            None,
        ));
    }
    let mut positions = vec![[0.0; 3]; 3 * count as usize];
    positions
        .par_chunks_mut(3 * TASK)
        .zip(records.par_chunks(RECORD * TASK))
        .for_each(|(positions, records)| {
            for (corners, record) in positions
                .chunks_exact_mut(3)
                .zip(records.chunks_exact(RECORD))
            {
                for (corner, bytes) in corners.iter_mut().zip(record[12..48].chunks_exact(12)) {
                    *corner = [0, 4, 8].map(|at| {
                        let c = [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
                        f64::from(f32::from_le_bytes(c))
                    });
                }
            }
        });
    if let Some(corner) = positions
        .par_iter()
        .position_first(|p| !p.iter().all(|c| c.is_finite()))
    {
        let [x, y, z] = positions[corner];
        return Err(Fault::element(
            "triangle",
            corner / 3,
            format!("corner ({x}, {y}, {z}) is not finite"),
        ));
    }
    Ok(positions)
}

/// What an ascii file may say next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Expected {
    Solid,
    FacetOrEnd,
    Loop,
    VertexOrEnd,
    EndFacet,
}

impl Expected {
    fn words(self) -> &'static str {
        match self {
            Expected::Solid => "solid",
            Expected::FacetOrEnd => "facet or endsolid",
            Expected::Loop => "outer loop",
            Expected::VertexOrEnd => "vertex or endloop",
            Expected::EndFacet => "endfacet",
        }
    }
}

fn read_ascii(bytes: &[u8], warnings: &mut Vec<Warning>) -> Result<Vec<Vec3>, Fault> {
    let mut lines = Lines::new(bytes);
    let mut positions: Vec<Vec3> = Vec::new();
    let mut expected = Expected::Solid;
    let mut facets = 0usize;
    while let Some(text) = lines.next() {
        let line = lines.number();
        let mut words = words(text);
        let Some(keyword) = words.next() else {
            continue;
        };
        let is = |name: &str| keyword.eq_ignore_ascii_case(name.as_bytes());
        expected = match expected {
            Expected::VertexOrEnd if is("vertex") => {
                positions.push(triple(&mut words, line, "vertex")?);
                Expected::VertexOrEnd
            }
            Expected::VertexOrEnd if is("endloop") => {
                check_loop(positions.len() - 3 * facets, facets, line)?;
                facets += 1;
                Expected::EndFacet
            }
            Expected::FacetOrEnd if is("facet") => Expected::Loop,
            Expected::Loop if is("outer") => Expected::VertexOrEnd,
            Expected::EndFacet if is("endfacet") => Expected::FacetOrEnd,
            Expected::FacetOrEnd if is("endsolid") => Expected::Solid,
            Expected::Solid if is("solid") => Expected::FacetOrEnd,
            _ => {
                return Err(Fault::line(
                    line,
                    format!("expected {}, found {}", expected.words(), shown(keyword)),
                ));
            }
        };
    }
    match expected {
        Expected::Solid => {}
        Expected::FacetOrEnd => warnings.push(Warning::new(
            "missing-endsolid",
            "the file ends without endsolid",
            1,
            Some(lines.number()),
        )),
        _ => {
            return Err(Fault::line(
                lines.number(),
                format!(
                    "the file ends after {facets} whole facets, where {} is expected",
                    expected.words()
                ),
            ));
        }
    }
    Ok(positions)
}

/// Every loop before this one had three vertices, so the rest are its own.
fn check_loop(corners: usize, facet: usize, line: u64) -> Result<(), Fault> {
    if corners == 3 {
        Ok(())
    } else {
        Err(Fault::line(
            line,
            format!("facet {facet} has {corners} vertices, but 3 are needed"),
        ))
    }
}

/// Writes binary STL: each triangle with its unit normal (zero where it has no area) and its
/// corners, rounded to 32-bit numbers.
///
/// # Errors
///
/// When there are 2^32 triangles or more, or a coordinate beyond what 32-bit numbers hold.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let refused = |problem: String| io::Error::new(io::ErrorKind::InvalidInput, problem);
    let count = u32::try_from(mesh.triangles.len())
        .map_err(|_| refused("STL counts triangles with 32 bits".into()))?;
    let mut header = [0; HEADER];
    let about = b"binary STL written by scantle";
    header[..about.len()].copy_from_slice(about);
    out.write_all(&header)?;
    out.write_all(&count.to_le_bytes())?;
    let mut records = Vec::with_capacity(RECORD * TASK.min(mesh.triangles.len()));
    for triangles in mesh.triangles.chunks(TASK) {
        records.clear();
        for triangle in triangles {
            let corners = triangle.map(|v| mesh.positions[v as usize].map(|c| c as f32));
            for (corner, v) in corners.iter().zip(triangle) {
                if !corner.iter().all(|c| c.is_finite()) {
                    return Err(refused(format!(
                        "vertex {v} is beyond the 32-bit numbers that STL holds"
                    )));
                }
            }
            let normal = facet_normal(corners.map(|p| p.map(f64::from)));
            for c in normal
                .map(|c| c as f32)
                .iter()
                .chain(corners.as_flattened())
            {
                records.extend_from_slice(&c.to_le_bytes());
            }
            records.extend_from_slice(&[0, 0]);
        }
        out.write_all(&records)?;
    }
    Ok(())
}

/// The unit normal of a triangle, zero where it has no area. The corners come from 32-bit numbers,
/// so that no product of two differences leaves the range of 64-bit ones.
fn facet_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let along = |p: Vec3, q: Vec3| [0, 1, 2].map(|i| q[i] - p[i]);
    normalize(cross(along(a, b), along(a, c)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read_bytes(bytes: &[u8]) -> Result<(Mesh, Vec<Warning>), Fault> {
        let source = Source::from_bytes("test.stl", bytes.to_vec()).unwrap();
        let mut warnings = Vec::new();
        read(&source, &mut warnings).map(|mesh| (mesh, warnings))
    }

    fn tetrahedron() -> Mesh {
        Mesh::from_triangles(
            vec![
                [0.0, 0.0, 0.0],
                [1.5, 0.0, 0.0],
                [0.0, 2.0, 0.0],
                [0.0, 0.0, 4.0],
            ],
            vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        )
    }

    fn written(mesh: &Mesh) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(mesh, &mut bytes).unwrap();
        bytes
    }

    fn soup(mesh: &Mesh) -> Vec<[Vec3; 3]> {
        (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect()
    }

    #[test]
    fn text_of_another_kind_is_named_as_such() {
        let obj = format!("# a cube\n{}", "v 0.0 0.0 0.0\n".repeat(20));
        let source = Source::from_bytes("cube.stl", obj.into_bytes()).expect("no gzip layer");
        let fault = read(&source, &mut Vec::new()).expect_err("no STL");
        assert_eq!(
            fault.problem,
            "is text that begins with \"# a cube\", where ascii STL begins with \"solid\""
        );
    }

    #[test]
    fn what_was_written_reads_back_as_triangles_of_their_own() {
        let mesh = tetrahedron();
        let bytes = written(&mesh);
        assert!(is_binary(&bytes) && !bytes.starts_with(b"solid"));
        let (back, warnings) = read_bytes(&bytes).unwrap();
        assert!(warnings.is_empty());
        assert_eq!(back.positions.len(), 12);
        assert_eq!(soup(&back), soup(&mesh));
        let normal =
            [84, 88, 92].map(|at| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
        assert_eq!(normal, [0.0, 0.0, -1.0]);
    }

    #[test]
    fn a_binary_file_may_start_with_solid() {
        let mut bytes = written(&tetrahedron());
        bytes[..80].fill(b' ');
        bytes[..5].copy_from_slice(b"solid");
        assert_eq!(read_bytes(&bytes).unwrap().0.triangles.len(), 4);
        // Told by its control bytes where the length does not tell.
        bytes.extend_from_slice(b"more");
        let (mesh, warnings) = read_bytes(&bytes).unwrap();
        assert_eq!(mesh.triangles.len(), 4);
        assert_eq!(
            (&*warnings[0].code, warnings[0].count),
            ("trailing-bytes", 4)
        );
    }

    #[test]
    fn a_binary_file_cut_short_says_how_much_is_there() {
        let bytes = written(&tetrahedron());
        let message = |n: usize| read_bytes(&bytes[..n]).unwrap_err().to_string();
        assert_eq!(
            message(283),
            "byte 283: the file ends after 3 of 4 triangles"
        );
        assert_eq!(
            message(50),
            "byte 50: the file ends within the 84 bytes of a binary header"
        );
    }

    #[test]
    fn ascii_files_hold_several_solids() {
        let facet = "facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1e0 0 0\n vertex 0 1 .5\n endloop\nendfacet\n";
        let text = format!(
            "solid a b\n{facet}endsolid a b\n\nSOLID\r\n{}{facet}",
            facet.to_uppercase()
        );
        let (mesh, warnings) = read_bytes(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
        assert_eq!(mesh.positions[8], [0.0, 1.0, 0.5]);
        assert_eq!(warnings[0].code, "missing-endsolid");
    }

    #[test]
    fn normals_are_one_long_at_every_size() {
        for size in [1e-40f64, 1e-20, 1.0, 1e20, 1e38] {
            let corners = [[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]];
            let n = facet_normal(corners.map(|p| p.map(|c| f64::from(c as f32))));
            assert!((n[2] - 1.0).abs() < 1e-12, "{size}: {n:?}");
        }
        assert_eq!(facet_normal([[1.0; 3]; 3]), [0.0; 3]);
    }

    #[test]
    fn what_32_bits_do_not_hold_is_refused() {
        let mut mesh = tetrahedron();
        mesh.positions[2][1] = 1e39;
        let error = write(&mesh, &mut Vec::new()).unwrap_err().to_string();
        assert_eq!(
            error,
            "vertex 2 is beyond the 32-bit numbers that STL holds"
        );
    }

    proptest! {
        #[test]
        fn coordinates_of_32_bits_survive(values in prop::collection::vec(prop::array::uniform9(-1e38f32..1e38), 1..50)) {
            let positions: Vec<Vec3> = values
                .iter()
                .flat_map(|t| [0, 3, 6].map(|i| [t[i], t[i + 1], t[i + 2]].map(f64::from)))
                .collect();
            let triangles = (0..values.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let mesh = Mesh::from_triangles(positions, triangles);
            prop_assert_eq!(read_bytes(&written(&mesh)).unwrap().0, mesh);
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), prefix in "(solid\n)?(facet\n)?(outer loop\n)?(vertex 1 2 3\n){0,4}") {
            let _ = read_bytes(&[prefix.as_bytes(), &bytes].concat());
        }
    }
}
