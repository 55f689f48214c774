//! Numbers: exact predicates, sums in a fixed order, random numbers by index.

mod double;
pub(crate) mod exact;
pub mod predicates;
pub mod rng;
pub mod sums;
pub mod vector;
