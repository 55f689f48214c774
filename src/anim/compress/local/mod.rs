//! Animation as clusters of vertices that move together, each seen from a frame of reference that moves
//! with it.
//!
//! A triangle of the mesh carries the frame of reference of a cluster; a vertex belongs to the cluster
//! in whose frame it moves least. Seen from there a rigid part stands still, and a few components, each
//! a column of weights and a row of coefficients over time, hold what is left. Which cluster gets how
//! many is weighed by what they cost and what they gain.
//!
//! Source: "Efficient compression of 3D dynamic mesh sequences", Journal of WSCG (2007): relative local
//! principal component analysis. Of our own: wide frames of reference, steps that make the same error in
//! all numbers, columns foreseen over the mesh, and points of the frames foreseen from one another.

mod allocate;
mod arrange;
mod clusters;
mod decode;
mod encode;
mod labels;
mod layout;
mod matrices;
mod modes;
mod plan;
mod pose;
mod predictor;
mod rows;
mod seeds;
#[cfg(test)]
mod tests;
mod tracks;

pub use decode::{Decoded, decode};

use super::coder::Writer;
use super::hierarchy::Hierarchy;
use super::spectrum::Trajectories;
use crate::error::{Error, Fault, Result};
use crate::numeric::vector::{dot, sub};
use arrange::{arrange, bounds};
use layout::{Anchor, Layout, Spent};
use modes::{Matrix, Modes};
use rayon::prelude::*;
use seeds::position;
use std::sync::OnceLock;
use tracks::Lattice;

/// Where clusters are seen from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// From frames of reference that move with them.
    Relative,
    /// From the world: the same clusters, without frames.
    World,
    /// From the world, and all vertices are one cluster: principal component analysis as it is.
    Whole,
}

/// The triangle that carries a frame of reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// The triangle of the mesh that the cluster grew from.
    Seed,
    /// Three vertices of the cluster as far apart as they are at every frame: rounding makes such a
    /// frame tremble less.
    Wide,
}

/// How components are shared out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Allocate {
    /// By the squared error that a bit takes off.
    RateDistortion,
    /// By the root of the squared error that a component takes off, every cluster having at least one.
    Paper,
    /// The same number for every cluster.
    Uniform,
}

/// How much a vertex moves in a frame of reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// The sum of its squared steps from frame to frame.
    Motion,
    /// The length of its path.
    Path,
    /// The sum of its squared distances from its mean place.
    Variance,
}

/// How finely numbers are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// All numbers of all clusters make the same squared error: columns and rows of less energy take
    /// fewer bits. A step is the largest side of the clip over `2^bits`, at every frame.
    Balanced,
    /// One step for the columns of a cluster and one for its rows: their range over `2^bits`.
    Ranges,
}

/// What a clip is taken apart by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Params {
    /// Where clusters are seen from.
    pub space: Space,
    /// Number of clusters wanted; there are fewer where there are not so many triangles apart.
    pub clusters: usize,
    /// Bits of columns and rows; none chooses them for the goal, by quarters.
    pub bits: Option<u32>,
    /// Bits of the points of frames of reference, over the largest side of the clip.
    pub seed_bits: u32,
    /// The triangles of frames of reference.
    pub frame: Frame,
    /// How components are shared out.
    pub allocate: Allocate,
    /// What decides the cluster of a vertex.
    pub metric: Metric,
    /// How numbers are rounded.
    pub rounding: Rounding,
}

impl Params {
    /// What is usual.
    pub const DEFAULT: Params = Params {
        space: Space::Relative,
        clusters: 10,
        bits: Some(12),
        seed_bits: 16,
        frame: Frame::Wide,
        allocate: Allocate::RateDistortion,
        metric: Metric::Motion,
        rounding: Rounding::Balanced,
    };

    /// Bits at most.
    pub const MOST_BITS: u32 = 24;

    /// Whether all are in their range; errs with [`Error::Parameter`] and the range.
    pub fn check(&self) -> Result<()> {
        let range = 2..=Self::MOST_BITS;
        let problem = format!("is not between 2 and {}", Self::MOST_BITS);
        if let Some(bits) = self.bits.filter(|bits| !range.contains(bits)) {
            return Err(Error::parameter("bits", bits, problem));
        }
        if !range.contains(&self.seed_bits) {
            return Err(Error::parameter("seed-bits", self.seed_bits, problem));
        }
        if self.clusters == 0 {
            return Err(Error::parameter("clusters", 0, "is less than 1"));
        }
        Ok(())
    }
}

/// What a stream shall reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// As many components as this number for every cluster makes: the same number of them with
    /// [`Allocate::Paper`], the same estimated bits with [`Allocate::RateDistortion`].
    Components(usize),
    /// A squared error, in local units, of at most this.
    SquaredError(f64),
    /// At most so many bits, payloads of window and parts together.
    Bits(f64),
}

/// The least error that is to be had, where a goal is below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// The least squared error with the bits at hand, in local units.
    pub squared_error: f64,
    /// What of it comes from the points of frames of reference: seed bits would reduce it.
    pub seed_squared_error: f64,
    /// The bits of columns and rows that would reach the goal; none where no number does.
    pub bits: Option<u32>,
}

/// A window as a stream holds it.
#[derive(Debug, Clone, Default)]
pub struct Encoded {
    /// The payload of its first section.
    pub window: Vec<u8>,
    /// The payloads of its parts, each a few components; the most useful come first.
    pub parts: Vec<Vec<u8>>,
    /// The squared error of what a decoder gets, in local units.
    pub squared_error: f64,
    /// The squared error foretold from singular values and steps.
    pub predicted_squared_error: f64,
    /// The squared error of the components alone, were none rounded.
    pub truncation_squared_error: f64,
    /// Bits that say which cluster each vertex is in.
    pub label_bits: f64,
    /// Bits of the frames of reference.
    pub seed_bits: f64,
    /// Bits of steps, sizes and the order of components.
    pub range_bits: f64,
    /// Bits of columns.
    pub basis_bits: f64,
    /// Bits of rows.
    pub coefficient_bits: f64,
    /// Components of each cluster.
    pub components: Vec<usize>,
    /// Number of clusters.
    pub clusters: usize,
    /// Bits of columns and rows: those asked for, or those chosen.
    pub bits: f64,
}

