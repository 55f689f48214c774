//! Stanford PLY: ascii, and binary of both byte orders.
//!
//! Read are the elements `vertex` (positions, normals, colours, classes), `face`, `tristrips`, `edge`
//! (segments) and `point` (vertices that stand alone beside faces: scantle's own). Everything else
//! is stepped over, with a counted warning. A file without faces and edges is a cloud of points.
//!
//! Binary vertices without lists, and binary faces that are all triangles of 32-bit indices, are
//! parsed straight from the mapped bytes on all threads; whatever else goes row by row.

mod faces;
mod header;
mod rows;
mod table;
mod vertices;
mod write;

pub use table::{Table, table, vertex_properties};
pub use write::write;

use crate::error::Fault;
use crate::io::cloud;
use crate::io::source::Source;
use crate::mesh::polygon::set_faces;
use crate::mesh::{Mesh, Polygons};
use crate::report::Warning;
use header::{Element, Encoding, Header};
use rows::{Ascii, Binary, Rows};
use vertices::Layout;

/// Rows that one task parses.
const TASK: usize = 1 << 13;

/// Reads vertices, faces, triangle strips, edges and points.
///
/// # Errors
///
/// A header that is not one, with the line; a file that ends before the rows it announces, with
/// the byte or line and how many there are; a number that is none or is not finite; an index that
/// is out of range.
///
/// # Cost
///
/// Linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Fault> {
    let bytes = source.bytes();
    let header = Header::parse(bytes)?;
    let mut reader = Reader::new(&header)?;
    reader.keeps_bad = source.skips_bad() && reader.is_cloud();
    let rest = match header.encoding {
        Encoding::Ascii => {
            let mut rows = Ascii::new(&bytes[header.data..], header.lines);
            reader.elements(&mut rows)?;
            rows.finish(warnings);
            0
        }
        Encoding::Little => reader.binary::<false>(bytes)?,
        Encoding::Big => reader.binary::<true>(bytes)?,
    };
    if rest > 0 {
        warnings.push(Warning::new(
            "trailing-bytes",
            "bytes follow the last element; not read",
            rest as u64,
            None,
        ));
    }
    reader.finish(warnings)
}

/// What is read while going through the elements.
struct Reader<'h> {
    header: &'h Header,
    layout: Layout,
    /// As announced; the element may stand after those that refer to it.
    vertices: u64,
    mesh: Mesh,
    /// Faces, when they were read as triangles all at once.
    triangles: Vec<[u32; 3]>,
    /// Faces, when they were read one by one.
    faces: Polygons,
    /// Classes as they stand in the file.
    classes: Vec<f64>,
    /// Whether vertices with a number that is not finite are left to who asked for them.
    keeps_bad: bool,
}

impl<'h> Reader<'h> {
    fn new(header: &'h Header) -> Result<Self, Fault> {
        let is_vertex = |e: &&Element| e.name == "vertex";
        let vertex =
            header.elements.iter().find(is_vertex).ok_or_else(|| {
                Fault::line(header.lines, "the header announces no vertex element")
            })?;
        Ok(Reader {
            header,
            layout: Layout::new(vertex)?,
            vertices: vertex.count,
            mesh: Mesh::default(),
            triangles: Vec::new(),
            faces: Polygons::default(),
            classes: Vec::new(),
            keeps_bad: false,
        })
    }

    /// Whether no element refers to the vertices.
    fn is_cloud(&self) -> bool {
        let refers = |element: &Element| element.name != "vertex" && self.is_read(element);
        let mut elements = self.header.elements.iter();
        !elements.any(|element| refers(element) && element.count > 0)
    }

    /// All elements, row by row.
    fn elements(&mut self, rows: &mut impl Rows) -> Result<(), Fault> {
        self.header
            .elements
            .iter()
            .try_for_each(|element| self.element(element, rows))
    }

