//! Rays through the octree.

use super::Octree;
use crate::numeric::vector::Vec3;
use crate::volume::trace::{GridRay, Visits};

/// Most levels of nodes: the root of a grid of [`super::MAX_DIM`] voxels down to edge 8.
const DEPTH: usize = 14;

/// Levels of the tree of a grid of 512 voxels along a side.
const SHALLOW: usize = 7;

/// Slices that the profile of a node tells apart.
const SLICES: usize = 64;

/// The children of a node on the far side of its middle across x, y and z, where child 0 is the one
/// that the ray comes to first.
const FAR: [u8; 3] = [0b1010_1010, 0b1100_1100, 0b1111_0000];

/// An octree laid out for rays.
#[derive(Debug)]
pub struct RayTree<'a> {
    tree: &'a Octree,
    levels: Vec<Vec<Node>>,
}

/// A node of the octree, all of it in one place.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// Which slices across z hold a set voxel: one bit per slice of a node of up to 64 voxels, one
    /// per 64th of a larger one.
    profile: u64,
    first: u32,
    mixed: u8,
    full: u8,
}

/// The parameters at which a ray enters and leaves the swollen slabs of a cube.
#[derive(Debug, Clone, Copy, Default)]
struct Span {
    enter: Vec3,
    leave: Vec3,
}

impl Span {
    /// The parameters within reach at which the ray is in the cube.
    #[inline]
    fn within(&self, reach: [f64; 2]) -> [f64; 2] {
        let [x, y, z] = self.enter;
        let start = reach[0].max(x).max(y).max(z);
        let [x, y, z] = self.leave;
        [start, reach[1].min(x).min(y).min(z)]
    }
}

/// A node on the way down, and its children that are still to be visited.
#[derive(Clone, Copy, Default)]
struct Frame {
    node: u32,
    corner: Vec3,
    span: Span,
    /// When the ray leaves the halves that it comes to first, and when it enters the others.
    middle: Span,
    /// Children in the order in which the ray comes to them.
    left: u8,
}

impl<'a> RayTree<'a> {
    /// The tree with the profiles of its nodes.
    ///
    /// Cost: one pass over the bricks and the nodes; 16 bytes held for each node.
    pub fn new(tree: &'a Octree) -> Self {
        let mut levels: Vec<Vec<Node>> = Vec::with_capacity(tree.levels.len());
        let mut below: Vec<u64> = tree.bricks.iter().map(|bits| layers(*bits)).collect();
        let mut edge = 8;
        for level in tree.levels.iter().rev() {
            let child_slices = (edge / 2).min(SLICES);
            let all = u64::MAX >> (SLICES - child_slices);
            let profile = |node: usize| {
                let mut next = level.first[node] as usize;
                let mut halves = [0u64; 2];
                for child in 0..8 {
                    if level.mixed[node] >> child & 1 == 1 {
                        halves[child >> 2] |= below[next];
                        next += 1;
                    } else if level.full[node] >> child & 1 == 1 {
                        halves[child >> 2] |= all;
                    }
                }
                if edge > SLICES {
                    halves = halves.map(in_pairs);
                }
                halves[0] | halves[1] << (edge.min(SLICES) / 2)
            };
            let nodes = (0..level.mixed.len()).map(|node| Node {
                profile: profile(node),
                first: level.first[node],
                mixed: level.mixed[node],
                full: level.full[node],
            });
            let nodes: Vec<Node> = nodes.collect();
            below = nodes.iter().map(|node| node.profile).collect();
            levels.push(nodes);
            edge *= 2;
        }
        levels.reverse();
        RayTree { tree, levels }
    }

    /// Bytes held, those of the octree included.
    pub fn bytes(&self) -> u64 {
        let nodes: usize = self.levels.iter().map(Vec::len).sum();
        self.tree.bytes() + (nodes * size_of::<Node>()) as u64
    }

