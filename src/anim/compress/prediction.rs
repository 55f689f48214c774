//! What a value at a vertex is expected to be, from the values at coarser vertices around it.
//!
//! Positions already known tell how the vertices lie to one another. The weights are those of
//! kriging: they make the expected squared error least for values that differ by a power of the
//! distance, and reproduce almost exactly whatever is an affine function of the known positions, as
//! the motion of a rigid part is. Source: G. Matheron, "The intrinsic random functions and their
//! applications" (1973).

use super::hierarchy::Hierarchy;
use rayon::prelude::*;

/// How much less trusted than the distance law a single value is: its own share of noise.
const NOISE: f64 = 0.003;
/// How far the vertices beyond the ring take the mean of those beside a vertex outwards, where no
/// position is known.
const OUTWARDS: f64 = 0.25;

/// The weights of every ring, one after the other as the rings stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights(Vec<f64>);

impl Weights {
    /// Where no position is known: the mean of those beside a vertex, a little away from that of those
    /// beyond, as curved surfaces lie.
    pub fn even(hierarchy: &Hierarchy) -> Self {
        let of = |rank: usize| {
            let inner = hierarchy.inner[rank] as usize;
            let outer = hierarchy.rings.of(rank).len() - inner;
            let away = if outer > 3 { OUTWARDS } else { 0.0 };
            let beside = (1.0 + away) / inner.max(1) as f64;
            let beyond = -away / outer.max(1) as f64;
            (0..inner + outer).map(move |i| if i < inner { beside } else { beyond })
        };
        Weights((0..hierarchy.len()).flat_map(of).collect())
    }

    /// The weights where each vertex has a place in a space of `dims` coordinates.
    ///
    /// `places[rank * dims..]` is the place of a rank; `affine` is how much more affine functions vary
    /// than the rest. Cost: the cube of a ring's length for each vertex, in parallel.
    pub fn new(hierarchy: &Hierarchy, places: &[f64], dims: usize, affine: f64) -> Self {
        let mut all = vec![0.0; hierarchy.rings.total()];
        let mut rest = all.as_mut_slice();
        let mut parts = Vec::with_capacity(hierarchy.len());
        for rank in 0..hierarchy.len() {
            let (part, after) = rest.split_at_mut(hierarchy.rings.of(rank).len());
            parts.push((rank, part));
            rest = after;
        }
        parts.into_par_iter().with_min_len(64).for_each_init(Vec::new, |system, (rank, part)| {
            let known = Places { places, dims, affine };
            known.krige(hierarchy.rings.of(rank), rank, system, part);
        });
        Weights(all)
    }

    /// The expected value at a rank.
    #[inline]
    pub fn expected(&self, hierarchy: &Hierarchy, rank: usize, values: &[f64]) -> f64 {
        let span = hierarchy.rings.span(rank);
        let ring = hierarchy.rings.of(rank).iter();
        let terms = ring.zip(&self.0[span]);
        terms.fold(0.0, |sum, (u, w)| sum + w * values[*u as usize])
    }
}

/// Where vertices are.
struct Places<'a> {
    places: &'a [f64],
    dims: usize,
    affine: f64,
}

