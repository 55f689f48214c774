//! Smoothing without a constraint, for comparison.
//!
//! Source: G. Taubin, "A signal processing approach to fair surface design", 1995.

use super::neighbours::Neighbours;
use crate::numeric::vector::{Vec3, add, scale, sub};
use rayon::prelude::*;

/// Rounds of the paper's comparison.
pub const ROUNDS: u32 = 110;

/// The paper's step that smooths.
pub const LAMBDA: f64 = 1.0 / 1.4;

/// The paper's step that undoes the shrinking.
pub const MU: f64 = -1.0 / 1.3;

/// Vertices that one thread moves at a time.
const CHUNK: usize = 1 << 12;

/// Moves each vertex by `lambda`, then by `mu` of its way to the mean of its neighbours, so many rounds.
///
/// Neighbours are the other ends of a vertex's edges, all of one weight; a vertex without one stays.
/// Nothing is kept: voxels may change sides. Cost: two passes over the edges for each round. Source:
/// Taubin 1995, section 3.
pub fn taubin(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    rounds: u32,
    lambda: f64,
    mu: f64,
) -> Vec<Vec3> {
    let neighbours = Neighbours::new(positions.len(), triangles, |w| w, |_, _| true);
    let mut at = positions.to_vec();
    let mut next = at.clone();
    for _ in 0..rounds {
        for step in [lambda, mu] {
            next.par_iter_mut()
                .enumerate()
                .with_min_len(CHUNK)
                .for_each(|(v, to)| *to = moved(&at, v, neighbours.of(v), step));
            std::mem::swap(&mut at, &mut next);
        }
    }
    at
}

/// A vertex moved by a share of its way to the mean of others. Differences are summed, so that far from
/// the origin nothing is lost.
#[inline]
fn moved(at: &[Vec3], v: usize, near: &[u32], share: f64) -> Vec3 {
    if near.is_empty() {
        return at[v];
    }
    let ways = near.iter().map(|w| sub(at[*w as usize], at[v]));
    let sum = ways.fold([0.0; 3], add);
    add(at[v], scale(sum, share / near.len() as f64))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ball, normal_rms};
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::topology::topology;
    use crate::progress::Silent;
    use crate::volume::isosurface::{Border, Select, extract};

    #[test]
    fn a_ball_becomes_round_keeps_its_volume_and_leaves_its_voxels() {
        let ball = ball(30.0, 64, 31.5);
        let surface = extract(&ball, &Select::Set, Border::Closed, &Silent).expect("a surface");
        let positions = surface.positions(&ball.frame, |_| [0.0; 3]);
        let triangles = surface.triangles(&positions);
        let smooth = taubin(&positions, &triangles, ROUNDS, LAMBDA, MU);
        let volume = |positions: &[Vec3]| {
            let mesh = Mesh::from_triangles(positions.to_vec(), triangles.clone());
            let report = topology(&mesh, &Silent).expect("a report");
            report.volume.expect("a volume")
        };
        let share = volume(&smooth) / volume(&positions);
        let rms = normal_rms(&smooth, &triangles, |p| p.map(|c| c - 31.5));
        let far = positions
            .iter()
            .zip(&smooth)
            .flat_map(|(p, q)| sub(*p, *q))
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        assert!((1.005..1.013).contains(&share), "{share}");
        assert!(rms < 3.0, "{rms}");
        // Farther than any faithful region lets it go.
        assert!(far > 0.5, "{far}");
    }

    #[test]
    fn vertices_alone_stay_and_a_step_goes_to_the_mean() {
        let positions = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [7.0; 3]];
        let once = taubin(&positions, &[[0, 1, 2]], 1, 0.5, 0.0);
        assert_eq!(once[3], [7.0; 3]);
        assert_eq!(once[0], [0.75, 0.75, 0.0]);
        assert_eq!(taubin(&positions, &[[0, 1, 2]], 0, 0.5, 0.0), positions);
    }

    #[test]
    fn any_number_of_threads_moves_alike() {
        let ball = ball(20.3, 44, 21.4);
        let surface = extract(&ball, &Select::Set, Border::Closed, &Silent).expect("a surface");
        let positions = surface.positions(&ball.frame, |_| [0.0; 3]);
        let triangles = surface.triangles(&positions);
        let on = |threads: usize| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool")
                .install(|| taubin(&positions, &triangles, 9, LAMBDA, MU))
        };
        let one = on(1);
        for threads in [2, 8] {
            assert!(on(threads) == one);
        }
    }
}
