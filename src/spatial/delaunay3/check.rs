//! Whether a triangulation is one.

use super::{Cell, Delaunay3, FACET, INFINITE, build, place};
use crate::numeric::predicates::{power3d, side_of_plane};
use crate::numeric::vector::{cross, dot, sub};

/// What is wrong with a triangulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Broken {
    /// The neighbour beyond a facet of a cell does not know it, or has other corners there.
    Neighbour {
        /// The cell.
        cell: u32,
        /// The slot of the vertex opposite the facet.
        slot: usize,
    },
    /// A finite cell is flat or turned inside out.
    Orientation {
        /// The cell.
        cell: u32,
    },
    /// The vertex beyond a facet lies inside the cell's sphere.
    Sphere {
        /// The cell.
        cell: u32,
        /// The slot of the vertex opposite the facet.
        slot: usize,
    },
    /// The hull is not convex at a facet.
    Hull {
        /// The cell at infinity.
        cell: u32,
    },
    /// A point that is no vertex is in conflict with the cell that holds it.
    Hidden {
        /// The point, by vertex.
        vertex: u32,
    },
    /// The volumes of the cells do not add up to that of the hull.
    Volume {
        /// The sum over the cells.
        cells: f64,
        /// What the hull encloses.
        hull: f64,
    },
    /// Vertices, edges, facets and cells do not count as those of a sphere do.
    Euler {
        /// Their alternating sum, which should be 0.
        sum: i64,
    },
}

impl Delaunay3 {
    /// Checks what makes it the triangulation of its points: neighbours that know each other, cells with
    /// positive volume, empty spheres, a convex hull, hidden points outside the spheres, volumes that add
    /// up and Euler's formula.
    ///
    /// Signs are exact, ties included; volumes agree to 1e-9 of the bounding box. Locally empty spheres are
    /// empty (Delaunay 1934), so each cell is compared with its neighbours alone: `O(n)`, and a walk for
    /// each hidden point.
    pub fn check(&self) -> Result<(), Broken> {
        let mut edges = 0i64;
        for (cell, index) in self.cells.iter().zip(0u32..) {
            self.check_neighbours(cell, index)?;
            if cell.is_finite() {
                let [a, b, c, d] = self.corners(index).map(place);
                if side_of_plane(a, b, c, d) != 1 {
                    return Err(Broken::Orientation { cell: index });
                }
            }
            self.check_spheres(cell, index)?;
            edges += self.edges_counted_here(index);
        }
        self.check_hidden()?;
        self.check_volume()?;
        // With the vertex at infinity the cells tile the three-dimensional sphere.
        let vertices = self.cell_of.iter().filter(|c| **c != super::NONE).count() as i64;
        let cells = self.cells.len() as i64;
        let sum = vertices + 1 - edges + 2 * cells - cells;
        if cells > 0 && sum != 0 {
            return Err(Broken::Euler { sum });
        }
        Ok(())
    }

    fn check_neighbours(&self, cell: &Cell, index: u32) -> Result<(), Broken> {
        for slot in 0..4 {
            let broken = Broken::Neighbour { cell: index, slot };
            let other = self
                .cells
                .get(cell.neighbours[slot] as usize)
                .ok_or(broken)?;
            let back = other.neighbours.iter().position(|n| *n == index);
            let back = back.ok_or(broken)?;
            // Seen from the other side, the corners turn the other way.
            let smallest_first = |[a, b, c]: [u32; 3]| match a.min(b).min(c) {
                least if least == a => [a, b, c],
                least if least == b => [b, c, a],
                _ => [c, a, b],
            };
            let here = FACET[slot].map(|k| cell.vertices[k]);
            let [a, b, c] = FACET[back].map(|k| other.vertices[k]);
            if smallest_first(here) != smallest_first([c, b, a]) {
                return Err(broken);
            }
        }
        Ok(())
    }

