//! Point clouds, and the discs that cover them.
//!
//! A cloud is a [`crate::mesh::Mesh`] whose vertices stand for themselves.

pub mod splat;

pub use splat::{Splat, Splats};
