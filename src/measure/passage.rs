//! How wide the widest way out between balls is, by an octree: the reference that tunnels are verified with.
//!
//! Shares nothing with the triangulations it judges. Of each cell it is known between which bounds the
//! clearance lies in it, by the distances of its box to the balls. The widest way over face-adjacent cells by
//! the upper bounds is no narrower than any continuous way; by the lower bounds it is a way. Cells on the
//! first that keep the two apart are split, until they are as near as asked for.

use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::protein::clearance::Ball;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The width of the widest way to infinity, between two bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// There is a way of this width.
    pub lower: f64,
    /// There is no wider one.
    pub upper: f64,
    /// Cells of the octree at the end.
    pub cells: u64,
    /// Searches made.
    pub rounds: u64,
}

/// Levels below the root at most: a cell is a box of whole numbers below 2^[`LEVELS`].
const LEVELS: u32 = 30;
/// Cells wider than the root by this factor are split wherever they are unsure, others on the way alone.
const COARSE: f64 = 1.0 / 64.0;
/// Bytes of a cell, its share of the lists of balls and of a search included.
const BYTES: u64 = 400;

struct Cell {
    corner: [u32; 3],
    size: u32,
    /// The clearance in the cell is between these.
    lower: f64,
    upper: f64,
    /// The first of eight parts; 0 for a leaf.
    parts: u32,
    /// Balls that may be the nearest somewhere in a leaf.
    balls: Vec<u32>,
}

struct Tree<'a> {
    balls: &'a [Ball],
    cells: Vec<Cell>,
    low: [f64; 3],
    unit: f64,
}

/// Brackets the width of the widest way from `start` to infinity, `tolerance` apart.
///
/// Errs with [`Error::Limit`] where that takes more than `memory` bytes. For `n` balls, what is spent grows
/// with the number of places where the way is nearly closed or nearly open, and with the logarithm of the
/// tolerance.
pub fn passage(
    balls: &[Ball],
    start: [f64; 3],
    tolerance: f64,
    memory: u64,
    progress: &dyn Progress,
) -> Result<Passage> {
    let mut tree = Tree::new(balls, start);
    let clear = balls
        .iter()
        .map(|ball| ball.distance(start))
        .fold(f64::INFINITY, f64::min);
    let (mut lower, mut rounds) = (f64::NEG_INFINITY, 0);
    loop {
        rounds += 1;
        progress.advance(1);
        let (upper, way, seen) = tree.widest(start, clear);
        let least = way.iter().map(|cell| tree.cells[*cell as usize].lower);
        lower = least.fold(clear, f64::min).max(lower);
        let cells = tree.cells.len() as u64;
        if upper - lower <= tolerance {
            return Ok(Passage {
                lower,
                upper,
                cells,
                rounds,
            });
        }
        if cells * BYTES > memory {
            let what = format!("an octree of {cells} cells around the way out");
            let needed = u128::from(cells * BYTES);
            return Err(Error::over_memory(
                what,
                needed,
                memory,
                Some("raise --max-memory"),
            ));
        }
        let before = tree.cells.len();
        let coarse = (f64::from(tree.cells[0].size) * COARSE) as u32;
        let unsure = |tree: &Tree, cell: u32| tree.cells[cell as usize].lower < upper - tolerance;
        for cell in seen {
            if tree.cells[cell as usize].size > coarse && unsure(&tree, cell) {
                tree.split(cell);
            }
        }
        for cell in way {
            if tree.cells[cell as usize].parts == 0 && unsure(&tree, cell) {
                tree.split(cell);
            }
        }
        if tree.cells.len() == before {
            // No cell can be split any more: rounding keeps the bounds apart.
            return Ok(Passage {
                lower,
                upper,
                cells,
                rounds,
            });
        }
    }
}

impl<'a> Tree<'a> {
    fn new(balls: &'a [Ball], start: [f64; 3]) -> Self {
        let mut low = start;
        let mut high = start;
        for ball in balls {
            for axis in 0..3 {
                low[axis] = low[axis].min(ball.centre[axis] - ball.radius);
                high[axis] = high[axis].max(ball.centre[axis] + ball.radius);
            }
        }
        let extent = (0..3)
            .map(|axis| high[axis] - low[axis])
            .fold(0.0, f64::max);
        let size = 1 << LEVELS;
        // A little wider than the balls, so that the start is inside.
        let unit = extent * 1.01 / f64::from(size);
        let low = std::array::from_fn(|axis| {
            0.5 * (low[axis] + high[axis]) - 0.5 * unit * f64::from(size)
        });
        let mut tree = Tree {
            balls,
            cells: vec![],
            low,
            unit,
        };
        let all: Vec<u32> = (0..balls.len() as u32).collect();
        let root = tree.cell([0; 3], size, &all);
        tree.cells.push(root);
        tree
    }

