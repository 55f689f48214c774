//! What the voxels hold: where a level is met, which values there are, and which are inside.

use super::{Select, Surface, axis_of};
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Volume};
use crate::with_samples;
use rayon::prelude::*;

/// How far each vertex lies from the middle of its edge, in voxels along it, where `level` is met by
/// linear interpolation; 0 where the edge leaves the volume. Cost: two values a vertex.
pub fn at_level(volume: &Volume, surface: &Surface, level: f64) -> Vec<f64> {
    let [nx, ny, nz] = volume.frame.dims;
    let value = |p: [i32; 3]| -> Option<f64> {
        let [x, y, z] = p.map(|c| usize::try_from(c).ok());
        let (x, y, z) = (x?, y?, z?);
        if x >= nx || y >= ny || z >= nz {
            return None;
        }
        let at = (z * ny + y) * nx + x;
        Some(
            with_samples!(&volume.data, v => v[at] as f64, bits => match bits {
                Data::Bits(grid) => f64::from(u8::from(grid.get(x, y, z))),
                Data::Sparse(tree) => f64::from(u8::from(tree.get(x, y, z))),
                _ => 0.0,
            }),
        )
    };
    let meets = |place: &[i32; 3]| {
        let axis = axis_of(*place);
        let mut low = place.map(|c| c.div_euclid(2));
        let a = value(low)?;
        low[axis] += 1;
        let b = value(low)?;
        let t = (level - a) / (b - a);
        t.is_finite().then(|| t.clamp(0.0, 1.0) - 0.5)
    };
    surface
        .places
        .par_iter()
        .with_min_len(1 << 12)
        .map(|place| meets(place).unwrap_or(0.0))
        .collect()
}

/// The different values of a volume, ascending; `None` where there are more than `most`, or one is no
/// number. Cost: one pass.
pub fn values(volume: &Volume, most: usize) -> Option<Vec<f64>> {
    let mut found: Vec<f64> = Vec::new();
    let mut last = f64::NAN;
    let mut add = |value: f64| {
        if value == last {
            return true;
        }
        last = value;
        match found.binary_search_by(|v| v.total_cmp(&value)) {
            Ok(_) => true,
            Err(at) => {
                found.insert(at, value);
                found.len() <= most && !value.is_nan()
            }
        }
    };
    let all = with_samples!(&volume.data, v => v.iter().all(|value| add(*value as f64)), _ => {
        add(0.0) && add(1.0)
    });
    all.then_some(found)
}

/// What is inside, as bits.
pub fn inside(volume: &Volume, select: &Select) -> BitGrid {
    let dims = volume.frame.dims;
    let mut all = BitGrid::new(dims);
    let slice = all.stride() * dims[1];
    if slice > 0 {
        all.words_mut()
            .par_chunks_mut(slice)
            .enumerate()
            .for_each(|(z, out)| {
                let mut bits = BitGrid::new([dims[0], dims[1], 1]);
                select.read(volume, z, &mut bits);
                out.copy_from_slice(bits.words());
            });
    }
    all
}
