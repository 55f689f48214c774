//! From a stream to positions.

use super::damaged;
use super::layout::{Anchor, Layout};
use super::matrices::{Models, State, Steps};
use super::pose::Pose;
use super::tracks::Lattice;
use crate::anim::compress::coder::Reader;
use crate::anim::compress::container::{push_number, take_f64, take_number};
use crate::anim::compress::hierarchy::Hierarchy;
use crate::error::Fault;
use crate::numeric::vector::Vec3;
use rayon::prelude::*;

/// What a window's first bytes say.
#[derive(Debug, Clone, PartialEq)]
pub struct Head {
    /// What frames of reference are fixed to.
    pub anchor: Anchor,
    /// The lattice of their points.
    pub lattice: Lattice,
    /// The steps of each cluster.
    pub steps: Vec<Steps>,
}

impl Head {
    /// Its bytes: what carries frames (0 the world, 1 a centroid, 2 triangles; and 4 where each cluster
    /// has its own steps), the number of clusters, the lattice, the steps.
    pub fn write(&self) -> Vec<u8> {
        let own = matches!(self.steps.first(), Some(Steps::Ranges { .. }));
        let mut out = vec![self.anchor as u8 | u8::from(own) << 2];
        push_number(&mut out, self.steps.len() as u64);
        for number in self.lattice.lo.into_iter().chain([self.lattice.step]) {
            out.extend_from_slice(&number.to_le_bytes());
        }
        for steps in &self.steps {
            match steps {
                Steps::Even(step) => {
                    out.extend_from_slice(&step.to_le_bytes());
                    break;
                }
                Steps::Ranges { columns, rows } => {
                    out.extend_from_slice(&(*columns as f32).to_le_bytes());
                    out.extend_from_slice(&(*rows as f32).to_le_bytes());
                }
            }
        }
        out
    }

    /// Takes it from the front of a window of so many vertices.
    fn read(bytes: &mut &[u8], vertices: usize) -> Result<Head, Fault> {
        let (kind, rest) = bytes
            .split_first()
            .ok_or_else(|| damaged("head is missing"))?;
        *bytes = rest;
        let anchor = match kind & 3 {
            0 => Anchor::World,
            1 => Anchor::Centroid,
            2 => Anchor::Triangle,
            _ => return Err(damaged("frames are of an unknown kind")),
        };
        let most = match anchor {
            Anchor::World => vertices,
            Anchor::Centroid => 1,
            Anchor::Triangle => vertices / 3,
        };
        let clusters = take_number(bytes).filter(|n| (1..=most as u64).contains(n));
        let clusters = clusters.ok_or_else(|| damaged("clusters are none or too many"))? as usize;
        let mut numbers = [0.0; 4];
        for number in &mut numbers {
            let finite = take_f64(bytes).filter(|x| x.is_finite());
            *number = finite.ok_or_else(|| damaged("lattice is not finite"))?;
        }
        let [x, y, z, step] = numbers;
        let positive = |x: Option<f64>| {
            x.filter(|x| x.is_finite() && *x > 0.0)
                .ok_or_else(|| damaged("step is not above 0"))
        };
        let steps = match kind >> 2 {
            0 => vec![Steps::Even(positive(take_f64(bytes))?); clusters],
            1 => {
                let mut small = || {
                    let (number, rest) = bytes.split_first_chunk()?;
                    *bytes = rest;
                    Some(f64::from(f32::from_le_bytes(*number)))
                };
                let mut steps = Vec::new();
                for _ in 0..clusters {
                    steps.push(Steps::Ranges {
                        columns: positive(small())?,
                        rows: positive(small())?,
                    });
                }
                steps
            }
            _ => return Err(damaged("steps are of an unknown kind")),
        };
        Ok(Head {
            anchor,
            lattice: Lattice {
                lo: [x, y, z],
                step,
            },
            steps,
        })
    }
}

