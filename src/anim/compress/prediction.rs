//! What a value at a vertex is expected to be, from the values at coarser vertices around it.
//!
//! Positions already known tell how the vertices lie to one another. The weights are those of
//! kriging: they make the expected squared error least for values that are smooth over a short
//! distance, and reproduce almost exactly whatever is an affine function of the known positions, as
//! the motion of a rigid part is. Source: G. Matheron, "The intrinsic random functions and their
//! applications" (1973).

use super::hierarchy::Hierarchy;
use rayon::prelude::*;

/// What a single value has of its own, that no other tells.
const NOISE: f64 = 0.005;
/// How far smooth functions stay alike, squared, in units of a ring's spread.
const REACH: f64 = 12.0;
/// How much rather weights stay even than foresee the coordinates that are known: the share of a ring's
/// spread that a vertex may be off a plane.
const RIDGE: f64 = 0.03;
/// Coordinates of a place, and vertices of a ring, at most.
const MOST_DIMS: usize = 64;
const MOST_RING: usize = Hierarchy::WIDEST;
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

    /// The same weights, moved as little as it takes to foresee the coordinates that are known already,
    /// one or two for each rank: in a plane they then foresee the third.
    ///
    /// Cost: a few products for each vertex of a ring, in parallel.
    pub fn through(&self, hierarchy: &Hierarchy, known: &[&[f64]]) -> Self {
        let of = |rank: usize| {
            let ring = hierarchy.rings.of(rank);
            let even = &self.0[hierarchy.rings.span(rank)];
            through(ring, even, rank, known)
        };
        let ranks = (0..hierarchy.len()).into_par_iter().with_min_len(256);
        Weights(ranks.flat_map_iter(of).collect())
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
        let known = Places {
            places,
            dims,
            affine,
        };
        parts.into_par_iter().with_min_len(64).for_each_init(
            Room::default,
            |room, (rank, part)| {
                known.krige(hierarchy.rings.of(rank), rank, room, part);
            },
        );
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

/// See [`Weights::through`].
fn through(ring: &[u32], even: &[f64], rank: usize, known: &[&[f64]]) -> Vec<f64> {
    let count = ring.len() as f64;
    let at = |field: &[f64], u: u32| field[u as usize];
    let mean = |field: &&[f64]| ring.iter().map(|u| at(field, *u)).sum::<f64>() / count;
    let means: Vec<f64> = known.iter().map(mean).collect();
    let apart = |i: usize, u: u32| at(known[i], u) - means[i];
    let missed = |i: usize| {
        let foreseen = ring.iter().zip(even).map(|(u, w)| w * at(known[i], *u));
        known[i][rank] - foreseen.sum::<f64>()
    };
    let spread = |i: usize, j: usize| {
        ring.iter()
            .map(|u| apart(i, *u) * apart(j, *u))
            .sum::<f64>()
    };
    // By Cramer's rule, for one coordinate as for two.
    let (a, mut b, mut d) = (spread(0, 0), 0.0, 0.0);
    let (x, mut y) = (missed(0), 0.0);
    if known.len() > 1 {
        (b, d, y) = (spread(0, 1), spread(1, 1), missed(1));
    }
    let ridge = RIDGE * (a + d);
    let (a, d) = (a + ridge, d + ridge);
    let det = a * d - b * b;
    if !(det > 0.0 && det.is_finite()) {
        return even.to_vec();
    }
    let (s, t) = ((d * x - b * y) / det, (a * y - b * x) / det);
    let moved = ring.iter().zip(even).map(|(u, w)| {
        let second = if known.len() > 1 {
            t * apart(1, *u)
        } else {
            0.0
        };
        w + s * apart(0, *u) + second
    });
    moved.collect()
}

/// Where vertices are.
#[derive(Clone, Copy)]
struct Places<'a> {
    places: &'a [f64],
    dims: usize,
    affine: f64,
}

