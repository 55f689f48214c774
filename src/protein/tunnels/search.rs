//! The widest way through the graph, and the shortest of those that are as wide.

use super::graph::Graph;
use crate::numeric::vector::{length, sub};
use crate::trade::named;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Where a way may end.
#[derive(Debug, Clone)]
pub struct Outside {
    /// Per cell, whether it is outside.
    cells: Vec<bool>,
}

impl Outside {
    /// The cells at infinity: a way ends behind a facet of the convex hull.
    pub fn hull(graph: &Graph) -> Self {
        let cells = graph.triangulation.cells();
        Outside {
            cells: cells.iter().map(|cell| !cell.is_finite()).collect(),
        }
    }

    /// The bulk solvent: what a probe of radius `shell` reaches from infinity.
    pub fn shell(graph: &mut Graph, shell: f64) -> Self {
        let mut outside = Self::hull(graph);
        let mut waiting: Vec<u32> = (0u32..)
            .zip(&outside.cells)
            .filter_map(|(cell, is_outside)| is_outside.then_some(cell))
            .collect();
        while let Some(cell) = waiting.pop() {
            for slot in 0..4 {
                let beyond = graph.cell(cell).neighbours[slot];
                if !outside.cells[beyond as usize] && graph.gate(cell, slot) >= shell {
                    outside.cells[beyond as usize] = true;
                    waiting.push(beyond);
                }
            }
        }
        outside
    }

    /// Whether a cell is outside.
    #[inline]
    pub fn has(&self, cell: u32) -> bool {
        self.cells[cell as usize]
    }

    /// How many of the cells are.
    pub fn count(&self) -> usize {
        self.cells.iter().filter(|is_outside| **is_outside).count()
    }
}

/// Gates that no way may take.
#[derive(Debug, Clone, Default)]
pub struct Closed {
    /// Per cell a bit for each slot.
    slots: Vec<u8>,
}

impl Closed {
    /// Closes the facet of `cell` opposite `slot`, from both sides.
    pub fn close(&mut self, graph: &Graph, cell: u32, slot: usize) {
        self.slots.resize(graph.triangulation.cells().len(), 0);
        self.slots[cell as usize] |= 1 << slot;
        let beyond = graph.cell(cell).neighbours[slot];
        if let Some(back) = graph
            .cell(beyond)
            .neighbours
            .iter()
            .position(|n| *n == cell)
        {
            self.slots[beyond as usize] |= 1 << back;
        }
    }

    /// Whether it is closed.
    #[inline]
    pub fn has(&self, cell: u32, slot: usize) -> bool {
        self.slots
            .get(cell as usize)
            .is_some_and(|slots| slots >> slot & 1 == 1)
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
struct Wide(f64, u32);

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
/// `O(m log n)` for `m` gates looked at.
pub fn widest(
    graph: &mut Graph,
    start: u32,
    width: f64,
    outside: &Outside,
    closed: &Closed,
    extent: Extent,
) -> Found {
    let count = graph.triangulation.cells().len();
    let mut best = vec![f64::NEG_INFINITY; count];
    let mut from = vec![(NONE, 0u8); count];
    let mut is_settled = vec![false; count];
    let mut queue = BinaryHeap::from([Wide(width, start)]);
    best[start as usize] = width;
    let (mut settled, mut end) = (0, None);
    while let Some(Wide(width, cell)) = queue.pop() {
        if std::mem::replace(&mut is_settled[cell as usize], true) {
            continue;
        }
        settled += 1;
        if outside.has(cell) {
            end = end.or(Some(cell));
            match extent {
                Extent::Reduced => break,
                Extent::Full => continue,
            }
        }
        for slot in 0..4 {
            let beyond = graph.cell(cell).neighbours[slot];
            if is_settled[beyond as usize] || closed.has(cell, slot) {
                continue;
            }
            let through = width.min(graph.gate(cell, slot));
            if through > best[beyond as usize] {
                best[beyond as usize] = through;
                from[beyond as usize] = (cell, slot as u8);
                queue.push(Wide(through, beyond));
            }
        }
    }
    let route = end.map(|end| trace(end, start, best[end as usize], &from));
    Found { route, settled }
}

fn trace(end: u32, start: u32, width: f64, from: &[(u32, u8)]) -> Route {
    let (mut cells, mut slots) = (vec![end], vec![]);
    let mut at = end;
    while at != start {
        let (before, slot) = from[at as usize];
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
    outside: &Outside,
    closed: &Closed,
) -> Option<Route> {
    let count = graph.triangulation.cells().len();
    let mut best = vec![f64::INFINITY; count];
    let mut from = vec![(NONE, 0u8); count];
    let mut is_settled = vec![false; count];
    // The largest first: costs are negative.
    let mut queue = BinaryHeap::from([Wide(-0.0, start)]);
    best[start as usize] = 0.0;
    while let Some(Wide(_, cell)) = queue.pop() {
        if std::mem::replace(&mut is_settled[cell as usize], true) {
            continue;
        }
        if outside.has(cell) {
            return Some(trace(cell, start, width, &from));
        }
        for slot in 0..4 {
            let beyond = graph.cell(cell).neighbours[slot];
            if is_settled[beyond as usize] || closed.has(cell, slot) {
                continue;
            }
            let gate = graph.gate(cell, slot);
            if gate < width {
                continue;
            }
            // A way ends at the gate to the outside.
            let leg = match outside.has(beyond) {
                true => 0.0,
                false => price(graph, cell, slot, gate, prefer),
            };
            let through = best[cell as usize] + leg;
            if through < best[beyond as usize] {
                best[beyond as usize] = through;
                from[beyond as usize] = (cell, slot as u8);
                queue.push(Wide(-through, beyond));
            }
        }
    }
    None
}

/// What the way through a gate costs, from node to node.
fn price(graph: &mut Graph, cell: u32, slot: usize, gate: f64, prefer: Prefer) -> f64 {
    let beyond = graph.cell(cell).neighbours[slot];
    let (here, there) = (graph.node(cell), graph.node(beyond));
    let way = length(sub(there.centre, here.centre));
    match prefer {
        Prefer::Length => way,
        Prefer::Cost => {
            let slowness = |width: f64| 1.0 / (width * width).max(1e-12);
            // Simpson's rule over both ends and the narrowest point.
            way * (slowness(here.width) + 4.0 * slowness(gate) + slowness(there.width)) / 6.0
        }
    }
}
