//! A mesh as distances are measured on it: triangles that can be searched and sampled.

use crate::error::{Error, Fault, Result};
use crate::mesh::Mesh;
use crate::mesh::distance::{Closest, point_triangle};
use crate::mesh::sampling::{self, Place};
use crate::numeric::vector::{Vec3, add, cross, length, scale, sub};
use crate::spatial::aabb::Aabb;
use crate::spatial::bvh::{Bvh, Nearest};
use crate::spatial::local::LocalFrame;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::borrow::Cow;

/// Points per parallel step; fixed, because a search starts from what the one before found.
const CHUNK: usize = 1024;

/// What of a mesh distances are measured from and to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Its triangles; its segments and points are left out.
    Triangles,
    /// Its segments: it has no triangles.
    Segments,
    /// Its points, or all its vertices where it lists none: it has neither triangles nor segments.
    Points,
}

/// The elements of one kind, each as three corners: segments and points are triangles that repeat
/// one.
pub struct Elements<'a> {
    pub kind: Kind,
    pub corners: Cow<'a, [[u32; 3]]>,
}

impl<'a> Elements<'a> {
    /// Errors when the mesh has no vertex, or is not what [`Mesh::check`] promises.
    pub fn of(mesh: &'a Mesh, name: &str) -> Result<Self> {
        mesh.check().map_err(|fault| {
            Error::Geometry(Fault {
                problem: format!("mesh {name}: {}", fault.problem),
                ..fault
            })
        })?;
        let (kind, corners) = if !mesh.triangles.is_empty() {
            (Kind::Triangles, Cow::Borrowed(mesh.triangles.as_slice()))
        } else if !mesh.segments.is_empty() {
            let corners = mesh.segments.iter().map(|&[a, b]| [a, b, b]);
            (Kind::Segments, corners.collect())
        } else if !mesh.points.is_empty() {
            (Kind::Points, mesh.points.iter().map(|&p| [p; 3]).collect())
        } else {
            let all = 0..mesh.positions.len() as u32;
            (Kind::Points, all.map(|p| [p; 3]).collect())
        };
        if corners.is_empty() {
            return Err(Error::Geometry(Fault::whole(format!(
                "mesh {name} has no vertices, so nothing has a distance to it"
            ))));
        }
        if corners.len() > u32::MAX as usize {
            return Err(Error::Limit {
                what: format!("the search tree of mesh {name}"),
                needed: format!("{} elements", corners.len()),
                limit: format!("{} elements", u32::MAX),
                hint: None,
            });
        }
        Ok(Elements { kind, corners })
    }

    /// The elements of all kinds at once; distances are to whichever is nearest.
    pub fn all_of(mesh: &Mesh) -> Elements<'static> {
        let triangles = mesh.triangles.iter().copied();
        let segments = mesh.segments.iter().map(|&[a, b]| [a, b, b]);
        let points = mesh.points.iter().map(|&p| [p; 3]);
        Elements {
            kind: Kind::Triangles,
            corners: triangles.chain(segments).chain(points).collect(),
        }
    }

    pub fn bounds(&self, mesh: &Mesh) -> Aabb {
        let of = |part: &[[u32; 3]]| {
            Aabb::around(part.iter().flatten().map(|v| &mesh.positions[*v as usize]))
        };
        self.corners
            .par_chunks(1 << 14)
            .map(of)
            .reduce(|| Aabb::EMPTY, Aabb::union)
    }
}

/// The elements in local coordinates, with a tree over them.
pub struct Surface {
    pub kind: Kind,
    /// Vertex indices of each element.
    pub indices: Vec<[u32; 3]>,
    /// Corners of each element.
    pub corners: Vec<[Vec3; 3]>,
    /// Vertices in use, in order, and where they are.
    pub vertices: Vec<(u32, Vec3)>,
    bvh: Bvh,
}

/// A nearest element and how far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    pub element: u32,
    pub distance: f64,
}

