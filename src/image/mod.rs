//! Pictures: rasters, colours, text and PNG.
//!
//! Light is added up in a [`raster::Raster`] of linear numbers; what a person sees is a
//! [`raster::Picture`] of sRGB bytes, on which text and lines are set and which becomes a PNG. A [`plot::Plot`] is
//! drawn on one, or written as SVG.

pub mod colour;
pub mod font;
pub mod plot;
pub mod png;
pub mod raster;
pub mod samples;
pub mod text;
