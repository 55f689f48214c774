//! Images and arrays as heights, where it is said how large their cells are.

use super::refusal::{RAISE, Refusal, expect_room};
use super::world;
use crate::error::Fault;
use crate::image::samples::{Image, Samples as Pixels};
use crate::terrain::{Grid, Samples, Transform};
use crate::volume::Volume;
use crate::with_samples;

/// The grey of an image as heights, in cells of a size from the lower left at the origin.
///
/// `cell` is their width and height; none puts cells of size 1. Errs for an image of colours.
pub fn of_image(image: &Image, cell: Option<[f64; 2]>) -> Result<Grid, Fault> {
    if image.channels != 1 {
        let problem = format!("has {} channels, but heights are of one", image.channels);
        return Err(Fault::whole(problem));
    }
    let samples = match &image.samples {
        Pixels::Eight(all) => Samples::I16(all.iter().map(|v| i16::from(*v)).collect()),
        Pixels::Sixteen(all) => Samples::F32(all.iter().map(|v| f32::from(*v)).collect()),
    };
    Ok(placed(image.width, image.height, samples, cell))
}

/// An array of two axes as heights, its first row in the north; as [`of_image`].
///
/// Errs where there are several slices, or no room for a copy.
pub fn of_volume(volume: &Volume, cell: Option<[f64; 2]>, limit: u64) -> Result<Grid, Refusal> {
    let [columns, rows, slices] = volume.frame.dims;
    if slices != 1 {
        let problem = format!("has {slices} slices, but heights are of one");
        return Err(Fault::whole(problem).into());
    }
    let needed = 12 * columns as u128 * rows as u128;
    expect_room(
        || format!("{columns} x {rows} heights"),
        needed,
        limit,
        RAISE,
    )?;
    let bits = || Fault::whole("holds bits, but heights are numbers");
    let values: Vec<f64> = with_samples!(&volume.data, v => v.iter().map(|s| *s as f64).collect(), _ => {
        return Err(bits().into());
    });
    let samples = Samples::narrowest(values);
    Ok(placed(columns, rows, samples, cell))
}

fn placed(columns: usize, rows: usize, samples: Samples, cell: Option<[f64; 2]>) -> Grid {
    let transform = cell.map_or(world::of_cells(rows), |[wide, high]| {
        Transform::north_up([0.0, rows as f64 * high], [wide, high])
    });
    Grid {
        columns,
        rows,
        transform,
        samples,
        nodata: None,
        crs: None,
    }
}
