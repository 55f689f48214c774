//! The widest way through the graph, and the shortest of those that are as wide.

use super::crop::Crop;
use super::graph::Graph;
use super::sparse::Sparse;
use crate::numeric::vector::{length, sub};
use crate::trade::named;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// What a cell is to a way that comes to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Part of the molecule: ways go on.
    Inside,
    /// The end of a way.
    Outside,
    /// Where atoms that were left out may change the triangulation.
    Unfinished,
}

/// The search came to where atoms were left out: it must be made again with more of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unfinished;

/// Where ways may end.
pub struct Outside<'a> {
    /// Per cell what it is, where that is known.
    places: Sparse<Option<Place>>,
    /// Where the atoms are only those around a point.
    crop: Option<&'a Crop<'a>>,
}

impl<'a> Outside<'a> {
    /// The cells at infinity: a way ends behind a facet of the convex hull.
    pub fn hull(graph: &Graph) -> Self {
        let mut outside = Outside {
            places: Sparse::new(graph.triangulation.cells().len(), None),
            crop: None,
        };
        for (cell, index) in graph.triangulation.cells().iter().zip(0..) {
            if !cell.is_finite() {
                *outside.places.at(index) = Some(Place::Outside);
            }
        }
        outside
    }

    /// The bulk solvent: what a probe of radius `shell` reaches from infinity.
    pub fn shell(graph: &mut Graph, shell: f64) -> Self {
        let mut outside = Self::hull(graph);
        let mut waiting: Vec<u32> = outside.places.find(is_outside).collect();
        while let Some(cell) = waiting.pop() {
            for slot in 0..4 {
                let beyond = graph.cell(cell).neighbours[slot];
                if !outside.has(beyond) && graph.gate(cell, slot) >= shell {
                    *outside.places.at(beyond) = Some(Place::Outside);
                    waiting.push(beyond);
                }
            }
        }
        outside
    }

    /// Where only the atoms around a point are triangulated: cells from which a probe comes straight out.
    pub fn around(graph: &Graph, crop: &'a Crop<'a>) -> Self {
        Outside {
            places: Sparse::new(graph.triangulation.cells().len(), None),
            crop: Some(crop),
        }
    }

    /// What a cell is.
    pub fn place(&mut self, graph: &mut Graph, cell: u32) -> Place {
        match (self.places.get(cell), self.crop) {
            (Some(place), _) => place,
            (None, Some(crop)) => {
                let place = crop.place(graph, cell);
                *self.places.at(cell) = Some(place);
                place
            }
            (None, None) => Place::Inside,
        }
    }

    /// Whether a cell is known to be outside.
    #[inline]
    pub fn has(&self, cell: u32) -> bool {
        self.places.get(cell) == Some(Place::Outside)
    }

    /// Whether no atoms are left out.
    pub fn is_whole(&self) -> bool {
        self.crop.is_none()
    }

    /// The cells that are known to be outside, in order.
    pub fn all(&self) -> impl Iterator<Item = u32> {
        self.places.find(is_outside)
    }

    /// How many cells are known to be outside.
    pub fn count(&self) -> usize {
        self.places.find(is_outside).count()
    }
}

fn is_outside(place: &Option<Place>) -> bool {
    *place == Some(Place::Outside)
}

/// Gates that no way may take.
#[derive(Debug, Clone)]
pub struct Closed {
    /// Per cell a bit for each slot.
    slots: Sparse<u8>,
}

impl Closed {
    /// None of a graph's.
    pub fn none(graph: &Graph) -> Self {
        Closed {
            slots: Sparse::new(graph.triangulation.cells().len(), 0),
        }
    }

    /// Closes the facet of `cell` opposite `slot`, from both sides.
    pub fn close(&mut self, graph: &Graph, cell: u32, slot: usize) {
        *self.slots.at(cell) |= 1 << slot;
        let beyond = graph.cell(cell).neighbours[slot];
        if let Some(back) = graph
            .cell(beyond)
            .neighbours
            .iter()
            .position(|n| *n == cell)
        {
            *self.slots.at(beyond) |= 1 << back;
        }
    }

    /// Whether it is closed.
    #[inline]
    pub fn has(&self, cell: u32, slot: usize) -> bool {
        self.slots.get(cell) >> slot & 1 == 1
    }
}

