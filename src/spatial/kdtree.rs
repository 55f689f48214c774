//! A k-d tree over points: nearest neighbours, balls, and neighbours one by one.

use crate::numeric::vector::Vec3;
use rayon::prelude::*;

/// Most points in a leaf.
const LEAF: usize = 12;
/// Points below which a part is built by one thread.
const PARALLEL: usize = 1 << 13;
/// Points per parallel step of a batch; fixed, so that nothing follows the number of threads.
const CHUNK: usize = 256;
/// Each shell of a [`Stream`] reaches so much farther, by the square of the distance.
const GROWTH: f64 = 2.0;
/// By so much a sum of two rounded distances may be too small.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Levels of any tree over at most 2^32 points.
const MOST_LEVELS: usize = 32;

/// A point that a search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Square of its distance from where the search began.
    pub distance_squared: f64,
    /// Its index in the list that the tree was built over.
    pub index: u32,
}

impl Neighbour {
    /// Nothing is nearer.
    const FIRST: Neighbour = Neighbour {
        distance_squared: f64::NEG_INFINITY,
        index: 0,
    };

    /// Whether it comes before another: nearer, or as near and of smaller index.
    #[inline]
    pub fn is_before(&self, other: &Neighbour) -> bool {
        self.distance_squared < other.distance_squared
            || (self.distance_squared == other.distance_squared && self.index < other.index)
    }

    /// The order of [`Neighbour::is_before`].
    #[inline]
    pub fn order(&self, other: &Neighbour) -> std::cmp::Ordering {
        let by_distance = self.distance_squared.total_cmp(&other.distance_squared);
        by_distance.then(self.index.cmp(&other.index))
    }
}

/// A cut across one axis: what is before it ends at `low`, what is behind begins at `high`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Split {
    low: f64,
    high: f64,
    axis: u8,
}

/// A balanced tree of cuts, with points in its leaves.
///
/// Points are told apart by index: of two equally far the one of smaller index comes first, so that no
/// answer depends on how the tree was built. Distances are compared as squares; a caller whose points
/// may be as close as 1e-150 or as far as 1e150 brings them to unit size first
/// ([`super::local::LocalFrame`]). Points are finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KdTree {
    /// Cuts in the order of a heap: those of cut `i` are `2i + 1` and `2i + 2`.
    splits: Vec<Split>,
    levels: u32,
    /// Coordinates, leaf after leaf.
    coordinates: [Vec<f64>; 3],
    indices: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    point: Vec3,
    index: u32,
}

/// A part of the tree that is still to be searched.
#[derive(Debug, Clone, Copy, Default)]
struct Pending {
    /// The least square of a distance to it.
    distance_squared: f64,
    /// Distances along the axes.
    offset: Vec3,
    node: u32,
}

/// What is searched for: hears of the points of a leaf, and tells how far it still looks.
trait Search {
    /// Square of the largest distance that still matters.
    fn reach(&self) -> f64;
    /// Takes the points of a leaf.
    fn leaf(&mut self, squares: &[f64], indices: &[u32]);
}

