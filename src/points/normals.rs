//! Normals of points from their neighbours.

use super::eigen::{Symmetric, smallest};
use super::order::distance_squared;
use crate::numeric::vector::{Vec3, dot, sub};
use crate::spatial::kdtree::KdTree;
use rayon::prelude::*;

/// Most neighbours that a plane is fitted to, where those asked for lie on a line.
pub const MOST_NEIGHBOURS: usize = 64;
/// Neighbours are as on a line where their spread across is less than this share of that along, as
/// squares: a tenth.
const NARROW: f64 = 1e-2;
/// Neighbours are on a line, and there is no plane, below this: 1/30000.
const LINE: f64 = 1e-9;
/// The weight that the farthest neighbour lacks; it falls with the square of the distance. On scans with
/// noise from a tenth to half of the spacing this is better than equal weights and than none at the end.
const FALL: f64 = 0.5;
/// The neighbour whose distance tells the density.
const DENSITY_RANK: usize = 8;

/// The neighbours of each point: those of point `i` start at `i * count`, nearest first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Neighbourhoods {
    /// Neighbours of each point, itself not among them.
    pub count: usize,
    /// Their indices.
    pub indices: Vec<u32>,
}

impl Neighbourhoods {
    /// The `count` nearest neighbours of all points, or all others where there are fewer.
    pub fn of(tree: &KdTree, points: &[Vec3], count: usize) -> Self {
        let count = count.min(points.len().saturating_sub(1));
        Neighbourhoods {
            count,
            indices: tree.neighbours(points, count),
        }
    }

    /// The neighbours of point `i`, nearest first.
    #[inline]
    pub fn row(&self, i: usize) -> &[u32] {
        &self.indices[i * self.count..(i + 1) * self.count]
    }
}

/// What the neighbours of a point tell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Plane {
    /// The unit normal, its sign without meaning; zero where neighbours lie on a line or in one place.
    pub normal: Vec3,
    /// The side of the square that one point stands for.
    pub spacing: f64,
}

/// The plane through each point's neighbourhood, by least squares.
///
/// The plane is fitted to the point and its neighbours about their mean, those farther off with less
/// weight. Where those lie as on a line,
/// up to [`MOST_NEIGHBOURS`] are taken, and the spacing is that of the larger neighbourhood. Cost: one
/// small eigenproblem for each point. Source: Hoppe and others, "Surface reconstruction from
/// unorganized points", 1992, section 3.
pub fn planes(tree: &KdTree, points: &[Vec3], near: &Neighbourhoods) -> Vec<Plane> {
    (0..points.len())
        .into_par_iter()
        .with_min_len(256)
        .map(|i| plane(tree, points, near, i))
        .collect()
}

/// The spacing around each point, where normals are known.
pub fn spacings(points: &[Vec3], near: &Neighbourhoods) -> Vec<f64> {
    (0..points.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| spacing(points, i, near.row(i), DENSITY_RANK))
        .collect()
}

fn plane(tree: &KdTree, points: &[Vec3], near: &Neighbourhoods, i: usize) -> Plane {
    let row = near.row(i);
    let (values, normal) = fit(points, i, row);
    if values[1] > NARROW * values[2] {
        return Plane {
            normal,
            spacing: spacing(points, i, row, DENSITY_RANK),
        };
    }
    let mut best = (values, normal, row.len());
    let mut found = Vec::new();
    let mut count = row.len();
    while best.0[1] <= NARROW * best.0[2] && count < MOST_NEIGHBOURS.min(points.len() - 1) {
        count = (2 * count).min(MOST_NEIGHBOURS).min(points.len() - 1);
        tree.nearest(points[i], count + 1, &mut found);
        let wide: Vec<u32> = found.iter().map(|n| n.index).collect();
        let (values, normal) = fit(points, i, &wide);
        best = (values, normal, count);
    }
    let (values, normal, count) = best;
    let rank = if count > row.len() {
        count
    } else {
        DENSITY_RANK
    };
    let wide: Vec<u32> = found
        .iter()
        .map(|n| n.index)
        .filter(|n| *n as usize != i)
        .collect();
    let wide = if wide.is_empty() { row } else { &wide };
    Plane {
        normal: if values[1] > LINE * values[2] {
            normal
        } else {
            [0.0; 3]
        },
        spacing: spacing(points, i, wide, rank),
    }
}

/// The eigenvalues of the second moments of a point and others about their mean, smallest first, and
/// the direction of the smallest. The point itself may be among the others: it is counted once.
fn fit(points: &[Vec3], i: usize, others: &[u32]) -> (Vec3, Vec3) {
    let centre = points[i];
    let mut sum = [0.0; 3];
    let mut m: Symmetric = [0.0; 6];
    let mut count = 1.0;
    let farthest = others
        .last()
        .map_or(1.0, |l| distance_squared(points[*l as usize], centre));
    let fall = if farthest > 0.0 { FALL / farthest } else { 0.0 };
    for &other in others {
        let d = sub(points[other as usize], centre);
        let w = 1.0 - fall * dot(d, d);
        count += w * f64::from(u8::from(other as usize != i));
        for a in 0..3 {
            sum[a] += w * d[a];
            m[a] += w * d[a] * d[a];
        }
        m[3] += w * d[0] * d[1];
        m[4] += w * d[0] * d[2];
        m[5] += w * d[1] * d[2];
    }
    let share = 1.0 / count;
    for a in 0..3 {
        m[a] -= sum[a] * sum[a] * share;
    }
    m[3] -= sum[0] * sum[1] * share;
    m[4] -= sum[0] * sum[2] * share;
    m[5] -= sum[1] * sum[2] * share;
    smallest(&m)
}

