//! Pores: ways through a molecule, from one mouth to another.
//!
//! What lies deeper than the depth of a mouth, by the shortest way to the solvent that the probe can take,
//! is inside. Mouths are where ways come from there into the layer above; gates near one another are one
//! mouth. From all mouths at once, the widest ways are followed inwards; where two meet lies a pore. Of the
//! pores between mouths that wider pores join already, none is told: `n` mouths of one cave make `n - 1`
//! pores.

use super::graph::Graph;
use super::search::{Outside, Route, Wide};
use super::sparse::Sparse;
use super::tunnel::{self, Tunnel};
use super::{Exit, Method, Params};
use crate::error::{Error, Fault, Result};
use crate::numeric::vector::{length, sub};
use crate::progress::Progress;
use crate::protein::clearance::{Ball, Clearance};
use crate::protein::tunnels::graph::Metric;
use crate::spatial::delaunay3::Delaunay3;
use std::collections::BinaryHeap;

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Pores {
    /// From mouth to mouth, the widest first.
    pub pores: Vec<Tunnel>,
    /// Mouths of ways that are as wide as the probe.
    pub mouths: u64,
    /// Tetrahedra.
    pub cells: u64,
    /// Facets whose width was worked out.
    pub gates: u64,
    /// Bytes of the graph.
    pub bytes: u64,
}

const NONE: u32 = u32::MAX;

/// A cell's way on: the cell it leads to, and the slot that it is left through.
type Way = (u32, u8);

/// Finds the pores of a molecule.
///
/// Of `params` the start and what closes gates are not used; the method must be conservative or approximate,
/// and ways end in the solvent. `O(n log n)` for `n` atoms, and the square of the number of gates at mouths.
pub fn pores(balls: &[Ball], params: &Params, progress: &dyn Progress) -> Result<Pores> {
    params.check()?;
    if balls.is_empty() {
        return Err(Error::Geometry(Fault::whole(
            "no atoms to find pores between",
        )));
    }
    let largest = balls.iter().map(|ball| ball.radius).fold(0.0, f64::max);
    let metric = match params.method {
        Method::Conservative => Metric::Uniform(largest),
        Method::Approximate => Metric::Touching,
        other => {
            let problem = "finds no pores; conservative and approximate do";
            return Err(Error::parameter("method", other.name(), problem));
        }
    };
    if params.exit != Exit::Shell {
        let problem = "leaves no mouths: pores end in the solvent, with --exit shell";
        return Err(Error::parameter("exit", params.exit.name(), problem));
    }
    let clearance = Clearance::new(balls);
    progress.stage("triangulate", 0);
    let centres: Vec<[f64; 3]> = balls.iter().map(|ball| ball.centre).collect();
    let mut graph = Graph::new(Delaunay3::new(&centres), metric, balls, &clearance);
    progress.stage("search", 0);
    let outside = Outside::shell(&mut graph, params.shell_radius);
    let layer = Layer::new(&mut graph, &outside, params.probe_radius);
    let mouths = Mouths::find(&mut graph, &outside, &layer, params);
    let inner = Inner::new(&mut graph, &layer, &mouths, params);
    progress.stage("pores", params.count as u64);
    let mut made = Pores {
        pores: vec![],
        mouths: mouths.count as u64,
        cells: graph.triangulation.finite_cells() as u64,
        gates: 0,
        bytes: graph.bytes(),
    };
    for Meeting {
        width, cell, slot, ..
    } in inner.meetings(&mut graph, &layer, &mouths, params)
    {
        if made.pores.len() == params.count {
            break;
        }
        let beyond = graph.cell(cell).neighbours[slot];
        let mut way = half(&mut graph, &outside, &layer, &inner, cell);
        way.reverse();
        way.extend(graph.narrowest(cell, slot).map(|crossing| crossing.point));
        way.extend(half(&mut graph, &outside, &layer, &inner, beyond));
        progress.advance(1);
        let pore = Tunnel::along(way, width, params.step, balls, &clearance);
        // Ways that come back to where they began lead through nothing.
        let leads_on = |pore: &Tunnel| {
            let ends = [pore.centreline[0], pore.exit()];
            length(sub(ends[1], ends[0])) > params.mouth
        };
        made.pores.extend(pore.filter(leads_on));
    }
    made.gates = graph.evaluated();
    made.pores
        .sort_by(|a, b| b.narrowest.radius.total_cmp(&a.narrowest.radius));
    Ok(made)
}

