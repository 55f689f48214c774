//! What both sides know before the first component: frames of reference and who is in which cluster.

use super::labels;
use super::pose::Pose;
use super::tracks::{self, Lattice};
use crate::anim::compress::coder::Coder;
use crate::anim::compress::hierarchy::Hierarchy;
use crate::error::Fault;
use rayon::prelude::*;

/// What a cluster's frame of reference is fixed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Nothing: it stands still at the corner of the box around everything.
    World,
    /// The centroid of all vertices; it does not turn.
    Centroid,
    /// Three vertices.
    Triangle,
}

impl Anchor {
    /// Points that are followed for each cluster.
    pub fn points(self) -> usize {
        match self {
            Anchor::World => 0,
            Anchor::Centroid => 1,
            Anchor::Triangle => 3,
        }
    }
}

/// The vertices of a cluster that its frame of reference does not hold.
#[derive(Debug, Clone)]
pub struct Group {
    /// Its vertices from coarse to fine.
    pub vertices: Vec<u32>,
    /// The cluster as a mesh of its own.
    pub hierarchy: Hierarchy,
}

impl Group {
    /// Rows of its matrix: row `axis * vertices + rank`.
    pub fn rows(&self) -> usize {
        3 * self.vertices.len()
    }
}

/// Frames of reference and clusters.
#[derive(Debug, Clone)]
pub struct Layout {
    /// What frames of reference are fixed to.
    pub anchor: Anchor,
    /// Frames of the window.
    pub frames: usize,
    /// The corners of each cluster's triangle, where it has one.
    pub corners: Vec<[u32; 3]>,
    /// The clusters.
    pub groups: Vec<Group>,
    /// The points that are followed, as numbers of the lattice: point `t` of frame `f` is at
    /// `f * points + t`.
    pub tracks: Vec<[i32; 3]>,
    /// The lattice.
    pub lattice: Lattice,
}

/// Bits that the parts of a layout take.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spent {
    /// Who is in which cluster.
    pub labels: f64,
    /// The frames of reference.
    pub tracks: f64,
}

/// What a layout is made of, before it is coded.
#[derive(Debug, Clone)]
pub struct Given {
    /// The cluster of each vertex.
    pub labels: Vec<u32>,
    /// The corners of each cluster's triangle.
    pub corners: Vec<[u32; 3]>,
    /// The numbers of the points that are followed.
    pub tracks: Vec<[i32; 3]>,
}

impl Layout {
    /// Codes a layout; `clusters` and `lattice` are known, and `given` where it is not read.
    ///
    /// `spent` says what a coder has spent up to now.
    pub fn code<C: Coder>(
        coder: &mut C,
        hierarchy: &Hierarchy,
        frames: usize,
        (anchor, clusters, lattice): (Anchor, usize, Lattice),
        given: Option<&Given>,
        spent: impl Fn(&C) -> f64,
    ) -> Result<(Layout, Spent), Fault> {
        let vertices = hierarchy.len();
        let before = spent(coder);
        let mut corners = Vec::new();
        if anchor == Anchor::Triangle {
            let bits = usize::BITS - (vertices - 1).leading_zeros();
            for i in 0..clusters {
                let own = given.map_or([0; 3], |given| given.corners[i]);
                corners.push(own.map(|v| coder.number(u64::from(v), bits) as u32));
            }
            if let Some(v) = corners.iter().flatten().find(|v| **v as usize >= vertices) {
                let problem = format!("a frame is fixed to vertex {v} of {vertices}; damaged");
                return Err(Fault::whole(problem));
            }
        }
        let ids = spent(coder);
        let known: Vec<(u32, u32)> = corners
            .iter()
            .zip(0..)
            .flat_map(|(corners, i)| corners.map(|v| (v, i)))
            .collect();
        let own = given.map(|given| given.labels.as_slice());
        let labels = labels::code(coder, hierarchy, clusters, &known, own);
        let labelled = spent(coder);
        let points = anchor.points() * clusters;
        let tracks = match points {
            0 => Vec::new(),
            _ => {
                let own = given.map(|given| given.tracks.as_slice());
                tracks::code(coder, frames, points, anchor.points(), own)
            }
        };
        let groups = groups(hierarchy, &labels, &corners, clusters)?;
        let layout = Layout {
            anchor,
            frames,
            corners,
            groups,
            tracks,
            lattice,
        };
        let spent = Spent {
            labels: labelled - ids,
            tracks: ids - before + spent(coder) - labelled,
        };
        Ok((layout, spent))
    }

    /// The poses of a cluster over the frames, as a decoder has them.
    pub fn poses(&self, cluster: usize) -> Vec<Pose> {
        let each = self.anchor.points();
        let count = each * self.groups.len();
        let point = |frame: usize, i: usize| {
            self.lattice
                .point(self.tracks[frame * count + cluster * each + i])
        };
        match self.anchor {
            Anchor::World => {
                let pose = Pose {
                    origin: self.lattice.lo,
                    ..Pose::WORLD
                };
                vec![pose; self.frames]
            }
            Anchor::Centroid => {
                let at = |frame| Pose {
                    origin: point(frame, 0),
                    ..Pose::WORLD
                };
                (0..self.frames).map(at).collect()
            }
            Anchor::Triangle => {
                let corners = |frame| std::array::from_fn(|i| point(frame, i));
                Pose::follow((0..self.frames).map(corners))
            }
        }
    }
}

/// The clusters without the corners of their triangles.
fn groups(
    hierarchy: &Hierarchy,
    labels: &[u32],
    corners: &[[u32; 3]],
    clusters: usize,
) -> Result<Vec<Group>, Fault> {
    const NONE: u32 = u32::MAX;
    let mut place = vec![0u32; labels.len()];
    for v in corners.iter().flatten() {
        place[*v as usize] = NONE;
    }
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); clusters];
    for (v, label) in labels.iter().enumerate() {
        if place[v] != NONE {
            let members = &mut members[*label as usize];
            place[v] = members.len() as u32;
            members.push(v as u32);
        }
    }
    let mut rank = vec![0u32; labels.len()];
    for (r, v) in hierarchy.vertices.iter().enumerate() {
        rank[*v as usize] = r as u32;
    }
    let group = |members: Vec<u32>| {
        let edges = members.iter().enumerate().flat_map(|(i, v)| {
            let near = hierarchy.neighbours.of(rank[*v as usize] as usize).iter();
            let near = near.map(|u| hierarchy.vertices[*u as usize]);
            let own = near.filter(|u| {
                place[*u as usize] != NONE && labels[*u as usize] == labels[*v as usize]
            });
            own.map(|u| place[u as usize])
                .filter(move |j| *j < i as u32)
                .map(move |j| [i as u32, j])
        });
        let hierarchy = Hierarchy::new(members.len(), edges)?;
        let vertices = hierarchy
            .vertices
            .iter()
            .map(|i| members[*i as usize])
            .collect();
        Ok(Group {
            vertices,
            hierarchy,
        })
    };
    let made: Result<_, crate::error::Error> = members.into_par_iter().map(group).collect();
    made.map_err(|error| Fault::whole(error.to_string()))
}
