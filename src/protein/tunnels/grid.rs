//! The widest way over the points of a grid: what CAVER 1 did, to compare with.
//!
//! Points have their clearance for a width and 26 neighbours. The widest way over them has a width within
//! `sqrt(3)/2 h` of the truth: around any way, the nearest grid points make one that is at most so much
//! narrower, and a step of at most `sqrt(3) h` dips by at most half of that between its ends
//! (Petrek et al. 2006).

use crate::error::{Error, Result};
use crate::protein::clearance::{Ball, Clearance};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::collections::hash_map::{Entry, HashMap};

/// What a search over a grid found.
#[derive(Debug, Clone, PartialEq)]
pub struct GridWay {
    /// The points of the way, from the one nearest to the start; empty where there is none.
    pub points: Vec<[f64; 3]>,
    /// The least clearance at those points.
    pub width: f64,
    /// Points whose clearance was worked out.
    pub asked: u64,
    /// Points settled.
    pub settled: u64,
    /// Points in the box around all atoms.
    pub full: f64,
}

/// The largest distance of a point to the nearest point of a grid, over the grid's spacing.
pub const REACH: f64 = 0.866_025_403_784_438_6;

/// Bytes of a point that the search knows.
const BYTES: usize = 64;

/// The widest way from `start` to beyond the box of all atoms, over points a distance `h` apart of which
/// the start is one. Errs when it would hold more than `memory` bytes.
pub fn widest(
    start: [f64; 3],
    h: f64,
    balls: &[Ball],
    clearance: &Clearance,
    memory: u64,
) -> Result<GridWay> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for ball in balls {
        for axis in 0..3 {
            low[axis] = low[axis].min(ball.centre[axis] - ball.radius);
            high[axis] = high[axis].max(ball.centre[axis] + ball.radius);
        }
    }
    let place = |p: [i32; 3]| -> [f64; 3] {
        std::array::from_fn(|axis| start[axis] + f64::from(p[axis]) * h)
    };
    let is_outside = |p: [f64; 3]| (0..3).any(|axis| p[axis] < low[axis] || p[axis] > high[axis]);
    let full: f64 = (0..3)
        .map(|axis| ((high[axis] - low[axis]) / h).floor() + 1.0)
        .product();
    let origin = [0; 3];
    let mut from = HashMap::from([(origin, origin)]);
    let mut queue = BinaryHeap::from([Waiting {
        width: clearance.at(start),
        point: origin,
    }]);
    let (mut width, mut settled) = (f64::INFINITY, 0);
    let mut points = Vec::new();
    while let Some(next) = queue.pop() {
        settled += 1;
        width = width.min(next.width);
        if is_outside(place(next.point)) {
            points = trace(next.point, &from).into_iter().map(place).collect();
            break;
        }
        if (from.len() * BYTES) as u64 > memory {
            let what = format!(
                "a grid of spacing {h}, {} of {full:.0} points so far,",
                from.len()
            );
            let hint = Some("a larger spacing needs fewer points");
            return Err(Error::over_memory(what, memory as u128 + 1, memory, hint));
        }
        for step in 0..27 {
            let [x, y, z] = next.point;
            let neighbour = [x + step % 3 - 1, y + step / 3 % 3 - 1, z + step / 9 - 1];
            if let Entry::Vacant(entry) = from.entry(neighbour) {
                entry.insert(next.point);
                queue.push(Waiting {
                    width: clearance.at(place(neighbour)),
                    point: neighbour,
                });
            }
        }
    }
    Ok(GridWay {
        points,
        width,
        asked: from.len() as u64,
        settled,
        full,
    })
}

/// The points from the start to `end`.
fn trace(end: [i32; 3], from: &HashMap<[i32; 3], [i32; 3]>) -> Vec<[i32; 3]> {
    let mut way = vec![end];
    let mut at = end;
    while from[&at] != at {
        at = from[&at];
        way.push(at);
    }
    way.reverse();
    way
}

/// A point that waits to be settled: the widest first, then the lowest.
#[derive(Debug, PartialEq)]
struct Waiting {
    width: f64,
    point: [i32; 3],
}

impl Eq for Waiting {}
impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        let widths = self.width.total_cmp(&other.width);
        widths.then(other.point.cmp(&self.point))
    }
}
impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