/// The way from a cell inside to the outside, as the corners of a centreline.
fn half(
    graph: &mut Graph,
    outside: &Outside,
    layer: &Layer,
    inner: &Inner,
    from: u32,
) -> Vec<[f64; 3]> {
    let (mut cells, mut slots) = (vec![from], vec![]);
    let mut at = from;
    while !outside.has(at) {
        let (next, slot) = match inner.on.get(at) {
            (NONE, _) => layer.on.get(at),
            way => way,
        };
        if next == NONE {
            break;
        }
        slots.push(usize::from(slot));
        cells.push(next);
        at = next;
    }
    let route = Route {
        cells,
        slots,
        width: 0.0,
    };
    tunnel::centreline(graph, &route, outside)
}

/// How deep cells lie below the solvent.
struct Layer {
    /// Length of the shortest way out that the probe can take; infinite where there is none.
    depth: Sparse<f64>,
    /// The least gate on it.
    open: Sparse<f64>,
    /// The next cell on it.
    on: Sparse<Way>,
}

impl Layer {
    fn new(graph: &mut Graph, outside: &Outside, probe: f64) -> Self {
        let count = graph.triangulation.cells().len();
        let mut layer = Layer {
            depth: Sparse::new(count, f64::INFINITY),
            open: Sparse::new(count, f64::NEG_INFINITY),
            on: Sparse::new(count, (NONE, 0)),
        };
        let mut queue = BinaryHeap::new();
        for cell in outside.all() {
            *layer.depth.at(cell) = 0.0;
            *layer.open.at(cell) = f64::INFINITY;
            queue.push(Wide(-0.0, cell));
        }
        while let Some(Wide(minus, cell)) = queue.pop() {
            if -minus > layer.depth.get(cell) {
                continue;
            }
            for slot in 0..4 {
                let beyond = graph.cell(cell).neighbours[slot];
                if outside.has(beyond) || !graph.cell(beyond).is_finite() {
                    continue;
                }
                let gate = graph.gate(cell, slot);
                if gate < probe {
                    continue;
                }
                let there = graph.node(beyond).centre;
                let leg = match outside.has(cell) {
                    // A way comes out at the gate.
                    true => graph
                        .narrowest(cell, slot)
                        .map_or(0.0, |c| length(sub(c.point, there))),
                    false => length(sub(graph.node(cell).centre, there)),
                };
                let depth = -minus + leg;
                if depth < layer.depth.get(beyond) {
                    *layer.depth.at(beyond) = depth;
                    *layer.open.at(beyond) = layer.open.get(cell).min(gate);
                    let back = graph
                        .cell(beyond)
                        .neighbours
                        .iter()
                        .position(|n| *n == cell);
                    *layer.on.at(beyond) = (cell, back.unwrap_or(0) as u8);
                    queue.push(Wide(-depth, beyond));
                }
            }
        }
        layer
    }

    fn is_deep(&self, cell: u32, params: &Params) -> bool {
        let depth = self.depth.get(cell);
        depth > params.mouth && depth < f64::INFINITY
    }
}

/// Where ways come from the inside into the layer.
struct Mouths {
    /// Cell inside, slot to the layer, and the mouth it belongs to.
    gates: Vec<(u32, usize, usize)>,
    count: usize,
}

