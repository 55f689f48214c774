//! What is in a raster of heights, and what looks wrong in it.

use super::Grid;
use crate::report::{Tally, Warning};
use schemars::JsonSchema;
use serde::Serialize;

/// What is in a raster of heights.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Inventory {
    /// Cells along a row.
    pub columns: u64,
    /// Rows.
    pub rows: u64,
    /// In which type heights are held: `i16`, `f32` or `f64`.
    pub sample_type: &'static str,
    /// The outer corner of the first cell.
    pub origin: [f64; 2],
    /// Length of a cell's side along its row, and of the other, in the unit of the map.
    pub cell_size: [f64; 2],
    /// Whether rows go east and the first is the northern one.
    pub north_up: bool,
    /// Smallest and largest coordinates of the outer corners.
    pub extent: [[f64; 2]; 2],
    /// The value of cells without a height, null where there is none.
    pub nodata: Option<f64>,
    /// Cells without a height.
    pub empty: u64,
    /// Lowest height, null where there is none.
    pub min: Option<f64>,
    /// Highest height, null where there is none.
    pub max: Option<f64>,
    /// The mean of all heights, null where there is none.
    pub mean: Option<f64>,
    /// The coordinate reference system, null where the file does not say it.
    pub crs: Option<String>,
    /// Its number in the EPSG registry, where it is known.
    pub epsg: Option<u32>,
    /// Whether places are longitudes and latitudes; null where that is not known.
    pub geographic: Option<bool>,
    #[serde(skip)]
    nameless: Tally,
}

/// Counts what is in a raster. Cost: linear in its cells, in a fixed order.
pub fn inventory(grid: &Grid) -> Inventory {
    let mut nameless = Tally::default();
    let (mut empty, mut sum, mut count) = (0u64, 0.0, 0u64);
    let mut range: Option<[f64; 2]> = None;
    for row in 0..grid.rows {
        let mut of_row = 0.0;
        for column in 0..grid.columns {
            let Some(height) = grid.height(column, row) else {
                empty += 1;
                if grid
                    .nodata
                    .is_none_or(|nodata| grid.stored(column, row) != nodata)
                {
                    nameless.note((row * grid.columns + column) as u64);
                }
                continue;
            };
            let [low, high] = range.unwrap_or([height; 2]);
            range = Some([low.min(height), high.max(height)]);
            of_row += height;
            count += 1;
        }
        sum += of_row;
    }
    let mean = sum / count as f64;
    Inventory {
        columns: grid.columns as u64,
        rows: grid.rows as u64,
        sample_type: grid.samples.sample_type(),
        origin: grid.transform.origin,
        cell_size: grid.transform.cell_size(),
        north_up: grid.transform.is_north_up(),
        extent: grid.extent(),
        nodata: grid.nodata.filter(|value| value.is_finite()),
        empty,
        min: range.map(|[low, _]| low),
        max: range.map(|[_, high]| high),
        mean: mean.is_finite().then_some(mean),
        crs: grid.crs.as_ref().map(|crs| crs.title().to_owned()),
        epsg: grid.crs.as_ref().and_then(|crs| crs.epsg),
        geographic: grid.crs.as_ref().and_then(|crs| crs.is_geographic()),
        nameless,
    }
}

impl Inventory {
    /// What looks wrong.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut once = |holds: bool, code, message: &str| {
            if holds {
                warnings.push(Warning::new(code, message, 1, None));
            }
        };
        once(
            self.crs.is_none(),
            "no-crs",
            "a raster that does not say its coordinate reference system",
        );
        once(
            self.min.is_none(),
            "no-heights",
            "a raster without any height",
        );
        once(
            !self.north_up,
            "turned",
            "a raster that is turned or mirrored, not with the north up",
        );
        let message =
            "cells that are not finite, though none is the value for cells without a height";
        self.nameless.warn("not-finite", message, &mut warnings);
        warnings
    }
}
