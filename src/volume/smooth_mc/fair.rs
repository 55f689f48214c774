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
//! diagonal never overshoots. The lengths of chords follow the surface every few steps ([`net`]).
//!
//! A curve of lagging chords shrinks a little. What is enclosed is therefore held to what the voxels
//! hold, part by part: with each change of the lengths all vertices of a part are moved along their
//! normals by what is missing over its area.
//!
//! Offsets from the first places are kept in single precision, in units of the smallest spacing: they
//! are below one voxel and stop to matter at a thousandth of it. Places themselves never enter, but as
//! whole steps between neighbours, so that results do not depend on where the surface lies.
//!
//! A step takes the bends of the curves, from which it makes the gradients. Vertices come by slices and
//! refer to the next ones only, so that bends are made shortly before they are needed and kept no longer
//! ([`sweep`]). Sums run in fixed chunks.

mod diamond;
mod net;
mod sweep;

use super::region::Region;
use super::{Outcome, Stop};
use crate::numeric::vector::Vec3;
use crate::volume::isosurface::cases::step_of;
use crate::volume::isosurface::{NONE, Surface};
use diamond::Diamond;
use net::Net;
use rayon::prelude::*;
use sweep::Sweep;
use wide::f32x4;

/// Steps between two changes of the lengths of chords.
const PERIOD: usize = 10;

/// Vertices that one thread moves at a time; fixed, so that sums never follow the threads.
const CHUNK: usize = 1 << 10;

/// Vertices that are moved together.
const GROUP: usize = 4;

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

    /// Moves all vertices until none moves by `threshold` (in the smallest spacing) or `most` steps are
    /// done. Returns the offsets.
    pub(super) fn run(
        &self,
        threshold: f64,
        most: u32,
        inflate: &dyn Inflate,
        advance: &(dyn Fn() + Sync),
    ) -> (Vec<Vec3>, Outcome) {
        let mut net = Net::new(self);
        let mut sweep = Sweep::new(&net);
        let mut momentum = 1.0f64;
        let mut outcome = Outcome::default();
        for iteration in 0..most as usize {
            if iteration % PERIOD == 0 {
                let (offsets, ahead) = sweep.offsets();
                net.weigh(self, offsets);
                if iteration > 0 {
                    self.inflate(offsets, ahead, inflate);
                }
            }
            let next = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
            let beta = ((momentum - 1.0) / next) as f32;
            let (largest, back) = sweep.step(self, &net, beta);
            momentum = if back > 0.0 { 1.0 } else { next };
            outcome.iterations += 1;
            outcome.updates += self.surface.len() as u64;
            outcome.last_step = largest;
            advance();
            if largest < threshold && iteration % PERIOD != 0 {
                outcome.stop = Stop::Threshold;
                break;
            }
        }
        drop(net);
        (self.in_voxels(sweep.offsets().0), outcome)
    }

    /// Offsets in voxels, within their regions to the last bit.
    fn in_voxels(&self, offsets: &[f32x4]) -> Vec<Vec3> {
        let voxels = |(v, offset): (usize, &f32x4)| {
            let o = offset.to_array();
            let o = std::array::from_fn(|a| f64::from(o[a]) / f64::from(self.metric[a]));
            (self.regions)(v).clip(o)
        };
        offsets[..self.surface.len()]
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

    fn has(&self, vertex: usize, slot: usize) -> bool {
        self.surface.links[vertex][slot] != NONE
    }

    fn inflate(&self, offsets: &[f32x4], ahead: &mut [f32x4], inflate: &dyn Inflate) {
        let by = inflate.by(offsets);
        ahead[..self.surface.len()]
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
