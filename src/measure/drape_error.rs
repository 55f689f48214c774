//! How far draped lines are above or below the land: against heights that are found anew.
//!
//! Nothing here is shared with draping: places go to the grid by a system of two equations, and every
//! square of it that a place may lie in is asked.

use crate::numeric::vector::Vec3;
use crate::terrain::surface::Kind;
use crate::terrain::{Grid, Transform};
use rayon::prelude::*;

/// Places between the ends of each piece that are looked at, the ends among them.
const PLACES: u32 = 9;
/// A place this near to a border of a square, in squares, may be in either.
const NEAR: f64 = 1e-6;

/// The largest distance along z between lines and the surface of a grid, and how many places had none.
///
/// Lines are of places on the map with heights in the grid's unit. Cost: nine places for each piece.
pub fn drape_error(grid: &Grid, kind: Kind, lines: &[Vec<Vec3>]) -> (f64, u64) {
    let worst = |a: (f64, u64), b: (f64, u64)| (a.0.max(b.0), a.1 + b.1);
    let of_line = |line: &Vec<Vec3>| {
        let pieces = line.windows(2).map(|ends| [ends[0], ends[1]]);
        let alone = (line.len() == 1).then(|| [line[0], line[0]]);
        let pieces = pieces.chain(alone);
        pieces.fold((0.0, 0), |all, [a, b]| {
            (0..PLACES).fold(all, |all, i| {
                let t = f64::from(i) / f64::from(PLACES - 1);
                let p: Vec3 = std::array::from_fn(|c| a[c] * (1.0 - t) + b[c] * t);
                worst(all, off(grid, kind, p).map_or((0.0, 1), |d| (d, 0)))
            })
        })
    };
    lines.par_iter().map(of_line).reduce(|| (0.0, 0), worst)
}

/// How far a place is from the surface along z; none where there is no surface.
fn off(grid: &Grid, kind: Kind, p: Vec3) -> Option<f64> {
    let [u, v] = on_lattice(&grid.transform, p);
    let range = |at: f64| [(at - NEAR).floor(), (at + NEAR).floor()];
    let columns = range(u);
    let rows = range(v);
    let all = columns
        .iter()
        .flat_map(|c| rows.iter().map(move |r| (*c, *r)));
    let found = all.filter_map(|(column, row)| {
        let [s, t] = [u - column, v - row];
        let z = square(grid, column, row, [s, t], kind)?;
        Some((p[2] - z).abs())
    });
    found.reduce(f64::min)
}

/// Columns and rows from the centre of the first cell.
fn on_lattice(transform: &Transform, p: Vec3) -> [f64; 2] {
    let Transform {
        origin,
        across: a,
        down: d,
    } = transform;
    let (x, y) = (p[0] - origin[0], p[1] - origin[1]);
    let determinant = a[0] * d[1] - a[1] * d[0];
    let column = (x * d[1] - y * d[0]) / determinant;
    let row = (a[0] * y - a[1] * x) / determinant;
    [column - 0.5, row - 0.5]
}

/// The height in a square of four cells at shares of it along its row and down.
fn square(grid: &Grid, column: f64, row: f64, [s, t]: [f64; 2], kind: Kind) -> Option<f64> {
    let inside = |at: f64, count: usize| at >= 0.0 && at + 1.0 < count as f64;
    if !inside(column, grid.columns) || !inside(row, grid.rows) {
        return None;
    }
    let (column, row) = (column as usize, row as usize);
    let z = |right: usize, below: usize| grid.height(column + right, row + below);
    let (above, below) = (z(1, 0), z(0, 1));
    match kind {
        // The diagonal goes from the second row's first height to the first row's second.
        Kind::Tin if s + t <= 1.0 => {
            let corner = z(0, 0)?;
            Some(corner + s * (above? - corner) + t * (below? - corner))
        }
        Kind::Tin => {
            let corner = z(1, 1)?;
            Some(corner + (1.0 - s) * (below? - corner) + (1.0 - t) * (above? - corner))
        }
        Kind::Bilinear => {
            let upper = z(0, 0)? * (1.0 - s) + above? * s;
            let lower = below? * (1.0 - s) + z(1, 1)? * s;
            Some(upper * (1.0 - t) + lower * t)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Samples;

    /// Four by three cells of 10 by 10 with a bump and a hole.
    fn grid() -> Grid {
        let heights = vec![
            0.0,
            1.0,
            2.0,
            3.0,
            0.0,
            5.0,
            2.0,
            3.0,
            0.0,
            1.0,
            2.0,
            f64::NAN,
        ];
        Grid {
            columns: 4,
            rows: 3,
            transform: Transform::north_up([100.0, 30.0], [10.0, 10.0]),
            samples: Samples::F64(heights),
            nodata: None,
            crs: None,
        }
    }

    #[test]
    fn what_lies_on_the_surface_is_not_off_it() {
        let line = vec![[105.0, 25.0, 0.0], [115.0, 25.0, 1.0], [115.0, 15.0, 5.0]];
        let grid = grid();
        for kind in [Kind::Tin, Kind::Bilinear] {
            assert_eq!(
                drape_error(&grid, kind, std::slice::from_ref(&line)),
                (0.0, 0)
            );
            let mut raised = line.clone();
            raised[1][2] += 0.25;
            assert_eq!(drape_error(&grid, kind, &[raised]), (0.25, 0));
        }
    }

    #[test]
    fn triangles_and_patches_differ_on_a_diagonal() {
        let grid = grid();
        // From one height of 1 to another across the diagonal: over the middle the patch is at 1.5.
        let across = vec![[105.0, 25.0, 0.0], [115.0, 15.0, 5.0]];
        let (tin, _) = drape_error(&grid, Kind::Tin, std::slice::from_ref(&across));
        let (patch, _) = drape_error(&grid, Kind::Bilinear, &[across]);
        // The diagonal is at (1 + 0) / 2 there, the patch at (0 + 1 + 0 + 5) / 4.
        assert!((tin - 2.0).abs() < 1e-12, "{tin}");
        assert!((patch - 1.0).abs() < 1e-12, "{patch}");
    }

    #[test]
    fn places_without_a_surface_are_counted() {
        let grid = grid();
        let hole = vec![[134.0, 6.0, 0.0]];
        let beside = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert_eq!(drape_error(&grid, Kind::Tin, &[hole]).1, 9);
        assert_eq!(drape_error(&grid, Kind::Tin, &[beside]).1, 9);
        // The triangle that keeps clear of the hole is there.
        assert_eq!(
            drape_error(&grid, Kind::Tin, &[vec![[127.0, 13.0, 2.3]]]).1,
            0
        );
    }
}
