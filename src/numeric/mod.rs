//! Numbers: exact predicates, sums in a fixed order, random numbers by index.

pub mod predicates;
pub mod rng;
pub mod sums;
pub mod vector;
