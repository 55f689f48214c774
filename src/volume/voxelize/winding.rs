//! The winding number of surfaces that are open or wound inconsistently.
//!
//! The generalised winding number (Jacobson, Kavan, Sorkine-Hornung 2013) of a point is the solid
//! angle of the surface over 4 pi. Closing the surface by strips from each border edge to infinity
//! along +x makes it a whole number, which the signed crossings of the line from the point towards
//! -x count exactly: that line runs beside the strips and never through one. What is left is the
//! solid angle of the strips, in closed form per border edge. So the cost follows the length of the
//! border and not the area of the surface, nothing is approximated by expansions, and only whether
//! it exceeds a half-integer has to be known: whole boxes of voxels are settled at once by a bound on
//! its gradient (Biot and Savart's law for the border as a wire), and from box to smaller box only
//! the edges near enough to change it much are followed.

use super::kernel::beside;
use super::lattice::Lattice;
use crate::mesh::Mesh;
use crate::mesh::distance::point_segment;
use crate::mesh::identify::identify;
use crate::numeric::vector::{Vec3, cross, dot, length, sub};
use crate::volume::octree::TILE;
use rayon::prelude::*;
use std::f64::consts::PI;

/// How much of a winding number all edges that are not followed may be off together: a tenth, so that
/// a point far from the border is settled without them.
const FAR: f64 = 0.1;
/// A winding number this near to a half is one: centres in the plane of an opening.
const TIE: f64 = 1e-9;
/// Rounding of one edge's solid angle, generously.
const ROUNDING: f64 = 1e-12;

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

/// A border edge in grid coordinates; it counts `times`-fold.
#[derive(Debug, Clone, Copy)]
struct Edge {
    a: Vec3,
    b: Vec3,
    times: f64,
}

/// A box of voxels, `hi` not included.
#[derive(Debug, Clone, Copy)]
struct Block {
    lo: [u32; 3],
    hi: [u32; 3],
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
        let lo = [0, at[0] * TILE, at[1] * TILE];
        let hi = [
            dims[0],
            dims[1].min(lo[1] + TILE),
            dims[2].min(lo[2] + TILE),
        ];
        let block = Block {
            lo: lo.map(|c| c as u32),
            hi: hi.map(|c| c as u32),
        };
        let mut steps = Vec::new();
        let mut stack = vec![self.afresh(block)];
        while let Some(task) = stack.pop() {
            match self.settle(&task) {
                Settled::All(doubled) => {
                    let block = task.block;
                    for z in block.lo[2]..block.hi[2] {
                        for y in block.lo[1]..block.hi[1] {
                            let row = (z - lo[2] as u32) * TILE as u32 + (y - lo[1] as u32);
                            steps.push(Step {
                                row,
                                x: block.lo[0],
                                doubled,
                            });
                        }
                    }
                }
                Settled::Split(halves) => stack.extend(halves),
            }
        }
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

    /// A box of which nothing is known.
    fn afresh(&self, block: Block) -> Task {
        Task {
            block,
            near: (0..self.edges.len() as u32).collect(),
            known: None,
            slack: 0.0,
        }
    }

    /// What all strips together take at a point.
    fn taken(&self, p: Vec3) -> f64 {
        self.edges.iter().map(|e| e.taken(p)).sum()
    }

    /// Settles a box, or says how to split it.
    fn settle(&self, task: &Task) -> Settled {
        let block = &task.block;
        let size: [u32; 3] = std::array::from_fn(|a| block.hi[a] - block.lo[a]);
        let centre: Vec3 =
            std::array::from_fn(|a| 0.5 * (f64::from(block.lo[a]) + f64::from(block.hi[a])));
        let edge = |index: &u32| &self.edges[*index as usize];
        let one_row = size[1] == 1 && size[2] == 1;
        if !one_row && task.near.iter().any(|e| edge(e).may_cross(block)) {
            // The sum jumps at the strips: the box must get narrower before it says anything.
            let axis = if size[2] > size[1] { 2 } else { 1 };
            return Settled::Split(block.halves(axis).map(|half| self.afresh(half)));
        }
        let value = match task.known {
            None => self.taken(centre),
            Some((from, value)) => {
                let swept = task.near.iter().map(|e| edge(e).swept(from, centre));
                value + swept.sum::<f64>()
            }
        };
        let radius = 0.5 * length(size.map(|s| f64::from(s - 1)));
        let share = 0.5 * (FAR - task.slack).max(0.0) / task.near.len().max(1) as f64;
        let mut slack = task.slack + task.near.len() as f64 * ROUNDING;
        let mut bound = 0.0;
        let mut rest = Vec::with_capacity(task.near.len());
        for index in &task.near {
            let change = edge(index).change(block, centre, radius);
            if change <= share {
                slack += change;
            } else {
                bound += change;
                rest.push(*index);
            }
        }
        let (total, open) = (value + 0.5, slack + bound);
        let (low, high) = ((total - open).floor(), (total + open).floor());
        if low == high {
            return Settled::All(2 * low as i64);
        }
        if size == [1; 3] {
            // What was left out on the way decides here, so nothing is.
            return Settled::All(doubled(self.taken(centre)));
        }
        let axis = (0..3).max_by_key(|a| (size[*a], 3 - *a)).unwrap_or(0);
        Settled::Split(block.halves(axis).map(|half| {
            // So near an edge rounding could sweep it past the wrong side of a centre, unless the
            // rows' own sides decide.
            if bound == f64::INFINITY && !one_row {
                return self.afresh(half);
            }
            Task {
                block: half,
                near: rest.clone(),
                known: Some((centre, value)),
                slack,
            }
        }))
    }
}

