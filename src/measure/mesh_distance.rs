//! How far two meshes are from each other.

use super::hausdorff::{self, Bounds, Reached, Stop};
use super::surface::{Elements, Hit, Surface};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::topology::{Topology, topology};
use crate::numeric::sums::sum_by;
use crate::numeric::vector::Vec3;
use crate::progress::Progress;
use crate::report::Accuracy;
use crate::spatial::local::LocalFrame;
use schemars::JsonSchema;
use serde::Serialize;

pub use super::surface::Kind;

/// How closely two meshes are compared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// Points spread over each surface by area, for mean and root mean square (besides all
    /// vertices, for the largest distance).
    pub samples: u64,
    /// Which points they are.
    pub seed: u64,
    /// The largest distance is bounded until the bound is no more than this share of the diagonal
    /// of both meshes' common box over the distance reached.
    pub gap: f64,
    /// At most so many pieces of triangles are split for that, in each direction; a bound that is
    /// still wider is reported as it stands. Two fine meshes of one surface need about ten per
    /// triangle.
    pub pieces: u64,
}

impl Params {
    /// A hundred thousand samples; bounds to a ten thousandth of the diagonal, in some seconds.
    pub const DEFAULT: Params = Params {
        samples: 100_000,
        seed: 0,
        gap: 1e-4,
        pieces: 200_000,
    };

    /// Errors when a value is out of its range.
    pub fn check(&self) -> Result<()> {
        if !(1..=1 << 32).contains(&self.samples) {
            return Err(Error::parameter(
                "samples",
                self.samples,
                "must be from 1 to 4294967296",
            ));
        }
        if !(1e-12..=1.0).contains(&self.gap) {
            return Err(Error::parameter("gap", self.gap, "must be from 1e-12 to 1"));
        }
        if self.pieces > 1 << 32 {
            return Err(Error::parameter(
                "pieces",
                self.pieces,
                "must be at most 4294967296",
            ));
        }
        Ok(())
    }
}

impl Default for Params {
    fn default() -> Self {
        Params::DEFAULT
    }
}

/// How two meshes differ. Lengths are in the files' unit, areas and volumes in its powers.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MeshDifference {
    /// Whether vertices, faces, segments and points are the same, in the same order, bit for bit.
    /// Distances are not measured then: they are 0.
    pub identical: bool,
    /// The first mesh.
    pub a: MeshFigures,
    /// The second mesh.
    pub b: MeshFigures,
    /// Diagonal of the box around both.
    pub diagonal: f64,
    /// From the first mesh to the second.
    pub a_to_b: Directed,
    /// From the second mesh to the first.
    pub b_to_a: Directed,
    /// The Hausdorff distance as far as it was reached: the larger of both `max`.
    pub hausdorff: f64,
    /// The Hausdorff distance is not larger than this.
    pub hausdorff_bound: f64,
    /// Mean distance over the samples of both directions.
    pub mean: f64,
    /// Root mean square distance over the samples of both directions.
    pub rms: f64,
    /// `(area b - area a) / area a`; null where a has no area.
    pub area_difference: Option<f64>,
    /// `(volume b - volume a) / volume a`; null where a mesh encloses no volume.
    pub volume_difference: Option<f64>,
}

/// One of the meshes compared.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MeshFigures {
    /// Vertices as stored.
    pub vertices: u64,
    /// Faces as stored.
    pub faces: u64,
    /// Triangles after faces of more corners are split.
    pub triangles: u64,
    /// What of the mesh distances are measured from and to.
    pub measured: Kind,
    /// Whether every edge has two triangles.
    pub closed: bool,
    /// Area of the triangles; null where it overflows.
    pub area: Option<f64>,
    /// Volume enclosed; null unless every edge is used as often in one direction as in the other.
    pub volume: Option<f64>,
    /// Smallest and largest coordinates: `[[x, y, z], [x, y, z]]`.
    pub bounds: Option<[[f64; 3]; 2]>,
}

