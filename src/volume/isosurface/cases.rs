//! The 256 ways in which the corners of a cell are inside or outside, and the polygons between.
//!
//! Corner `c` of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edges 0 to 3 run along x, 4 to 7
//! along y, 8 to 11 along z; within each four, the lower of the other two axes counts fastest.
//!
//! On a face whose corners alternate, those inside are kept apart. Both cells of a face decide so,
//! whence the polygons of neighbours always meet; each edge of a cell that the surface crosses is a
//! corner of exactly one polygon of that cell, whence every vertex of the surface is a manifold one.

use std::sync::LazyLock;

/// The corners of each edge, the lower one first.
pub const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// The corners of each face, counter-clockwise from outside: lower and upper x, y, z.
pub const FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// Most polygons in a cell.
pub const MOST_LOOPS: usize = 4;

/// Most corners of all polygons of a cell together.
const MOST_CORNERS: usize = 12;

/// The edge between two corners of a cell.
pub fn edge_between(a: usize, b: usize) -> usize {
    EDGES
        .iter()
        .position(|e| *e == [a.min(b), a.max(b)])
        .expect("corners that differ in one bit")
}

/// The axis that an edge runs along.
pub const fn axis_of(edge: usize) -> usize {
    edge / 4
}

/// Twice the midpoint of an edge, from the cell's lower corner.
pub fn doubled_midpoint(edge: usize) -> [i32; 3] {
    let [a, b] = EDGES[edge];
    std::array::from_fn(|axis| ((a >> axis & 1) + (b >> axis & 1)) as i32)
}

/// Where two vertices of one polygon follow each other on a face: each is named as the neighbour of
/// the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Link {
    /// The two edges.
    pub edges: [u8; 2],
    /// Slot of each end, as [`slot`] counts them.
    pub slots: [u8; 2],
    /// Step from each end to the other, as [`step_code`] writes it.
    pub steps: [u8; 2],
}

/// The polygons of one configuration.
#[derive(Debug, Clone, Default)]
pub struct Case {
    loops: u8,
    lengths: [u8; MOST_LOOPS],
    corners: [u8; MOST_CORNERS],
    /// For each face of the cell, what is linked on it.
    links: [[Option<Link>; 2]; 6],
}

impl Case {
    /// The polygons, each as its edges, counter-clockwise from outside of what is inside.
    #[inline]
    pub fn loops(&self) -> impl Iterator<Item = &[u8]> {
        let mut start = 0;
        self.lengths[..usize::from(self.loops)]
            .iter()
            .map(move |length| {
                let end = start + usize::from(*length);
                let edges = &self.corners[start..end];
                start = end;
                edges
            })
    }

    /// What is linked on a face.
    #[inline]
    pub fn links(&self, face: usize) -> impl Iterator<Item = &Link> {
        self.links[face].iter().flatten()
    }
}

/// All cases, by the bits of the corners that are inside.
pub static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| (0..256).map(build).collect());

/// The slot of a vertex on an edge along `axis` for its neighbour in direction `along`, up or down:
/// one curve runs in the plane of `axis` and the next axis, the other in that of the one after.
pub const fn slot(axis: usize, along: usize, up: bool) -> u8 {
    let curve = if along == (axis + 1) % 3 { 0 } else { 2 };
    curve + up as u8
}

/// A step between neighbours, in half voxels from -2 to 2, as a number below 125.
pub const fn step_code(step: [i32; 3]) -> u8 {
    ((step[0] + 2) + 5 * (step[1] + 2) + 25 * (step[2] + 2)) as u8
}

/// The step that a code stands for.
pub const fn step_of(code: u8) -> [i32; 3] {
    let code = code as i32;
    [code % 5 - 2, code / 5 % 5 - 2, code / 25 - 2]
}

/// The segments of the surface on a face, each from the edge where a walk around the face enters the
/// inside to the edge where it leaves it.
pub fn segments(face: usize, inside: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let corners = FACES[face];
    let at = |i: usize| corners[i % 4];
    let mut found = Vec::new();
    for i in 0..4 {
        if !inside(at(i)) && inside(at(i + 1)) {
            let mut j = i + 1;
            while inside(at(j + 1)) {
                j += 1;
            }
            found.push([
                edge_between(at(i), at(i + 1)),
                edge_between(at(j), at(j + 1)),
            ]);
        }
    }
    found
}

