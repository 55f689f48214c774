//! The winding number of surfaces that are open or wound inconsistently.
//!
//! The generalised winding number (Jacobson, Kavan, Sorkine-Hornung 2013) of a point is the solid
//! angle of the surface over 4 pi. Closing the surface by strips from each border edge to infinity
//! along +x makes it a whole number, which the signed crossings of the line from the point towards
//! -x count exactly: that line runs beside the strips and never through one. What is left is the
//! solid angle of the strips, in closed form per border edge. So the cost follows the length of the
//! border and not the area of the surface.
//!
//! Only on which side of a half-integer it is has to be known. As the eye moves through a box the sum
//! changes smoothly, by what the edges sweep, and by whole numbers where a strip is passed; the
//! smooth part settles whole boxes at once, and exact predicates count the jumps between rows. From
//! box to smaller box edges are followed one by one while they are near, and by their summed field,
//! with a bound on its error, once they are far. A voxel too near to a half for that is summed
//! directly, so that every answer is the direct sum's.

mod descent;
mod edge;
mod field;

use self::descent::{Block, Descent};
use self::edge::Edge;
use super::lattice::Lattice;
use crate::mesh::Mesh;
use crate::mesh::identify::identify;
use crate::numeric::vector::Vec3;
use crate::numeric::vector::{cross, length, sub};
use crate::volume::octree::TILE;
use rayon::prelude::*;

/// A winding number this near to a half is one: centres in the plane of an opening.
const TIE: f64 = 1e-9;

/// From voxel `x` on, the centres of a row have this much taken from their crossings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// `64 z + y` within the row of tiles.
    pub row: u32,
    /// First voxel.
    pub x: u32,
    /// Twice what is taken, rounded: to an even number, or to an odd one where it is a half-integer.
    /// Twice the crossings less this is 2 or more where the winding number exceeds one half.
    pub doubled: i64,
}

/// The directed border of a surface: the edges along which its triangles do not cancel.
#[derive(Debug, Clone, Default)]
pub struct Border {
    edges: Vec<Edge>,
    /// Which triangles are taken the other way round; empty for none.
    pub reversed: Vec<bool>,
}

