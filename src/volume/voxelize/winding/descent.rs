//! From a box of voxels down to those that settle: which whole number the strips take where.

use super::edge::Edge;
use super::field::{Bounds, Field};
use super::{Step, TIE, doubled};
use crate::mesh::distance::point_segment;
use crate::numeric::vector::{Vec3, length, sub};
use crate::volume::octree::TILE;

/// How much of a winding number all edges may be off that are known by their summed field only.
const FAR: f64 = 2e-3;
/// The part of what is left of it that one box may use.
const SHARE: f64 = 0.25;
/// Rounding of one edge's solid angle, generously.
const ROUNDING: f64 = 1e-12;
/// Edges nearer to a box than this share of its size, or of their own distance, are followed as if
/// they met it.
const TOUCHING: (f64, f64) = (1e-3, 1e-12);
/// The eye looks from so far beside the middle of a box, lest it meet edges on the lattice.
const BESIDE: Vec3 = [0.010_471, 0.013_817, 0.008_923];

/// A box of voxels, `hi` not included.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// First voxel.
    pub lo: [u32; 3],
    /// Behind the last voxel.
    pub hi: [u32; 3],
}

impl Block {
    fn size(&self) -> [u32; 3] {
        std::array::from_fn(|a| self.hi[a] - self.lo[a])
    }

    /// The box cut in half along its longest axis and those more than half as long.
    fn parts(&self) -> impl Iterator<Item = Block> {
        let (block, size) = (*self, self.size());
        let longest = size[0].max(size[1]).max(size[2]);
        let cut = size.map(|s| s > 1 && 2 * s > longest);
        (0..8u32).filter_map(move |part| {
            let mut half = block;
            for a in 0..3 {
                let upper = part >> a & 1 == 1;
                let middle = block.lo[a] + size[a] / 2;
                match (cut[a], upper) {
                    (true, false) => half.hi[a] = middle,
                    (true, true) => half.lo[a] = middle,
                    (false, true) => return None,
                    (false, false) => {}
                }
            }
            Some(half)
        })
    }
}

/// The space around a box's voxel centres.
#[derive(Debug, Clone, Copy)]
struct Hull {
    /// Its middle, from which the eye looks.
    at: Vec3,
    /// How far it reaches along each axis, both ways.
    extent: Vec3,
    radius: f64,
}

impl Hull {
    fn of(block: &Block) -> Self {
        let size = block.size();
        let middle = |a: usize| 0.5 * (f64::from(block.lo[a]) + f64::from(block.hi[a]));
        let (mut at, mut extent) = (std::array::from_fn(middle), [0.0; 3]);
        if size != [1; 3] {
            for a in 0..3 {
                at[a] += BESIDE[a];
                // The same excess at any size keeps the hulls of parts within that of the whole.
                extent[a] = 0.5 * f64::from(size[a] - 1) + BESIDE[a];
            }
        }
        Hull {
            at,
            extent,
            radius: length(extent),
        }
    }

    /// A lower bound on how far an edge is away; `None` where it may meet the hull.
    fn distance(&self, edge: &Edge) -> Option<f64> {
        let from_middle = point_segment(self.at, edge.a, edge.b)
            .distance_squared
            .sqrt();
        let apart: Vec3 = std::array::from_fn(|a| {
            let below = edge.a[a].min(edge.b[a]) - self.at[a];
            let above = self.at[a] - edge.a[a].max(edge.b[a]);
            (below.max(above) - self.extent[a]).max(0.0)
        });
        // A row of voxels is much thinner than the ball around it.
        let distance = (from_middle - self.radius).max(length(apart));
        let reach = length(sub(edge.a, self.at)) + length(sub(edge.b, self.at));
        (distance > TOUCHING.0 * self.radius + TOUCHING.1 * reach).then_some(distance)
    }

    /// Whether the strip of an edge may be between the hull's points.
    fn may_be_crossed(&self, edge: &Edge) -> bool {
        let (Edge { a, b, .. }, c, e) = (edge, self.at, self.extent);
        let meets = |i: usize| a[i].min(b[i]) <= c[i] + e[i] && a[i].max(b[i]) >= c[i] - e[i];
        if a[0].min(b[0]) > c[0] + e[0] || !meets(1) || !meets(2) {
            return false;
        }
        // Seen along x, the edge's line must pass between the hull's corners.
        let (y, z) = (b[1] - a[1], b[2] - a[2]);
        let (dy, dz) = (c[1] - a[1], c[2] - a[2]);
        let slack = 1e-12 * (y.abs() + z.abs()) * (dy.abs() + dz.abs() + e[1] + e[2]);
        (y * dz - z * dy).abs() <= y.abs() * e[2] + z.abs() * e[1] + slack
    }
}

