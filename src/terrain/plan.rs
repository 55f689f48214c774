//! Features seen from straight above: masks and feature numbers on a raster.
//!
//! The rules are those of GDAL 3 (`gdal_rasterize`, `rasterio.features.rasterize`), so that masks made by one
//! fit those made by the other pixel for pixel:
//!
//! - Polygons have the pixels whose centres they contain, each polygon by the even-odd rule over its rings. On
//!   a row, crossings with the level of the centres are rounded to whole columns; an edge has its upper end and
//!   not its lower one. A level edge exactly on the centres of a row fills it.
//! - Lines have the pixels of a Bresenham walk between the pixels of their vertices.
//! - Points have the pixel they are in.
//! - With `all_touched`, lines and the edges of polygons have every pixel they pass through.

use super::frame::Frame;
use crate::error::Result;
use crate::progress::Progress;
use crate::vector::rings::edges;
use crate::vector::{Feature, Shape, Vec2};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::ops::Range;

/// How features become pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Params {
    /// Every pixel that a line or an edge passes through, not only those by their centres.
    pub all_touched: bool,
}

impl Params {
    /// Pixels by their centres.
    pub const DEFAULT: Self = Params { all_touched: false };
}

/// What was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Stats {
    /// Features with a shape.
    pub features: u64,
    /// Features without one.
    pub empty: u64,
    /// Features with a shape of which no part is on the raster.
    pub outside: u64,
    /// Pixels with a feature.
    pub pixels: u64,
}

/// Rows that are drawn together.
const BAND: usize = 32;

enum Part {
    Rings(Vec<Vec<Vec2>>),
    Lines(Vec<Vec<Vec2>>),
    Points(Vec<Vec2>),
}

struct Item {
    part: Part,
    feature: u32,
    rows: Range<usize>,
}

/// Features in the coordinates of a raster, ready to be drawn row by row.
pub struct Plan {
    columns: usize,
    rows: usize,
    items: Vec<Item>,
    params: Params,
    stats: Stats,
}

impl Plan {
    /// Features brought to a raster; errs where its pixels have no area. Cost: linear in the vertices.
    pub fn new(features: &[Feature], frame: &Frame, params: &Params) -> Result<Plan> {
        let to_raster = frame.to_raster()?;
        let place = |p: &Vec2| to_raster.apply(*p);
        let line = |line: &Vec<Vec2>| line.iter().map(place).collect::<Vec<_>>();
        let items: Vec<Vec<Item>> = features
            .par_iter()
            .enumerate()
            .map(|(feature, what)| {
                let parts: Vec<Part> = match &what.shape {
                    Shape::Empty => Vec::new(),
                    Shape::Points(all) => vec![Part::Points(all.iter().map(place).collect())],
                    Shape::Lines(all) => vec![Part::Lines(all.iter().map(line).collect())],
                    Shape::Polygons(all) => all
                        .iter()
                        .map(|polygon| Part::Rings(polygon.rings.iter().map(line).collect()))
                        .collect(),
                };
                let item = |part: Part| Item {
                    rows: rows_of(&part, frame),
                    part,
                    feature: feature as u32,
                };
                parts.into_iter().map(item).collect()
            })
            .collect();
        let mut stats = Stats::default();
        for of_feature in &items {
            stats.features += u64::from(!of_feature.is_empty());
            stats.empty += u64::from(of_feature.is_empty());
            let outside = of_feature.iter().all(|item| item.rows.is_empty());
            stats.outside += u64::from(outside && !of_feature.is_empty());
        }
        Ok(Plan {
            columns: frame.columns,
            rows: frame.rows,
            items: items.into_iter().flatten().collect(),
            params: *params,
            stats,
        })
    }

    /// Counts of the features; no pixels are counted yet.
    pub fn stats(&self) -> Stats {
        self.stats
    }

    /// Draws into some rows of the raster; later features replace earlier ones.
    ///
    /// `out` has `rows.len()` rows; rows beyond the raster stay as they are. `value` is what a feature is drawn
    /// with, by its index. Cost: the crossings of edges with rows, and the pixels filled.
    pub fn draw<T: Copy + Send>(
        &self,
        rows: Range<usize>,
        out: &mut [T],
        value: impl Fn(usize) -> T + Sync,
        progress: &dyn Progress,
    ) {
        if self.columns == 0 {
            return;
        }
        let last = rows.end.min(self.rows);
        out.par_chunks_mut(BAND * self.columns)
            .enumerate()
            .for_each(|(k, pixels)| {
                let start = rows.start + k * BAND;
                let end = (start + pixels.len() / self.columns).min(last);
                let mut band = Band {
                    columns: self.columns,
                    rows: start..end.max(start),
                    pixels,
                    crossings: Vec::new(),
                };
                for item in &self.items {
                    if item.rows.start < end && start < item.rows.end {
                        band.draw(&item.part, self.params, value(item.feature as usize));
                    }
                }
                progress.advance(1);
            });
    }
}

