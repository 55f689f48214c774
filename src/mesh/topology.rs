//! What kind of surface a mesh is, and what looks wrong with it.

use super::Mesh;
use super::identify::identify;
use crate::error::{Error, Result};
use crate::numeric::predicates::orient2d;
use crate::numeric::sums::sum_by;
use crate::numeric::vector::{Vec3, cross, dot, length, sub};
use crate::progress::Progress;
use crate::report::Warning;
use crate::spatial::local::{LocalFrame, exponent_above, times_power_of_two};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// Corners are numbered in 32 bits.
const MOST_TRIANGLES: usize = (u32::MAX / 3) as usize;

/// How often something was found, and where first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Found {
    /// How many there are.
    pub count: u64,
    /// The smallest index of a triangle (of a vertex, for vertices) that shows it, from 0.
    pub first: Option<u64>,
}

impl Found {
    fn add(&mut self, count: u64, index: u64) {
        self.count += count;
        self.first = Some(self.first.map_or(index, |first| first.min(index)));
    }

    fn once(index: u64) -> Found {
        Found {
            count: 1,
            first: Some(index),
        }
    }

    fn union(mut self, other: Found) -> Found {
        if let Some(first) = other.first {
            self.add(other.count, first);
        }
        self
    }

    /// The indices for which `holds`.
    fn among(count: usize, holds: impl Fn(usize) -> bool + Sync) -> Found {
        (0..count)
            .into_par_iter()
            .fold(Found::default, |mut found, i| {
                if holds(i) {
                    found.add(1, i as u64);
                }
                found
            })
            .reduce(Found::default, Found::union)
    }
}

/// The topology of a mesh, after vertices at bit-identical positions are taken for one.
///
/// Edges, fans and the Euler characteristic are those of the triangles that are not degenerate.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Topology {
    /// Distinct vertex positions.
    pub distinct_vertices: u64,
    /// Edges of triangles, each counted once.
    pub edges: u64,
    /// Vertices at the position of an earlier one.
    pub duplicate_vertices: Found,
    /// Vertices that no triangle, segment or point refers to.
    pub isolated_vertices: Found,
    /// Triangles with two corners at one position.
    pub degenerate_triangles: Found,
    /// Triangles whose three distinct corners lie exactly on a line.
    pub zero_area_triangles: Found,
    /// Triangles with the corners of an earlier one, in any order.
    pub duplicate_triangles: Found,
    /// Edges of one triangle.
    pub boundary_edges: Found,
    /// Edges of more than two triangles.
    pub non_manifold_edges: Found,
    /// Vertices whose triangles form more than one fan.
    pub non_manifold_vertices: Found,
    /// Edges whose triangles do not pair off in opposite directions: two that run the same way.
    pub inconsistent_edges: Found,
    /// Parts made of triangles and segments that share vertices.
    pub components: u64,
    /// Vertices - edges + triangles.
    pub euler_characteristic: i64,
    /// Whether there are triangles and every edge has two.
    pub closed: bool,
    /// Whether there are triangles and no edge is wound inconsistently.
    pub oriented: bool,
    /// Whether there are triangles, no edge has more than two, and every vertex has one fan.
    pub manifold: bool,
    /// Handles of the surface; null unless it is one closed, oriented manifold.
    pub genus: Option<i64>,
    /// Area of the triangles, in the square of the file's unit; null where it overflows.
    pub area: Option<f64>,
    /// Volume enclosed, in the cube of the file's unit; negative where the triangles face inwards,
    /// null unless every edge is used as often in one direction as in the other, and where it
    /// overflows.
    pub volume: Option<f64>,
    /// Smallest and largest coordinates of what triangles, segments and points use:
    /// `[[x, y, z], [x, y, z]]`, null where there is none. Isolated vertices are no part of the model.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Which of area and volume are larger than a double can be.
    #[serde(skip)]
    overflows: [bool; 2],
}