    /// All elements of a binary file; returns how many bytes follow them.
    fn binary<const BIG: bool>(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let mut rows = Binary::<BIG>::new(bytes, self.header.data);
        for element in &self.header.elements {
            let done = match element.name.as_str() {
                "vertex" => self.vertex_block(element, &mut rows)?,
                "face" => self.triangle_block(element, &mut rows),
                _ => match element.stride() {
                    Some(stride @ 1..) if !self.is_read(element) => {
                        rows.block(element, stride)?;
                        true
                    }
                    _ => false,
                },
            };
            if !done {
                self.element(element, &mut rows)?;
            }
        }
        Ok(rows.rest().len())
    }

    fn is_read(&self, element: &Element) -> bool {
        ["vertex", "face", "tristrips", "edge", "point"].contains(&element.name.as_str())
    }

    fn element(&mut self, element: &Element, rows: &mut impl Rows) -> Result<(), Fault> {
        rows.begin(element);
        match element.name.as_str() {
            "vertex" => self.vertex_rows(element, rows),
            "face" => self.face_rows(element, rows),
            "tristrips" => self.strip_rows(element, rows),
            "edge" => self.edge_rows(element, rows),
            "point" => self.point_rows(element, rows),
            _ => rows::skip(element, rows),
        }
    }

    /// The mesh, and warnings about what was not read.
    fn finish(mut self, warnings: &mut Vec<Warning>) -> Result<Mesh, Fault> {
        if self.mesh.positions.is_empty() {
            return Err(Fault::whole("holds no vertices"));
        }
        self.warn_of_ignored(warnings);
        if self.layout.classes {
            self.mesh.classes = cloud::classes(&self.classes, warnings);
        }
        if self.faces.is_empty() {
            self.mesh.triangles = self.triangles;
        } else {
            set_faces(&mut self.mesh, self.faces, warnings)?;
        }
        if self.mesh.is_empty() {
            self.mesh.points = (0..self.mesh.positions.len() as u32).collect();
        }
        Ok(self.mesh)
    }

