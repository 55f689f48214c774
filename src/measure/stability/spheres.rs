//! How far spheres are from where they should be.

use super::drift::Drift;
use super::motion::Motion;
use crate::numeric::vector::{dot, sub};
use crate::protein::clearance::Ball;
use crate::spatial::aabb::Aabb;
use crate::spatial::bvh::Bvh;
use rayon::prelude::*;

/// How far spheres drifted: `changed` are what became of those of the input moved by `motion`.
///
/// Two spheres are as far apart as their centres, or as their radii differ, whichever is more. The distance
/// is the largest from a sphere of either result to the nearest of the other (Hausdorff's), for as many
/// spheres as for more or fewer: a single one that is added between two would make a comparison in order
/// say nothing. It is `None` where one of both has no spheres, and 0 where neither has. Lengths are in the
/// unit of the untouched input. Cost: O(n log n).
pub fn sphere_drift(reference: &[Ball], changed: &[Ball], motion: &Motion) -> Drift {
    let undone: Vec<Ball> = changed
        .iter()
        .map(|ball| Ball {
            centre: motion.undo(ball.centre),
            radius: motion.length_back(ball.radius),
        })
        .collect();
    match (reference.is_empty(), undone.is_empty()) {
        (true, true) => return Drift::NONE,
        (true, false) | (false, true) => return Drift::ALL,
        (false, false) => {}
    }
    let there = farthest(reference, &undone);
    Drift {
        distance: Some(there.max(farthest(&undone, reference))),
        ..Drift::NONE
    }
}

/// The largest distance from a sphere of one set to the nearest of the other, which is not empty.
fn farthest(from: &[Ball], to: &[Ball]) -> f64 {
    let at = |i: u32| to[i as usize].centre;
    let bvh = Bvh::build(to.len() as u32, |i| Aabb {
        lo: at(i),
        hi: at(i),
    });
    let nearest = |ball: &Ball| {
        let found = bvh.nearest(ball.centre, f64::INFINITY, |i| {
            let other = to[i as usize];
            let (d, r) = (sub(other.centre, ball.centre), other.radius - ball.radius);
            dot(d, d).max(r * r)
        });
        found.map_or(0.0, |hit| hit.distance_squared.sqrt())
    };
    let all: Vec<f64> = from.par_iter().map(nearest).collect();
    all.into_iter().fold(0.0, f64::max)
}
