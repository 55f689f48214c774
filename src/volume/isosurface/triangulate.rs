//! Polygons of cells become triangles.

use super::{Loops, Surface};
use crate::numeric::vector::{Vec3, dot, sub};
use rayon::prelude::*;

/// Polygons that one thread splits at a time.
const CHUNK: usize = 4096;

/// Most corners of a polygon: as many as a cell has edges.
const MOST: usize = 12;

impl Loops {
    /// Number of triangles that the polygons are split into.
    pub fn triangle_count(&self) -> usize {
        self.corners.len() - 2 * self.lengths.len()
    }

    /// The polygons, a fixed number at a time, each chunk with its corners.
    pub(crate) fn chunks(&self) -> Vec<(&[u8], &[u32])> {
        let mut rest = &self.corners[..];
        let take = |lengths| {
            let corners = corners_of(lengths);
            let (head, tail) = rest.split_at(corners);
            rest = tail;
            (lengths, head)
        };
        self.lengths.chunks(CHUNK).map(take).collect()
    }
}

fn corners_of(lengths: &[u8]) -> usize {
    lengths.iter().map(|n| usize::from(*n)).sum()
}

impl Surface {
    /// The polygons as triangles, split along their shortest diagonals.
    ///
    /// No diagonal lies in a face of a cell, where that of the neighbour could meet it and make an edge
    /// of four triangles. Cost: linear; a polygon of n corners takes n^3 steps, and n is rarely over 6.
    pub fn triangles(&self, positions: &[Vec3]) -> Vec<[u32; 3]> {
        let mut triangles = vec![[0; 3]; self.loops.triangle_count()];
        let mut parts = Vec::new();
        let mut rest = &mut triangles[..];
        for (lengths, corners) in self.loops.chunks() {
            let (head, tail) = rest.split_at_mut(corners.len() - 2 * lengths.len());
            rest = tail;
            parts.push((lengths, corners, head));
        }
        parts.into_par_iter().for_each(|(lengths, corners, out)| {
            let (mut corners, mut out) = (corners, out);
            for length in lengths {
                let (polygon, after) = corners.split_at(usize::from(*length));
                corners = after;
                let (head, tail) = out.split_at_mut(polygon.len() - 2);
                out = tail;
                self.split(polygon, positions, head);
            }
        });
        triangles
    }

    /// The polygons as fans around their first corners, as tables of marching cubes have them.
    pub fn fans(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.loops.triangle_count());
        let mut corners = &self.loops.corners[..];
        for length in &self.loops.lengths {
            let (polygon, after) = corners.split_at(usize::from(*length));
            corners = after;
            let rest = polygon[1..].windows(2);
            triangles.extend(rest.map(|pair| [polygon[0], pair[0], pair[1]]));
        }
        triangles
    }

    fn split(&self, polygon: &[u32], positions: &[Vec3], out: &mut [[u32; 3]]) {
        let length = |a: u32, b: u32| {
            let along = sub(positions[a as usize], positions[b as usize]);
            let square = dot(along, along);
            // Worse than any that is allowed, and one of these better than two.
            if self.in_one_face(a, b) {
                f64::MAX / 16.0
            } else {
                square
            }
        };
        match *polygon {
            [a, b, c] => out[0] = [a, b, c],
            [a, b, c, d] => {
                let halves = if length(a, c) <= length(b, d) {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                };
                out.copy_from_slice(&halves);
            }
            _ => shortest_diagonals(polygon, length, out),
        }
    }

    /// Whether two vertices of a cell lie in the same one of its faces.
    fn in_one_face(&self, a: u32, b: u32) -> bool {
        let (p, q) = (self.places[a as usize], self.places[b as usize]);
        (0..3).any(|axis| p[axis] == q[axis] && p[axis] & 1 == 0)
    }
}

/// Splits a polygon so that the sum of what `length` says of its diagonals is least.
fn shortest_diagonals(polygon: &[u32], length: impl Fn(u32, u32) -> f64, out: &mut [[u32; 3]]) {
    let n = polygon.len();
    let mut cost = [[0.0; MOST]; MOST];
    let mut apex = [[0; MOST]; MOST];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            let own = if span + 1 == n {
                0.0
            } else {
                length(polygon[i], polygon[j])
            };
            let mut best = (f64::INFINITY, i + 1);
            for k in i + 1..j {
                let sum = cost[i][k] + cost[k][j];
                if sum < best.0 {
                    best = (sum, k);
                }
            }
            cost[i][j] = best.0 + own;
            apex[i][j] = best.1;
        }
    }
    let mut left = vec![(0, n - 1)];
    let mut filled = 0;
    while let Some((i, j)) = left.pop() {
        if j < i + 2 {
            continue;
        }
        let k = apex[i][j];
        out[filled] = [polygon[i], polygon[k], polygon[j]];
        filled += 1;
        left.extend([(i, k), (k, j)]);
    }
}
