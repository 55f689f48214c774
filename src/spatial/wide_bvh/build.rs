//! Building the tree: binned splits by surface area, two children at a time.

use super::collapse::{Twig, collapse};
use super::{IS_LEAF, LEAF, Leaf, NONE, Node, WideBvh};
use crate::spatial::aabb::Aabb;
use rayon::prelude::*;
use wide::f32x4;

/// Most candidate planes of a split, plus one.
const BINS: usize = 16;
/// From this depth on parts are halved by count.
const SPLIT_DEPTH: u32 = 64;
/// Items below which a subtree is made by one thread.
const PARALLEL: usize = 1 << 13;
/// Items per parallel step; fixed, so that nothing follows the number of threads.
const CHUNK: usize = 1 << 14;
/// Parts narrower than this are not binned.
const NARROW: f32 = 1e-30;

/// A box; the fourth lane says nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub lo: f32x4,
    pub hi: f32x4,
}

impl Extent {
    const EMPTY: Extent = Extent {
        lo: f32x4::splat(f32::INFINITY),
        hi: f32x4::splat(f32::NEG_INFINITY),
    };

    #[inline(always)]
    fn union(self, other: Extent) -> Extent {
        Extent {
            lo: self.lo.fast_min(other.lo),
            hi: self.hi.fast_max(other.hi),
        }
    }

    #[inline(always)]
    fn with(self, p: f32x4) -> Extent {
        self.union(Extent { lo: p, hi: p })
    }

    #[inline(always)]
    pub fn half_area(self) -> f32 {
        let [x, y, z, _] = (self.hi - self.lo).to_array();
        x * y + y * z + z * x
    }
}

/// An item's box rounded outwards.
#[derive(Clone, Copy)]
struct Entry {
    bounds: Extent,
    item: u32,
}

impl Entry {
    fn new(item: u32, bounds: Aabb) -> Self {
        let down = |v: f64| {
            let near = v as f32;
            if f64::from(near) > v {
                near.next_down()
            } else {
                near
            }
        };
        let [lo, hi] = [bounds.lo.map(down), bounds.hi.map(|v| -down(-v))];
        Entry {
            bounds: Extent {
                lo: f32x4::new([lo[0], lo[1], lo[2], 0.0]),
                hi: f32x4::new([hi[0], hi[1], hi[2], 0.0]),
            },
            item,
        }
    }

    fn is_empty(&self) -> bool {
        let (lo, hi) = (self.bounds.lo.to_array(), self.bounds.hi.to_array());
        (0..3).any(|a| lo[a] > hi[a])
    }

    /// Twice the middle of the box.
    #[inline(always)]
    fn centre(&self) -> f32x4 {
        self.bounds.lo + self.bounds.hi
    }
}

/// The boxes around some entries and around their centres.
#[derive(Clone, Copy)]
struct Bounds {
    all: Extent,
    centres: Extent,
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        all: Extent::EMPTY,
        centres: Extent::EMPTY,
    };

    #[inline(always)]
    fn with(self, entry: &Entry) -> Bounds {
        Bounds {
            all: self.all.union(entry.bounds),
            centres: self.centres.with(entry.centre()),
        }
    }

    fn union(self, other: Bounds) -> Bounds {
        Bounds {
            all: self.all.union(other.all),
            centres: self.centres.union(other.centres),
        }
    }

    fn of(entries: &[Entry]) -> Bounds {
        let of = |part: &[Entry]| part.iter().fold(Bounds::EMPTY, Bounds::with);
        if entries.len() <= 2 * CHUNK {
            return of(entries);
        }
        entries
            .par_chunks(CHUNK)
            .map(of)
            .reduce(|| Bounds::EMPTY, Bounds::union)
    }
}

pub(super) fn build(count: u32, bounds: impl Fn(u32) -> Aabb + Sync) -> (WideBvh, Vec<Leaf>) {
    let mut entries: Vec<Entry> = (0..count)
        .into_par_iter()
        .map(|item| Entry::new(item, bounds(item)))
        .collect();
    if entries.par_iter().any(Entry::is_empty) {
        entries.retain(|entry| !entry.is_empty());
    }
    let mut twigs = Vec::new();
    if !entries.is_empty() {
        let whole = Bounds::of(&entries);
        grow(&mut entries, 0, whole, 0, &mut twigs);
    }
    let mut nodes = collapse(&twigs);
    let leaves = number(&mut nodes, &entries);
    (WideBvh { nodes }, leaves)
}

/// Turns places of entries into numbers of leaves.
fn number(nodes: &mut [Node], entries: &[Entry]) -> Vec<Leaf> {
    let mut leaves = Vec::with_capacity(entries.len() / 2);
    for node in nodes {
        let links = node.link.iter_mut().zip(&node.count);
        for (link, &count) in links.filter(|(_, count)| **count != 0) {
            let first = *link as usize;
            let mut leaf = [NONE; LEAF];
            for (place, entry) in leaf.iter_mut().zip(&entries[first..first + count as usize]) {
                *place = entry.item;
            }
            *link = leaves.len() as u32 | IS_LEAF;
            leaves.push(leaf);
        }
    }
    leaves
}

