//! Judging results: errors between two things of one kind.

pub mod animation_error;
pub mod drape_error;
mod hausdorff;
pub mod image_difference;
pub mod mesh_distance;
pub mod normal_error;
pub mod overlay_error;
pub mod passage;
pub mod report_difference;
mod sides;
pub mod smooth_error;
pub mod splat_cover;
pub mod splat_error;
pub mod splat_holes;
pub mod stability;
mod surface;
#[cfg(test)]
mod test_shapes;
pub mod tradeoff;
pub mod volume_difference;
pub mod voxel_error;
mod winding_number;
