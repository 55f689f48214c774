//! Delaunay triangulations in space, and regular (power) triangulations of weighted points.
//!
//! The cells are tetrahedra whose sphere, the one orthogonal to its four weighted points, is closer to
//! no other point in power distance `|x - p|^2 - w`. With equal weights that is the Delaunay
//! triangulation, and its dual the Voronoi diagram. Hidden points, whose power cell is empty, are no
//! vertices.
//!
//! All decisions are exact for all finite numbers, and ties are broken by the order of coordinates alone:
//! lattices, points on one plane or one sphere and coincident points give one valid triangulation without
//! flat cells, the same for any order of the input. Shifts of all points by an exactly representable
//! vector and sizes by a power of two change nothing.
//!
//! Points are inserted in rounds along a space-filling curve, each by a walk to its cell and the emptying
//! of its conflicts: about 25 cells made and 20 dropped a point.

mod build;
mod check;
mod dual;
mod order;

#[cfg(test)]
mod tests;

pub use check::Broken;
pub use dual::{Sphere, orthosphere, orthosphere_of_facet};

use crate::numeric::predicates::{orient2d, side_of_plane};
use build::{Builder, side};

/// The vertex at infinity: cells that have it are the outside of a facet of the convex hull.
pub const INFINITE: u32 = u32::MAX;

/// The slots of a cell's vertices but one, in the order in which they turn counter-clockwise seen from
/// that one.
pub const FACET: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];

/// A tetrahedron, by vertex; one of them may be [`INFINITE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// Its corners; the last lies on the side of the others that
    /// [`orient3d`](crate::numeric::predicates::orient3d) calls 1. With the vertex at infinity, it is any
    /// point beyond the facet.
    pub vertices: [u32; 4],
    /// The cells beyond the facets opposite each of them.
    pub neighbours: [u32; 4],
}

impl Cell {
    /// The slot of the vertex at infinity.
    #[inline]
    pub fn infinite_slot(&self) -> Option<usize> {
        self.vertices.iter().position(|v| *v == INFINITE)
    }

    /// Whether all its corners are points.
    #[inline]
    pub fn is_finite(&self) -> bool {
        !self.vertices.contains(&INFINITE)
    }
}

/// A Delaunay or regular triangulation.
#[derive(Debug, Clone)]
pub struct Delaunay3 {
    /// Places and weights by vertex, `[x, y, z, w]`, in the order of insertion.
    points: Vec<[f64; 4]>,
    /// The input's index of each vertex.
    inputs: Vec<u32>,
    cells: Vec<Cell>,
    /// A cell of each vertex; [`NONE`] for points that are not vertices.
    cell_of: Vec<u32>,
    dimension: i32,
}

/// No cell.
const NONE: u32 = u32::MAX;

impl Delaunay3 {
    /// The Delaunay triangulation of `points`.
    ///
    /// Coordinates must be finite, and points fewer than 2^32 - 2. Points in fewer than three dimensions
    /// have no cells ([`Delaunay3::dimension`]). Of coincident points the first is the vertex.
    ///
    /// Expected `O(n log n)` for points that fill space, about 5 microseconds each; `O(n^2)` at worst, as
    /// there are triangulations of that size.
    pub fn new(points: &[[f64; 3]]) -> Self {
        let weighted: Vec<[f64; 4]> = points.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
        Self::regular(&weighted)
    }

    /// The regular triangulation of weighted points `[x, y, z, w]`: a sphere of radius `r` is a point
    /// of weight `r^2`.
    ///
    /// As [`Delaunay3::new`]; of coincident points the heaviest is the vertex.
    pub fn regular(points: &[[f64; 4]]) -> Self {
        debug_assert!(points.iter().flatten().all(|value| value.is_finite()));
        let inputs = order::insertion_order(points);
        let points: Vec<[f64; 4]> = inputs.iter().map(|i| points[*i as usize]).collect();
        let (first, dimension) = spanning(&points);
        let mut cells = Vec::new();
        if let Some(first) = first {
            let mut builder = Builder::new(&points, first);
            for vertex in 0..points.len() {
                if !first.contains(&vertex) {
                    builder.insert(vertex as u32 + 1);
                }
            }
            cells = builder.finish();
        }
        let mut cell_of = vec![NONE; points.len()];
        for (cell, index) in cells.iter().zip(0..) {
            for vertex in cell.vertices {
                if vertex != INFINITE {
                    cell_of[vertex as usize] = index;
                }
            }
        }
        Delaunay3 {
            points,
            inputs,
            cells,
            cell_of,
            dimension,
        }
    }

