//! Where ways start.

use super::graph::Graph;
use super::params::Params;
use super::search::{Outside, Place};
use super::solve::Halt;
use crate::error::{Error, Fault};
use crate::numeric::vector::{length, sub};

/// Where ways start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Origin {
    /// As asked for.
    pub given: [f64; 3],
    /// The point used.
    pub used: [f64; 3],
    /// The clearance there.
    pub clearance: f64,
    /// The cell of the atoms' Delaunay triangulation whose dual vertex it is; none for a point held.
    cell: Option<u32>,
}

/// The error of a start that is not inside.
pub fn outside(point: [f64; 3]) -> Error {
    let problem = format!("the start {point:?} lies outside of the molecule");
    let hint = "a larger --start-search may find a place inside";
    Error::Geometry(Fault::whole(problem).with_hint(hint))
}

impl Origin {
    /// A start in no triangulation.
    pub fn alone(given: [f64; 3], clearance: f64) -> Self {
        Origin {
            given,
            used: given,
            clearance,
            cell: None,
        }
    }

    /// The dual vertex of largest clearance within the search radius, of those not outside; the given
    /// point itself for a radius of 0.
    pub(super) fn find(
        graph: &mut Graph,
        given: [f64; 3],
        params: &Params,
        outside_cells: &mut Outside,
    ) -> Result<Self, Halt> {
        let mut start = Origin::alone(given, graph.width_at(given));
        if params.start_search > 0.0 {
            let mut best: Option<(f64, f64, u32)> = None;
            for cell in 0..graph.triangulation.cells().len() as u32 {
                if outside_cells.has(cell) || !graph.cell(cell).is_finite() {
                    continue;
                }
                let centre = graph.centre(cell);
                let away = length(sub(centre, given));
                if away > params.start_search || !away.is_finite() {
                    continue;
                }
                let width = graph.node(cell).width;
                let is_better = best.is_none_or(|(w, a, _)| (width, -away) > (w, -a));
                if is_better
                    && graph.has_inside(centre, cell)
                    && outside_cells.place(graph, cell) == Place::Inside
                {
                    best = Some((width, away, cell));
                }
            }
            if let Some((width, _, cell)) = best.filter(|(width, ..)| *width > start.clearance) {
                start.used = graph.centre(cell);
                start.clearance = width;
                start.cell = Some(cell);
            }
        }
        if start.clearance <= 0.0 {
            return Err(start.in_an_atom(graph).into());
        }
        let place = start
            .cell_in(graph)
            .map(|cell| outside_cells.place(graph, cell));
        match place {
            Some(Place::Inside) => Ok(start),
            Some(Place::Unfinished) => Err(Halt::Unfinished),
            None if !outside_cells.is_whole() => Err(Halt::Unfinished),
            Some(Place::Outside) | None => Err(outside(given).into()),
        }
    }

    fn in_an_atom(&self, graph: &Graph) -> Error {
        let depth = -self.clearance;
        let near = graph.nearest(self.used);
        let problem = format!("the start {:?} lies {depth:.3} deep in it", self.used);
        let hint = "a larger --start-search may find a place that is free";
        let fault = match near {
            Some(ball) => Fault::element("atom", ball as usize, problem),
            None => Fault::whole(problem),
        };
        Error::Geometry(fault.with_hint(hint))
    }

    /// The cell of a graph that ways start in.
    pub fn cell_in(&self, graph: &Graph) -> Option<u32> {
        // Where it is the dual vertex of a cell here too, that is the cell, wherever the vertex lies.
        let own = self.cell.filter(|cell| graph.is_centre(*cell, self.used));
        let cell = own.or_else(|| graph.triangulation.locate(self.used, None))?;
        Some(cell).filter(|cell| graph.cell(*cell).is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{crystal, held, ideal, solve};
    use super::super::{Exit, Method, Params};

    #[test]
    fn a_start_narrower_than_every_gate_limits_the_way() {
        let balls = crystal(&[[0.0; 3]], 7, 6.0, 1.7);
        // Gates have 6 / sqrt 2 - 1.7 = 2.54; 2 from an atom's centre there is 0.3.
        let start = [18.0, 18.0, 20.0];
        let methods = [
            Method::Conservative,
            Method::Approximate,
            Method::Exact,
            Method::Balls(6),
        ];
        for method in methods {
            let widest = ideal(&balls, start, method);
            assert!((widest.width - 0.3).abs() < 1e-6, "{method:?}: {widest:?}");
            assert!(widest.lower <= 0.3 + 1e-12 && widest.upper <= 0.3 + 1e-12);
            assert!(widest.lower > 0.3 - 1e-6, "{method:?}: {widest:?}");
            assert_eq!(widest.narrowest.point, start, "{method:?}");
            let found = solve(&balls, start, &held(method));
            assert!(
                widest.lower >= found.start.clearance,
                "{method:?}: {widest:?}"
            );
        }
        // It does so for ways to the solvent too, and a wider place near does not.
        let to_shell = Params {
            exit: Exit::Shell,
            ..held(Method::Approximate)
        };
        let found = solve(&balls, start, &to_shell);
        let widest = found.widest.expect("a way");
        assert!((widest.lower - found.start.clearance).abs() < 1e-12);
        let moved = Params {
            start_search: 5.0,
            ..to_shell
        };
        let found = solve(&balls, start, &moved);
        let widest = found.widest.expect("a way");
        assert!(widest.upper < found.start.clearance - 0.5, "{widest:?}");
    }
}
