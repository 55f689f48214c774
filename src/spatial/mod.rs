//! Space: boxes and search structures over them.

pub mod aabb;
pub mod bvh;
pub mod bvh4;
pub mod local;
