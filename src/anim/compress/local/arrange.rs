//! Who goes where: seeds, clusters and the triangles that carry them.

use super::layout::{Anchor, Given};
use super::pose::Pose;
use super::seeds::{self, position};
use super::tracks::Lattice;
use super::{Frame, Params, Space, clusters};
use crate::anim::compress::spectrum::Trajectories;
use crate::numeric::vector::Vec3;
use rayon::prelude::*;

/// The lowest corner of the box around all vertices at all frames, and its largest side.
pub fn bounds(trajectories: &Trajectories) -> (Vec3, f64) {
    let frames: Vec<(Vec3, Vec3)> = (0..trajectories.frames())
        .into_par_iter()
        .map(|f| {
            let all = (0..trajectories.vertices as u32).map(|v| position(trajectories, f, v));
            let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            all.fold(start, |(lo, hi), p| {
                let low = std::array::from_fn(|i| p[i].min(lo[i]));
                (low, std::array::from_fn(|i| p[i].max(hi[i])))
            })
        })
        .collect();
    let mut lo = [f64::INFINITY; 3];
    let mut hi = [f64::NEG_INFINITY; 3];
    for (low, high) in frames {
        for i in 0..3 {
            lo[i] = lo[i].min(low[i]);
            hi[i] = hi[i].max(high[i]);
        }
    }
    let side = (0..3).map(|i| hi[i] - lo[i]).fold(0.0, f64::max);
    (lo, side)
}

/// Clusters, and the points that carry their frames of reference.
pub fn arrange(
    trajectories: &Trajectories,
    triangles: &[[u32; 3]],
    lattice: &Lattice,
    side: f64,
    params: &Params,
) -> (Anchor, Given) {
    let (vertices, frames) = (trajectories.vertices, trajectories.frames());
    let whole = Given {
        labels: vec![0; vertices],
        corners: Vec::new(),
        tracks: Vec::new(),
    };
    if params.space == Space::Whole || vertices < 3 || frames < 2 {
        return (Anchor::World, whole);
    }
    let least = match params.frame {
        Frame::Seed => lattice.step,
        Frame::Wide => 1e-6 * side,
    };
    let seeds = seeds::select(trajectories, triangles, params.clusters, least);
    let at = |f: usize, corners: &[u32; 3]| corners.map(|v| position(trajectories, f, v));
    if seeds.is_empty() {
        if params.space == Space::World {
            return (Anchor::World, whole);
        }
        let centroid = |f: usize| {
            let mut sum = [0.0; 3];
            for v in 0..vertices as u32 {
                let p = position(trajectories, f, v);
                (0..3).for_each(|axis| sum[axis] += p[axis] / vertices as f64);
            }
            lattice.numbers(sum)
        };
        let tracks = (0..frames).map(centroid).collect();
        return (Anchor::Centroid, Given { tracks, ..whole });
    }
    // Vertices are told apart by the triangles as they are: rounding concerns only how they are held.
    let poses: Vec<Vec<Pose>> = seeds
        .par_iter()
        .map(|corners| Pose::follow((0..frames).map(|f| at(f, corners))))
        .collect();
    let labels = clusters::assign(trajectories, &seeds, &poses, params.metric);
    if params.space == Space::World {
        return (Anchor::World, Given { labels, ..whole });
    }
    let corners = match params.frame {
        Frame::Seed => seeds,
        Frame::Wide => {
            let mut members: Vec<Vec<u32>> = vec![Vec::new(); seeds.len()];
            for (v, label) in labels.iter().enumerate() {
                members[*label as usize].push(v as u32);
            }
            let pairs = members.par_iter().zip(&seeds);
            pairs
                .map(|(members, seed)| seeds::widest(trajectories, members, *seed))
                .collect()
        }
    };
    let points = |f: usize| {
        let all = corners.iter().flatten();
        all.map(move |v| lattice.numbers(position(trajectories, f, *v)))
    };
    let tracks = (0..frames).flat_map(points).collect();
    let given = Given {
        labels,
        corners,
        tracks,
    };
    (Anchor::Triangle, given)
}
