//! Animations: one mesh whose vertices move.

pub mod clip;
pub mod motion;

pub use clip::Clip;