impl Topology {
    /// What looks wrong, as warnings for a report. A boundary alone is not wrong.
    pub fn warnings(&self) -> Vec<Warning> {
        let kinds = [
            (
                "degenerate-triangles",
                "triangles with two corners at one position",
                self.degenerate_triangles,
            ),
            (
                "zero-area-triangles",
                "triangles whose corners lie on a line",
                self.zero_area_triangles,
            ),
            (
                "duplicate-triangles",
                "triangles with the corners of an earlier one",
                self.duplicate_triangles,
            ),
            (
                "non-manifold-edges",
                "edges of more than two triangles",
                self.non_manifold_edges,
            ),
            (
                "non-manifold-vertices",
                "vertices whose triangles form more than one fan",
                self.non_manifold_vertices,
            ),
            (
                "inconsistent-winding",
                "edges whose triangles run along them the same way",
                self.inconsistent_edges,
            ),
            (
                "isolated-vertices",
                "vertices that nothing refers to",
                self.isolated_vertices,
            ),
        ];
        let figures = [
            ("area-overflows", "the area is larger than a number can be"),
            (
                "volume-overflows",
                "the volume is larger than a number can be",
            ),
        ];
        let overflows = figures.into_iter().zip(self.overflows);
        kinds
            .into_iter()
            .filter(|(_, _, found)| found.count > 0)
            .map(|(code, what, found)| Warning::new(code, what, found.count, found.first))
            .chain(
                overflows
                    .filter(|(_, overflows)| *overflows)
                    .map(|((code, what), _)| Warning::new(code, what, 1, None)),
            )
            .collect()
    }
}

/// Finds what kind of surface a mesh is and what looks wrong with it.
///
/// Errors when the mesh is not what [`Mesh::check`] promises, or has over 1.4e9 triangles. Decisions are exact for coordinates
/// whose products neither over- nor underflow once the largest is near 1. Cost: O(n log n), about
/// 100 bytes per triangle.
pub fn topology(mesh: &Mesh, progress: &dyn Progress) -> Result<Topology> {
    mesh.check().map_err(Error::Geometry)?;
    if mesh.triangles.len() > MOST_TRIANGLES || mesh.positions.len() > u32::MAX as usize {
        return Err(Error::Limit {
            what: "the topology of a mesh".to_owned(),
            needed: format!(
                "indices for {} triangles and {} vertices",
                mesh.triangles.len(),
                mesh.positions.len()
            ),
            limit: format!("{MOST_TRIANGLES} triangles and {} vertices", u32::MAX),
            hint: None,
        });
    }
    progress.stage("identify vertices", 0);
    let same = identify(&mesh.positions);
    let corners: Vec<[u32; 3]> = mesh
        .triangles
        .par_iter()
        .map(|t| t.map(|v| same[v as usize]))
        .collect();
    progress.stage("pair edges", 0);
    let degenerate_triangles = Found::among(corners.len(), |t| is_degenerate(corners[t]));
    let half_edges = sorted_half_edges(&corners);
    let edges = count_edges(&half_edges);
    progress.stage("join parts", 0);
    let (fans, components) = rayon::join(
        || count_fans(&corners, &half_edges, mesh.positions.len()),
        || count_components(mesh, &same),
    );
    progress.stage("measure", 0);
    let bounds = mesh.used_bounds();
    let (area, enclosed) = area_and_volume(mesh);
    let proper = corners.len() as u64 - degenerate_triangles.count;
    let euler_characteristic = fans.vertices as i64 - edges.count as i64 + proper as i64;
    let manifold = proper > 0 && edges.non_manifold.count == 0 && fans.non_manifold.count == 0;
    let is_solid = proper > 0 && edges.balanced;
    let closed = proper > 0 && edges.non_manifold.count == 0 && edges.boundary.count == 0;
    let oriented = proper > 0 && edges.inconsistent.count == 0;
    let one = manifold && closed && oriented && components == 1;
    let duplicate_vertices = Found::among(same.len(), |v| same[v] as usize != v);
    Ok(Topology {
        distinct_vertices: same.len() as u64 - duplicate_vertices.count,
        edges: edges.count,
        duplicate_vertices,
        isolated_vertices: isolated(mesh),
        degenerate_triangles,
        zero_area_triangles: collinear(mesh, &corners),
        duplicate_triangles: duplicates(&corners),
        boundary_edges: edges.boundary,
        non_manifold_edges: edges.non_manifold,
        non_manifold_vertices: fans.non_manifold,
        inconsistent_edges: edges.inconsistent,
        components,
        euler_characteristic,
        closed,
        oriented,
        manifold,
        genus: one.then_some(1 - euler_characteristic / 2),
        area: Some(area).filter(|area| area.is_finite()),
        volume: is_solid.then_some(enclosed).filter(|v| v.is_finite()),
        bounds: (!bounds.is_empty()).then_some([bounds.lo, bounds.hi]),
        overflows: [!area.is_finite(), is_solid && !enclosed.is_finite()],
    })
}

