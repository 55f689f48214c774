//! The fairest surface within the constraint: least bending of the curves in which it meets the
//! planes of voxel centres.
//!
//! Every vertex lies on two such curves ([`Surface`]), so that they cover the surface like a net. The
//! energy is the sum over all vertices and both curves of the squared change of direction from one
//! chord to the next, divided by their mean length: the integral of squared curvature along the
//! curves, in the manner of a thin plate. Its minimum among all surfaces whose vertices stay in their
//! regions is sought by projected gradients with momentum (Y. Nesterov 1983; A. Beck and M. Teboulle,
//! "FISTA", 2009; restarted where it turns back, B. O'Donoghue and E. Candes 2015), each vertex with a
//! step of its own size: a row of the energy holds three vertices, whence 3/8 of the inverse of the
//! diagonal never overshoots. The lengths of chords follow the surface every few steps.
//!
//! A curve of lagging chords shrinks a little. What is enclosed is therefore held to what the voxels
//! hold, part by part: with each change of the lengths all vertices of a part are moved along their
//! normals by what is missing over its area.
//!
//! Offsets from the first places are kept in single precision, in units of the smallest spacing: they
//! are below one voxel and stop to matter at a thousandth of it, and the whole is bound by memory.
//! Places themselves never enter, but as whole steps between neighbours, so that results do not
//! depend on where the surface lies. Sums run in fixed chunks.

use super::region::{Constraint, Region};
use super::{Outcome, Stop};
use crate::numeric::vector::Vec3;
use crate::volume::isosurface::cases::step_of;
use crate::volume::isosurface::{NONE, Surface};
use rayon::prelude::*;
use wide::f32x4;

/// Steps between two changes of the lengths of chords.
const PERIOD: usize = 10;

/// Vertices that one thread moves at a time; fixed, so that sums never follow the threads.
const CHUNK: usize = 1 << 12;

/// Step over the inverse of the diagonal: rows hold (1, -2, 1), and (1 + 2 + 1)^2 / (1 + 4 + 1) = 8/3.
const STEP: f32 = 3.0 / 8.0;

/// A chord is never taken for shorter than this share of its first length.
const SHORTEST: f32 = 0.5;

/// All that a step needs to know of a vertex beside the offsets, in one line of the cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
struct Node {
    /// As the surface has them; the vertex itself where there is none.
    links: [u32; 4],
    /// One over the length of the chord of each slot; 0 where there is none.
    inverse: [f32; 4],
    /// Two over the sum of the lengths of both chords of each curve; 0 where the curve ends.
    row: [f32; 2],
    /// The step of the vertex.
    step: f32,
    /// One over how far it may go inwards along its edge, times the sign of that way.
    inward: f32,
    steps: [u8; 4],
    axis: u8,
    /// Whether its region is more than the diamond, and all that the others are.
    special: bool,
    /// Whether curves end here without going on.
    has_arms: bool,
}

/// Encloses what is missing in each part, by moving it along its normals.
pub(super) trait Inflate: Sync {
    /// How far each part is to be moved outwards, in the unit of `offsets`.
    fn by(&self, offsets: &[f32x4]) -> Vec<f32>;
    /// How far a vertex is moved then.
    fn shift(&self, vertex: usize, by: &[f32]) -> f32;
}

pub(super) struct Fair<'a> {
    surface: &'a Surface,
    /// Steps by their code, in the unit of the offsets.
    steps: Vec<f32x4>,
    /// Spacing over the smallest one.
    metric: [f32; 3],
    regions: &'a (dyn Fn(usize) -> Region + Sync),
    diamond: Diamond,
}

impl<'a> Fair<'a> {
    /// `metric` is the spacing over the smallest one.
    pub(super) fn new(
        surface: &'a Surface,
        metric: Vec3,
        reach: f64,
        regions: &'a (dyn Fn(usize) -> Region + Sync),
    ) -> Self {
        let half = metric.map(|m| (0.5 * m) as f32);
        let steps = (0..125).map(|code| {
            let step = step_of(code).map(|s| s as f32);
            f32x4::from([step[0] * half[0], step[1] * half[1], step[2] * half[2], 0.0])
        });
        let metric = metric.map(|m| m as f32);
        Fair {
            surface,
            steps: steps.collect(),
            metric,
            regions,
            diamond: Diamond::new(metric, reach as f32),
        }
    }