/// Distances from one mesh to the other.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Directed {
    /// The largest distance reached.
    pub max: f64,
    /// No point of the surface is farther than this.
    pub max_bound: f64,
    /// Where on the first surface the largest distance is reached; null for identical meshes.
    pub max_at: Option<[f64; 3]>,
    /// The point of the other surface nearest to that.
    pub max_nearest: Option<[f64; 3]>,
    /// Mean over the samples.
    pub mean: f64,
    /// Root mean square over the samples.
    pub rms: f64,
    /// Samples measured: points spread evenly over the surface, or its vertices where it has no
    /// extent.
    pub samples: u64,
    /// Vertices measured.
    pub vertices: u64,
    /// Pieces split to bound the largest distance.
    pub pieces: u64,
}

impl MeshDifference {
    /// The Hausdorff distance, as the accuracy of a report.
    pub fn accuracy(&self) -> Accuracy {
        Accuracy {
            measure: "hausdorff distance".to_owned(),
            unit: "file unit".to_owned(),
            bound: Some(self.hausdorff_bound),
            reached: Some(self.hausdorff),
            reference: "exact closest points of all vertices and samples; bound by branch and bound over the triangles".to_owned(),
            verified: true,
        }
    }
}

/// Measures how far two meshes are from each other, in both directions.
///
/// Distances are to the exact closest point of the other mesh. Errors when a mesh has no vertices
/// or is not what [`Mesh::check`] promises. Cost: O((n + samples) log n) and what the bound needs,
/// up to `pieces` searches; about 400 bytes per triangle.
pub fn compare(
    a: &Mesh,
    b: &Mesh,
    params: &Params,
    progress: &dyn Progress,
) -> Result<MeshDifference> {
    params.check()?;
    let elements = [Elements::of(a, "A")?, Elements::of(b, "B")?];
    let bounds = elements[0].bounds(a).union(elements[1].bounds(b));
    let frame = LocalFrame::around(bounds);
    let [kind_a, kind_b] = [elements[0].kind, elements[1].kind];
    let identical = is_identical(a, b);
    let (a_to_b, b_to_a) = if identical {
        let none = || Measured::nothing(&frame);
        (none(), none())
    } else {
        progress.stage("index", 0);
        let [of_a, of_b] = elements;
        let from_a = Surface::new(a, of_a, &frame);
        let from_b = Surface::new(b, of_b, &frame);
        let corners = [bounds.lo, bounds.hi].map(|p| frame.to_local(p));
        let diagonal =
            crate::numeric::vector::length(crate::numeric::vector::sub(corners[1], corners[0]));
        let stop = Stop {
            gap: params.gap * diagonal,
            pieces: params.pieces,
        };
        let one_way = |from, to| Measured::between(from, to, params, stop, &frame, progress);
        (one_way(&from_a, &from_b), one_way(&from_b, &from_a))
    };
    let a = MeshFigures::new(a, kind_a, &topology(a, progress)?);
    let b = MeshFigures::new(b, kind_b, &topology(b, progress)?);
    Ok(summary(
        identical,
        [a, b],
        bounds.diagonal(),
        [a_to_b, b_to_a],
    ))
}

fn summary(
    identical: bool,
    [a, b]: [MeshFigures; 2],
    diagonal: f64,
    [a_to_b, b_to_a]: [Measured; 2],
) -> MeshDifference {
    let relative = |a: f64, b: f64| (a != 0.0).then_some((b - a) / a);
    let count = (a_to_b.directed.samples + b_to_a.directed.samples).max(1) as f64;
    let length = |local: f64| a_to_b.frame.length(local);
    MeshDifference {
        identical,
        diagonal,
        hausdorff: a_to_b.directed.max.max(b_to_a.directed.max),
        hausdorff_bound: a_to_b.directed.max_bound.max(b_to_a.directed.max_bound),
        mean: length((a_to_b.sum + b_to_a.sum) / count),
        rms: length(((a_to_b.squares + b_to_a.squares) / count).sqrt()),
        area_difference: a.area.zip(b.area).and_then(|(a, b)| relative(a, b)),
        volume_difference: a.volume.zip(b.volume).and_then(|(a, b)| relative(a, b)),
        a,
        b,
        a_to_b: a_to_b.directed,
        b_to_a: b_to_a.directed,
    }
}