impl Mouths {
    fn find(graph: &mut Graph, outside: &Outside, layer: &Layer, params: &Params) -> Self {
        let mut gates = Vec::new();
        let mut points = Vec::new();
        for cell in 0..graph.triangulation.cells().len() as u32 {
            if !layer.is_deep(cell, params) {
                continue;
            }
            for slot in 0..4 {
                let beyond = graph.cell(cell).neighbours[slot];
                let is_layer = !outside.has(beyond) && layer.depth.get(beyond) <= params.mouth;
                if is_layer && graph.gate(cell, slot) >= params.probe_radius {
                    gates.push((cell, slot));
                    points.push(graph.node(beyond).centre);
                }
            }
        }
        let mut sets = Sets::new(gates.len());
        for k in 0..gates.len() {
            for other in 0..k {
                if length(sub(points[k], points[other])) <= params.mouth {
                    sets.join(k, other);
                }
            }
        }
        let labels = sets.labels();
        let count = labels.iter().max().map_or(0, |most| most + 1);
        let gates = gates.into_iter().zip(labels);
        Mouths {
            gates: gates
                .map(|((cell, slot), label)| (cell, slot, label))
                .collect(),
            count,
        }
    }
}

/// Where two ways from different mouths meet.
struct Meeting {
    width: f64,
    cell: u32,
    slot: usize,
    mouths: [u32; 2],
}

/// The widest ways from the mouths inwards.
struct Inner {
    width: Sparse<f64>,
    mouth: Sparse<u32>,
    /// The next cell on the way out to the mouth.
    on: Sparse<Way>,
}

impl Inner {
    fn new(graph: &mut Graph, layer: &Layer, mouths: &Mouths, params: &Params) -> Self {
        let count = graph.triangulation.cells().len();
        let mut inner = Inner {
            width: Sparse::new(count, f64::NEG_INFINITY),
            mouth: Sparse::new(count, NONE),
            on: Sparse::new(count, (NONE, 0)),
        };
        let mut queue = BinaryHeap::new();
        for (cell, slot, label) in &mouths.gates {
            let beyond = graph.cell(*cell).neighbours[*slot];
            let width = layer.open.get(beyond).min(graph.gate(*cell, *slot));
            if width > inner.width.get(*cell) {
                *inner.width.at(*cell) = width;
                *inner.mouth.at(*cell) = *label as u32;
                *inner.on.at(*cell) = (beyond, *slot as u8);
                queue.push(Wide(width, *cell));
            }
        }
        while let Some(Wide(width, cell)) = queue.pop() {
            if width < inner.width.get(cell) {
                continue;
            }
            for slot in 0..4 {
                let beyond = graph.cell(cell).neighbours[slot];
                if !layer.is_deep(beyond, params) {
                    continue;
                }
                let through = width.min(graph.gate(cell, slot));
                if through >= params.probe_radius && through > inner.width.get(beyond) {
                    *inner.width.at(beyond) = through;
                    *inner.mouth.at(beyond) = inner.mouth.get(cell);
                    let back = graph
                        .cell(beyond)
                        .neighbours
                        .iter()
                        .position(|n| *n == cell);
                    *inner.on.at(beyond) = (cell, back.unwrap_or(0) as u8);
                    queue.push(Wide(through, beyond));
                }
            }
        }
        inner
    }

    /// The widest meetings that join mouths which no wider ones do.
    fn meetings(
        &self,
        graph: &mut Graph,
        layer: &Layer,
        mouths: &Mouths,
        params: &Params,
    ) -> Vec<Meeting> {
        let mut all = Vec::new();
        let labelled: Vec<u32> = self.mouth.find(|mouth| *mouth != NONE).collect();
        for cell in labelled {
            let own = self.mouth.get(cell);
            for slot in 0..4 {
                let beyond = graph.cell(cell).neighbours[slot];
                let other = self.mouth.get(beyond);
                if beyond > cell && other != NONE && other != own {
                    let ends = self.width.get(cell).min(self.width.get(beyond));
                    let width = ends.min(graph.gate(cell, slot));
                    all.push(Meeting {
                        width,
                        cell,
                        slot,
                        mouths: [own, other],
                    });
                }
            }
        }
        // A mouth narrower than the ways that come to it from inside is met at its gate.
        for (cell, slot, label) in mouths.gates.iter().copied() {
            let (own, other) = (self.mouth.get(cell), label as u32);
            if own != other {
                let beyond = graph.cell(cell).neighbours[slot];
                let out = layer.open.get(beyond).min(graph.gate(cell, slot));
                let width = out.min(self.width.get(cell));
                all.push(Meeting {
                    width,
                    cell,
                    slot,
                    mouths: [own, other],
                });
            }
        }
        all.retain(|meeting| meeting.width >= params.probe_radius);
        all.sort_by(|a, b| {
            let widths = b.width.total_cmp(&a.width);
            widths.then((a.cell, a.slot).cmp(&(b.cell, b.slot)))
        });
        let mut sets = Sets::new(mouths.count);
        all.retain(|meeting| sets.join(meeting.mouths[0] as usize, meeting.mouths[1] as usize));
        all
    }
}

