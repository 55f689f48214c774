//! How faithful a smoothed surface is, and how far from the fairest one.

use super::mesh_distance;
use super::sides::on_wrong_side;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::numeric::sums::sum_by;
use crate::numeric::vector::{Vec3, add, cross, dot, normalize, sub};
use crate::progress::Progress;
use crate::volume::bits::BitGrid;
use crate::volume::isosurface::Surface;
use crate::volume::smooth_mc::{Params, smooth, turning};
use schemars::JsonSchema;
use serde::Serialize;

/// Steps after which a surface counts as the fairest one, and the step at which it does before.
const FAIREST_STEPS: u32 = 1000;
const FAIREST_THRESHOLD: f64 = 1e-5;

/// What was measured of a smoothed surface.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SmoothError {
    /// Voxels whose centres lie on another side than they belong, by a voxelization of the result; null
    /// where it is open.
    pub misclassified_voxels: Option<u64>,
    /// Largest distance between the surface and that of marching cubes, measured both ways, in the
    /// smallest spacing: at least this.
    pub hausdorff: f64,
    /// At most this.
    pub hausdorff_bound: f64,
    /// Root mean square over the vertices of the distance, along its normals, to the fairest surface: the
    /// least bending within the diamond, after a thousand steps; in the smallest spacing.
    pub from_fairest: f64,
    /// Root mean square of the angle between chords of the curves in which the fairest surface meets the planes of voxel
    /// centres, in degrees.
    pub fairest_turning_deg: f64,
}

/// A surface in voxels, in units of the smallest spacing.
pub fn lattice_mesh(
    surface: &Surface,
    metric: Vec3,
    offsets: &[Vec3],
    triangles: &[[u32; 3]],
) -> Mesh {
    let at = |(place, offset): (&[i32; 3], &Vec3)| {
        std::array::from_fn(|a| (0.5 * f64::from(place[a]) + offset[a]) * metric[a])
    };
    let positions = surface.places.iter().zip(offsets).map(at).collect();
    Mesh::from_triangles(positions, triangles.to_vec())
}

/// Measures what [`smooth`] made of a surface.
///
/// `inside` are the voxels of the volume, where they are known and the surface is closed. Errs as
/// voxelizing and comparing meshes do. Cost: a thousand steps of smoothing, a filled grid, and distances
/// between meshes.
pub fn measure(
    surface: &Surface,
    spacing: Vec3,
    inside: Option<&BitGrid>,
    offsets: &[Vec3],
    triangles: &[[u32; 3]],
    max_memory: u64,
    progress: &dyn Progress,
) -> Result<SmoothError> {
    let smallest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let metric = spacing.map(|s| s / smallest);
    let misclassified_voxels = inside
        .map(|inside| misclassified(surface, inside, offsets, triangles, max_memory, progress))
        .transpose()?;
    progress.stage("distance", 0);
    let (hausdorff, hausdorff_bound) = if triangles.is_empty() {
        (0.0, 0.0)
    } else {
        let zero = vec![[0.0; 3]; surface.len()];
        let before = lattice_mesh(
            surface,
            metric,
            &zero,
            &surface.triangles(&lattice_mesh(surface, metric, &zero, &[]).positions),
        );
        let after = lattice_mesh(surface, metric, offsets, triangles);
        let found =
            mesh_distance::compare(&before, &after, &mesh_distance::Params::DEFAULT, progress)?;
        (found.hausdorff, found.hausdorff_bound)
    };
    let fairest = Params {
        threshold: FAIREST_THRESHOLD,
        max_iterations: FAIREST_STEPS,
        ..Params::DEFAULT
    };
    let (best, split, _) = smooth(surface, None, spacing, &fairest, progress)?;
    let normals = normals(&lattice_mesh(surface, metric, &best, &split));
    let ways: Vec<f64> = (0..surface.len())
        .map(|v| {
            let d = sub(offsets[v], best[v]);
            dot(std::array::from_fn(|a| d[a] * metric[a]), normals[v])
        })
        .collect();
    let from_fairest = (sum_by(&ways, |w| w * w) / ways.len().max(1) as f64).sqrt();
    Ok(SmoothError {
        misclassified_voxels,
        hausdorff,
        hausdorff_bound,
        from_fairest,
        fairest_turning_deg: turning(surface, metric, |v| best[v]),
    })
}

/// Number of voxels whose centres these triangles, which close, have on another side than they belong.
pub fn misclassified(
    surface: &Surface,
    inside: &BitGrid,
    offsets: &[Vec3],
    triangles: &[[u32; 3]],
    max_memory: u64,
    progress: &dyn Progress,
) -> Result<u64> {
    progress.stage("voxelize", 0);
    let in_voxels = lattice_mesh(surface, [1.0; 3], offsets, triangles);
    on_wrong_side(inside, &in_voxels, max_memory, progress)
}

fn normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = vec![[0.0; 3]; mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let n = cross(sub(b, a), sub(c, a));
        for v in t {
            let sum = &mut normals[*v as usize];
            *sum = add(*sum, n);
        }
    }
    normals.into_iter().map(normalize).collect()
}
