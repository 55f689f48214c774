//! In which voxels two volumes differ.

use crate::error::{Error, Fault, Result, number};
use crate::numeric::vector::{Vec3, add, cross, dot, length, scale, sub};
use crate::progress::Progress;
use crate::report::{Accuracy, Warning};
use crate::volume::{Frame, Volume};
use schemars::JsonSchema;
use serde::Serialize;

mod bits;
mod samples;

/// Frames closer than this, in voxels, are the same up to the roundings of text formats.
const SAME_PLACE: f64 = 1e-6;

/// How two volumes are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Params {
    /// Volumes of whole numbers with more different values than this are compared as amounts
    /// alone, others label by label too.
    pub labels: u32,
}

impl Params {
    /// As many labels as 16 bits hold.
    pub const DEFAULT: Params = Params { labels: 1 << 16 };

    /// Errors when a value is out of its range.
    pub fn check(&self) -> Result<()> {
        if self.labels > 1 << 24 {
            return Err(Error::parameter(
                "labels",
                self.labels,
                "must be at most 16777216",
            ));
        }
        Ok(())
    }
}

impl Default for Params {
    fn default() -> Self {
        Params::DEFAULT
    }
}

/// How two volumes differ. Voxels are named by their indices along x, y and z, from 0.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct VolumeDifference {
    /// Whether the frames are the same bit for bit and no voxel differs.
    pub identical: bool,
    /// Voxels along x, y, z, of both.
    pub dims: [u64; 3],
    /// Type of a voxel of the first volume.
    pub sample_type_a: String,
    /// Type of a voxel of the second volume.
    pub sample_type_b: String,
    /// How far the first voxels are apart, in steps of the first volume's grid along its axes.
    pub origin_difference: f64,
    /// How much farther apart that makes another voxel: what the axes differ by, at the far end.
    pub axes_difference: f64,
    /// Voxels of either volume.
    pub voxels: u64,
    /// Voxels with different values.
    pub differing: u64,
    /// `differing / voxels`; 0 where there is none.
    pub share: f64,
    /// The first voxel that differs, x fastest.
    pub first: Option<[u64; 3]>,
    /// How well each label agrees, by label; null where values are not whole numbers or are too
    /// many. The labels of bits are 0 and 1.
    pub labels: Option<Vec<LabelOverlap>>,
    /// How much values differ; null for two volumes of bits.
    pub amounts: Option<Amounts>,
}

/// How well one label agrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct LabelOverlap {
    /// The value.
    pub label: i128,
    /// Voxels of the first volume that have it.
    pub a: u64,
    /// Voxels of the second volume that have it.
    pub b: u64,
    /// Voxels that have it in both.
    pub both: u64,
    /// Voxels that have it in the first alone.
    pub only_a: u64,
    /// Voxels that have it in the second alone.
    pub only_b: u64,
    /// `2 both / (a + b)` (Dice 1945).
    pub dice: f64,
    /// `both / (a + b - both)` (Jaccard 1912).
    pub jaccard: f64,
}

impl LabelOverlap {
    /// One of the counts is not 0.
    fn new(label: i128, [a, b, both]: [u64; 3]) -> Self {
        LabelOverlap {
            label,
            a,
            b,
            both,
            only_a: a - both,
            only_b: b - both,
            dice: 2.0 * both as f64 / (a + b) as f64,
            jaccard: both as f64 / (a + b - both) as f64,
        }
    }
}

/// How much values differ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Amounts {
    /// The largest difference.
    pub max: f64,
    /// The first voxel that has it; null where none differs.
    pub max_at: Option<[u64; 3]>,
    /// Mean of the absolute differences of all voxels.
    pub mean: f64,
    /// Root mean square of the differences of all voxels.
    pub rms: f64,
    /// Voxels that differ by no finite number: one is not a number or infinite. They are left out
    /// of the figures above.
    pub undefined: u64,
}

impl VolumeDifference {
    /// What the number of differing voxels does not tell: that the grids are not at the same place,
    /// so that no voxel is where the other volume has it.
    pub fn beyond_measure(&self) -> Option<String> {
        let [origins, axes] = [self.origin_difference, self.axes_difference];
        // Written so that a difference which is no number counts too.
        let same = origins <= SAME_PLACE && axes <= SAME_PLACE;
        let [origins, axes] = [origins, axes].map(number);
        (!same).then(|| {
            format!(
                "the grids are not at the same place: origins differ by {origins} voxels, axes by {axes} voxels at the far end"
            )
        })
    }

