//! Pictures: rasters, colours, text and PNG.