impl KdTree {
    /// The tree over points, of which there are fewer than 2^32.
    ///
    /// The same tree comes from any number of threads. Cost: O(n log n) time; 32 bytes per point
    /// while building, 31 after. Source: Friedman, Bentley and Finkel, "An algorithm for finding best
    /// matches in logarithmic expected time", 1977; cuts halve the longest side of the box of the points.
    pub fn build(points: &[Vec3]) -> Self {
        let mut entries: Vec<Entry> = points
            .par_iter()
            .zip(0u32..points.len() as u32)
            .map(|(point, index)| Entry {
                point: *point,
                index,
            })
            .collect();
        let mut levels = 0;
        while (points.len() + (1 << levels) - 1) >> levels > LEAF {
            levels += 1;
        }
        let mut splits = vec![Split::default(); (1 << levels) - 1];
        let cuts = cut(&mut entries, levels, points.len(), (0, 0));
        for (node, split) in cuts {
            splits[node] = split;
        }
        KdTree {
            splits,
            levels,
            coordinates: std::array::from_fn(|a| entries.iter().map(|e| e.point[a]).collect()),
            indices: entries.iter().map(|e| e.index).collect(),
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// The `count` nearest points to `p` into `found`, nearest first; all where there are fewer.
    ///
    /// Cost: O(log n + count^2) for points spread as on a surface.
    pub fn nearest(&self, p: Vec3, count: usize, found: &mut Vec<Neighbour>) {
        self.nearest_within(p, count, f64::INFINITY, found);
    }

    /// The nearest points of those at squared distances up to `reach`.
    fn nearest_within(&self, p: Vec3, count: usize, reach: f64, found: &mut Vec<Neighbour>) {
        found.clear();
        let worst = Neighbour {
            distance_squared: reach,
            index: u32::MAX,
        };
        if count > 0 {
            self.search(
                p,
                &mut Nearest {
                    count,
                    worst,
                    found,
                },
            );
        }
    }

    /// For each point the `count` nearest others, nearest first: those of point `i` start at
    /// `i * count`. `points` are those that the tree was built over, and more than `count`.
    ///
    /// Cost: a search for each point, on all threads.
    pub fn neighbours(&self, points: &[Vec3], count: usize) -> Vec<u32> {
        let mut all = vec![0; points.len() * count];
        if count == 0 {
            return all;
        }
        all.par_chunks_mut(CHUNK * count)
            .zip(points.par_chunks(CHUNK))
            .enumerate()
            .for_each(|(chunk, (rows, points))| {
                let mut found: Vec<Neighbour> = Vec::with_capacity(count + 1);
                let mut before = points[0];
                for (i, (row, p)) in rows.chunks_exact_mut(count).zip(points).enumerate() {
                    let own = (chunk * CHUNK + i) as u32;
                    // As many are as near to the point before as its farthest, and no farther from this
                    // one than by the way between the two.
                    let reach = found.last().map_or(f64::INFINITY, |last| {
                        let step: Vec3 = std::array::from_fn(|a| p[a] - before[a]);
                        let way = last.distance_squared.sqrt() + square(step).sqrt();
                        way * way * (1.0 + ROUNDING)
                    });
                    before = *p;
                    self.nearest_within(*p, count + 1, reach, &mut found);
                    let others = found.iter().filter(|n| n.index != own);
                    for (slot, other) in row.iter_mut().zip(others) {
                        *slot = other.index;
                    }
                }
            });
        all
    }

    /// The points at squared distances up to `reach` that come after `last` (all where it is `None`),
    /// in no order that means anything, but always the same.
    pub fn within(&self, p: Vec3, reach: f64, last: Option<Neighbour>, found: &mut Vec<Neighbour>) {
        found.clear();
        let last = last.unwrap_or(Neighbour::FIRST);
        self.search(p, &mut Ball { reach, last, found });
    }

    /// The points in order of their distance from `p`, found in shells as they are asked for, the first
    /// of squared radius `first`, above 0.
    pub fn stream(&self, p: Vec3, first: f64) -> Stream<'_> {
        Stream {
            tree: self,
            centre: p,
            reach: first,
            last: None,
            shell: Vec::new(),
            next: 0,
            seen: 0,
        }
    }

    fn search(&self, p: Vec3, search: &mut impl Search) {
        if self.indices.is_empty() {
            return;
        }
        let cuts = self.splits.len() as u32;
        let mut stack = [Pending::default(); MOST_LEVELS + 1];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let mut at = stack[waiting];
            if at.distance_squared > search.reach() {
                continue;
            }
            while at.node < cuts {
                let split = &self.splits[at.node as usize];
                let axis = usize::from(split.axis);
                // No more than the rounded difference to any point behind the cut, so that no point is
                // passed over for a rounding.
                let before = (p[axis] - split.low).max(at.offset[axis]);
                let behind = (split.high - p[axis]).max(at.offset[axis]);
                let side = u32::from(behind < before);
                let (near, far) = if side == 0 {
                    (before, behind)
                } else {
                    (behind, before)
                };
                let children = 2 * at.node + 1;
                let mut other = at;
                other.node = children + 1 - side;
                other.offset[axis] = far;
                other.distance_squared = square(other.offset);
                at.node = children + side;
                at.offset[axis] = near;
                if other.distance_squared <= search.reach() {
                    stack[waiting] = other;
                    waiting += 1;
                }
            }
            self.scan(p, (at.node - cuts) as usize, search);
        }
    }

