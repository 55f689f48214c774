//! Steps down the gradient, chunk after chunk.
//!
//! Vertices that are numbered by slices refer to near ones only. The bends of a chunk are then made when
//! the first chunk that refers to it is moved, and forgotten with the last: they stay in the cache. Where
//! vertices refer to far ones, all bends are made before any vertex is moved.

use super::net::Net;
use super::{CHUNK, Fair, GROUP};
use rayon::prelude::*;
use wide::f32x4;

/// Runs of chunks for each thread, so that none waits long for the others.
const RUNS: usize = 4;

/// A run is at least so many times as long as what it refers to: the bends at its ends are made twice.
const LEAST: usize = 4;

type Bends = Vec<[f32x4; 2]>;

/// Where all vertices are.
pub(super) struct Sweep {
    /// Offsets of groups, by component.
    offsets: Vec<[f32x4; 3]>,
    /// Where the momentum takes each vertex.
    ahead: Vec<f32x4>,
    /// The same after the step.
    next: Vec<f32x4>,
    /// Of each chunk, the first chunk that it or a later one refers to, and the last that it or an earlier
    /// one refers to.
    needs: Vec<[usize; 2]>,
    /// Chunks of a run.
    run: usize,
    /// For each run those bends that are needed, of chunks in turn; or one list of all.
    bends: Vec<Bends>,
}

/// The largest square of a way, and how much went against the momentum.
#[derive(Debug, Clone, Copy)]
struct Partial {
    largest: f32,
    back: f32,
}

impl Sweep {
    pub(super) fn new(net: &Net) -> Sweep {
        let n = net.nodes.len();
        let mut needs: Vec<[usize; 2]> = net
            .reach
            .iter()
            .map(|reach| reach.map(|v| v as usize / CHUNK))
            .collect();
        for i in 1..needs.len() {
            needs[i][1] = needs[i][1].max(needs[i - 1][1]);
        }
        for i in (1..needs.len()).rev() {
            needs[i - 1][0] = needs[i - 1][0].min(needs[i][0]);
        }
        let widest = needs.iter().map(|[low, high]| high - low + 1).max();
        let ring = widest.unwrap_or(1).next_power_of_two();
        // Results are the same for any length of runs.
        let threads = rayon::current_num_threads();
        let runs = if threads == 1 { 1 } else { RUNS * threads };
        let run = needs.len().div_ceil(runs).max(LEAST * ring);
        let bends = if 2 * ring < needs.len() {
            let runs = needs.len().div_ceil(run);
            vec![vec![[f32x4::ZERO; 2]; ring * CHUNK]; runs]
        } else {
            vec![vec![[f32x4::ZERO; 2]; n]]
        };
        Sweep {
            offsets: vec![[f32x4::ZERO; 3]; n / GROUP],
            ahead: vec![f32x4::ZERO; n],
            next: vec![f32x4::ZERO; n],
            needs,
            run,
            bends,
        }
    }

    /// The offset of each vertex, and where the momentum takes it.
    pub(super) fn offsets(&mut self) -> (&[f32x4], &mut [f32x4]) {
        // What is there is of no use before the next step.
        let all = &mut self.next;
        all.par_chunks_mut(CHUNK)
            .zip(self.offsets.par_chunks(CHUNK / GROUP))
            .for_each(|(out, groups)| {
                for (out, [x, y, z]) in out.chunks_exact_mut(GROUP).zip(groups) {
                    out.copy_from_slice(&f32x4::transpose([*x, *y, *z, f32x4::ZERO]));
                }
            });
        (all, &mut self.ahead)
    }

    /// One step down the gradient and back into the regions. Returns the longest way and whether it went
    /// against the momentum (above 0).
    pub(super) fn step(&mut self, fair: &Fair, net: &Net, beta: f32) -> (f64, f64) {
        let mover = Mover {
            fair,
            net,
            beta,
            at: &self.ahead,
        };
        let next = &mut self.next[..];
        let partial: Vec<Partial> = if self.bends[0].len() == self.ahead.len() {
            let all = &mut self.bends[0];
            all.par_chunks_mut(CHUNK)
                .enumerate()
                .for_each(|(chunk, out)| mover.bend(chunk, out));
            let all = all.as_flattened();
            next.par_chunks_mut(CHUNK)
                .zip(self.offsets.par_chunks_mut(CHUNK / GROUP))
                .enumerate()
                .map(|(chunk, (next, offsets))| mover.go(chunk, all, usize::MAX, next, offsets))
                .collect()
        } else {
            let (run, needs) = (self.run, &self.needs);
            let partial: Vec<Vec<Partial>> = next
                .par_chunks_mut(run * CHUNK)
                .zip(self.offsets.par_chunks_mut(run * CHUNK / GROUP))
                .zip(&mut self.bends)
                .enumerate()
                .map(|(i, ((next, offsets), ring))| mover.run(i * run, needs, ring, next, offsets))
                .collect();
            partial.into_iter().flatten().collect()
        };
        std::mem::swap(&mut self.ahead, &mut self.next);
        let largest = partial.iter().map(|p| p.largest).fold(0.0, f32::max);
        let back = partial.iter().map(|p| f64::from(p.back)).sum();
        (f64::from(largest).sqrt(), back)
    }
}

/// One step.
struct Mover<'a> {
    fair: &'a Fair<'a>,
    net: &'a Net,
    beta: f32,
    /// Where the momentum takes each vertex.
    at: &'a [f32x4],
}

