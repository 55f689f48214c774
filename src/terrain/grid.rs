//! Heights on a raster of places.

use crate::error::{Fault, number};
use crate::report;
use crate::vector::Vec2;
use crate::vector::crs::Crs;

/// Heights at the centres of the cells of a raster.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Cells along a row.
    pub columns: usize,
    /// Rows, the first is the first in the file: the northern one where the raster is not turned.
    pub rows: usize,
    /// Where the cells are.
    pub transform: Transform,
    /// Heights, row by row.
    pub samples: Samples,
    /// The value of cells without a height; a NaN never is one.
    pub nodata: Option<f64>,
    /// What places mean; none where the file does not say.
    pub crs: Option<Crs>,
}

/// Heights as the file has them.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Whole numbers of 16 bits.
    I16(Vec<i16>),
    /// Single precision; all that is exact in it.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

/// Where cells are: the corner of cell `(column, row)` that is first in the file is at
/// `origin + column * across + row * down`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// The outer corner of the first cell.
    pub origin: Vec2,
    /// The step from a cell to the next in its row.
    pub across: Vec2,
    /// The step from a row to the next.
    pub down: Vec2,
}

impl Transform {
    /// The place of a point of the raster, in cells from the outer corner of the first.
    #[inline]
    pub fn place(&self, column: f64, row: f64) -> Vec2 {
        std::array::from_fn(|a| self.origin[a] + (column * self.across[a] + row * self.down[a]))
    }

    /// Whether rows go east and the next row is south, as on most maps.
    pub fn is_north_up(&self) -> bool {
        self.across[0] > 0.0 && self.across[1] == 0.0 && self.down[0] == 0.0 && self.down[1] < 0.0
    }
}

impl Grid {
    /// The height of a cell; none where it has none.
    #[inline]
    pub fn height(&self, column: usize, row: usize) -> Option<f64> {
        let height = self.stored(column, row);
        (height.is_finite() && self.nodata != Some(height)).then_some(height)
    }

    /// The number that is stored for a cell, whether it is a height or not.
    #[inline]
    pub fn stored(&self, column: usize, row: usize) -> f64 {
        let at = row * self.columns + column;
        match &self.samples {
            Samples::I16(all) => f64::from(all[at]),
            Samples::F32(all) => f64::from(all[at]),
            Samples::F64(all) => all[at],
        }
    }

    /// The place of the centre of a cell.
    #[inline]
    pub fn centre(&self, column: usize, row: usize) -> Vec2 {
        self.transform.place(column as f64 + 0.5, row as f64 + 0.5)
    }
}

impl Samples {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Samples::I16(all) => all.len(),
            Samples::F32(all) => all.len(),
            Samples::F64(all) => all.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Numbers of double precision in the narrowest kind that holds all of them exactly.
    ///
    /// Cost: linear; the other copy is held until this returns.
    pub fn narrowest(values: Vec<f64>) -> Self {
        let is_single = |v: &f64| v.is_nan() || f64::from(*v as f32) == *v;
        if values.iter().all(|v| f64::from(*v as i16) == *v) {
            Samples::I16(values.iter().map(|v| *v as i16).collect())
        } else if values.iter().all(is_single) {
            Samples::F32(values.iter().map(|v| *v as f32).collect())
        } else {
            Samples::F64(values)
        }
    }

    /// The name of their type: `i16`, `f32` or `f64`.
    pub fn sample_type(&self) -> &'static str {
        match self {
            Samples::I16(_) => "i16",
            Samples::F32(_) => "f32",
            Samples::F64(_) => "f64",
        }
    }
}

impl Transform {
    /// Cells of one size whose rows go east from a corner in the north west.
    pub fn north_up(corner: Vec2, [width, height]: Vec2) -> Self {
        Transform {
            origin: corner,
            across: [width, 0.0],
            down: [0.0, -height],
        }
    }

    /// The area of a cell, negative where the raster is no mirror image of one with its rows going down.
    pub fn determinant(&self) -> f64 {
        self.across[0] * self.down[1] - self.across[1] * self.down[0]
    }

    /// The length of a cell's side along its row, and of its other side.
    pub fn cell_size(&self) -> [f64; 2] {
        [self.across, self.down].map(|step| step[0].hypot(step[1]))
    }
}

impl Grid {
    /// The outer corners with the smallest and the largest coordinates.
    pub fn extent(&self) -> [Vec2; 2] {
        let (columns, rows) = (self.columns as f64, self.rows as f64);
        let corners = [(0.0, 0.0), (columns, 0.0), (0.0, rows), (columns, rows)];
        let corners = corners.map(|(c, r)| self.transform.place(c, r));
        let of = |fold: fn(f64, f64) -> f64| {
            std::array::from_fn(|a| corners.iter().map(|c| c[a]).fold(corners[0][a], fold))
        };
        [of(f64::min), of(f64::max)]
    }

    /// Errs where there are no cells, not one height for each, or cells without an area.
    pub fn check(&self) -> Result<(), Fault> {
        let (columns, rows) = (self.columns, self.rows);
        if columns == 0 || rows == 0 {
            let problem = format!("a raster of {columns} x {rows} cells has none");
            return Err(Fault::whole(problem));
        }
        let held = self.samples.len();
        if columns.checked_mul(rows) != Some(held) {
            let problem = format!("a raster of {columns} x {rows} cells has {held} heights");
            return Err(Fault::whole(problem));
        }
        let Transform {
            origin,
            across,
            down,
        } = self.transform;
        let is_finite = [origin, across, down]
            .as_flattened()
            .iter()
            .all(|v| v.is_finite());
        let area = self.transform.determinant();
        if !is_finite || !area.is_finite() || area == 0.0 {
            let [wide, high] = self.transform.cell_size().map(number);
            let problem = format!("its cells are {wide} by {high} and have no area");
            return Err(Fault::whole(problem));
        }
        Ok(())
    }

    /// The report's counts and bounds; bounds are of the outer corners, with the lowest and the highest
    /// height. Cost: linear in the cells.
    pub fn content(&self) -> report::Content {
        let range = self.heights();
        let [low, high] = self.extent();
        let bounds = range.map(|[min, max]| [[low[0], low[1], min], [high[0], high[1], max]]);
        report::Content {
            cells: Some([self.columns as u64, self.rows as u64]),
            sample_type: Some(self.samples.sample_type().to_owned()),
            crs: self.crs.as_ref().map(ToString::to_string),
            bounds,
            ..report::Content::default()
        }
    }

    /// The lowest and the highest height; none where no cell has one. Cost: linear in the cells.
    pub fn heights(&self) -> Option<[f64; 2]> {
        let mut range: Option<[f64; 2]> = None;
        for row in 0..self.rows {
            for height in (0..self.columns).filter_map(|column| self.height(column, row)) {
                let [low, high] = range.unwrap_or([height; 2]);
                range = Some([low.min(height), high.max(height)]);
            }
        }
        range
    }
}
