//! The lowest and the highest height over parts of a surface.

use super::surface::Surface;
use crate::vector::Vec2;
use rayon::prelude::*;

/// Squares along the side of the smallest block.
pub const BLOCK: usize = 4;

/// A lowest and a highest local height; empty where the first is above the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// No more than any height.
    pub low: f32,
    /// No less than any height.
    pub high: f32,
}

impl Span {
    /// No height.
    pub const EMPTY: Span = Span {
        low: f32::INFINITY,
        high: f32::NEG_INFINITY,
    };

    /// Whether there is no height.
    #[inline]
    pub fn is_empty(self) -> bool {
        self.low > self.high
    }

    /// The span of both.
    #[inline]
    pub fn union(self, other: Span) -> Span {
        Span {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn of(low: f64, high: f64) -> Span {
        if low > high {
            return Span::EMPTY;
        }
        // Outward, so that rounding never cuts a height off.
        let (l, h) = (low as f32, high as f32);
        Span {
            low: if f64::from(l) > low { l.next_down() } else { l },
            high: if f64::from(h) < high { h.next_up() } else { h },
        }
    }
}

struct Level {
    columns: usize,
    rows: usize,
    spans: Vec<Span>,
}

/// Spans of blocks of squares, of blocks of four of these, and so on up to one.
pub struct Pyramid {
    /// The finest first.
    levels: Vec<Level>,
}

/// What a query found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Local heights over the footprint; empty where it has none.
    pub span: Span,
    /// Nodes it looked at.
    pub visited: u64,
}

impl Pyramid {
    /// The pyramid of a surface, for triangles and patches alike: both stay between their corners.
    ///
    /// Cost: linear in the cells; two thirds of a byte for each.
    pub fn new(surface: &Surface) -> Pyramid {
        let [columns, rows] = surface.squares().map(|n| n.div_ceil(BLOCK));
        let last = [surface.grid().columns - 1, surface.grid().rows - 1];
        let spans = (0..columns * rows)
            .into_par_iter()
            .map(|block| {
                let (x, y) = (block % columns * BLOCK, block / columns * BLOCK);
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for row in y..=(y + BLOCK).min(last[1]) {
                    for column in x..=(x + BLOCK).min(last[0]) {
                        // A missing height is a NaN, which neither takes.
                        let z = surface.local(column, row);
                        low = low.min(z);
                        high = high.max(z);
                    }
                }
                Span::of(low, high)
            })
            .collect();
        let mut levels = vec![Level {
            columns,
            rows,
            spans,
        }];
        while let Some(below) = levels.last().filter(|l| l.columns * l.rows > 1) {
            levels.push(coarser(below));
        }
        Pyramid { levels }
    }

    /// Levels; the last has one node.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Nodes of all levels.
    pub fn nodes(&self) -> u64 {
        let all = self.levels.iter();
        all.map(|level| level.spans.len() as u64).sum()
    }

    /// The span of a node, by its level, 0 for the finest; empty beyond the surface.
    #[inline]
    pub fn span(&self, level: usize, column: usize, row: usize) -> Span {
        let level = &self.levels[level];
        if column < level.columns && row < level.rows {
            level.spans[row * level.columns + column]
        } else {
            Span::EMPTY
        }
    }

    /// Local heights of the whole surface.
    pub fn whole(&self) -> Span {
        let top = self.levels.last();
        top.map_or(Span::EMPTY, |level| level.spans[0])
    }

    /// Heights over all blocks for whose boxes a test holds.
    ///
    /// The test gets a box of the lattice, its lower and upper corner, and must hold for a box when it holds
    /// for a part of it. Nodes that can add nothing to what is found are not opened. Cost: the nodes along the
    /// footprint's border.
    pub fn over(&self, mut meets: impl FnMut(Vec2, Vec2) -> Meets) -> Found {
        let mut found = Found {
            span: Span::EMPTY,
            visited: 0,
        };
        let mut stack = vec![(self.levels.len() - 1, 0, 0)];
        while let Some((level, column, row)) = stack.pop() {
            let span = self.span(level, column, row);
            if span.is_empty() || found.span.union(span) == found.span {
                continue;
            }
            found.visited += 1;
            let size = (BLOCK << level) as f64;
            let lo = [column as f64 * size, row as f64 * size];
            match meets(lo, [lo[0] + size, lo[1] + size]) {
                Meets::No => {}
                Meets::Partly if level > 0 => {
                    for child in 0..4 {
                        let (x, y) = (child & 1, child >> 1);
                        stack.push((level - 1, 2 * column + x, 2 * row + y));
                    }
                }
                Meets::Partly | Meets::Wholly => found.span = found.span.union(span),
            }
        }
        found
    }

