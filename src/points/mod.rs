//! Point clouds, their normals, and the discs that cover them.
//!
//! A cloud is a [`crate::mesh::Mesh`] whose vertices stand for themselves.

mod eigen;
pub mod normals;
pub mod order;
pub mod orient;
pub mod splat;

pub use splat::{Splat, Splats};
