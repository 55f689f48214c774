//! How faithful a smoothed surface is, and how far from the fairest one.

use super::mesh_distance;
use super::sides::{on_other_side, on_wrong_side};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::numeric::sums::sum_by;
use crate::numeric::vector::{Vec3, add, cross, dot, length, normalize, sub};
use crate::progress::Progress;
use crate::volume::bits::BitGrid;
use crate::volume::isosurface::{NONE, Surface};
use crate::volume::smooth_mc::{Params, smooth, turning};
use rayon::prelude::*;
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
    /// Largest distance between the surface and the one that was smoothed, measured both ways, in the
    /// smallest spacing: at least this.
    pub hausdorff: f64,
    /// At most this.
    pub hausdorff_bound: f64,
    /// Root mean square over the vertices of the distance, along its normals, to the fairest surface: the
    /// least bending within the diamond, after a thousand steps; in the smallest spacing. Null for a dual
    /// surface, which has no such counterpart.
    pub from_fairest: Option<f64>,
    /// Root mean square of the angle between chords of the curves in which the fairest surface meets
    /// the planes of voxel centres, in degrees; null where there is no curve.
    pub fairest_turning_deg: Option<f64>,
}

/// A surface in voxels, in units of the smallest spacing.
pub fn lattice_mesh(
    surface: &Surface,
    metric: Vec3,
    offsets: &[Vec3],
    triangles: &[[u32; 3]],
) -> Mesh {
    let positions = surface.on_grid(metric, |v| offsets[v]);
    Mesh::from_triangles(positions, triangles.to_vec())
}

/// What the voxels of a surface are known from.
#[derive(Debug, Clone, Copy)]
pub enum Voxels<'a> {
    /// They are given.
    Given(&'a BitGrid),
    /// They are what the surface of marching cubes encloses.
    Enclosed,
    /// The surface is open, or has several insides.
    Unknown,
}

/// A smoothed surface, in voxels.
#[derive(Debug, Clone, Copy)]
pub struct Smoothed<'a> {
    /// What was smoothed.
    pub surface: &'a Surface,
    /// Lengths of the steps of its grid.
    pub spacing: Vec3,
    /// The way of each vertex, in voxels.
    pub offsets: &'a [Vec3],
    /// Its triangles.
    pub triangles: &'a [[u32; 3]],
}

impl Smoothed<'_> {
    fn metric(&self) -> Vec3 {
        let smallest = self.spacing.iter().copied().fold(f64::INFINITY, f64::min);
        self.spacing.map(|s| s / smallest)
    }

    /// The surface as it was, and the smoothed one, in voxels times `metric`.
    fn meshes(&self, metric: Vec3) -> [Mesh; 2] {
        let zero = vec![[0.0; 3]; self.surface.len()];
        let mut before = lattice_mesh(self.surface, metric, &zero, &[]);
        before.triangles = self.surface.triangles(&before.positions);
        let after = lattice_mesh(self.surface, metric, self.offsets, self.triangles);
        [before, after]
    }

    /// Number of voxels whose centres lie on another side than they belong, if that can be known.
    ///
    /// Errs as voxelizing does.
    pub fn misclassified(
        &self,
        voxels: Voxels,
        max_memory: u64,
        progress: &dyn Progress,
    ) -> Result<Option<u64>> {
        progress.stage("voxelize", 0);
        let after = || lattice_mesh(self.surface, [1.0; 3], self.offsets, self.triangles);
        match voxels {
            Voxels::Given(inside) => {
                on_wrong_side(inside, &after(), max_memory, progress).map(Some)
            }
            Voxels::Enclosed => {
                let [before, after] = self.meshes([1.0; 3]);
                on_other_side(&before, &after, max_memory, progress).map(Some)
            }
            Voxels::Unknown => Ok(None),
        }
    }
}

