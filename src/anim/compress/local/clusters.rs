//! Vertices go where they move least.

use super::Metric;
use super::pose::Pose;
use super::seeds::position;
use crate::anim::compress::spectrum::Trajectories;
use crate::numeric::vector::{Vec3, dot, length, sub};
use rayon::prelude::*;

/// The cluster of each vertex: the frame of reference in which it moves least, the first of equals.
///
/// `poses` are those of one cluster over the frames after the other. Corners of a seed are in its
/// cluster whatever they do. Cost: at most `V N F`, in parallel. Source: section 3.2 of the paper named
/// in [`super`]; the sum begins at the second frame, which is the first that has one before.
pub fn assign(
    trajectories: &Trajectories,
    seeds: &[[u32; 3]],
    poses: &[Vec<Pose>],
    metric: Metric,
) -> Vec<u32> {
    let frames = trajectories.frames();
    let mut labels: Vec<u32> = (0..trajectories.vertices as u32)
        .into_par_iter()
        .with_min_len(16)
        .map_init(Vec::new, |path: &mut Vec<Vec3>, v| {
            path.clear();
            path.extend((0..frames).map(|f| position(trajectories, f, v)));
            let apart = |i: usize| length(sub(poses[i][0].origin, path[0]));
            // The nearest first: mostly the others are given up soon.
            let near = (0..poses.len()).min_by(|a, b| apart(*a).total_cmp(&apart(*b)));
            let near = near.unwrap_or(0);
            let mut best = (motion(path, &poses[near], metric, f64::INFINITY), near);
            for (i, poses) in poses.iter().enumerate().filter(|(i, _)| *i != near) {
                let here = motion(path, poses, metric, best.0);
                if here < best.0 || here == best.0 && i < best.1 {
                    best = (here, i);
                }
            }
            best.1 as u32
        })
        .collect();
    for (i, corners) in seeds.iter().enumerate() {
        for v in corners {
            labels[*v as usize] = i as u32;
        }
    }
    labels
}

/// How much a path moves in a frame of reference; some number above `enough` where it is more.
fn motion(path: &[Vec3], poses: &[Pose], metric: Metric, enough: f64) -> f64 {
    let mut sum = 0.0;
    let mut last = poses[0].local(path[0]);
    if metric == Metric::Variance {
        // From the first place, so that little is lost in the difference of squares.
        let (start, mut mean, mut squares) = (last, [0.0; 3], 0.0);
        for (p, pose) in path.iter().zip(poses) {
            let q = sub(pose.local(*p), start);
            squares += dot(q, q);
            mean = std::array::from_fn(|i| mean[i] + q[i] / path.len() as f64);
        }
        return (squares - path.len() as f64 * dot(mean, mean)).max(0.0);
    }
    for (p, pose) in path.iter().zip(poses).skip(1) {
        let q = pose.local(*p);
        let step = sub(q, last);
        sum += match metric {
            Metric::Path => length(step),
            _ => dot(step, step),
        };
        if sum > enough {
            return sum;
        }
        last = q;
    }
    sum
}