    fn nodes(&self) -> Vec<Node> {
        (0..self.surface.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| {
                let region = (self.regions)(v);
                let plain = region.constraint == Constraint::Diamond
                    && region.reach as f32 == self.diamond.reach
                    && !region.fixed.contains(&true);
                let on_edge = self.surface.is_on_edge(v);
                let limit = region.inward * f64::from(self.metric[region.axis]);
                let own = (v as u32) << 2;
                Node {
                    links: self.surface.links[v].map(|to| if to == NONE { own } else { to }),
                    steps: self.surface.steps[v],
                    axis: region.axis as u8,
                    inward: (-region.outward / limit) as f32,
                    special: !plain,
                    has_arms: !on_edge,
                    ..Node::default()
                }
            })
            .collect()
    }

    /// Moves all vertices until none moves by `threshold` (in the smallest spacing) or `most` steps are
    /// done. Returns the offsets.
    pub(super) fn run(
        &self,
        threshold: f64,
        most: u32,
        inflate: &dyn Inflate,
        advance: &(dyn Fn() + Sync),
    ) -> (Vec<Vec3>, Outcome) {
        let n = self.surface.len();
        let mut ahead = vec![f32x4::ZERO; n];
        let mut offsets = ahead.clone();
        let mut bends = vec![[f32x4::ZERO; 2]; n];
        let mut nodes = self.nodes();
        let mut momentum = 1.0f64;
        let mut outcome = Outcome::default();
        for iteration in 0..most as usize {
            if iteration % PERIOD == 0 {
                self.weigh(&offsets, &mut nodes);
                if iteration > 0 {
                    self.inflate(&offsets, &mut ahead, inflate);
                }
            }
            self.bend(&ahead, &nodes, &mut bends);
            let next = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
            let beta = ((momentum - 1.0) / next) as f32;
            let (largest, back) = self.step(&bends, &nodes, beta, &mut ahead, &mut offsets);
            momentum = if back > 0.0 { 1.0 } else { next };
            outcome.iterations += 1;
            outcome.updates += n as u64;
            outcome.last_step = largest;
            advance();
            if largest < threshold && iteration % PERIOD != 0 {
                outcome.stop = Stop::Threshold;
                break;
            }
        }
        (self.in_voxels(&offsets), outcome)
    }

    /// Offsets in voxels, within their regions to the last bit.
    fn in_voxels(&self, offsets: &[f32x4]) -> Vec<Vec3> {
        let voxels = |(v, offset): (usize, &f32x4)| {
            let o = offset.to_array();
            let o = std::array::from_fn(|a| f64::from(o[a]) / f64::from(self.metric[a]));
            (self.regions)(v).clip(o)
        };
        offsets
            .par_iter()
            .enumerate()
            .with_min_len(CHUNK)
            .map(voxels)
            .collect()
    }

    #[inline]
    fn chord(&self, at: &[f32x4], vertex: usize, slot: usize) -> f32x4 {
        let to = (self.surface.links[vertex][slot] >> 2) as usize;
        let step = self.steps[usize::from(self.surface.steps[vertex][slot])];
        step + at[to] - at[vertex]
    }

    /// The curves that end at a vertex without going on: the vertex that they come from, and its slot.
    fn arms(&self, vertex: usize) -> impl Iterator<Item = (usize, usize)> {
        let all: &[(u32, u32)] = if self.surface.is_on_edge(vertex) {
            &[]
        } else {
            let of = |v: usize| {
                self.surface
                    .arms
                    .partition_point(|arm| (arm.0 as usize) < v)
            };
            &self.surface.arms[of(vertex)..of(vertex + 1)]
        };
        all.iter()
            .map(|arm| ((arm.1 >> 2) as usize, (arm.1 & 3) as usize))
    }

    fn has(&self, vertex: usize, slot: usize) -> bool {
        self.surface.links[vertex][slot] != NONE
    }

