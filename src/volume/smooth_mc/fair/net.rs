//! The weights of the energy: what a step needs to know of the curves.

use super::{CHUNK, Fair, GROUP};
use crate::volume::isosurface::NONE;
use crate::volume::smooth_mc::region::Constraint;
use rayon::prelude::*;
use wide::f32x4;

/// Step over the inverse of the diagonal: rows hold (1, -2, 1), and (1 + 2 + 1)^2 / (1 + 4 + 1) = 8/3.
const STEP: f32 = 3.0 / 8.0;

/// A chord is never taken for shorter than this share of its first length.
const SHORTEST: f32 = 0.5;

/// A vertex on its two curves, in one line of the cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Node {
    /// As the surface has them; the vertex itself where there is none.
    pub links: [u32; 4],
    /// One over the length of the chord of each slot; 0 where there is none.
    pub inverse: [f32; 4],
    /// For each curve, the sum of its steps over the lengths of their chords, and in the last lane two
    /// over the sum of these lengths; that is 0 where the curve ends.
    pub curves: [f32x4; 2],
}

impl Node {
    /// The change of direction along both curves, weighted; the last lanes mean nothing.
    #[inline]
    pub(super) fn bends(&self, vertex: usize, at: &[f32x4]) -> [f32x4; 2] {
        let own = at[vertex];
        let curve = |c: usize| {
            let constant = self.curves[c];
            let row = f32x4::splat(constant.to_array()[3]);
            let [down, up] = [self.inverse[2 * c], self.inverse[2 * c + 1]];
            let to = [2 * c, 2 * c + 1].map(|slot| at[(self.links[slot] >> 2) as usize]);
            let chords = to[0] * f32x4::splat(down) + to[1] * f32x4::splat(up)
                - own * f32x4::splat(down + up);
            (chords + constant) * row
        };
        [curve(0), curve(1)]
    }
}

/// How vertices of a group are moved, each in its own lane.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Moves {
    /// One over how far it may go inwards along its edge, along that axis.
    pub inward: [f32x4; 3],
    /// The step of each.
    pub step: [f32; 4],
}

/// What is known of all vertices. Lists are filled up to whole groups with vertices of no curve.
pub(super) struct Net {
    pub nodes: Vec<Node>,
    pub moves: Vec<Moves>,
    /// Of each group, by bits: whose regions are not what the others' are (low), and where curves end
    /// without going on (high).
    pub special: Vec<u8>,
    /// Of each chunk, the first and last vertex that it refers to or is referred to by.
    pub reach: Vec<[u32; 2]>,
    /// As the last lanes of the curves.
    rows: Vec<[f32; 2]>,
}

impl Net {
    pub(super) fn new(fair: &Fair) -> Net {
        let n = fair.surface.len();
        let filled = n.next_multiple_of(GROUP);
        let mut nodes = vec![Node::default(); filled];
        let mut moves = vec![Moves::default(); filled / GROUP];
        let mut special = vec![0; filled / GROUP];
        let reach = nodes
            .par_chunks_mut(CHUNK)
            .zip(moves.par_chunks_mut(CHUNK / GROUP))
            .zip(special.par_chunks_mut(CHUNK / GROUP))
            .enumerate()
            .map(|(chunk, ((nodes, moves), special))| {
                let mut reach = [u32::MAX, 0];
                for (i, node) in nodes.iter_mut().enumerate() {
                    let v = chunk * CHUNK + i;
                    let own = (v as u32) << 2;
                    node.links = match fair.surface.links.get(v) {
                        Some(links) => links.map(|to| if to == NONE { own } else { to }),
                        None => [own; 4],
                    };
                    let arms = fair.arms(v).map(|(from, _)| from as u32);
                    for to in node.links.into_iter().map(|link| link >> 2).chain(arms) {
                        reach = [reach[0].min(to), reach[1].max(to)];
                    }
                    if v < n {
                        fair.start(v, &mut moves[i / GROUP], &mut special[i / GROUP]);
                    }
                }
                reach
            })
            .collect();
        Net {
            nodes,
            moves,
            special,
            reach,
            rows: vec![[0.0; 2]; filled],
        }
    }

