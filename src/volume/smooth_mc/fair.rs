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

use super::region::Region;
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

/// What is known of one curve at one vertex.
#[derive(Debug, Clone, Copy, Default)]
struct Weights {
    /// One over the length of the chord of each slot; 0 where there is none.
    inverse: [f32; 4],
    /// Two over the sum of the lengths of both chords of each curve; 0 where the curve ends.
    row: [f32; 2],
    /// The step of the vertex.
    step: f32,
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
}

impl<'a> Fair<'a> {
    /// `metric` is the spacing over the smallest one.
    pub(super) fn new(
        surface: &'a Surface,
        metric: Vec3,
        regions: &'a (dyn Fn(usize) -> Region + Sync),
    ) -> Self {
        let half = metric.map(|m| (0.5 * m) as f32);
        let steps = (0..125).map(|code| {
            let step = step_of(code).map(|s| s as f32);
            f32x4::from([step[0] * half[0], step[1] * half[1], step[2] * half[2], 0.0])
        });
        Fair {
            surface,
            steps: steps.collect(),
            metric: metric.map(|m| m as f32),
            regions,
        }
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
        let mut weights = vec![Weights::default(); n];
        let mut momentum = 1.0f64;
        let mut outcome = Outcome::default();
        for iteration in 0..most as usize {
            if iteration % PERIOD == 0 {
                self.weigh(&offsets, &mut weights);
                if iteration > 0 {
                    self.inflate(&offsets, &mut ahead, inflate);
                }
            }
            self.bend(&ahead, &weights, &mut bends);
            let next = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
            let beta = ((momentum - 1.0) / next) as f32;
            let (largest, back) = self.step(&bends, &weights, beta, &mut ahead, &mut offsets);
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
    fn weigh(&self, offsets: &[f32x4], weights: &mut [Weights]) {
        let length = |v: f32x4| (v * v).reduce_add().sqrt();
        weights
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, out)| {
                for (i, w) in out.iter_mut().enumerate() {
                    let v = chunk * CHUNK + i;
                    let mut sizes = [0.0; 4];
                    for slot in 0..4 {
                        w.inverse[slot] = 0.0;
                        if self.has(v, slot) {
                            let step = self.steps[usize::from(self.surface.steps[v][slot])];
                            let least = SHORTEST * length(step);
                            sizes[slot] = length(self.chord(offsets, v, slot)).max(least);
                            w.inverse[slot] = 1.0 / sizes[slot];
                        }
                    }
                    for curve in 0..2 {
                        let ends = self.has(v, 2 * curve) && self.has(v, 2 * curve + 1);
                        let sum = sizes[2 * curve] + sizes[2 * curve + 1];
                        w.row[curve] = if ends { 2.0 / sum } else { 0.0 };
                    }
                }
            });
        let steps: Vec<f32> = (0..weights.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| {
                let w = &weights[v];
                let mut diagonal = 0.0;
                for curve in 0..2 {
                    let own = w.inverse[2 * curve] + w.inverse[2 * curve + 1];
                    diagonal += w.row[curve] * own * own;
                }
                for slot in 0..4 {
                    let link = self.surface.links[v][slot];
                    if link != NONE {
                        let row = weights[(link >> 2) as usize].row[(link >> 1 & 1) as usize];
                        diagonal += row * w.inverse[slot] * w.inverse[slot];
                    }
                }
                for (from, slot) in self.arms(v) {
                    let arm = &weights[from];
                    diagonal += arm.row[slot / 2] * arm.inverse[slot] * arm.inverse[slot];
                }
                if diagonal > 0.0 { STEP / diagonal } else { 0.0 }
            })
            .collect();
        for (w, step) in weights.iter_mut().zip(steps) {
            w.step = step;
        }
    }

    /// The change of direction at each vertex along both curves, weighted.
    fn bend(&self, at: &[f32x4], weights: &[Weights], bends: &mut [[f32x4; 2]]) {
        bends
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, out)| {
                for (i, bend) in out.iter_mut().enumerate() {
                    let v = chunk * CHUNK + i;
                    let w = &weights[v];
                    for curve in 0..2 {
                        bend[curve] = if w.row[curve] > 0.0 {
                            let down = self.chord(at, v, 2 * curve);
                            let up = self.chord(at, v, 2 * curve + 1);
                            let sum = down * f32x4::splat(w.inverse[2 * curve])
                                + up * f32x4::splat(w.inverse[2 * curve + 1]);
                            sum * f32x4::splat(w.row[curve])
                        } else {
                            f32x4::ZERO
                        };
                    }
                }
            });
    }

    /// One step down the gradient and back into the regions. Returns the longest way and whether it went
    /// against the momentum (above 0).
    fn step(
        &self,
        bends: &[[f32x4; 2]],
        weights: &[Weights],
        beta: f32,
        ahead: &mut [f32x4],
        offsets: &mut [f32x4],
    ) -> (f64, f64) {
        let beta = f32x4::splat(beta);
        let partial: Vec<(f32, f64)> = ahead
            .par_chunks_mut(CHUNK)
            .zip(offsets.par_chunks_mut(CHUNK))
            .enumerate()
            .map(|(chunk, (ahead, offsets))| {
                let mut largest: f32 = 0.0;
                let mut back = f32x4::ZERO;
                for (i, (ahead, offset)) in ahead.iter_mut().zip(offsets).enumerate() {
                    let v = chunk * CHUNK + i;
                    let w = &weights[v];
                    let own = &bends[v];
                    let mut gradient = own[0] * f32x4::splat(-w.inverse[0] - w.inverse[1])
                        + own[1] * f32x4::splat(-w.inverse[2] - w.inverse[3]);
                    for slot in 0..4 {
                        let link = self.surface.links[v][slot];
                        if link != NONE {
                            let bend = bends[(link >> 2) as usize][(link >> 1 & 1) as usize];
                            gradient += bend * f32x4::splat(w.inverse[slot]);
                        }
                    }
                    for (from, slot) in self.arms(v) {
                        gradient +=
                            bends[from][slot / 2] * f32x4::splat(weights[from].inverse[slot]);
                    }
                    let wanted = *ahead - gradient * f32x4::splat(w.step);
                    let next = self.project(v, wanted);
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
    fn project(&self, vertex: usize, wanted: f32x4) -> f32x4 {
        let w = wanted.to_array();
        let m = self.metric;
        let region = (self.regions)(vertex);
        let v = [w[0] / m[0], w[1] / m[1], w[2] / m[2]].map(f64::from);
        let p = region.project(v, m.map(f64::from)).map(|c| c as f32);
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
