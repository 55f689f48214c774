//! Rings made fit for counting: normalised, and which points they go around.

use super::{Polygon, Vec2};
use crate::numeric::predicates::orient2d;
use schemars::JsonSchema;
use serde::Serialize;

/// Which points a set of rings covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fill {
    /// Those that the rings go around, however often.
    #[default]
    NonZero,
    /// Those that the rings go around an odd number of times.
    EvenOdd,
}

impl Fill {
    /// Whether a point with this winding number is covered.
    #[inline]
    pub fn covers(self, winding: i32) -> bool {
        match self {
            Fill::NonZero => winding != 0,
            Fill::EvenOdd => winding & 1 != 0,
        }
    }
}

/// What normalising left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Dropped {
    /// Vertices equal to the one before.
    pub repeated_points: u64,
    /// Rings and lines with too few different places in a row: rings under three, lines under two.
    pub too_short: u64,
    /// Rings whose places all lie on one line.
    pub zero_area: u64,
}

impl Dropped {
    /// The counts of both.
    pub fn plus(self, other: Dropped) -> Dropped {
        Dropped {
            repeated_points: self.repeated_points + other.repeated_points,
            too_short: self.too_short + other.too_short,
            zero_area: self.zero_area + other.zero_area,
        }
    }
}

/// Twice the area a ring goes around counter-clockwise, relative to its first vertex; 0 for no ring.
///
/// In the square of the map's unit. Cost: linear.
pub fn twice_signed_area(ring: &[Vec2]) -> f64 {
    let Some(&origin) = ring.first() else {
        return 0.0;
    };
    let local = |p: Vec2| [p[0] - origin[0], p[1] - origin[1]];
    let pairs = ring.windows(2).map(|pair| {
        let (a, b) = (local(pair[0]), local(pair[1]));
        a[0] * b[1] - a[1] * b[0]
    });
    pairs.sum()
}

/// A line without repeated places; none when fewer than two are left.
pub fn normalise_line(line: &[Vec2], dropped: &mut Dropped) -> Option<Vec<Vec2>> {
    let mut kept = line.to_vec();
    kept.dedup();
    dropped.repeated_points += (line.len() - kept.len()) as u64;
    if kept.len() < 2 {
        dropped.too_short += 1;
        return None;
    }
    Some(kept)
}

/// Polygons with outer rings counter-clockwise and holes clockwise, and what was left out.
///
/// Repeated vertices (also a last one equal to the first), rings of under three vertices and rings all
/// on one line go; so do the holes of an outer ring that goes. A ring whose signed area is 0, as that of
/// an even figure of eight, stays as it is. Cost: linear.
pub fn normalise(polygons: &[Polygon]) -> (Vec<Polygon>, Dropped) {
    let mut dropped = Dropped::default();
    let mut out = Vec::with_capacity(polygons.len());
    for polygon in polygons {
        let mut rings = Vec::with_capacity(polygon.rings.len());
        for (index, ring) in polygon.rings.iter().enumerate() {
            match normalise_ring(ring, index == 0, &mut dropped) {
                Some(ring) => rings.push(ring),
                None if index == 0 => break,
                None => {}
            }
        }
        if !rings.is_empty() {
            out.push(Polygon { rings });
        }
    }
    (out, dropped)
}

fn normalise_ring(ring: &[Vec2], outer: bool, dropped: &mut Dropped) -> Option<Vec<Vec2>> {
    let mut kept = ring.to_vec();
    kept.dedup();
    while kept.len() > 1 && kept.first() == kept.last() {
        kept.pop();
    }
    dropped.repeated_points += (ring.len() - kept.len()) as u64;
    if kept.len() < 3 {
        dropped.too_short += 1;
        return None;
    }
    if kept.windows(3).all(|w| orient2d(w[0], w[1], w[2]) == 0) {
        dropped.zero_area += 1;
        return None;
    }
    let area = twice_signed_area(&kept);
    if area != 0.0 && (area > 0.0) != outer {
        kept.reverse();
    }
    Some(kept)
}

/// Which side of the line from `a` to `b` a point is on: 1 left, -1 right, never 0 while `a` is not `b`.
///
/// The point stands for one that is moved to the right by less than any number and up by less still, so
/// that every point is on one side, and points on a left or lower border of an area are inside.
#[inline]
pub fn side(a: Vec2, b: Vec2, p: Vec2) -> i32 {
    match orient2d(a, b, p) {
        0 if b[1] > a[1] => -1,
        0 if b[1] < a[1] => 1,
        0 if b[0] > a[0] => 1,
        0 => -1,
        sign => sign,
    }
}

/// How an edge changes the count of a ray that runs from `p` to the right: 1 where it goes up across it,
/// -1 where down, 0 where they do not meet.
#[inline]
pub fn crossing(a: Vec2, b: Vec2, p: Vec2) -> i32 {
    if a[1] <= p[1] && p[1] < b[1] {
        i32::from(side(a, b, p) > 0)
    } else if b[1] <= p[1] && p[1] < a[1] {
        -i32::from(side(a, b, p) < 0)
    } else {
        0
    }
}

