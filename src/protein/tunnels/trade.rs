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
        Placed {
            option: "start",
            parts: &[Part::Point],
        },
        length("start-search"),
        length("shell-radius"),
        length("probe-radius"),
        length("mouth"),
        length("tolerance"),
        length("step"),
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
        // The spacing of a grid is part of a name, and cannot be scaled along.
        Invariance {
            under: Change::Scale,
            only: &[("method", TRIANGULATED), ("shell-radius", GIVEN)],
        },
        Invariance::always(Change::VertexOrder),
        Invariance::always(Change::DuplicateFaces),
    ],
};

/// The methods that search no grid.
const TRIANGULATED: &[&str] = &[
    "conservative",
    "approximate",
    "balls:4",
    "balls:6",
    "balls:8",
    "balls:12",
    "balls:20",
    "exact",
];

const POINT: &str = "give the place itself as --start X,Y,Z";

const SPHERES: &str = "give a file of the spheres themselves (xyzr)";

const fn length(option: &'static str) -> Placed {
    let parts = &[Part::Length];
    Placed { option, parts }
}

const fn tied(option: &'static str, instead: &'static str) -> Tied {
    Tied { option, instead }
}
