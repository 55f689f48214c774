//! The trade that an overlay is: textures are quick and wrong, exact ways are not always slower.

use crate::trade::{Knob, Measure, Trade};

/// What an overlay trades for what.
pub const TRADE: Trade = Trade {
    knobs: &[
        Knob {
            name: "method",
            ladder: &[
                "texture:512",
                "texture:1024",
                "texture:2048",
                "texture:4096",
                "texture:8192",
                "stencil",
                "distance",
            ],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "samples",
            ladder: &["1", "4", "16"],
            numeric: true,
            idle: &[],
        },
    ],
    error: Measure {
        name: "pixels that show the wrong feature",
        unit: "share of the pixels that show one",
    },
    reference: "the place of each pixel against each feature by its definition",
    result: "png",
    placed: &[],
    tied: &[],
    invariant: &[],
};
