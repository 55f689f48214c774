//! Normals and spacings of a cloud, given or estimated.

use super::params::{Orient, Params};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, dot, normalize, scale};
use crate::points::normals::{Neighbourhoods, disagreement, planes, spacings};
use crate::points::order::Ordered;
use crate::points::orient::{Parts, by_tree, connected, to_viewpoint, upwards};
use crate::progress::Progress;
use crate::spatial::kdtree::KdTree;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// The share of neighbours that may point the other way before given normals are turned.
const DISAGREE: f64 = 0.1;

/// Where normals are from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// As given.
    Given,
    /// As given, some turned to the other side.
    Reoriented,
    /// From neighbours.
    Estimated,
}

/// What normals were found.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NormalStats {
    /// Where they are from.
    pub origin: Origin,
    /// Estimated ones, where some were given as zero.
    pub filled: u64,
    /// Share of neighbours whose given normals point the other way; null where none are given.
    pub disagreement: Option<f64>,
    /// Parts of the cloud that are not connected by neighbours.
    pub islands: u64,
    /// Those whose outside followed that of a larger one beside them.
    pub islands_joined: u64,
}

/// What discs are grown from.
pub struct Prepared {
    /// Unit normals; zero where there is none.
    pub normals: Vec<Vec3>,
    /// The side of the square that each point stands for.
    pub spacings: Vec<f64>,
    /// What normals were found.
    pub stats: NormalStats,
}

/// Normals and spacings of the ordered points.
pub fn prepare(
    cloud: &Mesh,
    ordered: &Ordered,
    tree: &KdTree,
    near: &Neighbourhoods,
    params: &Params,
    progress: &dyn Progress,
) -> Prepared {
    let points = &ordered.points;
    progress.stage("normals", 0);
    let given: Option<Vec<Vec3>> = cloud.normals.as_ref().map(|normals| {
        let of = |s: &u32| normalize(normals[*s as usize]);
        ordered.sources.par_iter().map(of).collect()
    });
    let whole = given
        .as_ref()
        .is_some_and(|normals| !normals.contains(&[0.0; 3]));
    let (mut normals, spacings, filled) = match given {
        Some(normals) if whole => (normals, spacings(points, near), 0),
        given => {
            let planes = planes(tree, points, near);
            let spacings = planes.iter().map(|p| p.spacing).collect();
            let estimated = planes.into_iter().map(|p| p.normal);
            match given {
                None => (estimated.collect(), spacings, 0),
                Some(given) => {
                    let (normals, filled) = fill(given, estimated, near);
                    (normals, spacings, filled)
                }
            }
        }
    };
    progress.stage("orient", 0);
    let given = cloud.normals.is_some();
    let disagreement = given.then(|| disagreement(points, &normals, near));
    let trusted = given && (params.trust_normals || params.orient == Orient::Keep);
    let turned = !trusted
        && match (params.orient, disagreement) {
            (Orient::Mst, Some(share)) => share > DISAGREE,
            _ => true,
        };
    let parts = if turned {
        turn(ordered, tree, &mut normals, near, params.orient)
    } else {
        connected(&normals, near)
    };
    Prepared {
        normals,
        spacings,
        stats: NormalStats {
            origin: match (given, turned) {
                (false, _) => Origin::Estimated,
                (true, true) => Origin::Reoriented,
                (true, false) => Origin::Given,
            },
            filled,
            disagreement,
            islands: parts.count,
            islands_joined: parts.joined,
        },
    }
}

/// Given normals, and where they are zero estimated ones on the side of the nearest that is given.
fn fill(
    given: Vec<Vec3>,
    estimated: impl Iterator<Item = Vec3>,
    near: &Neighbourhoods,
) -> (Vec<Vec3>, u64) {
    let mut filled = 0;
    let mut normals = given.clone();
    for (i, plane) in estimated.enumerate() {
        if given[i] != [0.0; 3] || plane == [0.0; 3] {
            continue;
        }
        let model = near.row(i).iter().map(|j| given[*j as usize]);
        let against = model
            .map(|n| dot(n, plane))
            .find(|d| *d != 0.0)
            .is_some_and(|d| d < 0.0);
        normals[i] = if against { scale(plane, -1.0) } else { plane };
        filled += 1;
    }
    (normals, filled)
}

fn turn(
    ordered: &Ordered,
    tree: &KdTree,
    normals: &mut [Vec3],
    near: &Neighbourhoods,
    orient: Orient,
) -> Parts {
    match orient {
        Orient::Mst => return by_tree(tree, &ordered.points, normals, near),
        Orient::Viewpoint(place) => {
            to_viewpoint(&ordered.points, normals, ordered.local.to_local(place));
        }
        Orient::Keep => upwards(normals),
    }
    connected(normals, near)
}