/// How much of the graph a search looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Until the first cell outside is reached: nothing behind it is wider.
    Reduced,
    /// All cells that can be reached.
    Full,
}
named! { Extent { Reduced = "reduced", Full = "full" } }

/// A way from the start to the outside, as the gates it goes through.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// The cells from the start on, the last of them outside.
    pub cells: Vec<u32>,
    /// The slot that each is left through; one fewer.
    pub slots: Vec<usize>,
    /// The least width on it, that of the start among them.
    pub width: f64,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The way; none where the start is closed in, however thin the probe.
    pub route: Option<Route>,
    /// Cells settled.
    pub settled: u64,
}

/// Widest first, then lowest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wide(pub f64, pub u32);

impl Eq for Wide {}
impl Ord for Wide {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}
impl PartialOrd for Wide {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

const NONE: u32 = u32::MAX;

/// The widest way from a cell to the outside: Dijkstra's search, the smallest width on the way in place
/// of the sum of lengths.
///
/// The paper's pseudocode compares `max(d[v], w)`: what it calls the width of a way is then that of its
/// last gate, and cells already settled get new predecessors, so that the way back runs in circles. (Left
/// alone they would make Prim's tree, whose ways are the widest too.) Here the width of a way is
/// `min(d[u], w)`, and the last gate counts.
///
/// Ways narrower than `least` are not followed. `O(m log n)` for `m` gates looked at.
pub fn widest(
    graph: &mut Graph,
    start: u32,
    width: f64,
    outside: &mut Outside,
    closed: &Closed,
    extent: Extent,
    least: f64,
) -> Result<Found, Unfinished> {
    let count = graph.triangulation.cells().len();
    let mut best = Sparse::new(count, f64::NEG_INFINITY);
    let mut from = Sparse::new(count, (NONE, 0u8));
    let mut is_settled = Sparse::new(count, false);
    let mut queue = BinaryHeap::from([Wide(width, start)]);
    *best.at(start) = width;
    let (mut settled, mut end) = (0, None);
    while let Some(Wide(width, cell)) = queue.pop() {
        if std::mem::replace(is_settled.at(cell), true) {
            continue;
        }
        settled += 1;
        match (outside.place(graph, cell), extent) {
            (Place::Unfinished, _) => return Err(Unfinished),
            (Place::Outside, Extent::Reduced) => {
                end = Some(cell);
                break;
            }
            (Place::Outside, Extent::Full) => {
                end = end.or(Some(cell));
                continue;
            }
            (Place::Inside, _) => {}
        }
        for slot in 0..4 {
            let beyond = graph.cell(cell).neighbours[slot];
            if is_settled.get(beyond) || closed.has(cell, slot) {
                continue;
            }
            let through = width.min(graph.gate(cell, slot));
            if through > best.get(beyond) && through >= least {
                *best.at(beyond) = through;
                *from.at(beyond) = (cell, slot as u8);
                queue.push(Wide(through, beyond));
            }
        }
    }
    let route = end.map(|end| trace(end, start, best.get(end), &from));
    Ok(Found { route, settled })
}

fn trace(end: u32, start: u32, width: f64, from: &Sparse<(u32, u8)>) -> Route {
    let (mut cells, mut slots) = (vec![end], vec![]);
    let mut at = end;
    while at != start {
        let (before, slot) = from.get(at);
        slots.push(slot as usize);
        cells.push(before);
        at = before;
    }
    cells.reverse();
    slots.reverse();
    Route {
        cells,
        slots,
        width,
    }
}

/// What the second stage makes small, among the ways that are as wide as can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prefer {
    /// The length of the centreline.
    Length,
    /// The integral of `1 / r^2` along it: wide ways at little more length.
    Cost,
}
named! { Prefer { Length = "length", Cost = "cost" } }