    #[inline]
    fn scan(&self, p: Vec3, leaf: usize, search: &mut impl Search) {
        let count = self.indices.len();
        let range = (leaf * count) >> self.levels..((leaf + 1) * count) >> self.levels;
        let [x, y, z] = &self.coordinates;
        let (x, y, z) = (&x[range.clone()], &y[range.clone()], &z[range.clone()]);
        let mut squares = [0.0; LEAF];
        for (i, square) in squares[..x.len()].iter_mut().enumerate() {
            let (dx, dy, dz) = (x[i] - p[0], y[i] - p[1], z[i] - p[2]);
            *square = dx * dx + dy * dy + dz * dz;
        }
        search.leaf(&squares[..x.len()], &self.indices[range]);
    }
}

#[inline]
fn square(v: Vec3) -> f64 {
    v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
}

/// Puts entries in the order of their leaves; returns the cuts with their places. `node` is its level
/// and its number in the level.
fn cut(
    entries: &mut [Entry],
    levels: u32,
    count: usize,
    node: (u32, usize),
) -> Vec<(usize, Split)> {
    let (level, number) = node;
    if level == levels {
        return Vec::new();
    }
    let start = (number * count) >> level;
    let middle = (((2 * number + 1) * count) >> (level + 1)) - start;
    let mut lo = [f64::INFINITY; 3];
    let mut hi = [f64::NEG_INFINITY; 3];
    for entry in entries.iter() {
        for a in 0..3 {
            lo[a] = lo[a].min(entry.point[a]);
            hi[a] = hi[a].max(entry.point[a]);
        }
    }
    let mut axis = 0;
    for a in 1..3 {
        if hi[a] - lo[a] > hi[axis] - lo[axis] {
            axis = a;
        }
    }
    let order = |a: &Entry, b: &Entry| {
        a.point[axis]
            .total_cmp(&b.point[axis])
            .then(a.index.cmp(&b.index))
    };
    entries.select_nth_unstable_by(middle, order);
    let (before, behind) = entries.split_at_mut(middle);
    let split = Split {
        low: before
            .iter()
            .fold(f64::NEG_INFINITY, |m, e| m.max(e.point[axis])),
        high: behind[0].point[axis],
        axis: axis as u8,
    };
    let below = |side| (level + 1, 2 * number + side);
    let size = before.len() + behind.len();
    let (mut cuts, more) = if size >= PARALLEL {
        rayon::join(
            || cut(before, levels, count, below(0)),
            || cut(behind, levels, count, below(1)),
        )
    } else {
        (
            cut(before, levels, count, below(0)),
            cut(behind, levels, count, below(1)),
        )
    };
    cuts.extend(more);
    cuts.push(((1 << level) - 1 + number, split));
    cuts
}

/// The nearest points, in a list kept in order.
struct Nearest<'a> {
    count: usize,
    /// Nothing after it is looked for.
    worst: Neighbour,
    found: &'a mut Vec<Neighbour>,
}

impl Search for Nearest<'_> {
    #[inline]
    fn reach(&self) -> f64 {
        self.worst.distance_squared
    }

    #[inline]
    fn leaf(&mut self, squares: &[f64], indices: &[u32]) {
        for (&distance_squared, &index) in squares.iter().zip(indices) {
            if distance_squared > self.worst.distance_squared {
                continue;
            }
            let new = Neighbour {
                distance_squared,
                index,
            };
            if !new.is_before(&self.worst) {
                continue;
            }
            if self.found.len() < self.count {
                self.found.push(new);
            }
            let mut place = self.found.len() - 1;
            while place > 0 && new.is_before(&self.found[place - 1]) {
                self.found[place] = self.found[place - 1];
                place -= 1;
            }
            self.found[place] = new;
            if self.found.len() == self.count {
                self.worst = self.found[self.count - 1];
            }
        }
    }
}

/// All points up to a distance that come after one that is known.
struct Ball<'a> {
    reach: f64,
    last: Neighbour,
    found: &'a mut Vec<Neighbour>,
}

impl Search for Ball<'_> {
    #[inline]
    fn reach(&self) -> f64 {
        self.reach
    }

    #[inline]
    fn leaf(&mut self, squares: &[f64], indices: &[u32]) {
        for (&distance_squared, &index) in squares.iter().zip(indices) {
            let new = Neighbour {
                distance_squared,
                index,
            };
            if distance_squared <= self.reach && self.last.is_before(&new) {
                self.found.push(new);
            }
        }
    }
}

