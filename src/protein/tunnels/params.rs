//! What is asked for.

use super::balls::COUNTS;
use super::search::{Extent, Prefer};
use crate::error::{Error, Result};
use crate::trade::named;

/// How widths are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// All atoms as large as the largest: a lower bound, exact where they are equal.
    Conservative,
    /// The Delaunay triangulation of the centres, gates by the ball that touches their three atoms.
    Approximate,
    /// Each atom as so many balls of the smallest radius: an upper bound, as CAVER 3.
    Balls(usize),
    /// The points of a grid of this spacing, as CAVER 1.
    Grid(f64),
    /// Regular triangulations, between bounds as close as asked for.
    Exact,
}

impl Method {
    /// The method of a name: `conservative`, `approximate`, `balls:K`, `grid:H`, `exact`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "conservative" => Some(Method::Conservative),
            "approximate" => Some(Method::Approximate),
            "exact" => Some(Method::Exact),
            _ => match name.split_once(':')? {
                ("balls", count) => count
                    .parse()
                    .ok()
                    .filter(|count| COUNTS.contains(count))
                    .map(Method::Balls),
                ("grid", spacing) => spacing
                    .parse()
                    .ok()
                    .filter(|h: &f64| *h > 0.0 && h.is_finite())
                    .map(Method::Grid),
                _ => None,
            },
        }
    }

    /// The name of this method.
    pub fn name(self) -> String {
        match self {
            Method::Conservative => "conservative".to_owned(),
            Method::Approximate => "approximate".to_owned(),
            Method::Balls(count) => format!("balls:{count}"),
            Method::Grid(h) => format!("grid:{h}"),
            Method::Exact => "exact".to_owned(),
        }
    }
}

/// Where ways end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// In the bulk solvent: where a large probe comes from infinity.
    Shell,
    /// Behind a facet of the convex hull.
    Hull,
}
named! { Exit { Shell = "shell", Hull = "hull" } }

/// What is closed before the next tunnel is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Removal {
    /// The narrowest gates of the way.
    Narrowest,
    /// All gates from the narrowest furthest from the surface to the surface.
    ToSurface,
    /// The narrowest gates and those near them, within the larger of their width and a third of the
    /// shell's radius.
    Around,
}
named! { Removal { Narrowest = "a", ToSurface = "b", Around = "c" } }

/// What is asked for, in the unit of the coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// How widths are found.
    pub method: Method,
    /// Where ways end.
    pub exit: Exit,
    /// How far from the given start a wider place to start is looked for.
    pub start_search: f64,
    /// Tunnels narrower than this are not looked for.
    pub probe_radius: f64,
    /// Radius of the probe that the bulk solvent is where it comes. Ways that are nowhere further apart
    /// than a third of it are one.
    pub shell_radius: f64,
    /// Ways that end this near one another have one mouth.
    pub mouth: f64,
    /// Tunnels at most.
    pub count: usize,
    /// What is closed before the next is searched.
    pub removal: Removal,
    /// What decides between ways that are as wide.
    pub prefer: Prefer,
    /// How much of the graph a search looks at.
    pub extent: Extent,
    /// How far the bounds of the exact method may be apart.
    pub tolerance: f64,
    /// Largest distance of stops on a tunnel.
    pub step: f64,
    /// Bytes that a graph or a grid may take.
    pub memory: u64,
    /// Of more atoms than this, only those around the start are triangulated, where that is enough and
    /// ways end in the solvent.
    pub whole: usize,
}

impl Params {
    /// For coordinates in angstrom.
    pub const DEFAULT: Params = Params {
        method: Method::Approximate,
        exit: Exit::Shell,
        start_search: 3.0,
        probe_radius: 0.9,
        shell_radius: 3.0,
        mouth: 4.0,
        count: 10,
        removal: Removal::ToSurface,
        prefer: Prefer::Cost,
        extent: Extent::Reduced,
        tolerance: 1e-6,
        step: 0.5,
        memory: u64::MAX,
        whole: 20_000,
    };

    /// Errs for values out of range.
    pub fn check(&self) -> Result<()> {
        let at_least_0 = [
            ("start-search", self.start_search),
            ("probe-radius", self.probe_radius),
            ("shell-radius", self.shell_radius),
            ("mouth", self.mouth),
        ];
        for (option, value) in at_least_0 {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::parameter(
                    option,
                    value,
                    "must be at least 0, and finite",
                ));
            }
        }
        for (option, value) in [("tolerance", self.tolerance), ("step", self.step)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::parameter(
                    option,
                    value,
                    "must be above 0, and finite",
                ));
            }
        }
        if self.count == 0 {
            return Err(Error::parameter("count", 0, "must be at least 1"));
        }
        Ok(())
    }
}
