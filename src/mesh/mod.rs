//! Meshes: triangles, polylines and points over one list of vertices.

pub mod cloud;
pub mod distance;
pub mod identify;
pub mod polygon;
pub mod sampling;
pub mod shapes;
pub mod topology;
pub mod tracer;

use crate::error::{Error, Fault, Result};
use crate::numeric::vector::Vec3;
use crate::report::Content;
use crate::spatial::aabb::Aabb;
use rayon::prelude::*;

/// A mesh as a file holds it: nothing welded, reordered or repaired.
///
/// Vertex indices count from 0. Faces of more than three corners are kept in `polygons` and appear
/// in `triangles` as the triangles they were split into, in face order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, in the file's unit.
    pub positions: Vec<Vec3>,
    /// Triangles, counter-clockwise from outside where the file is oriented.
    pub triangles: Vec<[u32; 3]>,
    /// The faces as stored; `None` when every face is a triangle.
    pub polygons: Option<Polygons>,
    /// Segments of polylines.
    pub segments: Vec<[u32; 2]>,
    /// Vertices that stand for themselves (a point cloud; glTF or OBJ points).
    pub points: Vec<u32>,
    /// One unit normal per vertex.
    pub normals: Option<Vec<Vec3>>,
    /// The labels inside and outside of each triangle, for walls between bodies.
    pub sides: Option<Vec<[i32; 2]>>,
    /// One colour per vertex: red, green, blue, alpha from 0 to 1, as stored.
    pub colors: Option<Vec<[f32; 4]>>,
    /// One class per vertex, as LAS numbers them (2 is ground, 6 is a building).
    pub classes: Option<Vec<u8>>,
}

/// Faces of any number of corners: face `f` has corners `corners[starts[f]..starts[f + 1]]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polygons {
    /// Offsets into `corners`, one more than there are faces.
    pub starts: Vec<u32>,
    /// Vertex indices.
    pub corners: Vec<u32>,
}

impl Polygons {
    /// Number of faces.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there is no face.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The faces, each as its corners.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.starts
            .windows(2)
            .map(|w| &self.corners[w[0] as usize..w[1] as usize])
    }
}

impl Mesh {
    /// A mesh of triangles alone.
    pub fn from_triangles(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        Mesh {
            positions,
            triangles,
            ..Mesh::default()
        }
    }

    /// Adds the vertices and triangles of another mesh after those that are there, and nothing else of it.
    ///
    /// Errs with [`Error::Limit`] where there are 2^32 vertices or more together.
    pub fn append(&mut self, other: &Mesh) -> Result<()> {
        let first = self.positions.len();
        let vertices = first + other.positions.len();
        if u32::try_from(vertices).is_err() {
            return Err(Error::Limit {
                what: "meshes together".into(),
                needed: format!("{vertices} vertices"),
                limit: format!("{} vertices", u32::MAX),
                hint: None,
            });
        }
        self.positions.extend_from_slice(&other.positions);
        let moved = other.triangles.iter().map(|t| t.map(|v| v + first as u32));
        self.triangles.extend(moved);
        Ok(())
    }

    /// The triangles with only the vertices that they use, in their order.
    pub fn compacted(&self) -> Mesh {
        let mut number = vec![u32::MAX; self.positions.len()];
        for v in self.triangles.iter().flatten() {
            number[*v as usize] = 0;
        }
        let mut positions = Vec::new();
        for (v, number) in number.iter_mut().enumerate() {
            if *number == 0 {
                *number = positions.len() as u32;
                positions.push(self.positions[v]);
            }
        }
        let triangles = self.triangles.iter().map(|t| t.map(|v| number[v as usize]));
        Mesh::from_triangles(positions, triangles.collect())
    }

    /// Number of faces as stored.
    pub fn face_count(&self) -> usize {
        self.polygons
            .as_ref()
            .map_or(self.triangles.len(), Polygons::len)
    }