    /// A cell with the bounds of the clearance in it, given what balls may be near.
    fn cell(&self, corner: [u32; 3], size: u32, near: &[u32]) -> Cell {
        let low: [f64; 3] = std::array::from_fn(|k| self.low[k] + f64::from(corner[k]) * self.unit);
        let side = f64::from(size) * self.unit;
        let (mut lower, mut upper) = (f64::INFINITY, f64::INFINITY);
        let bounds = |ball: &Ball| {
            let (mut least, mut most) = (0.0, 0.0);
            for axis in 0..3 {
                let from = ball.centre[axis] - low[axis];
                let out = (-from).max(from - side).max(0.0);
                let far = from.abs().max((side - from).abs());
                least += out * out;
                most += far * far;
            }
            (
                f64::sqrt(least) - ball.radius,
                f64::sqrt(most) - ball.radius,
            )
        };
        for ball in near {
            let (least, most) = bounds(&self.balls[*ball as usize]);
            lower = lower.min(least);
            upper = upper.min(most);
        }
        let may_be_nearest = |ball: &&u32| bounds(&self.balls[**ball as usize]).0 <= upper;
        Cell {
            corner,
            size,
            lower,
            upper,
            parts: 0,
            balls: near.iter().filter(may_be_nearest).copied().collect(),
        }
    }

    fn split(&mut self, index: u32) {
        let cell = &mut self.cells[index as usize];
        if cell.size == 1 || cell.parts != 0 {
            return;
        }
        let near = std::mem::take(&mut cell.balls);
        let (corner, half) = (cell.corner, cell.size / 2);
        let first = self.cells.len() as u32;
        for part in 0..8u32 {
            let corner = std::array::from_fn(|axis| corner[axis] + (part >> axis & 1) * half);
            let made = self.cell(corner, half, &near);
            self.cells.push(made);
        }
        self.cells[index as usize].parts = first;
    }

    /// The leaf that holds a point of the root.
    fn leaf_at(&self, p: [f64; 3]) -> u32 {
        let most = f64::from(self.cells[0].size) - 1.0;
        let place: [u32; 3] = std::array::from_fn(|axis| {
            ((p[axis] - self.low[axis]) / self.unit)
                .floor()
                .clamp(0.0, most) as u32
        });
        let mut at = 0;
        while self.cells[at as usize].parts != 0 {
            let Cell {
                corner,
                size,
                parts,
                ..
            } = &self.cells[at as usize];
            let part: u32 = (0..3)
                .map(|k| u32::from(place[k] - corner[k] >= size / 2) << k)
                .sum();
            at = parts + part;
        }
        at
    }

    /// The leaves that share a piece of a face with a cell, below or above it along an axis; whether
    /// that face is one of the root's.
    fn beyond(&self, cell: u32, axis: usize, above: bool, found: &mut Vec<u32>) -> bool {
        let Cell { corner, size, .. } = self.cells[cell as usize];
        let plane = if above {
            corner[axis] + size
        } else {
            corner[axis]
        };
        if plane == 0 || plane == self.cells[0].size {
            return true;
        }
        // The cells behind the plane begin there, or end there.
        let row = if above { plane } else { plane - 1 };
        let mut waiting = vec![0u32];
        while let Some(at) = waiting.pop() {
            let other = &self.cells[at as usize];
            let overlaps = (0..3).all(|k| {
                let (low, high) = (other.corner[k], other.corner[k] + other.size);
                match k == axis {
                    true => low <= row && row < high,
                    false => low < corner[k] + size && corner[k] < high,
                }
            });
            if overlaps && other.parts == 0 {
                found.push(at);
            } else if overlaps {
                waiting.extend(other.parts..other.parts + 8);
            }
        }
        false
    }

