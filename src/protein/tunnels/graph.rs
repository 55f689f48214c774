//! The graph that tunnels are searched in: cells of a triangulation, joined across their facets.
//!
//! A node is a cell, its place the vertex of the power diagram that is dual to it; a gate is a facet, and
//! its dual edge the way through. A gate is narrowest where the dual edge crosses the facet's plane, or
//! else at the end of the edge nearer to it (Medek, Benes and Sochor 2007, section 3). Widths are worked
//! out when a search asks for them, and kept.

use super::sparse::Sparse;
use crate::numeric::vector::{cross, dot, length, sub};
use crate::protein::clearance::{Ball, Clearance};
use crate::spatial::delaunay3::{
    Cell, Delaunay3, FACET, Sphere, orthosphere, orthosphere_of_facet, place,
};

/// How wide a place is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Metric {
    /// All balls have one radius: exact for such balls, and the dual edges are straight.
    Uniform(f64),
    /// Nodes by their clearance, gates by that of the ball that touches the three atoms of the facet,
    /// its centre in their plane: what the approximate method takes for the narrowest point.
    Touching,
    /// The least clearance along the dual edge, exactly.
    Along,
    /// The power of nodes, and of the narrowest points of gates: positive where the dual edge is outside
    /// of all the balls that the weights stand for (Edelsbrunner 1995).
    Power,
}

/// A cell's dual vertex and how wide it is there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// The dual vertex.
    pub centre: [f64; 3],
    /// Its width, in the graph's metric.
    pub width: f64,
}

/// The narrowest point of a gate whose dual edge crosses its facet's plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The point.
    pub point: [f64; 3],
    /// The power of the crossing itself.
    pub square: f64,
    /// How far the point is from the crossing.
    off: f64,
}

/// Relative error of dual vertices, with room.
const ROUNDING: f64 = 1e-11;

const UNKNOWN: Node = Node {
    centre: [f64::NAN; 3],
    width: f64::NAN,
};

/// A triangulation whose facets have widths.
pub struct Graph<'a> {
    /// The triangulation of the atoms, or of what stands for them.
    pub triangulation: Delaunay3,
    metric: Metric,
    /// The balls of the vertices of the triangulation, by input.
    balls: &'a [Ball],
    clearance: &'a Clearance,
    nodes: Sparse<Node>,
    /// By cell and slot; NaN while unknown.
    gates: Sparse<[f64; 4]>,
    evaluated: u64,
    /// The largest radius, and the weight that goes with it.
    largest: f64,
    heaviest: f64,
}

impl<'a> Graph<'a> {
    /// The graph over a triangulation of `balls`; `clearance` is that of the atoms themselves.
    pub fn new(
        triangulation: Delaunay3,
        metric: Metric,
        balls: &'a [Ball],
        clearance: &'a Clearance,
    ) -> Self {
        let cells = triangulation.cells().len();
        // Of all atoms, those among them that are not triangulated.
        let largest = clearance.largest();
        let heaviest = triangulation
            .points()
            .iter()
            .map(|p| p[3])
            .fold(0.0, f64::max);
        let own = balls.iter().map(|ball| ball.radius).fold(0.0, f64::max);
        let heaviest = match heaviest == 0.0 {
            true => 0.0,
            false => (heaviest.sqrt() + largest - own).powi(2),
        };
        Graph {
            largest,
            heaviest,
            triangulation,
            metric,
            balls,
            clearance,
            nodes: Sparse::new(cells, UNKNOWN),
            gates: Sparse::new(cells, [f64::NAN; 4]),
            evaluated: 0,
        }
    }

    /// The same triangulation under another metric.
    pub fn under(self, metric: Metric) -> Self {
        Graph::new(self.triangulation, metric, self.balls, self.clearance)
    }

    /// The metric of its widths.
    pub fn metric(&self) -> Metric {
        self.metric
    }

    /// Gates whose width was asked for.
    pub fn evaluated(&self) -> u64 {
        self.evaluated
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let cells = size_of_val(self.triangulation.cells());
        let points = self.triangulation.points().len();
        let of_point = size_of::<[f64; 4]>() + 2 * size_of::<u32>();
        let triangulation = (cells + points * of_point) as u64;
        triangulation + self.nodes.bytes() + self.gates.bytes()
    }

    /// A cell of the triangulation.
    #[inline]
    pub fn cell(&self, cell: u32) -> Cell {
        self.triangulation.cells()[cell as usize]
    }

    /// How wide a point is, in the graph's metric but [`Metric::Power`].
    pub fn width_at(&self, p: [f64; 3]) -> f64 {
        match self.metric {
            // The clearance of the balls' centres, less the one radius.
            Metric::Uniform(radius) => {
                let centres = self.balls.iter().map(|ball| sub(p, ball.centre));
                let square = centres
                    .map(|from| dot(from, from))
                    .fold(f64::INFINITY, f64::min);
                square.sqrt() - radius
            }
            _ => self.clearance.at(p),
        }
    }