/// The components of one cluster.
#[derive(Debug, Clone)]
struct Cluster {
    vertices: Vec<u32>,
    poses: Vec<Pose>,
    /// For each component the weights of all rows.
    columns: Vec<Vec<f64>>,
    /// For each component its coefficients over time.
    rows: Vec<Vec<f64>>,
}

/// A window that is known, as far as its parts are.
#[derive(Debug, Clone)]
pub struct Decoded {
    clusters: Vec<Cluster>,
    corners: Vec<[u32; 3]>,
    tracks: Vec<[i32; 3]>,
    lattice: Lattice,
}

/// Reads a window of so many frames, as far as there are parts; `hierarchy` is that of the mesh, and
/// `window` and `parts` are what [`super::Analysis::encode`] made.
///
/// Errs where the bytes cannot be those of an encoder. Cost: memory for at most six times the
/// positions.
pub fn decode(
    hierarchy: &Hierarchy,
    frames: usize,
    mut window: &[u8],
    parts: &[&[u8]],
) -> Result<Decoded, Fault> {
    if hierarchy.is_empty() || frames == 0 {
        return Err(damaged("vertices or frames are none"));
    }
    let head = Head::read(&mut window, hierarchy.len())?;
    let count = head.steps.len();
    let kind = (head.anchor, count, head.lattice);
    let mut reader = Reader::new(window);
    let (layout, _) = Layout::code(&mut reader, hierarchy, frames, kind, None, |_| 0.0)?;
    let mut models = Models::new(count, frames);
    let groups = layout.groups.iter().zip(&head.steps);
    let mut states: Vec<State> = groups
        .map(|(g, steps)| State::new(g, frames, *steps))
        .collect();
    let mut held = vec![(Vec::new(), Vec::new()); count];
    for mut part in parts.iter().copied() {
        let components = take_number(&mut part);
        let components = components.ok_or_else(|| damaged("part has no number of components"))?;
        let mut reader = Reader::new(part);
        for _ in 0..components {
            let cluster = models.whose(&mut reader, 0);
            let (state, held) = (&mut states[cluster], &mut held[cluster]);
            if state.met >= layout.groups[cluster].rows().min(frames) {
                return Err(damaged("components are too many"));
            }
            models.scale(&mut reader, state, 0.0);
            let column = models.column(&mut reader, state, None);
            held.1.push(models.row(&mut reader, state, &column, None));
            held.0.push(column);
        }
    }
    drop(states);
    let clusters = layout
        .groups
        .par_iter()
        .zip(held)
        .enumerate()
        .map(|(i, (group, held))| {
            let (columns, rows) = held;
            Cluster {
                vertices: group.vertices.clone(),
                poses: layout.poses(i),
                columns,
                rows,
            }
        });
    Ok(Decoded {
        clusters: clusters.collect(),
        corners: layout.corners,
        tracks: layout.tracks,
        lattice: layout.lattice,
    })
}

impl Decoded {
    /// Positions at one frame of the window, in local coordinates, of all vertices.
    ///
    /// Cost: three products for each vertex and component of its cluster.
    pub fn frame(&self, frame: usize, out: &mut [Vec3]) {
        let mut local = Vec::new();
        for cluster in &self.clusters {
            let count = cluster.vertices.len();
            local.clear();
            local.resize(3 * count, 0.0);
            for (column, row) in cluster.columns.iter().zip(&cluster.rows) {
                let x = row[frame];
                for (sum, weight) in local.iter_mut().zip(column) {
                    *sum += x * weight;
                }
            }
            let pose = &cluster.poses[frame];
            for (rank, v) in cluster.vertices.iter().enumerate() {
                out[*v as usize] =
                    pose.world([local[rank], local[count + rank], local[2 * count + rank]]);
            }
        }
        let corners = self.corners.iter().flatten();
        let count = 3 * self.corners.len();
        for (v, numbers) in corners.zip(&self.tracks[(frame * count).min(self.tracks.len())..]) {
            out[*v as usize] = self.lattice.point(*numbers);
        }
    }
}
