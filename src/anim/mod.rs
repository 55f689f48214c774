//! Animations: one mesh whose vertices move.

pub mod clip;

pub use clip::Clip;
