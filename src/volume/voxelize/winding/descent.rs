//! From a box of voxels down to those that settle: which whole number the strips take where.

use super::edge::Edge;
use super::field::{Bounds, Field};
use super::{Step, TIE, doubled};
use crate::mesh::distance::point_segment;
use crate::numeric::vector::{Vec3, length, sub};
use crate::volume::octree::TILE;

/// How much of a winding number all edges may be off that are known by their summed field only, in a
/// voxel. In a larger box it is less, so that a voxel which does not settle can ask larger boxes.
const FAR: f64 = 0.3;
/// The part of what is left of it that one box may use.
const SHARE: f64 = 0.5;
/// Rounding of one edge's solid angle, generously.
const ROUNDING: f64 = 1e-12;
/// The share of that for voxels that do not settle with it.
const FINE: f64 = 0.1;
/// What it costs to follow an edge, one that may be met, and to split a box for each edge near it,
/// over the cost of following the summed field.
const COSTS: [usize; 3] = [6, 20, 150];
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

    /// How much of a winding number the edges may be off that are known by their field.
    fn far(&self) -> f64 {
        let size = 1.0 + self.radius;
        FAR / (size * size.sqrt())
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
struct Node<'p> {
    /// What was known of the box that this one is a part of.
    whole: Option<&'p Node<'p>>,
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
    #[cfg(test)]
    pub work: u64,
}

