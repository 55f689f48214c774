//! Only as much of a molecule as the ways out need: the atoms around the start.
//!
//! A cell of their triangulation is one of the whole molecule's when its sphere reaches nowhere where an
//! atom was left out. A search that settles only such cells finds what it would in the whole; one that
//! comes to another is made again with more atoms.

use super::graph::Graph;
use super::search::Place;
use crate::numeric::vector::{add, length, scale, sub};
use crate::protein::clearance::{Ball, Clearance};
use crate::spatial::delaunay3::orthosphere;

/// The atoms around a point, of all.
pub struct Crop<'a> {
    /// Where ways start.
    centre: [f64; 3],
    /// All atoms whose centre is within this of it are there.
    reach: f64,
    /// The clearance of all atoms.
    clearance: &'a Clearance,
    /// The box of all atoms.
    bounds: [[f64; 3]; 2],
    /// Radius of the probe that tells the solvent from the molecule.
    shell: f64,
}

/// Directions that a probe is sent out in: faces, edges and corners of a cube, and away from the start.
const DIRECTIONS: usize = 27;

impl<'a> Crop<'a> {
    /// The atoms within `reach` of a point, of `all`.
    pub fn new(
        centre: [f64; 3],
        reach: f64,
        all: &[Ball],
        clearance: &'a Clearance,
        shell: f64,
    ) -> Self {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for ball in all {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(ball.centre[axis] - ball.radius);
                bounds[1][axis] = bounds[1][axis].max(ball.centre[axis] + ball.radius);
            }
        }
        Crop {
            centre,
            reach,
            clearance,
            bounds,
            shell,
        }
    }

    /// What a cell of the triangulation of these atoms is.
    pub fn place(&self, graph: &mut Graph, cell: u32) -> Place {
        if !graph.cell(cell).is_finite() {
            return Place::Unfinished;
        }
        let sphere = orthosphere(graph.triangulation.corners(cell));
        // An atom left out is in conflict only within the sphere grown by the largest weight; one that
        // stands for an atom is no further from its centre than the largest radius.
        let grown = (sphere.square + graph.heaviest()).max(0.0).sqrt() + self.clearance.largest();
        let is_final = length(sub(sphere.centre, self.centre)) + grown <= self.reach;
        if !is_final {
            return Place::Unfinished;
        }
        match self.is_open(sphere.centre) {
            true => Place::Outside,
            false => Place::Inside,
        }
    }

    /// Whether the probe comes straight from a point to beyond all atoms.
    fn is_open(&self, point: [f64; 3]) -> bool {
        if self.clearance.at(point) < self.shell {
            return false;
        }
        (0..DIRECTIONS).any(|index| {
            let grid = [index % 3, index / 3 % 3, index / 9].map(|k| k as f64 - 1.0);
            let direction = if grid == [0.0; 3] {
                sub(point, self.centre)
            } else {
                grid
            };
            let long = length(direction);
            long > 0.0 && self.comes_out(point, scale(direction, 1.0 / long))
        })
    }

    fn comes_out(&self, mut point: [f64; 3], direction: [f64; 3]) -> bool {
        // As far as the clearance is above the probe's radius, the way is free.
        let least = 1e-3 * self.shell;
        loop {
            let [low, high] = self.bounds;
            if (0..3).any(|k| point[k] < low[k] || point[k] > high[k]) {
                return true;
            }
            let free = self.clearance.at(point) - self.shell;
            if free < least {
                return false;
            }
            point = add(point, scale(direction, free));
        }
    }

    /// Whether an atom is there.
    pub fn has(&self, ball: &Ball) -> bool {
        length(sub(ball.centre, self.centre)) <= self.reach
    }
}

#[cfg(test)]
mod tests {
    use super::super::Params;
    use super::super::tests::{ball, solve};
    use crate::numeric::rng::Rng;

    #[test]
    fn no_atoms_are_added_for_ways_beyond_those_asked_for() {
        // A thick wall with a hole, and at its end a gate to another that goes on far into the wall.
        let mut rng = Rng::new(22, 0);
        let mut balls = Vec::new();
        for index in 0..40 * 56 * 56 {
            let at = [index % 40 - 12, index / 40 % 56, index / 2240].map(|k| f64::from(k - 28));
            let [x, y, z] = at.map(|k| 1.6 * (k + rng.range(-0.1, 0.1)));
            let hole = match x {
                x if x > -20.0 => 3.7,
                x if x > -22.0 => 3.1,
                x if x > -56.0 => 3.7,
                _ => 0.0,
            };
            if y.hypot(z) >= hole {
                balls.push(ball([x, y, z], 1.5));
            }
        }
        let atoms = |count, probe_radius| {
            let params = Params {
                count,
                probe_radius,
                ..Params::DEFAULT
            };
            let found = solve(&balls, [-10.0, 0.0, 0.0], &params);
            assert!(!found.tunnels.is_empty());
            found.searched.atoms
        };
        let enough = atoms(1, 2.0);
        assert!(enough < balls.len() as u64 / 2);
        assert_eq!(atoms(1, 1.0), enough);
        // The second way does need them.
        assert!(atoms(2, 1.0) > enough);
    }
}