impl Places<'_> {
/// The weights of one ring.
fn krige(&self, ring: &[u32], rank: usize, system: &mut Vec<f64>, weights: &mut [f64]) {
    let Places { places, dims, affine } = *self;
    let count = ring.len();
    if count < 2 {
        weights.fill(1.0);
        return;
    }
    let place = |u: usize| &places[u * dims..(u + 1) * dims];
    let mut centre = [0.0; 64];
    let centre = &mut centre[..dims];
    for u in ring {
        for (c, x) in centre.iter_mut().zip(place(*u as usize)) {
            *c += x / count as f64;
        }
    }
    let inner = |a: usize, b: usize| {
        let pairs = place(a).iter().zip(place(b)).zip(centre.iter());
        pairs.fold(0.0, |sum, ((x, y), c)| sum + (x - c) * (y - c))
    };
    let apart = |a: usize, b: usize| {
        let pairs = place(a).iter().zip(place(b));
        pairs.fold(0.0, |sum, (x, y)| sum + (x - y) * (x - y))
    };
    let spread = ring.iter().fold(0.0, |sum, u| sum + inner(*u as usize, *u as usize));
    let scale = count as f64 / spread;
    if !scale.is_finite() {
        weights.fill(1.0 / count as f64);
        return;
    }
    // The covariance of two places, up to what the weights' sum of one takes away.
    let between = |a: usize, b: usize| {
        let squared = apart(a, b) * scale;
        // To the power of 15/8 of the distance: rough enough to be stable, smooth enough to curve.
        let root = squared.sqrt().sqrt().sqrt().sqrt();
        let power = if root > 0.0 { squared / root } else { 0.0 };
        affine * scale * inner(a, b) - power
    };
    let n = count + 1;
    system.clear();
    system.resize(n * (n + 1), 0.0);
    for (i, a) in ring.iter().enumerate() {
        let row = i * (n + 1);
        for (j, b) in ring.iter().enumerate().take(i) {
            let value = between(*a as usize, *b as usize);
            system[row + j] = value;
            system[j * (n + 1) + i] = value;
        }
        system[row + i] = between(*a as usize, *a as usize) + NOISE;
        system[row + count] = 1.0;
        system[row + n] = between(*a as usize, rank);
        system[count * (n + 1) + i] = 1.0;
    }
    system[count * (n + 1) + n] = 1.0;
    solve(system, n);
    for (i, weight) in weights.iter_mut().enumerate() {
        *weight = system[i * (n + 1) + n];
    }
}
}

/// Solves a system of `n` rows of `n + 1` numbers, the last of which are the right side; the solution
/// stands there after it. By elimination with the largest pivot of a column.
fn solve(system: &mut [f64], n: usize) {
    let width = n + 1;
    for i in 0..n {
        let size = |r: usize| system[r * width + i].abs();
        let pivot = (i + 1..n).fold(i, |best, r| if size(r) > size(best) { r } else { best });
        if pivot != i {
            let (above, below) = system.split_at_mut(pivot * width);
            above[i * width..(i + 1) * width].swap_with_slice(&mut below[..width]);
        }
        let (above, below) = system.split_at_mut((i + 1) * width);
        let row = &above[i * width..];
        if row[i] == 0.0 {
            continue;
        }
        for other in below.chunks_exact_mut(width) {
            let factor = other[i] / row[i];
            if factor != 0.0 {
                for (o, r) in other[i + 1..].iter_mut().zip(&row[i + 1..]) {
                    *o -= factor * r;
                }
            }
        }
    }
    for i in (0..n).rev() {
        let sum = (i + 1..n).fold(system[i * width + n], |sum, c| {
            sum - system[i * width + c] * system[c * width + n]
        });
        let pivot = system[i * width + i];
        system[i * width + n] = if pivot == 0.0 { 0.0 } else { sum / pivot };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn affine_functions_are_foreseen_and_constants_exactly() {
        let mesh = shapes::icosphere([0.0; 3], 1.0, 3);
        let edges = mesh.triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let hierarchy = Hierarchy::new(mesh.positions.len(), edges).unwrap();
        let of = |rank: usize| mesh.positions[hierarchy.vertices[rank] as usize];
        let places: Vec<f64> = (0..hierarchy.len()).flat_map(of).collect();
        let weights = Weights::new(&hierarchy, &places, 3, 100.0);
        let affine = |p: [f64; 3]| 3.0 + 2.0 * p[0] - p[1] + 0.5 * p[2];
        let values: Vec<f64> = (0..hierarchy.len()).map(|rank| affine(of(rank))).collect();
        let ones = vec![1.0; hierarchy.len()];
        for rank in hierarchy.len() / 4..hierarchy.len() {
            let missed = weights.expected(&hierarchy, rank, &values) - values[rank];
            assert!(missed.abs() < 2e-3, "rank {rank}: {missed}");
            let one = weights.expected(&hierarchy, rank, &ones);
            assert!((one - 1.0).abs() < 1e-9, "rank {rank}: {one}");
        }
    }

    #[test]
    fn places_that_coincide_are_no_trouble() {
        let edges = (1..20u32).flat_map(|v| [[v - 1, v], [v / 2, v]]);
        let hierarchy = Hierarchy::new(20, edges).unwrap();
        for places in [vec![0.0; 60], vec![1e300; 60], (0..60).map(|i| f64::from(i / 6)).collect()] {
            let weights = Weights::new(&hierarchy, &places, 3, 1000.0);
            assert!(weights.0.iter().all(|w| w.is_finite()));
        }
    }
}
