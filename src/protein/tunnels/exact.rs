//! The width of the widest way, between two bounds as close as asked for.
//!
//! What is left of space by the balls of radius `r_i + t` has the shape of what is left by the weighted
//! alpha complex, at 0, of the regular triangulation with weights `(r_i + t)^2` (Edelsbrunner 1995, "The
//! union of balls and its dual shape"): their components are the same. So a way of width `t` exists
//! if and only if the start is joined to infinity by cells and facets outside of the complex, and a search
//! for the way of largest *power* answers that: it is positive just then. On the way found, dual edges
//! have a clearance of at least `t` all along.
//!
//! The critical width is guessed from the balls that touch three atoms, near which it must lie once the
//! triangulation is that of a near `t`; guesses that do not close the gap are followed by bisection.

use super::crop::Crop;
use super::graph::{Graph, Metric};
use super::search::{Closed, Extent, Outside, Unfinished, widest};
use crate::progress::Progress;
use crate::protein::clearance::{Ball, Clearance};
use crate::spatial::delaunay3::Delaunay3;

/// The bracket found, and the graph that its lower end is a way in.
pub struct Bracket<'a> {
    /// A way of this width was found.
    pub lower: f64,
    /// No way is this wide.
    pub upper: f64,
    /// The triangulation in whose dual the way of the lower end lies, by clearance along dual edges.
    pub graph: Graph<'a>,
    /// Triangulations made.
    pub triangulations: u64,
    /// Cells settled by all searches.
    pub settled: u64,
}

/// What is asked.
pub struct Question<'a> {
    /// The atoms.
    pub balls: &'a [Ball],
    /// Their clearance.
    pub clearance: &'a Clearance,
    /// Where ways start.
    pub start: [f64; 3],
    /// A way of this width is known.
    pub lower: f64,
    /// No way is wider than this.
    pub upper: f64,
    /// A guess.
    pub guess: f64,
    /// How far the bounds may be apart.
    pub tolerance: f64,
    /// Where the balls are only those around the start.
    pub crop: Option<&'a Crop<'a>>,
}

/// Powers this small, over the square of the largest ball, are not told from 0.
const UNDECIDED: f64 = 1e-9;

/// Triangulations after which the bracket stays as it is.
const MOST: u64 = 100;

/// The atoms grown by `t`, triangulated.
fn grown(balls: &[Ball], t: f64) -> Delaunay3 {
    let weighted = balls.iter().map(|ball| {
        let [x, y, z] = ball.centre;
        let radius = (ball.radius + t).max(0.0);
        [x, y, z, radius * radius]
    });
    Delaunay3::regular(&weighted.collect::<Vec<_>>())
}

impl<'a> Question<'a> {
    /// Brackets the width of the widest way from the start to infinity.
    ///
    /// Each step costs a regular triangulation of all balls and up to three searches; there are two to
    /// four as a rule. Where rounding keeps the signs from being told, the bracket stays wider than the
    /// tolerance.
    pub fn answer(&self, progress: &dyn Progress) -> Result<Bracket<'a>, Unfinished> {
        let (mut lower, mut upper) = (self.lower, self.upper.max(self.lower));
        let mut guess = self.guess.clamp(lower, upper);
        let (mut triangulations, mut settled) = (0, 0);
        let mut kept: Option<Graph<'a>> = None;
        // Above the guess first, to close; then below, for a way.
        let mut offset = 0.4 * self.tolerance;
        loop {
            let gap = upper - lower;
            let near = guess + offset;
            let t = if triangulations > 0 && triangulations % 3 == 0
                || !(lower < near && near < upper)
            {
                0.5 * (lower + upper)
            } else {
                near
            };
            progress.advance(1);
            triangulations += 1;
            let step = self.step(t)?;
            settled += step.settled;
            match step.is_open {
                Some(true) => lower = lower.max(t),
                Some(false) => upper = upper.min(t),
                None => {}
            }
            // Below `t` the start is joined to its cell's dual vertex; above, that is not known.
            let way = step.way.min(t).min(upper);
            if way >= lower || kept.is_none() {
                kept = Some(step.graph);
            }
            lower = lower.max(way);
            guess = step.touching.clamp(lower, upper);
            offset = if step.is_open == Some(false) {
                -0.4
            } else {
                0.4
            } * self.tolerance;
            let is_stuck = step.is_open.is_none() && upper - lower >= gap;
            if upper - lower <= self.tolerance || triangulations >= MOST || is_stuck {
                break;
            }
        }
        let graph = match kept {
            Some(graph) => graph,
            None => self.step(lower)?.graph,
        };
        Ok(Bracket {
            lower,
            upper,
            graph,
            triangulations,
            settled,
        })
    }

    /// What the balls grown by `t` leave.
    fn step(&self, t: f64) -> Result<Step<'a>, Unfinished> {
        let largest = self
            .balls
            .iter()
            .map(|ball| ball.radius + t)
            .fold(0.0, f64::max);
        let mut graph = Graph::new(
            grown(self.balls, t),
            Metric::Power,
            self.balls,
            self.clearance,
        );
        let mut outside = match self.crop {
            Some(crop) => Outside::around(&graph, crop),
            None => Outside::hull(&graph),
        };
        let Some(start) = graph.triangulation.locate(self.start, None) else {
            return Ok(Step {
                is_open: Some(true),
                way: t,
                touching: t,
                graph,
                settled: 0,
            });
        };
        let power = self.power(t);
        let mut settled = 0;
        let mut search = |graph: &mut Graph, width: f64| {
            let any = f64::NEG_INFINITY;
            let open = Closed::none(graph);
            let reduced = Extent::Reduced;
            let found = widest(graph, start, width, &mut outside, &open, reduced, any)?;
            settled += found.settled;
            Ok::<f64, Unfinished>(found.route.map_or(any, |route| route.width))
        };
        let room = UNDECIDED * largest * largest;
        let is_open = match search(&mut graph, power)? {
            width if width > room => Some(true),
            width if width < -room => Some(false),
            _ => None,
        };
        let clear = self.clearance.at(self.start);
        let mut graph = graph.under(Metric::Touching);
        let touching = search(&mut graph, clear)?;
        let mut graph = graph.under(Metric::Along);
        let way = search(&mut graph, clear)?;
        Ok(Step {
            is_open,
            way,
            touching,
            graph,
            settled,
        })
    }

    /// The least power of the start to a ball grown by `t`.
    fn power(&self, t: f64) -> f64 {
        let of = |ball: &Ball| {
            let distance = ball.distance(self.start) + ball.radius;
            let radius = (ball.radius + t).max(0.0);
            (distance - radius) * (distance + radius)
        };
        self.balls.iter().map(of).fold(f64::INFINITY, f64::min)
    }
}

/// What one triangulation told.
struct Step<'a> {
    /// Whether a way of its width exists.
    is_open: Option<bool>,
    /// The clearance along the best way over its dual edges.
    way: f64,
    /// The width that its touching balls promise.
    touching: f64,
    graph: Graph<'a>,
    settled: u64,
}
