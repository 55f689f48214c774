//! The trade that tracing discs is: fewer rays, fewer bounces, plainer surfaces.

use crate::trade::{Change, Invariance, Knob, Measure, Part, Placed, Trade};

/// The measure that compares settings.
pub(super) const WRONG: Measure = Measure {
    name: "wrong pixels",
    unit: "share of pixels",
};

/// What tracing discs trades for what.
pub const TRADE: Trade = Trade {
    knobs: &[
        Knob {
            name: "depth",
            ladder: &["0", "1", "2", "4", "8"],
            numeric: true,
            idle: &[],
        },
        Knob {
            name: "samples",
            ladder: &["1", "2", "4"],
            numeric: true,
            idle: &[],
        },
        Knob {
            name: "blend",
            ladder: &["none", "normals", "depth"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "self-hit",
            ladder: &["ball", "overlap"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "accelerator",
            ladder: &["bvh", "octree"],
            numeric: false,
            idle: &[],
        },
    ],
    error: WRONG,
    reference: "the mesh of --reference, else the same discs at the finest setting",
    result: "png",
    placed: &[
        Placed::new("light", &[Part::Point]),
        Placed::new(
            "camera",
            &[Part::Point, Part::Point, Part::Direction, Part::Number],
        ),
        Placed::new("sphere", &[Part::Point, Part::Length]),
    ],
    tied: &[],
    invariant: &[
        Invariance::always(Change::Scale),
        Invariance::always(Change::Shift),
    ],
};
