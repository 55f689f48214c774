//! Geometry processing that measures the error it makes.
//!
//! Each algorithm is a function of an input, a `Params` and a [`progress::Progress`]; it returns
//! its output and a `Stats` that becomes the `result` of the JSON report. Nothing in here prints,
//! exits or opens a file outside [`io`].
//!
//! Modules stand in layers and import downwards only (`tests/layers.rs` holds them to it):
//!
//! | layer | modules |
//! |---|---|
//! | 0 | [`error`] [`progress`] [`report`] [`trade`] |
//! | 1 | [`numeric`] |
//! | 2 | [`spatial`] [`image`] |
//! | 3 | [`mesh`] [`points`] [`vector`] [`camera`] |
//! | 4 | [`volume`] |
//! | 5 | [`render`] [`terrain`] [`protein`] [`anim`] |
//! | 6 | [`measure`] [`io`] (used by commands alone) |
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod anim;
pub mod camera;
pub mod error;
pub mod image;
pub mod io;
pub mod measure;
pub mod mesh;
pub mod numeric;
pub mod points;
pub mod progress;
pub mod protein;
pub mod render;
pub mod report;
pub mod spatial;
pub mod terrain;
pub mod trade;
pub mod vector;
pub mod volume;
