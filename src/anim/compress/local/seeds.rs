//! Triangles that carry frames of reference.

use super::pose::height;
use crate::anim::compress::spectrum::Trajectories;
use crate::numeric::vector::{Vec3, length, sub};
use rayon::prelude::*;

/// Vertices near a seed that are tried, where there are no faces.
const NEAR: usize = 24;

/// A position in local coordinates.
pub fn position(trajectories: &Trajectories, frame: usize, vertex: u32) -> Vec3 {
    std::array::from_fn(|axis| trajectories.at(frame, vertex as usize, axis))
}

/// The smallest height that a triangle of the mesh has at any frame; not looked at further than `least`.
fn steadiness(trajectories: &Trajectories, corners: [u32; 3], least: f64) -> f64 {
    let mut smallest = f64::INFINITY;
    for frame in 0..trajectories.frames() {
        smallest = smallest.min(height(corners.map(|v| position(trajectories, frame, v))));
        if smallest <= least {
            break;
        }
    }
    smallest
}

/// The triangles around each vertex.
struct Around {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Around {
    fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        for v in triangles.iter().flatten() {
            starts[*v as usize + 1] += 1;
        }
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut ends = starts.clone();
        let mut all = vec![0; 3 * triangles.len()];
        for (t, corners) in triangles.iter().enumerate() {
            for v in corners {
                let end = &mut ends[*v as usize];
                all[*end as usize] = t as u32;
                *end += 1;
            }
        }
        Around {
            starts,
            triangles: all,
        }
    }

    fn of(&self, v: usize) -> &[u32] {
        &self.triangles[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

/// At most so many triangles without a common corner, spread over the first frame: the first has the
/// vertex farthest from the centroid, each next the vertex farthest from all before.
///
/// Of the triangles around such a vertex the one is taken whose smallest height at any frame is the
/// largest; a vertex where none is above `least` is passed over. A cloud has no triangles: there the
/// nearest vertex and the next one that is not in line take their place. Cost: `V` for each triangle,
/// and `F` for each that is looked at. Source: the relative local PCA of section 3.2 of the paper named
/// in [`super`].
pub fn select(
    trajectories: &Trajectories,
    triangles: &[[u32; 3]],
    count: usize,
    least: f64,
) -> Vec<[u32; 3]> {
    let vertices = trajectories.vertices;
    let first: Vec<Vec3> = (0..vertices as u32)
        .map(|v| position(trajectories, 0, v))
        .collect();
    let mut centre = [0.0; 3];
    for p in &first {
        for axis in 0..3 {
            centre[axis] += p[axis] / vertices as f64;
        }
    }
    let around = Around::new(vertices, triangles);
    let mut used = vec![false; vertices];
    let mut away: Vec<f64> = first.iter().map(|p| length(sub(*p, centre))).collect();
    let mut seeds = Vec::new();
    while seeds.len() < count {
        let free = |v: &usize| !used[*v] && away[*v] >= 0.0;
        // The lowest of those that are equally far.
        let farthest = (0..vertices)
            .rev()
            .filter(free)
            .max_by(|a, b| away[*a].total_cmp(&away[*b]));
        let Some(v) = farthest else {
            break;
        };
        let mut best = (least, None);
        let mut try_out = |corners: [u32; 3]| {
            let height = steadiness(trajectories, corners, best.0);
            if height > best.0 {
                best = (height, Some(corners));
            }
        };
        if triangles.is_empty() {
            beside(&first, &used, v).into_iter().for_each(&mut try_out);
        } else {
            for t in around.of(v) {
                let corners = triangles[*t as usize];
                if corners.iter().all(|v| !used[*v as usize]) {
                    try_out(corners);
                }
            }
        }
        let Some(corners) = best.1 else {
            // Not a seed, now or later: what is used up or flat stays so.
            away[v] = -1.0;
            continue;
        };
        for c in corners {
            used[c as usize] = true;
        }
        let centre = first[v];
        let initial = seeds.is_empty();
        away.par_iter_mut()
            .zip(&first)
            .with_min_len(4096)
            .for_each(|(away, p)| {
                let here = length(sub(*p, centre));
                if *away >= 0.0 {
                    *away = if initial { here } else { away.min(here) };
                }
            });
        seeds.push(corners);
    }
    seeds
}

/// Triangles of a vertex of a cloud with its nearest vertex and one of the next.
fn beside(first: &[Vec3], used: &[bool], v: usize) -> Vec<[u32; 3]> {
    let apart = |u: usize| length(sub(first[u], first[v]));
    let mut near: Vec<(f64, u32)> = (0..first.len())
        .filter(|u| *u != v && !used[*u] && apart(*u) > 0.0)
        .map(|u| (apart(u), u as u32))
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near.truncate(NEAR);
    let Some((nearest, others)) = near.split_first() else {
        return Vec::new();
    };
    others
        .iter()
        .map(|(_, u)| [v as u32, nearest.1, *u])
        .collect()
}

/// A triangle as large as the vertices of a cluster allow at every frame, or the one given where it is
/// no smaller.
///
/// The trembling of a frame of reference whose corners are rounded grows with the distance from them
/// over their distance from one another. Cost: three passes over the trajectories of the cluster.
pub fn widest(trajectories: &Trajectories, members: &[u32], seed: [u32; 3]) -> [u32; 3] {
    let frames = trajectories.frames();
    // The member whose least value over the frames is the largest; the first of equals.
    let best = |value: &(dyn Fn(usize, u32) -> f64 + Sync)| -> Option<u32> {
        let least = |v: u32| {
            (0..frames)
                .map(|f| value(f, v))
                .fold(f64::INFINITY, f64::min)
        };
        let all: Vec<f64> = members
            .par_iter()
            .with_min_len(64)
            .map(|v| least(*v))
            .collect();
        let best = (0..all.len())
            .rev()
            .max_by(|a, b| all[*a].total_cmp(&all[*b]));
        best.map(|i| members[i])
    };
    let from = |corner: u32| {
        best(&move |f, v| {
            length(sub(
                position(trajectories, f, v),
                position(trajectories, f, corner),
            ))
        })
    };
    let chosen = from(seed[0])
        .and_then(|a| from(a).map(|b| (a, b)))
        .and_then(|(a, b)| {
            let third = best(&move |f, v| height([a, b, v].map(|v| position(trajectories, f, v))));
            third.map(|c| [a, b, c])
        });
    match chosen {
        Some(chosen) => {
            let least = steadiness(trajectories, seed, 0.0);
            if steadiness(trajectories, chosen, 0.0) > least {
                chosen
            } else {
                seed
            }
        }
        None => seed,
    }
}
