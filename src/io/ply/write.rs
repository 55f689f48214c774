//! Writing: binary, little endian.

use crate::io::cloud::{is_of_bytes, to_byte};
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use std::io::{self, Write};

/// Bytes gathered before they are written.
const BUFFER: usize = 1 << 16;

/// Writes binary little-endian PLY: positions, normals, colours and classes; faces as stored, segments as
/// edges, and points where vertices alone would not say it.
///
/// Coordinates and normals are 32-bit numbers where all of them are exactly that, else 64-bit
/// ones; colours are bytes where all of them are whole 255ths, else 32-bit numbers. So nothing is
/// rounded. Alpha is left out where all is opaque.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let plan = Plan::new(mesh);
    out.write_all(plan.header(mesh).as_bytes())?;
    let mut out = Gathered {
        bytes: Vec::with_capacity(BUFFER + 256),
        out,
    };
    for (v, position) in mesh.positions.iter().enumerate() {
        out.vector(*position, plan.wide_positions);
        if let Some(normals) = &mesh.normals {
            out.vector(normals[v], plan.wide_normals);
        }
        if let Some(colors) = &mesh.colors {
            out.color(&colors[v][..plan.channels], plan.bytes);
        }
        if let Some(classes) = &mesh.classes {
            out.bytes.push(classes[v]);
        }
        out.spill()?;
    }
    match &mesh.polygons {
        Some(polygons) => polygons
            .iter()
            .try_for_each(|face| out.face(face, plan.long_faces))?,
        None => mesh
            .triangles
            .iter()
            .enumerate()
            .try_for_each(|(t, face)| {
                out.face(face, false)?;
                match &mesh.sides {
                    Some(sides) => out.indices(&sides[t].map(|s| s as u32)),
                    None => Ok(()),
                }
            })?,
    }
    for segment in &mesh.segments {
        out.indices(segment)?;
    }
    if plan.points {
        for point in &mesh.points {
            out.indices(&[*point])?;
        }
    }
    out.out.write_all(&out.bytes)
}

/// The types chosen.
struct Plan {
    wide_positions: bool,
    wide_normals: bool,
    bytes: bool,
    /// Of a colour: 3, or 4 with alpha.
    channels: usize,
    long_faces: bool,
    points: bool,
}

impl Plan {
    fn new(mesh: &Mesh) -> Plan {
        let colors = mesh.colors.as_deref().unwrap_or_default();
        Plan {
            wide_positions: is_wide(&mesh.positions),
            wide_normals: is_wide(mesh.normals.as_deref().unwrap_or_default()),
            bytes: is_of_bytes(colors.as_flattened()),
            channels: if colors.iter().all(|c| c[3] == 1.0) {
                3
            } else {
                4
            },
            long_faces: mesh
                .polygons
                .as_ref()
                .is_some_and(|polygons| polygons.iter().any(|face| face.len() > 255)),
            points: !mesh.points.is_empty() && !mesh.is_cloud(),
        }
    }

    fn header(&self, mesh: &Mesh) -> String {
        let mut lines = vec![
            "ply".to_owned(),
            "format binary_little_endian 1.0".to_owned(),
            "comment written by scantle".to_owned(),
            format!("element vertex {}", mesh.positions.len()),
        ];
        let mut add = |kind: &str, names: &[&str]| {
            lines.extend(names.iter().map(|name| format!("property {kind} {name}")));
        };
        let real = |wide: bool| if wide { "double" } else { "float" };
        add(real(self.wide_positions), &["x", "y", "z"]);
        if mesh.normals.is_some() {
            add(real(self.wide_normals), &["nx", "ny", "nz"]);
        }
        if mesh.colors.is_some() {
            let kind = if self.bytes { "uchar" } else { "float" };
            let names = ["red", "green", "blue", "alpha"];
            add(kind, &names[..self.channels]);
        }
        if mesh.classes.is_some() {
            add("uchar", &["classification"]);
        }
        // Indices of 31 bits are written as `int`, which every reader knows.
        let index = if i32::try_from(mesh.positions.len()).is_ok() {
            "int"
        } else {
            "uint"
        };
        if mesh.face_count() > 0 {
            let count = if self.long_faces { "uint" } else { "uchar" };
            lines.push(format!("element face {}", mesh.face_count()));
            lines.push(format!("property list {count} {index} vertex_indices"));
            if mesh.sides.is_some() && mesh.polygons.is_none() {
                lines.push("property int label".to_owned());
                lines.push("property int label_outside".to_owned());
            }
        }
        if !mesh.segments.is_empty() {
            lines.push(format!("element edge {}", mesh.segments.len()));
            lines.push(format!("property {index} vertex1"));
            lines.push(format!("property {index} vertex2"));
        }
        if self.points {
            lines.push(format!("element point {}", mesh.points.len()));
            lines.push(format!("property {index} vertex_index"));
        }
        lines.push("end_header\n".to_owned());
        lines.join("\n")
    }
}

/// Whether a coordinate is not exactly a 32-bit number.
fn is_wide(vectors: &[Vec3]) -> bool {
    vectors
        .as_flattened()
        .iter()
        .any(|c| f64::from(*c as f32) != *c)
}

struct Gathered<'o> {
    bytes: Vec<u8>,
    out: &'o mut dyn Write,
}

impl Gathered<'_> {
    fn vector(&mut self, v: Vec3, wide: bool) {
        for c in v {
            if wide {
                self.bytes.extend_from_slice(&c.to_le_bytes());
            } else {
                self.bytes.extend_from_slice(&(c as f32).to_le_bytes());
            }
        }
    }

    fn color(&mut self, channels: &[f32], bytes: bool) {
        for c in channels {
            if bytes {
                self.bytes.push(to_byte(*c));
            } else {
                self.bytes.extend_from_slice(&c.to_le_bytes());
            }
        }
    }

    fn face(&mut self, face: &[u32], long: bool) -> io::Result<()> {
        if long {
            self.bytes
                .extend_from_slice(&(face.len() as u32).to_le_bytes());
        } else {
            self.bytes.push(face.len() as u8);
        }
        self.indices(face)
    }

    fn indices(&mut self, indices: &[u32]) -> io::Result<()> {
        for v in indices {
            self.bytes.extend_from_slice(&v.to_le_bytes());
        }
        self.spill()
    }

    fn spill(&mut self) -> io::Result<()> {
        crate::io::text::spill(&mut self.bytes, self.out)
    }
}