impl Surface {
    pub fn new(mesh: &Mesh, elements: Elements, frame: &LocalFrame) -> Self {
        let indices = elements.corners.into_owned();
        let local = |v: u32| frame.to_local(mesh.positions[v as usize]);
        let corners: Vec<[Vec3; 3]> = indices.par_iter().map(|t| t.map(local)).collect();
        let mut used = vec![false; mesh.positions.len()];
        for v in indices.iter().flatten() {
            used[*v as usize] = true;
        }
        let vertices = (0..mesh.positions.len() as u32)
            .into_par_iter()
            .filter(|v| used[*v as usize])
            .map(|v| (v, local(v)))
            .collect();
        let bvh = Bvh::build(corners.len() as u32, |i| Aabb::around(&corners[i as usize]));
        Surface {
            kind: elements.kind,
            indices,
            corners,
            vertices,
            bvh,
        }
    }

    /// The point of one element closest to `p`.
    #[inline]
    pub fn closest_on(&self, element: u32, p: Vec3) -> Closest {
        point_triangle(p, self.corners[element as usize])
    }

    /// The element nearest to `p`; `hint` is one that may be near.
    pub fn nearest(&self, p: Vec3, hint: u32) -> Hit {
        let to = |element| self.closest_on(element, p).distance_squared;
        let start = to(hint);
        let found = self.bvh.nearest(p, start, to).unwrap_or(Nearest {
            item: hint,
            distance_squared: start,
        });
        Hit {
            element: found.item,
            distance: found.distance_squared.sqrt(),
        }
    }

    /// The nearest element for each of many points, which are best given near each other.
    pub fn nearest_of<T: Sync>(&self, items: &[T], point: impl Fn(&T) -> Vec3 + Sync) -> Vec<Hit> {
        let parts: Vec<Vec<Hit>> = items
            .par_chunks(CHUNK)
            .map(|part| {
                let mut hint = 0;
                part.iter()
                    .map(|item| {
                        let hit = self.nearest(point(item), hint);
                        hint = hit.element;
                        hit
                    })
                    .collect()
            })
            .collect();
        parts.concat()
    }

    /// Whether `holds` is true of an element whose box meets `query`; it is asked of some others too.
    pub fn any_overlapping(&self, query: &Aabb, holds: impl FnMut(u32) -> bool) -> bool {
        self.bvh.any_overlapping(query, holds)
    }

    /// The element that is nearest to all three points at once: the one for which the largest of
    /// the three distances is smallest, if that is not over `upper`.
    pub fn nearest_to_all(&self, points: &[Vec3; 3], upper: f64) -> Option<Hit> {
        let largest = |of: &dyn Fn(Vec3) -> f64| points.iter().map(|p| of(*p)).fold(0.0, f64::max);
        let found = self.bvh.nearest_by(
            upper * upper,
            |b| largest(&|p| b.distance_squared(p)),
            |element| largest(&|p| self.closest_on(element, p).distance_squared),
        );
        found.map(|found| Hit {
            element: found.item,
            distance: found.distance_squared.sqrt(),
        })
    }

    /// Exactly `count` points spread evenly over the elements by area (by length for segments),
    /// one in each of `count` equal shares; none where nothing has an extent.
    ///
    /// Each depends on the seed and its index alone.
    pub fn samples(&self, count: u64, seed: u64) -> Vec<Vec3> {
        let extents: Vec<f64> = self.corners.par_iter().map(|c| self.extent(c)).collect();
        let places = sampling::spread(&extents, count, seed);
        places.par_iter().map(|p| self.point_at(p)).collect()
    }

    fn extent(&self, [a, b, c]: &[Vec3; 3]) -> f64 {
        match self.kind {
            Kind::Triangles => length(cross(sub(*b, *a), sub(*c, *a))),
            Kind::Segments => length(sub(*b, *a)),
            Kind::Points => 0.0,
        }
    }

    fn point_at(&self, place: &Place) -> Vec3 {
        let [a, b, c] = self.corners[place.element];
        let [u, v] = match self.kind {
            Kind::Triangles => sampling::in_triangle(place),
            _ => [place.along, 0.0],
        };
        add(a, add(scale(sub(b, a), u), scale(sub(c, a), v)))
    }
}
