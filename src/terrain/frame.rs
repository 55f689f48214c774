//! A raster in the plan of a map, without what is in its cells.

use super::grid::{Grid, Transform};
use crate::error::{Error, Fault, Result};
use crate::vector::Vec2;

/// Where the pixels of a plan are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Where they are.
    pub transform: Transform,
    /// Pixels along a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl Frame {
    /// The cells of a grid, each cut into `factor` by `factor` pixels; a factor of 0 counts as 1.
    pub fn of(grid: &Grid, factor: usize) -> Frame {
        let factor = factor.max(1);
        let Transform {
            origin,
            across,
            down,
        } = grid.transform;
        Frame {
            transform: Transform {
                origin,
                across: across.map(|c| c / factor as f64),
                down: down.map(|c| c / factor as f64),
            },
            columns: grid.columns * factor,
            rows: grid.rows * factor,
        }
    }

    /// The same ground in pixels of other numbers; errs where one is 0.
    pub fn resized(&self, columns: usize, rows: usize) -> Result<Frame> {
        if columns == 0 || rows == 0 {
            let size = format!("{columns}x{rows}");
            return Err(Error::parameter("size", size, "has no pixels"));
        }
        let Transform {
            origin,
            across,
            down,
        } = self.transform;
        let step = |v: Vec2, old: usize, new: usize| v.map(|c| c * old as f64 / new as f64);
        Ok(Frame {
            transform: Transform {
                origin,
                across: step(across, self.columns, columns),
                down: step(down, self.rows, rows),
            },
            columns,
            rows,
        })
    }

    /// The way from places to the raster; errs where the pixels have no area.
    pub fn to_raster(&self) -> Result<ToRaster> {
        ToRaster::of(&self.transform)
    }
}

/// The way from places on the map to places on a raster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToRaster {
    origin: Vec2,
    across: Vec2,
    down: Vec2,
    determinant: f64,
}

impl ToRaster {
    /// The inverse of a transform; errs where its cells have no area, or numbers that are not finite.
    pub fn of(transform: &Transform) -> Result<ToRaster> {
        let Transform {
            origin,
            across,
            down,
        } = *transform;
        let determinant = across[0] * down[1] - across[1] * down[0];
        if determinant == 0.0 || !determinant.is_finite() || !origin.iter().all(|c| c.is_finite()) {
            return Err(Error::Geometry(Fault::whole(format!(
                "cells with the sides {across:?} and {down:?} have no area"
            ))));
        }
        Ok(ToRaster {
            origin,
            across,
            down,
            determinant,
        })
    }

    /// Column and row of a place, in cells from the outer corner of the first one.
    #[inline]
    pub fn apply(&self, p: Vec2) -> Vec2 {
        self.turn([p[0] - self.origin[0], p[1] - self.origin[1]])
    }

    /// A step on the map in cells.
    #[inline]
    pub fn turn(&self, [x, y]: Vec2) -> Vec2 {
        if self.across[1] == 0.0 && self.down[0] == 0.0 {
            return [x / self.across[0], y / self.down[1]];
        }
        [
            (x * self.down[1] - y * self.down[0]) / self.determinant,
            (y * self.across[0] - x * self.across[1]) / self.determinant,
        ]
    }

    /// Area of a cell on the map.
    pub fn cell_area(&self) -> f64 {
        self.determinant.abs()
    }
}