/// Room for the system of one ring.
#[derive(Default)]
struct Room {
    /// Places less their centre, in units of their spread; the last is that of the vertex itself.
    local: Vec<f64>,
    /// The same, coordinate by coordinate.
    turned: Vec<f64>,
    matrix: Vec<f64>,
    /// The last row of the covariances: with the vertex itself.
    with: Vec<f64>,
    ones: Vec<f64>,
    sums: Vec<f64>,
}

impl Room {
    /// The sum over all coordinates of the products of place `i` with the first places, into `sums`.
    ///
    /// Here as in [`root`] and [`solve`], what lies side by side are sums that do not wait for one
    /// another; each of them goes on in the order of its terms.
    fn products(&mut self, i: usize, stride: usize) {
        self.sums.fill(0.0);
        for coordinate in self.turned.chunks_exact(stride) {
            add_scaled(&mut self.sums, coordinate, coordinate[i]);
        }
    }
}

/// `sums += values * factor`.
#[inline]
fn add_scaled(sums: &mut [f64], values: &[f64], factor: f64) {
    for (sum, x) in sums.iter_mut().zip(values) {
        *sum += factor * x;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}

impl Places<'_> {
    /// Ring and vertex in local coordinates; false where they have none.
    fn localise(&self, ring: &[u32], rank: usize, room: &mut Room) -> bool {
        let Places { places, dims, .. } = *self;
        let local = &mut room.local;
        local.clear();
        for u in ring.iter().map(|u| *u as usize).chain([rank]) {
            local.extend_from_slice(&places[u * dims..(u + 1) * dims]);
        }
        let (around, _) = local.split_at(ring.len() * dims);
        let mut centre = [0.0; MOST_DIMS];
        for place in around.chunks_exact(dims) {
            for (c, x) in centre.iter_mut().zip(place) {
                *c += x / ring.len() as f64;
            }
        }
        for place in local.chunks_exact_mut(dims) {
            for (x, c) in place.iter_mut().zip(&centre) {
                *x -= c;
            }
        }
        let around = &local[..ring.len() * dims];
        let scale = (ring.len() as f64 / dot(around, around)).sqrt();
        local.iter_mut().for_each(|x| *x *= scale);
        let stride = ring.len() + 1;
        room.turned.resize(stride * dims, 0.0);
        for (i, place) in local.chunks_exact(dims).enumerate() {
            for (d, x) in place.iter().enumerate() {
                room.turned[d * stride + i] = *x;
            }
        }
        scale.is_finite()
    }

    /// The covariance of two places whose products are known, up to what the weights' sum of one takes
    /// away: that of an affine function and of a smooth one.
    fn covariance(&self, a: f64, b: f64, product: f64) -> f64 {
        let apart = (a + b - 2.0 * product).max(0.0);
        self.affine * product + REACH / (1.0 + apart / REACH)
    }

    /// The weights of one ring.
    fn krige(&self, ring: &[u32], rank: usize, room: &mut Room, weights: &mut [f64]) {
        let count = ring.len();
        if count < 2 || !self.localise(ring, rank, room) {
            weights.fill(1.0 / count as f64);
            return;
        }
        let stride = count + 1;
        let mut lengths = [0.0; MOST_RING + 1];
        let lengths = &mut lengths[..stride];
        for coordinate in room.turned.chunks_exact(stride) {
            for (length, x) in lengths.iter_mut().zip(coordinate) {
                *length += x * x;
            }
        }
        room.sums.resize(stride, 0.0);
        room.matrix.resize(count * count, 0.0);
        for j in 0..count {
            room.products(j, stride);
            let column = &mut room.matrix[j * count..(j + 1) * count];
            let below = column.iter_mut().zip(&room.sums).enumerate().skip(j);
            for (i, (to, product)) in below {
                *to = self.covariance(lengths[i], lengths[j], *product);
            }
            column[j] += NOISE;
        }
        room.products(count, stride);
        let with = room.sums.iter().zip(lengths.iter()).take(count);
        let with = with.map(|(product, length)| self.covariance(*length, lengths[count], *product));
        room.with.clear();
        room.with.extend(with);
        room.ones.clear();
        room.ones.resize(count, 1.0);
        let sums = &mut room.sums[..count];
        root(&mut room.matrix, sums);
        solve(&room.matrix, &mut room.with, sums);
        solve(&room.matrix, &mut room.ones, sums);
        let (with, ones) = (&room.with, &room.ones);
        let share = (1.0 - with.iter().sum::<f64>()) / ones.iter().sum::<f64>();
        for (weight, (with, one)) in weights.iter_mut().zip(with.iter().zip(ones)) {
            *weight = with + share * one;
        }
    }
}

