//! Polygons: splitting a face of many corners into triangles.
