//! The points of a cloud in an order that does not depend on that of the file.

use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, sub};
use crate::spatial::local::CornerFrame;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Bits of a Morton key along each axis.
const BITS: u32 = 21;

/// The distinct points of a cloud in local coordinates, along Morton's curve.
///
/// Of points in one place the first is kept, by normal, colour, class and at last index.
#[derive(Debug, Clone)]
pub struct Ordered {
    /// The frame of the coordinates.
    pub local: CornerFrame,
    /// Coordinates in that frame.
    pub points: Vec<Vec3>,
    /// The index of each in the cloud.
    pub sources: Vec<u32>,
}

impl Ordered {
    /// Orders the points of a cloud, which are finite and fewer than 2^32.
    ///
    /// Cost: one sort. Source: Morton, "A computer oriented geodetic data base", 1966; points of one
    /// cell of 2^-21 of the longest side are in the order of their coordinates.
    pub fn of(cloud: &Mesh) -> Self {
        let local = CornerFrame::around(cloud.bounds());
        let place = |index: u32| local.to_local(cloud.positions[index as usize]);
        let mut keys: Vec<(u64, u32)> = (0..cloud.positions.len() as u32)
            .into_par_iter()
            .map(|index| (morton(place(index)), index))
            .collect();
        keys.par_sort_unstable_by(|a, b| {
            a.0.cmp(&b.0)
                .then_with(|| compare(&place(a.1), &place(b.1)))
                .then_with(|| attributes(cloud, a.1 as usize, b.1 as usize))
                .then(a.1.cmp(&b.1))
        });
        let mut points = Vec::with_capacity(keys.len());
        let mut sources = Vec::with_capacity(keys.len());
        for (_, index) in keys {
            let p = place(index);
            if points.last() != Some(&p) {
                points.push(p);
                sources.push(index);
            }
        }
        Ordered {
            local,
            points,
            sources,
        }
    }
}

fn compare<const N: usize>(a: &[f64; N], b: &[f64; N]) -> Ordering {
    let pairs = a.iter().zip(b);
    pairs.fold(Ordering::Equal, |all, (a, b)| all.then(a.total_cmp(b)))
}

fn attributes(cloud: &Mesh, a: usize, b: usize) -> Ordering {
    let normals = cloud.normals.as_ref().map(|n| compare(&n[a], &n[b]));
    let colors = cloud.colors.as_ref().map(|c| {
        let wide = |c: [f32; 4]| c.map(f64::from);
        compare(&wide(c[a]), &wide(c[b]))
    });
    let classes = cloud.classes.as_ref().map(|c| c[a].cmp(&c[b]));
    let all = [normals, colors, classes].into_iter().flatten();
    all.fold(Ordering::Equal, Ordering::then)
}

/// The key of a point of the unit cube: bits of its coordinates in turn, x lowest.
fn morton(p: Vec3) -> u64 {
    let largest = f64::from((1u32 << BITS) - 1);
    let cell = |c: f64| spread((c * f64::from(1u32 << BITS)).clamp(0.0, largest) as u64);
    cell(p[0]) | cell(p[1]) << 1 | cell(p[2]) << 2
}

/// Puts two zeros between any two of the lowest 21 bits.
fn spread(mut bits: u64) -> u64 {
    bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
    bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
    bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}

/// The square of the distance between two points.
#[inline]
pub(crate) fn distance_squared(a: Vec3, b: Vec3) -> f64 {
    let d = sub(a, b);
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    #[test]
    fn keys_interleave_bits() {
        for i in 0..100 {
            let mut rng = Rng::new(1, i);
            let p: Vec3 = std::array::from_fn(|_| rng.unit());
            let cell = p.map(|c| (c * 2_097_152.0) as u64);
            let mut key = 0;
            for bit in 0..21 {
                for a in 0..3 {
                    key |= (cell[a] >> bit & 1) << (3 * bit + a);
                }
            }
            assert_eq!(morton(p), key);
        }
        assert_eq!(morton([1.0; 3]), (1 << 63) - 1);
    }

    #[test]
    fn neither_order_nor_place_nor_size_matters() {
        let grid = |i: u64| (Rng::new(5, i).bits() % 4096) as f64 / 4096.0;
        let positions: Vec<Vec3> = (0..3000)
            .map(|i| [grid(3 * i % 2000), grid(3 * i + 1), grid(3 * i + 2)])
            .collect();
        let mut twice = positions.clone();
        twice.extend_from_slice(&positions[..500]);
        let of = |positions: Vec<Vec3>| {
            Ordered::of(&Mesh {
                positions,
                ..Mesh::default()
            })
        };
        let first = of(positions.clone());
        assert!(first.points.len() <= 3000 && first.points.len() > 2900);
        let mut other = twice.clone();
        other.reverse();
        assert_eq!(of(other).points, first.points);
        assert_eq!(of(twice).sources, first.sources);
        let moved = |scale: f64, shift: f64| {
            let change = |p: &Vec3| p.map(|c| c * scale + shift);
            of(positions.iter().map(change).collect())
        };
        for (size, shift) in [(1.0, 1e6), (2f64.powi(900), 0.0), (2f64.powi(-900), 0.0)] {
            assert_eq!(moved(size, shift).points, first.points);
        }
    }
}