/// Appends the subtree over `entries`, which start at place `first`, children before parents.
fn grow(entries: &mut [Entry], first: usize, whole: Bounds, depth: u32, twigs: &mut Vec<Twig>) {
    let count = entries.len();
    if count <= LEAF {
        twigs.push(Twig::leaf(whole.all, first, count));
        return;
    }
    let (middle, sides) = split(entries, whole, depth);
    let (a, b) = entries.split_at_mut(middle);
    let before = twigs.len();
    let mut left = |twigs: &mut Vec<Twig>| grow(a, first, sides[0], depth + 1, twigs);
    let mut right = |twigs: &mut Vec<Twig>| grow(b, first + middle, sides[1], depth + 1, twigs);
    if count <= PARALLEL {
        left(twigs);
        right(twigs);
    } else {
        let mut others = Vec::new();
        rayon::join(|| left(twigs), || right(&mut others));
        twigs.append(&mut others);
    }
    twigs.push(Twig::fork(whole.all, &twigs[before..]));
}

/// Orders the entries into two sides, neither empty; returns the size of the first and their boxes.
fn split(entries: &mut [Entry], bounds: Bounds, depth: u32) -> (usize, [Bounds; 2]) {
    if depth < SPLIT_DEPTH {
        let grid = Grid::new(bounds.centres, entries.len());
        if let Some((axis, last)) = grid.best_plane(&grid.fill(entries)) {
            return partition(entries, |entry| grid.bins_of(entry)[axis] <= last as i32);
        }
    }
    let middle = entries.len() / 2;
    let (a, b) = entries.split_at(middle);
    (middle, [Bounds::of(a), Bounds::of(b)])
}

/// Bins along the three axes.
struct Grid {
    low: f32x4,
    scale: f32x4,
    bins: usize,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Extent,
    count: u32,
}

impl Bin {
    const EMPTY: Bin = Bin {
        bounds: Extent::EMPTY,
        count: 0,
    };

    #[inline(always)]
    fn union(self, other: Bin) -> Bin {
        Bin {
            bounds: self.bounds.union(other.bounds),
            count: self.count + other.count,
        }
    }

    /// Leaves are tested whole, so that what counts is how many there are.
    #[inline(always)]
    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count.div_ceil(LEAF as u32) as f32
    }
}

type Bins = [[Bin; BINS]; 3];

impl Grid {
    fn new(centres: Extent, count: usize) -> Self {
        let bins = (4 + count / 8).min(BINS);
        let spread = (centres.hi - centres.lo).to_array();
        // A little less than the bins, so that the last centre is in the last bin.
        let scale = |s: f32| {
            if s > NARROW {
                bins as f32 * (1.0 - 4.0 * f32::EPSILON) / s
            } else {
                0.0
            }
        };
        let [x, y, z, _] = spread.map(scale);
        Grid {
            low: centres.lo,
            scale: f32x4::new([x, y, z, 0.0]),
            bins,
        }
    }

    #[inline(always)]
    fn bins_of(&self, entry: &Entry) -> [i32; 4] {
        ((entry.centre() - self.low) * self.scale)
            .fast_trunc_int()
            .to_array()
    }

    fn fill(&self, entries: &[Entry]) -> Bins {
        let of = |part: &[Entry]| {
            let mut bins = [[Bin::EMPTY; BINS]; 3];
            for entry in part {
                let places = self.bins_of(entry);
                for axis in 0..3 {
                    let bin = &mut bins[axis][places[axis] as usize & (BINS - 1)];
                    bin.bounds = bin.bounds.union(entry.bounds);
                    bin.count += 1;
                }
            }
            bins
        };
        if entries.len() <= 2 * CHUNK {
            return of(entries);
        }
        let union = |a: Bins, b: Bins| -> Bins {
            std::array::from_fn(|axis| std::array::from_fn(|i| a[axis][i].union(b[axis][i])))
        };
        entries
            .par_chunks(CHUNK)
            .map(of)
            .reduce(|| [[Bin::EMPTY; BINS]; 3], union)
    }

    /// Axis and last bin of the first side of the cheapest split; `None` when all would be on one
    /// side.
    fn best_plane(&self, bins: &Bins) -> Option<(usize, usize)> {
        let mut best: Option<(f32, usize, usize)> = None;
        for (axis, bins) in bins.iter().enumerate() {
            let mut after = [0.0; BINS];
            let mut sum = Bin::EMPTY;
            for i in (1..self.bins).rev() {
                sum = sum.union(bins[i]);
                after[i] = if sum.count == 0 { f32::NAN } else { sum.cost() };
            }
            let mut before = Bin::EMPTY;
            for i in 0..self.bins - 1 {
                before = before.union(bins[i]);
                if before.count == 0 || after[i + 1].is_nan() {
                    continue;
                }
                let total = before.cost() + after[i + 1];
                if best.is_none_or(|(least, ..)| total < least) {
                    best = Some((total, axis, i));
                }
            }
        }
        best.map(|(_, axis, last)| (axis, last))
    }
}

/// Moves the entries that are `first` before the others; returns how many they are and both boxes.
#[inline(always)]
fn partition(entries: &mut [Entry], first: impl Fn(&Entry) -> bool) -> (usize, [Bounds; 2]) {
    let (mut low, mut high) = (0, entries.len());
    let mut sides = [Bounds::EMPTY; 2];
    while low < high {
        let entry = entries[low];
        if first(&entry) {
            sides[0] = sides[0].with(&entry);
            low += 1;
        } else {
            sides[1] = sides[1].with(&entry);
            high -= 1;
            entries.swap(low, high);
        }
    }
    (low, sides)
}