/// The root of a positive definite matrix, in its place (Cholesky): column after column, of which the
/// part from the diagonal on counts. `sums` is room for one column.
fn root(matrix: &mut [f64], sums: &mut [f64]) {
    let count = sums.len();
    for j in 0..count {
        let (before, this) = matrix.split_at_mut(j * count);
        let this = &mut this[j..count];
        let sums = &mut sums[j..];
        sums.fill(0.0);
        for column in before.chunks_exact(count) {
            add_scaled(sums, &column[j..], column[j]);
        }
        // Below this there is nothing but rounding: the noise alone is larger.
        let diagonal = (this[0] - sums[0]).max(0.5 * NOISE).sqrt();
        this[0] = diagonal;
        for (x, sum) in this.iter_mut().zip(sums.iter()).skip(1) {
            *x = (*x - sum) / diagonal;
        }
    }
}

/// Solves for one right side, given the root; `sums` is room for one column.
fn solve(root: &[f64], side: &mut [f64], sums: &mut [f64]) {
    let count = side.len();
    sums.fill(0.0);
    for (k, column) in root.chunks_exact(count).enumerate() {
        side[k] = (side[k] - sums[k]) / column[k];
        add_scaled(&mut sums[k + 1..], &column[k + 1..], side[k]);
    }
    for i in (0..count).rev() {
        side[i] /= root[i * count + i];
        let value = side[i];
        for (k, side) in side[..i].iter_mut().enumerate() {
            *side -= value * root[k * count + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn affine_functions_are_foreseen_and_constants_exactly() {
        let mesh = shapes::icosphere([0.0; 3], 1.0, 3);
        let edges = mesh
            .triangles
            .iter()
            .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
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
    fn in_a_plane_two_coordinates_tell_the_third() {
        let mesh = shapes::sheet(1.0, 1.0, 12, 12);
        let edges = mesh.triangles.iter();
        let edges = edges.flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let hierarchy = Hierarchy::new(mesh.positions.len(), edges).unwrap();
        // Vertices moved about within a plane.
        let place = |rank: usize| {
            let v = hierarchy.vertices[rank];
            let [x, y, _] = mesh.positions[v as usize];
            let (x, y) = (x + 0.02 * (7.0 * y).sin(), y + 0.02 * (9.0 * x).cos());
            [x, y, 0.3 * x - 0.4 * y]
        };
        let field = |axis: usize| -> Vec<f64> {
            (0..hierarchy.len()).map(|rank| place(rank)[axis]).collect()
        };
        let fields = [field(0), field(1), field(2)];
        let even = Weights::even(&hierarchy);
        let through = even.through(&hierarchy, &[&fields[0], &fields[1]]);
        let missed = |weights: &Weights| {
            let of = |rank: usize| weights.expected(&hierarchy, rank, &fields[2]) - fields[2][rank];
            (20..hierarchy.len())
                .map(|rank| of(rank).powi(2))
                .sum::<f64>()
        };
        assert!(
            missed(&through) < 0.2 * missed(&even),
            "{} {}",
            missed(&through),
            missed(&even)
        );
    }

    #[test]
    fn places_that_coincide_are_no_trouble() {
        let edges = (1..20u32).flat_map(|v| [[v - 1, v], [v / 2, v]]);
        let hierarchy = Hierarchy::new(20, edges).unwrap();
        for places in [
            vec![0.0; 60],
            vec![1e300; 60],
            (0..60).map(|i| f64::from(i / 6)).collect(),
        ] {
            let weights = Weights::new(&hierarchy, &places, 3, 1000.0);
            assert!(weights.0.iter().all(|w| w.is_finite()));
        }
    }
}
