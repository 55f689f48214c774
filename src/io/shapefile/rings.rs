//! Rings of a shape as polygons: which holes are in which outer ring.

use crate::vector::{Polygon, Vec2, twice_area};

/// Polygons, and what was put right.
#[derive(Debug, Default)]
pub struct Settled {
    pub polygons: Vec<Polygon>,
    /// Rings of less than three places were left out.
    pub is_short: bool,
    /// Rings were closed.
    pub is_unclosed: bool,
    /// Holes in no outer ring became polygons.
    pub has_orphans: bool,
}

/// Sorts rings by the way round they go: clockwise is outside.
///
/// A hole belongs to the smallest outer ring around it, of equals the first. Where no ring goes clockwise
/// all are outside, as some writers have it. Cost: holes times places of outer rings.
pub fn settle(parts: Vec<Vec<Vec2>>) -> Settled {
    let mut settled = Settled::default();
    let mut rings = Vec::with_capacity(parts.len());
    for mut ring in parts {
        match (ring.first(), ring.last()) {
            (Some(first), Some(last)) if first == last && ring.len() > 1 => {
                ring.pop();
            }
            _ => settled.is_unclosed = true,
        }
        if ring.len() < 3 {
            settled.is_short = true;
        } else {
            rings.push(ring);
        }
    }
    let has_outer = rings.iter().any(|ring| twice_area(ring) <= 0.0);
    let mut holes = Vec::new();
    let mut areas = Vec::new();
    for ring in rings {
        let area = twice_area(&ring);
        if area > 0.0 && has_outer {
            holes.push(ring);
        } else {
            areas.push(area.abs());
            settled.polygons.push(Polygon { rings: vec![ring] });
        }
    }
    for hole in holes {
        let around = |n: &usize| is_around(&settled.polygons[*n].rings[0], &hole);
        let outer = (0..areas.len()).filter(around);
        match outer.min_by(|a, b| areas[*a].total_cmp(&areas[*b])) {
            Some(outer) => settled.polygons[outer].rings.push(hole),
            None => {
                settled.has_orphans = true;
                areas.push(twice_area(&hole));
                settled.polygons.push(Polygon { rings: vec![hole] });
            }
        }
    }
    settled
}

/// Whether a hole is within a ring: the first place of it that is not on the ring is.
fn is_around(outer: &[Vec2], hole: &[Vec2]) -> bool {
    let mut sides = hole.iter().filter_map(|place| is_inside(outer, *place));
    sides.next().unwrap_or(true)
}

/// Whether a place is inside a ring; none where it is on it.
fn is_inside(ring: &[Vec2], [x, y]: Vec2) -> Option<bool> {
    let mut inside = false;
    let next = ring.iter().cycle().skip(1);
    for ([ax, ay], [bx, by]) in ring.iter().zip(next) {
        let coord = |x, y| robust::Coord { x, y };
        let side = robust::orient2d(coord(*ax, *ay), coord(*bx, *by), coord(x, y));
        let is_between = |a: f64, b: f64, at: f64| a.min(b) <= at && at <= a.max(b);
        if side == 0.0 && is_between(*ax, *bx, x) && is_between(*ay, *by, y) {
            return None;
        }
        if (*ay > y) != (*by > y) && (side > 0.0) == (by > ay) {
            inside = !inside;
        }
    }
    Some(inside)
}
