//! Writing a mesh as a GLB file.

use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, sub};
use crate::spatial::aabb::Aabb;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::io::{self, Write};

/// Elements coded at a time.
const CHUNK: usize = 1 << 14;

/// Writes a mesh as one node: triangles, lines and points as primitives over the same vertices,
/// with normals and colours where the mesh has them.
///
/// glTF holds coordinates in single precision. Where that would lose bits and the mesh is farther
/// from the origin than it is wide, the node is moved instead: its translation is the middle of the
/// mesh, and the vertices are relative to it. A reader that applies the node in double precision
/// gets the coordinates back to 2^-24 of the distance from the middle; one that holds it in single
/// precision sees the mesh moved as a whole, by 2^-24 of the distance from the origin. Coordinates
/// beyond single precision (3.4e38) are an error, as is a file of 4 GiB or more. Faces of more than
/// three corners are written as the triangles they were split into. A mesh without a triangle,
/// line or point is an empty scene, whatever vertices it has: glTF has no primitive for them.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let centre = local_origin(&mesh.positions, mesh.bounds());
    let parts = Parts::of(mesh, centre)?;
    container(&parts.document(centre), parts.length, out, |out| {
        write_binary(mesh, centre, out)
    })
}

/// Writes a GLB file of a document and so many bytes of binary data, a multiple of 4.
pub fn container(
    document: &Value,
    binary: u128,
    out: &mut dyn Write,
    write_binary: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut json = serde_json::to_vec(document)?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let chunk = if binary > 0 { 8 + binary } else { 0 };
    let total = 12 + 8 + json.len() as u128 + chunk;
    let total = u32::try_from(total).map_err(|_| {
        invalid(format!(
            "a GLB file holds less than 4 GiB, and this mesh takes {total} bytes"
        ))
    })?;
    out.write_all(b"glTF")?;
    out.write_all(&2u32.to_le_bytes())?;
    out.write_all(&total.to_le_bytes())?;
    out.write_all(&(json.len() as u32).to_le_bytes())?;
    out.write_all(b"JSON")?;
    out.write_all(&json)?;
    if binary > 0 {
        out.write_all(&(binary as u32).to_le_bytes())?;
        out.write_all(b"BIN\0")?;
        write_binary(out)?;
    }
    Ok(())
}

/// An error of what the format cannot hold.
pub fn invalid(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}

/// What is subtracted from the vertices and added by the node; zero where that gains nothing.
pub fn local_origin(positions: &[Vec3], bounds: Aabb) -> Vec3 {
    let exact = |p: &Vec3| p.iter().all(|c| f64::from(*c as f32) == *c);
    if bounds.is_empty() || positions.par_iter().all(exact) {
        return [0.0; 3];
    }
    let (centre, extent) = (bounds.centre(), bounds.extent());
    if (0..3).any(|a| centre[a].abs() > extent[a]) {
        centre
    } else {
        [0.0; 3]
    }
}

/// A position as it is written.
pub fn single(p: Vec3, centre: Vec3) -> [f32; 3] {
    sub(p, centre).map(|c| c as f32)
}

/// How the binary chunk is laid out; all parts are multiples of 4 bytes long.
pub struct Parts {
    /// The number of elements of each part that is there, in the order of the file.
    sections: Vec<Section>,
    /// Bytes of all.
    pub length: u128,
    min: [f32; 3],
    max: [f32; 3],
}

struct Section {
    name: &'static str,
    count: usize,
    bytes: u128,
}

