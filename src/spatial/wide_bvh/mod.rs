//! A bounding volume hierarchy for rays: eight children a node, tested at once.

mod build;
mod collapse;

use super::aabb::Aabb;
use crate::error::Fault;
use crate::numeric::vector::Vec3;
use std::ops::ControlFlow;
use wide::f32x8 as Lanes;

/// Items of a leaf.
pub const LEAF: usize = 4;
/// The place in a leaf that holds no item.
pub const NONE: u32 = u32::MAX;

/// Children of a node, and lanes of its planes.
const WIDTH: usize = 8;
/// Marks the link to a leaf.
const IS_LEAF: u32 = 1 << 31;
/// Nodes that a walk keeps without asking for memory; a tree of a million items needs fewer.
const STACK: usize = 48;
/// Relative error of a distance to a plane: a difference, an inverse and a product, each rounded
/// once, and the inverse once more from `f64`; doubled.
const GAMMA: f64 = 8.0 * (f32::EPSILON as f64 / 2.0);
/// Slack of coordinates below 4 in size: what the rounding to `f32` moves them, doubled.
const SLACK: f64 = 1.0 / (1u64 << 22) as f64;
/// Directions flatter than this against an axis are taken as this flat: over a walk of less than
/// 16 they stay within [`SLACK`].
const FLAT: f64 = 1.0 / (1u64 << 40) as f64;

/// Boxes and what is in them. A missing child has an inside-out box that no ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
struct Node {
    /// Lower and upper x, lower and upper y, lower and upper z of the boxes.
    planes: [[Lanes; 2]; 3],
    /// A leaf's number and [`IS_LEAF`], or the index of a node.
    link: [u32; WIDTH],
    /// Items below, of a leaf; 0 for a node and for a missing child.
    count: [u32; WIDTH],
}

const _: () = assert!(size_of::<Node>() == 256);

/// A tree of boxes in `f32` over items that only the caller knows, by index; leaves hold up to
/// [`LEAF`] of them.
///
/// For coordinates below 2 in size ([`super::local::LocalFrame`]). Boxes are rounded outwards and
/// rays are widened by every rounding on the way, so that no leaf that a ray meets is passed by.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WideBvh {
    nodes: Vec<Node>,
}

/// The items of a leaf; places without one hold [`NONE`].
pub type Leaf = [u32; LEAF];

/// A ray made ready for boxes.
#[derive(Debug, Clone)]
pub struct Slabs {
    /// By axis which of a box's two planes is nearer.
    near: [usize; 3],
    /// Origins moved towards the nearer and away from the farther planes.
    origins: [[Lanes; 3]; 2],
    /// Inverse directions, made smaller for the nearer and larger for the farther planes.
    inverses: [[Lanes; 3]; 2],
}

impl Slabs {
    /// The ray from `origin`, below 4 in size, along `direction`, whose largest component is
    /// between 1 and 2 in size; its coordinates are off by up to `error`.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3, error: f64) -> Self {
        let slack = SLACK + error;
        let mut slabs = Slabs {
            near: [0; 3],
            origins: [[Lanes::ZERO; 3]; 2],
            inverses: [[Lanes::ZERO; 3]; 2],
        };
        for axis in 0..3 {
            let down = direction[axis] < 0.0;
            let sign = if down { -1.0 } else { 1.0 };
            let steep = direction[axis].abs();
            let inverse = sign / if steep > FLAT { steep } else { FLAT };
            slabs.near[axis] = usize::from(down);
            for (side, signed) in [(0, 1.0), (1, -1.0)] {
                let moved = origin[axis] + signed * sign * slack;
                slabs.origins[side][axis] = Lanes::splat(moved as f32);
                let scaled = inverse * (1.0 - signed * GAMMA);
                slabs.inverses[side][axis] = Lanes::splat(scaled as f32);
            }
        }
        slabs
    }

    /// Where the ray enters a node's boxes, at 0 or later, and which of them it meets by `limit`.
    #[inline(always)]
    fn enter(&self, node: &Node, limit: f32) -> (Lanes, u32) {
        let at = |side: usize, axis: usize| {
            // Masked, as the compiler does not know that it is 0 or 1.
            let plane = node.planes[axis][(self.near[axis] ^ side) & 1];
            (plane - self.origins[side][axis]) * self.inverses[side][axis]
        };
        // No product is NaN: inverses are finite and not 0, and so are the differences, or infinite.
        let near = at(0, 0)
            .fast_max(at(0, 1))
            .fast_max(at(0, 2).fast_max(Lanes::ZERO));
        let far = at(1, 0)
            .fast_min(at(1, 1))
            .fast_min(at(1, 2).fast_min(Lanes::splat(limit)));
        (near, near.simd_le(far).to_bitmask())
    }
}

