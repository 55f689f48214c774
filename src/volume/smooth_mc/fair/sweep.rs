//! Steps down the gradient, chunk after chunk.

use super::net::Net;
use super::{CHUNK, Fair, GROUP};
use rayon::prelude::*;
use wide::f32x4;

/// Where all vertices are.
pub(super) struct Sweep {
    /// Offsets of groups, by component.
    offsets: Vec<[f32x4; 3]>,
    /// Where the momentum takes each vertex.
    ahead: Vec<f32x4>,
    bends: Vec<[f32x4; 2]>,
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
        Sweep {
            offsets: vec![[f32x4::ZERO; 3]; n / GROUP],
            ahead: vec![f32x4::ZERO; n],
            bends: vec![[f32x4::ZERO; 2]; n],
        }
    }

    pub(super) fn ahead(&mut self) -> &mut [f32x4] {
        &mut self.ahead
    }

    /// The offset of each vertex.
    pub(super) fn offsets(&self) -> Vec<f32x4> {
        let mut all = vec![f32x4::ZERO; self.ahead.len()];
        all.par_chunks_mut(CHUNK)
            .zip(self.offsets.par_chunks(CHUNK / GROUP))
            .for_each(|(out, groups)| {
                for (out, [x, y, z]) in out.chunks_exact_mut(GROUP).zip(groups) {
                    out.copy_from_slice(&f32x4::transpose([*x, *y, *z, f32x4::ZERO]));
                }
            });
        all
    }

    /// One step down the gradient and back into the regions. Returns the longest way and whether it went
    /// against the momentum (above 0).
    pub(super) fn step(&mut self, fair: &Fair, net: &Net, beta: f32) -> (f64, f64) {
        let at = &self.ahead;
        self.bends
            .par_chunks_mut(CHUNK)
            .zip(net.nodes.par_chunks(CHUNK))
            .enumerate()
            .for_each(|(chunk, (bends, nodes))| {
                for (i, (bend, node)) in bends.iter_mut().zip(nodes).enumerate() {
                    *bend = node.bends(chunk * CHUNK + i, at);
                }
            });
        let bends = &self.bends;
        let partial: Vec<Partial> = self
            .ahead
            .par_chunks_mut(CHUNK)
            .zip(self.offsets.par_chunks_mut(CHUNK / GROUP))
            .enumerate()
            .map(|(chunk, (ahead, offsets))| {
                move_chunk(fair, net, beta, bends, chunk, ahead, offsets)
            })
            .collect();
        let largest = partial.iter().map(|p| p.largest).fold(0.0, f32::max);
        let back = partial.iter().map(|p| f64::from(p.back)).sum();
        (f64::from(largest).sqrt(), back)
    }
}

fn move_chunk(
    fair: &Fair,
    net: &Net,
    beta: f32,
    bends: &[[f32x4; 2]],
    chunk: usize,
    ahead: &mut [f32x4],
    offsets: &mut [[f32x4; 3]],
) -> Partial {
    let beta = f32x4::splat(beta);
    let mut largest = f32x4::ZERO;
    let mut back = f32x4::ZERO;
    let bends = bends.as_flattened();
    let start = chunk * CHUNK;
    let nodes = &net.nodes[start..start + ahead.len()];
    let groups = start / GROUP..(start + ahead.len()) / GROUP;
    let each = ahead
        .as_chunks_mut::<GROUP>()
        .0
        .iter_mut()
        .zip(offsets)
        .zip(nodes.as_chunks::<GROUP>().0)
        .zip(&net.moves[groups.clone()])
        .zip(&net.special[groups])
        .enumerate();
    for (i, ((((ahead, offset), nodes), moves), special)) in each {
        let first = start + i * GROUP;
        let mut wanted = *ahead;
        for lane in 0..GROUP {
            let node = &nodes[lane];
            let own = 2 * (first + lane);
            let inverse = &node.inverse;
            let mut gradient = bends[own] * f32x4::splat(-inverse[0] - inverse[1])
                + bends[own + 1] * f32x4::splat(-inverse[2] - inverse[3]);
            for slot in 0..4 {
                // Four times the vertex and the slot: bends are two a vertex, slots two a curve.
                let bend = bends[(node.links[slot] >> 1) as usize];
                gradient += bend * f32x4::splat(inverse[slot]);
            }
            if special >> (GROUP + lane) & 1 == 1 {
                for (from, slot) in fair.arms(first + lane) {
                    let inverse = net.nodes[from].inverse[slot];
                    gradient += bends[2 * from + slot / 2] * f32x4::splat(inverse);
                }
            }
            wanted[lane] -= gradient * f32x4::splat(moves.step[lane]);
        }
        let [x, y, z, _] = f32x4::transpose(wanted);
        let mut next = fair.diamond.closest([x, y, z]);
        let inward = moves.inward;
        let along = next[0] * inward[0] + next[1] * inward[1] + next[2] * inward[2];
        // Above 1 where it goes inwards farther than it may.
        let share = f32x4::ONE / along.fast_max(f32x4::ONE);
        next = next.map(|c| c * share);
        if special & 0xf != 0 {
            fair.project_lanes(first, *special, &wanted, &mut next);
        }
        let [x, y, z, _] = f32x4::transpose(*ahead);
        let was = [x, y, z];
        let moved: [f32x4; 3] = std::array::from_fn(|a| next[a] - offset[a]);
        largest = largest.fast_max(moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2]);
        for a in 0..3 {
            back += (was[a] - next[a]) * moved[a];
        }
        let [x, y, z]: [f32x4; 3] = std::array::from_fn(|a| next[a] + moved[a] * beta);
        *ahead = f32x4::transpose([x, y, z, f32x4::ZERO]);
        *offset = next;
    }
    Partial {
        largest: largest.to_array().into_iter().fold(0.0, f32::max),
        back: back.reduce_add(),
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
