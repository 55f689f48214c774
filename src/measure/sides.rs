//! Which voxels a surface has on the wrong side.

use crate::error::Result;
use crate::mesh::Mesh;
use crate::progress::Progress;
use crate::volume::bits::BitGrid;
use crate::volume::voxelize::{self, Fill, Mode, Params, Size, Storage};
use crate::volume::{Data, Volume};
use rayon::prelude::*;

/// Number of voxels whose centres a closed mesh has on another side than they belong.
///
/// The mesh is in voxels: voxel (i, j, k) has its centre at (i, j, k). Decided by voxelizing the mesh
/// anew, by the parity of exact crossings, which knows nothing of how it was made. Errs as
/// [`voxelize::voxelize`]. Cost: that of filling the grid; memory: two more grids of bits.
pub fn on_wrong_side(
    inside: &BitGrid,
    mesh: &Mesh,
    max_memory: u64,
    progress: &dyn Progress,
) -> Result<u64> {
    if mesh.triangles.is_empty() {
        return Ok(inside.count());
    }
    let end = inside.dims().map(|n| n as f64 - 0.5);
    let bounds = [-0.5, -0.5, -0.5, end[0], end[1], end[2]];
    let found = filled(mesh, bounds, max_memory, progress)?;
    Ok(differing(inside, &found))
}

/// Number of voxels that two closed meshes have on different sides, the first around all that is inside.
///
/// Both are in voxels, as in [`on_wrong_side`], and the second within half a voxel of the first.
pub fn on_other_side(
    before: &Mesh,
    after: &Mesh,
    max_memory: u64,
    progress: &dyn Progress,
) -> Result<u64> {
    if before.triangles.is_empty() {
        return Ok(0);
    }
    let around = before.used_bounds();
    let lo = around.lo.map(|c| c.floor() - 0.5);
    let hi = around.hi.map(|c| c.ceil() + 0.5);
    let bounds = [lo[0], lo[1], lo[2], hi[0], hi[1], hi[2]];
    let inside = filled(before, bounds, max_memory, progress)?;
    let found = filled(after, bounds, max_memory, progress)?;
    match &inside.data {
        Data::Bits(bits) => Ok(differing(bits, &found)),
        _ => Ok(0),
    }
}

/// The voxels inside of a mesh, by the parity of crossings.
fn filled(
    mesh: &Mesh,
    bounds: [f64; 6],
    max_memory: u64,
    progress: &dyn Progress,
) -> Result<Volume> {
    let params = Params {
        size: Size::VoxelSize(1.0),
        mode: Mode::None,
        fill: Fill::Parity,
        bounds: Some(bounds),
        grid: Storage::Dense,
        max_memory,
        ..Params::DEFAULT
    };
    Ok(voxelize::voxelize(mesh, &params, progress)?.0)
}

