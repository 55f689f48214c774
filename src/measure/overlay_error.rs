//! How many pixels of an overlay show another feature than the one that lies there.

use crate::camera::{Camera, Lens, Size};
use crate::terrain::overlay::{Cap, Drawn, Join, Overlay, Unit};
use crate::terrain::surface::Surface;
use crate::vector::rings::Fill;
use crate::vector::{Shape, Vec2};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// Pixels of an overlay against the definition of its features.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OverlayError {
    /// Pixels that show terrain.
    pub terrain: u64,
    /// Pixels that are to show a feature.
    pub covered: u64,
    /// Pixels next to one that is to show another feature, or none.
    pub boundary: u64,
    /// Pixels that show the wrong one.
    pub wrong: u64,
    /// Wrong pixels on a boundary.
    pub near_edge: u64,
    /// Wrong pixels elsewhere.
    pub interior: u64,
    /// Pixels of the sky with a feature.
    pub sky: u64,
}

/// A feature by its definition, in places relative to an origin near it.
struct Target<'a> {
    drawn: &'a Drawn<'a>,
    parts: Vec<Vec<Vec2>>,
    halves: Vec<Vec<f64>>,
    low: Vec2,
    high: Vec2,
}

/// The wrong pixels of an overlay: each place seen is tested against each feature by its definition, without
/// index, polyhedron or texture.
///
/// Cost: pixels by the features whose box they are in, by these features' vertices.
pub fn overlay_error(
    surface: &Surface,
    features: &[Drawn],
    camera: &Camera,
    size: Size,
    overlay: &Overlay,
) -> OverlayError {
    let origin = surface.from_lattice([0.0, 0.0]);
    let targets: Vec<Target> = features
        .iter()
        .map(|drawn| target(drawn, origin, surface, camera, size))
        .collect();
    let expected: Vec<Option<u32>> = overlay
        .seen
        .par_iter()
        .map(|seen| {
            if seen.is_sky() {
                return None;
            }
            let p = surface.from_lattice(seen.at);
            let p = [p[0] - origin[0], p[1] - origin[1]];
            let last = targets.iter().rposition(|target| target.covers(p));
            Some(last.map_or(0, |k| k as u32 + 1))
        })
        .collect();
    let width = size.width.max(1);
    let mut out = OverlayError::default();
    for (at, (expected_id, got)) in expected.iter().zip(&overlay.ids).enumerate() {
        let Some(id) = *expected_id else {
            out.sky += u64::from(*got != 0);
            continue;
        };
        let (x, y) = (at % width, at / width);
        let columns = x.saturating_sub(1)..=(x + 1).min(size.width - 1);
        let mut rows = y.saturating_sub(1)..=(y + 1).min(size.height - 1);
        let is_boundary =
            rows.any(|y| columns.clone().any(|x| expected[y * width + x] != Some(id)));
        let wrong = id != *got;
        out.terrain += 1;
        out.covered += u64::from(id != 0);
        out.boundary += u64::from(is_boundary);
        out.wrong += u64::from(wrong);
        out.near_edge += u64::from(wrong && is_boundary);
        out.interior += u64::from(wrong && !is_boundary);
    }
    out
}

fn target<'a>(
    drawn: &'a Drawn<'a>,
    origin: Vec2,
    surface: &Surface,
    camera: &Camera,
    size: Size,
) -> Target<'a> {
    let local = |p: &Vec2| [p[0] - origin[0], p[1] - origin[1]];
    let part = |all: &Vec<Vec2>| all.iter().map(local).collect::<Vec<_>>();
    let parts: Vec<Vec<Vec2>> = match drawn.shape {
        Shape::Empty => Vec::new(),
        Shape::Points(all) => vec![part(all)],
        Shape::Lines(all) => all.iter().map(part).collect(),
        Shape::Polygons(all) => oriented(all.iter().map(|p| p.rings.iter().map(part).collect())),
    };
    let half = |p: &Vec2| {
        let width = 0.5 * drawn.style.width;
        match drawn.style.unit {
            Unit::Map => width,
            Unit::Pixels => width * pixel(surface, *p, origin, camera, size),
        }
    };
    let halves: Vec<Vec<f64>> = match drawn.shape {
        Shape::Points(_) | Shape::Lines(_) => {
            let of = |part: &Vec<Vec2>| part.iter().map(half).collect();
            parts.iter().map(of).collect()
        }
        _ => Vec::new(),
    };
    // Mitres reach up to four half widths.
    let most = halves.iter().flatten().fold(0.0, |m: f64, h| m.max(*h)) * 4.0;
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in parts.iter().flatten() {
        for a in 0..2 {
            low[a] = low[a].min(p[a] - most);
            high[a] = high[a].max(p[a] + most);
        }
    }
    Target {
        drawn,
        parts,
        halves,
        low,
        high,
    }
}

/// Rings with outer ones and holes turned against each other; what has no area does not matter.
fn oriented(polygons: impl Iterator<Item = Vec<Vec<Vec2>>>) -> Vec<Vec<Vec2>> {
    let mut out = Vec::new();
    for rings in polygons {
        for (k, mut ring) in rings.into_iter().enumerate() {
            let o = ring.first().copied().unwrap_or_default();
            let mut area = 0.0;
            for i in 0..ring.len() {
                let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
                area += (a[0] - o[0]) * (b[1] - o[1]) - (b[0] - o[0]) * (a[1] - o[1]);
            }
            if (k == 0 && area < 0.0) || (k > 0 && area > 0.0) {
                ring.reverse();
            }
            out.push(ring);
        }
    }
    out
}

