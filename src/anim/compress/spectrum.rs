//! How the vertices of a clip move together: their trajectories' principal directions.

use crate::numeric::vector::Vec3;
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;
use std::ops::Range;

/// Vertices that are looked at together.
const BLOCK: usize = 128;

/// The trajectories of all vertices over some frames, in local coordinates.
///
/// The trajectory of a vertex has `3 F` numbers: x at all frames, then y, then z. Nothing is copied
/// but a block at a time.
#[derive(Debug, Clone, Copy)]
pub struct Trajectories<'a> {
    /// Vertex `v` of frame `f` is `positions[f * vertices + v]`.
    pub positions: &'a [Vec3],
    /// Vertices of a frame.
    pub vertices: usize,
    /// What is taken off every position first.
    pub origin: Vec3,
    /// What it is then multiplied by.
    pub scale: f64,
}

impl Trajectories<'_> {
    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.positions.len() / self.vertices
    }

    /// A coordinate in local coordinates.
    #[inline]
    pub fn at(&self, frame: usize, vertex: usize, axis: usize) -> f64 {
        (self.positions[frame * self.vertices + vertex][axis] - self.origin[axis]) * self.scale
    }

    /// The mean position of each vertex over the frames.
    pub fn means(&self) -> Vec<Vec3> {
        let frames = self.frames();
        let mean = |vertex: usize| {
            std::array::from_fn(|axis| {
                let all = (0..frames).map(|frame| self.at(frame, vertex, axis));
                all.sum::<f64>() / frames as f64
            })
        };
        (0..self.vertices).into_par_iter().map(mean).collect()
    }

    /// The trajectories of a block of vertices less their means: coordinate `i` of the `j`-th vertex
    /// is at `i * BLOCK + j`, and what is beyond the last vertex is 0.
    fn block(&self, first: usize, means: &[Vec3], out: &mut Vec<f64>) {
        let frames = self.frames();
        out.clear();
        out.resize(3 * frames * BLOCK, 0.0);
        let last = self.vertices.min(first + BLOCK);
        for frame in 0..frames {
            for vertex in first..last {
                for axis in 0..3 {
                    let value = self.at(frame, vertex, axis) - means[vertex][axis];
                    out[(axis * frames + frame) * BLOCK + vertex - first] = value;
                }
            }
        }
    }

    /// The products of every two coordinates of the trajectories less their means, summed over the
    /// vertices: `3 F` rows of as many. Cost: half of `V (3 F)^2` products, on all threads.
    fn products(&self, means: &[Vec3]) -> Vec<f64> {
        let size = 3 * self.frames();
        let mut sums = vec![0.0; size * size];
        let mut block = Vec::new();
        for first in (0..self.vertices).step_by(BLOCK) {
            self.block(first, means, &mut block);
            let row = |i: usize| &block[i * BLOCK..(i + 1) * BLOCK];
            let add = |(i, sums): (usize, &mut [f64])| {
                for (j, sum) in sums.iter_mut().enumerate().take(i + 1) {
                    *sum += dot(row(i), row(j));
                }
            };
            sums.par_chunks_mut(size).enumerate().for_each(add);
        }
        for i in 0..size {
            for j in i + 1..size {
                sums[i * size + j] = sums[j * size + i];
            }
        }
        sums
    }

    /// The products of each vertex's trajectory less its mean with vectors of `3 F` numbers.
    pub fn onto(&self, vectors: &[f64], means: &[Vec3]) -> Products {
        let size = 3 * self.frames();
        let count = vectors.len() / size;
        let mut blocks = vec![[0.0; BLOCK]; self.vertices.div_ceil(BLOCK) * count];
        let each = blocks.par_chunks_mut(count.max(1)).enumerate();
        each.for_each_init(Vec::new, |block, (number, sums)| {
            self.block(number * BLOCK, means, block);
            for (vector, sums) in vectors.chunks_exact(size).zip(sums) {
                for (value, row) in vector.iter().zip(block.as_chunks::<BLOCK>().0) {
                    for (sum, x) in sums.iter_mut().zip(row) {
                        *sum += value * x;
                    }
                }
            }
        });
        Products { count, blocks }
    }

    /// The squared lengths of all trajectories less their means, summed.
    pub fn energy(&self, means: &[Vec3]) -> f64 {
        let rows: Vec<f64> = (0..self.frames())
            .into_par_iter()
            .map(|frame| {
                let of = |(vertex, mean): (usize, &Vec3)| {
                    let apart = |axis: usize| self.at(frame, vertex, axis) - mean[axis];
                    (0..3).map(|axis| apart(axis) * apart(axis)).sum::<f64>()
                };
                means.iter().enumerate().map(of).sum()
            })
            .collect();
        rows.iter().sum()
    }
}