impl MeshFigures {
    fn new(mesh: &Mesh, measured: Kind, topology: &Topology) -> Self {
        MeshFigures {
            vertices: mesh.positions.len() as u64,
            faces: mesh.face_count() as u64,
            triangles: mesh.triangles.len() as u64,
            measured,
            closed: topology.closed,
            area: topology.area,
            volume: topology.volume,
            bounds: topology.bounds,
        }
    }
}

fn is_identical(a: &Mesh, b: &Mesh) -> bool {
    let bits = |p: &Vec3| p.map(f64::to_bits);
    a.positions.len() == b.positions.len()
        && a.triangles == b.triangles
        && a.polygons == b.polygons
        && a.segments == b.segments
        && a.points == b.points
        && a.positions
            .iter()
            .map(bits)
            .eq(b.positions.iter().map(bits))
}

/// One direction, with the local sums that both are pooled from.
struct Measured {
    directed: Directed,
    sum: f64,
    squares: f64,
    frame: LocalFrame,
}

impl Measured {
    fn nothing(frame: &LocalFrame) -> Self {
        Measured {
            directed: Directed {
                max: 0.0,
                max_bound: 0.0,
                max_at: None,
                max_nearest: None,
                mean: 0.0,
                rms: 0.0,
                samples: 0,
                vertices: 0,
                pieces: 0,
            },
            sum: 0.0,
            squares: 0.0,
            frame: *frame,
        }
    }

    fn between(
        from: &Surface,
        to: &Surface,
        params: &Params,
        stop: Stop,
        frame: &LocalFrame,
        progress: &dyn Progress,
    ) -> Self {
        progress.stage("sample", 0);
        let vertex_hits = to.nearest_of(&from.vertices, |(_, p)| *p);
        let samples = from.samples(params.samples, params.seed);
        let sample_hits = to.nearest_of(&samples, |p| *p);
        let vertices = from.vertices.iter().map(|(_, p)| *p);
        let all = vertices
            .zip(&vertex_hits)
            .chain(samples.iter().copied().zip(&sample_hits));
        let reached = farthest(all);
        progress.stage("bound", 0);
        let bounds = hausdorff::bound(from, to, &vertex_hits, reached, stop, progress);
        let counted = if samples.is_empty() {
            &vertex_hits
        } else {
            &sample_hits
        };
        Measured::new(to, &bounds, counted, vertex_hits.len(), frame)
    }

    fn new(
        to: &Surface,
        bounds: &Bounds,
        hits: &[Hit],
        vertices: usize,
        frame: &LocalFrame,
    ) -> Self {
        let sum = sum_by(hits, |hit| hit.distance);
        let squares = sum_by(hits, |hit| hit.distance * hit.distance);
        let count = hits.len().max(1) as f64;
        let Reached { point, hit } = bounds.reached;
        Measured {
            directed: Directed {
                max: frame.length(hit.distance),
                max_bound: frame.length(bounds.upper),
                max_at: Some(frame.from_local(point)),
                max_nearest: Some(frame.from_local(to.closest_on(hit.element, point).point)),
                mean: frame.length(sum / count),
                rms: frame.length((squares / count).sqrt()),
                samples: hits.len() as u64,
                vertices: vertices as u64,
                pieces: bounds.pieces,
            },
            sum,
            squares,
            frame: *frame,
        }
    }
}

/// The point of largest distance, the first of equals.
fn farthest<'a>(points: impl Iterator<Item = (Vec3, &'a Hit)>) -> Reached {
    let mut best = Reached {
        point: [0.0; 3],
        hit: Hit {
            element: 0,
            distance: -1.0,
        },
    };
    for (point, hit) in points {
        if hit.distance > best.hit.distance {
            best = Reached { point, hit: *hit };
        }
    }
    best
}

#[cfg(test)]
mod tests;