    /// What looks wrong, as warnings for a report.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if let Some(why) = self.beyond_measure() {
            let message = format!("{why}; voxels are compared by index");
            warnings.push(Warning::new("frames-differ", message, 1, None));
        }
        if let Some(undefined) = self.amounts.map(|a| a.undefined).filter(|n| *n > 0) {
            let message = "voxels differ by no finite number";
            warnings.push(Warning::new(
                "undefined-differences",
                message,
                undefined,
                None,
            ));
        }
        warnings
    }

    /// The number of differing voxels, as the accuracy of a report.
    pub fn accuracy(&self) -> Accuracy {
        Accuracy {
            measure: "differing voxels".to_owned(),
            unit: "voxel".to_owned(),
            bound: Some(self.differing as f64),
            reached: Some(self.differing as f64),
            reference: "every voxel".to_owned(),
            verified: true,
        }
    }
}

/// Compares two volumes voxel by voxel.
///
/// Values are compared exactly, whatever their types, but for whole numbers beyond 2^53 against
/// fractions. Errors when the numbers of voxels along an axis differ, or a volume is not what
/// [`Volume::check`] promises. Cost: O(voxels); some slices of a sparse volume are expanded at a
/// time, never all.
pub fn compare(
    a: &Volume,
    b: &Volume,
    params: &Params,
    progress: &dyn Progress,
) -> Result<VolumeDifference> {
    params.check()?;
    for (name, volume) in [("A", a), ("B", b)] {
        volume.check().map_err(|fault| {
            Error::Geometry(Fault {
                problem: format!("volume {name}: {}", fault.problem),
                ..fault
            })
        })?;
    }
    let dims = a.frame.dims;
    if dims != b.frame.dims {
        let name = |[x, y, z]: [usize; 3]| format!("{x} x {y} x {z}");
        let problem = format!(
            "volume A has {} voxels, volume B has {}",
            name(dims),
            name(b.frame.dims)
        );
        let hint = "only volumes of the same dimensions can be compared: make both with the same resolution or spacing";
        return Err(Error::Geometry(Fault::whole(problem).with_hint(hint)));
    }
    progress.stage("compare", dims[2] as u64);
    let found = if a.is_binary() && b.is_binary() {
        bits::compare(a, b, progress)
    } else {
        samples::compare(a, b, params.labels as usize, progress)
    };
    let (origin_difference, axes_difference) = frame_difference(&a.frame, &b.frame);
    let voxels = a.frame.len() as u64;
    Ok(VolumeDifference {
        identical: found.differing == 0 && a.frame == b.frame,
        dims: dims.map(|d| d as u64),
        sample_type_a: a.data.sample_type().to_owned(),
        sample_type_b: b.data.sample_type().to_owned(),
        origin_difference,
        axes_difference,
        voxels,
        differing: found.differing,
        share: found.differing as f64 / voxels.max(1) as f64,
        first: found.first.map(|at| place(at, dims)),
        labels: found.labels,
        amounts: found.amounts,
    })
}

/// What the voxels alone say.
struct Found {
    differing: u64,
    /// Position of the first, x fastest.
    first: Option<usize>,
    labels: Option<Vec<LabelOverlap>>,
    amounts: Option<Amounts>,
}

/// The indices of the voxel at a position, x fastest.
fn place(at: usize, [nx, ny, _]: [usize; 3]) -> [u64; 3] {
    [at % nx, at / nx % ny, at / nx / ny].map(|i| i as u64)
}

/// How far the origins are apart, and how far the axes alone move the voxel they move most, both
/// as the largest number of steps along an axis of `a`.
fn frame_difference(a: &Frame, b: &Frame) -> (f64, f64) {
    let steps = |gap: Vec3| {
        // Lengths are divided out before products are made: spacings may be tiny or huge.
        let unit = a.axes.map(crate::numeric::vector::normalize);
        let along = |i: usize| {
            let normal = cross(unit[(i + 1) % 3], unit[(i + 2) % 3]);
            let local = gap.map(|c| c / length(a.axes[i]));
            (dot(local, normal) / dot(unit[i], normal)).abs()
        };
        along(0).max(along(1)).max(along(2))
    };
    let origin = steps(sub(b.origin, a.origin));
    let corner = |corner: usize| {
        (0..3)
            .filter(|i| corner >> i & 1 == 1)
            .fold([0.0; 3], |at, i| {
                let last = a.dims[i].saturating_sub(1) as f64;
                add(at, scale(sub(b.axes[i], a.axes[i]), last))
            })
    };
    let axes = (1..8).map(|c| steps(corner(c))).fold(0.0, f64::max);
    (origin, axes)
}

#[cfg(test)]
mod tests;
