//! Terrain: height fields, and what lies on them.

pub mod grid;
pub mod inventory;

pub use grid::{Grid, Samples, Transform};