    /// The lengths of chords as they are, and what follows from them.
    pub(super) fn weigh(&mut self, fair: &Fair, offsets: &[f32x4]) {
        let n = fair.surface.len();
        let shortest: Vec<f32> = fair
            .steps
            .iter()
            .map(|step| SHORTEST * (*step * *step).reduce_add().sqrt())
            .collect();
        self.nodes[..n]
            .par_chunks_mut(CHUNK)
            .zip(self.rows.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, (nodes, rows))| {
                for (i, (node, rows)) in nodes.iter_mut().zip(rows).enumerate() {
                    *rows = fair.weigh(chunk * CHUNK + i, offsets, &shortest, node);
                }
            });
        // A diagonal is made of rows of the neighbours too.
        let (nodes, rows) = (&self.nodes, &self.rows);
        self.moves
            .par_chunks_mut(CHUNK / GROUP)
            .enumerate()
            .for_each(|(chunk, moves)| {
                for (i, moves) in moves.iter_mut().enumerate() {
                    let first = chunk * CHUNK + i * GROUP;
                    let special = self.special[first / GROUP] >> 4;
                    for (lane, step) in moves.step.iter_mut().enumerate() {
                        let mut diagonal = diagonal(first + lane, nodes, rows);
                        if special >> lane & 1 == 1 {
                            for (from, slot) in fair.arms(first + lane) {
                                diagonal +=
                                    rows[from][slot / 2] * nodes[from].inverse[slot].powi(2);
                            }
                        }
                        *step = if diagonal > 0.0 { STEP / diagonal } else { 0.0 };
                    }
                }
            });
    }
}

fn diagonal(vertex: usize, nodes: &[Node], rows: &[[f32; 2]]) -> f32 {
    let node = &nodes[vertex];
    let own = rows[vertex];
    let mut diagonal = 0.0;
    for curve in 0..2 {
        let both = node.inverse[2 * curve] + node.inverse[2 * curve + 1];
        diagonal += own[curve] * both * both;
    }
    for slot in 0..4 {
        let link = node.links[slot];
        let row = rows[(link >> 2) as usize][(link >> 1 & 1) as usize];
        diagonal += row * node.inverse[slot] * node.inverse[slot];
    }
    diagonal
}

impl Fair<'_> {
    /// Where a vertex may go.
    fn start(&self, vertex: usize, moves: &mut Moves, special: &mut u8) {
        let region = (self.regions)(vertex);
        let lane = vertex % GROUP;
        let plain = region.constraint == Constraint::Diamond
            && region.reach as f32 == self.diamond.reach
            && !region.fixed.contains(&true);
        let limit = region.inward * f64::from(self.metric[region.axis]);
        let axis = &mut moves.inward[region.axis];
        let mut lanes = axis.to_array();
        lanes[lane] = (-region.outward / limit) as f32;
        *axis = f32x4::from(lanes);
        *special |= u8::from(!plain) << lane;
        *special |= u8::from(!self.surface.is_on_edge(vertex)) << (GROUP + lane);
    }

    /// The curves that end at a vertex without going on: the vertex that they come from, and its slot.
    pub(super) fn arms(&self, vertex: usize) -> impl Iterator<Item = (usize, usize)> {
        let arms = &self.surface.arms[..];
        // Those that fill up the last group are none of the surface's.
        let none = arms.is_empty() || vertex >= self.surface.len();
        let all = if none || self.surface.is_on_edge(vertex) {
            &[]
        } else {
            let of = |v: usize| arms.partition_point(|arm| (arm.0 as usize) < v);
            &arms[of(vertex)..of(vertex + 1)]
        };
        all.iter()
            .map(|arm| ((arm.1 >> 2) as usize, (arm.1 & 3) as usize))
    }

    /// The chords of a vertex as they are. Returns its rows.
    #[inline]
    fn weigh(
        &self,
        vertex: usize,
        offsets: &[f32x4],
        shortest: &[f32],
        node: &mut Node,
    ) -> [f32; 2] {
        let codes = self.surface.steps[vertex].map(usize::from);
        let steps = codes.map(|code| self.steps[code]);
        let own = offsets[vertex];
        let to = |slot: usize| offsets[(node.links[slot] >> 2) as usize];
        let chords = [0, 1, 2, 3].map(|slot| steps[slot] + (to(slot) - own));
        let [x, y, z, _] = f32x4::transpose(chords);
        let shortest = f32x4::from(codes.map(|code| shortest[code]));
        let sizes = (x * x + y * y + z * z).sqrt().fast_max(shortest);
        // There is no chord to the vertex itself.
        let links = self.surface.links[vertex];
        let inverse = (f32x4::ONE / sizes).to_array();
        node.inverse = std::array::from_fn(|slot| {
            if links[slot] == NONE {
                0.0
            } else {
                inverse[slot]
            }
        });
        let sizes = sizes.to_array();
        let rows = [0, 1].map(|curve| {
            if links[2 * curve] == NONE || links[2 * curve + 1] == NONE {
                0.0
            } else {
                2.0 / (sizes[2 * curve] + sizes[2 * curve + 1])
            }
        });
        node.curves = std::array::from_fn(|curve| {
            let sum = [2 * curve, 2 * curve + 1]
                .map(|slot| steps[slot] * f32x4::splat(node.inverse[slot]));
            let [x, y, z, _] = (sum[0] + sum[1]).to_array();
            f32x4::from([x, y, z, rows[curve]])
        });
        rows
    }
}