/// The number of the last feature on each pixel, from 1; 0 for none.
///
/// Errs where the pixels have no area. Cost: see [`Plan::draw`]; four bytes a pixel.
pub fn ids(
    features: &[Feature],
    frame: &Frame,
    params: &Params,
    progress: &dyn Progress,
) -> Result<(Vec<u32>, Stats)> {
    rasterize(features, frame, params, progress, 0, |feature| {
        feature as u32 + 1
    })
}

/// 1 where there is a feature, 0 elsewhere.
///
/// Errs where the pixels have no area. Cost: see [`Plan::draw`]; a byte a pixel.
pub fn mask(
    features: &[Feature],
    frame: &Frame,
    params: &Params,
    progress: &dyn Progress,
) -> Result<(Vec<u8>, Stats)> {
    rasterize(features, frame, params, progress, 0, |_| 1)
}

fn rasterize<T: Copy + Send + Sync + PartialEq>(
    features: &[Feature],
    frame: &Frame,
    params: &Params,
    progress: &dyn Progress,
    none: T,
    value: impl Fn(usize) -> T + Sync,
) -> Result<(Vec<T>, Stats)> {
    progress.stage("rasterize", frame.rows.div_ceil(BAND) as u64);
    let plan = Plan::new(features, frame, params)?;
    let mut out = vec![none; frame.columns * frame.rows];
    plan.draw(0..frame.rows, &mut out, value, progress);
    let set = out.par_iter().filter(|pixel| **pixel != none).count();
    let stats = Stats {
        pixels: set as u64,
        ..plan.stats
    };
    Ok((out, stats))
}

/// Rows that a part may draw on; empty where it is off the raster on any side.
fn rows_of(part: &Part, frame: &Frame) -> Range<usize> {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut with = |p: &Vec2| {
        for a in 0..2 {
            lo[a] = lo[a].min(p[a]);
            hi[a] = hi[a].max(p[a]);
        }
    };
    match part {
        Part::Rings(all) | Part::Lines(all) => all.iter().flatten().for_each(&mut with),
        Part::Points(all) => all.iter().for_each(&mut with),
    }
    if !(hi[0] >= 0.0 && hi[1] >= 0.0 && lo[0] <= frame.columns as f64) {
        return 0..0;
    }
    let first = lo[1].floor().max(0.0) as usize;
    first.min(frame.rows)
        ..(hi[1].floor().max(0.0) as usize)
            .saturating_add(1)
            .min(frame.rows)
}

struct Band<'a, T> {
    columns: usize,
    rows: Range<usize>,
    pixels: &'a mut [T],
    crossings: Vec<(usize, i64)>,
}

