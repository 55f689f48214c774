//! A way through the graph as a tunnel: its centreline, and how wide that is, certified.

use super::graph::{Graph, Metric};
use super::search::{CLOSED, Outside, Route};
use crate::numeric::vector::{add, length, scale, sub};
use crate::protein::clearance::{Ball, Clearance, Near};
use schemars::JsonSchema;
use serde::Serialize;

/// A place on a centreline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Stop {
    /// How far it is from the start, along the centreline.
    pub at: f64,
    /// The place, the centre of a ball.
    pub centre: [f64; 3],
    /// The clearance there: the largest radius of a ball that enters no atom.
    pub radius: f64,
    /// The nearest atom, as an index of the balls that were given.
    #[serde(skip)]
    pub ball: u32,
}

/// The narrowest place of a centreline.
#[derive(Debug, Clone, PartialEq)]
pub struct Narrowest {
    /// The least clearance along the centreline, exact but for rounding.
    pub radius: f64,
    /// Where it is.
    pub point: [f64; 3],
    /// The three nearest atoms there, nearest first.
    pub balls: Vec<u32>,
}

/// A way out.
#[derive(Debug, Clone, PartialEq)]
pub struct Tunnel {
    /// How wide the method takes it to be.
    pub width: f64,
    /// How wide its centreline is.
    pub narrowest: Narrowest,
    /// The corners of the centreline, from the start to the outside.
    pub centreline: Vec<[f64; 3]>,
    /// Balls at the corners of the centreline, where it is narrowest between them, and between.
    pub stops: Vec<Stop>,
    /// Length of the centreline.
    pub length: f64,
    /// That over the straight way between its ends.
    pub curvature: f64,
    /// The integral of `1 / r^2` along it.
    pub cost: f64,
    /// `exp(-cost)`: nearer to 1 the easier the way is (Chovancova et al. 2012).
    pub throughput: f64,
    /// Atoms within 3 units of the tunnel's surface, in order.
    pub lining: Vec<u32>,
}

/// A tunnel has about so many stops at most, whatever the step.
const MOST_STOPS: f64 = 1e5;

/// How far from the surface of a tunnel an atom still lines it.
pub const LINING: f64 = 3.0;

impl Tunnel {
    /// The end at the outside.
    pub fn exit(&self) -> [f64; 3] {
        self.centreline.last().copied().unwrap_or([f64::NAN; 3])
    }

    /// The tunnel along a centreline, with a ball at least every `step`; none for fewer than one point.
    pub fn along(
        centreline: Vec<[f64; 3]>,
        width: f64,
        step: f64,
        balls: &[Ball],
        clearance: &Clearance,
    ) -> Option<Self> {
        let narrowest = narrowest(&centreline, balls, clearance)?;
        let stops = stops(&centreline, step, balls, clearance)?;
        let length_of = stops.last()?.at;
        let straight = length(sub(*centreline.last()?, *centreline.first()?));
        let cost = cost(&stops, clearance);
        let mut lining = Vec::new();
        for stop in &stops {
            clearance.within(stop.centre, stop.radius + LINING, &mut lining);
        }
        lining.sort_unstable();
        lining.dedup();
        Some(Tunnel {
            width,
            narrowest,
            centreline,
            stops,
            length: length_of,
            curvature: if straight > 0.0 {
                length_of / straight
            } else {
                1.0
            },
            cost,
            throughput: (-cost).exp(),
            lining,
        })
    }
}

/// The corners of a way's centreline: dual vertices, and between them the narrowest points of gates.
pub fn centreline(graph: &mut Graph, route: &Route, outside: &Outside) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for (index, cell) in route.cells.iter().enumerate() {
        let is_outside = outside.has(*cell) && index > 0;
        // Along the dual edge the way ends where its width was measured to, at the next vertex.
        let is_measured = matches!(graph.metric(), Metric::Along);
        let centre = graph.node(*cell).centre;
        let is_place = centre.iter().all(|value| value.is_finite());
        let last_gate = route.slots.last().filter(|_| is_outside).copied();
        let gate = last_gate.and_then(|slot| graph.narrowest(route.cells[index - 1], slot));
        // A last gate that its edge does not cross is narrowest at one of its ends.
        if is_place && (!is_outside || is_measured || gate.is_none()) {
            points.push(centre);
        }
        if let Some(slot) = route.slots.get(index) {
            let crossing = graph.narrowest(*cell, *slot);
            points.extend(crossing.map(|crossing| crossing.point));
        }
    }
    points.dedup();
    if outside.is_whole() {
        cut_at_hull(graph, &mut points);
    }
    points
}

/// Ends a way where it first leaves the convex hull: from there it is free to go straight away from all
/// atoms, while dual vertices of flat cells at the hull may lie anywhere.
fn cut_at_hull(graph: &Graph, points: &mut Vec<[f64; 3]>) {
    let mut near = None;
    let mut is_inside = |p: [f64; 3]| {
        near = graph.triangulation.locate(p, near);
        near.is_some_and(|cell| graph.cell(cell).is_finite())
    };
    let Some(first) = points
        .iter()
        .position(|p| !is_inside(*p))
        .filter(|first| *first > 0)
    else {
        return;
    };
    // Between the last corner inside and the first outside, to the last bit or so.
    let (mut inner, mut outer) = (points[first - 1], points[first]);
    for _ in 0..200 {
        let middle = scale(add(inner, outer), 0.5);
        if middle == inner || middle == outer {
            break;
        }
        match is_inside(middle) {
            true => inner = middle,
            false => outer = middle,
        }
    }
    points.truncate(first);
    points.push(outer);
}

