//! Clipping ears off an outline in the plane.

use super::{Split, fan};
use crate::numeric::predicates::orient2d;
use std::collections::VecDeque;

/// Steps that clipping may take per corner before the rest becomes a fan: it bounds the time that
/// an outline made for the purpose can take, and is far over what outlines of maps and parts need.
const STEPS_PER_CORNER: usize = 4096;
/// Corners from which on a grid is worth its making.
const GRID_FROM: usize = 24;

/// What clipping needs, kept from face to face.
#[derive(Default)]
pub struct Scratch {
    /// The outline, turning counter-clockwise.
    pub flat: Vec<[f64; 2]>,
    next: Vec<usize>,
    previous: Vec<usize>,
    waiting: VecDeque<usize>,
    /// `Gone` once clipped.
    state: Vec<State>,
    grid: Grid,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Waiting,
    Tried,
    Gone,
}

/// How much is asked of an ear. Later ones are tried only when the earlier find none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// Turns left, and no other corner touches it but those at the ends of its base.
    Clear,
    /// The same, but other corners may lie at its tip (a hole joined by a bridge).
    SharedTip,
    /// A tip on the line through its neighbours: a triangle of no area.
    Flat,
}

impl Scratch {
    /// Splits the face whose outline is `flat`.
    pub fn clip(&mut self, face: &[u32], triangles: &mut Vec<[u32; 3]>) -> Split {
        let n = face.len();
        self.next.clear();
        self.next.extend((0..n).map(|i| (i + 1) % n));
        self.previous.clear();
        self.previous.extend((0..n).map(|i| (i + n - 1) % n));
        self.state.clear();
        self.state.resize(n, State::Waiting);
        self.waiting.clear();
        self.waiting.extend(0..n);
        self.grid.fill(&self.flat);
        let mut left = n;
        let mut steps = n.saturating_mul(STEPS_PER_CORNER);
        let mut rule = Rule::Clear;
        let mut first = 0;
        while left > 3 && steps > 0 {
            let Some(tip) = self.waiting.pop_front() else {
                rule = match rule {
                    Rule::Clear => Rule::SharedTip,
                    Rule::SharedTip => Rule::Flat,
                    Rule::Flat => break,
                };
                steps = steps.saturating_sub(left);
                self.wait_all(first);
                continue;
            };
            if self.state[tip] == State::Gone {
                continue;
            }
            self.state[tip] = State::Tried;
            steps -= 1;
            if !self.is_ear(tip, rule, &mut steps) {
                continue;
            }
            let (p, q) = (self.previous[tip], self.next[tip]);
            triangles.push([face[p], face[tip], face[q]]);
            self.next[p] = q;
            self.previous[q] = p;
            self.state[tip] = State::Gone;
            left -= 1;
            if first == tip {
                first = q;
            }
            // Clipping an ear makes ears of its neighbours alone (O'Rourke 1998, 1.6.5).
            if rule != Rule::Clear {
                rule = Rule::Clear;
                self.waiting.clear();
                self.state
                    .iter_mut()
                    .filter(|s| **s == State::Waiting)
                    .for_each(|s| *s = State::Tried);
                steps = steps.saturating_sub(n);
            }
            for corner in [p, q] {
                if self.state[corner] == State::Tried {
                    self.state[corner] = State::Waiting;
                    self.waiting.push_back(corner);
                }
            }
        }
        let rest = std::iter::successors(Some(first), |c| Some(self.next[*c])).take(left);
        fan(face, rest, triangles);
        if left == 3 {
            Split::Covered
        } else {
            Split::Fanned
        }
    }

    fn wait_all(&mut self, first: usize) {
        let mut corner = first;
        loop {
            self.state[corner] = State::Waiting;
            self.waiting.push_back(corner);
            corner = self.next[corner];
            if corner == first {
                return;
            }
        }
    }

    fn is_ear(&self, tip: usize, rule: Rule, steps: &mut usize) -> bool {
        let (p, q) = (self.previous[tip], self.next[tip]);
        let [a, b, c] = [self.flat[p], self.flat[tip], self.flat[q]];
        let turn = orient2d(a, b, c);
        if rule == Rule::Flat {
            return turn == 0;
        }
        if turn <= 0 {
            return false;
        }
        let blocks = |i: usize| {
            let x = self.flat[i];
            self.state[i] != State::Gone
                && ![p, tip, q].contains(&i)
                && x != a
                && x != c
                && (x != b || rule == Rule::Clear)
                && orient2d(a, b, x) >= 0
                && orient2d(b, c, x) >= 0
                && orient2d(c, a, x) >= 0
        };
        !self.grid.any_near([a, b, c], steps, blocks)
    }
}

/// Corners sorted into square cells.
#[derive(Default)]
struct Grid {
    side: usize,
    lo: [f64; 2],
    per_unit: [f64; 2],
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Grid {
    fn fill(&mut self, flat: &[[f64; 2]]) {
        self.side = if flat.len() < GRID_FROM {
            1
        } else {
            (flat.len() as f64).sqrt() as usize
        };
        self.lo = flat
            .iter()
            .fold([f64::INFINITY; 2], |m, p| [m[0].min(p[0]), m[1].min(p[1])]);
        let hi = flat.iter().fold([f64::NEG_INFINITY; 2], |m, p| {
            [m[0].max(p[0]), m[1].max(p[1])]
        });
        self.per_unit = [0, 1].map(|a| self.side as f64 / (hi[a] - self.lo[a]));
        let cells = self.side * self.side;
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        for p in flat {
            let cell = self.row(p[1]) * self.side + self.column(p[0]);
            self.starts[cell + 1] += 1;
        }
        for cell in 0..cells {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.items.clear();
        self.items.resize(flat.len(), 0);
        // Filled from the back, the offsets end as they began.
        for (i, p) in flat.iter().enumerate().rev() {
            let cell = self.row(p[1]) * self.side + self.column(p[0]);
            self.starts[cell + 1] -= 1;
            self.items[self.starts[cell + 1] as usize] = i as u32;
        }
        self.starts.rotate_left(1);
        self.starts[cells] = flat.len() as u32;
    }

    // Rounding is monotone: what lies between two coordinates lies between their cells.
    fn column(&self, x: f64) -> usize {
        (((x - self.lo[0]) * self.per_unit[0]) as usize).min(self.side - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.lo[1]) * self.per_unit[1]) as usize).min(self.side - 1)
    }

    /// Whether a test holds for any corner in the cells that a triangle's box touches.
    fn any_near(
        &self,
        triangle: [[f64; 2]; 3],
        steps: &mut usize,
        test: impl Fn(usize) -> bool,
    ) -> bool {
        let [a, b, c] = triangle;
        let lo = [0, 1].map(|i| a[i].min(b[i]).min(c[i]));
        let hi = [0, 1].map(|i| a[i].max(b[i]).max(c[i]));
        let columns = self.column(lo[0])..=self.column(hi[0]);
        for row in self.row(lo[1])..=self.row(hi[1]) {
            let from = self.starts[row * self.side + columns.start()];
            let to = self.starts[row * self.side + columns.end() + 1];
            *steps = steps.saturating_sub(1 + (to - from) as usize);
            for i in &self.items[from as usize..to as usize] {
                if test(*i as usize) {
                    return true;
                }
            }
        }
        false
    }
}