    /// The three corners of triangle `t`.
    #[inline]
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.triangles[t].map(|v| self.positions[v as usize])
    }

    /// The box around all vertices, as a file holds them; see [`Mesh::used_bounds`].
    pub fn bounds(&self) -> Aabb {
        self.positions
            .par_chunks(1 << 14)
            .map(Aabb::around)
            .reduce(|| Aabb::EMPTY, Aabb::union)
    }

    /// The box around the model: the vertices that triangles, segments and points use.
    ///
    /// Vertices that nothing refers to are kept and written, but are no part of the model. Cost: one
    /// pass over the elements.
    pub fn used_bounds(&self) -> Aabb {
        fn around<const N: usize>(positions: &[Vec3], elements: &[[u32; N]]) -> Aabb {
            let of = |part: &[[u32; N]]| {
                Aabb::around(part.iter().flatten().map(|v| &positions[*v as usize]))
            };
            elements
                .par_chunks(1 << 14)
                .map(of)
                .reduce(|| Aabb::EMPTY, Aabb::union)
        }
        around(&self.positions, &self.triangles)
            .union(around(&self.positions, &self.segments))
            .union(around(&self.positions, self.points.as_chunks::<1>().0))
    }

    /// For each vertex, whether a triangle, segment or point uses it.
    pub fn used_vertices(&self) -> Vec<bool> {
        let mut used = vec![false; self.positions.len()];
        let of_triangles = self.triangles.iter().flatten();
        let of_segments = self.segments.iter().flatten();
        for v in of_triangles.chain(of_segments).chain(&self.points) {
            used[*v as usize] = true;
        }
        used
    }

    /// Whether nothing in it has a place: no triangle, segment or point.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.segments.is_empty() && self.points.is_empty()
    }

    /// Whether it is a cloud: points alone, which are all the vertices in their order.
    pub fn is_cloud(&self) -> bool {
        self.face_count() == 0
            && self.segments.is_empty()
            && self.points.len() == self.positions.len()
            && self.points.iter().zip(0u32..).all(|(p, v)| *p == v)
    }

    /// What every reader promises: finite coordinates, normals and colours, indices in range,
    /// attributes of one length.
    pub fn check(&self) -> Result<(), Fault> {
        let bad = self
            .positions
            .par_iter()
            .position_first(|p| !p.iter().all(|c| c.is_finite()));
        if let Some(v) = bad {
            let [x, y, z] = self.positions[v];
            return Err(Fault::element(
                "vertex",
                v,
                format!("coordinates ({x}, {y}, {z}) are not finite"),
            ));
        }
        let count = self.positions.len();
        let out = |indices: &[u32]| indices.iter().copied().find(|v| *v as usize >= count);
        let refers = |kind, index, v| {
            Fault::element(
                kind,
                index,
                format!("refers to vertex {v}, but there are {count}"),
            )
        };
        if let Some(polygons) = &self.polygons
            && let Some((f, v)) = polygons
                .iter()
                .enumerate()
                .find_map(|(f, face)| out(face).map(|v| (f, v)))
        {
            return Err(refers("face", f, v));
        }
        let bad = self
            .triangles
            .par_iter()
            .position_first(|t| t.iter().any(|v| *v as usize >= count));
        if let Some(t) = bad {
            return Err(refers(
                "face",
                t,
                out(&self.triangles[t]).unwrap_or_default(),
            ));
        }
        if let Some((s, v)) = self
            .segments
            .iter()
            .enumerate()
            .find_map(|(s, seg)| out(seg).map(|v| (s, v)))
        {
            return Err(refers("segment", s, v));
        }
        if let Some((p, v)) = self
            .points
            .iter()
            .enumerate()
            .find_map(|(p, v)| out(&[*v]).map(|v| (p, v)))
        {
            return Err(refers("point", p, v));
        }
        let normals = self.normals.as_ref().map(Vec::len);
        let colors = self.colors.as_ref().map(Vec::len);
        let classes = self.classes.as_ref().map(Vec::len);
        let attributes = [
            ("normals", normals),
            ("colours", colors),
            ("classes", classes),
        ];
        for (what, length) in attributes {
            if let Some(length) = length.filter(|length| *length != count) {
                return Err(Fault::whole(format!(
                    "{length} {what} for {count} vertices"
                )));
            }
        }
        self.check_attributes()
    }

    fn check_attributes(&self) -> Result<(), Fault> {
        let normals = self.normals.as_deref().unwrap_or_default();
        let bad = normals
            .par_iter()
            .position_first(|n| !n.iter().all(|c| c.is_finite()));
        if let Some(v) = bad {
            let [x, y, z] = normals[v];
            let problem = format!("normal ({x}, {y}, {z}) is not finite");
            return Err(Fault::element("vertex", v, problem));
        }
        let colors = self.colors.as_deref().unwrap_or_default();
        let bad = colors
            .par_iter()
            .position_first(|n| !n.iter().all(|c| c.is_finite()));
        if let Some(v) = bad {
            let [r, g, b, a] = colors[v];
            let problem = format!("colour ({r}, {g}, {b}, {a}) is not finite");
            return Err(Fault::element("vertex", v, problem));
        }
        Ok(())
    }

    /// Counts and bounds for a report.
    pub fn content(&self) -> Content {
        let bounds = self.bounds();
        let some = |n: usize| (n > 0).then_some(n as u64);
        Content {
            vertices: Some(self.positions.len() as u64),
            faces: Some(self.face_count() as u64),
            triangles: Some(self.triangles.len() as u64),
            segments: some(self.segments.len()),
            points: some(self.points.len()),
            bounds: (!bounds.is_empty()).then_some([bounds.lo, bounds.hi]),
            ..Content::default()
        }
    }
}