/// Components that are looked for at first; twice as many each further time.
const MODES: usize = 40;
/// Times they are looked for.
const LEVELS: usize = 7;

/// What is known of a window before there is a goal.
#[derive(Debug)]
pub struct Analysis<'a> {
    trajectories: Trajectories<'a>,
    params: Params,
    layout: Layout,
    /// Payload of the layout, and what its parts took.
    head: Vec<u8>,
    spent: Spent,
    /// The local coordinates of each cluster.
    matrices: Vec<Matrix>,
    /// The squared error of the points of frames of reference.
    seed_squared_error: f64,
    /// The largest side of the box around everything.
    side: f64,
    modes: [OnceLock<Vec<Modes>>; LEVELS],
}

impl<'a> Analysis<'a> {
    /// Clusters, frames of reference and local coordinates of a window.
    ///
    /// `triangles` are those of the mesh, none for a cloud; `hierarchy` is that of its edges. Errs with
    /// [`Error::Parameter`] where a parameter is out of its range. Cost: `V N F` for the clusters;
    /// memory for a copy of the positions.
    pub fn new(
        trajectories: Trajectories<'a>,
        triangles: &[[u32; 3]],
        hierarchy: &Hierarchy,
        params: &Params,
    ) -> Result<Self> {
        params.check()?;
        let (lo, side) = bounds(&trajectories);
        let lattice = Lattice {
            lo,
            step: side / 2f64.powi(params.seed_bits as i32),
        };
        let (anchor, given) = arrange(&trajectories, triangles, &lattice, side, params);
        let clusters = given
            .labels
            .iter()
            .max()
            .map_or(1, |most| *most as usize + 1);
        let clusters = clusters.max(given.corners.len());
        let mut writer = Writer::new();
        let frames = trajectories.frames();
        let kind = (anchor, clusters, lattice);
        let coded = Layout::code(
            &mut writer,
            hierarchy,
            frames,
            kind,
            Some(&given),
            Writer::spent,
        );
        let (layout, spent) = coded.map_err(Error::Geometry)?;
        let matrix = |cluster: usize| {
            let (vertices, poses) = (&layout.groups[cluster].vertices, layout.poses(cluster));
            let count = vertices.len();
            let mut values = vec![0.0; 3 * count * frames];
            for (f, pose) in poses.iter().enumerate() {
                for (rank, v) in vertices.iter().enumerate() {
                    let local = pose.local(position(&trajectories, f, *v));
                    for axis in 0..3 {
                        values[(axis * count + rank) * frames + f] = local[axis];
                    }
                }
            }
            Matrix { values, frames }
        };
        let matrices = (0..clusters).into_par_iter().map(matrix).collect();
        let apart = |(i, numbers): (usize, &[i32; 3])| {
            let count = 3 * clusters;
            let v = layout.corners[i % count / 3][i % 3];
            let e = sub(
                lattice.point(*numbers),
                position(&trajectories, i / count, v),
            );
            dot(e, e)
        };
        let seed_squared_error = match anchor {
            Anchor::Triangle => layout.tracks.iter().enumerate().map(apart).sum(),
            _ => 0.0,
        };
        Ok(Analysis {
            trajectories,
            params: *params,
            head: writer.finish(),
            spent,
            matrices,
            seed_squared_error,
            side,
            modes: Default::default(),
            layout,
        })
    }

    /// Bits of the points of frames of reference that suit a squared error, in local units: their step
    /// is about twice what a coordinate is then off by. Finer points cost more than they save in
    /// components.
    pub fn fitting_seed_bits(trajectories: &Trajectories, squared_error: f64) -> u32 {
        let (_, side) = bounds(trajectories);
        let off = (squared_error / (3 * trajectories.positions.len()) as f64).sqrt();
        let bits = (side / (2.0 * off)).log2().round();
        // Also where there is no error or no extent.
        if bits >= 6.0 {
            bits.min(f64::from(Params::MOST_BITS)) as u32
        } else {
            6
        }
    }

    /// Number of clusters there are.
    pub fn clusters(&self) -> usize {
        self.matrices.len()
    }

    /// Whether no triangle could carry a frame of reference although they were asked for.
    pub fn is_without_frames(&self) -> bool {
        self.params.space == Space::Relative && self.layout.anchor != Anchor::Triangle
    }

    /// The cluster of each vertex.
    pub fn labels(&self) -> Vec<u32> {
        let mut labels = vec![0; self.trajectories.vertices];
        for (i, group) in self.layout.groups.iter().enumerate() {
            let corners = self.layout.corners.get(i).into_iter().flatten();
            for v in group.vertices.iter().chain(corners) {
                labels[*v as usize] = i as u32;
            }
        }
        labels
    }

    /// The largest modes of each cluster; more at each level.
    fn modes(&self, level: usize) -> &[Modes] {
        self.modes[level].get_or_init(|| {
            let most = match level + 1 < LEVELS {
                true => MODES << level,
                false => usize::MAX >> 8,
            };
            self.matrices
                .par_iter()
                .map(|matrix| Modes::of(matrix, most))
                .collect()
        })
    }
}

/// A fault of a stream.
fn damaged(what: &str) -> Fault {
    Fault::whole(format!("a window's {what}; damaged"))
}