/// What is known at the middle of a box.
struct Node {
    at: Vec3,
    /// What all strips together take there.
    value: f64,
    /// The error of `value`.
    slack: f64,
    /// The field of the edges that are not followed any more.
    field: Field,
    /// Edges that may meet the box.
    touching: Vec<u32>,
    /// Other edges that are followed one by one.
    near: Vec<u32>,
    /// Edges whose strips may cross the box.
    strips: Vec<u32>,
}

/// An edge apart from a box.
struct Apart {
    index: u32,
    /// Its error if it is left to the field.
    error: f64,
    bounds: Bounds,
}

/// The search through one row of tiles.
pub struct Descent<'a> {
    edges: &'a [Edge],
    /// The first row, y and z.
    origin: [u32; 2],
    /// What was found, in no order.
    pub steps: Vec<Step>,
    /// How many times an edge was looked at.
    pub evaluations: u64,
}

impl<'a> Descent<'a> {
    /// Settles all voxels of a row of tiles.
    pub fn through(edges: &'a [Edge], block: Block) -> Self {
        let mut descent = Descent {
            edges,
            origin: [block.lo[1], block.lo[2]],
            steps: Vec::new(),
            evaluations: 0,
        };
        let at = Hull::of(&block).at;
        let all: Vec<u32> = (0..edges.len() as u32).collect();
        let (value, slack) = descent.afresh(at);
        let root = Node {
            at,
            value,
            slack,
            field: Field::default(),
            touching: Vec::new(),
            near: all.clone(),
            strips: all,
        };
        descent.visit(&block, &root);
        descent
    }