/// Length of a pixel on the map at a place of the surface.
fn pixel(surface: &Surface, p: Vec2, origin: Vec2, camera: &Camera, size: Size) -> f64 {
    let place = [p[0] + origin[0], p[1] + origin[1]];
    let z = surface.height(place).unwrap_or(surface.base());
    match camera.lens {
        Lens::Orthographic { height } => camera.unit * height / size.height as f64,
        Lens::Perspective { fov_y } => {
            let eye = camera.eye();
            let to = [place[0] - eye[0], place[1] - eye[1], z - eye[2]];
            let depth = -(0..3).map(|a| to[a] * camera.axes[2][a]).sum::<f64>();
            let depth = depth.max(camera.near().unwrap_or(0.0) * camera.unit);
            2.0 * depth * (0.5 * fov_y).tan() / size.height as f64
        }
    }
}

impl Target<'_> {
    fn covers(&self, p: Vec2) -> bool {
        if (0..2).any(|a| p[a] < self.low[a] || p[a] > self.high[a]) {
            return false;
        }
        match self.drawn.shape {
            Shape::Empty => false,
            Shape::Points(_) => {
                let discs = self.parts[0].iter().zip(&self.halves[0]);
                let mut discs = discs.filter(|(_, h)| **h > 0.0);
                discs.any(|(c, h)| (p[0] - c[0]).hypot(p[1] - c[1]) <= *h)
            }
            Shape::Lines(_) => {
                let mut lines = self.parts.iter().zip(&self.halves);
                lines.any(|(line, halves)| self.line_covers(line, halves, p))
            }
            Shape::Polygons(_) => {
                let count: i32 = self.parts.iter().map(|ring| turns(ring, p)).sum();
                match self.drawn.style.fill {
                    Fill::NonZero => count != 0,
                    Fill::EvenOdd => count % 2 != 0,
                }
            }
        }
    }

    fn line_covers(&self, line: &[Vec2], halves: &[f64], p: Vec2) -> bool {
        let mut line = line.to_vec();
        let mut halves = halves.to_vec();
        for k in (1..line.len()).rev() {
            if line[k] == line[k - 1] {
                line.remove(k);
                halves.remove(k);
            }
        }
        let last = line.len() - 1;
        if last == 0 {
            return false;
        }
        let closed = last > 1 && line[0] == line[last];
        let style = self.drawn.style;
        let near = |k: usize| (p[0] - line[k][0]).hypot(p[1] - line[k][1]) <= halves[k];
        let segments = (0..last).any(|k| {
            let (a, b) = (line[k], line[k + 1]);
            let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
            let length = d[0].hypot(d[1]);
            let along = (d[0] * e[0] + d[1] * e[1]) / (length * length);
            let off = (d[0] * e[1] - d[1] * e[0]).abs() / length;
            let half = halves[k] + along * (halves[k + 1] - halves[k]);
            (0.0..=1.0).contains(&along) && off <= half
        });
        let joins = (0..=last).any(|k| {
            let is_end = k == 0 || k == last;
            match (is_end && !closed, style.join, style.cap) {
                (true, _, Cap::Round) | (false, Join::Round, _) => near(k),
                (false, Join::Mitre, _) => {
                    let before = if k == 0 { line[last - 1] } else { line[k - 1] };
                    let after = if k == last { line[1] } else { line[k + 1] };
                    in_mitre(before, line[k], after, halves[k], p)
                }
                (true, _, Cap::Butt) => false,
            }
        });
        segments || joins
    }
}

/// Whether a point is in the corner outside a bend: between the ends of both segments' sides, and within both
/// strips, or within the chord where the corner is too far.
fn in_mitre(a: Vec2, v: Vec2, b: Vec2, half: f64, p: Vec2) -> bool {
    let unit = |d: Vec2| {
        let l = d[0].hypot(d[1]);
        [d[0] / l, d[1] / l]
    };
    let (d, e) = (
        unit([v[0] - a[0], v[1] - a[1]]),
        unit([b[0] - v[0], b[1] - v[1]]),
    );
    let turn = d[0] * e[1] - d[1] * e[0];
    let side = -turn.signum();
    let q = [p[0] - v[0], p[1] - v[1]];
    let beyond = d[0] * q[0] + d[1] * q[1] >= 0.0 && e[0] * q[0] + e[1] * q[1] <= 0.0;
    let (off, next) = (
        side * (d[0] * q[1] - d[1] * q[0]),
        side * (e[0] * q[1] - e[1] * q[0]),
    );
    if !beyond || turn == 0.0 {
        return false;
    }
    let cosine_of_half = (0.5 * (1.0 + d[0] * e[0] + d[1] * e[1])).sqrt();
    if cosine_of_half >= 0.25 {
        return off <= half && next <= half;
    }
    // Along the way to the corner, the chord is at the half width's share.
    let out = unit([side * (-d[1] - e[1]), side * (d[0] + e[0])]);
    q[0] * out[0] + q[1] * out[1] <= half * cosine_of_half
}

/// How often a ring goes around a point: quarter turns of the way to its vertices.
fn turns(ring: &[Vec2], p: Vec2) -> i32 {
    let quadrant = |v: Vec2| match (v[0] > p[0], v[1] > p[1]) {
        (true, true) => 0,
        (false, true) => 1,
        (false, false) => 2,
        (true, false) => 3,
    };
    let mut quarters = 0;
    for k in 0..ring.len() {
        let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
        quarters += match (quadrant(b) - quadrant(a)) & 3 {
            0 => 0,
            1 => 1,
            3 => -1,
            _ => {
                let cross = (a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0]);
                if cross > 0.0 { 2 } else { -2 }
            }
        };
    }
    quarters / 4
}

#[cfg(test)]
mod tests;
