//! The steps from atoms and a start to tunnels.

use super::crop::Crop;
use super::graph::{Graph, Metric};
use super::params::{Exit, Method, Params};
use super::search::{Closed, Found, Outside, Route, Unfinished, cheapest, widest};
use super::start::{self, Origin};
use super::tunnel::{self, Stop, Tunnel};
use super::{Searched, Tunnels, Widest, balls, exact, grid};
use crate::error::Error;
use crate::numeric::vector::{length, sub};
use crate::progress::Progress;
use crate::protein::clearance::{Ball, Clearance};
use crate::spatial::delaunay3::Delaunay3;

/// Bytes of a graph, per atom: some 6.8 cells, in the making, and what few of them have of nodes and gates.
const BYTES: u64 = 450;

/// Why a search ended without a result.
pub(super) enum Halt {
    /// It came to where atoms were left out.
    Unfinished,
    /// There is none.
    Failed(Error),
}

impl From<Unfinished> for Halt {
    fn from(Unfinished: Unfinished) -> Self {
        Halt::Unfinished
    }
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Halt::Failed(error)
    }
}

/// What all steps of a search need.
pub(super) struct Search<'a> {
    /// The atoms that are triangulated.
    pub balls: &'a [Ball],
    /// All atoms.
    pub all: &'a [Ball],
    /// The clearance of all atoms.
    pub clearance: &'a Clearance,
    pub params: &'a Params,
    pub progress: &'a dyn Progress,
    /// Which atoms are triangulated, where that is not all.
    pub crop: Option<&'a Crop<'a>>,
}

/// Where in a graph ways start, and where they end.
struct Ends<'a> {
    cell: u32,
    width: f64,
    outside: Outside<'a>,
}

/// A way with the width that is certain.
struct Candidate {
    width: f64,
    certain: f64,
}

impl<'a> Search<'a> {
    /// Finds the tunnels from a point.
    pub fn run(&self, given: [f64; 3]) -> Result<Tunnels, Halt> {
        let count = self.balls.len() as u64;
        let times = match self.params.method {
            // The best triangulation so far, and the next.
            Method::Exact => 2,
            Method::Balls(balls) => balls as u64 + 1,
            _ => 1,
        };
        if count * BYTES * times > self.params.memory {
            let what = format!("triangulating {count} atoms");
            let hint = Some("raise --max-memory");
            let needed = u128::from(count * BYTES * times);
            return Err(Error::over_memory(what, needed, self.params.memory, hint).into());
        }
        self.progress.stage("triangulate", 0);
        let centres: Vec<[f64; 3]> = self.balls.iter().map(|ball| ball.centre).collect();
        let triangulation = Delaunay3::new(&centres);
        self.progress.stage("search", 0);
        let mut graph = Graph::new(triangulation, Metric::Touching, self.balls, self.clearance);
        let mut searched = Searched {
            cells: graph.triangulation.finite_cells() as u64,
            triangulations: 1,
            atoms: self.balls.len() as u64,
            bytes: graph.bytes(),
            ..Searched::default()
        };
        if searched.cells == 0 && self.crop.is_some() {
            return Err(Halt::Unfinished);
        }
        if searched.cells == 0 {
            return Ok(Tunnels {
                start: Origin::alone(given, self.clearance.at(given)),
                widest: None,
                tunnels: vec![],
                merged: 0,
                searched,
            });
        }
        let mut outside = self.outside(&mut graph);
        let start = Origin::find(&mut graph, given, self.params, &mut outside)?;
        // With one radius for all, the largest, the triangulation is exact: a bound from both sides.
        let radii = || self.all.iter().map(|ball| ball.radius);
        let largest = radii().fold(f64::NEG_INFINITY, f64::max);
        let spread = largest - radii().fold(f64::INFINITY, f64::min);
        let mut uniform = graph.under(Metric::Uniform(largest));
        let conservative = self.candidate(&mut uniform, &start, &mut searched)?;
        let mut upper = start.clearance.min(conservative.width + spread);
        let mut lower = conservative.certain;
        if spread == 0.0 {
            upper = upper.min(conservative.width);
        }
        let (mut main, width) = match self.params.method {
            Method::Conservative => (uniform, conservative.width),
            Method::Approximate => {
                let mut graph = uniform.under(Metric::Touching);
                let found = self.candidate(&mut graph, &start, &mut searched)?;
                lower = lower.max(found.certain);
                (graph, found.width)
            }
            Method::Balls(count) => return self.with_balls(count, start, lower, upper, searched),
            Method::Grid(h) => return self.on_grid(h, uniform, start, lower, upper, searched),
            Method::Exact => {
                let mut graph = uniform.under(Metric::Touching);
                let found = self.candidate(&mut graph, &start, &mut searched)?;
                drop(graph);
                self.progress.stage("bracket", 0);
                let question = exact::Question {
                    balls: self.balls,
                    clearance: self.clearance,
                    start: start.used,
                    lower: lower.max(found.certain),
                    upper,
                    guess: found.width,
                    tolerance: self.params.tolerance,
                    crop: self.crop,
                };
                let bracket = question.answer(self.progress)?;
                (lower, upper) = (bracket.lower, bracket.upper);
                searched.triangulations += bracket.triangulations;
                searched.settled += bracket.settled;
                (bracket.graph, bracket.lower)
            }
        };
        let bounds = [lower, upper];
        self.tunnels(&mut main, start, width, bounds, searched)
    }

