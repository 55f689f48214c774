//! Space: boxes and search structures over them.

pub mod aabb;
pub mod bvh;
pub mod delaunay3;
pub mod kdtree;
pub mod local;
pub mod wide_bvh;
