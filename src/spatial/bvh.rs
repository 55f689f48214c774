//! A bounding volume hierarchy with leaves of the caller.

use super::aabb::Aabb;
use crate::error::Fault;
use crate::numeric::vector::Vec3;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Most items in a leaf.
const LEAF: usize = 4;
/// Candidate planes of a split, plus one.
const BINS: usize = 16;
/// From this depth on nodes are halved by count, so that no tree is deeper than `MOST_DEPTH`.
const SPLIT_DEPTH: u32 = 48;
/// 32 halvings end any 2^32 items.
const MOST_DEPTH: usize = SPLIT_DEPTH as usize + 33;
/// Items below which a node is made by one thread.
const PARALLEL: usize = 1 << 13;
/// Items per parallel step; fixed, so that nothing follows the number of threads.
const CHUNK: usize = 1 << 14;
/// Boxes up to this much farther than the best item are still opened: it covers the roundings of
/// the distances to the box and to an item inside it.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// One node, a cache line. The first child of an inner node follows it.
#[derive(Debug, Clone, PartialEq)]
#[repr(C, align(64))]
struct Node {
    bounds: Aabb,
    /// Inner: how many nodes on the second child is. Leaf: where its items start.
    link: usize,
    /// Items of a leaf; 0 for an inner node.
    count: u32,
}

const _: () = assert!(size_of::<Node>() == 64);

/// A tree of boxes over items that only the caller knows, by index.
///
/// Boxes hold `f64`. Building works for any coordinates whose differences are finite; queries
/// compare squares of distances, so a caller whose model may be as small as 1e-150 or as large as
/// 1e150 brings it to unit size first ([`super::local::LocalFrame`]).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bvh {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

/// What a search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Index of the item.
    pub item: u32,
    /// What the caller's function said of it.
    pub distance_squared: f64,
}

#[derive(Clone, Copy)]
struct Entry {
    bounds: Aabb,
    item: u32,
}