    fn outside(&self, graph: &mut Graph) -> Outside<'a> {
        match (self.crop, self.params.exit) {
            (Some(crop), _) => Outside::around(graph, crop),
            (None, Exit::Hull) => Outside::hull(graph),
            (None, Exit::Shell) => Outside::shell(graph, self.params.shell_radius),
        }
    }

    /// Where ways start and end in a graph.
    fn ends(&self, graph: &mut Graph, start: &Origin) -> Result<Ends<'a>, Halt> {
        let outside = self.outside(graph);
        let cell = start.cell_in(graph);
        let width = graph.width_at(start.used);
        match cell {
            Some(cell) => Ok(Ends {
                cell,
                width,
                outside,
            }),
            None if self.crop.is_some() => Err(Halt::Unfinished),
            None => Err(start::outside(start.used).into()),
        }
    }

    /// The widest way in a graph; below a width that is not `least`, none.
    fn widest(
        &self,
        graph: &mut Graph,
        ends: &mut Ends,
        closed: &Closed,
        least: f64,
    ) -> Result<Found, Unfinished> {
        let extent = self.params.extent;
        widest(
            graph,
            ends.cell,
            ends.width,
            &mut ends.outside,
            closed,
            extent,
            least,
        )
    }

    /// The widest way in a graph, and what of its width is certain.
    fn candidate(
        &self,
        graph: &mut Graph,
        start: &Origin,
        searched: &mut Searched,
    ) -> Result<Candidate, Halt> {
        let mut ends = self.ends(graph, start)?;
        let found = self.widest(graph, &mut ends, &Closed::none(graph), f64::NEG_INFINITY)?;
        searched.settled += found.settled;
        searched.gates += graph.evaluated();
        let Some(route) = found.route else {
            return Ok(Candidate {
                width: f64::NEG_INFINITY,
                certain: f64::NEG_INFINITY,
            });
        };
        let way = self.centreline(graph, &route, &ends, start);
        let narrowest = tunnel::narrowest(&way, self.all, self.clearance);
        let certain = narrowest.map_or(f64::NEG_INFINITY, |n| n.radius);
        Ok(Candidate {
            width: route.width,
            certain: certain.min(start.clearance),
        })
    }

    /// The corners of a way, from the start on.
    fn centreline(
        &self,
        graph: &mut Graph,
        route: &Route,
        ends: &Ends,
        start: &Origin,
    ) -> Vec<[f64; 3]> {
        let mut way = tunnel::centreline(graph, route, &ends.outside);
        if way.first() != Some(&start.used) {
            way.insert(0, start.used);
        }
        way
    }

    /// All tunnels in a graph, given how wide the widest is.
    fn tunnels(
        &self,
        graph: &mut Graph,
        start: Origin,
        width: f64,
        bounds: [f64; 2],
        searched: Searched,
    ) -> Result<Tunnels, Halt> {
        self.progress.stage("tunnels", self.params.count as u64);
        let mut ends = self.ends(graph, &start)?;
        let mut closed = Closed::none(graph);
        let mut made = Tunnels {
            start,
            widest: None,
            tunnels: vec![],
            merged: 0,
            searched,
        };
        let most = 50 * self.params.count + 50;
        for round in 0..most {
            // One more search may only find that more atoms are needed for it.
            if made.tunnels.len() >= self.params.count {
                break;
            }
            // The first is told however narrow it is.
            let least = if round == 0 {
                f64::NEG_INFINITY
            } else {
                self.params.probe_radius
            };
            let found = self.widest(graph, &mut ends, &closed, least)?;
            let Some(route) = found.route else {
                break;
            };
            // Of all ways that are as wide, the cheapest.
            let prefer = self.params.prefer;
            let width_there = route.width;
            let cheap = cheapest(
                graph,
                ends.cell,
                width_there,
                prefer,
                &mut ends.outside,
                &closed,
            )?;
            let route = cheap.unwrap_or(route);
            let way = self.centreline(graph, &route, &ends, &made.start);
            let tunnel =
                Tunnel::along(way, route.width, self.params.step, self.all, self.clearance);
            let Some(mut tunnel) = tunnel else {
                break;
            };
            if round == 0 {
                tunnel.width = width;
                made.widest = Some(Widest::along(&tunnel, bounds));
                if width < self.params.probe_radius {
                    break;
                }
            }
            self.close(graph, &route, &mut closed);
            match made
                .tunnels
                .iter()
                .any(|other| self.is_same(other, &tunnel))
            {
                true => made.merged += 1,
                false => {
                    self.progress.advance(1);
                    made.tunnels.push(tunnel);
                }
            }
        }
        made.searched.gates += graph.evaluated();
        made.searched.outside = ends.outside.count() as u64;
        let by_width = |t: &Tunnel| -t.narrowest.radius;
        made.tunnels
            .sort_by(|a, b| by_width(a).total_cmp(&by_width(b)));
        Ok(made)
    }

    /// Whether two tunnels have one mouth, or run the same way.
    fn is_same(&self, a: &Tunnel, b: &Tunnel) -> bool {
        length(sub(a.exit(), b.exit())) <= self.params.mouth
            || hausdorff(a, b) < self.params.shell_radius * NEAR
    }

    /// The atoms as sets of equal balls.
    fn with_balls(
        &self,
        count: usize,
        start: Origin,
        lower: f64,
        upper: f64,
        mut searched: Searched,
    ) -> Result<Tunnels, Halt> {
        self.progress.stage("balls", 0);
        let small = balls::replace(self.balls, count);
        let radius = small[0].radius;
        let centres: Vec<[f64; 3]> = small.iter().map(|ball| ball.centre).collect();
        let triangulation = Delaunay3::new(&centres);
        searched.cells = triangulation.finite_cells() as u64;
        searched.triangulations += 1;
        let mut graph = Graph::new(
            triangulation,
            Metric::Uniform(radius),
            &small,
            self.clearance,
        );
        let found = self.candidate(&mut graph, &start, &mut searched)?;
        // The balls lie inside the atoms, so no way is wider than between them.
        let upper = upper.min(found.width);
        let lower = lower.max(found.certain).min(upper);
        self.tunnels(&mut graph, start, found.width, [lower, upper], searched)
    }

    /// The widest way over a grid, alone.
    fn on_grid(
        &self,
        h: f64,
        mut graph: Graph<'a>,
        start: Origin,
        lower: f64,
        upper: f64,
        mut searched: Searched,
    ) -> Result<Tunnels, Halt> {
        self.progress.stage("grid", 0);
        let way = grid::widest(
            start.used,
            h,
            self.balls,
            self.clearance,
            self.params.memory,
        )?;
        searched.cells = way.full as u64;
        searched.gates = way.asked;
        searched.settled = way.settled;
        let upper = upper.min(way.width + grid::REACH * h);
        let outside = self.outside(&mut graph);
        searched.outside = outside.count() as u64;
        // The way ends where it comes to the outside.
        let mut near = None;
        let end = way.points.iter().position(|p| {
            near = graph.triangulation.locate(*p, near);
            near.is_some_and(|cell| outside.has(cell))
        });
        let mut points = way.points;
        points.truncate(end.map_or(usize::MAX, |end| end + 1));
        let mut made = Tunnels {
            start,
            widest: None,
            tunnels: vec![],
            merged: 0,
            searched,
        };
        let tunnel = Tunnel::along(
            points,
            way.width,
            self.params.step,
            self.balls,
            self.clearance,
        );
        if let Some(tunnel) = tunnel {
            made.widest = Some(Widest::along(&tunnel, [lower, upper]));
            if way.width >= self.params.probe_radius {
                made.tunnels.push(tunnel);
            }
        }
        Ok(made)
    }
}

/// Over the radius of the solvent's probe, which sets the unit: ways nearer than this to one another all
/// along are one.
pub(super) const NEAR: f64 = 1.0 / 3.0;

/// The largest distance of a stop of either tunnel to the nearest of the other.
pub fn hausdorff(a: &Tunnel, b: &Tunnel) -> f64 {
    let one_sided = |from: &Tunnel, to: &Tunnel| {
        let nearest = |stop: &Stop| {
            let gaps = to
                .stops
                .iter()
                .map(|other| length(sub(other.centre, stop.centre)));
            gaps.fold(f64::INFINITY, f64::min)
        };
        from.stops.iter().map(nearest).fold(0.0, f64::max)
    };
    one_sided(a, b).max(one_sided(b, a))
}