/// A value for every vertex, of each of several vectors.
#[derive(Debug, Default)]
pub struct Products {
    count: usize,
    blocks: Vec<[f64; BLOCK]>,
}

impl Products {
    /// The value of a vertex for one of the vectors.
    #[inline]
    pub fn at(&self, vector: usize, vertex: usize) -> f64 {
        self.blocks[vertex / BLOCK * self.count + vector][vertex % BLOCK]
    }
}

/// A sum of products in a fixed order that runs in lanes.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    for (a, b) in a.as_chunks::<8>().0.iter().zip(b.as_chunks::<8>().0) {
        for i in 0..8 {
            lanes[i] += a[i] * b[i];
        }
    }
    lanes.iter().sum()
}

/// Principal directions, of most energy first.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// Unit vectors of `3 F` numbers each: for every axis the cosine transform over the frames.
    pub vectors: Vec<f64>,
    /// The energy along each.
    pub energies: Vec<f64>,
}

/// The principal directions of trajectories, as cosine transforms.
///
/// Directions of no energy are left out. Cost: `V (3 F)^2` and some tens of `(3 F)^3` operations.
/// Source: M. Alexa and W. Müller, "Representing animations by principal components" (2000), of
/// trajectories instead of shapes as in L. Váša and V. Skala, "Coddyac" (2007).
pub fn spectrum(trajectories: &Trajectories, means: &[Vec3]) -> Spectrum {
    let frames = trajectories.frames();
    let size = 3 * frames;
    let products = DMatrix::from_vec(size, size, trajectories.products(means));
    let total = products.trace();
    let eigen = SymmetricEigen::new(products);
    let mut order: Vec<usize> = (0..size).collect();
    let energy = |i: usize| eigen.eigenvalues[i];
    order.sort_by(|a, b| energy(*b).total_cmp(&energy(*a)));
    order.retain(|i| energy(*i) > 1e-15 * total && energy(*i) > 0.0);
    let cosines = Cosines::new(frames);
    let vectors: Vec<Vec<f64>> = order
        .par_iter()
        .map(|i| {
            let column = eigen.eigenvectors.column(*i);
            let mut vector = vec![0.0; size];
            for (time, out) in column
                .as_slice()
                .chunks_exact(frames)
                .zip(vector.chunks_exact_mut(frames))
            {
                cosines.transform(time, out);
            }
            // A direction has no sign of its own: its largest number is made positive.
            let largest = vector
                .iter()
                .copied()
                .max_by(|a, b| a.abs().total_cmp(&b.abs()));
            if largest.is_some_and(|largest| largest < 0.0) {
                vector.iter_mut().for_each(|x| *x = -*x);
            }
            vector
        })
        .collect();
    Spectrum {
        vectors: vectors.concat(),
        energies: order.iter().map(|i| energy(*i)).collect(),
    }
}

/// The orthonormal cosine transform of a few frames (DCT-II).
#[derive(Debug, Clone)]
pub struct Cosines {
    frames: usize,
    /// Frequency by frequency, each at all frames.
    table: Vec<f64>,
}

