//! What is one voxel thick keeps its share of what marching cubes encloses.

use crate::numeric::vector::Vec3;
use crate::progress::Silent;
use crate::volume::isosurface::{Border, Select, extract};
use crate::volume::smooth_mc::{Energy, Params, Stats, Thin, smooth};
use crate::volume::{Data, Frame, Volume};

/// Boxes of voxels, each from its first voxel on, of so many.
fn boxes(n: usize, boxes: &[([usize; 3], [usize; 3])]) -> Volume {
    let mut values = vec![0; n * n * n];
    for (first, size) in boxes {
        for z in first[2]..first[2] + size[2] {
            for y in first[1]..first[1] + size[1] {
                for x in first[0]..first[0] + size[0] {
                    values[(z * n + y) * n + x] = 1;
                }
            }
        }
    }
    Volume {
        frame: Frame::straight([n; 3], [0.0; 3], [1.0; 3]),
        data: Data::U8(values),
    }
}

fn smoothed(volume: &Volume, energy: Energy, spacing: Vec3) -> Stats {
    let params = Params {
        energy,
        thin: Thin::Guard,
        max_iterations: match energy {
            Energy::Laplacian => Params::LAPLACIAN_ITERATIONS,
            Energy::Bilaplacian => Params::DEFAULT.max_iterations,
        },
        ..Params::DEFAULT
    };
    let surface = extract(volume, &Select::Set, Border::Closed, &Silent).expect("a surface");
    let (_, _, stats) =
        smooth(&surface, None, spacing, &params, &Silent).expect("a smooth surface");
    stats
}

/// Every part keeps at least this share in both energies, and none counts as vanishing.
fn keeps(volume: &Volume, share: f64) {
    for energy in [Energy::Laplacian, Energy::Bilaplacian] {
        for spacing in [[1.0; 3], [1.0, 1.0, 2.5], [0.4, 1.0, 1.0]] {
            let stats = smoothed(volume, energy, spacing);
            assert_eq!(stats.vanishing, 0);
            for part in &stats.parts {
                let kept = part.volume_after / part.volume_before;
                assert!(kept >= share, "{energy:?}, spacing {spacing:?}: {kept}");
            }
        }
    }
}

#[test]
fn voxels_alone_keep_an_eighth() {
    let at = [[1, 1, 1], [4, 1, 2], [2, 5, 1], [5, 5, 5], [1, 3, 6]];
    keeps(&boxes(8, &at.map(|at| (at, [1; 3]))), 0.12);
}

/// Voxels that touch at edges and corners alone are parts of their own.
#[test]
fn voxels_that_touch_at_corners_keep_an_eighth() {
    let at = [
        [2, 2, 2],
        [3, 3, 3],
        [4, 2, 4],
        [4, 4, 2],
        [1, 3, 2],
        [2, 4, 4],
    ];
    keeps(&boxes(8, &at.map(|at| (at, [1; 3]))), 0.12);
}

#[test]
fn a_rod_of_one_voxel_keeps_a_quarter() {
    for size in [[20, 1, 1], [1, 20, 1], [1, 1, 20]] {
        keeps(&boxes(24, &[([2; 3], size)]), 0.25);
    }
}

#[test]
fn a_plate_of_one_voxel_keeps_most_of_it() {
    for size in [[1, 20, 20], [20, 1, 20], [20, 20, 1]] {
        let plate = boxes(24, &[([2; 3], size)]);
        for spacing in [[1.0; 3], [1.0, 1.0, 2.5]] {
            let stats = smoothed(&plate, Energy::Bilaplacian, spacing);
            let kept = stats.volume_after.expect("closed") / stats.volume_before.expect("closed");
            assert!(kept >= 0.8, "{spacing:?}: {kept}");
        }
        keeps(&plate, 0.8);
    }
}
