//! Terrain: height fields, and what lies on them.

pub mod drape;
pub mod frame;
pub mod grid;
pub mod inventory;
pub mod overlay;
pub mod plan;
pub mod pyramid;
pub mod style;
pub mod surface;
pub mod view;

pub use grid::{Grid, Samples, Transform};
