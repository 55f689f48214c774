//! The surface that a grid of heights stands for.
//!
//! Heights stand at the centres of cells; four of them around a corner make a square of the *lattice*, whose
//! coordinates count the centres: `u` along the first row from its first centre, `v` from the first row to
//! the last. A square is two triangles, or one bilinear patch.

use super::frame::ToRaster;
use super::grid::{Grid, Transform};
use crate::error::{Error, Fault, Result};
use crate::numeric::vector::Vec3;
use crate::vector::Vec2;
use schemars::JsonSchema;
use serde::Serialize;

/// What lies between four heights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Two triangles, parted from the second row's first height to the first row's second one: on a map with
    /// north up, from the lower left to the upper right.
    #[default]
    Tin,
    /// The bilinear patch through them.
    Bilinear,
}

/// A triangle of a square.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Half {
    /// The one with the square's first height: `s + t <= 1`.
    First,
    /// The one with its last height.
    Last,
}

/// A square of the lattice: its corners' heights less the base, in the order first row, second row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    /// Heights; NaN where there is none.
    pub z: [f64; 4],
}

impl Square {
    /// Whether a triangle has all its heights.
    #[inline]
    pub fn has(&self, half: Half) -> bool {
        let [a, b, c, d] = self.z;
        let sum = match half {
            Half::First => a + b + c,
            Half::Last => b + c + d,
        };
        !sum.is_nan()
    }

    /// The plane of a triangle, as height at the square's first corner and steps along `u` and `v`.
    #[inline]
    pub fn plane(&self, half: Half) -> [f64; 3] {
        let [a, b, c, d] = self.z;
        match half {
            Half::First => [a, b - a, c - a],
            Half::Last => [b + c - d, d - c, d - b],
        }
    }

    /// The height of the triangles at `s`, `t` from 0 to 1.
    #[inline]
    fn on_tin(&self, s: f64, t: f64) -> f64 {
        let [a, b, c, d] = self.z;
        // From the corner at the right angle, so that corners have their own heights.
        if s + t <= 1.0 {
            a + (s * (b - a) + t * (c - a))
        } else {
            d + ((1.0 - s) * (c - d) + (1.0 - t) * (b - d))
        }
    }

    #[inline]
    fn on_patch(&self, s: f64, t: f64) -> f64 {
        let [a, b, c, d] = self.z;
        let (first, second) = (a + s * (b - a), c + s * (d - c));
        first + t * (second - first)
    }
}

/// The surface of a grid, in coordinates of its lattice.
#[derive(Debug, Clone)]
pub struct Surface<'a> {
    grid: &'a Grid,
    kind: Kind,
    to_raster: ToRaster,
    base: f64,
    range: [f64; 2],
    heights: u64,
}

impl<'a> Surface<'a> {
    /// The surface of a grid; errs where it has under two rows or columns, no height, or cells without area.
    ///
    /// Heights are kept less the lowest one, so that heights far from 0 keep their bits. Cost: linear in the
    /// cells.
    pub fn new(grid: &'a Grid, kind: Kind) -> Result<Surface<'a>> {
        use rayon::prelude::*;
        let whole = |problem: String| Err(Error::Geometry(Fault::whole(problem)));
        if grid.columns < 2 || grid.rows < 2 {
            return whole(format!(
                "a raster of {} by {} cells has no surface; it takes 2 by 2",
                grid.columns, grid.rows
            ));
        }
        let to_raster = ToRaster::of(&grid.transform)?;
        let rows: Vec<(f64, f64, u64)> = (0..grid.rows)
            .into_par_iter()
            .map(|row| {
                let heights = (0..grid.columns).filter_map(|column| grid.height(column, row));
                heights.fold((f64::INFINITY, f64::NEG_INFINITY, 0), |(lo, hi, n), z| {
                    (lo.min(z), hi.max(z), n + 1)
                })
            })
            .collect();
        let start = (f64::INFINITY, f64::NEG_INFINITY, 0);
        let (lo, hi, heights) = rows
            .into_iter()
            .fold(start, |a, b| (a.0.min(b.0), a.1.max(b.1), a.2 + b.2));
        if heights == 0 {
            return whole(format!(
                "none of the {} by {} cells has a height",
                grid.columns, grid.rows
            ));
        }
        if !(hi - lo).is_finite() {
            return whole(format!("heights from {lo:e} to {hi:e} span too much"));
        }
        Ok(Surface {
            grid,
            kind,
            to_raster,
            base: lo,
            range: [lo, hi],
            heights,
        })
    }

    /// The same heights with something else between them.
    pub fn clone_as(&self, kind: Kind) -> Surface<'a> {
        Surface {
            kind,
            ..self.clone()
        }
    }