    /// The lengths of chords as they are, and what follows from them.
    fn weigh(&self, offsets: &[f32x4], nodes: &mut [Node]) {
        let length = |v: f32x4| (v * v).reduce_add().sqrt();
        let in_chunks = |nodes: &mut [Node], f: &(dyn Fn(usize, &mut Node) + Sync)| {
            nodes
                .par_chunks_mut(CHUNK)
                .enumerate()
                .for_each(|(chunk, nodes)| {
                    for (i, node) in nodes.iter_mut().enumerate() {
                        f(chunk * CHUNK + i, node);
                    }
                });
        };
        in_chunks(nodes, &|v, node| {
            let mut sizes = [0.0; 4];
            for slot in 0..4 {
                node.inverse[slot] = 0.0;
                if self.has(v, slot) {
                    let least = SHORTEST * length(self.steps[usize::from(node.steps[slot])]);
                    sizes[slot] = length(self.chord(offsets, v, slot)).max(least);
                    node.inverse[slot] = 1.0 / sizes[slot];
                }
            }
            for curve in 0..2 {
                let [down, up] = [sizes[2 * curve], sizes[2 * curve + 1]];
                let ends = down > 0.0 && up > 0.0;
                node.row[curve] = if ends { 2.0 / (down + up) } else { 0.0 };
            }
        });
        // A diagonal is made of rows of the neighbours, which are not written meanwhile.
        let all: &[Node] = nodes;
        let step = |(v, node): (usize, &Node)| {
            let mut diagonal = 0.0;
            for curve in 0..2 {
                let own = node.inverse[2 * curve] + node.inverse[2 * curve + 1];
                diagonal += node.row[curve] * own * own;
            }
            for slot in 0..4 {
                let link = node.links[slot];
                let row = all[(link >> 2) as usize].row[(link >> 1 & 1) as usize];
                diagonal += row * node.inverse[slot] * node.inverse[slot];
            }
            if node.has_arms {
                for (from, slot) in self.arms(v) {
                    let arm = &all[from];
                    diagonal += arm.row[slot / 2] * arm.inverse[slot].powi(2);
                }
            }
            if diagonal > 0.0 { STEP / diagonal } else { 0.0 }
        };
        let steps: Vec<f32> = all
            .par_iter()
            .enumerate()
            .with_min_len(CHUNK)
            .map(step)
            .collect();
        for (node, step) in nodes.iter_mut().zip(steps) {
            node.step = step;
        }
    }

    /// The change of direction at each vertex along both curves, weighted.
    fn bend(&self, at: &[f32x4], nodes: &[Node], bends: &mut [[f32x4; 2]]) {
        let steps: &[f32x4; 125] = self.steps[..]
            .try_into()
            .expect("as many as there are codes");
        let bend_of = |v: usize, node: &Node| {
            let own = at[v];
            let curve = |curve: usize| {
                let part = |slot: usize| {
                    let step = steps[usize::from(node.steps[slot].min(124))];
                    let chord = step + (at[(node.links[slot] >> 2) as usize] - own);
                    chord * f32x4::splat(node.inverse[slot])
                };
                (part(2 * curve) + part(2 * curve + 1)) * f32x4::splat(node.row[curve])
            };
            [curve(0), curve(1)]
        };
        bends
            .par_chunks_mut(CHUNK)
            .zip(nodes.par_chunks(CHUNK))
            .enumerate()
            .for_each(|(chunk, (bends, nodes))| {
                for (i, (bend, node)) in bends.iter_mut().zip(nodes).enumerate() {
                    *bend = bend_of(chunk * CHUNK + i, node);
                }
            });
    }

    /// One step down the gradient and back into the regions. Returns the longest way and whether it went
    /// against the momentum (above 0).
    fn step(
        &self,
        bends: &[[f32x4; 2]],
        nodes: &[Node],
        beta: f32,
        ahead: &mut [f32x4],
        offsets: &mut [f32x4],
    ) -> (f64, f64) {
        let beta = f32x4::splat(beta);
        let all = nodes;
        let partial: Vec<(f32, f64)> = ahead
            .par_chunks_mut(CHUNK)
            .zip(offsets.par_chunks_mut(CHUNK))
            .zip(nodes.par_chunks(CHUNK))
            .enumerate()
            .map(|(chunk, ((ahead, offsets), nodes))| {
                let mut largest: f32 = 0.0;
                let mut back = f32x4::ZERO;
                let each = ahead.iter_mut().zip(offsets).zip(nodes);
                for (i, ((ahead, offset), node)) in each.enumerate() {
                    let v = chunk * CHUNK + i;
                    let own = &bends[v];
                    let inverse = &node.inverse;
                    let mut gradient = own[0] * f32x4::splat(-inverse[0] - inverse[1])
                        + own[1] * f32x4::splat(-inverse[2] - inverse[3]);
                    for slot in 0..4 {
                        let link = node.links[slot];
                        let bend = bends[(link >> 2) as usize][(link >> 1 & 1) as usize];
                        gradient += bend * f32x4::splat(inverse[slot]);
                    }
                    if node.has_arms {
                        for (from, slot) in self.arms(v) {
                            let inverse = all[from].inverse[slot];
                            gradient += bends[from][slot / 2] * f32x4::splat(inverse);
                        }
                    }
                    let wanted = *ahead - gradient * f32x4::splat(node.step);
                    let next = self.project(v, node, wanted);
                    let moved = next - *offset;
                    largest = largest.max((moved * moved).reduce_add());
                    back += (*ahead - next) * moved;
                    *ahead = next + moved * beta;
                    *offset = next;
                }
                (largest, f64::from(back.reduce_add()))
            })
            .collect();
        let largest = partial.iter().map(|p| p.0).fold(0.0, f32::max);
        (f64::from(largest).sqrt(), partial.iter().map(|p| p.1).sum())
    }