/// Measures what [`smooth`] made of a surface.
///
/// Errs as voxelizing and comparing meshes do. Cost: a thousand steps of smoothing, a filled grid, and
/// distances between meshes.
pub fn measure(
    smoothed: &Smoothed,
    voxels: Voxels,
    max_memory: u64,
    progress: &dyn Progress,
) -> Result<SmoothError> {
    let misclassified_voxels = smoothed.misclassified(voxels, max_memory, progress)?;
    let (surface, metric) = (smoothed.surface, smoothed.metric());
    progress.stage("distance", 0);
    let (hausdorff, hausdorff_bound) = if smoothed.triangles.is_empty() {
        (0.0, 0.0)
    } else {
        let [before, after] = smoothed.meshes(metric);
        let params = mesh_distance::Params::DEFAULT;
        let found = mesh_distance::compare(&before, &after, &params, progress)?;
        (found.hausdorff, found.hausdorff_bound)
    };
    let curves = surface.links.iter().any(|links| *links != [NONE; 4]);
    let (from_fairest, fairest_turning_deg) = if curves {
        let (distance, turning) = to_fairest(smoothed, progress)?;
        (Some(distance), turning)
    } else {
        (surface.is_empty().then_some(0.0), None)
    };
    Ok(SmoothError {
        misclassified_voxels,
        hausdorff,
        hausdorff_bound,
        from_fairest,
        fairest_turning_deg,
    })
}

/// The distance to the fairest surface, and how much that turns.
fn to_fairest(smoothed: &Smoothed, progress: &dyn Progress) -> Result<(f64, Option<f64>)> {
    let (surface, metric) = (smoothed.surface, smoothed.metric());
    let fairest = Params {
        threshold: FAIREST_THRESHOLD,
        max_iterations: FAIREST_STEPS,
        ..Params::DEFAULT
    };
    let (best, split, _) = smooth(surface, None, smoothed.spacing, &fairest, progress)?;
    let normals = normals(&lattice_mesh(surface, metric, &best, &split));
    let ways: Vec<f64> = (0..surface.len())
        .map(|v| {
            let d = sub(smoothed.offsets[v], best[v]);
            dot(std::array::from_fn(|a| d[a] * metric[a]), normals[v])
        })
        .collect();
    let distance = (sum_by(&ways, |w| w * w) / ways.len() as f64).sqrt();
    Ok((distance, turning(surface, metric, |v| best[v])))
}

/// What any surface of a volume is judged by, whoever made it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Judged {
    /// Who made it.
    pub method: &'static str,
    /// Its triangles.
    pub triangles: u64,
    /// What it encloses, in percent of what marching cubes encloses.
    pub volume_percent: Option<f64>,
    /// Voxels whose centres lie on another side than they belong.
    pub misclassified_voxels: Option<u64>,
    /// Largest distance between it and the surface of marching cubes, both ways, in diagonals of a cell.
    pub hausdorff_cell_diagonals: f64,
    /// Mean angle between triangles at an edge, in degrees.
    pub dihedral_mean_deg: f64,
}

/// Judges a surface in voxels against that of marching cubes.
///
/// Errs and costs as [`measure`] does without the smoothing.
pub fn judge(
    method: &'static str,
    marching_cubes: &Mesh,
    mesh: &Mesh,
    spacing: Vec3,
    voxels: Voxels,
    max_memory: u64,
    progress: &dyn Progress,
) -> Result<Judged> {
    progress.stage("judge", 0);
    let smallest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let scaled = |mesh: &Mesh| {
        let at = |p: &Vec3| std::array::from_fn(|a| p[a] * spacing[a] / smallest);
        let positions = mesh.positions.iter().map(at).collect();
        Mesh::from_triangles(positions, mesh.triangles.clone())
    };
    let (before, after) = (scaled(marching_cubes), scaled(mesh));
    let misclassified_voxels = match voxels {
        Voxels::Given(inside) => Some(on_wrong_side(inside, mesh, max_memory, progress)?),
        Voxels::Enclosed => Some(on_other_side(marching_cubes, mesh, max_memory, progress)?),
        Voxels::Unknown => None,
    };
    let mut judged = Judged {
        method,
        triangles: mesh.triangles.len() as u64,
        volume_percent: None,
        misclassified_voxels,
        hausdorff_cell_diagonals: 0.0,
        dihedral_mean_deg: dihedral_mean_deg(&after),
    };
    if !before.triangles.is_empty() && !after.triangles.is_empty() {
        let params = mesh_distance::Params::DEFAULT;
        let found = mesh_distance::compare(&before, &after, &params, progress)?;
        let volumes = found.a.volume.zip(found.b.volume);
        judged.volume_percent = volumes.map(|(a, b)| 100.0 * b / a);
        judged.hausdorff_cell_diagonals = found.hausdorff * smallest / length(spacing);
    }
    Ok(judged)
}