impl Mover<'_> {
    /// The bends of a chunk.
    fn bend(&self, chunk: usize, out: &mut [[f32x4; 2]]) {
        let start = chunk * CHUNK;
        for (i, (bends, node)) in out.iter_mut().zip(&self.net.nodes[start..]).enumerate() {
            *bends = node.bends(start + i, self.at);
        }
    }

    /// Moves the chunks of a run, of which `first` is the first. The ring holds a power of two of chunks.
    fn run(
        &self,
        first: usize,
        needs: &[[usize; 2]],
        ring: &mut [[f32x4; 2]],
        next: &mut [f32x4],
        offsets: &mut [[f32x4; 3]],
    ) -> Vec<Partial> {
        let mask = ring.len() - 1;
        let mut made = needs[first][0];
        let each = next
            .chunks_mut(CHUNK)
            .zip(offsets.chunks_mut(CHUNK / GROUP));
        each.enumerate()
            .map(|(i, (next, offsets))| {
                let chunk = first + i;
                while made <= needs[chunk][1] {
                    let at = (made * CHUNK) & mask;
                    self.bend(made, &mut ring[at..at + CHUNK]);
                    made += 1;
                }
                self.go(chunk, ring.as_flattened(), 2 * mask + 1, next, offsets)
            })
            .collect()
    }

    /// Moves the vertices of a chunk. Bends of one vertex after the other lie where `mask` leaves of twice
    /// its number.
    fn go(
        &self,
        chunk: usize,
        bends: &[f32x4],
        mask: usize,
        next: &mut [f32x4],
        offsets: &mut [[f32x4; 3]],
    ) -> Partial {
        let (fair, net, beta) = (self.fair, self.net, f32x4::splat(self.beta));
        let mut largest = f32x4::ZERO;
        let mut back = f32x4::ZERO;
        let start = chunk * CHUNK;
        let (nodes, at) = (&net.nodes[start..], &self.at[start..]);
        let each = next
            .as_chunks_mut::<GROUP>()
            .0
            .iter_mut()
            .zip(offsets)
            .zip(nodes.as_chunks::<GROUP>().0)
            .zip(at.as_chunks::<GROUP>().0)
            .zip(&net.moves[start / GROUP..])
            .zip(&net.special[start / GROUP..])
            .enumerate();
        for (i, (((((next, offset), nodes), at), moves), special)) in each {
            let first = start + i * GROUP;
            let mut wanted = *at;
            for lane in 0..GROUP {
                let node = &nodes[lane];
                let own = (2 * (first + lane)) & mask;
                let inverse = &node.inverse;
                let mut gradient = bends[own] * f32x4::splat(-inverse[0] - inverse[1])
                    + bends[own + 1] * f32x4::splat(-inverse[2] - inverse[3]);
                for slot in 0..4 {
                    // Four times the vertex and the slot: bends are two a vertex, slots two a curve.
                    let bend = bends[(node.links[slot] >> 1) as usize & mask];
                    gradient += bend * f32x4::splat(inverse[slot]);
                }
                if special >> (GROUP + lane) & 1 == 1 {
                    for (from, slot) in fair.arms(first + lane) {
                        let inverse = net.nodes[from].inverse[slot];
                        gradient += bends[(2 * from + slot / 2) & mask] * f32x4::splat(inverse);
                    }
                }
                wanted[lane] -= gradient * f32x4::splat(moves.step[lane]);
            }
            let [x, y, z, _] = f32x4::transpose(wanted);
            let mut to = fair.diamond.closest([x, y, z]);
            let inward = moves.inward;
            let along = to[0] * inward[0] + to[1] * inward[1] + to[2] * inward[2];
            // Above 1 where it goes inwards farther than it may.
            let share = f32x4::ONE / along.fast_max(f32x4::ONE);
            to = to.map(|c| c * share);
            if special & 0xf != 0 {
                fair.project_lanes(first, *special, &wanted, &mut to);
            }
            let [x, y, z, _] = f32x4::transpose(*at);
            let was = [x, y, z];
            let moved: [f32x4; 3] = std::array::from_fn(|a| to[a] - offset[a]);
            largest =
                largest.fast_max(moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]);
            for a in 0..3 {
                back += (was[a] - to[a]) * moved[a];
            }
            let [x, y, z]: [f32x4; 3] = std::array::from_fn(|a| to[a] + moved[a] * beta);
            *next = f32x4::transpose([x, y, z, f32x4::ZERO]);
            *offset = to;
        }
        Partial {
            largest: largest.to_array().into_iter().fold(0.0, f32::max),
            back: back.reduce_add(),
        }
    }
}

impl Fair<'_> {
    /// Those lanes of a group whose regions are not what the others' are.
    #[cold]
    fn project_lanes(
        &self,
        first: usize,
        special: u8,
        wanted: &[f32x4; GROUP],
        next: &mut [f32x4; 3],
    ) {
        let m = self.metric;
        let mut lanes = next.map(|c| c.to_array());
        for lane in (0..GROUP).filter(|lane| special >> lane & 1 == 1) {
            let w = wanted[lane].to_array();
            let v = [w[0] / m[0], w[1] / m[1], w[2] / m[2]].map(f64::from);
            let p = (self.regions)(first + lane).project(v, m.map(f64::from));
            for a in 0..3 {
                lanes[a][lane] = p[a] as f32 * m[a];
            }
        }
        *next = lanes.map(f32x4::from);
    }
}
