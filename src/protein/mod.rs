//! Proteins.

pub mod clearance;
pub mod tunnels;
