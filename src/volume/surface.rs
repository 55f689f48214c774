//! The surface of a binary volume as a mesh of voxel faces.
