//! Lines and outlines laid on a surface.
//!
//! A segment is split wherever it crosses an edge of the surface, so that each piece lies in one triangle and
//! its ends have the triangle's height: the draped line is on the surface everywhere, not only at vertices. On
//! bilinear patches pieces are split further until they are within a stated distance.

use super::surface::{Half, Kind, Surface};
use crate::error::{Error, Result};
use crate::numeric::vector::{Vec3, length, sub};
use crate::progress::Progress;
use crate::vector::rings::{Dropped, normalise, normalise_line, twice_signed_area};
use crate::vector::{Feature, Polygon, Shape, Vec2};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// How lines are draped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// Farthest a piece may be above or below a bilinear patch, in the unit of heights; triangles need none.
    pub max_error: f64,
}

impl Params {
    /// A centimetre, where heights are in metres.
    pub const DEFAULT: Self = Params { max_error: 0.01 };

    /// Errs where the distance is not positive.
    pub fn check(&self) -> Result<()> {
        if self.max_error > 0.0 && self.max_error.is_finite() {
            return Ok(());
        }
        Err(Error::parameter(
            "max-error",
            self.max_error,
            "is not a positive number",
        ))
    }
}

/// A feature on the surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Draped {
    /// Lines, outlines and points that lie on the surface; several where a hole or the border cut one.
    pub lines: Vec<Vec<Vec3>>,
    /// What was measured.
    pub measures: Measures,
}

/// Sizes of a feature on the surface; lengths in the map's unit, with heights in it too.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Measures {
    /// Vertices given, without repeated ones.
    pub vertices_in: u64,
    /// Vertices on the surface.
    pub vertices: u64,
    /// Length on the map of what is on the surface.
    pub length_2d: f64,
    /// Length along the surface.
    pub length_3d: f64,
    /// Length on the map of what was cut out: over holes and outside.
    pub length_cut: f64,
    /// Area on the map of polygons, outside and holes included.
    pub area: f64,
    /// Area on the map of the part of polygons that has a surface.
    pub area_covered: f64,
    /// Area of that part along the surface; on patches, of the triangles with the same corners.
    pub area_3d: f64,
}

/// What was draped.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Features with a part on the surface.
    pub features: u64,
    /// Features without a shape, or without a usable one.
    pub empty: u64,
    /// Features wholly outside or over holes.
    pub outside: u64,
    /// Parts left out of shapes.
    pub dropped: Dropped,
    /// Sums over all features.
    pub sum: Measures,
}

/// Features laid on a surface, in order.
///
/// Vertices are places on the map with the height in the grid's unit. Pieces over missing heights and outside
/// are cut out; outlines of polygons are closed. Errs where a parameter is out of range. Cost: the surface
/// edges crossed; areas take the squares of each polygon's box.
pub fn drape(
    features: &[Feature],
    surface: &Surface,
    params: &Params,
    progress: &dyn Progress,
) -> Result<(Vec<Draped>, Stats)> {
    params.check()?;
    progress.stage("drape", features.len() as u64);
    let all: Vec<(Draped, Dropped)> = features
        .par_iter()
        .map(|feature| {
            let mut draper = Draper::new(surface, params);
            draper.feature(&feature.shape);
            progress.advance(1);
            (draper.out, draper.dropped)
        })
        .collect();
    let mut stats = Stats::default();
    for ((draped, dropped), feature) in all.iter().zip(features) {
        stats.dropped = stats.dropped.plus(*dropped);
        if draped.measures.vertices > 0 {
            stats.features += 1;
        } else if draped.measures.vertices_in == 0 || feature.shape == Shape::Empty {
            stats.empty += 1;
        } else {
            stats.outside += 1;
        }
        stats.sum = stats.sum.plus(&draped.measures);
    }
    Ok((all.into_iter().map(|(draped, _)| draped).collect(), stats))
}

impl Measures {
    fn plus(&self, other: &Measures) -> Measures {
        Measures {
            vertices_in: self.vertices_in + other.vertices_in,
            vertices: self.vertices + other.vertices,
            length_2d: self.length_2d + other.length_2d,
            length_3d: self.length_3d + other.length_3d,
            length_cut: self.length_cut + other.length_cut,
            area: self.area + other.area,
            area_covered: self.area_covered + other.area_covered,
            area_3d: self.area_3d + other.area_3d,
        }
    }
}

