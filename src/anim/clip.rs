//! A sequence of frames of one mesh.

use crate::error::Fault;
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use crate::report::Content;
use crate::spatial::aabb::Aabb;
use rayon::prelude::*;

/// A mesh of fixed faces whose vertices move from frame to frame, nothing reordered.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clip {
    /// The mesh at its first frame; a cloud where no faces are known.
    pub mesh: Mesh,
    /// Positions of all vertices at all frames: vertex `v` of frame `f` is
    /// `positions[f * vertices + v]`, in the file's unit.
    pub positions: Vec<Vec3>,
    /// Time of the first frame, in seconds.
    pub start: f64,
    /// Frames per second.
    pub rate: f64,
}

impl Clip {
    /// Frames per second where a file names none.
    pub const DEFAULT_RATE: f64 = 24.0;

    /// A clip of points alone: `vertices` of them in each frame, all in `positions`, of which the
    /// first frame makes the mesh. Fewer positions than that make a clip without vertices.
    pub fn cloud(vertices: usize, positions: Vec<Vec3>, start: f64, rate: f64) -> Clip {
        let first = positions.get(..vertices).unwrap_or_default().to_vec();
        let mesh = Mesh {
            points: (0..first.len() as u32).collect(),
            positions: first,
            ..Mesh::default()
        };
        Clip {
            mesh,
            positions,
            start,
            rate,
        }
    }

    /// The clip with the faces, polylines, labels and colours of a mesh, vertex for vertex.
    ///
    /// The positions stay the clip's; normals come along only where the mesh is its very first frame.
    /// Errs where the two do not have the same number of vertices.
    pub fn with_base(self, base: Mesh) -> Result<Clip, Fault> {
        let (vertices, others) = (self.vertices(), base.positions.len());
        if vertices != others {
            let problem =
                format!("the animation has {vertices} vertices, but its base mesh {others}");
            return Err(Fault::whole(problem));
        }
        let first = self.mesh.positions;
        let normals = base.normals.filter(|_| base.positions == first);
        let mesh = Mesh {
            positions: first,
            normals,
            ..base
        };
        Ok(Clip { mesh, ..self })
    }

    /// Vertices of every frame.
    pub fn vertices(&self) -> usize {
        self.mesh.positions.len()
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        match self.vertices() {
            0 => 0,
            vertices => self.positions.len() / vertices,
        }
    }

    /// The positions at frame `f`.
    pub fn frame(&self, f: usize) -> &[Vec3] {
        let vertices = self.vertices();
        &self.positions[f * vertices..(f + 1) * vertices]
    }

    /// The mesh at frame `f`; normals are left out but for the first frame.
    pub fn mesh_at(&self, f: usize) -> Mesh {
        let normals = match f {
            0 => self.mesh.normals.clone(),
            _ => None,
        };
        Mesh {
            positions: self.frame(f).to_vec(),
            triangles: self.mesh.triangles.clone(),
            polygons: self.mesh.polygons.clone(),
            segments: self.mesh.segments.clone(),
            points: self.mesh.points.clone(),
            sides: self.mesh.sides.clone(),
            colors: self.mesh.colors.clone(),
            classes: self.mesh.classes.clone(),
            normals,
        }
    }

    /// The box around all vertices at all frames.
    pub fn bounds(&self) -> Aabb {
        self.positions
            .par_chunks(1 << 14)
            .map(Aabb::around)
            .reduce(|| Aabb::EMPTY, Aabb::union)
    }

    /// What every reader promises: a sound mesh, whole frames, finite coordinates, a rate above 0.
    ///
    /// A coordinate that is not finite is named by its frame and vertex.
    pub fn check(&self) -> Result<(), Fault> {
        let vertices = self.vertices();
        if vertices == 0 || self.positions.is_empty() {
            return Err(Fault::whole("holds no vertices or no frames"));
        }
        if !self.positions.len().is_multiple_of(vertices) {
            let problem = format!(
                "{} positions are no whole number of frames of {vertices} vertices",
                self.positions.len()
            );
            return Err(Fault::whole(problem));
        }
        let finite = |p: &Vec3| p.iter().all(|c| c.is_finite());
        if let Some(at) = self.positions.par_iter().position_first(|p| !finite(p)) {
            let [x, y, z] = self.positions[at];
            let problem = format!(
                "vertex {}: coordinates ({x}, {y}, {z}) are not finite",
                at % vertices
            );
            return Err(Fault::element("frame", at / vertices, problem));
        }
        if !(self.rate.is_finite() && self.rate > 0.0 && self.start.is_finite()) {
            let problem = format!(
                "starts at {} s with {} frames per second",
                self.start, self.rate
            );
            return Err(Fault::whole(problem));
        }
        self.mesh.check()
    }

    /// Counts and bounds for a report.
    pub fn content(&self) -> Content {
        let bounds = self.bounds();
        Content {
            frames: Some(self.frames() as u64),
            rate: Some(self.rate),
            bounds: (!bounds.is_empty()).then_some([bounds.lo, bounds.hi]),
            ..self.mesh.content()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_gives_faces_to_its_own_number_of_vertices() {
        let at = |z: f64| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        let positions = [at(0.0), at(1.0)].concat();
        let clip = Clip::cloud(3, positions, 0.0, 24.0);
        assert_eq!((clip.frames(), clip.mesh.points.len()), (2, 3));
        let mut base = Mesh::from_triangles(at(5.0).to_vec(), vec![[0, 1, 2]]);
        base.normals = Some(vec![[0.0, 0.0, 1.0]; 3]);
        let faced = clip.clone().with_base(base.clone()).expect("three each");
        assert_eq!(faced.mesh.triangles, base.triangles);
        assert_eq!(faced.mesh.positions, at(0.0));
        assert!(faced.mesh.points.is_empty() && faced.mesh.normals.is_none());
        assert_eq!(faced.mesh_at(1).positions, at(1.0));
        faced.check().expect("a sound clip");
        base.positions.push([0.0; 3]);
        let fault = clip.with_base(base).expect_err("three and four");
        assert_eq!(
            fault.problem,
            "the animation has 3 vertices, but its base mesh 4"
        );
    }
}
