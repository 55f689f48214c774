//! The trade that voxelizing is: finer voxels, looser rules.

use crate::trade::{Change, Invariance, Knob, Measure, Part, Placed, Trade};

/// The measure that compares resolutions, modes and fills.
pub(super) const TWO_SIDED: Measure = Measure {
    name: "largest distance between the model and the voxels, either way",
    unit: "file unit",
};

/// What voxelizing trades for what.
pub const TRADE: Trade = Trade {
    knobs: &[
        Knob {
            name: "resolution",
            ladder: &["32", "64", "128", "256"],
            numeric: true,
            idle: &[],
        },
        Knob {
            name: "mode",
            // `none` sets nothing unless a fill is asked for too.
            ladder: &["z", "three-axis", "conservative"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "fill",
            ladder: &["none", "parity", "winding"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "grid",
            ladder: &["auto", "dense", "sparse"],
            numeric: false,
            idle: &[],
        },
        Knob {
            name: "levels",
            ladder: &["xyz", "xy"],
            numeric: false,
            idle: &[],
        },
    ],
    error: TWO_SIDED,
    reference: "exact closest points of the model and its samples",
    result: "svo",
    placed: &[
        Placed::new("voxel-size", &[Part::Length]),
        Placed::new("bounds", &[Part::Box]),
    ],
    tied: &[],
    invariant: &[
        Invariance::always(Change::Scale),
        Invariance::always(Change::Shift),
        Invariance::always(Change::VertexOrder),
        Invariance::always(Change::FaceOrder),
        Invariance::always(Change::SplitVertices),
        Invariance::always(Change::DegenerateFaces),
        // Two surfaces at one place are two crossings, and wind twice.
        Invariance {
            under: Change::DuplicateFaces,
            only: &[("fill", &["none"])],
        },
    ],
};