/// How often the rings go around a point counter-clockwise.
///
/// Exact. Points on a left or lower border belong to the area, those on a right or upper one do not: areas
/// that share a border share no point. Cost: linear; [`super::index::Index`] answers faster.
pub fn winding<'a>(rings: impl IntoIterator<Item = &'a [Vec2]>, p: Vec2) -> i32 {
    let mut count = 0;
    for ring in rings {
        for (a, b) in edges(ring) {
            count += crossing(a, b, p);
        }
    }
    count
}

/// The edges of a ring in order, the closing one first.
pub fn edges(ring: &[Vec2]) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
    let before = ring.last().into_iter().chain(ring.iter());
    before.copied().zip(ring.iter().copied())
}

/// Square of the distance from a point to a segment, and where on it the nearest place is, from 0 to 1.
#[inline]
pub fn distance_squared(a: Vec2, b: Vec2, p: Vec2) -> (f64, f64) {
    let d = [b[0] - a[0], b[1] - a[1]];
    let e = [p[0] - a[0], p[1] - a[1]];
    let length = d[0] * d[0] + d[1] * d[1];
    let along = if length > 0.0 {
        ((e[0] * d[0] + e[1] * d[1]) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let off = [e[0] - along * d[0], e[1] - along * d[1]];
    (off[0] * off[0] + off[1] * off[1], along)
}

/// Distance from a point to a line of segments, in the map's unit; infinite for a line of no place.
pub fn distance_to_line(line: &[Vec2], p: Vec2) -> f64 {
    let least = match line {
        [] => f64::INFINITY,
        [only] => distance_squared(*only, *only, p).0,
        _ => {
            let all = line.windows(2).map(|w| distance_squared(w[0], w[1], p).0);
            all.fold(f64::INFINITY, f64::min)
        }
    };
    least.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Vec2; 4] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];

    fn count(rings: &[Vec<Vec2>], p: Vec2) -> i32 {
        winding(rings.iter().map(Vec::as_slice), p)
    }

    #[test]
    fn left_and_lower_borders_are_inside() {
        let square = [SQUARE.to_vec()];
        for (p, inside) in [
            ([1.0, 1.0], true),
            ([0.0, 1.0], true),
            ([1.0, 0.0], true),
            ([0.0, 0.0], true),
            ([2.0, 1.0], false),
            ([1.0, 2.0], false),
            ([2.0, 0.0], false),
            ([0.0, 2.0], false),
            ([-1.0, 0.0], false),
            ([3.0, 1.0], false),
        ] {
            assert_eq!(count(&square, p) != 0, inside, "{p:?}");
        }
    }

    #[test]
    fn areas_around_a_point_share_it_once() {
        // Four triangles around a corner of none of their boxes; each point of a lattice is in one.
        let c = [0.5, 0.25];
        let triangles: Vec<[Vec<Vec2>; 1]> = (0..4)
            .map(|k| [vec![SQUARE[k], SQUARE[(k + 1) % 4], c]])
            .collect();
        for j in 0..8 {
            for i in 0..8 {
                let p = [f64::from(i) * 0.25, f64::from(j) * 0.25];
                let sum: i32 = triangles.iter().map(|t| count(t, p)).sum();
                assert_eq!(sum, 1, "{p:?}");
            }
        }
    }

    #[test]
    fn rings_are_turned_and_cleaned() {
        let mut clockwise = SQUARE.to_vec();
        clockwise.reverse();
        clockwise.push(clockwise[0]);
        let hole = vec![[0.5, 0.5], [1.5, 0.5], [1.5, 0.5], [1.0, 1.5]];
        let flat = vec![[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]];
        let given = [
            Polygon {
                rings: vec![clockwise, hole, vec![[1.0, 1.0], [1.0, 1.0]]],
            },
            Polygon { rings: vec![flat] },
        ];
        let (got, dropped) = normalise(&given);
        let expected = Dropped {
            repeated_points: 3,
            too_short: 1,
            zero_area: 1,
        };
        assert_eq!(dropped, expected);
        assert_eq!(got.len(), 1);
        assert_eq!(got[0].rings.len(), 2);
        assert_eq!(twice_signed_area(&got[0].rings[0]), 8.0);
        assert!(twice_signed_area(&got[0].rings[1]) < 0.0);
        assert_eq!(count(&got[0].rings, [1.0, 0.75]), 0);
        assert_eq!(count(&got[0].rings, [0.25, 0.25]), 1);
    }

    #[test]
    fn a_figure_of_eight_keeps_both_lobes() {
        let eight = vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        let (got, _) = normalise(&[Polygon { rings: vec![eight] }]);
        let [left, right] = [[0.25, 1.0], [1.75, 1.0]].map(|p| count(&got[0].rings, p));
        assert_eq!(left, -right);
        assert!(Fill::NonZero.covers(left) && Fill::EvenOdd.covers(right));
    }

    #[test]
    fn distances_are_to_the_nearest_place() {
        let line = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]];
        assert_eq!(distance_to_line(&line, [2.0, 1.0]), 1.0);
        assert_eq!(distance_to_line(&line, [7.0, 7.0]), 5.0);
        assert_eq!(distance_to_line(&line[..1], [3.0, 4.0]), 5.0);
        assert_eq!(distance_to_line(&[], [3.0, 4.0]), f64::INFINITY);
    }
}