/// The cheapest way from `start` to the outside through gates of at least `width`.
///
/// `O(m log n)` for `m` gates looked at. None if there is no such way.
pub fn cheapest(
    graph: &mut Graph,
    start: u32,
    width: f64,
    prefer: Prefer,
    outside: &mut Outside,
    closed: &Closed,
) -> Result<Option<Route>, Unfinished> {
    let count = graph.triangulation.cells().len();
    let mut best = Sparse::new(count, f64::INFINITY);
    let mut from = Sparse::new(count, (NONE, 0u8));
    let mut is_settled = Sparse::new(count, false);
    // The largest first: costs are negative.
    let mut queue = BinaryHeap::from([Wide(-0.0, start)]);
    *best.at(start) = 0.0;
    while let Some(Wide(_, cell)) = queue.pop() {
        if std::mem::replace(is_settled.at(cell), true) {
            continue;
        }
        match outside.place(graph, cell) {
            Place::Unfinished => return Err(Unfinished),
            Place::Outside => return Ok(Some(trace(cell, start, width, &from))),
            Place::Inside => {}
        }
        for slot in 0..4 {
            let beyond = graph.cell(cell).neighbours[slot];
            if is_settled.get(beyond) || closed.has(cell, slot) {
                continue;
            }
            let gate = graph.gate(cell, slot);
            if gate < width {
                continue;
            }
            // A way ends at the gate to the outside.
            let leg = match outside.place(graph, beyond) {
                Place::Outside => 0.0,
                _ => price(graph, cell, slot, gate, prefer),
            };
            let through = best.get(cell) + leg;
            if through < best.get(beyond) {
                *best.at(beyond) = through;
                *from.at(beyond) = (cell, slot as u8);
                queue.push(Wide(-through, beyond));
            }
        }
    }
    Ok(None)
}

/// What stands for the square of a width of 0, so that no cost is infinite. No unit is small enough for a
/// width to come near its root.
pub(super) const CLOSED: f64 = 1e-280;

/// What the way through a gate costs, from node to node.
fn price(graph: &mut Graph, cell: u32, slot: usize, gate: f64, prefer: Prefer) -> f64 {
    let beyond = graph.cell(cell).neighbours[slot];
    let (here, there) = (graph.node(cell), graph.node(beyond));
    let way = length(sub(there.centre, here.centre));
    match prefer {
        Prefer::Length => way,
        Prefer::Cost => {
            let slowness = |width: f64| 1.0 / (width * width).max(CLOSED);
            // Simpson's rule over both ends and the narrowest point.
            way * (slowness(here.width) + 4.0 * slowness(gate) + slowness(there.width)) / 6.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ball, held, solve};
    use super::super::{Method, Params, Tunnel};
    use super::*;
    use crate::protein::clearance::Ball;

    /// A block with a room, a throat out of it, and from there two ways out: a short one to the right that
    /// is as wide as the throat, and a long one upwards that is wider.
    fn forked() -> Vec<Ball> {
        let (step, radius) = (0.8, 0.6);
        let is_open = |[x, y, z]: [f64; 3]| {
            let room = (x + 5.0).hypot(y).hypot(z) < 1.4 + radius;
            let throat = x > -5.0 && y.hypot(z) < 1.2 + radius;
            let upwards = y > 0.0 && x.hypot(z) < 3.0 + radius;
            room || throat || upwards
        };
        let mut balls = Vec::new();
        for index in 0..20 * 24 * 16 {
            let [i, j, k] = [index % 20, index / 20 % 24, index / 480].map(f64::from);
            let place = [i - 9.75, j - 9.75, k - 7.75].map(|n| n * step);
            if !is_open(place) {
                balls.push(ball(place, radius));
            }
        }
        balls
    }

    #[test]
    fn of_ways_as_wide_the_shortest_or_the_easiest_is_taken() {
        let balls = forked();
        let found = |prefer| {
            let params = Params {
                prefer,
                ..held(Method::Approximate)
            };
            let tunnels = solve(&balls, [-5.0, 0.0, 0.0], &params).tunnels;
            assert_eq!(tunnels.len(), 1, "{prefer:?}");
            tunnels[0].clone()
        };
        let short = found(Prefer::Length);
        let easy = found(Prefer::Cost);
        let [exit_of_short, exit_of_easy] = [&short, &easy].map(Tunnel::exit);
        assert!(exit_of_short[0] > 5.0, "{exit_of_short:?}");
        assert!(exit_of_easy[1] > 5.0, "{exit_of_easy:?}");
        assert!(short.length < easy.length - 1.0);
        assert!(easy.cost < short.cost - 1.0);
        assert_eq!(short.width, easy.width);
    }
}
