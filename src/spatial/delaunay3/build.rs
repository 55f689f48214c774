//! Insertion of points one by one (Bowyer 1981; Watson 1981), with ties broken symbolically.
//!
//! Vertex 0 is the one at infinity while cells are built. A cell is in conflict with a point when the
//! point lies inside its sphere; the cells in conflict form a ball around the point, which is emptied
//! and filled with the cells between its boundary and the point.
//!
//! Ties, five points on one sphere, are broken as if the lifted points `(x, y, z, |p|^2 - w)` were
//! raised by infinitely small amounts, the larger the later a point comes in the order of its coordinates
//! (Devillers and Teillaud 2011, "Perturbations for Delaunay and weighted Delaunay 3D triangulations").
//! The result depends on no order of insertion, and no cell is flat.

use super::Cell;
use crate::numeric::predicates::{power3d, side_of_plane};
use std::cmp::Ordering;
use std::collections::HashMap;

/// The vertex at infinity, while building.
const INFINITE: u32 = 0;
/// No cell, no vertex.
const NONE: u32 = u32::MAX;

/// A facet between a cell in conflict and one that is not.
struct Facet {
    /// The cell in conflict, the new point in place of the vertex that faces the outside.
    cell: [u32; 4],
    /// Where in it the new point stands.
    slot: usize,
    /// The cell outside.
    outside: u32,
    /// Which of its neighbours the cell in conflict was.
    back: usize,
}

/// A triangulation in the making.
pub struct Builder {
    /// Places and weights; the first stands for the vertex at infinity.
    points: Vec<[f64; 4]>,
    cells: Vec<Cell>,
    /// Per cell, when it was last asked about: twice the number of the insertion, and one more where it
    /// is in conflict.
    marks: Vec<u32>,
    /// Cells without use.
    free: Vec<u32>,
    /// Number of the current insertion.
    round: u32,
    /// Where the next walk starts.
    last: u32,
    /// Whether any weights differ: only then can points be hidden.
    weighted: bool,
    conflicts: Vec<u32>,
    facets: Vec<Facet>,
    links: Links,
}

/// Where a point is found to lie.
enum Found {
    /// In this cell, closed.
    Cell(u32),
    /// On this vertex.
    Vertex(u32),
}

#[inline(always)]
fn place(point: [f64; 4]) -> [f64; 3] {
    [point[0], point[1], point[2]]
}

/// The order of coordinates that ties are broken by.
fn by_place(a: [f64; 4], b: [f64; 4]) -> Ordering {
    let order = place(a).partial_cmp(&place(b));
    order.unwrap_or(Ordering::Equal)
}

impl Builder {
    /// Starts with four points that span space, the last on the positive side of the others; `points`
    /// without one for the vertex at infinity. Vertices are counted from 1.
    pub fn new(points: &[[f64; 4]], first: [usize; 4]) -> Self {
        let [along, squared] = to_whole(points);
        let scaled = |[x, y, z, w]: &[f64; 4]| [x * along, y * along, z * along, w * squared];
        let mut all = Vec::with_capacity(points.len() + 1);
        all.push([f64::NAN; 4]);
        all.extend(points.iter().map(scaled));
        let weighted = points.iter().any(|p| p[3] != points[0][3]);
        let corners = first.map(|index| index as u32 + 1);
        let room = points.len() * 7 + 16;
        let mut builder = Builder {
            links: Links::new(all.len()),
            points: all,
            cells: Vec::with_capacity(room),
            marks: Vec::with_capacity(room),
            free: Vec::new(),
            round: 1,
            last: 0,
            weighted,
            conflicts: Vec::new(),
            facets: Vec::new(),
        };
        builder.cells.push(Cell {
            vertices: corners,
            neighbours: [1, 2, 3, 4],
        });
        for slot in 0..4 {
            // Beyond the facet, the vertex at infinity; two others swap to keep the orientation.
            let mut vertices = corners;
            let mut neighbours = [1, 2, 3, 4];
            vertices[slot] = INFINITE;
            neighbours[slot] = 0;
            let (a, b) = [(1, 2), (0, 2), (0, 1), (0, 1)][slot];
            vertices.swap(a, b);
            neighbours.swap(a, b);
            builder.cells.push(Cell {
                vertices,
                neighbours,
            });
        }
        builder.marks.resize(5, 0);
        builder
    }

    /// Adds the vertex `vertex`, counted from 1.
    pub fn insert(&mut self, vertex: u32) {
        let p = self.points[vertex as usize];
        self.round += 2;
        let start = match self.locate(p) {
            Found::Cell(cell) => cell,
            // The heavier of two points in one place hides the other.
            Found::Vertex(other) if self.points[other as usize][3] >= p[3] => return,
            Found::Vertex(_) => self.last,
        };
        if self.weighted && !self.is_in_conflict(start, p) {
            return;
        }
        self.collect(start, p, vertex);
        self.fill(vertex);
    }