/// Whether every edge of the mesh is passed as often one way as the other, by position.
///
/// With two random numbers A and B for each place, A(a) B(b) - A(b) B(a) changes sign with the
/// direction of an edge `a b`. Its sum over all edges, modulo 2^128, is 0 for a surface without
/// border; for another one it is a polynomial of degree two in these numbers, not 0, and vanishes with
/// a probability of about 2^-62 (Schwartz 1980).
pub fn has_no_border(mesh: &Mesh) -> bool {
    let product = |a: u64, b: u64| {
        let wide = u128::from(a) * u128::from(b);
        (wide >> 64) as u64 ^ wide as u64
    };
    let place = |p: &Vec3| {
        let [x, y, z] = p.map(|c| (c + 0.0).to_bits());
        let [i, j, k] = [
            0x9e37_79b9_7f4a_7c15,
            0xd6e8_feb8_6659_fd93,
            0xbf58_476d_1ce4_e5b9,
        ];
        let xy = product(x ^ i, y ^ j);
        product(product(xy ^ j, z ^ k) ^ k, i)
    };
    let places: Vec<u64> = mesh.positions.par_iter().map(place).collect();
    // Two numbers of 63 bits, so that differences have a sign.
    let pair = |v: u32| {
        let a = places[v as usize];
        let b = (a ^ (a >> 29)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        ((a >> 1) as i64, ((b ^ (b >> 32)) >> 1) as i64)
    };
    let area = |a: i64, b: i64| i128::from(a) * i128::from(b);
    let around = |t: &[u32; 3]| {
        let [(a, a1), (b, b1), (c, c1)] = t.map(pair);
        area(a, b1 - c1)
            .wrapping_add(area(b, c1 - a1))
            .wrapping_add(area(c, a1 - b1))
    };
    let sum = mesh
        .triangles
        .par_chunks(1 << 14)
        .map(|chunk| chunk.iter().map(around).fold(0, i128::wrapping_add))
        .reduce(|| 0, i128::wrapping_add);
    sum == 0
}

impl Border {
    /// The border of a mesh after its patches are wound consistently; no edges where there is none.
    ///
    /// A patch is what hangs together by edges of exactly two triangles. Where it is wound
    /// consistently as stored it stays so; elsewhere the direction of the larger area wins.
    /// Cost: O(n log n) for a mesh with a border, one pass for one without.
    pub fn of(mesh: &Mesh, lattice: &Lattice) -> Self {
        if has_no_border(mesh) {
            return Border::default();
        }
        let place = identify(&mesh.positions);
        let mut halves = half_edges(mesh, &place);
        halves.par_sort_unstable();
        let reversed = wind(mesh, &halves);
        let mut edges = Vec::new();
        for group in halves.chunk_by(|a, b| a.0 == b.0) {
            let way =
                |h: &HalfEdge| h.forward() != reversed.get(h.triangle()).copied().unwrap_or(false);
            let sum: i64 = group.iter().map(|h| if way(h) { 1 } else { -1 }).sum();
            if sum != 0 {
                let ends = [group[0].0 >> 32, group[0].0 & 0xffff_ffff];
                let [a, b] = ends.map(|v| lattice.to_grid(mesh.positions[v as usize]));
                edges.push(Edge {
                    a,
                    b,
                    times: sum as f64,
                });
            }
        }
        Border { edges, reversed }
    }

    /// Number of border edges.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Number of triangles taken the other way round.
    pub fn reversed_count(&self) -> u64 {
        self.reversed.iter().filter(|r| **r).count() as u64
    }

    /// What the border takes from the crossings of the rows of one row of tiles `[ty, tz]`, by row
    /// and place; a row starts with 0 taken.
    pub fn steps(&self, at: [usize; 2], dims: [usize; 3]) -> Vec<Step> {
        if self.edges.is_empty() {
            return Vec::new();
        }
        let mut steps = Descent::through(&self.edges, tile_row(at, dims)).steps;
        steps.sort_unstable_by_key(|s| (s.row, s.x));
        // Only changes matter, and a row starts at 0.
        let mut kept: Vec<Step> = Vec::new();
        for step in steps {
            let before = kept
                .last()
                .filter(|k| k.row == step.row)
                .map_or(0, |k| k.doubled);
            if step.doubled != before {
                kept.push(step);
            }
        }
        kept
    }

    /// How many times [`Border::steps`] looks at an edge.
    #[cfg(test)]
    pub fn work(&self, at: [usize; 2], dims: [usize; 3]) -> u64 {
        Descent::through(&self.edges, tile_row(at, dims)).work
    }
}

/// The voxels of a row of tiles.
fn tile_row(at: [usize; 2], dims: [usize; 3]) -> Block {
    let lo = [0, at[0] * TILE, at[1] * TILE];
    let hi = [
        dims[0],
        dims[1].min(lo[1] + TILE),
        dims[2].min(lo[2] + TILE),
    ];
    Block {
        lo: lo.map(|c| c as u32),
        hi: hi.map(|c| c as u32),
    }
}

/// Twice a sum, rounded to an even number, or to an odd one where it is a half-integer up to rounding.
fn doubled(sum: f64) -> i64 {
    let twice = (2.0 * sum).round();
    if (2.0 * sum - twice).abs() <= TIE {
        twice as i64
    } else {
        2 * (sum + 0.5).floor() as i64
    }
}

/// An edge of a triangle: the places of its ends, smaller first; and triangle and direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge(u64, u64);

impl HalfEdge {
    fn triangle(&self) -> usize {
        (self.1 >> 1) as usize
    }

    fn forward(&self) -> bool {
        self.1 & 1 == 1
    }
}

/// The edges of all triangles but those with two corners at one place: what these have cancels, and
/// they would make an edge that two others share look as if it were shared by more.
fn half_edges(mesh: &Mesh, place: &[u32]) -> Vec<HalfEdge> {
    let of = |(t, corners): (usize, &[u32; 3])| {
        let at = corners.map(|v| u64::from(place[v as usize]));
        let is_flat = at[0] == at[1] || at[1] == at[2] || at[2] == at[0];
        let edge = move |i: usize| {
            let (a, b) = (at[i], at[(i + 1) % 3]);
            (!is_flat).then(|| {
                HalfEdge(
                    a.min(b) << 32 | a.max(b),
                    (t as u64) << 1 | u64::from(a < b),
                )
            })
        };
        [edge(0), edge(1), edge(2)].into_iter().flatten()
    };
    mesh.triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(of)
        .collect()
}

/// Which triangles to reverse so that patches are wound consistently; empty when none.
fn wind(mesh: &Mesh, halves: &[HalfEdge]) -> Vec<bool> {
    let pairs = || halves.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() == 2);
    if !pairs().any(|g| g[0].forward() == g[1].forward()) {
        return Vec::new();
    }
    // Union of triangles with the parity of the turns between them and their root.
    let mut parent: Vec<(u32, bool)> = (0..mesh.triangles.len() as u32)
        .map(|t| (t, false))
        .collect();
    for group in pairs() {
        let (a, b) = (
            root(&mut parent, group[0].triangle() as u32),
            root(&mut parent, group[1].triangle() as u32),
        );
        if a.0 != b.0 {
            let turned = a.1 ^ b.1 ^ (group[0].forward() == group[1].forward());
            parent[a.0.max(b.0) as usize] = (a.0.min(b.0), turned);
        }
    }
    let roots: Vec<(u32, bool)> = (0..parent.len() as u32)
        .map(|t| root(&mut parent, t))
        .collect();
    // Area for and against the root's own direction.
    let mut areas = vec![[0.0; 2]; roots.len()];
    for (t, (root, turned)) in roots.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        areas[*root as usize][usize::from(*turned)] += length(cross(sub(b, a), sub(c, a)));
    }
    roots
        .iter()
        .map(|(root, turned)| *turned != (areas[*root as usize][1] > areas[*root as usize][0]))
        .collect()
}

/// The root of a triangle's patch, and whether the triangle is turned against it; shortens the path.
fn root(parent: &mut [(u32, bool)], t: u32) -> (u32, bool) {
    let (mut at, mut turned) = (t, false);
    while parent[at as usize].0 != at {
        let (up, turn) = parent[at as usize];
        let (top, more) = parent[up as usize];
        parent[at as usize] = (top, turn ^ more);
        turned ^= turn ^ more;
        at = top;
    }
    (at, turned)
}