    /// Heights over a segment of the lattice, widened by a distance to all sides.
    pub fn over_segment(&self, a: Vec2, b: Vec2, around: f64) -> Found {
        self.over(|lo, hi| {
            let lo = [lo[0] - around, lo[1] - around];
            let hi = [hi[0] + around, hi[1] + around];
            if segment_meets_box(a, b, lo, hi) {
                Meets::Partly
            } else {
                Meets::No
            }
        })
    }

    /// Heights over a box of the lattice.
    pub fn over_box(&self, low: Vec2, high: Vec2) -> Found {
        self.over(|lo, hi| {
            let apart = (0..2).any(|a| hi[a] < low[a] || high[a] < lo[a]);
            let within = (0..2).all(|a| low[a] <= lo[a] && hi[a] <= high[a]);
            match (apart, within) {
                (true, _) => Meets::No,
                (_, true) => Meets::Wholly,
                _ => Meets::Partly,
            }
        })
    }
}

/// How a footprint lies to a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meets {
    /// Apart from it.
    No,
    /// It has a part of it.
    Partly,
    /// It has all of it.
    Wholly,
}

fn coarser(below: &Level) -> Level {
    let (columns, rows) = (below.columns.div_ceil(2), below.rows.div_ceil(2));
    let spans = (0..columns * rows)
        .into_par_iter()
        .map(|node| {
            let (x, y) = (node % columns * 2, node / columns * 2);
            let mut span = Span::EMPTY;
            for row in y..(y + 2).min(below.rows) {
                for column in x..(x + 2).min(below.columns) {
                    span = span.union(below.spans[row * below.columns + column]);
                }
            }
            span
        })
        .collect();
    Level {
        columns,
        rows,
        spans,
    }
}

/// Whether a segment and a closed box meet; with rounding, it may say so of ones that nearly do.
pub(crate) fn segment_meets_box(a: Vec2, b: Vec2, lo: Vec2, hi: Vec2) -> bool {
    if (0..2).any(|k| a[k].max(b[k]) < lo[k] || a[k].min(b[k]) > hi[k]) {
        return false;
    }
    // The box is apart from the line when all its corners are on one side.
    let d = [b[0] - a[0], b[1] - a[1]];
    let centre = [0, 1].map(|k| (lo[k] + hi[k]) * 0.5 - a[k]);
    let half = [0, 1].map(|k| (hi[k] - lo[k]) * 0.5);
    let off = (d[0] * centre[1] - d[1] * centre[0]).abs();
    let reach = half[0] * d[1].abs() + half[1] * d[0].abs();
    off <= reach * (1.0 + 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::terrain::surface::Kind;
    use crate::terrain::surface::tests::grid;

    #[test]
    fn spans_hold_every_height_below_them() {
        let grid = grid(61, 43, 1.0, |x, y| {
            let z = (x * 0.37).sin() * 31.7 + (y * 0.21).cos() * 17.3;
            if (x as usize * 7 + y as usize).is_multiple_of(23) {
                -9999.0
            } else {
                z
            }
        });
        let surface = Surface::new(&grid, Kind::Tin).unwrap();
        let pyramid = Pyramid::new(&surface);
        let mut rng = Rng::new(5, 0);
        let mut tight = 0;
        for _ in 0..300 {
            let mut place = || [rng.range(-5.0, 65.0), rng.range(-5.0, 48.0)];
            let (a, b) = (place(), place());
            let found = pyramid.over_segment(a, b, 0.5);
            for k in 0..=200 {
                let t = f64::from(k) / 200.0;
                let p = [0, 1].map(|i| a[i] + t * (b[i] - a[i]));
                if let Some(z) = surface.local_height(p) {
                    let span = found.span;
                    assert!(f64::from(span.low) <= z && z <= f64::from(span.high));
                }
            }
            tight += u64::from(found.span != pyramid.whole());
            assert!(found.visited <= pyramid.nodes());
        }
        assert!(tight > 100, "{tight}");
        let all = pyramid.over_box([-1.0, -1.0], [99.0, 99.0]);
        assert_eq!((all.span, all.visited), (pyramid.whole(), 1));
        let none = pyramid.over_box([-9.0, -9.0], [-8.0, -8.0]);
        assert!(none.span.is_empty());
    }
}
