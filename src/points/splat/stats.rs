//! What covering a cloud found.

use super::prepare::NormalStats;
use crate::report::Warning;
use schemars::JsonSchema;
use serde::Serialize;

/// Most rows of the histogram of radii.
const ROWS: usize = 24;

/// The bound that was asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Delta {
    /// In the cloud's unit.
    pub abs: f64,
    /// As a share of the diagonal; null where that is 0.
    pub diag: Option<f64>,
}

/// The radii.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Radius {
    /// The smallest, in the cloud's unit; null where there is no disc.
    pub min: Option<f64>,
    /// The one in the middle; the larger of two.
    pub median: Option<f64>,
    /// The largest.
    pub max: Option<f64>,
    /// How many there are, by powers of two below the largest, small ones first.
    pub histogram: Vec<Bin>,
}

/// Radii of one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Bin {
    /// The largest that is counted here; those up to the row before are not.
    pub up_to: f64,
    /// How many.
    pub count: u64,
}

impl Radius {
    pub(super) fn of(mut radii: Vec<f64>) -> Self {
        radii.sort_unstable_by(f64::total_cmp);
        let Some(&max) = radii.last() else {
            return Radius::default();
        };
        let mut histogram = Vec::new();
        let mut rest = &radii[..];
        let mut up_to = max;
        while !rest.is_empty() {
            // All that is smaller is in the last row.
            let last = histogram.len() + 1 == ROWS;
            let below = if last {
                0
            } else {
                rest.partition_point(|r| *r <= 0.5 * up_to)
            };
            let count = (rest.len() - below) as u64;
            histogram.push(Bin { up_to, count });
            rest = &rest[..below];
            up_to *= 0.5;
        }
        histogram.reverse();
        Radius {
            min: radii.first().copied(),
            median: Some(radii[radii.len() / 2]),
            max: Some(max),
            histogram,
        }
    }
}

/// The largest height of a covered point, over all discs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Heights {
    /// The largest, in the cloud's unit; above the bound where a first ring is.
    pub max: f64,
    /// The mean.
    pub mean: f64,
    /// The root of the mean square.
    pub rms: f64,
}

impl Heights {
    pub(super) fn of(errors: impl Iterator<Item = f64> + Clone) -> Self {
        let count = errors.clone().count().max(1) as f64;
        let max = errors.clone().fold(0.0, f64::max);
        if max == 0.0 {
            return Heights::default();
        }
        // Shares of the largest, as squares may over- or underflow.
        let squares: f64 = errors.clone().map(|e| (e / max) * (e / max)).sum();
        Heights {
            max,
            mean: errors.map(|e| e / max).sum::<f64>() / count * max,
            rms: (squares / count).sqrt() * max,
        }
    }
}

/// What covering a cloud found.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Points as given.
    pub points: u64,
    /// Points left out because another lies in the same place.
    pub duplicates: u64,
    /// Points left out because they and their neighbours lie on a line, which has no normal.
    pub lines: u64,
    /// Discs.
    pub splats: u64,
    /// Discs over points.
    pub ratio: f64,
    /// The bound that was asked for.
    pub delta: Delta,
    /// Neighbours that normals were estimated from.
    pub k: u64,
    /// Points whose normals the mean disc covers.
    pub covered_mean: f64,
    /// The radii.
    pub radius: Radius,
    /// The largest heights over the discs.
    pub error: Heights,
    /// Discs that ended at the largest radius.
    pub capped: u64,
    /// Discs whose first ring is higher than the bound: it is below the noise there.
    pub oversized_first_ring: u64,
    /// Points far from all others for the distances of those.
    pub isolated: u64,
    /// Where normals are from.
    pub normals: NormalStats,
    /// Root mean square of the angle between the fields and the normals they were fitted to, in degrees.
    pub field_rms_deg: f64,
    /// Bytes of positions and normals of all points, in memory.
    pub bytes_before: u64,
    /// Bytes of the discs, in memory.
    pub bytes_after: u64,
}

impl Stats {
    /// What looks wrong but could be worked with.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut warn = |code, count: u64, message: String| {
            if count > 0 {
                warnings.push(Warning::new(code, message, count, None));
            }
        };
        warn(
            "duplicate-points",
            self.duplicates,
            "points lie where another does and are left out".to_owned(),
        );
        warn(
            "points-on-lines",
            self.lines,
            "points lie on a line with their neighbours, have no normal and are not covered"
                .to_owned(),
        );
        warn(
            "isolated-points",
            self.isolated,
            "points are far from all others and have a small disc of their own".to_owned(),
        );
        if 2 * self.oversized_first_ring > self.splats {
            let bound = crate::error::number(self.delta.abs);
            let message = format!(
                "discs of more than half cannot keep the bound of {bound} with their \
                 first ring: the noise is higher; raise --delta"
            );
            warn("noise-over-delta", self.oversized_first_ring, message);
        }
        if self.splats == 1 && self.radius.max == Some(0.0) {
            let message = "all points lie in one place, which is a disc of radius 0";
            warn("one-place", 1, message.to_owned());
        }
        if self.normals.origin == super::Origin::Reoriented {
            let share = 100.0 * self.normals.disagreement.unwrap_or_default();
            let message =
                format!("given normals were turned: {share:.1} % of neighbours disagreed");
            warn("normals-turned", 1, message);
        }
        warn(
            "zero-normals",
            self.normals.filled,
            "given normals are zero; they were estimated".to_owned(),
        );
        warnings
    }
}
