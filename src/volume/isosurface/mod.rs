//! Marching cubes: the surface between what is inside of a volume and what is outside.
//!
//! Voxels are points at their centres, and eight neighbours are the corners of a cell. A vertex lies
//! on each edge between a voxel inside and one outside: halfway where the volume is binary, where the
//! level is met by linear interpolation where it holds amounts. The polygons of a cell are those of
//! [`cases`]: the surface is closed and manifold, whatever the voxels are, but where the volume ends
//! and [`Border::Open`] is asked for.
//!
//! Only cells that the surface passes are looked at: crossed edges are found 64 at a time as bits,
//! twice, first to count and then to number. Cost: a few operations per 64 voxels, and about a hundred
//! for each vertex; memory is that of the surface. Source: W. E. Lorensen and H. E. Cline, "Marching
//! Cubes", 1987; the numbering by rows follows W. Schroeder, R. Maynard and B. Geveci, "Flying Edges",
//! 2015.

pub mod cases;
mod extract;
mod junction;
pub(in crate::volume) mod slab;
#[cfg(test)]
mod tests;
mod triangulate;
mod values;

use crate::numeric::vector::{Vec3, add, scale};
use crate::trade::named;
use crate::volume::Frame;
pub use extract::{extract, extract_labels};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
pub use slab::Labels;
pub use values::{at_level, inside, values};

/// No neighbour.
pub const NONE: u32 = u32::MAX;

/// What counts as inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Select {
    /// Every value but 0.
    Set,
    /// One value.
    Equal(f64),
    /// This value and larger ones.
    AtLeast(f64),
}

impl Select {
    /// Whether a value is inside; one that is no number never is.
    #[inline]
    pub fn takes(&self, value: f64) -> bool {
        match self {
            Select::Set => value != 0.0 && !value.is_nan(),
            Select::Equal(label) => value == *label,
            Select::AtLeast(level) => value >= *level,
        }
    }
}

/// What happens where the volume ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Border {
    /// What lies beyond is outside, and the surface is closed half a voxel before it.
    Closed,
    /// The surface ends at the outermost voxel centres.
    Open,
}
named!(Border { Closed = "closed", Open = "open" });

/// Polygons as a list of their lengths and a list of their corners.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loops {
    /// Corners of each polygon.
    pub lengths: Vec<u8>,
    /// Vertices, polygon after polygon, counter-clockwise from outside.
    pub corners: Vec<u32>,
}

/// The surface of a binary volume: vertices on the edges between voxels, and how they follow each
/// other.
///
/// Every vertex lies on two curves, each the cut of the surface with a plane of voxel centres: curve 0
/// in the plane of its edge's axis and the next axis (x, y, z, x), curve 1 in that of the axis after.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Twice the place of each vertex in voxels from the centre of voxel (0, 0, 0). One coordinate is
    /// odd: the axis of its edge.
    pub places: Vec<[i32; 3]>,
    /// Whether the lower end of its edge is the one inside.
    pub lower_inside: Vec<bool>,
    /// Whether what is inside, or outside, is one voxel thick along its edge.
    pub thin: Vec<bool>,
    /// The neighbours on curve 0 down and up, on curve 1 down and up: four times the vertex, and the
    /// slot in which it names this one; [`NONE`] where a curve ends.
    pub links: Vec<[u32; 4]>,
    /// The steps to the neighbours, as [`cases::step_code`] writes them.
    pub steps: Vec<[u8; 4]>,
    /// The polygons; where there are labels, counter-clockwise from outside of the higher one.
    pub loops: Loops,
    /// Cells that hold a part of it.
    pub cells: u64,
    /// Where there are labels, those on both sides of each vertex on an edge: inside, which is the
    /// higher one, and outside; else empty.
    pub sides: Vec<[u16; 2]>,
    /// Where three labels meet there are vertices in the middle of faces and cells too. Curves that end
    /// there without going on: that vertex, and four times the vertex that names it plus its slot, in
    /// order.
    pub arms: Vec<(u32, u32)>,
}

/// The axis of the edge that a vertex lies on.
#[inline]
pub fn axis_of(place: [i32; 3]) -> usize {
    // One coordinate is odd.
    ((place[1] & 1) + 2 * (place[2] & 1)) as usize
}

impl Surface {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let each = 12 + 2 + 16 + 4 + if self.sides.is_empty() { 0 } else { 4 };
        let loops = self.loops.lengths.len() + 4 * self.loops.corners.len();
        (each * self.len() + loops + 8 * self.arms.len()) as u64
    }

    /// Number of vertices where the surface ends.
    pub fn ends(&self) -> usize {
        let ends = |v: &usize| self.is_on_edge(*v) && self.links[*v].contains(&NONE);
        (0..self.len()).filter(ends).count()
    }

    /// Whether a vertex lies on an edge between voxels, as all do but those where three labels meet.
    #[inline]
    pub fn is_on_edge(&self, vertex: usize) -> bool {
        self.places[vertex].iter().map(|c| c & 1).sum::<i32>() == 1
    }

    /// Whether there is no surface.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The labels inside and outside of a triangle or polygon; `None` where there are no labels.
    #[inline]
    pub fn sides_of(&self, corners: &[u32]) -> Option<[u16; 2]> {
        if self.sides.is_empty() {
            return None;
        }
        // Every polygon has a corner on an edge, and all that do have the same labels.
        let v = corners.iter().find(|v| self.is_on_edge(**v as usize))?;
        Some(self.sides[*v as usize])
    }

    /// Those of the triangles that bound a label, turned outwards from it.
    pub fn triangles_around(&self, label: u16, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let around = |t: &[u32; 3]| match self.sides_of(t) {
            Some([inside, _]) if inside == label => Some(*t),
            Some([_, outside]) if outside == label => Some([t[0], t[2], t[1]]),
            _ => None,
        };
        triangles.iter().filter_map(around).collect()
    }

    /// Where vertices are in space: each in the middle of its edge, moved by so many voxels along it.
    pub fn positions(&self, frame: &Frame, moved: impl Fn(usize) -> Vec3 + Sync) -> Vec<Vec3> {
        (0..self.len())
            .into_par_iter()
            .with_min_len(1 << 12)
            .map(|v| {
                let offset = moved(v);
                let mut p = frame.origin;
                for a in 0..3 {
                    let steps = f64::from(self.places[v][a]) * 0.5 + offset[a];
                    p = add(p, scale(frame.axes[a], steps));
                }
                p
            })
            .collect()
    }

    /// Where vertices are on the grid: in voxels from the centre of voxel (0, 0, 0), times `metric`, each
    /// moved by so many voxels.
    pub fn on_grid(&self, metric: Vec3, moved: impl Fn(usize) -> Vec3 + Sync) -> Vec<Vec3> {
        self.on_grid_from(|_| [0; 3], metric, moved)
    }

    /// As [`Surface::on_grid`], each vertex from a place of its own, which is doubled as its own is: a part
    /// far out on the grid keeps its digits.
    pub(in crate::volume) fn on_grid_from(
        &self,
        origin: impl Fn(usize) -> [i32; 3] + Sync,
        metric: Vec3,
        moved: impl Fn(usize) -> Vec3 + Sync,
    ) -> Vec<Vec3> {
        (0..self.len())
            .into_par_iter()
            .with_min_len(1 << 12)
            .map(|v| {
                let (place, from, offset) = (self.places[v], origin(v), moved(v));
                std::array::from_fn(|a| {
                    (0.5 * f64::from(place[a] - from[a]) + offset[a]) * metric[a]
                })
            })
            .collect()
    }
}