/// The narrowest place of a way with corners; of one point, that point.
pub fn narrowest(corners: &[[f64; 3]], balls: &[Ball], clearance: &Clearance) -> Option<Narrowest> {
    let first = *corners.first()?;
    let mut best = (clearance.nearest(first)?, first);
    for pair in corners.windows(2) {
        let near = clearance.along(pair[0], pair[1]);
        if near.distance < best.0.distance {
            let ball = &balls[near.ball as usize];
            best = (near, Clearance::closest_on_way(pair[0], pair[1], ball));
        }
    }
    let (Near { distance, .. }, point) = best;
    let several = clearance.several(point, 3);
    Some(Narrowest {
        radius: distance,
        point,
        balls: several.into_iter().map(|near| near.ball).collect(),
    })
}

/// Balls along a way: at its corners, at the narrowest place between two, and at least every `step`.
fn stops(
    corners: &[[f64; 3]],
    step: f64,
    balls: &[Ball],
    clearance: &Clearance,
) -> Option<Vec<Stop>> {
    let stop = |at: f64, centre: [f64; 3]| -> Option<Stop> {
        let Near { distance, ball } = clearance.nearest(centre)?;
        Some(Stop {
            at,
            centre,
            radius: distance,
            ball,
        })
    };
    let whole: f64 = corners
        .windows(2)
        .map(|pair| length(sub(pair[1], pair[0])))
        .sum();
    let step = step.max(whole / MOST_STOPS);
    let mut stops = vec![stop(0.0, *corners.first()?)?];
    let mut start = 0.0;
    for pair in corners.windows(2) {
        let way = sub(pair[1], pair[0]);
        let long = length(way);
        let near = clearance.along(pair[0], pair[1]);
        let tight = Clearance::closest_on_way(pair[0], pair[1], &balls[near.ball as usize]);
        let tight = length(sub(tight, pair[0]));
        let pieces = (long / step).ceil().max(1.0) as usize;
        let mut places: Vec<f64> = (1..pieces)
            .map(|k| long * k as f64 / pieces as f64)
            .collect();
        // The corners themselves are there already.
        if tight > 0.0 && tight < long {
            let at = places.partition_point(|place| *place < tight);
            places.insert(at, tight);
        }
        for place in places {
            stops.push(stop(start + place, add(pair[0], scale(way, place / long)))?);
        }
        stops.push(stop(start + long, pair[1])?);
        start += long;
    }
    Some(stops)
}

/// The integral of `1 / r^2` over the stops, by Simpson's rule between neighbours.
fn cost(stops: &[Stop], clearance: &Clearance) -> f64 {
    let slowness = |radius: f64| 1.0 / (radius * radius).max(CLOSED);
    let piece = |pair: &[Stop]| {
        let middle = scale(add(pair[0].centre, pair[1].centre), 0.5);
        let sum = slowness(pair[0].radius)
            + 4.0 * slowness(clearance.at(middle))
            + slowness(pair[1].radius);
        (pair[1].at - pair[0].at) * sum / 6.0
    };
    stops.windows(2).map(piece).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_along_a_way_are_those_of_theory() {
        let balls = [Ball {
            centre: [0.0; 3],
            radius: 1.0,
        }];
        let clearance = Clearance::new(&balls);
        let along = |way: &[[f64; 3]]| {
            Tunnel::along(way.to_vec(), 1.0, 0.01, &balls, &clearance).expect("a tunnel")
        };
        // Straight away from the ball: the integral of 1 / (x - 1)^2 from 2 to 4.
        let straight = along(&[[2.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
        let cost = 2.0 / 3.0;
        assert!((straight.cost - cost).abs() < 1e-8, "{}", straight.cost);
        assert!((straight.throughput - f64::exp(-cost)).abs() < 1e-8);
        assert_eq!((straight.length, straight.curvature), (2.0, 1.0));
        assert_eq!(straight.narrowest.radius, 1.0);
        assert_eq!(straight.narrowest.point, [2.0, 0.0, 0.0]);
        assert_eq!(straight.exit(), [4.0, 0.0, 0.0]);
        // Around a corner, and past the ball at a distance of 1 from it.
        let bent = along(&[[2.0, -3.0, 0.0], [2.0, 0.0, 0.0], [6.0, 0.0, 0.0]]);
        assert!((bent.length - 7.0).abs() < 1e-12);
        assert!((bent.curvature - 7.0 / 5.0).abs() < 1e-12);
        assert_eq!(bent.narrowest.point, [2.0, 0.0, 0.0]);
        let before = along(&[[2.0, -3.0, 0.0], [2.0, 0.0, 0.0]]);
        let after = along(&[[2.0, 0.0, 0.0], [6.0, 0.0, 0.0]]);
        assert!((after.cost - 0.8).abs() < 1e-8, "{}", after.cost);
        assert!((bent.cost - before.cost - after.cost).abs() < 1e-12);
        assert!((bent.throughput - before.throughput * after.throughput).abs() < 1e-12);
        // The way back is as hard, and a way to nowhere costs nothing.
        let back = along(&[[4.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
        assert!((back.cost - cost).abs() < 1e-8);
        let point = along(&[[2.0, 0.0, 0.0]]);
        assert_eq!((point.cost, point.throughput), (0.0, 1.0));
        assert_eq!((point.length, point.curvature), (0.0, 1.0));
    }
}
