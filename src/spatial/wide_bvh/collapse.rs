//! From a tree of two children a node to one of eight, so that rays visit as few nodes as may be.

use super::build::Extent;
use super::{Lanes, Node, WIDTH};

/// A node with two children, or a leaf, of the tree that is collapsed.
///
/// Subtrees lie in one piece, children before parents: the second child just before its parent,
/// and before its subtree the first child.
#[derive(Clone)]
pub(super) struct Twig {
    lo: [f32; 3],
    hi: [f32; 3],
    /// Twigs of the subtree, this one included.
    size: u32,
    /// Of a leaf the place of its first entry.
    first: u32,
    /// Of a leaf the number of its entries.
    count: u32,
    /// Least cost of the subtree as up to 1, 2, ... 7 children of one node.
    costs: [f32; WIDTH - 1],
    /// How many of up to 2, 3, ... 8 children are the first's and the second's; zeros where the
    /// twig is better one child itself.
    shares: [[u8; 2]; WIDTH - 1],
}

impl Twig {
    /// The leaf of the `count` entries from place `first` on.
    pub fn leaf(bounds: Extent, first: usize, count: usize) -> Twig {
        let (lo, hi) = corners(bounds);
        Twig {
            lo,
            hi,
            size: 1,
            first: first as u32,
            count: count as u32,
            costs: [bounds.half_area(); WIDTH - 1],
            shares: [[0; 2]; WIDTH - 1],
        }
    }

    /// The parent of two subtrees, which end in the last of `twigs` and before its subtree.
    ///
    /// A visit costs as much at a node as at a leaf, and is as likely as its box has surface.
    /// Source: Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs through
    /// compressed wide BVHs", section 3.1.
    pub fn fork(bounds: Extent, twigs: &[Twig]) -> Twig {
        let (lo, hi) = corners(bounds);
        let [a, b] = children(twigs, twigs.len()).map(|child| &twigs[child]);
        let mut costs = [f32::INFINITY; WIDTH + 1];
        let mut shares = [[0; 2]; WIDTH + 1];
        for sum in 2..=WIDTH {
            (costs[sum], shares[sum]) = (costs[sum - 1], shares[sum - 1]);
            for first in 1..sum {
                let cost = a.costs[first - 1] + b.costs[sum - first - 1];
                if cost < costs[sum] {
                    (costs[sum], shares[sum]) = (cost, [first as u8, (sum - first) as u8]);
                }
            }
        }
        costs[1] = costs[WIDTH] + bounds.half_area();
        for sum in 2..WIDTH {
            if costs[1] <= costs[sum] {
                (costs[sum], shares[sum]) = (costs[1], [0; 2]);
            }
        }
        Twig {
            lo,
            hi,
            size: a.size + b.size + 1,
            first: 0,
            count: 0,
            costs: std::array::from_fn(|i| costs[i + 1]),
            shares: std::array::from_fn(|i| shares[i + 2]),
        }
    }
}

/// Where the children are of the twig at `at`, which is none of a leaf.
#[inline(always)]
fn children(twigs: &[Twig], at: usize) -> [usize; 2] {
    let second = at - 1;
    [second - twigs[second].size as usize, second]
}

fn corners(bounds: Extent) -> ([f32; 3], [f32; 3]) {
    let [lo, hi] = [bounds.lo, bounds.hi].map(|p| {
        let [x, y, z, _] = p.to_array();
        [x, y, z]
    });
    (lo, hi)
}

/// The nodes of the cheapest tree, parents before children; leaves link to places of entries.
pub(super) fn collapse(twigs: &[Twig]) -> Vec<Node> {
    let mut nodes = Vec::new();
    if let Some(root) = twigs.len().checked_sub(1) {
        emit(twigs, root, &mut nodes);
    }
    nodes
}

/// Appends the subtree below the twig at `at`, in depth-first order.
fn emit(twigs: &[Twig], at: usize, nodes: &mut Vec<Node>) {
    let mut parts = [0; WIDTH];
    let count = gather(twigs, at, WIDTH, &mut parts);
    let place = nodes.len();
    nodes.push(Node::around(twigs, &parts[..count]));
    for (child, &part) in parts[..count].iter().enumerate() {
        if twigs[part].count == 0 {
            nodes[place].link[child] = nodes.len() as u32;
            emit(twigs, part, nodes);
        }
    }
}

/// Puts in the first of `parts` the twigs that stand for the one at `at` as up to `most` children;
/// returns how many they are.
fn gather(twigs: &[Twig], at: usize, most: usize, parts: &mut [usize]) -> usize {
    let shares = match most {
        1 => [0; 2],
        _ => twigs[at].shares[most - 2],
    };
    if shares == [0; 2] {
        parts[0] = at;
        return 1;
    }
    let [a, b] = children(twigs, at);
    let before = gather(twigs, a, shares[0].into(), parts);
    before + gather(twigs, b, shares[1].into(), &mut parts[before..])
}

impl Node {
    /// A node whose leaves link to places of entries, and whose other links are yet to be made.
    fn around(twigs: &[Twig], parts: &[usize]) -> Node {
        // Inside out where there is no child.
        let mut planes = [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3];
        let mut node = Node {
            planes: [[Lanes::ZERO; 2]; 3],
            link: [0; WIDTH],
            count: [0; WIDTH],
        };
        for (child, &part) in parts.iter().enumerate() {
            let twig = &twigs[part];
            for axis in 0..3 {
                planes[axis][0][child] = twig.lo[axis];
                planes[axis][1][child] = twig.hi[axis];
            }
            node.link[child] = twig.first;
            node.count[child] = twig.count;
        }
        node.planes = planes.map(|pair| pair.map(Lanes::new));
        node
    }
}
