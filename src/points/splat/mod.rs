//! Discs that cover a cloud.
mod disc;
pub use disc::{Splat, Splats};
