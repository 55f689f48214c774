//! Animations in as few bits as the error asked for allows.
//!
//! wip

mod coder;
pub mod container;
mod corrections;
mod delta;
pub mod encode;
mod faces;
mod field;
mod hierarchy;
mod integers;
mod mixing;
pub mod params;
mod prediction;
mod search;
mod spectrum;
pub mod stream;
mod trajectory;

pub use encode::{Bits, Encoder, Ground, Made, Stats};
pub use params::{Method, Params, Target};
pub use stream::{Stream, Summary, summary};