fn build(bits: usize) -> Case {
    let mut case = Case::default();
    let mut next = [None; 12];
    for face in 0..6 {
        let found = segments(face, |corner| bits >> corner & 1 == 1);
        for (at, [from, to]) in found.into_iter().enumerate() {
            next[from] = Some(to);
            case.links[face][at] = Some(link(face, [from, to]));
        }
    }
    let mut filled = 0;
    for start in 0..12 {
        let mut edge = start;
        let first = filled;
        while let Some(to) = next[edge].take() {
            case.corners[filled] = edge as u8;
            filled += 1;
            edge = to;
        }
        if filled > first {
            case.lengths[usize::from(case.loops)] = (filled - first) as u8;
            case.loops += 1;
        }
    }
    case
}

/// How two edges of a face are named as neighbours.
pub fn link(face: usize, edges: [usize; 2]) -> Link {
    let normal = face / 2;
    let mid = edges.map(doubled_midpoint);
    let slots = [0, 1].map(|end| {
        let axis = axis_of(edges[end]);
        let along = 3 - axis - normal;
        slot(axis, along, mid[end][along] == 0)
    });
    let step = |from: usize, to: usize| {
        step_code(std::array::from_fn(|axis| mid[to][axis] - mid[from][axis]))
    };
    Link {
        edges: edges.map(|e| e as u8),
        slots,
        steps: [step(0, 1), step(1, 0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::vector::{cross, dot, sub};

    #[test]
    fn every_crossed_edge_is_in_one_polygon_of_three_to_seven_corners() {
        for (bits, case) in CASES.iter().enumerate() {
            let mut seen = [0; 12];
            for polygon in case.loops() {
                assert!((3..=7).contains(&polygon.len()), "{bits:08b}: {polygon:?}");
                for edge in polygon {
                    seen[usize::from(*edge)] += 1;
                }
            }
            for (edge, [a, b]) in EDGES.into_iter().enumerate() {
                let crossed = (bits >> a ^ bits >> b) & 1;
                assert_eq!(seen[edge], crossed, "{bits:08b}: edge {edge}");
            }
        }
    }

    #[test]
    fn polygons_of_one_corner_turn_away_from_it() {
        for corner in 0..8usize {
            for (bits, inside) in [(1usize << corner, true), (255 ^ 1 << corner, false)] {
                let case = &CASES[bits];
                let polygon: Vec<_> = case.loops().next().expect("a triangle").to_vec();
                let p: Vec<[f64; 3]> = polygon
                    .iter()
                    .map(|e| doubled_midpoint(usize::from(*e)).map(f64::from))
                    .collect();
                let normal = cross(sub(p[1], p[0]), sub(p[2], p[0]));
                let at = [0, 1, 2].map(|a| (corner >> a & 1) as f64 * 2.0);
                assert_eq!(dot(normal, sub(p[0], at)) > 0.0, inside, "{bits:08b}");
            }
        }
    }

    #[test]
    fn faces_turn_outwards_and_links_name_each_other() {
        for (face, corners) in FACES.into_iter().enumerate() {
            let p = corners.map(|c| [0, 1, 2].map(|a| (c >> a & 1) as f64));
            let normal = cross(sub(p[1], p[0]), sub(p[2], p[1]));
            let sign = if face % 2 == 1 { 1.0 } else { -1.0 };
            assert_eq!(normal[face / 2], sign, "face {face}");
        }
        for code in 0..125 {
            assert_eq!(step_code(step_of(code)), code);
        }
        for case in CASES.iter() {
            for link in (0..6).flat_map(|face| case.links(face)) {
                let [there, back] = link.steps.map(step_of);
                assert_eq!(there, back.map(|v| -v));
                let mid = link.edges.map(|e| doubled_midpoint(usize::from(e)));
                assert_eq!(std::array::from_fn(|a| mid[0][a] + there[a]), mid[1]);
            }
        }
    }

    #[test]
    fn the_same_face_is_cut_alike_from_both_cells() {
        // An upper face of one cell is the lower face of the next: corners are named by their place.
        for axis in 0..3 {
            for bits in 0..16usize {
                let others: Vec<usize> = (0..8).filter(|c| c >> axis & 1 == 0).collect();
                let inside = |c: usize| {
                    let at = others.iter().position(|o| *o == c & !(1 << axis));
                    bits >> at.expect("a corner of the face") & 1 == 1
                };
                let place = |edge: usize| {
                    let mut mid = doubled_midpoint(edge);
                    mid[axis] = 0;
                    mid
                };
                let mut upper: Vec<_> = segments(2 * axis + 1, inside)
                    .into_iter()
                    .map(|[a, b]| [place(b), place(a)])
                    .collect();
                let mut lower: Vec<_> = segments(2 * axis, inside)
                    .into_iter()
                    .map(|s| s.map(place))
                    .collect();
                upper.sort();
                lower.sort();
                assert_eq!(upper, lower, "axis {axis}, {bits:04b}");
            }
        }
    }
}
