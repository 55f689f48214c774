//! The trade that a search for tunnels is: what stands for the atoms.

use crate::trade::{Change, GIVEN, Invariance, Knob, Measure, Part, Placed, Tied, Trade};

/// What finding tunnels trades for what.
pub const TRADE: Trade = Trade {
    knobs: &[Knob {
        name: "method",
        ladder: &[
            "grid:0.8",
            "grid:0.4",
            "grid:0.2",
            "conservative",
            "approximate",
            "balls:6",
            "balls:12",
            "exact",
        ],
        numeric: false,
        idle: &[],
    }],
    error: Measure {
        name: "width of the widest way above that of the one found",
        unit: "angstrom",
    },
    reference: "the exact width, which an octree confirms",
    result: "xyzr",
    placed: &[
        Placed::new("start", &[Part::Point]),
        Placed::new("start-search", &[Part::Length]),
        Placed {
            option: "method",
            prefix: "grid:",
            parts: &[Part::Length],
        },
        Placed::new("shell-radius", &[Part::Length]),
        Placed::new("probe-radius", &[Part::Length]),
        Placed::new("mouth", &[Part::Length]),
        Placed::new("tolerance", &[Part::Length]),
        Placed::new("step", &[Part::Length]),
    ],
    tied: &[
        tied("start-residues", POINT),
        tied("start-atoms", POINT),
        tied("start-ligand", POINT),
        tied("keep", SPHERES),
        tied("radii", SPHERES),
        tied("models", "give a file of that model alone"),
    ],
    // Moved far away, the places of a tunnel are rounded as they stand there, and its widths with them:
    // by a few units of their last place, which is not nothing.
    invariant: &[
        // Without it, it is 3 or 4 whatever the unit.
        Invariance {
            under: Change::Scale,
            only: &[("shell-radius", GIVEN)],
        },
        Invariance::always(Change::VertexOrder),
        Invariance::always(Change::DuplicateFaces),
    ],
};

const POINT: &str = "give the place itself as --start X,Y,Z";

const SPHERES: &str = "give a file of the spheres themselves (xyzr)";

const fn tied(option: &'static str, instead: &'static str) -> Tied {
    Tied { option, instead }
}
