//! Animations: one mesh whose vertices move.

pub mod clip;
pub mod compress;

pub use clip::Clip;