fn differing(inside: &BitGrid, found: &Volume) -> u64 {
    let mut held = BitGrid::new([inside.dims()[0], inside.dims()[1], 1]);
    match &found.data {
        Data::Bits(grid) => inside
            .words()
            .par_iter()
            .zip(grid.words())
            .map(|(a, b)| u64::from((a ^ b).count_ones()))
            .sum(),
        _ => (0..inside.dims()[2])
            .map(|z| {
                found.read_bit_slices(z, &mut held);
                let rows = 0..inside.dims()[1];
                rows.map(|y| {
                    let pairs = inside.row(y, z).iter().zip(held.row(y, 0));
                    pairs
                        .map(|(a, b)| u64::from((a ^ b).count_ones()))
                        .sum::<u64>()
                })
                .sum::<u64>()
            })
            .sum(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::smooth_error::lattice_mesh;
    use crate::numeric::rng::Rng;
    use crate::numeric::vector::Vec3;
    use crate::progress::Silent;
    use crate::volume::Frame;
    use crate::volume::isosurface::{
        Border, Labels, Select, Surface, extract, extract_labels, inside,
    };
    use crate::volume::smooth_mc::region::Constraint;
    use crate::volume::smooth_mc::{Energy, Params as Smoothing, Thin, smooth};

    fn volume(dims: [usize; 3], values: Vec<u8>) -> Volume {
        Volume {
            frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
            data: Data::U8(values),
        }
    }

    fn random(round: u64, kinds: usize, density: f64) -> Volume {
        let mut rng = Rng::new(31, round);
        let value = |_| {
            if rng.unit() < density {
                1 + rng.below(kinds - 1) as u8
            } else {
                0
            }
        };
        volume([16; 3], (0..4096).map(value).collect())
    }

    fn wrong(volume: &Volume, params: &Smoothing) -> u64 {
        let surface = extract(volume, &Select::Set, Border::Closed, &Silent).expect("a surface");
        let (offsets, triangles, _) =
            smooth(&surface, None, [1.0; 3], params, &Silent).expect("a smooth surface");
        let mesh = lattice_mesh(&surface, [1.0; 3], &offsets, &triangles);
        let inside = inside(volume, &Select::Set);
        on_wrong_side(&inside, &mesh, 1 << 30, &Silent).expect("a voxelization")
    }

    /// Voxels of a label, and how many lie on another side of the walls around it.
    fn of_label(
        volume: &Volume,
        label: usize,
        surface: &Surface,
        offsets: &[Vec3],
        triangles: &[[u32; 3]],
    ) -> (u64, u64) {
        let own = surface.triangles_around(label as u16, triangles);
        let mesh = lattice_mesh(surface, [1.0; 3], offsets, &own);
        let inside = inside(volume, &Select::Equal(label as f64));
        let wrong = on_wrong_side(&inside, &mesh, 1 << 30, &Silent);
        (inside.count(), wrong.expect("a voxelization"))
    }

    #[test]
    fn no_voxel_changes_sides_in_the_diamond_or_on_the_edge_and_some_do_in_the_box() {
        let mut in_the_box = 0;
        for round in 0..200u64 {
            let volume = random(round, 2, 0.1 + 0.8 * (round % 9) as f64 / 8.0);
            let energy = [Energy::Laplacian, Energy::Bilaplacian][round as usize % 2];
            for constraint in [Constraint::Diamond, Constraint::CellEdge] {
                let params = Smoothing {
                    constraint,
                    energy,
                    thin: [Thin::Guard, Thin::Off][round as usize / 2 % 2],
                    ..Smoothing::DEFAULT
                };
                assert_eq!(wrong(&volume, &params), 0, "round {round}, {params:?}");
            }
            let params = Smoothing {
                constraint: Constraint::CellSize,
                energy,
                ..Smoothing::DEFAULT
            };
            in_the_box += wrong(&volume, &params);
        }
        assert!(in_the_box > 0);
    }

    #[test]
    fn no_voxel_of_any_label_changes_sides() {
        for round in 0..60u64 {
            let kinds = 3 + round as usize % 5;
            let volume = random(round, kinds, 0.4 + 0.6 * (round % 7) as f64 / 6.0);
            let labels = Labels::new((1..kinds).map(|k| k as f64).collect());
            let surface = extract_labels(&volume, &labels, &Silent).expect("walls");
            for energy in [Energy::Laplacian, Energy::Bilaplacian] {
                let params = Smoothing {
                    energy,
                    ..Smoothing::DEFAULT
                };
                let (offsets, triangles, stats) =
                    smooth(&surface, None, [1.0; 3], &params, &Silent).expect("smooth walls");
                for label in 1..kinds {
                    let (voxels, wrong) = of_label(&volume, label, &surface, &offsets, &triangles);
                    assert_eq!(wrong, 0, "round {round}, label {label}");
                    assert_eq!(stats.parts[label].voxels, Some(voxels as i64));
                }
            }
        }
    }

    /// The proof does not ask where in its region a vertex goes.
    #[test]
    fn vertices_anywhere_in_their_diamonds_keep_every_voxel_on_its_side() {
        for round in 0..100u64 {
            let kinds = 2 + round as usize % 6;
            let volume = random(round, kinds, 0.5);
            let labels = Labels::new((1..kinds).map(|k| k as f64).collect());
            let surface = extract_labels(&volume, &labels, &Silent).expect("walls");
            let mut rng = Rng::new(5, round);
            let corner = |_: usize| {
                // Corners of the octahedron, where the proof is closest to failing, and points within.
                let mut offset = [0.0; 3];
                offset[rng.below(3)] = if rng.unit() < 0.5 {
                    -0.4999995
                } else {
                    0.4999995
                };
                let share = if rng.unit() < 0.7 { 1.0 } else { rng.unit() };
                offset.map(|c| c * share)
            };
            let offsets: Vec<_> = (0..surface.len()).map(corner).collect();
            let triangles = surface.triangles(&surface.on_grid([1.0; 3], |v| offsets[v]));
            for label in 1..kinds {
                let (_, wrong) = of_label(&volume, label, &surface, &offsets, &triangles);
                assert_eq!(wrong, 0, "round {round}, label {label}");
            }
        }
    }
}