    /// The cell that holds a point, found by walking towards it.
    fn locate(&mut self, p: [f64; 4]) -> Found {
        let mut cell = self.last;
        if let Some(slot) = self.infinite_slot(cell) {
            cell = self.cells[cell as usize].neighbours[slot];
        }
        let mut from = NONE;
        'walk: loop {
            let Cell {
                vertices,
                neighbours,
            } = self.cells[cell as usize];
            if vertices.contains(&INFINITE) {
                self.last = cell;
                return Found::Cell(cell);
            }
            let corners = vertices.map(|v| place(self.points[v as usize]));
            for slot in 0..4 {
                if neighbours[slot] != from && side(corners, slot, place(p)) < 0 {
                    from = cell;
                    cell = neighbours[slot];
                    continue 'walk;
                }
            }
            self.last = cell;
            let on = corners.iter().position(|corner| *corner == place(p));
            return on.map_or(Found::Cell(cell), |slot| Found::Vertex(vertices[slot]));
        }
    }

    #[inline(always)]
    fn infinite_slot(&self, cell: u32) -> Option<usize> {
        let vertices = self.cells[cell as usize].vertices;
        vertices.iter().position(|v| *v == INFINITE)
    }

    /// Whether a point lies inside the sphere of a cell; for a cell at infinity, beyond its facet, or in
    /// the facet's plane and its circle.
    #[inline]
    fn is_in_conflict(&self, cell: u32, p: [f64; 4]) -> bool {
        let Cell {
            vertices,
            neighbours,
        } = self.cells[cell as usize];
        let at = |slot: usize| self.points[vertices[slot] as usize];
        if let Some(slot) = vertices.iter().position(|v| *v == INFINITE) {
            let corners = [0, 1, 2, 3].map(|k| place(at(k)));
            return match side(corners, slot, place(p)) {
                // In the plane, the circle is where the sphere on the other side cuts it.
                0 => self.is_in_conflict(neighbours[slot], p),
                sign => sign > 0,
            };
        }
        match power3d(at(0), at(1), at(2), at(3), p) {
            0 => tie([at(0), at(1), at(2), at(3)], p),
            sign => sign > 0,
        }
    }

    /// Finds the cells in conflict with `p`, and the facets around them.
    fn collect(&mut self, start: u32, p: [f64; 4], vertex: u32) {
        let (asked, conflicting) = (self.round, self.round + 1);
        self.conflicts.clear();
        self.facets.clear();
        self.conflicts.push(start);
        self.marks[start as usize] = conflicting;
        let mut next = 0;
        while next < self.conflicts.len() {
            let cell = self.conflicts[next];
            next += 1;
            let Cell {
                vertices,
                neighbours,
            } = self.cells[cell as usize];
            for slot in 0..4 {
                let outside = neighbours[slot];
                let mark = self.marks[outside as usize];
                if mark == conflicting {
                    continue;
                }
                if mark != asked {
                    if self.is_in_conflict(outside, p) {
                        self.marks[outside as usize] = conflicting;
                        self.conflicts.push(outside);
                        continue;
                    }
                    self.marks[outside as usize] = asked;
                }
                let of_outside = self.cells[outside as usize].neighbours;
                let back = of_outside.iter().position(|n| *n == cell);
                let mut made = vertices;
                made[slot] = vertex;
                self.facets.push(Facet {
                    cell: made,
                    slot,
                    outside,
                    back: back.expect("neighbours know each other"),
                });
            }
        }
    }

    /// Replaces the cells in conflict by those between their boundary and the new vertex.
    fn fill(&mut self, vertex: u32) {
        self.free.extend(self.conflicts.iter().rev());
        self.links.start(&self.facets, vertex);
        for facet in &self.facets {
            let cell = match self.free.pop() {
                Some(cell) => cell,
                None => {
                    self.cells.push(Cell {
                        vertices: [NONE; 4],
                        neighbours: [NONE; 4],
                    });
                    self.marks.push(0);
                    (self.cells.len() - 1) as u32
                }
            };
            let made = &mut self.cells[cell as usize];
            made.vertices = facet.cell;
            made.neighbours[facet.slot] = facet.outside;
            self.cells[facet.outside as usize].neighbours[facet.back] = cell;
            // Across the other facets lie the cells that share an edge of the boundary.
            let [i, j, k] = OTHERS[facet.slot];
            for (across, a, b) in [(i, j, k), (j, k, i), (k, i, j)] {
                let edge = (facet.cell[a], facet.cell[b]);
                if let Some((other, slot)) = self.links.meet(edge, (cell, across)) {
                    self.cells[other as usize].neighbours[slot] = cell;
                    self.cells[cell as usize].neighbours[across] = other;
                }
            }
            self.last = cell;
        }
    }

    /// The cells without gaps, `u32::MAX` for the vertex at infinity, vertices counted from 0.
    pub fn finish(mut self) -> Vec<Cell> {
        let mut last = self.cells.len();
        for cell in &self.free {
            self.cells[*cell as usize].vertices = [NONE; 4];
        }
        self.free.sort_unstable();
        for hole in self.free.iter().map(|cell| *cell as usize) {
            // Unused cells at the end are cut off, used ones move into the holes.
            while last > hole && self.cells[last - 1].vertices == [NONE; 4] {
                last -= 1;
            }
            if last <= hole {
                break;
            }
            last -= 1;
            let moved = self.cells[last];
            self.cells[hole] = moved;
            for neighbour in moved.neighbours {
                for back in &mut self.cells[neighbour as usize].neighbours {
                    if *back == last as u32 {
                        *back = hole as u32;
                    }
                }
            }
        }
        self.cells.truncate(last);
        for cell in &mut self.cells {
            cell.vertices = cell.vertices.map(|v| v.wrapping_sub(1));
        }
        self.cells.shrink_to_fit();
        self.cells
    }
}

