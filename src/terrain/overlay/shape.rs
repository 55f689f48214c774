//! Features as areas on the map: lines and points get their width.

use super::params::{Cap, Join, Style};
use crate::vector::index::Area;
use crate::vector::rings::{Dropped, Fill, normalise, normalise_line};
use crate::vector::{Shape, Vec2};

/// Mitres longer than this many half widths are cut.
const MITRE_LIMIT: f64 = 4.0;

/// A shape as an area, in local coordinates.
///
/// `local` moves a place there; `half` is half the width at a local place. Each segment of a line is a ring of
/// its own, a rectangle that narrows where the width does. Cost: linear in the vertices.
pub fn area(
    shape: &Shape,
    style: &Style,
    local: impl Fn(Vec2) -> Vec2,
    half: impl Fn(Vec2) -> f64,
    dropped: &mut Dropped,
) -> Area {
    let mut area = Area {
        fill: style.fill,
        ..Area::default()
    };
    match shape {
        Shape::Empty => {}
        Shape::Points(all) => {
            for p in all.iter().map(|p| local(*p)) {
                let radius = half(p);
                if radius > 0.0 {
                    area.discs.push((p, radius));
                }
            }
        }
        Shape::Lines(all) => {
            area.fill = Fill::NonZero;
            for line in all {
                if let Some(line) = normalise_line(line, dropped) {
                    let line: Vec<Vec2> = line.into_iter().map(&local).collect();
                    stroke(&line, style, &half, &mut area);
                }
            }
        }
        Shape::Polygons(all) => {
            let (polygons, lost) = normalise(all);
            *dropped = dropped.plus(lost);
            let rings = polygons.into_iter().flat_map(|polygon| polygon.rings);
            area.rings = rings
                .map(|ring| ring.into_iter().map(&local).collect())
                .collect();
        }
    }
    area
}

fn stroke(line: &[Vec2], style: &Style, half: &impl Fn(Vec2) -> f64, area: &mut Area) {
    let halves: Vec<f64> = line.iter().map(|p| half(*p)).collect();
    if halves.iter().all(|h| *h <= 0.0) {
        return;
    }
    let mut normals: Vec<Vec2> = Vec::with_capacity(line.len());
    for pair in line.windows(2) {
        let d = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = d[0].hypot(d[1]);
        normals.push(if length > 0.0 {
            [-d[1] / length, d[0] / length]
        } else {
            [0.0; 2]
        });
    }
    for (k, n) in normals.iter().enumerate() {
        let beside = |i: usize, side: f64| {
            let h = side * halves[i];
            [line[i][0] + h * n[0], line[i][1] + h * n[1]]
        };
        if *n != [0.0; 2] {
            // Counter-clockwise: the normal is to the left.
            let ring = [
                beside(k, -1.0),
                beside(k + 1, -1.0),
                beside(k + 1, 1.0),
                beside(k, 1.0),
            ];
            area.rings.push(ring.to_vec());
        }
    }
    let last = line.len() - 1;
    for k in 1..last {
        match style.join {
            Join::Round => area.discs.push((line[k], halves[k])),
            Join::Mitre => area
                .rings
                .extend(mitre(line[k], halves[k], normals[k - 1], normals[k])),
        }
    }
    let closed = last > 1 && line[0] == line[last];
    match (closed, style.join, style.cap) {
        (true, Join::Round, _) | (false, _, Cap::Round) => {
            area.discs.push((line[0], halves[0]));
            if !closed {
                area.discs.push((line[last], halves[last]));
            }
        }
        (true, Join::Mitre, _) => {
            area.rings
                .extend(mitre(line[0], halves[0], normals[last - 1], normals[0]));
        }
        (false, _, Cap::Butt) => {}
    }
}

/// The wedge outside a bend between two segments with these left normals.
fn mitre(at: Vec2, half: f64, before: Vec2, after: Vec2) -> Option<Vec<Vec2>> {
    let turn = before[0] * after[1] - before[1] * after[0];
    if turn == 0.0 || half <= 0.0 {
        return None;
    }
    // The outside of a turn to the left is on the right.
    let side = if turn > 0.0 { -half } else { half };
    let off = |n: Vec2, h: f64| [at[0] + h * n[0], at[1] + h * n[1]];
    let mut ring = vec![at, off(before, side)];
    let cosine = before[0] * after[0] + before[1] * after[1];
    // The tip is 1 / cos(half the turn) half widths away.
    if 2.0 / (1.0 + cosine) <= MITRE_LIMIT * MITRE_LIMIT {
        let sum = [before[0] + after[0], before[1] + after[1]];
        ring.push(off(sum, side / (1.0 + cosine)));
    }
    ring.push(off(after, side));
    if crate::vector::rings::twice_signed_area(&ring) < 0.0 {
        ring.reverse();
    }
    Some(ring)
}
