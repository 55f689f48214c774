//! The trade that shadows are: fewer rays, coarser voxels.

use crate::trade::{Change, Invariance, Knob, Measure, Part, Placed, Trade};

/// The measure that compares methods, resolutions and numbers of rays.
pub(super) const SOFT: Measure = Measure {
    name: "mean error of the blocked share",
    unit: "share of the light",
};

/// What shadows trade for what.
pub const TRADE: Trade = Trade {
    knobs: &[
        Knob {
            name: "method",
            ladder: &["octree", "dda", "exact"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "resolution",
            ladder: &["32", "64", "128", "256"],
            numeric: true,
            idle: &[("method", "exact")],
        },
        Knob {
            name: "rays",
            ladder: &["1", "4", "16", "64"],
            numeric: true,
            idle: &[],
        },
        Knob {
            name: "near",
            ladder: &["skip", "exact"],
            numeric: false,
            idle: &[("method", "exact")],
        },
        Knob {
            name: "mode",
            ladder: &["three-axis", "conservative"],
            numeric: false,
            idle: &[("method", "exact")],
        },
    ],
    error: SOFT,
    reference: "other rays by watertight triangles",
    result: "png",
    placed: &[
        Placed::new("light", &[Part::Point, Part::Length]),
        Placed::new(
            "camera",
            &[Part::Point, Part::Point, Part::Direction, Part::Number],
        ),
    ],
    tied: &[],
    invariant: &[
        Invariance::always(Change::Scale),
        Invariance::always(Change::Shift),
    ],
};