    /// The dual vertex of a finite cell; cells at infinity are infinitely wide.
    pub fn node(&mut self, cell: u32) -> Node {
        let known = self.nodes.get(cell);
        if !known.width.is_nan() {
            return known;
        }
        let node = if self.cell(cell).is_finite() {
            let Sphere { centre, square } = orthosphere(self.triangulation.corners(cell));
            let width = match self.metric {
                Metric::Uniform(radius) => square.sqrt() - radius,
                Metric::Touching | Metric::Along => {
                    self.clear(centre, 0.0, square, &self.cell(cell).vertices)
                }
                Metric::Power => square,
            };
            // A sphere too large for a double is as good as the outside.
            let width = if width.is_nan() { f64::INFINITY } else { width };
            Node { centre, width }
        } else {
            Node {
                centre: [f64::NAN; 3],
                width: f64::INFINITY,
            }
        };
        *self.nodes.at(cell) = node;
        node
    }

    /// The dual vertex of a cell, whatever it is as wide as; not finite for cells at infinity.
    pub fn centre(&self, cell: u32) -> [f64; 3] {
        match self.cell(cell).is_finite() {
            true => orthosphere(self.triangulation.corners(cell)).centre,
            false => [f64::NAN; 3],
        }
    }

    /// Whether a point lies in the convex hull; found by a walk from a cell near it.
    pub fn has_inside(&self, p: [f64; 3], near: u32) -> bool {
        let cell = self.triangulation.locate(p, Some(near));
        cell.is_some_and(|cell| self.cell(cell).is_finite())
    }

    /// Whether a point is the dual vertex of a cell of this graph.
    pub fn is_centre(&self, cell: u32, p: [f64; 3]) -> bool {
        (cell as usize) < self.triangulation.cells().len() && self.centre(cell) == p
    }

    /// The largest weight that any atom would have.
    pub fn heaviest(&self) -> f64 {
        self.heaviest
    }

    /// The nearest atom.
    pub fn nearest(&self, p: [f64; 3]) -> Option<u32> {
        self.clearance.nearest(p).map(|near| near.ball)
    }

    /// How wide the way is through the facet of `cell` opposite `slot`.
    pub fn gate(&mut self, cell: u32, slot: usize) -> f64 {
        let known = self.gates.get(cell)[slot];
        if !known.is_nan() {
            return known;
        }
        let width = self.measure(cell, slot);
        self.evaluated += 1;
        self.gates.at(cell)[slot] = width;
        let beyond = self.cell(cell).neighbours[slot];
        if let Some(back) = self.cell(beyond).neighbours.iter().position(|n| *n == cell) {
            self.gates.at(beyond)[back] = width;
        }
        width
    }

    /// The clearance at a point that is `off` from the centre of a sphere, of this squared radius, to
    /// which no atom is nearer than the vertices that it is orthogonal to.
    ///
    /// That bounds the clearance from both sides, and ends the search early where many atoms are as near.
    fn clear(&self, p: [f64; 3], off: f64, square: f64, vertices: &[u32]) -> f64 {
        let mut best = f64::INFINITY;
        for vertex in vertices {
            let ball = &self.balls[self.triangulation.input(*vertex) as usize];
            best = best.min(ball.distance(p));
        }
        let reach = (square + self.heaviest).max(0.0).sqrt();
        let floor = reach * (1.0 + ROUNDING) - self.largest - off;
        self.clearance.between(p, floor, best)
    }

    fn measure(&mut self, cell: u32, slot: usize) -> f64 {
        let crossing = self.narrowest(cell, slot);
        let ends = [cell, self.cell(cell).neighbours[slot]].map(|c| self.node(c));
        let widths = ends[0].width.min(ends[1].width);
        let width = match (self.metric, crossing) {
            (Metric::Uniform(radius), Some(crossing)) => crossing.square.sqrt() - radius,
            (Metric::Power, Some(crossing)) => crossing.square,
            (Metric::Touching, Some(Crossing { point, square, off })) => {
                let vertices = self.cell(cell).vertices;
                self.clear(point, off, square, &FACET[slot].map(|k| vertices[k]))
            }
            (Metric::Along, _) => {
                let way = [ends[0].centre, ends[1].centre];
                match way.iter().flatten().all(|v| v.is_finite()) {
                    true => self.clearance.along(way[0], way[1]).distance,
                    // A ray to the outside: as wide as where it starts, or as the facet.
                    false => crossing.map_or(widths, |c| self.clearance.at(c.point)),
                }
            }
            (_, None) => widths,
        };
        // Rounding must not make a gate wider than what lies on both sides of it.
        width.min(widths)
    }