    /// Whether a ray hits a set voxel, by the rule of [`GridRay::hits`].
    ///
    /// With `masked`, a node is left at once when none of its slices between those in which the ray
    /// enters and leaves it holds anything, and a brick is looked at only where the ray's box is;
    /// without, only what is empty as a whole is left out. The answer is the same. Cost: the nodes
    /// on the way, front to back, until one voxel is hit.
    ///
    /// Revelles, Ureña and Lastra, "An efficient parametric algorithm for octree traversal" (2000),
    /// with children that overlap by the rule's slack and without recursion; the mask is that of
    /// Forest, Barthe and Paulin, "Real-time hierarchical binary-scene voxelization" (2009).
    pub fn any_hit(&self, ray: &GridRay, masked: bool, visits: &mut Visits) -> bool {
        let dims = self.tree.dims.map(|d| d as f64);
        let [start, end] = ray.cuboid([0.0; 3], dims);
        if start.is_nan() || end.is_nan() || start > end {
            return false;
        }
        // Most trees are far from the deepest, and room for one takes time to clear.
        if self.levels.len() <= SHALLOW {
            self.descend::<SHALLOW>(ray, masked, visits)
        } else {
            self.descend::<DEPTH>(ray, masked, visits)
        }
    }

    fn descend<const MOST: usize>(&self, ray: &GridRay, masked: bool, visits: &mut Visits) -> bool {
        let flip = (0..3).fold(0, |flip, a| flip | usize::from(ray.sign(a) < 0) << a);
        let edge = self.tree.root_edge() as f64;
        let mut frames = [Frame::default(); MOST];
        let mut depth = 0;
        for a in 0..3 {
            let [enter, leave] = ray.slab(a, 0.0, edge);
            frames[0].span.enter[a] = enter;
            frames[0].span.leave[a] = leave;
        }
        if self.enter(0, &mut frames[0], ray, flip, masked, visits) {
            return true;
        }
        loop {
            let frame = &mut frames[depth];
            if frame.left == 0 {
                if depth == 0 {
                    return false;
                }
                depth -= 1;
                continue;
            }
            let order = frame.left.trailing_zeros() as usize;
            frame.left &= frame.left - 1;
            let child = order ^ flip;
            let node = &self.levels[depth][frame.node as usize];
            let before = node.mixed & ((1 << child) - 1);
            let index = node.first + before.count_ones();
            let half = (self.tree.root_edge() >> (depth + 1)) as f64;
            let mut below = Frame {
                node: index,
                ..Frame::default()
            };
            for a in 0..3 {
                let is_far = order >> a & 1 == 1;
                let (own, middle) = (&frame.span, &frame.middle);
                let enter = if is_far {
                    middle.enter[a]
                } else {
                    own.enter[a]
                };
                let leave = if is_far {
                    own.leave[a]
                } else {
                    middle.leave[a]
                };
                below.span.enter[a] = enter;
                below.span.leave[a] = leave;
                below.corner[a] = frame.corner[a] + (child >> a & 1) as f64 * half;
            }
            if depth + 1 == self.levels.len() {
                if self.brick(&below, ray, masked, visits) {
                    return true;
                }
                continue;
            }
            if self.enter(depth + 1, &mut below, ray, flip, masked, visits) {
                return true;
            }
            if below.left != 0 {
                depth += 1;
                frames[depth] = below;
            }
        }
    }

    /// Finds which children of a node the ray has to visit, and whether it hits one that is full.
    #[inline]
    fn enter(
        &self,
        depth: usize,
        frame: &mut Frame,
        ray: &GridRay,
        flip: usize,
        masked: bool,
        visits: &mut Visits,
    ) -> bool {
        let node = self.levels[depth][frame.node as usize];
        let edge = (self.tree.root_edge() >> depth) as f64;
        let [start, end] = frame.span.within(ray.reach);
        if start.is_nan() || end.is_nan() || start > end {
            return false;
        }
        if masked && node.profile & slices(ray, [start, end], frame.corner[2], edge) == 0 {
            return false;
        }
        visits.nodes += 1;
        for a in 0..3 {
            let [enter, leave] = ray.halves(a, frame.corner[a] + edge / 2.0);
            frame.middle.enter[a] = enter;
            frame.middle.leave[a] = leave;
        }
        let Span { enter, leave } = frame.middle;
        // A child is met when it is entered, across every axis, before it is left across any.
        let mut met = u8::MAX;
        for a in 0..3 {
            met &= if leave[a] >= start { u8::MAX } else { FAR[a] };
            met &= if enter[a] <= end { u8::MAX } else { !FAR[a] };
            for b in 0..3 {
                if a != b && enter[a] > leave[b] {
                    met &= !(FAR[a] & !FAR[b]);
                }
            }
        }
        frame.left = met & in_order(node.mixed, flip);
        met & in_order(node.full, flip) != 0
    }