/// Places on a segment where it crosses edges of the lattice, and between.
#[derive(Clone, Copy)]
struct Stop {
    /// From 0 at the start to 1 at the end.
    t: f64,
    at: Vec2,
}

struct Draper<'a> {
    surface: &'a Surface<'a>,
    params: &'a Params,
    out: Draped,
    dropped: Dropped,
    /// The line that grows.
    line: Vec<Vec3>,
    stops: Vec<Stop>,
}

impl<'a> Draper<'a> {
    fn new(surface: &'a Surface<'a>, params: &'a Params) -> Self {
        Draper {
            surface,
            params,
            out: Draped::default(),
            dropped: Dropped::default(),
            line: Vec::new(),
            stops: Vec::new(),
        }
    }

    fn feature(&mut self, shape: &Shape) {
        match shape {
            Shape::Empty => {}
            Shape::Points(all) => {
                for p in all {
                    self.out.measures.vertices_in += 1;
                    if let Some(z) = self.surface.height(*p) {
                        self.line.push([p[0], p[1], z]);
                        self.finish();
                    }
                }
            }
            Shape::Lines(all) => {
                for line in all {
                    if let Some(line) = normalise_line(line, &mut self.dropped) {
                        self.out.measures.vertices_in += line.len() as u64;
                        self.line(&line);
                    }
                }
            }
            Shape::Polygons(all) => self.polygons(all),
        }
    }

    fn polygons(&mut self, polygons: &[Polygon]) {
        let (polygons, dropped) = normalise(polygons);
        self.dropped = self.dropped.plus(dropped);
        for ring in polygons.iter().flat_map(|polygon| &polygon.rings) {
            self.out.measures.vertices_in += ring.len() as u64;
            self.out.measures.area += 0.5 * twice_signed_area(ring);
            let mut closed = ring.clone();
            closed.push(ring[0]);
            self.line(&closed);
        }
        let areas = areas(self.surface, &polygons);
        self.out.measures.area_covered += areas[0];
        self.out.measures.area_3d += areas[1];
    }

    fn line(&mut self, line: &[Vec2]) {
        for pair in line.windows(2) {
            self.segment(pair[0], pair[1]);
        }
        self.finish();
    }

    fn finish(&mut self) {
        if !self.line.is_empty() {
            self.out.measures.vertices += self.line.len() as u64;
            self.out.lines.push(std::mem::take(&mut self.line));
        }
    }

    fn segment(&mut self, a: Vec2, b: Vec2) {
        let mut stops = std::mem::take(&mut self.stops);
        let (from, to) = (self.surface.to_lattice(a), self.surface.to_lattice(b));
        crossings(self.surface, from, to, &mut stops);
        let place = |stop: &Stop| match stop.t {
            0.0 => a,
            1.0 => b,
            _ => self.surface.from_lattice(stop.at),
        };
        for pair in stops.windows(2) {
            let (p, q) = (place(&pair[0]), place(&pair[1]));
            match self.piece(pair[0].at, pair[1].at) {
                Some(heights) => self.add(p, q, &heights),
                None => {
                    self.out.measures.length_cut += length([q[0] - p[0], q[1] - p[1], 0.0]);
                    self.finish();
                }
            }
        }
        self.stops = stops;
    }

