//! The one-sided Hausdorff distance between two surfaces, with a proven upper bound.

use super::surface::{Hit, Surface};
use crate::numeric::vector::{Vec3, length, lerp, sub};
use crate::progress::Progress;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Pieces split at once; fixed, so that the work never follows the number of threads.
const BATCH: usize = 1024;
/// What the roundings of local coordinates (below 2 in size) and of the distances between them can
/// hide, those of some thirty halvings included.
const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// A point of the surface measured from, and its distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    pub point: Vec3,
    pub hit: Hit,
}

/// What is known of the largest distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// A point that is as far as any found.
    pub reached: Reached,
    /// No point is farther.
    pub upper: f64,
    /// How many pieces were split.
    pub pieces: u64,
}

/// When to stop splitting.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// The upper bound is this close to the distance reached.
    pub gap: f64,
    /// So many pieces have been split.
    pub pieces: u64,
}

/// Part of an element of the surface measured from.
#[derive(Debug, Clone, Copy)]
struct Piece {
    corners: [Vec3; 3],
    hits: [Hit; 3],
    upper: f64,
    /// When it was made: the older of two equals goes first.
    number: u64,
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        let newer = other.number.cmp(&self.number);
        self.upper.total_cmp(&other.upper).then(newer)
    }
}

/// Bounds the largest distance from a point of `from` to `to` by branch and bound.
///
/// `hits` are the nearest elements of the vertices of `from`, in the order of `from.vertices`;
/// `reached` is the farthest point known. The distance to one element of `to` is convex, so over a
/// triangle it is largest at a corner: the smallest over all elements of the largest over the
/// corners bounds a piece from above. So does the distance at a corner plus the size of the piece,
/// for the distance changes no faster than the point. The piece of largest bound is halved next.
/// Idea: Guthe, Borodin, Klein 2005, "Fast and accurate Hausdorff distance calculation between
/// meshes", section 3.
pub fn bound(
    from: &Surface,
    to: &Surface,
    hits: &[Hit],
    mut reached: Reached,
    stop: Stop,
    progress: &dyn Progress,
) -> Bounds {
    let (mut heap, mut settled) = whole_elements(from, to, hits, reached.hit.distance);
    let mut next = from.corners.len() as u64;
    let mut split = 0;
    while split < stop.pieces {
        let most = BATCH.min((stop.pieces - split) as usize);
        let limit = reached.hit.distance + stop.gap;
        let mut batch = Vec::with_capacity(most);
        while batch.len() < most && heap.peek().is_some_and(|piece| piece.upper > limit) {
            batch.extend(heap.pop());
        }
        if batch.is_empty() {
            break;
        }
        let halves: Vec<(Reached, [Piece; 2])> = batch
            .par_iter()
            .with_max_len(32)
            .map(|piece| piece.halve(to, limit))
            .collect();
        for (middle, _) in &halves {
            if middle.hit.distance > reached.hit.distance {
                reached = *middle;
            }
        }
        for mut half in halves.into_iter().flat_map(|(_, halves)| halves) {
            if half.upper > reached.hit.distance {
                half.number = next;
                next += 1;
                heap.push(half);
            }
        }
        split += batch.len() as u64;
        progress.advance(batch.len() as u64);
    }
    if let Some(piece) = heap.peek() {
        settled = settled.max(piece.upper);
    }
    Bounds {
        reached,
        upper: settled.max(reached.hit.distance) + ROUNDING,
        pieces: split,
    }
}

/// The elements that may hold a point farther than `reached`, and the largest bound of the others.
fn whole_elements(
    from: &Surface,
    to: &Surface,
    hits: &[Hit],
    reached: f64,
) -> (BinaryHeap<Piece>, f64) {
    let vertex_count = from.vertices.last().map_or(0, |(v, _)| *v as usize + 1);
    let mut row = vec![0u32; vertex_count];
    for (i, (v, _)) in from.vertices.iter().enumerate() {
        row[*v as usize] = i as u32;
    }
    let pieces: Vec<Piece> = (0..from.corners.len())
        .into_par_iter()
        .filter_map(|element| {
            let mut piece = Piece {
                corners: from.corners[element],
                hits: from.indices[element].map(|v| hits[row[v as usize] as usize]),
                upper: f64::INFINITY,
                number: element as u64,
            };
            piece.tighten(to, reached);
            (piece.upper > reached).then_some(piece)
        })
        .collect();
    (pieces.into(), reached)
}