/// A box to be settled, and what is known from the box it is a half of.
struct Task {
    block: Block,
    /// The edges that change the sum by more than the slack within the box.
    near: Vec<u32>,
    /// A point and the sum of all edges there.
    known: Option<(Vec3, f64)>,
    /// How much the other edges change the sum from that point to any of the box, and rounding.
    slack: f64,
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

/// What came of a box.
enum Settled {
    /// All its centres have this taken; see [`Step::doubled`].
    All(i64),
    /// Look at the halves.
    Split([Task; 2]),
}

impl Block {
    /// The two halves along an axis.
    fn halves(&self, axis: usize) -> [Block; 2] {
        let middle = self.lo[axis] + (self.hi[axis] - self.lo[axis]) / 2;
        let mut halves = [*self; 2];
        halves[0].hi[axis] = middle;
        halves[1].lo[axis] = middle;
        halves
    }
}

impl Edge {
    /// The share of the strip from this edge to infinity along +x in the winding number at `p`.
    fn taken(&self, p: Vec3) -> f64 {
        let (u, v) = (sub(self.a, p), sub(self.b, p));
        let (lu, lv) = (length(u), length(v));
        // The strip is wound against the edge: b, a, infinity.
        let turn = beside([self.b[1], self.b[2]], [self.a[1], self.a[2]], [p[1], p[2]]);
        if turn == 0 || lu == 0.0 || lv == 0.0 {
            return 0.0;
        }
        // On the ray from an end the strip takes what it takes beside it, on the side to which
        // `beside` moves the point, +y: half of the lune between the ray and the strip.
        let on_ray = |w: Vec3| w[1] == 0.0 && w[2] == 0.0 && w[0] < 0.0;
        for (end, other) in [(u, v), (v, u)] {
            if on_ray(end) {
                let lune = other[2].abs().atan2(-other[1]);
                return self.times * lune * f64::from(turn) / (2.0 * PI);
            }
        }
        // Van Oosterom and Strackee (1983), with the unit vector of +x as the third corner.
        // The exact turn gives the sign, also to a volume that is rounding error or 0.
        let volume = cross(v, u)[0].abs() / (lu * lv);
        let cosines = 1.0 + dot(u, v) / (lu * lv) + u[0] / lu + v[0] / lv;
        self.times * volume.copysign(f64::from(turn)).atan2(cosines) / (2.0 * PI)
    }

    /// The share of the parallelogram that this edge sweeps when `from` moves to `to` and the edge
    /// is seen from it.
    ///
    /// Summed over a closed border this is the change of the sum of [`Edge::taken`]; edge by edge it
    /// is not, since a strip also turns with the rays that bound it, which cancel only among
    /// neighbours. So far edges can be left out here and not there.
    fn swept(&self, from: Vec3, to: Vec3) -> f64 {
        if from[1] == to[1] && from[2] == to[2] {
            // The rays stay in their lines, and the strips know on which side of the row they run.
            return self.taken(to) - self.taken(from);
        }
        let [a, b] = [sub(self.a, from), sub(self.b, from)];
        let [a1, b1] = [sub(self.a, to), sub(self.b, to)];
        self.times * (half_angle(a, b, b1) + half_angle(a, b1, a1)) / (2.0 * PI)
    }

    /// A bound on the size of [`Edge::swept`] from the middle of a box to any centre in it, infinite
    /// where the edge may run between them.
    fn change(&self, block: &Block, centre: Vec3, radius: f64) -> f64 {
        let to_ball = point_segment(centre, self.a, self.b)
            .distance_squared
            .sqrt()
            - radius;
        // A row of voxels is much thinner than the ball around it.
        let apart = |a: usize| {
            let (low, high) = (f64::from(block.lo[a]) + 0.5, f64::from(block.hi[a]) - 0.5);
            let below = self.a[a].min(self.b[a]) - high;
            below.max(low - self.a[a].max(self.b[a])).max(0.0)
        };
        let distance = to_ball.max(length([apart(0), apart(1), apart(2)]));
        if distance <= 0.0 {
            return f64::INFINITY;
        }
        self.times.abs() * length(sub(self.b, self.a)) * radius / (4.0 * PI * distance * distance)
    }

    /// Whether the strip may run between the rows of a box.
    fn may_cross(&self, block: &Block) -> bool {
        (1..3).all(|a| {
            let (low, high) = (f64::from(block.lo[a]) + 0.5, f64::from(block.hi[a]) - 0.5);
            self.a[a].min(self.b[a]) <= high && self.a[a].max(self.b[a]) >= low
        })
    }
}

/// Half the solid angle of a triangle at the origin (Van Oosterom and Strackee 1983).
fn half_angle(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    let [la, lb, lc] = [a, b, c].map(length);
    let cosines = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    dot(a, cross(b, c)).atan2(cosines)
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

fn half_edges(mesh: &Mesh, place: &[u32]) -> Vec<HalfEdge> {
    let of = |(t, corners): (usize, &[u32; 3])| {
        let at = corners.map(|v| u64::from(place[v as usize]));
        let edge = move |i: usize| {
            let (a, b) = (at[i], at[(i + 1) % 3]);
            (a != b).then(|| {
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