    /// Heights at even steps of a piece that crosses no edge; none where it has no surface.
    fn piece(&self, a: Vec2, b: Vec2) -> Option<Vec<f64>> {
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let (column, row) = self.surface.square_at(middle)?;
        let square = self.surface.square(column, row);
        let corner = [column as f64, row as f64];
        // A piece ends on its own square's border, up to rounding.
        let local = |p: Vec2| [0, 1].map(|k| (p[k] - corner[k]).clamp(0.0, 1.0));
        let (p, q) = (local(a), local(b));
        let base = self.surface.base();
        let [z00, z10, z01, z11] = square.z;
        match self.surface.kind() {
            Kind::Tin => {
                let m = local(middle);
                let half = if m[0] + m[1] <= 1.0 {
                    Half::First
                } else {
                    Half::Last
                };
                if !square.has(half) {
                    return None;
                }
                let at = |p: Vec2| match half {
                    Half::First => z00 + (p[0] * (z10 - z00) + p[1] * (z01 - z00)),
                    Half::Last => z11 + ((1.0 - p[0]) * (z01 - z11) + (1.0 - p[1]) * (z10 - z11)),
                };
                Some(vec![base + at(p), base + at(q)])
            }
            Kind::Bilinear => {
                let twist = (z11 - z01) - (z10 - z00);
                if twist.is_nan() {
                    return None;
                }
                // A quarter of the second difference is how far the middle of a piece is off.
                let bend = ((q[0] - p[0]) * (q[1] - p[1]) * twist).abs() * 0.25;
                let parts = (bend / self.params.max_error)
                    .sqrt()
                    .ceil()
                    .clamp(1.0, 4096.0);
                let at = |k: usize| {
                    let t = k as f64 / parts;
                    let [s, t] = [0, 1].map(|i| p[i] + t * (q[i] - p[i]));
                    let first = z00 + s * (z10 - z00);
                    base + (first + t * (z01 + s * (z11 - z01) - first))
                };
                Some((0..=parts as usize).map(at).collect())
            }
        }
    }

    /// Adds a piece with heights at even steps.
    fn add(&mut self, a: Vec2, b: Vec2, heights: &[f64]) {
        let last = heights.len() - 1;
        if self.line.is_empty() {
            self.line.push([a[0], a[1], heights[0]]);
        }
        for (k, z) in heights.iter().enumerate().skip(1) {
            let p = if k == last {
                b
            } else {
                let t = k as f64 / last as f64;
                [0, 1].map(|i| a[i] + t * (b[i] - a[i]))
            };
            let to = [p[0], p[1], *z];
            if let Some(&from) = self.line.last() {
                let step = sub(to, from);
                self.out.measures.length_3d += length(step);
                self.out.measures.length_2d += length([step[0], step[1], 0.0]);
            }
            self.line.push(to);
        }
    }
}

/// The ends of a segment of the lattice and where it crosses edges, in order; crossings have the edge's own
/// coordinate exactly.
fn crossings(surface: &Surface, a: Vec2, b: Vec2, stops: &mut Vec<Stop>) {
    stops.clear();
    stops.push(Stop { t: 0.0, at: a });
    let [columns, rows] = surface.squares().map(|n| n as f64);
    let at = |t: f64| [0, 1].map(|k| a[k] + t * (b[k] - a[k]));
    // Lines of the lattice that a coordinate passes, the ends left out; beyond the surface there are none.
    let passed = |from: f64, to: f64, most: f64| {
        let (low, high) = (from.min(to), from.max(to));
        let (first, last) = ((low.floor() + 1.0).max(0.0), (high.ceil() - 1.0).min(most));
        let count = if first <= last {
            (last - first) as usize + 1
        } else {
            0
        };
        (0..count).map(move |k| {
            let level = first + k as f64;
            (level, (level - from) / (to - from))
        })
    };
    for (u, t) in passed(a[0], b[0], columns) {
        stops.push(Stop {
            t,
            at: [u, at(t)[1]],
        });
    }
    for (v, t) in passed(a[1], b[1], rows) {
        stops.push(Stop {
            t,
            at: [at(t)[0], v],
        });
    }
    if surface.kind() == Kind::Tin {
        for (sum, t) in passed(a[0] + a[1], b[0] + b[1], columns + rows) {
            let u = at(t)[0];
            let inside = at(t);
            if (0.0..=columns).contains(&inside[0]) && (0.0..=rows).contains(&inside[1]) {
                stops.push(Stop {
                    t,
                    at: [u, sum - u],
                });
            }
        }
    }
    stops.push(Stop { t: 1.0, at: b });
    stops.sort_by(|p, q| p.t.total_cmp(&q.t));
    // Where lines of the lattice meet, one stop is enough.
    stops.dedup_by(|later, kept| later.t == kept.t);
}

