//! Tunnels: the widest ways from inside a molecule to the outside, with a bound of how much wider there
//! could be.
//!
//! A molecule is a set of balls. Its clearance `r(x)` is the distance to the nearest of them; a tunnel is a
//! curve from the start to the outside, its width the least clearance on it, and the ideal tunnel the
//! widest of all. Its narrowest point lies on the Voronoi diagram of the balls, so it is searched on the
//! dual of a triangulation (Medek, Benes and Sochor 2007, "Computation of tunnels in protein molecules
//! using Delaunay triangulation"), where the paper grew no finer grid to be more accurate.
//!
//! What was decided where the paper is silent, or wrong:
//! - its relaxation forgets the way so far, and its search stops at the hull without the last gate; see
//!   [`search::widest`];
//! - its rule for the weight of an edge in the plane, half the gap between two atoms, does not hold in space,
//!   where nearly every facet has two atoms that overlap: a gate is as wide as the ball that touches
//!   its three atoms, see [`graph`];
//! - closed gates are not given weight 0, which would open those of negative width.
//!
//! With one radius for all atoms the Delaunay triangulation is exact: with the largest, a lower bound; the
//! same with the smallest is an upper bound, and differs by the difference of the radii alone.

mod balls;
mod close;
pub mod cluster;
mod crop;
pub mod cut;
mod exact;
pub mod graph;
mod grid;
mod params;
pub mod pores;
pub mod search;
pub mod shape;
mod solid;
mod solve;
mod sparse;
mod start;
mod trade;
pub mod tunnel;

#[cfg(test)]
mod tests;

pub use balls::COUNTS;
pub use params::{Exit, Method, Params, Removal};
pub use search::{Extent, Prefer};
pub use start::Origin;
pub use trade::TRADE;
pub use tunnel::{LINING, Narrowest, Stop, Tunnel};

use crate::error::{Error, Fault, Result};
use crate::progress::Progress;
use crate::protein::clearance::{Ball, Clearance};
use crop::Crop;
use solve::{Halt, Search};

/// The widest way out, as well as it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Widest {
    /// How wide the method takes it to be.
    pub width: f64,
    /// A way of this width exists.
    pub lower: f64,
    /// No way from the start to the outside is wider.
    pub upper: f64,
    /// Its narrowest place.
    pub narrowest: Narrowest,
}

impl Widest {
    /// The widest way as the tunnel along it, which is a way as wide as it is.
    fn along(tunnel: &Tunnel, [lower, upper]: [f64; 2]) -> Self {
        Widest {
            width: tunnel.width,
            lower: lower.max(tunnel.narrowest.radius).min(upper),
            upper,
            narrowest: tunnel.narrowest.clone(),
        }
    }
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Tunnels {
    /// Where ways start.
    pub start: Origin,
    /// The widest of all ways, below the probe's radius too. None without any cells.
    pub widest: Option<Widest>,
    /// Ways at least as wide as the probe, the widest first.
    pub tunnels: Vec<Tunnel>,
    /// Ways left out because their mouth, or their course, is that of a wider one.
    pub merged: u64,
    /// What was searched.
    pub searched: Searched,
}

/// How much was searched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Searched {
    /// Tetrahedra of the triangulation; points, for a grid.
    pub cells: u64,
    /// Facets whose width was worked out.
    pub gates: u64,
    /// Cells settled by the search for the widest way.
    pub settled: u64,
    /// Cells that the bulk solvent was found to hold.
    pub outside: u64,
    /// Triangulations made.
    pub triangulations: u64,
    /// Atoms that were triangulated.
    pub atoms: u64,
    /// Bytes of the largest graph.
    pub bytes: u64,
}

/// Finds the tunnels out of a molecule from `given`.
///
/// Units are those of the coordinates. Errs without balls, where the start lies in an atom (its index is
/// the element named) or outside, and for parameters out of range.
///
/// `O(n log n)` for `n` atoms spread as in molecules, the exact method a small multiple of that.
pub fn find(
    balls: &[Ball],
    given: [f64; 3],
    params: &Params,
    progress: &dyn Progress,
) -> Result<Tunnels> {
    params.check()?;
    if balls.is_empty() {
        return Err(Error::Geometry(Fault::whole(
            "no atoms to find tunnels between",
        )));
    }
    let clearance = Clearance::new(balls);
    let may_crop = params.exit == Exit::Shell && !matches!(params.method, Method::Grid(_));
    let mut reach = CROP * params.shell_radius;
    while may_crop && balls.len() > params.whole {
        let crop = Crop::new(given, reach, balls, &clearance, params.shell_radius);
        let near: Vec<Ball> = balls
            .iter()
            .filter(|ball| crop.has(ball))
            .copied()
            .collect();
        if 2 * near.len() > balls.len() {
            break;
        }
        let search = Search {
            balls: &near,
            all: balls,
            clearance: &clearance,
            params,
            progress,
            crop: Some(&crop),
        };
        match search.run(given) {
            Err(Halt::Unfinished) => reach *= 1.5,
            Err(Halt::Failed(error)) => return Err(error),
            Ok(found) => return Ok(found),
        }
    }
    let search = Search {
        balls,
        all: balls,
        clearance: &clearance,
        params,
        progress,
        crop: None,
    };
    match search.run(given) {
        Err(Halt::Unfinished) => unreachable!("no atom is left out"),
        Err(Halt::Failed(error)) => Err(error),
        Ok(found) => Ok(found),
    }
}

/// The first crop reaches so many times the shell's radius around the start.
const CROP: f64 = 10.0;