    #[inline]
    fn project(&self, vertex: usize, node: &Node, wanted: f32x4) -> f32x4 {
        if !node.special {
            let next = self.diamond.closest(wanted);
            let along = next.to_array()[usize::from(node.axis & 3)];
            // Above 1 where it goes inwards farther than it may.
            let share = (along * node.inward).max(1.0);
            return next * f32x4::splat(1.0 / share);
        }
        let w = wanted.to_array();
        let m = self.metric;
        let v = [w[0] / m[0], w[1] / m[1], w[2] / m[2]].map(f64::from);
        let p = (self.regions)(vertex).project(v, m.map(f64::from));
        let p = p.map(|c| c as f32);
        f32x4::from([p[0] * m[0], p[1] * m[1], p[2] * m[2], 0.0])
    }

    fn inflate(&self, offsets: &[f32x4], ahead: &mut [f32x4], inflate: &dyn Inflate) {
        let by = inflate.by(offsets);
        ahead
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, out)| {
                for (i, at) in out.iter_mut().enumerate() {
                    let v = chunk * CHUNK + i;
                    let normal = self.normal(offsets, v);
                    *at += normal * f32x4::splat(inflate.shift(v, &by));
                }
            });
    }

    /// The outward direction at a vertex, from the chords of both curves; 0 where one ends.
    pub(super) fn normal(&self, at: &[f32x4], vertex: usize) -> f32x4 {
        if (0..4).any(|slot| !self.has(vertex, slot)) {
            return f32x4::ZERO;
        }
        let along = |curve: usize| {
            let both = self.chord(at, vertex, 2 * curve + 1) - self.chord(at, vertex, 2 * curve);
            both.to_array()
        };
        let ([ax, ay, az, _], [bx, by, bz, _]) = (along(0), along(1));
        let n = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        if length == 0.0 {
            return f32x4::ZERO;
        }
        let sign = if self.surface.lower_inside[vertex] {
            1.0
        } else {
            -1.0
        };
        f32x4::from([n[0], n[1], n[2], 0.0]) * f32x4::splat(sign / length)
    }
}

/// The octahedron of one reach, in the unit of the offsets.
struct Diamond {
    reach: f32,
    /// One over the metric; 0 for the fourth lane.
    inverse: f32x4,
    /// One over the sum of the squares of that over each set of axes, by its bits.
    totals: [f32; 8],
}

impl Diamond {
    fn new(metric: [f32; 3], reach: f32) -> Self {
        let inverse = metric.map(|m| 1.0 / m);
        let total = |set: usize| {
            let of = |a: usize| {
                if set >> a & 1 == 1 {
                    inverse[a] * inverse[a]
                } else {
                    0.0
                }
            };
            1.0 / (of(0) + of(1) + of(2))
        };
        Diamond {
            reach,
            inverse: f32x4::from([inverse[0], inverse[1], inverse[2], 0.0]),
            totals: std::array::from_fn(total),
        }
    }

    /// The closest point of the octahedron; see [`Region::project`].
    #[inline]
    fn closest(&self, v: f32x4) -> f32x4 {
        let share = v.abs() * self.inverse;
        let [x, y, z, _] = share.to_array();
        let (yz, reach) = (y + z, self.reach);
        let t = &self.totals;
        let singles = ((x - reach) * t[1])
            .max((y - reach) * t[2])
            .max((z - reach) * t[4]);
        let pairs = ((x + y - reach) * t[3])
            .max((x + z - reach) * t[5])
            .max((yz - reach) * t[6]);
        // Nothing is above 0 within: no branch is needed, which could not be foretold.
        let most = singles.max(pairs).max((x + yz - reach) * t[7]).max(0.0);
        let left = (v.abs() - self.inverse * f32x4::splat(most)).max(f32x4::ZERO);
        left.copysign(v)
    }
}
