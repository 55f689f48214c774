//! What is closed of a way before the next is looked for.

use super::graph::Graph;
use super::params::Removal;
use super::search::{Closed, Route};
use super::solve::{NEAR, Search};
use crate::numeric::vector::{length, sub};
use std::collections::BTreeSet;

impl Search<'_> {
    /// Closes gates of a way, so that the next is another.
    pub(super) fn close(&self, graph: &mut Graph, route: &Route, closed: &mut Closed) {
        let gates: Vec<(u32, usize)> = route
            .cells
            .iter()
            .copied()
            .zip(route.slots.iter().copied())
            .collect();
        let widths: Vec<f64> = gates
            .iter()
            .map(|(cell, slot)| graph.gate(*cell, *slot))
            .collect();
        let least = widths.iter().copied().fold(f64::INFINITY, f64::min);
        let minimal = |k: &usize| widths[*k] == least;
        match self.params.removal {
            Removal::Narrowest => {
                for k in (0..gates.len()).filter(minimal) {
                    closed.close(graph, gates[k].0, gates[k].1);
                }
            }
            Removal::ToSurface => {
                let first = (0..gates.len()).find(minimal).unwrap_or(0);
                for (cell, slot) in &gates[first..] {
                    closed.close(graph, *cell, *slot);
                }
            }
            Removal::Around => {
                let reach = least.max(self.params.shell_radius * NEAR);
                for k in (0..gates.len()).filter(minimal) {
                    let centre = self.gate_point(graph, gates[k].0, gates[k].1);
                    self.close_around(graph, gates[k], centre, reach, closed);
                }
            }
        }
    }

    fn gate_point(&self, graph: &mut Graph, cell: u32, slot: usize) -> [f64; 3] {
        let crossed = graph.narrowest(cell, slot).map(|c| c.point);
        let ends = [cell, graph.cell(cell).neighbours[slot]].map(|c| graph.node(c));
        let narrower = if ends[0].width <= ends[1].width {
            ends[0]
        } else {
            ends[1]
        };
        crossed.unwrap_or(narrower.centre)
    }

    /// Closes all gates whose narrowest point is within `reach` of a point, found from one of them.
    fn close_around(
        &self,
        graph: &mut Graph,
        (cell, slot): (u32, usize),
        centre: [f64; 3],
        reach: f64,
        closed: &mut Closed,
    ) {
        closed.close(graph, cell, slot);
        let mut seen = BTreeSet::from([cell, graph.cell(cell).neighbours[slot]]);
        let mut waiting: Vec<u32> = seen.iter().copied().collect();
        while let Some(cell) = waiting.pop() {
            for slot in 0..4 {
                let point = self.gate_point(graph, cell, slot);
                let is_near = length(sub(point, centre)) <= reach;
                if is_near {
                    closed.close(graph, cell, slot);
                    let beyond = graph.cell(cell).neighbours[slot];
                    if seen.insert(beyond) {
                        waiting.push(beyond);
                    }
                }
            }
        }
    }
}