    /// The grid.
    pub fn grid(&self) -> &'a Grid {
        self.grid
    }

    /// What lies between the heights.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The lowest and the highest height.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Cells with a height.
    pub fn heights(&self) -> u64 {
        self.heights
    }

    /// What local heights are above.
    pub fn base(&self) -> f64 {
        self.base
    }

    /// Squares along a row and rows of them.
    pub fn squares(&self) -> [usize; 2] {
        [self.grid.columns - 1, self.grid.rows - 1]
    }

    /// A place on the lattice.
    #[inline]
    pub fn to_lattice(&self, p: Vec2) -> Vec2 {
        self.to_raster.apply(p).map(|c| c - 0.5)
    }

    /// A step on the map as one on the lattice.
    #[inline]
    pub fn to_lattice_step(&self, step: Vec2) -> Vec2 {
        self.to_raster.turn(step)
    }

    /// The place on the map of a place on the lattice.
    #[inline]
    pub fn from_lattice(&self, p: Vec2) -> Vec2 {
        self.grid.transform.place(p[0] + 0.5, p[1] + 0.5)
    }

    /// Area on the map of a square.
    pub fn square_area(&self) -> f64 {
        self.to_raster.cell_area()
    }

    /// The steps on the map along `u` and `v`.
    pub fn steps(&self) -> [Vec2; 2] {
        let Transform { across, down, .. } = self.grid.transform;
        [across, down]
    }

    /// A local height; NaN where there is none.
    #[inline]
    pub fn local(&self, column: usize, row: usize) -> f64 {
        match self.grid.height(column, row) {
            Some(z) => z - self.base,
            None => f64::NAN,
        }
    }

    /// A square by its first corner; the caller keeps inside [`Surface::squares`].
    #[inline]
    pub fn square(&self, column: usize, row: usize) -> Square {
        Square {
            z: [
                self.local(column, row),
                self.local(column + 1, row),
                self.local(column, row + 1),
                self.local(column + 1, row + 1),
            ],
        }
    }

    /// The square that a place of the lattice is in; none outside. Places on a border are in the later square,
    /// those on the last borders in the last.
    #[inline]
    pub fn square_at(&self, p: Vec2) -> Option<(usize, usize)> {
        let [columns, rows] = self.squares();
        let inside = p[0] >= 0.0 && p[1] >= 0.0 && p[0] <= columns as f64 && p[1] <= rows as f64;
        inside.then(|| {
            (
                (p[0] as usize).min(columns - 1),
                (p[1] as usize).min(rows - 1),
            )
        })
    }

    /// The local height at a place of the lattice; none outside or where a height is missing.
    ///
    /// A bilinear patch needs all four heights, a triangle its three. Continuous to rounding.
    #[inline]
    pub fn local_height(&self, p: Vec2) -> Option<f64> {
        let (column, row) = self.square_at(p)?;
        let (s, t) = (p[0] - column as f64, p[1] - row as f64);
        let square = self.square(column, row);
        let z = match self.kind {
            Kind::Tin => square.on_tin(s, t),
            Kind::Bilinear => square.on_patch(s, t),
        };
        (!z.is_nan()).then_some(z)
    }

    /// The height at a place on the map, in the grid's unit; none outside or where a height is missing.
    pub fn height(&self, p: Vec2) -> Option<f64> {
        let local = self.local_height(self.to_lattice(p))?;
        Some(self.base + local)
    }

    /// How the local height grows along `u` and `v` at a place of the lattice.
    #[inline]
    pub fn gradient(&self, p: Vec2) -> Option<Vec2> {
        let (column, row) = self.square_at(p)?;
        let (s, t) = (p[0] - column as f64, p[1] - row as f64);
        let square = self.square(column, row);
        let [a, b, c, d] = square.z;
        let slope = match self.kind {
            Kind::Tin => {
                let half = if s + t <= 1.0 {
                    Half::First
                } else {
                    Half::Last
                };
                let [_, du, dv] = square.plane(half);
                [du, dv]
            }
            Kind::Bilinear => [
                (b - a) + t * ((d - c) - (b - a)),
                (c - a) + s * ((d - b) - (c - a)),
            ],
        };
        (!slope[0].is_nan() && !slope[1].is_nan()).then_some(slope)
    }

    /// The unit normal, upward, at a place of the lattice.
    pub fn normal(&self, p: Vec2) -> Option<Vec3> {
        Some(self.normal_of(self.gradient(p)?))
    }

    /// The unit normal, upward, of a slope per step of the lattice.
    #[inline]
    pub fn normal_of(&self, slope: Vec2) -> Vec3 {
        let [a, d] = self.steps();
        let determinant = a[0] * d[1] - a[1] * d[0];
        // The slope on the map.
        let x = (slope[0] * d[1] - slope[1] * a[1]) / determinant;
        let y = (slope[1] * a[0] - slope[0] * d[0]) / determinant;
        crate::numeric::vector::normalize([-x, -y, 1.0])
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::terrain::Samples;

    /// A grid of cells of a size, with north up and its lower left corner at the origin.
    pub(crate) fn grid(
        columns: usize,
        rows: usize,
        cell: f64,
        z: impl Fn(f64, f64) -> f64,
    ) -> Grid {
        let transform = Transform {
            origin: [0.0, rows as f64 * cell],
            across: [cell, 0.0],
            down: [0.0, -cell],
        };
        let centres = (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r)));
        let heights = centres.map(|(c, r)| {
            let [x, y] = transform.place(c as f64 + 0.5, r as f64 + 0.5);
            z(x, y)
        });
        Grid {
            columns,
            rows,
            transform,
            samples: Samples::F64(heights.collect()),
            nodata: Some(-9999.0),
            crs: None,
        }
    }

    #[test]
    fn planes_are_planes_on_both_surfaces() {
        let plane = |x: f64, y: f64| 3.0 + 0.25 * x - 0.5 * y;
        let grid = grid(9, 7, 2.0, plane);
        for kind in [Kind::Tin, Kind::Bilinear] {
            let surface = Surface::new(&grid, kind).unwrap();
            for (x, y) in [
                (1.0, 1.0),
                (3.7, 5.1),
                (16.9, 12.9),
                (17.0, 13.0),
                (1.0, 13.0),
            ] {
                let z = surface.height([x, y]).unwrap();
                assert!((z - plane(x, y)).abs() < 1e-12, "{x} {y}");
                let n = surface.normal(surface.to_lattice([x, y])).unwrap();
                assert!((n[0] / n[2] + 0.25).abs() < 1e-12 && (n[1] / n[2] - 0.5).abs() < 1e-12);
            }
            assert_eq!(surface.height([0.9, 5.0]), None);
            assert_eq!(surface.height([5.0, 13.1]), None);
        }
    }

    #[test]
    fn the_diagonal_goes_from_the_lower_left_to_the_upper_right() {
        // One high corner at the upper left: the diagonal itself stays at 0.
        let grid = grid(2, 2, 1.0, |x, y| f64::from(u8::from(x < 1.0 && y > 1.0)));
        let tin = Surface::new(&grid, Kind::Tin).unwrap();
        let bilinear = Surface::new(&grid, Kind::Bilinear).unwrap();
        assert_eq!(tin.height([1.0, 1.0]), Some(0.0));
        assert_eq!(bilinear.height([1.0, 1.0]), Some(0.25));
        assert_eq!(tin.height([0.75, 1.25]), Some(0.5));
        assert_eq!(tin.height([1.25, 0.75]), Some(0.0));
    }

    #[test]
    fn a_missing_height_takes_its_triangles_away() {
        let grid = grid(
            3,
            3,
            1.0,
            |x, y| {
                if x == 1.5 && y == 1.5 { -9999.0 } else { 1.0 }
            },
        );
        let tin = Surface::new(&grid, Kind::Tin).unwrap();
        assert_eq!(tin.heights(), 8);
        let bilinear = Surface::new(&grid, Kind::Bilinear).unwrap();
        // The upper left square keeps the triangle away from the middle.
        assert_eq!(tin.height([0.6, 2.4]), Some(1.0));
        assert_eq!(tin.height([1.3, 1.7]), None);
        assert_eq!(tin.height([1.3, 1.3]), None);
        assert_eq!(bilinear.height([0.6, 2.4]), None);
    }

    #[test]
    fn heights_and_places_far_away_keep_their_bits() {
        let wave = |x: f64, y: f64| (x * 7.0).floor() * 0.125 + (y * 3.0).floor() * 0.25;
        let near = grid(20, 20, 1.0, wave);
        let mut far = grid(20, 20, 1.0, |x, y| wave(x, y) + 1048576.0);
        far.transform.origin[0] += 4194304.0;
        far.transform.origin[1] -= 8388608.0;
        let near = Surface::new(&near, Kind::Tin).unwrap();
        let far = Surface::new(&far, Kind::Tin).unwrap();
        for k in 0..100 {
            let p = [
                1.0 + f64::from(k) * 0.171875,
                18.0 - f64::from(k) * 0.140625,
            ];
            let q = [p[0] + 4194304.0, p[1] - 8388608.0];
            let (a, b) = (near.to_lattice(p), far.to_lattice(q));
            assert_eq!(a, b);
            assert_eq!(near.local_height(a), far.local_height(b));
        }
    }

    #[test]
    fn grids_without_a_surface_are_refused() {
        for (bad, words) in [
            (grid(1, 5, 1.0, |_, _| 0.0), "1 by 5"),
            (grid(5, 5, 1.0, |_, _| -9999.0), "none of the 5 by 5"),
            (grid(5, 5, 0.0, |_, _| 0.0), "no area"),
        ] {
            let wrong = Surface::new(&bad, Kind::Tin).unwrap_err().to_string();
            assert!(wrong.contains(words), "{wrong}");
        }
    }
}
