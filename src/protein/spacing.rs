//! How far neighbouring atoms are from each other.

use crate::numeric::vector::{Vec3, dot, sub};
use rayon::prelude::*;

/// Atoms of which the nearest neighbour is sought.
const SAMPLE: usize = 64;

/// Bonds are 0.95 to 2.5 angstrom long: a median below this is one of nanometres.
pub const NANOMETRES: f64 = 0.3;

/// The median distance to the nearest neighbour elsewhere, over a sample of the points; `None` where
/// no two points are apart.
///
/// Cost: 64 passes.
pub fn median_spacing(points: &[Vec3]) -> Option<f64> {
    let sample: Vec<Vec3> = (0..SAMPLE.min(points.len()))
        .map(|i| points[i * points.len() / SAMPLE.min(points.len())])
        .collect();
    let nearest = |from: &Vec3| {
        let squares = points.iter().map(|to| {
            let way = sub(*to, *from);
            dot(way, way)
        });
        squares
            .filter(|square| *square > 0.0)
            .fold(f64::INFINITY, f64::min)
    };
    let mut squares: Vec<f64> = sample.par_iter().map(nearest).collect();
    squares.retain(|square| square.is_finite());
    squares.sort_by(f64::total_cmp);
    squares.get(squares.len() / 2).map(|square| square.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_that_of_the_nearest() {
        let row = |step: f64| -> Vec<Vec3> {
            (0..500).map(|i| [step * f64::from(i), 0.0, 0.0]).collect()
        };
        assert_eq!(median_spacing(&row(0.25)), Some(0.25));
        assert_eq!(median_spacing(&row(0.0)), None);
        assert_eq!(median_spacing(&[]), None);
        assert_eq!(median_spacing(&[[1.0; 3]]), None);
    }
}
