//! Animations: one mesh whose vertices move.

pub mod clip;
pub mod compress;
pub mod motion;

pub use clip::Clip;