/// Area of polygons on the map that has a surface, and along the surface.
///
/// By Green's theorem: the integral of the weight from the left of a row to the polygon's border, along the
/// border. The weight is constant in a triangle and the border a straight piece, so that it is exact.
fn areas(surface: &Surface, polygons: &[Polygon]) -> [f64; 2] {
    let mut pieces: Vec<(usize, Vec2, Vec2)> = Vec::new();
    let [columns, rows] = surface.squares();
    let mut stops = Vec::new();
    let tin = surface.clone_as(Kind::Tin);
    for ring in polygons.iter().flat_map(|polygon| &polygon.rings) {
        for (a, b) in crate::vector::rings::edges(ring) {
            crossings(&tin, tin.to_lattice(a), tin.to_lattice(b), &mut stops);
            for pair in stops.windows(2) {
                let v = 0.5 * (pair[0].at[1] + pair[1].at[1]);
                if v > 0.0 && v < rows as f64 && pair[0].at[1] != pair[1].at[1] {
                    pieces.push(((v as usize).min(rows - 1), pair[0].at, pair[1].at));
                }
            }
        }
    }
    pieces.sort_by_key(|(row, _, _)| *row);
    let reach = |pick: fn(f64, f64) -> f64, start: f64| {
        let ends = pieces.iter().flat_map(|(_, a, b)| [a[0], b[0]]);
        ends.fold(start, pick).clamp(0.0, columns as f64)
    };
    let first = reach(f64::min, f64::INFINITY).floor() as usize;
    let last = (reach(f64::max, f64::NEG_INFINITY).ceil() as usize).min(columns);
    let mut sums = [0.0; 2];
    for row in pieces.chunk_by(|a, b| a.0 == b.0) {
        let weights = Row::new(&tin, row[0].0, first, last);
        for (_, a, b) in row {
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            let to_left = weights.to_left(middle);
            for (sum, weight) in sums.iter_mut().zip(to_left) {
                *sum += weight * (b[1] - a[1]);
            }
        }
    }
    // The lattice may be mirrored on the map, where rings go around the other way.
    let [across, down] = surface.steps();
    let sign = (across[0] * down[1] - across[1] * down[0]).signum();
    sums.map(|sum| sum * sign * surface.square_area())
}

/// Integrals of weights along a row of squares: of 1 where there is a surface, and of its area for the map's.
struct Row {
    first: usize,
    row: usize,
    /// For each square: both weights of its first and of its last triangle.
    weights: Vec<[[f64; 2]; 2]>,
    /// The sums of the weights to the left of each square.
    before: Vec<[[f64; 2]; 2]>,
}

impl Row {
    fn new(surface: &Surface, row: usize, first: usize, last: usize) -> Row {
        let mut sum = [[0.0; 2]; 2];
        let (mut weights, mut before) = (Vec::new(), Vec::new());
        for column in first..last {
            let square = surface.square(column, row);
            let weight = [Half::First, Half::Last].map(|half| {
                if !square.has(half) {
                    return [0.0; 2];
                }
                let [_, du, dv] = square.plane(half);
                [1.0, 1.0 / surface.normal_of([du, dv])[2]]
            });
            before.push(sum);
            for (half, w) in weight.iter().enumerate() {
                for (k, w) in w.iter().enumerate() {
                    sum[half][k] += w;
                }
            }
            weights.push(weight);
        }
        before.push(sum);
        weights.push([[0.0; 2]; 2]);
        Row {
            first,
            row,
            weights,
            before,
        }
    }

    /// Both integrals from the start of the row to a place.
    fn to_left(&self, p: Vec2) -> [f64; 2] {
        let t = (p[1] - self.row as f64).clamp(0.0, 1.0);
        let u = (p[0] - self.first as f64).clamp(0.0, (self.weights.len() - 1) as f64);
        let square = u as usize;
        let s = u - square as f64;
        // The first triangle takes the row up to 1 - t, the last one the rest.
        let (in_first, in_last) = (s.min(1.0 - t), (s - (1.0 - t)).max(0.0));
        let (before, own) = (&self.before[square], &self.weights[square]);
        [0, 1].map(|k| {
            (1.0 - t) * before[0][k] + t * before[1][k] + in_first * own[0][k] + in_last * own[1][k]
        })
    }
}

#[cfg(test)]
mod tests;
