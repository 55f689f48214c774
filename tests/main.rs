//! All tests that run the binary or look at the repository, in one binary of their own.
//!
//! Tests of a function stand beside it, in `src/` and `commands/`.

mod support;
mod surfaces;

mod animations;
mod atomic;
mod chapter;
mod cli;
mod determinism;
mod examples;
mod fixtures;
mod golden;
mod layers;
mod licences;
mod malformed;
mod man;
mod mutations;
mod properties;
mod reports;
mod trade;
mod tunnel_outputs;
mod tunnels;
mod volumes;
mod voxelize;
