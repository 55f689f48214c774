//! Cameras and the projection of triangles onto a raster.