impl Piece {
    /// Lowers the upper bound as far as it can be; stops early once it is at most `enough`.
    fn tighten(&mut self, to: &Surface, enough: f64) {
        for (i, hit) in self.hits.iter().enumerate() {
            let others = [(i + 1) % 3, (i + 2) % 3];
            let radius = others.map(|j| length(sub(self.corners[j], self.corners[i])));
            self.upper = self.upper.min(hit.distance + radius[0].max(radius[1]));
        }
        for (i, hit) in self.hits.iter().enumerate() {
            if self.upper <= enough {
                return;
            }
            let repeated = self.hits[..i].iter().any(|h| h.element == hit.element);
            if !repeated {
                let to_one = |p: &Vec3| to.closest_on(hit.element, *p).distance_squared;
                let largest = self.corners.iter().map(to_one).fold(0.0, f64::max);
                self.upper = self.upper.min(largest.sqrt());
            }
        }
        if self.upper > enough {
            self.upper = self.upper.min(self.bound_by_cuts(to));
        }
        if self.upper > enough
            && let Some(hit) = to.nearest_to_all(&self.corners, self.upper)
        {
            self.upper = self.upper.min(hit.distance);
        }
    }

    /// An upper bound from cutting the piece into one part for each element that is nearest to a
    /// corner: over each part the distance to its element is largest at a corner of the part.
    ///
    /// It holds wherever the cuts are; they are made where two elements are equally far. This is
    /// what bounds a piece that lies across an edge of the other surface.
    fn bound_by_cuts(&self, to: &Surface) -> f64 {
        let distance = |i: usize, p: Vec3| to.closest_on(self.hits[i].element, p).distance_squared;
        let cuts = [0, 1, 2].map(|i| {
            let j = (i + 1) % 3;
            (self.hits[i].element != self.hits[j].element).then(|| {
                let t = equal_point(|t| {
                    let p = lerp(self.corners[i], self.corners[j], t);
                    distance(i, p) - distance(j, p)
                });
                lerp(self.corners[i], self.corners[j], t)
            })
        });
        let middle = match cuts {
            [Some(a), Some(b), Some(c)] => {
                Some(std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0))
            }
            _ => None,
        };
        // The part of a corner ends at the cuts of its two edges and at their common middle.
        let ends = |i: usize| [cuts[i], cuts[(i + 2) % 3], middle].into_iter().flatten();
        (0..3)
            .flat_map(|i| ends(i).map(move |p| (i, p)))
            .map(|(i, p)| distance(i, p))
            .chain(self.hits.iter().map(|hit| hit.distance * hit.distance))
            .fold(0.0, f64::max)
            .sqrt()
    }

    /// The two halves across the longest edge, and what was found in its middle.
    fn halve(&self, to: &Surface, enough: f64) -> (Reached, [Piece; 2]) {
        let lengths = [0, 1, 2].map(|i| length(sub(self.corners[(i + 1) % 3], self.corners[i])));
        let longest = (1..3).fold(0, |l, i| if lengths[i] > lengths[l] { i } else { l });
        let (i, j) = (longest, (longest + 1) % 3);
        let point = lerp(self.corners[i], self.corners[j], 0.5);
        let hit = to.nearest(point, self.hits[i].element);
        let halves = [i, j].map(|replaced| {
            let mut half = *self;
            half.corners[replaced] = point;
            half.hits[replaced] = hit;
            half.tighten(to, enough);
            half
        });
        (Reached { point, hit }, halves)
    }
}

/// About where `f`, which is not positive at 0 and not negative at 1, is 0.
fn equal_point(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let (mut at_low, mut at_high) = (f(low), f(high));
    // The Illinois rule: an end that stays twice counts half (Dowell, Jarratt 1971).
    let mut stayed = 0;
    for _ in 0..8 {
        if at_high <= at_low {
            break;
        }
        let t = low - at_low * (high - low) / (at_high - at_low);
        let value = f(t);
        if value == 0.0 {
            return t;
        }
        if value < 0.0 {
            (low, at_low) = (t, value);
            if stayed == 1 {
                at_high *= 0.5;
            }
            stayed = 1;
        } else {
            (high, at_high) = (t, value);
            if stayed == -1 {
                at_low *= 0.5;
            }
            stayed = -1;
        }
    }
    if -at_low < at_high { low } else { high }
}
