//! Values that are no finite numbers.

use super::{Data, Frame, Volume};
use crate::error::Fault;
use crate::report::{Tally, Warning};
use rayon::prelude::*;

/// Values that one thread looks at at a time.
const CHUNK: usize = 1 << 16;

impl Volume {
    /// The values that are no numbers. Voxels count from 0, x fastest. Cost: a pass over real numbers, and
    /// nothing for all other samples.
    pub fn not_numbers(&self) -> Tally {
        self.tally(f64::is_nan)
    }

    /// The values that are infinite, counted as [`Volume::not_numbers`] counts.
    pub fn infinities(&self) -> Tally {
        self.tally(f64::is_infinite)
    }

    /// Refuses values that are no numbers: they are neither inside nor outside of anything. Names the first.
    pub fn check_numbers(&self) -> Result<(), Fault> {
        let Some(first) = self.not_numbers().first() else {
            return Ok(());
        };
        let voxel = voxel_of(&self.frame, first);
        let problem = format!("the value at {voxel:?} is not a number");
        Err(Fault::element("voxel", first as usize, problem))
    }

    /// What looks wrong with its values. Cost: as [`Volume::not_numbers`], twice.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        for (code, what, found) in [
            ("not-a-number", "not numbers", self.not_numbers()),
            ("infinite-values", "infinite", self.infinities()),
        ] {
            if let Some(first) = found.first() {
                let voxel = voxel_of(&self.frame, first);
                let message = format!("values that are {what}, the first at {voxel:?}");
                found.warn(code, message, &mut warnings);
            }
        }
        warnings
    }

    fn tally(&self, is_one: fn(f64) -> bool) -> Tally {
        match &self.data {
            Data::F32(values) => tally(values, is_one),
            Data::F64(values) => tally(values, is_one),
            _ => Tally::default(),
        }
    }
}

fn tally<T: Copy + Into<f64> + Sync>(values: &[T], is_one: fn(f64) -> bool) -> Tally {
    let in_chunk = |(chunk, values): (usize, &[T])| {
        let mut found = Tally::default();
        for (i, value) in values.iter().enumerate() {
            if is_one((*value).into()) {
                found.note((chunk * CHUNK + i) as u64);
            }
        }
        found
    };
    let parts: Vec<Tally> = values.par_chunks(CHUNK).enumerate().map(in_chunk).collect();
    let mut all = Tally::default();
    parts.into_iter().for_each(|part| all.add(part));
    all
}

/// Where in the grid the voxel of an index is.
fn voxel_of(frame: &Frame, index: u64) -> [u64; 3] {
    let [nx, ny, _] = frame.dims.map(|n| n as u64);
    [index % nx, index / nx % ny, index / (nx * ny)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(data: Data) -> Volume {
        Volume {
            frame: Frame::straight([50, 40, 60], [0.0; 3], [1.0; 3]),
            data,
        }
    }

    #[test]
    fn values_that_are_no_numbers_are_counted_and_the_first_is_named() {
        let mut values = vec![0.5f32; 50 * 40 * 60];
        // The second is in another chunk than the first.
        for at in [3 * 2000 + 7 * 50 + 21, 119_999] {
            values[at] = f32::NAN;
        }
        values[100_000] = f32::NEG_INFINITY;
        let wide = values.iter().map(|v| f64::from(*v)).collect();
        for volume in [volume(Data::F32(values)), volume(Data::F64(wide))] {
            assert_eq!(
                volume.warnings(),
                [
                    Warning::new(
                        "not-a-number",
                        "values that are not numbers, the first at [21, 7, 3]",
                        2,
                        Some(6371)
                    ),
                    Warning::new(
                        "infinite-values",
                        "values that are infinite, the first at [0, 0, 50]",
                        1,
                        Some(100_000)
                    ),
                ]
            );
            let refused = volume.check_numbers().expect_err("a value is no number");
            assert_eq!(
                refused.to_string(),
                "voxel 6371: the value at [21, 7, 3] is not a number"
            );
        }
    }

    #[test]
    fn nothing_is_wrong_with_finite_and_with_whole_numbers() {
        for data in [
            Data::F32(vec![f32::MAX; 120_000]),
            Data::F64(vec![f64::MIN; 120_000]),
            Data::U8(vec![255; 120_000]),
        ] {
            let volume = volume(data);
            assert!(volume.warnings().is_empty());
            assert!(volume.check_numbers().is_ok());
        }
    }
}