    fn edge(&self, index: &u32) -> &'a Edge {
        &self.edges[*index as usize]
    }

    /// What all strips together take at a point, and its error.
    fn afresh(&mut self, p: Vec3) -> (f64, f64) {
        self.evaluations += self.edges.len() as u64;
        let taken: f64 = self.edges.iter().map(|e| e.taken(p)).sum();
        let times: f64 = self.edges.iter().map(|e| e.times.abs()).sum();
        (taken, TIE + times * ROUNDING)
    }

    /// Settles a box, or its parts.
    fn visit(&mut self, block: &Block, from: &Node) {
        let hull = Hull::of(block);
        let mut node = self.moved(from, hull.at);
        if block.size() == [1; 3] {
            let taken = match whole(node.value, node.slack) {
                Some(whole) => 2 * whole,
                // What was left out on the way decides here, so nothing is.
                None => doubled(self.afresh(hull.at).0),
            };
            self.push([block.lo[1], block.lo[2]], block.lo[0], taken);
            return;
        }
        let near = self.gather(&mut node, from, &hull);
        match self.settle(&node, &near, &hull) {
            Some(whole) => self.push_rows(block, &node, &hull, whole),
            None => {
                for part in block.parts() {
                    self.visit(&part, &node);
                }
            }
        }
    }

    /// What is known at a point, from what is known at another of the same box.
    fn moved(&mut self, from: &Node, to: Vec3) -> Node {
        let way = sub(to, from.at);
        let field = from.field.moved(way);
        let (value, slack) = match way == [0.0; 3] {
            true => (from.value, from.slack),
            false => self.followed(from, to).unwrap_or_else(|| self.afresh(to)),
        };
        Node {
            at: to,
            value,
            slack,
            field,
            touching: Vec::new(),
            near: Vec::new(),
            strips: Vec::new(),
        }
    }

    /// What the strips take at a point and its error; `None` where rounding may decide on which side
    /// of an edge the way there runs.
    fn followed(&mut self, from: &Node, to: Vec3) -> Option<(f64, f64)> {
        self.evaluations += (from.touching.len() + from.near.len()) as u64;
        let way = sub(to, from.at);
        let mut value = from.value + from.field.swept(way);
        let mut slack = from.slack + from.field.error(length(way));
        for edge in from.touching.iter().map(|e| self.edge(e)) {
            let swept = edge.swept_near(from.at, to)?;
            value += swept.value;
            // Once more for what was computed afresh at the start.
            slack += 2.0 * swept.rounding;
        }
        for edge in from.near.iter().map(|e| self.edge(e)) {
            value += edge.swept(from.at, to);
            slack += ROUNDING * edge.times.abs();
        }
        for edge in from.strips.iter().map(|e| self.edge(e)) {
            value += edge.times * f64::from(edge.jump(from.at, to));
        }
        Some((value, slack))
    }

    /// Sorts the edges of a box: what meets it, what is so far that its field does for all that is
    /// in the box, and the others, which are returned.
    fn gather(&mut self, node: &mut Node, from: &Node, hull: &Hull) -> Vec<Apart> {
        self.evaluations += (from.touching.len() + from.near.len()) as u64;
        let mut apart = Vec::with_capacity(from.near.len());
        for index in from.touching.iter().chain(&from.near) {
            let edge = self.edge(index);
            match hull.distance(edge) {
                None => node.touching.push(*index),
                Some(distance) => {
                    let bounds = Bounds::new(edge, hull.at, distance);
                    apart.push(Apart {
                        index: *index,
                        error: bounds.error(hull.radius),
                        bounds,
                    });
                }
            }
        }
        apart.sort_unstable_by(|a, b| {
            a.error
                .total_cmp(&b.error)
                .then_with(|| a.index.cmp(&b.index))
        });
        let mut budget = SHARE * (FAR - node.slack - node.field.error(hull.radius));
        let mut far = 0;
        for edge in &apart {
            budget -= edge.error;
            if budget < 0.0 {
                break;
            }
            node.field
                .add(self.edge(&edge.index), hull.at, &edge.bounds);
            far += 1;
        }
        let near = apart.split_off(far);
        node.near = near.iter().map(|e| e.index).collect();
        let crossed = |e: &&u32| hull.may_be_crossed(self.edge(e));
        node.strips = from.strips.iter().filter(crossed).copied().collect();
        near
    }

    /// What the strips take in the whole box, rounded, as seen from its middle without their jumps.
    fn settle(&self, node: &Node, near: &[Apart], hull: &Hull) -> Option<i64> {
        if !node.touching.is_empty() {
            return None;
        }
        let mut open = node.slack + node.field.error(hull.radius);
        open += near
            .iter()
            .map(|e| e.error.min(e.bounds.field * hull.radius))
            .sum::<f64>();
        // The fields can only add to what is open.
        whole(node.value, open)?;
        let mut field = node.field;
        for edge in near {
            if edge.error < edge.bounds.field * hull.radius {
                field.add_exact(self.edge(&edge.index), hull.at);
            }
        }
        whole(node.value, open + field.range(hull.extent))
    }

    fn push(&mut self, [y, z]: [u32; 2], x: u32, doubled: i64) {
        let row = (z - self.origin[1]) * TILE as u32 + (y - self.origin[0]);
        self.steps.push(Step { row, x, doubled });
    }

    /// Notes what is taken in the rows of a settled box, which no edge meets.
    ///
    /// The way from the middle of the box to a row runs along y first and then along z.
    fn push_rows(&mut self, block: &Block, node: &Node, hull: &Hull, whole: i64) {
        let [_, rows_y, rows_z] = block.size().map(|s| s as usize);
        let mut jumps = vec![0i64; rows_y * rows_z];
        let centre = |c: u32| f64::from(c) + 0.5;
        let [x, _, from_z] = hull.at;
        let lowest = centre(block.lo[2]).min(from_z);
        let highest = centre(block.hi[2] - 1).max(from_z);
        for edge in node.strips.iter().map(|e| self.edge(e)) {
            let times = edge.times as i64;
            for (j, y) in (block.lo[1]..block.hi[1]).map(centre).enumerate() {
                let corner = [x, y, from_z];
                let to_column = i64::from(edge.jump(hull.at, corner));
                let along = edge.jump([x, y, lowest], [x, y, highest]);
                if to_column == 0 && along == 0 {
                    continue;
                }
                let side = edge.turn(corner);
                for (k, z) in (block.lo[2]..block.hi[2]).map(centre).enumerate() {
                    // A strip crosses a column once at most.
                    let in_column = match along {
                        0 => 0,
                        _ => i64::from(edge.turn([x, y, z]) - side) / 2,
                    };
                    jumps[k * rows_y + j] += times * (to_column + in_column);
                }
            }
        }
        for (z, row) in (block.lo[2]..).zip(jumps.chunks(rows_y)) {
            for (y, jump) in (block.lo[1]..).zip(row) {
                self.push([y, z], block.lo[0], 2 * (whole + jump));
            }
        }
    }
}

/// A value rounded, half a number up, where it can be off by `open` without changing that.
fn whole(value: f64, open: f64) -> Option<i64> {
    let (low, high) = ((value + 0.5 - open).floor(), (value + 0.5 + open).floor());
    (low == high).then_some(low as i64)
}