/// The side of the square that one of so many neighbours stands for: their disc shared out.
fn spacing(points: &[Vec3], i: usize, row: &[u32], rank: usize) -> f64 {
    let rank = rank.min(row.len());
    if rank == 0 {
        return 0.0;
    }
    let square = distance_squared(points[i], points[row[rank - 1] as usize]);
    (square * std::f64::consts::PI / rank as f64).sqrt()
}

/// The share of neighbours whose normal points the other way without a reason in the shape.
///
/// Two normals agree as well where one is the other's mirror image in the plane between the points: on
/// both sides of an edge. And they may differ where each point is behind the other, or before it: on the
/// sides of a thin sheet, or of a slit; but not both of it about one point, which is noise. Cost: one
/// pass over the neighbours.
pub fn disagreement(points: &[Vec3], normals: &[Vec3], near: &Neighbourhoods) -> f64 {
    let most = near.count.min(DENSITY_RANK);
    let differ: u64 = (0..points.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| differing(points, normals, i, &near.row(i)[..most]))
        .sum();
    differ as f64 / ((points.len() * most).max(1)) as f64
}

/// How many of a point's neighbours have their normal on the wrong side.
fn differing(points: &[Vec3], normals: &[Vec3], i: usize, row: &[u32]) -> u64 {
    let (mut behind, mut before, mut other) = (0, 0, 0);
    for &j in row {
        let j = j as usize;
        if dot(normals[i], normals[j]) >= 0.0 || mirrored(points, normals, i, j) >= 0.0 {
            continue;
        }
        let way = sub(points[j], points[i]);
        let (own, its) = (dot(way, normals[i]), -dot(way, normals[j]));
        if own < 0.0 && its < 0.0 {
            behind += 1;
        } else if own > 0.0 && its > 0.0 {
            before += 1;
        } else {
            other += 1;
        }
    }
    other + 2 * behind.min(before)
}

/// The cosine between one normal and the mirror image of another in the plane between their points.
#[inline]
pub(super) fn mirrored(points: &[Vec3], normals: &[Vec3], i: usize, j: usize) -> f64 {
    let (a, b) = (normals[i], normals[j]);
    let e = sub(points[j], points[i]);
    let square = dot(e, e);
    if square > 0.0 {
        dot(a, b) - 2.0 * dot(a, e) * dot(b, e) / square
    } else {
        dot(a, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::vector::{cross, length};
    use crate::points::test_clouds::{sphere, square};

    fn planes_of(points: &[Vec3], count: usize) -> Vec<Plane> {
        let tree = KdTree::build(points);
        let near = Neighbourhoods::of(&tree, points, count);
        planes(&tree, points, &near)
    }

    #[test]
    fn normals_of_a_sphere_are_its_radii_and_spacings_its_density() {
        let cloud = sphere(20_000, 1);
        let found = planes_of(&cloud.positions, 16);
        let off = |(plane, p): (&Plane, &Vec3)| length(cross(plane.normal, *p)).powi(2);
        let pairs = found.iter().zip(&cloud.positions);
        let rms = (pairs.map(off).sum::<f64>() / 20_000.0).sqrt().to_degrees();
        assert!(rms < 0.5, "{rms}");
        let area = found.iter().map(|p| p.spacing * p.spacing).sum::<f64>();
        let share = area / (4.0 * std::f64::consts::PI);
        assert!((share - 1.0).abs() < 0.2, "{share}");
    }

    #[test]
    fn lines_take_more_neighbours_before_they_have_no_normal() {
        // Scan lines far apart: sixteen neighbours are all of one line.
        let scan: Vec<Vec3> = (0..2000)
            .map(|i| [f64::from(i % 100) * 0.01, f64::from(i / 100) * 0.12, 0.0])
            .collect();
        let found = planes_of(&scan, 16);
        for plane in &found {
            assert!(plane.normal[2].abs() > 1.0 - 1e-12, "{plane:?}");
            assert!(plane.spacing > 0.02, "{plane:?}");
        }
        let line: Vec<Vec3> = (0..200).map(|i| [0.0, f64::from(i), 0.0]).collect();
        for plane in planes_of(&line, 16) {
            assert_eq!(plane.normal, [0.0; 3]);
        }
    }

    #[test]
    fn few_points_have_few_neighbours() {
        assert!(planes_of(&[], 16).is_empty());
        assert_eq!(planes_of(&[[1.0; 3]], 16)[0].normal, [0.0; 3]);
        let three = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        for plane in planes_of(&three, 16) {
            assert!((plane.normal[2].abs() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn disagreement_counts_flips_and_not_edges() {
        let mut cloud = square(2000);
        let points = &cloud.positions;
        let near = Neighbourhoods::of(&KdTree::build(points), points, 16);
        let normals = cloud.normals.as_mut().expect("normals");
        assert_eq!(disagreement(points, normals, &near), 0.0);
        for normal in normals.iter_mut().step_by(2) {
            normal[2] = -1.0;
        }
        let share = disagreement(points, normals, &near);
        assert!((share - 0.5).abs() < 0.05, "{share}");
    }
}
