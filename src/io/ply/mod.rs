//! Stanford PLY: ascii, and binary of both byte orders.
//!
//! Read are the elements `vertex` (positions, normals, colours), `face`, `tristrips`, `edge`
//! (segments) and `point` (vertices that stand alone beside faces: scantle's own). Everything else
//! is stepped over, with a counted warning. A file without faces and edges is a cloud of points.
//!
//! Binary vertices without lists, and binary faces that are all triangles of 32-bit indices, are
//! parsed straight from the mapped bytes on all threads; whatever else goes row by row.

mod faces;
mod header;
mod rows;
mod vertices;
mod write;

pub use write::write;

use crate::error::Fault;
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
        })
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
        const SHOWN: usize = 12;
        if !names.is_empty() {
            let more = if names.len() > SHOWN { ", ..." } else { "" };
            let list = names[..names.len().min(SHOWN)].join(", ");
            warnings.push(Warning::new(
                "ignored-properties",
                format!("properties that are not read: {list}{more}"),
                names.len() as u64,
                None,
            ));
        }
    }
}