/// Points by increasing distance from a place, of equally far ones by increasing index.
#[derive(Debug, Clone)]
pub struct Stream<'a> {
    tree: &'a KdTree,
    centre: Vec3,
    reach: f64,
    last: Option<Neighbour>,
    shell: Vec<Neighbour>,
    next: usize,
    seen: usize,
}

impl Iterator for Stream<'_> {
    type Item = Neighbour;

    fn next(&mut self) -> Option<Neighbour> {
        while self.next == self.shell.len() {
            if self.seen == self.tree.len() {
                return None;
            }
            self.last = self.shell.last().copied().or(self.last);
            self.tree
                .within(self.centre, self.reach, self.last, &mut self.shell);
            self.shell.sort_unstable_by(Neighbour::order);
            self.next = 0;
            self.seen += self.shell.len();
            self.reach *= GROWTH;
        }
        self.next += 1;
        Some(self.shell[self.next - 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    /// Random points, points of a lattice, whose distances are often equal, and all in one place.
    fn clouds() -> Vec<Vec<Vec3>> {
        let random = |count: u64| {
            (0..count).map(|i| {
                let mut rng = Rng::new(7, i);
                std::array::from_fn(|_| rng.range(-1.0, 1.0))
            })
        };
        let lattice = (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(f64::from));
        let mut clouds: Vec<Vec<Vec3>> = [0, 1, 2, 10, 11, 21, 500, 20_000]
            .into_iter()
            .map(|count| random(count).collect())
            .collect();
        clouds.push(lattice.collect());
        clouds.push(vec![[0.25, 0.5, 0.75]; 100]);
        clouds
    }

    fn brute(points: &[Vec3], p: Vec3) -> Vec<Neighbour> {
        let mut all: Vec<Neighbour> = (0u32..)
            .zip(points)
            .map(|(index, q)| Neighbour {
                distance_squared: square(std::array::from_fn(|a| q[a] - p[a])),
                index,
            })
            .collect();
        all.sort_by(Neighbour::order);
        all
    }

    #[test]
    fn searches_find_what_comparing_all_finds() {
        for points in clouds() {
            let tree = KdTree::build(&points);
            assert_eq!(tree.len(), points.len());
            let mut found = Vec::new();
            for i in 0..20 {
                let mut rng = Rng::new(3, i);
                let p = match points.get(i as usize * 7) {
                    Some(p) if i % 2 == 0 => *p,
                    _ => std::array::from_fn(|_| rng.range(-2.0, 5.0)),
                };
                let all = brute(&points, p);
                for count in [0, 1, 16, 70] {
                    tree.nearest(p, count, &mut found);
                    assert_eq!(found, all[..count.min(all.len())]);
                }
                let streamed: Vec<Neighbour> = tree.stream(p, 0.01).take(300).collect();
                assert_eq!(streamed, all[..all.len().min(300)]);
                for reach in [0.0, 0.5, 3.0] {
                    let last = all.get(5).copied();
                    tree.within(p, reach, last, &mut found);
                    found.sort_by(Neighbour::order);
                    let wanted = all.iter().filter(|n| {
                        n.distance_squared <= reach && last.is_none_or(|l| l.is_before(n))
                    });
                    assert!(found.iter().eq(wanted));
                }
            }
        }
    }

    #[test]
    fn neighbours_of_all_are_the_same_on_any_number_of_threads() {
        for points in clouds().into_iter().filter(|points| points.len() > 8) {
            let on = |threads| {
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .expect("a pool");
                pool.install(|| {
                    let tree = KdTree::build(&points);
                    let neighbours = tree.neighbours(&points, 8);
                    (tree, neighbours)
                })
            };
            let (one, rows) = on(1);
            assert_eq!((one, rows.clone()), on(8));
            for i in (0..points.len()).step_by(97) {
                let all = brute(&points, points[i]);
                let others = all.iter().map(|n| n.index).filter(|n| *n != i as u32);
                assert!(others.take(8).eq(rows[8 * i..8 * i + 8].iter().copied()));
            }
        }
    }
}