    /// Where the dual edge crosses the plane of a facet; none where it does not.
    pub fn narrowest(&mut self, cell: u32, slot: usize) -> Option<Crossing> {
        let (cell, slot) = self.finite_side(cell, slot)?;
        let Cell {
            vertices,
            neighbours,
        } = self.cell(cell);
        let facet = FACET[slot].map(|k| vertices[k]);
        let corners = facet.map(|v| self.triangulation.points()[v as usize]);
        let [a, b, c] = corners.map(place);
        // Towards the cell's own side.
        let normal = cross(sub(b, a), sub(c, a));
        let height = |x: [f64; 3]| dot(normal, sub(x, a));
        let own = height(self.node(cell).centre);
        let beyond = neighbours[slot];
        let is_crossed = match self.cell(beyond).is_finite() {
            true => own >= 0.0 && height(self.node(beyond).centre) <= 0.0,
            false => own >= 0.0,
        };
        if !is_crossed {
            return None;
        }
        let sphere = orthosphere_of_facet(corners);
        let point = match self.metric {
            Metric::Touching => {
                let balls = facet.map(|v| self.balls[self.triangulation.input(v) as usize]);
                touching(balls).map_or(sphere.centre, |(y, _)| y)
            }
            _ => sphere.centre,
        };
        Some(Crossing {
            point,
            square: sphere.square,
            off: length(sub(point, sphere.centre)),
        })
    }

    /// The facet as one of a finite cell.
    fn finite_side(&self, cell: u32, slot: usize) -> Option<(u32, usize)> {
        if self.cell(cell).is_finite() {
            return Some((cell, slot));
        }
        let beyond = self.cell(cell).neighbours[slot];
        let back = self
            .cell(beyond)
            .neighbours
            .iter()
            .position(|n| *n == cell)?;
        self.cell(beyond).is_finite().then_some((beyond, back))
    }
}

/// The ball that touches three others from outside, its centre in the plane of theirs; the smallest, if
/// there are two. None where one reaches through the gap of the others, or they stand in line.
///
/// Apollonius' problem, by taking the first of `|x - c_i| = rho + r_i` from the others: what is left is
/// linear in `x` and `rho`.
pub fn touching(balls: [Ball; 3]) -> Option<([f64; 3], f64)> {
    let [first, second, third] = balls;
    let u = sub(second.centre, first.centre);
    let v = sub(third.centre, first.centre);
    let normal = cross(u, v);
    let square = dot(normal, normal);
    if square == 0.0 {
        return None;
    }
    // x = A + B rho, over the basis dual to u and v.
    let (for_u, for_v) = (cross(v, normal), cross(normal, u));
    let constant = |e: [f64; 3], ball: Ball| {
        dot(e, e) + (first.radius - ball.radius) * (first.radius + ball.radius)
    };
    let combine = |s: f64, t: f64| -> [f64; 3] {
        std::array::from_fn(|k| (for_u[k] * s + for_v[k] * t) * 0.5 / square)
    };
    let a = combine(constant(u, second), constant(v, third));
    let b = combine(
        2.0 * (first.radius - second.radius),
        2.0 * (first.radius - third.radius),
    );
    // (|B|^2 - 1) rho^2 + 2 (A.B - r) rho + |A|^2 - r^2 = 0.
    let (quadratic, half) = (dot(b, b) - 1.0, dot(a, b) - first.radius);
    let rest = dot(a, a) - first.radius * first.radius;
    let discriminant = half * half - quadratic * rest;
    if discriminant < 0.0 {
        return None;
    }
    // Without cancellation: one root by its sum, the other by the product of both.
    let sum = -(half + discriminant.sqrt().copysign(half));
    let roots = [sum / quadratic, rest / sum];
    let fits = |rho: &f64| rho.is_finite() && balls.iter().all(|ball| rho + ball.radius >= 0.0);
    let rho = roots.into_iter().filter(fits).min_by(f64::total_cmp)?;
    let x = std::array::from_fn(|k| first.centre[k] + a[k] + b[k] * rho);
    Some((x, rho))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    #[test]
    fn the_touching_ball_touches_all_three() {
        let mut rng = Rng::new(8, 0);
        let mut found = 0;
        for _ in 0..500 {
            let balls: [Ball; 3] = std::array::from_fn(|_| Ball {
                centre: std::array::from_fn(|_| rng.range(-3.0, 3.0)),
                radius: rng.range(0.5, 2.0),
            });
            let Some((x, rho)) = touching(balls) else {
                continue;
            };
            found += 1;
            for ball in balls {
                assert!(
                    (ball.distance(x) - rho).abs() < 1e-7 * (1.0 + rho.abs()),
                    "{balls:?}"
                );
            }
            let normal = cross(
                sub(balls[1].centre, balls[0].centre),
                sub(balls[2].centre, balls[0].centre),
            );
            let height = dot(normal, sub(x, balls[0].centre));
            assert!(height.abs() < 1e-7 * dot(normal, normal).sqrt() * (1.0 + rho.abs()));
        }
        assert!(found > 300, "{found}");
    }

    #[test]
    fn equal_balls_are_touched_around_the_circumcentre() {
        let ball = |x: f64, y: f64| Ball {
            centre: [x, y, 5.0],
            radius: 1.7,
        };
        let (x, rho) =
            touching([ball(0.0, 0.0), ball(6.0, 0.0), ball(0.0, 6.0)]).expect("there is one");
        assert_eq!(x, [3.0, 3.0, 5.0]);
        assert!((rho - (6.0 / 2f64.sqrt() - 1.7)).abs() < 1e-15);
        assert_eq!(
            touching([ball(0.0, 0.0), ball(1.0, 0.0), ball(2.0, 0.0)]),
            None
        );
    }
}