    /// The widest way by upper bounds from a point to the faces of the root: its width, its leaves, and
    /// all leaves that were settled.
    fn widest(&self, start: [f64; 3], clear: f64) -> (f64, Vec<u32>, Vec<u32>) {
        let first = self.leaf_at(start);
        let mut from = vec![u32::MAX; self.cells.len()];
        let mut queue = BinaryHeap::from([Waiting(clear, first)]);
        from[first as usize] = first;
        let (mut seen, mut beyond) = (Vec::new(), Vec::new());
        while let Some(Waiting(width, cell)) = queue.pop() {
            seen.push(cell);
            for side in 0..6 {
                beyond.clear();
                if self.beyond(cell, side / 2, side % 2 == 1, &mut beyond) {
                    let mut way = vec![cell];
                    while from[way[way.len() - 1] as usize] != way[way.len() - 1] {
                        way.push(from[way[way.len() - 1] as usize]);
                    }
                    let own = self.cells[cell as usize].upper;
                    return (width.min(own), way, seen);
                }
                for other in &beyond {
                    // The first to reach a leaf is the widest to do so.
                    if from[*other as usize] == u32::MAX {
                        from[*other as usize] = cell;
                        queue.push(Waiting(
                            width.min(self.cells[*other as usize].upper),
                            *other,
                        ));
                    }
                }
            }
        }
        unreachable!("the faces of the root are reached, however narrow the way");
    }
}

/// A leaf that waits to be settled: the widest first, then the lowest.
#[derive(PartialEq)]
struct Waiting(f64, u32);

impl Eq for Waiting {}
impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}
impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::numeric::vector::{length, sub};
    use crate::progress::Silent;
    use crate::protein::tunnels::{Exit, Method, Params, find};

    fn known(balls: &[Ball], start: [f64; 3], tolerance: f64) -> Passage {
        passage(balls, start, tolerance, u64::MAX, &Silent).expect("no limit")
    }

    #[test]
    fn a_lattice_has_the_gate_of_theory() {
        let balls: Vec<Ball> = (0..64)
            .map(|k| Ball {
                centre: [k % 4, k / 4 % 4, k / 16].map(|c| 6.0 * f64::from(c)),
                radius: 1.7,
            })
            .collect();
        let truth = 6.0 / 2f64.sqrt() - 1.7;
        let found = known(&balls, [9.0; 3], 0.02);
        assert!(found.lower <= truth && truth <= found.upper, "{found:?}");
        assert!(found.upper - found.lower <= 0.02);
        // Held by the start: no way is wider than where it begins.
        let found = known(&balls, [6.0, 6.0, 8.0], 1e-4);
        assert!(
            (found.lower - 0.3).abs() < 1e-4 && (found.upper - 0.3).abs() < 1e-4,
            "{found:?}"
        );
    }

    #[test]
    fn it_confirms_the_exact_method_on_random_balls() {
        let radii = [1.2, 1.52, 1.55, 1.7, 1.8];
        let mut narrow = 0;
        for seed in 0..12 {
            let mut rng = Rng::new(seed, 1);
            let mut balls: Vec<Ball> = Vec::new();
            while balls.len() < 70 {
                let centre = [0, 1, 2].map(|_| rng.range(-6.5, 6.5));
                let made = Ball {
                    centre,
                    radius: radii[rng.below(if seed < 8 { 5 } else { 1 })],
                };
                let is_free = made.distance([0.0; 3]) > 1.5 && length(centre) < 6.5;
                if is_free && balls.iter().all(|b| length(sub(b.centre, centre)) > 1.6) {
                    balls.push(made);
                }
            }
            let params = Params {
                method: Method::Exact,
                exit: Exit::Hull,
                start_search: 0.0,
                probe_radius: 0.0,
                count: 1,
                ..Params::DEFAULT
            };
            let exact = find(&balls, [0.0; 3], &params, &Silent).expect("a start inside");
            let exact = exact.widest.expect("a way");
            let found = known(&balls, [0.0; 3], 0.02);
            assert!(
                found.lower <= exact.upper && exact.lower <= found.upper,
                "{seed}: {found:?} {exact:?}"
            );
            assert!(found.upper - found.lower <= 0.02, "{seed}");
            narrow += usize::from(exact.lower < 1.5);
        }
        assert!(
            narrow > 6,
            "{narrow}: most should have a gate narrower than the start"
        );
    }

    #[test]
    fn the_limit_holds() {
        let ball = |x: f64| Ball {
            centre: [x, 0.0, 0.0],
            radius: 1.0,
        };
        let error = passage(&[ball(-2.0), ball(2.0)], [0.0; 3], 1e-9, 1000, &Silent);
        assert!(matches!(error, Err(Error::Limit { .. })));
    }
}