#[inline]
fn is_degenerate([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// A directed edge of a triangle, packed to sort by edge, then triangle: smaller vertex, larger
/// vertex, triangle, and whether it runs from the larger to the smaller.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge(u128);

impl HalfEdge {
    fn new(from: u32, to: u32, triangle: usize) -> Self {
        let edge = u128::from(from.min(to)) << 32 | u128::from(from.max(to));
        HalfEdge(edge << 64 | (triangle as u128) << 1 | u128::from(from > to))
    }

    #[inline]
    fn edge(self) -> u64 {
        (self.0 >> 64) as u64
    }

    #[inline]
    fn triangle(self) -> usize {
        (self.0 as u64 >> 1) as usize
    }

    /// The vertices of the edge, the smaller first.
    #[inline]
    fn ends(self) -> [u32; 2] {
        [(self.edge() >> 32) as u32, self.edge() as u32]
    }

    /// The vertex it runs from.
    #[inline]
    fn start(self) -> u32 {
        self.ends()[usize::from(self.is_reversed())]
    }

    #[inline]
    fn is_reversed(self) -> bool {
        self.0 & 1 == 1
    }
}

fn sorted_half_edges(corners: &[[u32; 3]]) -> Vec<HalfEdge> {
    let mut half_edges: Vec<HalfEdge> = corners
        .par_iter()
        .enumerate()
        .filter(|(_, c)| !is_degenerate(**c))
        .flat_map_iter(|(t, &[a, b, c])| {
            [(a, b), (b, c), (c, a)].map(|(from, to)| HalfEdge::new(from, to, t))
        })
        .collect();
    half_edges.par_sort_unstable();
    half_edges
}

#[derive(Default)]
struct Edges {
    count: u64,
    boundary: Found,
    non_manifold: Found,
    inconsistent: Found,
    /// Whether each edge is used as often in one direction as in the other.
    balanced: bool,
}

fn count_edges(half_edges: &[HalfEdge]) -> Edges {
    half_edges
        .par_chunk_by(|a, b| a.edge() == b.edge())
        .fold(
            || Edges {
                balanced: true,
                ..Edges::default()
            },
            |mut edges, run| {
                let first = run[0].triangle() as u64;
                let reversed = run.iter().filter(|h| h.is_reversed()).count();
                edges.count += 1;
                match run.len() {
                    1 => edges.boundary.add(1, first),
                    2 => {}
                    _ => edges.non_manifold.add(1, first),
                }
                let excess = (2 * reversed).abs_diff(run.len());
                if excess > 1 {
                    edges.inconsistent.add(1, first);
                }
                edges.balanced &= excess == 0;
                edges
            },
        )
        .reduce(
            || Edges {
                balanced: true,
                ..Edges::default()
            },
            |a, b| Edges {
                count: a.count + b.count,
                boundary: a.boundary.union(b.boundary),
                non_manifold: a.non_manifold.union(b.non_manifold),
                inconsistent: a.inconsistent.union(b.inconsistent),
                balanced: a.balanced && b.balanced,
            },
        )
}

/// Sets that are joined two at a time; the smallest member stands for a set.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Sets((0..count as u32).collect())
    }

    fn root(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            let above = self.0[member as usize];
            self.0[member as usize] = self.0[above as usize];
            member = above;
        }
        member
    }

    /// Whether they were apart.
    fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
        a != b
    }
}

struct Fans {
    /// Vertices that triangles use.
    vertices: u64,
    non_manifold: Found,
}

