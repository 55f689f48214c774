//! The trade that covering a cloud is: fewer discs, farther from the points.

use crate::trade::{Change, Invariance, Knob, Measure, Part, Placed, Trade};

/// What covering a cloud trades for what.
pub const TRADE: Trade = Trade {
    knobs: &[
        Knob {
            name: "delta",
            ladder: &["1%", "0.5%", "0.2%", "0.1%", "0.05%", "0.02%"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "perc",
            ladder: &["0.8", "0.5", "0.3", "0.2", "0.1"],
            numeric: true,
            idle: &[],
        },
        Knob {
            name: "cover",
            ladder: &["paper", "greedy"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "neighbors",
            ladder: &["8", "16", "32"],
            numeric: true,
            idle: &[],
        },
    ],
    error: Measure {
        name: "largest distance of a point to the disc that covers it best",
        unit: "diagonal",
    },
    reference: "the points of the cloud, each against all discs over it",
    result: "ply",
    placed: &[
        Placed::new("delta", &[Part::Length]),
        Placed::new("max-radius", &[Part::Length]),
        Placed {
            option: "orient",
            prefix: "viewpoint:",
            parts: &[Part::Point],
        },
    ],
    tied: &[],
    invariant: &[
        Invariance::always(Change::Scale),
        Invariance::always(Change::Shift),
        Invariance {
            under: Change::VertexOrder,
            only: &[("order", &["morton"])],
        },
        Invariance::always(Change::DuplicateFaces),
    ],
};