    /// Whether the ray hits a voxel of a brick.
    #[inline]
    fn brick(&self, frame: &Frame, ray: &GridRay, masked: bool, visits: &mut Visits) -> bool {
        let [start, end] = frame.span.within(ray.reach);
        if start.is_nan() || end.is_nan() || start > end {
            return false;
        }
        visits.nodes += 1;
        let mut rest = self.tree.bricks[frame.node as usize];
        let mut slabs = [[[0.0; 2]; 4]; 3];
        for a in 0..3 {
            let mut met = 0;
            for i in 0..4 {
                let lo = frame.corner[a] + i as f64;
                let [enter, leave] = ray.slab(a, lo, lo + 1.0);
                slabs[a][i] = [enter, leave];
                met |= usize::from(enter <= end && leave >= start) << i;
            }
            if masked {
                rest &= ROWS[a][met];
                if rest == 0 {
                    return false;
                }
            }
        }
        while rest != 0 {
            let bit = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            visits.voxels += 1;
            let [x, y, z] = [
                slabs[0][bit & 3],
                slabs[1][bit >> 2 & 3],
                slabs[2][bit >> 4],
            ];
            let first = ray.reach[0].max(x[0]).max(y[0]).max(z[0]);
            let last = ray.reach[1].min(x[1]).min(y[1]).min(z[1]);
            if first <= last {
                return true;
            }
        }
        false
    }
}

/// The bits of a brick whose x (or y, or z) is among those of a mask of four.
const ROWS: [[u64; 16]; 3] = [
    rows(0x1111_1111_1111_1111, 1),
    rows(0x000f_000f_000f_000f, 4),
    rows(0xffff, 16),
];

const fn rows(first: u64, shift: u32) -> [u64; 16] {
    let mut table = [0; 16];
    let mut mask = 0;
    while mask < 16 {
        let mut i = 0;
        while i < 4 {
            if mask >> i & 1 == 1 {
                table[mask] |= first << (i * shift);
            }
            i += 1;
        }
        mask += 1;
    }
    table
}

/// Which layers across z of a brick hold a set voxel.
fn layers(bits: u64) -> u64 {
    (0..4).fold(0, |layers, z| {
        layers | u64::from(bits >> (16 * z) & 0xffff != 0) << z
    })
}

/// Bit `i` of the result is the or of bits 2 i and 2 i + 1.
fn in_pairs(bits: u64) -> u64 {
    (0..32).fold(0, |pairs, i| {
        pairs | u64::from(bits >> (2 * i) & 3 != 0) << i
    })
}

/// The slices of a node's profile between those in which a ray enters and leaves it, and what those
/// places may be off by.
#[inline]
fn slices(ray: &GridRay, [start, end]: [f64; 2], corner: f64, edge: f64) -> u64 {
    let count = edge.min(SLICES as f64);
    let scale = count / edge;
    let (a, b) = (ray.at(start, 2) - corner, ray.at(end, 2) - corner);
    let haze = ray.haze();
    let last = count - 1.0;
    let low = ((a.min(b) - haze) * scale).clamp(0.0, last) as u32;
    let high = ((a.max(b) + haze) * scale).clamp(0.0, last) as u32;
    (u64::MAX << low) & (u64::MAX >> (63 - high))
}

/// A mask of children in the order in which a ray comes to them: bit `i` is child `i ^ flip`.
#[inline]
fn in_order(mask: u8, flip: usize) -> u8 {
    let mut mask = mask;
    if flip & 1 != 0 {
        mask = (mask & 0x55) << 1 | (mask & 0xaa) >> 1;
    }
    if flip & 2 != 0 {
        mask = (mask & 0x33) << 2 | (mask & 0xcc) >> 2;
    }
    if flip & 4 != 0 {
        mask = mask.rotate_left(4);
    }
    mask
}