impl WideBvh {
    /// The tree over items `0..count` and its leaves by number. `bounds` gives an item's box: not
    /// NaN, below 2 in size. Items with an empty box are left out.
    ///
    /// The same tree comes from any number of threads. Fewer than 2^31 items. Cost: O(n log n)
    /// time, about 100 bytes per item while building and 15 after. Source: binned surface area
    /// heuristic, Wald 2007, "On fast construction of SAH-based bounding volume hierarchies",
    /// section 3; the cheapest eight-wide tree within the binary one, Ylitie, Karras, Laine 2017,
    /// "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", section 3.1.
    pub fn build(count: u32, bounds: impl Fn(u32) -> Aabb + Sync) -> (Self, Vec<Leaf>) {
        build::build(count, bounds)
    }

    /// Bytes that the tree takes.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.nodes.as_slice()) as u64
    }

    /// Calls `visit` for the leaves whose boxes the ray meets between 0 and `limit`, nearer ones
    /// roughly first, until it breaks off. `visit` returns the limit from there on.
    ///
    /// Limits are in multiples of the ray's direction, from its origin. Cost: O(log n) where items
    /// overlap little. Source: Ize 2013, "Robust BVH ray traversal"; here each side of the slab
    /// has an origin of its own, which also covers the rounding of the origin.
    #[inline(always)]
    pub fn walk(
        &self,
        ray: &Slabs,
        mut limit: f32,
        mut visit: impl FnMut(usize, f32) -> ControlFlow<(), f32>,
    ) -> ControlFlow<()> {
        let mut stack = Stack::new();
        let mut at = 0;
        if self.nodes.is_empty() {
            return ControlFlow::Continue(());
        }
        loop {
            let next = if at & IS_LEAF != 0 {
                limit = visit((at ^ IS_LEAF) as usize, limit)?;
                None
            } else {
                let node = &self.nodes[at as usize];
                let (near, mask) = ray.enter(node, limit);
                stack.push_all(&near.to_array(), &node.link, mask)
            };
            at = match next.or_else(|| stack.pop(limit)) {
                Some(link) => link,
                None => return ControlFlow::Continue(()),
            };
        }
    }

    /// What the tree promises: every child inside the box that its parent has for it, every item
    /// with a box in exactly one leaf and inside the leaf's box.
    pub fn check(
        &self,
        leaves: &[Leaf],
        count: u32,
        bounds: impl Fn(u32) -> Aabb,
    ) -> Result<(), Fault> {
        let wrong = |at: usize, what: &str| Err(Fault::element("node", at, what));
        let mut seen: Vec<bool> = (0..count).map(|item| bounds(item).is_empty()).collect();
        let (mut nodes_seen, mut leaves_seen) = (0, 0);
        let everything = Aabb {
            lo: [f64::NEG_INFINITY; 3],
            hi: [f64::INFINITY; 3],
        };
        let mut todo = vec![(0, everything)];
        while let Some((at, outer)) = todo.pop() {
            let Some(node) = self.nodes.get(at) else {
                if self.nodes.is_empty() {
                    break;
                }
                return wrong(at, "is missing");
            };
            nodes_seen += 1;
            for child in (0..WIDTH).filter(|c| !node.bounds(*c).is_empty()) {
                let bounds_of_child = node.bounds(child);
                if outer.union(bounds_of_child) != outer {
                    return wrong(at, "has a child outside the box for it");
                }
                if node.link[child] & IS_LEAF == 0 {
                    todo.push((node.link[child] as usize, bounds_of_child));
                    continue;
                }
                leaves_seen += 1;
                let leaf = (node.link[child] ^ IS_LEAF) as usize;
                for &item in leaves[leaf].iter().filter(|item| **item != NONE) {
                    if std::mem::replace(&mut seen[item as usize], true) {
                        return wrong(at, "holds an item that another leaf holds");
                    }
                    if bounds_of_child.union(bounds(item)) != bounds_of_child {
                        return wrong(at, "holds an item that is outside it");
                    }
                }
            }
        }
        if nodes_seen != self.nodes.len() || leaves_seen != leaves.len() || !seen.iter().all(|s| *s)
        {
            return Err(Fault::whole("some nodes or items are in no leaf"));
        }
        Ok(())
    }
}

