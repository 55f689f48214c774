//! The paper's relaxation: each vertex to the mean of its neighbours, clipped.

use super::neighbours::Neighbours;
use super::region::Region;
use super::{Outcome, Params, Stop, Update};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, add, length, scale, sub};
use crate::volume::isosurface::{NONE, Surface};
use rayon::prelude::*;

/// Vertices that one thread moves at a time.
const CHUNK: usize = 1 << 12;

/// A vertex lies still when it and its neighbours moved by less than this share of the threshold.
const STILL: f64 = 0.1;

pub(super) struct Relax<'a> {
    surface: &'a Surface,
    metric: Vec3,
    regions: &'a (dyn Fn(usize) -> Region + Sync),
    neighbours: Neighbours,
}

impl<'a> Relax<'a> {
    /// Neighbours are the other ends of a vertex's edges; at the end of a surface, those that lie there
    /// too. They are taken in the order of their places, so that no numbering of vertices matters.
    pub(super) fn new(
        surface: &'a Surface,
        triangles: &[[u32; 3]],
        metric: Vec3,
        regions: &'a (dyn Fn(usize) -> Region + Sync),
    ) -> Self {
        let ends =
            |v: u32| surface.is_on_edge(v as usize) && surface.links[v as usize].contains(&NONE);
        let neighbours = Neighbours::new(
            surface.len(),
            triangles,
            |w| (surface.places[w as usize], w),
            |v, w| !ends(v) || ends(w),
        );
        Relax {
            surface,
            metric,
            regions,
            neighbours,
        }
    }

    pub(super) fn run(&self, params: &Params, advance: &(dyn Fn() + Sync)) -> (Vec<Vec3>, Outcome) {
        let n = self.surface.len();
        let mut offsets = vec![[0.0; 3]; n];
        let mut next = offsets.clone();
        let mut awake = vec![true; n];
        let mut outcome = Outcome::default();
        let still = STILL * params.threshold;
        for _ in 0..params.max_iterations {
            let moved: Vec<f64> = match params.update {
                Update::Jacobi => {
                    let moved = next
                        .par_iter_mut()
                        .enumerate()
                        .with_min_len(CHUNK)
                        .map(|(v, to)| {
                            *to = if awake[v] {
                                self.target(v, &offsets)
                            } else {
                                offsets[v]
                            };
                            self.way(*to, offsets[v])
                        })
                        .collect();
                    std::mem::swap(&mut offsets, &mut next);
                    moved
                }
                Update::GaussSeidel => (0..n)
                    .map(|v| {
                        if !awake[v] {
                            return 0.0;
                        }
                        let to = self.target(v, &offsets);
                        let way = self.way(to, offsets[v]);
                        offsets[v] = to;
                        way
                    })
                    .collect(),
            };
            outcome.iterations += 1;
            outcome.updates += awake.iter().filter(|a| **a).count() as u64;
            outcome.last_step = moved.iter().copied().fold(0.0, f64::max);
            advance();
            if outcome.last_step < params.threshold {
                outcome.stop = Stop::Threshold;
                break;
            }
            awake
                .par_iter_mut()
                .enumerate()
                .with_min_len(CHUNK)
                .for_each(|(v, awake)| {
                    let near = self
                        .neighbours
                        .of(v)
                        .iter()
                        .any(|w| moved[*w as usize] >= still);
                    *awake = near || moved[v] >= still;
                });
            if !awake.contains(&true) {
                outcome.stop = Stop::Still;
                break;
            }
        }
        (offsets, outcome)
    }

    /// How far apart two offsets are, in the smallest spacing.
    fn way(&self, a: Vec3, b: Vec3) -> f64 {
        let d = sub(a, b);
        length(std::array::from_fn(|axis| d[axis] * self.metric[axis]))
    }

    /// The mean of the neighbours from the vertex's first place, clipped.
    fn target(&self, v: usize, offsets: &[Vec3]) -> Vec3 {
        let near = self.neighbours.of(v);
        if near.is_empty() {
            return offsets[v];
        }
        let at = self.surface.places[v];
        let mut sum = [0.0; 3];
        for w in near {
            let place = self.surface.places[*w as usize];
            let step = std::array::from_fn(|a| 0.5 * f64::from(place[a] - at[a]));
            sum = add(sum, add(step, offsets[*w as usize]));
        }
        (self.regions)(v).clip(scale(sum, 1.0 / near.len() as f64))
    }
}

/// Any mesh in boxes of `spacing` around its vertices; see [`super::smooth_in_boxes`].
pub(super) fn in_boxes(
    mesh: &Mesh,
    spacing: Vec3,
    params: &Params,
    advance: &(dyn Fn() + Sync),
) -> (Vec<Vec3>, Outcome) {
    let first = &mesh.positions;
    if first.is_empty() {
        return (Vec::new(), Outcome::NOTHING);
    }
    let ends = ends_of(&mesh.triangles, first.len());
    let neighbours = Neighbours::new(
        first.len(),
        &mesh.triangles,
        |w| w,
        |v, w| !ends[v as usize] || ends[w as usize],
    );
    let smallest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let mut at = first.clone();
    let mut outcome = Outcome::default();
    for _ in 0..params.max_iterations {
        let target = |v: usize| {
            let near = neighbours.of(v);
            if near.is_empty() {
                return at[v];
            }
            // From the first place, so that far from the origin nothing is lost.
            let ways = near.iter().map(|w| sub(at[*w as usize], first[v]));
            let mean = scale(ways.fold([0.0; 3], add), 1.0 / near.len() as f64);
            let kept = |a: usize| {
                let reach = 0.5 * params.scale * spacing[a];
                mean[a].clamp(-reach, reach)
            };
            add(first[v], [kept(0), kept(1), kept(2)])
        };
        let next: Vec<Vec3> = (0..at.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(target)
            .collect();
        let ways = next.iter().zip(&at).map(|(a, b)| length(sub(*a, *b)));
        outcome.last_step = ways.fold(0.0, f64::max) / smallest;
        outcome.iterations += 1;
        outcome.updates += at.len() as u64;
        at = next;
        advance();
        if outcome.last_step < params.threshold {
            outcome.stop = Stop::Threshold;
            break;
        }
    }
    (at, outcome)
}

/// Whether each vertex lies on an edge of one triangle alone.
fn ends_of(triangles: &[[u32; 3]], vertices: usize) -> Vec<bool> {
    let mut sides: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|t| (0..3).map(|i| [t[i], t[(i + 1) % 3]]))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    sides.par_sort_unstable();
    let mut ends = vec![false; vertices];
    for same in sides.chunk_by(|a, b| a == b) {
        if same.len() == 1 {
            for v in same[0] {
                ends[v as usize] = true;
            }
        }
    }
    ends
}
