//! Meshes to voxels.
