//! Inputs at the extremes, and how far the results drift from that of the untouched input.
//!
//! A step changes a mesh, the atoms of a molecule or an animation, so that what becomes of the result is
//! known: it moves along, or stays as it is. Where coordinates had to be rounded, the step says what input it really stands for, so
//! that a fault of the algorithm is told from the rounding of its input.

mod change;
mod drift;
mod motion;
mod spheres;
mod subject;

pub use change::{Changed, Rounding, Step};
pub use drift::{Drift, clip_drift, image_drift, mesh_drift, volume_drift};
pub use motion::Motion;
pub use spheres::sphere_drift;
pub use subject::Subject;

use crate::trade::Change;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// All steps, in the order of the report.
pub fn steps(scales: &[i32], offsets: &[f64]) -> Vec<Step> {
    let scales = scales.iter().map(|exponent| Step::Scale(*exponent));
    let offsets = offsets.iter().map(|extents| Step::Shift(*extents));
    let turns = (0..3).map(Step::QuarterTurn);
    let plain = [
        Change::Turn,
        Change::VertexOrder,
        Change::FaceOrder,
        Change::SplitVertices,
        Change::DuplicateFaces,
        Change::DegenerateFaces,
        Change::Jitter,
    ];
    let plain = plain.map(Step::Plain);
    scales.chain(offsets).chain(turns).chain(plain).collect()
}

/// How far results hold, by the steps that were tried.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Reach {
    /// The largest power of two by which the model can be scaled down; null where not even the first
    /// step holds, or none was tried.
    pub smallest_scale: Option<i32>,
    /// The largest power of two by which it can be scaled up.
    pub largest_scale: Option<i32>,
    /// The largest offset, in extents.
    pub offset: Option<f64>,
}

impl Reach {
    /// The farthest steps of which `holds` is true together with all nearer ones.
    pub fn of(steps: &[(Step, bool)]) -> Reach {
        let farthest = |size: &dyn Fn(Step) -> Option<f64>| {
            let mut tried: Vec<(f64, bool)> = steps
                .iter()
                .filter_map(|(step, holds)| Some((size(*step)?, *holds)))
                .collect();
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
            tried
                .into_iter()
                .take_while(|(_, holds)| *holds)
                .last()
                .map(|(size, _)| size)
        };
        let scale = |sign: f64| {
            let size = move |step| match step {
                Step::Scale(k) if f64::from(k) * sign > 0.0 => Some(f64::from(k) * sign),
                _ => None,
            };
            farthest(&size).map(|size| (size * sign) as i32)
        };
        Reach {
            smallest_scale: scale(-1.0),
            largest_scale: scale(1.0),
            offset: farthest(&|step| match step {
                Step::Shift(extents) => Some(extents),
                _ => None,
            }),
        }
    }
}

impl Step {
    /// Which change it makes.
    pub fn change(self) -> Change {
        match self {
            Step::Scale(_) => Change::Scale,
            Step::Shift(_) => Change::Shift,
            Step::QuarterTurn(_) => Change::QuarterTurn,
            Step::Plain(change) => change,
        }
    }

    /// How much of it, for people: `2^-100`, `1e9 extents`, `about x`.
    pub fn amount(self) -> String {
        match self {
            Step::Scale(exponent) => format!("2^{exponent}"),
            Step::Shift(extents) => format!("{extents:e} extents"),
            Step::QuarterTurn(axis) => format!("about {}", ["x", "y", "z"][axis.min(2)]),
            Step::Plain(_) => String::new(),
        }
    }
}

#[cfg(test)]
mod tests;