/// Sets that are joined (union by the lower index, with paths halved).
struct Sets(Vec<usize>);

impl Sets {
    fn new(count: usize) -> Self {
        Sets((0..count).collect())
    }

    fn root(&mut self, mut at: usize) -> usize {
        while self.0[at] != at {
            self.0[at] = self.0[self.0[at]];
            at = self.0[at];
        }
        at
    }

    /// Joins the sets of two; whether they were not one before.
    fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
        a != b
    }

    /// Numbers of the sets, in the order of their first elements.
    fn labels(mut self) -> Vec<usize> {
        let roots: Vec<usize> = (0..self.0.len()).map(|k| self.root(k)).collect();
        let mut firsts = roots.clone();
        firsts.sort_unstable();
        firsts.dedup();
        roots
            .iter()
            .map(|root| firsts.partition_point(|first| first < root))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    /// A block of small balls with holes along x: their places and radii.
    fn block(holes: &[([f64; 2], f64)]) -> Vec<Ball> {
        let mut balls = Vec::new();
        for index in 0..17 * 37 * 37 {
            let [x, y, z] = [index % 17, index / 17 % 37, index / 629].map(f64::from);
            let centre = [x - 8.0, 0.7 * (y - 18.0), 0.7 * (z - 18.0)];
            let is_free = |(at, radius): &([f64; 2], f64)| {
                (centre[1] - at[0]).hypot(centre[2] - at[1]) < radius + 0.6
            };
            if !holes.iter().any(is_free) {
                balls.push(Ball {
                    centre,
                    radius: 0.6,
                });
            }
        }
        balls
    }

    #[test]
    fn holes_through_a_block_are_pores() {
        let holes = [([-5.0, -5.0], 1.8), ([5.0, 4.0], 1.4)];
        for (count, method) in [(1, Method::Approximate), (2, Method::Conservative)] {
            let params = Params {
                method,
                ..Params::DEFAULT
            };
            let found = pores(&block(&holes[..count]), &params, &Silent).expect("a block");
            assert_eq!(found.pores.len(), count, "{found:?}");
            assert_eq!(found.mouths as usize, 2 * count);
            for (pore, ([y, z], radius)) in found.pores.iter().zip(holes) {
                let width = pore.narrowest.radius;
                assert!(
                    width > radius - 1e-9 && width < radius + 0.5,
                    "{width} for {radius}"
                );
                let ends = [pore.centreline[0], pore.exit()];
                assert!((ends[0][0] - ends[1][0]).abs() > 14.0, "{ends:?}");
                for stop in &pore.stops {
                    assert!((stop.centre[1] - y).hypot(stop.centre[2] - z) < 1.5);
                }
            }
        }
        let none = pores(&block(&[]), &Params::DEFAULT, &Silent).expect("a block");
        assert!(none.pores.is_empty() && none.mouths == 0);
    }

    #[test]
    fn what_finds_no_pores_is_told() {
        let balls = block(&[]);
        for params in [
            Params {
                method: Method::Exact,
                ..Params::DEFAULT
            },
            Params {
                exit: Exit::Hull,
                ..Params::DEFAULT
            },
        ] {
            assert!(matches!(
                pores(&balls, &params, &Silent),
                Err(Error::Parameter { .. })
            ));
        }
        assert!(pores(&[], &Params::DEFAULT, &Silent).is_err());
        assert!(
            pores(&balls[..3], &Params::DEFAULT, &Silent)
                .expect("flat")
                .pores
                .is_empty()
        );
    }
}