    /// The dimension of the points' affine hull: 3 where there are cells, -1 without points.
    pub fn dimension(&self) -> i32 {
        self.dimension
    }

    /// All cells, those at infinity among them.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// How many cells are tetrahedra.
    pub fn finite_cells(&self) -> usize {
        self.cells.iter().filter(|cell| cell.is_finite()).count()
    }

    /// Places and weights `[x, y, z, w]` by vertex, those of points that are no vertices among them.
    pub fn points(&self) -> &[[f64; 4]] {
        &self.points
    }

    /// The index in the input of a vertex.
    pub fn input(&self, vertex: u32) -> u32 {
        self.inputs[vertex as usize]
    }

    /// A cell of a vertex; none where the point is hidden or coincides with another.
    pub fn cell_of(&self, vertex: u32) -> Option<u32> {
        Some(self.cell_of[vertex as usize]).filter(|cell| *cell != NONE)
    }

    /// The corners of a finite cell, `[x, y, z, w]` each.
    #[inline]
    pub fn corners(&self, cell: u32) -> [[f64; 4]; 4] {
        self.cells[cell as usize]
            .vertices
            .map(|v| self.points[v as usize])
    }

    /// The cell that holds a point, its facets included; one at infinity where the point is outside the
    /// convex hull. None without cells.
    ///
    /// Walks from `near`, or from the first cell: the cost is that of the cells in between.
    pub fn locate(&self, p: [f64; 3], near: Option<u32>) -> Option<u32> {
        let mut cell = near.unwrap_or(0);
        if let Some(slot) = self.cells.get(cell as usize)?.infinite_slot() {
            cell = self.cells[cell as usize].neighbours[slot];
        }
        'walk: loop {
            let Cell {
                vertices,
                neighbours,
            } = self.cells[cell as usize];
            if vertices.contains(&INFINITE) {
                return Some(cell);
            }
            let corners = self.corners(cell).map(place);
            for slot in 0..4 {
                if side(corners, slot, p) < 0 {
                    cell = neighbours[slot];
                    continue 'walk;
                }
            }
            return Some(cell);
        }
    }
}

/// The coordinates of a weighted point.
#[inline(always)]
pub fn place(point: [f64; 4]) -> [f64; 3] {
    [point[0], point[1], point[2]]
}

/// The first points that span space, the last on the positive side of the others; else the dimension
/// that all points have.
fn spanning(points: &[[f64; 4]]) -> (Option<[usize; 4]>, i32) {
    let at = |index: usize| place(points[index]);
    let all = || 0..points.len();
    if points.is_empty() {
        return (None, -1);
    }
    let Some(b) = all().find(|k| at(*k) != at(0)) else {
        return (None, 0);
    };
    let Some(c) = all().find(|k| !on_a_line(at(0), at(b), at(*k))) else {
        return (None, 1);
    };
    for d in all() {
        match side_of_plane(at(0), at(b), at(c), at(d)) {
            0 => {}
            1 => return (Some([0, b, c, d]), 3),
            _ => return (Some([0, c, b, d]), 3),
        }
    }
    (None, 2)
}

/// Whether three points lie on one line.
fn on_a_line(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> bool {
    let flat = |p: [f64; 3], i: usize, j: usize| [p[i], p[j]];
    [(0, 1), (1, 2), (2, 0)]
        .into_iter()
        .all(|(i, j)| orient2d(flat(a, i, j), flat(b, i, j), flat(c, i, j)) == 0)
}