impl Bvh {
    /// The tree over items `0..count`, whose boxes `bounds` gives; boxes are not empty and not NaN.
    ///
    /// The same tree comes from any number of threads. Cost: O(n log n) time, about 56 bytes per
    /// item while building and 30 after. Source: binned surface area heuristic, Wald 2007, "On
    /// fast construction of SAH-based bounding volume hierarchies", section 3.
    pub fn build(count: u32, bounds: impl Fn(u32) -> Aabb + Sync) -> Self {
        let mut entries: Vec<Entry> = (0..count)
            .into_par_iter()
            .map(|item| Entry {
                bounds: bounds(item),
                item,
            })
            .collect();
        let mut nodes = Vec::new();
        if !entries.is_empty() {
            grow(&mut entries, 0, 0, &mut nodes);
        }
        Bvh {
            nodes,
            items: entries.iter().map(|e| e.item).collect(),
        }
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether there is no item.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// The box around everything.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// The item nearest to `p`, if one is within `upper` (a squared distance, inclusive).
    ///
    /// `distance_squared` gives the square of the distance from `p` to an item, which lies in the
    /// item's box. Of items equally near the one of smallest index is found. Cost: O(log n) where
    /// items overlap little.
    pub fn nearest(
        &self,
        p: Vec3,
        upper: f64,
        distance_squared: impl FnMut(u32) -> f64,
    ) -> Option<Nearest> {
        self.nearest_by(upper, |b| b.distance_squared(p), distance_squared)
    }

    /// The item for which `value` is smallest, if that is at most `upper`.
    ///
    /// `bound` of a box is not more than `value` of any item whose box lies inside it, up to a few
    /// roundings. Of equal items the one of smallest index is found.
    pub fn nearest_by(
        &self,
        upper: f64,
        bound: impl Fn(&Aabb) -> f64,
        mut value: impl FnMut(u32) -> f64,
    ) -> Option<Nearest> {
        let mut best = upper;
        let mut found: Option<u32> = None;
        let mut stack = Stack::default();
        stack.push(bound(&self.nodes.first()?.bounds), 0);
        while let Some((distance, mut at)) = stack.pop() {
            if distance > best + best * ROUNDING {
                continue;
            }
            while self.nodes[at].count == 0 {
                let second = at + self.nodes[at].link;
                let near = bound(&self.nodes[at + 1].bounds);
                let far = bound(&self.nodes[second].bounds);
                let (near, far, next, later) = if far < near {
                    (far, near, second, at + 1)
                } else {
                    (near, far, at + 1, second)
                };
                let limit = best + best * ROUNDING;
                if far <= limit {
                    stack.push(far, later);
                }
                if near > limit {
                    break;
                }
                at = next;
            }
            for &item in self.leaf(at) {
                let d = value(item);
                if d < best || (d == best && found.is_none_or(|f| item < f)) {
                    best = d;
                    found = Some(item);
                }
            }
        }
        found.map(|item| Nearest {
            item,
            distance_squared: best,
        })
    }

    /// Calls `visit` for every item whose box meets `query`, and for some more from the same
    /// leaves, in an order fixed by the tree, until it breaks off.
    pub fn visit_overlapping<B>(
        &self,
        query: &Aabb,
        mut visit: impl FnMut(u32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let meets = |b: &Aabb| (0..3).all(|a| b.lo[a] <= query.hi[a] && query.lo[a] <= b.hi[a]);
        let mut stack = Stack::default();
        if !self.nodes.is_empty() {
            stack.push(0.0, 0);
        }
        while let Some((_, at)) = stack.pop() {
            let node = &self.nodes[at];
            if !meets(&node.bounds) {
                continue;
            }
            if node.count == 0 {
                stack.push(0.0, at + node.link);
                stack.push(0.0, at + 1);
            }
            for &item in self.leaf(at) {
                visit(item)?;
            }
        }
        ControlFlow::Continue(())
    }

    /// Whether `holds` is true of an item whose box meets `query`.
    ///
    /// `holds` is asked of some items whose box does not meet it too.
    pub fn any_overlapping(&self, query: &Aabb, mut holds: impl FnMut(u32) -> bool) -> bool {
        self.visit_overlapping(query, |item| {
            if holds(item) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .is_break()
    }

    /// The items of a leaf; none for an inner node.
    #[inline]
    fn leaf(&self, at: usize) -> &[u32] {
        let node = &self.nodes[at];
        if node.count == 0 {
            &[]
        } else {
            &self.items[node.link..node.link + node.count as usize]
        }
    }

    /// What the tree promises: children inside their parents, every item inside its leaf, every
    /// item in exactly one leaf, no path longer than the searches have room for.
    pub fn check(&self, bounds: impl Fn(u32) -> Aabb) -> Result<(), Fault> {
        let wrong = |at: usize, what: &str| Err(Fault::element("node", at, what));
        let mut seen = vec![false; self.items.len()];
        let mut visited = 0;
        let mut todo: Vec<(usize, usize)> = (!self.nodes.is_empty())
            .then_some((0, 1))
            .into_iter()
            .collect();
        while let Some((at, depth)) = todo.pop() {
            visited += 1;
            let node = &self.nodes[at];
            if depth > MOST_DEPTH {
                return wrong(at, "is too deep");
            }
            if node.count == 0 {
                for child in [at + 1, at + node.link] {
                    match self.nodes.get(child) {
                        Some(c) if node.bounds.union(c.bounds) == node.bounds => {}
                        _ => return wrong(at, "has a child that is missing or outside it"),
                    }
                    todo.push((child, depth + 1));
                }
            }
            for &item in self.leaf(at) {
                if std::mem::replace(&mut seen[item as usize], true) {
                    return wrong(at, "holds an item that another leaf holds");
                }
                if node.bounds.union(bounds(item)) != node.bounds {
                    return wrong(at, "holds an item that is outside it");
                }
            }
        }
        if visited != self.nodes.len() || !seen.iter().all(|s| *s) {
            return Err(Fault::whole("some nodes or items are in no leaf"));
        }
        Ok(())
    }
}

/// Nodes to look at later. A search keeps at most one per level, a visit two.
struct Stack {
    nodes: [(f64, usize); MOST_DEPTH + 1],
    count: usize,
}

impl Default for Stack {
    fn default() -> Self {
        Stack {
            nodes: [(0.0, 0); MOST_DEPTH + 1],
            count: 0,
        }
    }
}

impl Stack {
    #[inline]
    fn push(&mut self, distance: f64, node: usize) {
        self.nodes[self.count] = (distance, node);
        self.count += 1;
    }

    #[inline]
    fn pop(&mut self) -> Option<(f64, usize)> {
        self.count = self.count.checked_sub(1)?;
        Some(self.nodes[self.count])
    }
}

/// Appends the subtree over `entries`, which start at position `first`, in depth-first order.
fn grow(entries: &mut [Entry], first: usize, depth: u32, nodes: &mut Vec<Node>) {
    let (bounds, centres) = bounds_of(entries);
    let at = nodes.len();
    if entries.len() <= LEAF {
        nodes.push(Node {
            bounds,
            link: first,
            count: entries.len() as u32,
        });
        return;
    }
    nodes.push(Node {
        bounds,
        link: 0,
        count: 0,
    });
    let middle = split(entries, bounds, centres, depth);
    let parallel = entries.len() > PARALLEL;
    let (left, right) = entries.split_at_mut(middle);
    if parallel {
        // Links are relative, so that subtrees made apart are joined by copying alone.
        let (mut a, mut b) = (Vec::new(), Vec::new());
        rayon::join(
            || grow(left, first, depth + 1, &mut a),
            || grow(right, first + middle, depth + 1, &mut b),
        );
        nodes[at].link = 1 + a.len();
        nodes.append(&mut a);
        nodes.append(&mut b);
    } else {
        grow(left, first, depth + 1, nodes);
        nodes[at].link = nodes.len() - at;
        grow(right, first + middle, depth + 1, nodes);
    }
}

/// The boxes around the entries and around their centres.
fn bounds_of(entries: &[Entry]) -> (Aabb, Aabb) {
    let of = |part: &[Entry]| {
        part.iter()
            .fold((Aabb::EMPTY, Aabb::EMPTY), |(all, centres), e| {
                (all.union(e.bounds), centres.with(e.bounds.centre()))
            })
    };
    if entries.len() <= 2 * CHUNK {
        return of(entries);
    }
    entries.par_chunks(CHUNK).map(of).reduce(
        || (Aabb::EMPTY, Aabb::EMPTY),
        |a, b| (a.0.union(b.0), a.1.union(b.1)),
    )
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

impl Bin {
    const EMPTY: Bin = Bin {
        bounds: Aabb::EMPTY,
        count: 0,
    };

    fn union(self, other: Bin) -> Bin {
        Bin {
            bounds: self.bounds.union(other.bounds),
            count: self.count + other.count,
        }
    }
}

/// Orders the entries into two sides, neither empty, and returns the size of the first.
fn split(entries: &mut [Entry], bounds: Aabb, centres: Aabb, depth: u32) -> usize {
    let spread = centres.extent();
    let axis = (1..3).fold(0, |best, a| if spread[a] > spread[best] { a } else { best });
    let (low, width) = (centres.lo[axis], spread[axis]);
    if !(width > 0.0 && width.is_finite()) {
        return entries.len() / 2;
    }
    let bin_of = |e: &Entry| {
        let share = (e.bounds.centre()[axis] - low) / width;
        ((share * BINS as f64) as usize).min(BINS - 1)
    };
    if depth < SPLIT_DEPTH
        && let Some(last) = best_plane(&bins_of(entries, bin_of), bounds)
    {
        return partition(entries, |e| bin_of(e) <= last);
    }
    let middle = entries.len() / 2;
    entries.select_nth_unstable_by(middle, |a, b| {
        let key = |e: &Entry| e.bounds.centre()[axis];
        key(a).total_cmp(&key(b)).then(a.item.cmp(&b.item))
    });
    middle
}

fn bins_of(entries: &[Entry], bin_of: impl Fn(&Entry) -> usize + Sync) -> [Bin; BINS] {
    let of = |part: &[Entry]| {
        let mut bins = [Bin::EMPTY; BINS];
        for e in part {
            let bin = &mut bins[bin_of(e)];
            bin.bounds = bin.bounds.union(e.bounds);
            bin.count += 1;
        }
        bins
    };
    if entries.len() <= 2 * CHUNK {
        return of(entries);
    }
    entries.par_chunks(CHUNK).map(of).reduce(
        || [Bin::EMPTY; BINS],
        |a, b| std::array::from_fn(|i| a[i].union(b[i])),
    )
}

/// The last bin of the first side of the cheapest split; `None` when all would be on one side.
fn best_plane(bins: &[Bin; BINS], bounds: Aabb) -> Option<usize> {
    // Areas relative to the node's size neither over- nor underflow.
    let size = bounds.extent().into_iter().fold(0.0, f64::max);
    let cost = |bin: &Bin| {
        let [x, y, z] = bin.bounds.extent().map(|e| e / size);
        (x * y + y * z + z * x) * bin.count as f64
    };
    let mut after = [Bin::EMPTY; BINS + 1];
    for i in (0..BINS).rev() {
        after[i] = bins[i].union(after[i + 1]);
    }
    let mut before = Bin::EMPTY;
    let mut best: Option<(f64, usize)> = None;
    for i in 0..BINS - 1 {
        before = before.union(bins[i]);
        if before.count == 0 || after[i + 1].count == 0 {
            continue;
        }
        let total = cost(&before) + cost(&after[i + 1]);
        if best.is_none_or(|(least, _)| total < least) {
            best = Some((total, i));
        }
    }
    best.map(|(_, i)| i)
}

/// Moves the entries that are `first` before the others, and returns how many they are.
fn partition(entries: &mut [Entry], first: impl Fn(&Entry) -> bool) -> usize {
    let (mut low, mut high) = (0, entries.len());
    while low < high {
        if first(&entries[low]) {
            low += 1;
        } else {
            high -= 1;
            entries.swap(low, high);
        }
    }
    low
}

#[cfg(test)]
mod tests;