impl<T: Copy> Band<'_, T> {
    fn draw(&mut self, part: &Part, params: Params, value: T) {
        match part {
            Part::Points(all) => {
                for p in all {
                    self.set(p[0].floor() as i64, p[1].floor() as i64, value);
                }
            }
            Part::Lines(all) if params.all_touched => {
                for pair in all.iter().flat_map(|line| line.windows(2)) {
                    self.touch(pair[0], pair[1], value);
                }
            }
            Part::Lines(all) => {
                for pair in all.iter().flat_map(|line| line.windows(2)) {
                    self.walk(pair[0], pair[1], value);
                }
            }
            Part::Rings(rings) => {
                self.fill(rings, value);
                if params.all_touched {
                    for (a, b) in rings.iter().flat_map(|ring| edges(ring)) {
                        self.touch(a, b, value);
                    }
                }
            }
        }
    }

    fn set(&mut self, column: i64, row: i64, value: T) {
        let inside = (0..self.columns as i64).contains(&column)
            && (self.rows.start as i64..self.rows.end as i64).contains(&row);
        if inside {
            let row = row as usize - self.rows.start;
            self.pixels[row * self.columns + column as usize] = value;
        }
    }

    /// Columns from one to before another.
    fn span(&mut self, row: usize, from: i64, to: i64, value: T) {
        let clip = |column: i64| column.clamp(0, self.columns as i64) as usize;
        let (from, to) = (clip(from), clip(to));
        if from < to {
            let start = (row - self.rows.start) * self.columns;
            self.pixels[start + from..start + to].fill(value);
        }
    }

    fn fill(&mut self, rings: &[Vec<Vec2>], value: T) {
        let mut crossings = std::mem::take(&mut self.crossings);
        crossings.clear();
        for (a, b) in rings.iter().flat_map(|ring| edges(ring)) {
            let (high, low) = if a[1] < b[1] { (a, b) } else { (b, a) };
            let first = (high[1] - 0.5).floor().max(self.rows.start as f64) as usize;
            let last = (low[1] + 0.5).floor().max(0.0) as usize;
            for row in first..last.saturating_add(1).min(self.rows.end) {
                let y = row as f64 + 0.5;
                if high[1] <= y && y < low[1] {
                    let x = (y - high[1]) * (low[0] - high[0]) / (low[1] - high[1]) + high[0];
                    crossings.push((row, (x + 0.5).floor() as i64));
                } else if a[1] == y && b[1] == y {
                    let ends = [a[0].min(b[0]), a[0].max(b[0])];
                    let ends = ends.map(|x| (x + 0.5).floor() as i64);
                    self.span(row, ends[0], ends[1], value);
                }
            }
        }
        crossings.sort_unstable();
        // Closed rings cross a level an even number of times.
        for pair in crossings.chunks_exact(2) {
            self.span(pair[0].0, pair[0].1, pair[1].1, value);
        }
        self.crossings = crossings;
    }

    /// The pixels of a Bresenham walk.
    fn walk(&mut self, a: Vec2, b: Vec2, value: T) {
        // Far beyond any raster, and small enough for the products below.
        const FAR: f64 = (1u64 << 28) as f64;
        let pixel = |p: Vec2| p.map(|c| c.floor().clamp(-FAR, FAR) as i64);
        let (from, to) = (pixel(a), pixel(b));
        let delta = [(to[0] - from[0]).abs(), (to[1] - from[1]).abs()];
        let step = [0, 1].map(|axis| if from[axis] > to[axis] { -1 } else { 1 });
        let long = usize::from(delta[0] < delta[1]);
        let short = 1 - long;
        let bounds = if long == 0 {
            0..self.columns as i64
        } else {
            self.rows.start as i64..self.rows.end as i64
        };
        // Only the steps that are inside along the longer axis.
        let (first, last) = if step[long] > 0 {
            (bounds.start - from[long], bounds.end - 1 - from[long])
        } else {
            (from[long] - (bounds.end - 1), from[long] - bounds.start)
        };
        for k in first.max(0)..=last.min(delta[long]) {
            // Halves go aside.
            let aside = match delta[long] {
                0 => 0,
                length => (2 * delta[short] * k + length) / (2 * length),
            };
            let mut at = [0; 2];
            at[long] = from[long] + step[long] * k;
            at[short] = from[short] + step[short] * aside;
            self.set(at[0], at[1], value);
        }
    }

    /// Every pixel that a segment passes through.
    fn touch(&mut self, a: Vec2, b: Vec2, value: T) {
        let (left, right) = if a[0] <= b[0] { (a, b) } else { (b, a) };
        let (top, bottom) = (left[1].min(right[1]), left[1].max(right[1]));
        if bottom < self.rows.start as f64 || top >= self.rows.end as f64 || right[0] < 0.0 {
            return;
        }
        let first = left[0].floor();
        let last = (right[0].ceil() - 1.0).max(first);
        let slope = (right[1] - left[1]) / (right[0] - left[0]);
        let from = first.max(0.0) as usize;
        let to = (last.max(-1.0) + 1.0).min(self.columns as f64) as usize;
        for column in from..to {
            let at = |x: f64| (left[1] + (x - left[0]) * slope).clamp(top, bottom);
            let column = column as f64;
            let y0 = if column <= left[0] {
                left[1]
            } else {
                at(column)
            };
            let end = column + 1.0;
            let y1 = if end >= right[0] { right[1] } else { at(end) };
            let (low, high) = (y0.min(y1), y0.max(y1));
            // A segment that comes down to a border ends above it; one that goes up from it starts below.
            let last = if y1 >= y0 {
                (high.ceil() - 1.0).max(low.floor())
            } else {
                high.floor()
            };
            let rows = low.floor().max(self.rows.start as f64)..=last.min(self.rows.end as f64);
            for row in *rows.start() as i64..=*rows.end() as i64 {
                self.set(column as i64, row, value);
            }
        }
    }
}

#[cfg(test)]
mod tests;