    fn check_spheres(&self, cell: &Cell, index: u32) -> Result<(), Broken> {
        for slot in 0..4 {
            let other = &self.cells[cell.neighbours[slot] as usize];
            let back = other.neighbours.iter().position(|n| *n == index);
            let beyond = other.vertices[back.unwrap_or(0)];
            if beyond == INFINITE {
                continue;
            }
            let p = self.points[beyond as usize];
            match cell.infinite_slot() {
                None => {
                    let corners = self.corners(index);
                    let [a, b, c, d] = corners;
                    let sign = power3d(a, b, c, d, p);
                    if sign > 0 || (sign == 0 && build::tie(corners, p)) {
                        return Err(Broken::Sphere { cell: index, slot });
                    }
                }
                // The apex of the next facet of the hull is not beyond this one.
                Some(at) if at != slot => {
                    let corner = |k: usize| match k == at {
                        true => place(p),
                        false => place(self.points[cell.vertices[k] as usize]),
                    };
                    if side_of_plane(corner(0), corner(1), corner(2), corner(3)) > 0 {
                        return Err(Broken::Hull { cell: index });
                    }
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    /// Edges of a cell around which no cell has a smaller index.
    fn edges_counted_here(&self, index: u32) -> i64 {
        let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        let cell = &self.cells[index as usize];
        let is_first = |&(i, j): &(usize, usize)| {
            let edge = [cell.vertices[i], cell.vertices[j]];
            let mut from = index;
            // Leave across the facet opposite one of the two other vertices, and go on around.
            let slot = (0..4).find(|k| *k != i && *k != j).unwrap_or(0);
            let mut at = cell.neighbours[slot];
            while at != index {
                if at < index {
                    return false;
                }
                let here = &self.cells[at as usize];
                let next = (0..4)
                    .find(|k| !edge.contains(&here.vertices[*k]) && here.neighbours[*k] != from);
                from = at;
                at = here.neighbours[next.unwrap_or(0)];
            }
            true
        };
        pairs.iter().filter(|pair| is_first(pair)).count() as i64
    }

    fn check_hidden(&self) -> Result<(), Broken> {
        let mut near = None;
        for (vertex, p) in (0u32..).zip(&self.points) {
            if self.cells.is_empty() || self.cell_of(vertex).is_some() {
                continue;
            }
            let broken = Broken::Hidden { vertex };
            let cell = self.locate(place(*p), near).ok_or(broken)?;
            near = Some(cell);
            if !self.cells[cell as usize].is_finite() {
                return Err(broken);
            }
            let corners = self.corners(cell);
            let twin = corners.iter().find(|corner| place(**corner) == place(*p));
            let hidden = match twin {
                Some(twin) => twin[3] >= p[3],
                None => {
                    let [a, b, c, d] = corners;
                    let sign = power3d(a, b, c, d, *p);
                    sign < 0 || (sign == 0 && !build::tie(corners, *p))
                }
            };
            if !hidden {
                return Err(broken);
            }
        }
        Ok(())
    }

    fn check_volume(&self) -> Result<(), Broken> {
        let Some(origin) = self.points.first().map(|p| place(*p)) else {
            return Ok(());
        };
        let mut extent = 0.0f64;
        for p in &self.points {
            let from = sub(place(*p), origin);
            extent = from.into_iter().fold(extent, |most, v| most.max(v.abs()));
        }
        let six_times = |a, b, c, d| dot(sub(b, a), cross(sub(c, a), sub(d, a)));
        let (mut cells, mut hull) = (0.0, 0.0);
        for (cell, index) in self.cells.iter().zip(0u32..) {
            match cell.infinite_slot() {
                None => {
                    let [a, b, c, d] = self.corners(index).map(place);
                    cells += six_times(a, b, c, d) / 6.0;
                }
                Some(slot) => {
                    let [a, b, c] =
                        FACET[slot].map(|k| place(self.points[cell.vertices[k] as usize]));
                    hull += six_times(origin, a, b, c) / 6.0;
                }
            }
        }
        if (cells - hull.abs()).abs() > 1e-9 * extent.powi(3) {
            return Err(Broken::Volume { cells, hull });
        }
        Ok(())
    }
}