impl Parts {
    /// The parts of a mesh that is moved by `centre` to the origin.
    pub fn of(mesh: &Mesh, centre: Vec3) -> io::Result<Parts> {
        let vertices = mesh.positions.len();
        let lists = [
            ("POSITION", vertices, 12),
            ("NORMAL", mesh.normals.as_ref().map_or(0, Vec::len), 12),
            ("COLOR_0", mesh.colors.as_ref().map_or(0, Vec::len), 16),
            ("triangles", 3 * mesh.triangles.len(), 4),
            ("lines", 2 * mesh.segments.len(), 4),
            ("points", mesh.points.len(), 4),
        ];
        let sections: Vec<Section> = lists
            .into_iter()
            .filter(|(_, count, _)| *count > 0 && !mesh.is_empty())
            .map(|(name, count, size)| Section {
                name,
                count,
                bytes: count as u128 * size,
            })
            .collect();
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for (v, p) in mesh.positions.iter().enumerate() {
            let p = single(*p, centre);
            if !p.iter().all(|c| c.is_finite()) {
                let [x, y, z] = mesh.positions[v];
                return Err(invalid(format!(
                    "vertex {v} at ({x}, {y}, {z}) is beyond single precision, which glTF holds"
                )));
            }
            for a in 0..3 {
                min[a] = min[a].min(p[a]);
                max[a] = max[a].max(p[a]);
            }
        }
        let length = sections.iter().map(|s| s.bytes).sum();
        Ok(Parts {
            sections,
            length,
            min,
            max,
        })
    }

    /// The JSON chunk.
    pub fn document(&self, centre: Vec3) -> Value {
        let asset = json!({ "version": "2.0", "generator": "scantle" });
        if self.sections.is_empty() {
            return json!({ "asset": asset, "scene": 0, "scenes": [{}] });
        }
        let (mut accessors, mut views) = (Vec::new(), Vec::new());
        let (mut attributes, mut primitives) = (serde_json::Map::new(), Vec::new());
        let mut offset = 0u64;
        for (index, section) in self.sections.iter().enumerate() {
            let vertex = |kind: &str| json!({ "bufferView": index, "componentType": 5126, "count": section.count, "type": kind });
            let (accessor, mode) = match section.name {
                "POSITION" => {
                    let mut accessor = vertex("VEC3");
                    accessor["min"] = json!(self.min.map(f64::from));
                    accessor["max"] = json!(self.max.map(f64::from));
                    (accessor, None)
                }
                "NORMAL" => (vertex("VEC3"), None),
                "COLOR_0" => (vertex("VEC4"), None),
                name => {
                    let mode = match name {
                        "triangles" => 4,
                        "lines" => 1,
                        _ => 0,
                    };
                    (
                        json!({ "bufferView": index, "componentType": 5125, "count": section.count, "type": "SCALAR" }),
                        Some(mode),
                    )
                }
            };
            accessors.push(accessor);
            let target = if mode.is_some() { 34963 } else { 34962 };
            views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": section.bytes as u64, "target": target }));
            offset += section.bytes as u64;
            match mode {
                Some(mode) => primitives
                    .push(json!({ "attributes": attributes, "indices": index, "mode": mode })),
                None => {
                    attributes.insert(section.name.to_owned(), json!(index));
                }
            }
        }
        let mut node = json!({ "mesh": 0 });
        if centre != [0.0; 3] {
            node["translation"] = json!(centre);
        }
        json!({
            "asset": asset,
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [node],
            "meshes": [{ "primitives": primitives }],
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{ "byteLength": self.length as u64 }],
        })
    }
}

/// The binary chunk: the sections in their order.
pub fn write_binary(mesh: &Mesh, centre: Vec3, out: &mut dyn Write) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(CHUNK * 16);
    let floats = |bytes: &mut Vec<u8>, values: &[f32]| {
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    };
    for chunk in mesh.positions.chunks(CHUNK) {
        bytes.clear();
        chunk
            .iter()
            .for_each(|p| floats(&mut bytes, &single(*p, centre)));
        out.write_all(&bytes)?;
    }
    for chunk in mesh.normals.as_deref().unwrap_or_default().chunks(CHUNK) {
        bytes.clear();
        chunk
            .iter()
            .for_each(|n| floats(&mut bytes, &n.map(|c| c as f32)));
        out.write_all(&bytes)?;
    }
    for chunk in mesh.colors.as_deref().unwrap_or_default().chunks(CHUNK) {
        bytes.clear();
        chunk.iter().for_each(|c| floats(&mut bytes, c));
        out.write_all(&bytes)?;
    }
    let lists = [
        mesh.triangles.as_flattened(),
        mesh.segments.as_flattened(),
        &mesh.points,
    ];
    for chunk in lists.into_iter().flat_map(|list| list.chunks(CHUNK)) {
        bytes.clear();
        bytes.extend(chunk.iter().flat_map(|i| i.to_le_bytes()));
        out.write_all(&bytes)?;
    }
    Ok(())
}