impl<'a> Descent<'a> {
    /// Settles all voxels of a row of tiles.
    pub fn through(edges: &'a [Edge], block: Block) -> Self {
        let mut descent = Descent {
            edges,
            origin: [block.lo[1], block.lo[2]],
            steps: Vec::new(),
            #[cfg(test)]
            work: 0,
        };
        let at = Hull::of(&block).at;
        let all: Vec<u32> = (0..edges.len() as u32).collect();
        let (value, slack) = descent.afresh(at);
        let root = Node {
            whole: None,
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

    /// Notes that this many edges were looked at.
    fn note(&mut self, _edges: usize) {
        #[cfg(test)]
        {
            self.work += _edges as u64;
        }
    }

    /// What all strips together take at a point, and its error.
    fn afresh(&mut self, p: Vec3) -> (f64, f64) {
        self.note(self.edges.len());
        let taken: f64 = self.edges.iter().map(|e| e.taken(p)).sum();
        let times: f64 = self.edges.iter().map(|e| e.times.abs()).sum();
        (taken, TIE + times * ROUNDING)
    }

    /// Settles a box, or its parts.
    fn visit(&mut self, block: &Block, from: &Node) {
        let hull = Hull::of(block);
        if block.size() == [1; 3] {
            let taken = self.voxel(hull.at, from);
            self.push([block.lo[1], block.lo[2]], block.lo[0], taken);
            return;
        }
        let mut node = self.moved(from, hull.at);
        let near = self.gather(&mut node, from, &hull);
        if !self.settle(block, &node, &near, &hull) {
            for part in block.parts() {
                self.visit(&part, &node);
            }
        }
    }

    /// What is taken at a voxel's centre; see [`Step::doubled`].
    fn voxel(&mut self, at: Vec3, from: &Node) -> i64 {
        let mut from = Some(from);
        // What was left to the field may decide here; then larger boxes know better, at more cost.
        while let Some(node) = from {
            if 2 * (node.touching.len() + node.near.len()) > self.edges.len() {
                break;
            }
            let followed = self.followed(node, at);
            if let Some(whole) = followed.and_then(|(value, slack)| whole(value, slack)) {
                return 2 * whole;
            }
            from = node.whole;
        }
        doubled(self.afresh(at).0)
    }

    /// What is known at a point, from what is known at another of the same box.
    fn moved<'p>(&mut self, from: &'p Node<'p>, to: Vec3) -> Node<'p> {
        let way = sub(to, from.at);
        let field = from.field.moved(way);
        let (value, slack) = match way == [0.0; 3] {
            true => (from.value, from.slack),
            false => self.followed(from, to).unwrap_or_else(|| self.afresh(to)),
        };
        Node {
            whole: Some(from),
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
        self.note(from.touching.len() + from.near.len());
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
        self.note(from.touching.len() + from.near.len());
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
        let mut budget = SHARE * (hull.far() - node.slack - node.field.error(hull.radius));
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

    /// Notes what the strips take in a box, unless that has to be seen from nearer.
    fn settle(&mut self, block: &Block, node: &Node, near: &[Apart], hull: &Hull) -> bool {
        if node.touching.is_empty()
            && let Some(whole) = self.uniform(node, near, hull)
        {
            self.push_rows(block, node, hull, whole);
            return true;
        }
        self.scan(block, node, near, hull)
    }

    /// What the strips take in a whole box, rounded, as seen from its middle without their jumps.
    fn uniform(&self, node: &Node, near: &[Apart], hull: &Hull) -> Option<i64> {
        let change = |e: &Apart| e.bounds.field * hull.radius;
        let bounds: f64 = near.iter().map(|e| e.error.min(change(e))).sum();
        let open = node.slack + node.field.error(hull.radius) + bounds;
        // The fields can only add to what is open.
        whole(node.value, open)?;
        let mut field = node.field;
        for edge in near.iter().filter(|e| e.error < change(e)) {
            field.add_exact(self.edge(&edge.index), hull.at);
        }
        whole(node.value, open + field.range(hull.extent))
    }

    /// Settles the voxels of a box one by one, where that is less work than to split it: only the
    /// nearest edges are followed to each, and the others by their summed field.
    fn scan(&mut self, block: &Block, node: &Node, near: &[Apart], hull: &Hull) -> bool {
        let size = block.size().map(|s| s as usize);
        let [follow, touch, split] = COSTS;
        let by_field = within(near, hull.far());
        let each = 1 + follow * (near.len() - by_field) + touch * node.touching.len();
        let edges = near.len() + node.touching.len();
        if size[0] * size[1] * size[2] * each > split * edges {
            return false;
        }
        // Voxels near to a half follow more edges, before they follow all of this box.
        let fine = self.coarser(node, near, hull, within(near, FINE * hull.far()));
        let coarse = Node {
            whole: Some(&fine),
            ..self.coarser(node, near, hull, by_field)
        };
        for z in block.lo[2]..block.hi[2] {
            for y in block.lo[1]..block.hi[1] {
                let mut last = None;
                for x in block.lo[0]..block.hi[0] {
                    let at = [x, y, z].map(|c| f64::from(c) + 0.5);
                    let taken = self.voxel(at, &coarse);
                    if last != Some(taken) {
                        self.push([y, z], x, taken);
                        last = Some(taken);
                    }
                }
            }
        }
        true
    }

    /// The same knowledge of a box with the first `by_field` of its near edges left to the field.
    fn coarser<'p>(
        &mut self,
        node: &'p Node<'p>,
        near: &[Apart],
        hull: &Hull,
        by_field: usize,
    ) -> Node<'p> {
        let mut field = node.field;
        for edge in &near[..by_field] {
            field.add(self.edge(&edge.index), hull.at, &edge.bounds);
        }
        self.note(by_field);
        Node {
            whole: Some(node),
            field,
            touching: node.touching.clone(),
            near: node.near[by_field..].to_vec(),
            strips: node.strips.clone(),
            ..*node
        }
    }

    fn push(&mut self, [y, z]: [u32; 2], x: u32, doubled: i64) {
        let row = (z - self.origin[1]) * TILE as u32 + (y - self.origin[0]);
        self.steps.push(Step { row, x, doubled });
    }

    /// Notes what is taken in the rows of a box, if the smooth part of it is `whole` in all.
    fn push_rows(&mut self, block: &Block, node: &Node, hull: &Hull, whole: i64) {
        let rows_y = block.size()[1] as usize;
        let jumps = self.jumps(block, node, hull);
        for (z, row) in (block.lo[2]..).zip(jumps.chunks(rows_y)) {
            for (y, jump) in (block.lo[1]..).zip(row) {
                self.push([y, z], block.lo[0], 2 * (whole + jump));
            }
        }
    }

    /// By how much the strips jump from the middle of a box, which no edge meets, to its rows.
    ///
    /// The way from the middle of the box to a row runs along y first and then along z.
    fn jumps(&self, block: &Block, node: &Node, hull: &Hull) -> Vec<i64> {
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
        jumps
    }
}

/// How many of the edges may be left to the field, the farthest first, with this error together.
fn within(near: &[Apart], error: f64) -> usize {
    let mut sum = 0.0;
    near.iter()
        .take_while(|e| {
            sum += e.error;
            sum <= error
        })
        .count()
}

/// A value rounded, half a number up, where it can be off by `open` without changing that.
fn whole(value: f64, open: f64) -> Option<i64> {
    let (low, high) = ((value + 0.5 - open).floor(), (value + 0.5 + open).floor());
    (low == high).then_some(low as i64)
}