/// Mean angle between the triangles at each edge that two of them share, in degrees; 0 without such.
fn dihedral_mean_deg(mesh: &Mesh) -> f64 {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], t as u32));
        }
    }
    sides.par_sort_unstable();
    let normal = |t: u32| {
        let [a, b, c] = mesh.corners(t as usize);
        cross(sub(b, a), sub(c, a))
    };
    let (mut sum, mut count) = (0.0, 0u64);
    for pair in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, s), (_, t)] = pair {
            let (m, n) = (normal(*s), normal(*t));
            sum += length(cross(m, n)).atan2(dot(m, n));
            count += 1;
        }
    }
    if count == 0 {
        0.0
    } else {
        (sum / count as f64).to_degrees()
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use crate::volume::isosurface::{Border, Select, extract, inside};
    use crate::volume::smooth_mc::Energy;
    use crate::volume::smooth_mc::region::Constraint;
    use crate::volume::{Data, Frame, Volume};

    /// The paper's sphere: the distances of its figure 7.
    #[test]
    fn the_sphere_stays_as_near_as_in_the_paper() {
        let n = 64;
        let value = |i: usize| {
            let at = [i % n, i / n % n, i / n / n].map(|c| c as f64 - 31.5);
            u8::from(dot(at, at) <= 900.0)
        };
        let volume = Volume {
            frame: Frame::straight([n; 3], [0.0; 3], [1.0; 3]),
            data: Data::U8((0..n * n * n).map(value).collect()),
        };
        let surface = extract(&volume, &Select::Set, Border::Closed, &Silent).expect("a surface");
        let bits = inside(&volume, &Select::Set);
        for (constraint, lowest, highest) in [
            (Constraint::Diamond, 0.23, 0.25),
            (Constraint::CellEdge, 0.28, 0.2887),
            (Constraint::CellSize, 0.49, 0.5),
        ] {
            let params = Params {
                constraint,
                energy: Energy::Laplacian,
                max_iterations: Params::LAPLACIAN_ITERATIONS,
                ..Params::DEFAULT
            };
            let (offsets, triangles, _) =
                smooth(&surface, None, [1.0; 3], &params, &Silent).expect("a smooth surface");
            let smoothed = Smoothed {
                surface: &surface,
                spacing: [1.0; 3],
                offsets: &offsets,
                triangles: &triangles,
            };
            let found = measure(&smoothed, Voxels::Given(&bits), 1 << 30, &Silent).expect("errors");
            let diagonals = found.hausdorff / 3f64.sqrt();
            assert!(
                (lowest..=highest).contains(&diagonals),
                "{constraint:?}: {diagonals}"
            );
            assert!(found.hausdorff <= found.hausdorff_bound);
            let wrong = found.misclassified_voxels.expect("closed");
            assert_eq!(
                wrong == 0,
                constraint.is_faithful(),
                "{constraint:?}: {wrong}"
            );
            let off = found.from_fairest.expect("a net of curves");
            assert!(off > 0.0 && off < 0.5);
        }
    }

    #[test]
    fn a_cube_turns_at_its_edges() {
        let mesh = crate::mesh::shapes::cuboid([0.0; 3], [1.0; 3]);
        // Twelve edges of 90 degrees and six diagonals of squares.
        assert!((dihedral_mean_deg(&mesh) - 60.0).abs() < 1e-9);
    }
}
