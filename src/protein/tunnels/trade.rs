//! The trade that a search for tunnels is: what stands for the atoms.

use crate::trade::{Change, Invariance, Knob, Measure, Part, Placed, Tied, Trade};

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
    invariant: &[
        Invariance::always(Change::Shift),
        Invariance::always(Change::VertexOrder),
    ],
};

const POINT: &str = "give the place itself as --start X,Y,Z";

const SPHERES: &str = "give a file of the spheres themselves (xyzr)";

const fn length(option: &'static str) -> Placed {
    let parts = &[Part::Length];
    Placed { option, parts }
}

const fn tied(option: &'static str, instead: &'static str) -> Tied {
    Tied { option, instead }
}