/// Factors of coordinates and of weights, powers of two, that make all coordinates small whole numbers;
/// 1 where none does. Predicates are much faster on those, and ties among them are what lattices are
/// made of.
fn to_whole(points: &[[f64; 4]]) -> [f64; 2] {
    let coordinates = || points.iter().flat_map(|[x, y, z, _]| [*x, *y, *z]);
    let largest = coordinates().fold(0.0f64, |most, value| most.max(value.abs()));
    // The largest becomes at most 2^20.
    let exponent = 20 - (largest.log2().floor() as i32 + 1);
    if largest == 0.0 || exponent.abs() > 100 {
        return [1.0; 2];
    }
    let factor = 2f64.powi(exponent);
    if !coordinates().all(|value| (value * factor).fract() == 0.0) {
        return [1.0; 2];
    }
    // As small as they can be.
    let mut factor = factor;
    while coordinates().all(|value| (value * factor * 0.5).fract() == 0.0) {
        factor *= 0.5;
    }
    [factor, factor * factor]
}

/// For each slot the other three.
const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

/// On which side of the facet opposite `slot` a point lies: 1 on that of the cell.
#[inline(always)]
pub fn side(mut corners: [[f64; 3]; 4], slot: usize, p: [f64; 3]) -> i32 {
    corners[slot] = p;
    let [a, b, c, d] = corners;
    side_of_plane(a, b, c, d)
}

/// Whether `p` is in conflict with a cell on whose sphere it lies.
#[cold]
pub fn tie(corners: [[f64; 4]; 4], p: [f64; 4]) -> bool {
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| by_place(corners[*b], corners[*a]));
    for slot in order {
        // Raising `p` itself the most puts it outside.
        if by_place(p, corners[slot]) == Ordering::Greater {
            return false;
        }
        // Raising a corner raises the sphere's plane at `p`, if `p` is on the corner's side.
        match side(corners.map(place), slot, place(p)) {
            0 => {}
            sign => return sign > 0,
        }
    }
    false
}

/// Pairs the facets of new cells by the edge of the boundary that they share.
///
/// Each edge of the boundary is met twice. Vertices of the boundary get small numbers, and a square table
/// over them holds who came first; each entry is emptied when it is met again.
struct Links {
    /// Per vertex its number, where it is at least `base`.
    numbers: Vec<u32>,
    base: u32,
    next: u32,
    /// Entries along a row of the table, a power of two.
    stride: usize,
    /// Cell and slot that came first, plus one; 0 where none is waiting.
    table: Vec<u64>,
    /// Instead of the table, where it would be too large.
    many: HashMap<(u32, u32), (u32, usize)>,
}

impl Links {
    /// Rows of the largest table: 8 MiB.
    const WIDEST: usize = 1024;

    fn new(vertices: usize) -> Self {
        Links {
            numbers: vec![0; vertices],
            base: 1,
            next: 1,
            stride: 64,
            table: vec![0; 64 * 64],
            many: HashMap::new(),
        }
    }

    /// Numbers the vertices of a boundary.
    fn start(&mut self, facets: &[Facet], vertex: u32) {
        if self.next > u32::MAX / 2 {
            self.numbers.fill(0);
            self.next = 1;
        }
        self.base = self.next;
        for facet in facets {
            for v in facet.cell {
                if self.numbers[v as usize] < self.base && v != vertex {
                    self.numbers[v as usize] = self.next;
                    self.next += 1;
                }
            }
        }
        let count = (self.next - self.base) as usize;
        while self.stride < count && self.stride < Self::WIDEST {
            self.stride *= 2;
            // Every entry is empty between insertions.
            self.table.resize(self.stride * self.stride, 0);
        }
    }

    /// Who met this edge before; else waits for the one that will.
    #[inline(always)]
    fn meet(&mut self, (a, b): (u32, u32), (cell, slot): (u32, usize)) -> Option<(u32, usize)> {
        let a = self.numbers[a as usize] - self.base;
        let b = self.numbers[b as usize] - self.base;
        let (low, high) = (a.min(b), a.max(b));
        if high as usize >= self.stride {
            let waiting = self.many.remove(&(low, high));
            if waiting.is_none() {
                self.many.insert((low, high), (cell, slot));
            }
            return waiting;
        }
        let entry = &mut self.table[low as usize * self.stride + high as usize];
        if *entry == 0 {
            *entry = (u64::from(cell) << 2 | slot as u64) + 1;
            return None;
        }
        let waiting = *entry - 1;
        *entry = 0;
        Some(((waiting >> 2) as u32, (waiting & 3) as usize))
    }
}