impl Node {
    /// The box of a child; empty for a missing one.
    fn bounds(&self, child: usize) -> Aabb {
        let planes = |side: usize| self.planes.map(|p| f64::from(p[side].to_array()[child]));
        Aabb {
            lo: planes(0),
            hi: planes(1),
        }
    }
}

/// Nodes and leaves to look at later, and where the ray enters them.
struct Stack {
    first: [(f32, u32); STACK],
    count: usize,
    /// What does not fit.
    rest: Vec<(f32, u32)>,
}

impl Stack {
    #[inline(always)]
    fn new() -> Self {
        Stack {
            first: [(0.0, 0); STACK],
            count: 0,
            rest: Vec::new(),
        }
    }

    #[inline(always)]
    fn push(&mut self, entry: (f32, u32)) {
        if let Some(place) = self.first.get_mut(self.count) {
            *place = entry;
        } else {
            self.rest.push(entry);
        }
        self.count += 1;
    }

    /// The link put in last that the ray enters by `limit`.
    #[inline(always)]
    fn pop(&mut self, limit: f32) -> Option<u32> {
        while self.count > 0 {
            self.count -= 1;
            let entry = match self.first.get(self.count) {
                Some(entry) => *entry,
                None => self.rest.pop()?,
            };
            if entry.0 <= limit {
                return Some(entry.1);
            }
        }
        None
    }

    /// Puts the children in `mask` in, nearest last, but for the nearest, which is returned.
    #[inline(always)]
    fn push_all(&mut self, near: &[f32; WIDTH], link: &[u32; WIDTH], mut mask: u32) -> Option<u32> {
        let take = |mask: &mut u32| {
            let child = mask.trailing_zeros() as usize & (WIDTH - 1);
            *mask &= *mask - 1;
            (near[child], link[child])
        };
        if mask == 0 {
            return None;
        }
        let mut a = take(&mut mask);
        if mask == 0 {
            return Some(a.1);
        }
        let mut b = take(&mut mask);
        order(&mut a, &mut b);
        let first = self.count;
        self.push(b);
        while mask != 0 {
            let mut c = take(&mut mask);
            order(&mut a, &mut c);
            self.push(c);
            self.sink(first);
        }
        Some(a.1)
    }

    /// Moves the last entry down to its place among those from `first` on, the farthest first.
    #[inline(always)]
    fn sink(&mut self, first: usize) {
        let mut at = self.count - 1;
        // What did not fit stays where it is: the order costs time at most.
        while at > first && at < STACK && self.first[at - 1].0 < self.first[at].0 {
            self.first.swap(at - 1, at);
            at -= 1;
        }
    }
}

/// Swaps two entries when the second is nearer.
#[inline(always)]
fn order(a: &mut (f32, u32), b: &mut (f32, u32)) {
    if b.0 < a.0 {
        std::mem::swap(a, b);
    }
}

#[cfg(test)]
mod tests;