    fn warn_of_ignored(&self, warnings: &mut Vec<Warning>) {
        let mut names = Vec::new();
        for element in self.header.elements.iter().filter(|e| e.count > 0) {
            let read: Vec<usize> = match element.name.as_str() {
                "vertex" => (0..element.properties.len())
                    .filter(|p| self.layout.slots[*p].is_some())
                    .collect(),
                "face" | "tristrips" => faces::list_of(element).into_iter().collect(),
                "edge" => faces::columns_of(element, ["vertex1", "vertex2"])
                    .map_or(Vec::new(), |columns| columns.to_vec()),
                "point" => faces::columns_of(element, ["vertex_index"])
                    .map_or(Vec::new(), |columns| columns.to_vec()),
                _ => Vec::new(),
            };
            let others = element.properties.iter().enumerate();
            names.extend(
                others
                    .filter(|(at, _)| !read.contains(at))
                    .map(|(_, p)| format!("{}.{}", element.name, p.name)),
            );
        }
        cloud::warn_of_ignored(&names, warnings);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::roundtrip::{self, Content};
    use proptest::prelude::*;

    fn read_bytes(bytes: &[u8]) -> Result<(Mesh, Vec<Warning>), Fault> {
        let source = Source::from_bytes("test.ply", bytes.to_vec()).unwrap();
        let mut warnings = Vec::new();
        read(&source, &mut warnings).map(|mesh| (mesh, warnings))
    }

    fn message(bytes: &[u8]) -> String {
        read_bytes(bytes).unwrap_err().to_string()
    }

    /// One small mesh with lists among its vertex and face properties, in any encoding.
    fn rich(format: &str) -> Vec<u8> {
        let mut bytes = format!(
            "ply\nformat {format} 1.0\ncomment one of everything\nobj_info none\n\
             element camera 2\nproperty list ushort double view\nproperty char id\n\
             element vertex 4\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
             property list uchar short history\nproperty double x\nproperty int y\nproperty short z\n\
             element nothing 1152921504606846976\n\
             element face 2\nproperty float quality\nproperty list ushort uchar vertex_index\n\
             property uchar flag\n\
             element tristrips 1\nproperty list int int vertex_indices\n\
             element edge 1\nproperty uint vertex1\nproperty uchar vertex2\nproperty float weight\n\
             end_header\n"
        )
        .into_bytes();
        let rows: &[&[(&str, f64)]] = &[
            &[("u16", 2.0), ("f64", 0.1), ("f64", -7.0), ("i8", -1.0)],
            &[("u16", 0.0), ("i8", 3.0)],
            &[
                ("u8", 255.0),
                ("u8", 0.0),
                ("u8", 51.0),
                ("u8", 0.0),
                ("f64", 0.1),
                ("i32", 0.0),
                ("i16", 0.0),
            ],
            &[
                ("u8", 0.0),
                ("u8", 0.0),
                ("u8", 0.0),
                ("u8", 1.0),
                ("i16", -300.0),
                ("f64", 1.0),
                ("i32", 0.0),
                ("i16", 0.0),
            ],
            &[
                ("u8", 0.0),
                ("u8", 0.0),
                ("u8", 0.0),
                ("u8", 0.0),
                ("f64", 1.0),
                ("i32", 70000.0),
                ("i16", 0.0),
            ],
            &[
                ("u8", 0.0),
                ("u8", 0.0),
                ("u8", 0.0),
                ("u8", 0.0),
                ("f64", 0.0),
                ("i32", 1.0),
                ("i16", -2.0),
            ],
            &[
                ("f32", 0.5),
                ("u16", 3.0),
                ("u8", 0.0),
                ("u8", 1.0),
                ("u8", 2.0),
                ("u8", 9.0),
            ],
            &[
                ("f32", 0.5),
                ("u16", 4.0),
                ("u8", 0.0),
                ("u8", 1.0),
                ("u8", 2.0),
                ("u8", 3.0),
                ("u8", 9.0),
            ],
            &[
                ("i32", 8.0),
                ("i32", 0.0),
                ("i32", 1.0),
                ("i32", 2.0),
                ("i32", 3.0),
                ("i32", -1.0),
                ("i32", 3.0),
                ("i32", 2.0),
                ("i32", 1.0),
            ],
            &[("u32", 3.0), ("u8", 1.0), ("f32", 1.5)],
        ];
        let big = format == "binary_big_endian";
        for row in rows {
            for (kind, value) in *row {
                macro_rules! put {
                    ($type:ty) => {{
                        let value = *value as $type;
                        bytes.extend_from_slice(&if big {
                            value.to_be_bytes()
                        } else {
                            value.to_le_bytes()
                        });
                    }};
                }
                match (format, *kind) {
                    ("ascii", _) => bytes.extend_from_slice(format!("{value} ").as_bytes()),
                    (_, "i8") => put!(i8),
                    (_, "u8") => put!(u8),
                    (_, "i16") => put!(i16),
                    (_, "u16") => put!(u16),
                    (_, "i32") => put!(i32),
                    (_, "u32") => put!(u32),
                    (_, "f32") => put!(f32),
                    _ => put!(f64),
                }
            }
            if format == "ascii" {
                bytes.extend_from_slice(b"\n");
            }
        }
        bytes
    }

    #[test]
    fn every_encoding_holds_the_same() {
        let (mesh, warnings) = read_bytes(&rich("ascii")).unwrap();
        assert_eq!(mesh.positions[2], [1.0, 70000.0, 0.0]);
        assert_eq!(mesh.colors.as_ref().unwrap()[0], [1.0, 0.0, 0.2, 1.0]);
        let faces: Vec<_> = mesh.polygons.as_ref().unwrap().iter().collect();
        let expected: [&[u32]; 5] = [
            &[0, 1, 2],
            &[0, 1, 2, 3],
            &[0, 1, 2],
            &[2, 1, 3],
            &[3, 2, 1],
        ];
        assert_eq!(faces, expected);
        assert_eq!(mesh.segments, [[3, 1]]);
        assert!(mesh.points.is_empty());
        assert_eq!(
            warnings[0].message,
            "properties that are not read: camera.view, camera.id, vertex.history, face.quality, \
             face.flag, edge.weight"
        );
        for format in ["binary_little_endian", "binary_big_endian"] {
            assert_eq!(
                read_bytes(&rich(format)).unwrap(),
                (mesh.clone(), warnings.clone())
            );
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_refused_and_says_how_much_is_there() {
        for format in ["binary_little_endian", "binary_big_endian"] {
            let bytes = rich(format);
            for length in 0..bytes.len() {
                assert!(read_bytes(&bytes[..length]).is_err(), "{length}");
            }
            let end = bytes.len() - 1;
            let expected = format!("byte {end}: the file ends after 0 of 1 edges");
            assert_eq!(message(&bytes[..end]), expected);
        }
    }

    #[test]
    fn blocks_and_rows_give_the_same() {
        let mut mesh = Mesh {
            positions: (0..30_000)
                .map(|i| [f64::from(i), f64::from(i % 13), 0.5])
                .collect(),
            triangles: (0..29_998).map(|i| [i, i + 1, i + 2]).collect(),
            ..Mesh::default()
        };
        let written = |mesh: &Mesh| {
            let mut bytes = Vec::new();
            write(mesh, &mut bytes).unwrap();
            bytes
        };
        assert_eq!(read_bytes(&written(&mesh)).unwrap().0, mesh);
        // One index out of range sends all of it to the rows, which name the face.
        mesh.triangles[20_000][1] = 30_000;
        let expected = "face 20000: refers to vertex 30000, but there are 30000";
        assert_eq!(message(&written(&mesh)), expected);
        mesh.triangles[20_000][1] = u32::MAX;
        let expected = "face 20000: refers to vertex -1, but there are 30000";
        assert_eq!(message(&written(&mesh)), expected);
    }

    #[test]
    fn headers_that_claim_too_much_are_refused() {
        let header = |format: &str, count: u64| {
            format!(
                "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
            )
        };
        let many = 1 << 60;
        let text = header("ascii", many) + "0 0 0\n";
        let expected = "8: the file ends after 1 of 1152921504606846976 vertices";
        assert_eq!(message(text.as_bytes()), expected);
        let text = header("binary_little_endian", many) + "0123456789ab0123";
        let expected = format!(
            "byte {}: the file ends after 1 of 1152921504606846976 vertices",
            text.len()
        );
        assert_eq!(message(text.as_bytes()), expected);
    }

    #[test]
    fn lines_of_the_header_end_in_every_usual_way() {
        let text = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\nend_header\n";
        for end in ["\n", "\r\n", "\r"] {
            let mut bytes = text.replace('\n', end).into_bytes();
            bytes.extend_from_slice(b"\n\r\n");
            let (mesh, warnings) = read_bytes(&bytes).unwrap();
            assert_eq!(mesh.positions, [[10.0, 13.0, 10.0]]);
            assert_eq!(mesh.points, [0]);
            assert!(warnings.is_empty());
        }
    }

    #[test]
    fn faces_of_many_corners_are_written() {
        let ring = (0..300).map(|i| f64::from(i) / 300.0 * std::f64::consts::TAU);
        let mut mesh = Mesh {
            positions: ring.map(|a| [a.cos(), a.sin(), 0.0]).collect(),
            ..Mesh::default()
        };
        let mut faces = Polygons::default();
        faces.push(&(0..300).collect::<Vec<_>>());
        set_faces(&mut mesh, faces, &mut Vec::new()).unwrap();
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        assert_eq!(read_bytes(&bytes).unwrap().0, mesh);
    }

    proptest! {
        #[test]
        fn what_was_written_reads_back(mesh in roundtrip::mesh(Content::ALL)) {
            let mut bytes = Vec::new();
            write(&mesh, &mut bytes).unwrap();
            let (back, warnings) = read_bytes(&bytes).unwrap();
            prop_assert!(roundtrip::only_about_faces(&warnings), "{:?}", warnings);
            prop_assert_eq!(back, mesh);
        }

        #[test]
        fn no_bytes_make_it_panic(
            format in "ascii|binary_little_endian|binary_big_endian",
            at in 0..900usize,
            change in prop::collection::vec(any::<u8>(), 1..4),
        ) {
            let mut bytes = rich(&format);
            let at = at % bytes.len();
            for (old, new) in bytes[at..].iter_mut().zip(change) {
                *old = new;
            }
            let _ = read_bytes(&bytes);
        }
    }
}