/// Counts the fans at each vertex: corners of triangles, joined across shared edges.
fn count_fans(corners: &[[u32; 3]], half_edges: &[HalfEdge], vertices: usize) -> Fans {
    let mut fans = vec![0u32; vertices];
    for half_edge in half_edges {
        // Each corner of a triangle is the start of one of its directed edges.
        fans[half_edge.start() as usize] += 1;
    }
    let corner_at = |half_edge: HalfEdge, v: u32| {
        let t = half_edge.triangle();
        let k = usize::from(corners[t][1] == v) + 2 * usize::from(corners[t][2] == v);
        (3 * t + k) as u32
    };
    let mut sets = Sets::new(3 * corners.len());
    for pair in half_edges.windows(2) {
        if pair[0].edge() != pair[1].edge() {
            continue;
        }
        for v in pair[0].ends() {
            if sets.join(corner_at(pair[0], v), corner_at(pair[1], v)) {
                fans[v as usize] -= 1;
            }
        }
    }
    Fans {
        vertices: fans.iter().filter(|f| **f > 0).count() as u64,
        non_manifold: Found::among(fans.len(), |v| fans[v] > 1),
    }
}

/// Counts the parts that triangles and segments join vertices into.
fn count_components(mesh: &Mesh, same: &[u32]) -> u64 {
    let mut used = vec![false; same.len()];
    let mut sets = Sets::new(same.len());
    let mut components = 0;
    let triangles = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c]]);
    for [a, b] in triangles.chain(mesh.segments.iter().copied()) {
        let (a, b) = (same[a as usize], same[b as usize]);
        for v in [a, b] {
            components += u64::from(!std::mem::replace(&mut used[v as usize], true));
        }
        components -= u64::from(sets.join(a, b));
    }
    components
}

fn isolated(mesh: &Mesh) -> Found {
    let used = mesh.used_vertices();
    Found::among(used.len(), |v| !used[v])
}

/// Triangles of three distinct corners on a line: those whose projections along all three axes
/// have no area.
fn collinear(mesh: &Mesh, corners: &[[u32; 3]]) -> Found {
    let largest = mesh.used_bounds();
    let size = (0..3)
        .map(|a| largest.lo[a].abs().max(largest.hi[a].abs()))
        .fold(0.0, f64::max);
    // A power of two for all, so that nothing is rounded: the predicate's products need room.
    let exponent = if size > 0.0 { exponent_above(size) } else { 0 };
    Found::among(corners.len(), |t| {
        if is_degenerate(corners[t]) {
            return false;
        }
        let [a, b, c] = mesh
            .corners(t)
            .map(|p| p.map(|x| times_power_of_two(x, -exponent)));
        [(0, 1), (1, 2), (2, 0)].into_iter().all(|(u, v)| {
            let flat = |p: Vec3| [p[u], p[v]];
            orient2d(flat(a), flat(b), flat(c)) == 0
        })
    })
}

fn duplicates(corners: &[[u32; 3]]) -> Found {
    let mut keys: Vec<u128> = corners
        .par_iter()
        .enumerate()
        .filter(|(_, c)| !is_degenerate(**c))
        .map(|(t, c)| {
            let mut c = *c;
            c.sort_unstable();
            c.into_iter().fold(0, |key, v| key << 32 | u128::from(v)) << 32 | t as u128
        })
        .collect();
    keys.par_sort_unstable();
    // Within equal corners the triangles are in order: all but the first repeat an earlier one.
    keys.par_windows(2)
        .filter(|pair| pair[0] >> 32 == pair[1] >> 32)
        .map(|pair| Found::once(u64::from(pair[1] as u32)))
        .reduce(Found::default, Found::union)
}

/// Area and signed volume, summed in a frame near the mesh.
fn area_and_volume(mesh: &Mesh) -> (f64, f64) {
    let frame = LocalFrame::around(mesh.used_bounds());
    let local = |t: &[u32; 3]| t.map(|v| frame.to_local(mesh.positions[v as usize]));
    let twice = sum_by(&mesh.triangles, |t| {
        let [a, b, c] = local(t);
        length(cross(sub(b, a), sub(c, a)))
    });
    let six_fold = sum_by(&mesh.triangles, |t| {
        let [a, b, c] = local(t);
        dot(a, cross(b, c))
    });
    (frame.area(twice / 2.0), frame.volume(six_fold / 6.0))
}

#[cfg(test)]
mod tests;
