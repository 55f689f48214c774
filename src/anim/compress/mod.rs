//! Animations in as few bits as the error asked for allows.
//!
//! A stream ([`container`]) holds the faces as they stand (`faces`), and the motion in windows of frames
//! by one of several methods:
//!
//! - `trajectory`: components of the trajectories of all vertices over a window, their weights foreseen
//!   over the mesh. The default.
//! - `delta`: every frame from the one before. It asks nothing of the motion, and is the floor that
//!   `auto` never falls below.
//! - [`local`]: clusters that move with frames of reference, and components in each (RLPCA); the same
//!   without frames (LPCA); or of all vertices together (PCA).
//!
//! All of them write whole numbers with one entropy coder (`coder`) under models that learn (`mixing`,
//! `integers`), and quantise for what is asked: a number is rounded down where that saves more bits than
//! it adds error. `search` finds the step that reaches a target; `corrections` make a bound on every
//! vertex hard. What the encoder expects is what a decoder gets, and the command measures that anyway.
//!
//! Decoders compute positions in floating point from whole numbers; no decision of theirs depends on
//! those positions, so that another machine's last bits change the last bits of a coordinate and nothing
//! else.
//!
//! Where the paper ("Efficient compression of 3D dynamic mesh sequences", WSCG 2007) is silent or
//! damaged: its error is reported both about each frame's centroid and about each vertex's mean over
//! time; its method is read as [`local`] says.

mod clustered;
mod coder;
pub mod container;
mod corrections;
mod delta;
pub mod encode;
mod faces;
mod field;
mod hierarchy;
mod integers;
pub mod local;
mod mixing;
pub mod params;
mod prediction;
mod search;
mod spectrum;
pub mod stream;
mod trajectory;

pub use encode::{Bits, Encoder, Ground, Made, Stats};
pub use local::{Allocate, Frame, Rounding};
pub use params::{Clusters, Method, Params, Target};
pub use stream::{Stream, Summary, is_stream, room_to_decode, summary};

use crate::anim::Clip;
use crate::trade::{Change, Invariance, Knob, Measure, Part, Placed, Trade};

/// What coding an animation trades for what.
pub const TRADE: Trade = Trade {
    knobs: &[
        Knob {
            name: "target-kg",
            ladder: &["2", "0.5", "0.1", "0.02"],
            numeric: true,
            idle: &[],
        },
        Knob {
            name: "method",
            ladder: Method::NAMES,
            numeric: false,
            idle: &[],
        },
    ],
    error: Measure {
        name: "error about the centroids",
        unit: "percent",
    },
    reference: "the animation as it was read",
    result: "sanim",
    placed: &[
        Placed::new("target-rmse", &[Part::Length]),
        Placed::new("target-max", &[Part::Length]),
    ],
    tied: &[],
    invariant: &[
        Invariance::always(Change::Scale),
        Invariance::always(Change::Shift),
    ],
};

/// Bytes that coding a clip takes beside the clip: products of all trajectories, directions and
/// weights, and the hierarchy.
pub fn room(clip: &Clip, params: &Params) -> u128 {
    let (vertices, frames) = (
        clip.vertices() as u128,
        clip.frames().min(params.window) as u128,
    );
    let size = 3 * frames;
    // Products, directions and the room of their search; then weights and what they are found from.
    let windows = (clip.frames() as u128).div_ceil(frames.max(1));
    size * size * 8 * (2 + windows) + vertices * (800 + size.min(200) * 8 * 3)
}

#[cfg(test)]
mod tests;
