//! The trade that a search for tunnels is: what stands for the atoms.

use crate::trade::{Change, Invariance, Knob, Measure, Part, Placed, Trade};

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
    placed: &[Placed {
        option: "start",
        parts: &[Part::Point],
    }],
    invariant: &[
        Invariance::always(Change::Shift),
        Invariance::always(Change::VertexOrder),
    ],
};