impl Cosines {
    /// Of so many frames.
    pub fn new(frames: usize) -> Self {
        let n = frames as f64;
        let at = |k: usize, t: usize| match k {
            0 => (1.0 / n).sqrt(),
            k => {
                let turn = (2 * t + 1) * k % (4 * frames);
                (2.0 / n).sqrt() * (std::f64::consts::PI * turn as f64 / (2.0 * n)).cos()
            }
        };
        let row = |k: usize| (0..frames).map(move |t| at(k, t));
        Cosines {
            frames,
            table: (0..frames).flat_map(row).collect(),
        }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// One frequency at all frames.
    pub fn frequency(&self, k: usize) -> &[f64] {
        &self.table[k * self.frames..(k + 1) * self.frames]
    }

    /// From frames to frequencies.
    pub fn transform(&self, time: &[f64], out: &mut [f64]) {
        for (k, out) in out.iter_mut().enumerate() {
            let terms = time.iter().zip(self.frequency(k));
            *out = terms.fold(0.0, |sum, (x, c)| sum + x * c);
        }
    }

    /// From frequencies to frames.
    pub fn inverse(&self, frequencies: &[f64], out: &mut [f64]) {
        self.inverse_at(frequencies, 0..self.frames, out);
    }

    /// From frequencies to some of the frames.
    pub fn inverse_at(&self, frequencies: &[f64], frames: Range<usize>, out: &mut [f64]) {
        out.fill(0.0);
        for (k, x) in frequencies.iter().enumerate() {
            if *x != 0.0 {
                let there = &self.frequency(k)[frames.clone()];
                for (out, c) in out.iter_mut().zip(there) {
                    *out += x * c;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    #[test]
    fn the_cosine_transform_is_orthonormal() {
        for frames in [1, 2, 7, 48] {
            let cosines = Cosines::new(frames);
            let time: Vec<f64> = (0..frames).map(|t| (t as f64 * 0.7).sin() + 0.1).collect();
            let (mut there, mut back) = (vec![0.0; frames], vec![0.0; frames]);
            cosines.transform(&time, &mut there);
            cosines.inverse(&there, &mut back);
            let energy = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
            assert!((energy(&time) - energy(&there)).abs() < 1e-12);
            assert!(time.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }

    #[test]
    fn motion_of_low_rank_has_so_many_directions() {
        let (vertices, frames) = (300, 20);
        let mut rng = Rng::new(9, 0);
        let modes: Vec<Vec3> = (0..2 * frames)
            .map(|_| std::array::from_fn(|_| rng.range(-1.0, 1.0)))
            .collect();
        let weights: Vec<[f64; 2]> = (0..vertices).map(|_| [rng.unit(), rng.unit()]).collect();
        let positions: Vec<Vec3> = (0..frames * vertices)
            .map(|i| {
                let (f, v) = (i / vertices, i % vertices);
                let [a, b] = weights[v];
                std::array::from_fn(|x| 5.0 + a * modes[f][x] + b * modes[frames + f][x])
            })
            .collect();
        let trajectories = Trajectories {
            positions: &positions,
            vertices,
            origin: [5.0; 3],
            scale: 1.0,
        };
        let means = trajectories.means();
        let found = spectrum(&trajectories, &means);
        let total: f64 = found.energies.iter().sum();
        assert!((total / trajectories.energy(&means) - 1.0).abs() < 1e-12);
        let rest: f64 = found.energies[2..].iter().sum();
        assert!(rest < 1e-12 * total, "{rest} of {total}");
        // What the products with the directions hold is all there is.
        let cosines = Cosines::new(frames);
        let mut time = vec![0.0; 2 * 3 * frames];
        let parts = time.chunks_exact_mut(frames);
        for (time, there) in parts.zip(found.vectors.chunks_exact(frames)) {
            cosines.inverse(there, time);
        }
        let onto = trajectories.onto(&time, &means);
        let held: f64 = onto.blocks.iter().flatten().map(|x| x * x).sum();
        assert!((held / total - 1.0).abs() < 1e-10);
    }
}
