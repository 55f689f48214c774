//! The trade that smoothing is: fewer steps, narrower regions.

use crate::trade::{Change, Invariance, Knob, Measure, Trade};

/// What smoothing trades for what.
pub const TRADE: Trade = Trade {
    knobs: &[
        Knob {
            name: "max-iterations",
            ladder: &["5", "10", "20", "30", "60", "120"],
            numeric: true,
            idle: &[],
        },
        Knob {
            name: "energy",
            ladder: &["laplacian", "bilaplacian"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "constraint",
            ladder: &["cell-edge", "diamond", "cell-size"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "threshold",
            ladder: &["0.05", "0.01", "0.002"],
            numeric: true,
            idle: &[],
        },
    ],
    error: Measure {
        name: "distance to the fairest surface, rms",
        unit: "voxel",
    },
    reference: "the least bending in the diamond, after a thousand steps",
    result: "ply",
    placed: &[],
    tied: &[],
    invariant: &[
        Invariance::always(Change::Scale),
        Invariance::always(Change::Shift),
    ],
};
