//! What must not change the voxels, and what must change them in step.

use super::*;
use crate::mesh::shapes::{cylinder, icosphere, joined, open_box, tetrahedron, torus, torus_knot};
use crate::numeric::rng::Rng;
use crate::numeric::vector::Vec3;

const DIMS: [usize; 3] = [37, 33, 41];
const MODES: [Mode; 3] = [Mode::Z, Mode::ThreeAxis, Mode::Conservative];

/// A mesh of closed and open parts, its coordinates whole multiples of 2^-20 within [`DIMS`], so
/// that moving and mirroring it are exact. In the plane of the box's opening, where the winding number
/// is one half, there are no centres.
fn model() -> Mesh {
    let mut mesh = torus([18.3, 16.1, 20.7], 10.0, 4.3, 40, 20);
    mesh = joined(mesh, &tetrahedron([20.0, 14.0, 30.0], 11.0));
    mesh = joined(mesh, &open_box([3.25, 4.5, 5.0], [17.1, 9.0, 30.25]));
    each(mesh, |p| p.map(|c| (c * 1048576.0).round() / 1048576.0))
}

fn each(mut mesh: Mesh, f: impl Fn(Vec3) -> Vec3) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = f(*p));
    mesh
}

/// All parameters under which the results are compared.
fn cases() -> Vec<Params> {
    let fills = [Fill::None, Fill::Parity, Fill::Winding];
    let mut all: Vec<Params> = MODES.map(|mode| unit(DIMS, mode, Fill::None)).to_vec();
    all.extend(fills.map(|fill| unit(DIMS, Mode::ThreeAxis, fill)));
    for fill in [Fill::Parity, Fill::Winding] {
        all.push(unit(DIMS, Mode::None, fill));
    }
    all
}

#[test]
fn the_order_of_triangles_does_not_matter() {
    let mesh = model();
    let mut other = mesh.clone();
    for i in (1..other.triangles.len()).rev() {
        other.triangles.swap(i, Rng::new(7, i as u64).below(i + 1));
    }
    for (i, t) in other.triangles.iter_mut().enumerate() {
        t.rotate_left(i % 3);
    }
    assert_ne!(mesh.triangles, other.triangles);
    for params in cases() {
        let (wanted, stats) = run(&mesh, &params);
        let (found, other_stats) = run(&other, &params);
        assert!(found == wanted, "{params:?}");
        assert_eq!(stats.levels, other_stats.levels);
        assert_eq!(stats.fill_disagreement, other_stats.fill_disagreement);
    }
}

#[test]
fn the_winding_of_triangles_does_not_matter_to_the_surface() {
    let mesh = model();
    let mut other = mesh.clone();
    for (i, t) in other.triangles.iter_mut().enumerate() {
        if Rng::new(8, i as u64).bits() & 1 == 1 {
            t.swap(0, 2);
        }
    }
    for mode in MODES {
        for fill in [Fill::None, Fill::Parity] {
            let params = unit(DIMS, mode, fill);
            assert!(
                run(&other, &params).0 == run(&mesh, &params).0,
                "{params:?}"
            );
        }
    }
    // All triangles at once: the model is inside out, and taken so.
    let mut inverse = mesh.clone();
    inverse.triangles.iter_mut().for_each(|t| t.swap(0, 2));
    let params = unit(DIMS, Mode::None, Fill::Winding);
    let ((wanted, _), (found, stats)) = (run(&mesh, &params), run(&inverse, &params));
    assert!(found == wanted);
    assert_eq!(warned(&stats, "inside-out"), Some(1));
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let mesh = model();
    for grid in [Storage::Dense, Storage::Sparse] {
        for params in cases() {
            let params = Params { grid, ..params };
            let made = |threads: usize| {
                rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .expect("threads")
                    .install(|| voxelize(&mesh, &params, &Silent).expect("a grid"))
            };
            let wanted = made(1);
            for threads in [2, 8] {
                assert!(made(threads) == wanted, "{threads} threads: {params:?}");
            }
        }
    }
}

#[test]
fn dense_and_sparse_grids_hold_the_same() {
    // More than one tile along each axis, and a slab that is no multiple of a brick.
    let knot = torus_knot(2, 3, 0.4, 60, 16);
    let mut all: Vec<(Mesh, Params)> = cases().into_iter().map(|p| (model(), p)).collect();
    for fill in [Fill::None, Fill::Parity, Fill::Winding] {
        for mode in [Mode::ThreeAxis, Mode::Conservative] {
            let size = Size::Resolution(150);
            let bounds = Some([-2.0, -3.5, -1.0, 3.5, 1.0, 0.7]);
            let params = Params {
                size,
                mode,
                fill,
                ..Params::DEFAULT
            };
            all.push((knot.clone(), params.clone()));
            all.push((knot.clone(), Params { bounds, ..params }));
        }
    }
    for (mesh, params) in all {
        let made = |grid| {
            let params = Params {
                grid,
                ..params.clone()
            };
            voxelize(&mesh, &params, &Silent).expect("a grid")
        };
        let ((dense, a), (sparse, b)) = (made(Storage::Dense), made(Storage::Sparse));
        let Data::Sparse(tree) = &sparse.data else {
            panic!("not sparse: {params:?}");
        };
        assert!(dense.data == Data::Bits(tree.to_bits()), "{params:?}");
        assert_eq!(dense.frame, sparse.frame);
        assert_eq!((a.grid, b.grid), (Storage::Dense, Storage::Sparse));
        assert_eq!(
            (
                &a.levels,
                a.set_voxels,
                a.inside_voxels,
                a.fill_disagreement
            ),
            (
                &b.levels,
                b.set_voxels,
                b.inside_voxels,
                b.fill_disagreement
            ),
        );
        assert_eq!(
            (a.sparse_bytes, a.octree_nodes),
            (b.sparse_bytes, b.octree_nodes)
        );
        assert!(a.set_voxels > 0 && a.warnings == b.warnings);
    }
}

#[test]
fn moving_the_model_with_its_bounds_moves_nothing() {
    let mesh = model();
    for by in [
        [1024.0, -768.0, 5.0],
        [-1e6, 33554432.5, 0.0],
        [-37.0, -33.0, -41.0],
    ] {
        let moved = each(mesh.clone(), |p| std::array::from_fn(|a| p[a] + by[a]));
        for params in cases() {
            let bounds = params
                .bounds
                .map(|b| std::array::from_fn(|i| b[i] + by[i % 3]));
            let other = Params {
                bounds,
                ..params.clone()
            };
            assert!(
                run(&moved, &other).0 == run(&mesh, &params).0,
                "{by:?} {params:?}"
            );
        }
    }
}

#[test]
fn scaling_by_a_power_of_two_changes_nothing() {
    let mesh = model();
    for power in [-100, -60, 60, 100] {
        let factor = 2f64.powi(power);
        let scaled = each(mesh.clone(), |p| p.map(|c| c * factor));
        for params in cases() {
            let bounds = params.bounds.map(|b| b.map(|c| c * factor));
            let other = Params {
                bounds,
                size: Size::VoxelSize(factor),
                ..params.clone()
            };
            let ((wanted, a), (found, b)) = (run(&mesh, &params), run(&scaled, &other));
            assert!(found == wanted, "2^{power}: {params:?}");
            assert_eq!(b.spacing, a.spacing.map(|h| h * factor));
        }
        let fitted = Params {
            size: Size::Resolution(24),
            ..Params::DEFAULT
        };
        let ((wanted, a), (found, b)) = (run(&mesh, &fitted), run(&scaled, &fitted));
        assert!(found == wanted && a.dims == b.dims, "2^{power}");
        assert_eq!(b.origin, a.origin.map(|c| c * factor));
    }
}

#[test]
fn a_mirrored_model_has_mirrored_voxels() {
    let mesh = model();
    for axis in 0..3 {
        let size = DIMS[axis] as f64;
        let mirrored = each(mesh.clone(), |mut p| {
            p[axis] = size - p[axis];
            p
        });
        // The upper voxel of two has a face between them, so only the closed rule is symmetric for
        // surfaces on lattice planes.
        let off_planes = |m: &Mesh| each(m.clone(), |p| p.map(|c| 0.999 * c + 0.001));
        let pairs = [
            (Mode::Conservative, mesh.clone(), mirrored.clone()),
            (Mode::ThreeAxis, off_planes(&mesh), {
                each(off_planes(&mesh), |mut p| {
                    p[axis] = size - p[axis];
                    p
                })
            }),
        ];
        for (mode, mesh, mirrored) in pairs {
            let params = unit(DIMS, mode, Fill::None);
            let mut wanted = BitGrid::new(DIMS);
            for mut v in set_voxels(&run(&mesh, &params).0) {
                v[axis] = DIMS[axis] - 1 - v[axis];
                wanted.set(v[0], v[1], v[2]);
            }
            assert!(run(&mirrored, &params).0 == wanted, "{mode:?} along {axis}");
        }
    }
}

#[test]
fn each_rule_sets_what_the_weaker_ones_set() {
    let shapes = [
        model(),
        icosphere([18.0, 16.5, 20.5], 14.0, 3),
        cylinder([18.5, 16.0, 20.0], 9.0, 22.0, 24),
        open_box([4.0, 5.0, 6.0], [20.0, 21.5, 30.0]),
    ];
    for mesh in shapes {
        let [z, three, all] = MODES.map(|mode| run(&mesh, &unit(DIMS, mode, Fill::None)).0);
        assert!(z.count() > 0 && is_subset(&z, &three) && is_subset(&three, &all));
        assert!(z.count() < three.count() && three.count() < all.count());
    }
}

#[test]
fn parity_and_winding_number_agree_on_closed_surfaces() {
    let knot = each(torus_knot(2, 3, 0.4, 90, 24), |p| {
        [5.0 * p[0] + 18.0, 5.0 * p[1] + 16.0, 5.0 * p[2] + 20.0]
    });
    let shapes = [
        knot,
        // Faces, edges and corners on lattice planes and on lines through centres.
        crate::mesh::shapes::cuboid([2.0, 3.5, 4.0], [20.5, 21.0, 22.5]),
        icosphere([18.0, 16.5, 20.5], 14.0, 3),
        cylinder([18.5, 16.0, 20.0], 9.0, 22.0, 24),
        // Partly outside of the grid on every side.
        icosphere([18.0, 16.5, 20.5], 24.0, 3),
    ];
    for mesh in shapes {
        let [parity, winding] =
            [Fill::Parity, Fill::Winding].map(|fill| run(&mesh, &unit(DIMS, Mode::None, fill)));
        assert!(parity.0 == winding.0 && parity.0.count() > 100);
        for (grid, stats) in [parity, winding] {
            assert_eq!(
                (stats.fill_disagreement, stats.border_edges),
                (Some(0), Some(0))
            );
            assert_eq!(stats.inside_voxels, Some(grid.count()));
            assert!(stats.warnings.is_empty(), "{:?}", stats.warnings);
        }
    }
}

#[test]
fn a_solid_is_what_is_inside_and_what_the_surface_sets() {
    let mesh = model();
    for fill in [Fill::Parity, Fill::Winding] {
        let [surface, inside, both] = [
            (Mode::ThreeAxis, Fill::None),
            (Mode::None, fill),
            (Mode::ThreeAxis, fill),
        ]
        .map(|(mode, fill)| run(&mesh, &unit(DIMS, mode, fill)).0);
        let words = surface.words().iter().zip(inside.words());
        assert!(words.map(|(a, b)| a | b).eq(both.words().iter().copied()));
    }
}

#[test]
fn levels_hold_the_or_of_the_voxels_below() {
    let mesh = model();
    for grid in [Storage::Dense, Storage::Sparse] {
        for (levels, keeps_z) in [(Levels::Xyz, false), (Levels::Xy, true)] {
            let params = Params {
                grid,
                levels,
                ..unit(DIMS, Mode::ThreeAxis, Fill::Winding)
            };
            let (bits, stats) = run(&mesh, &params);
            // 41 voxels along z make 64, which xy does not halve: 37 along x make 64 as well.
            assert_eq!(stats.levels.len(), 7);
            for level in &stats.levels {
                let shift = [
                    level.level,
                    level.level,
                    if keeps_z { 0 } else { level.level },
                ];
                let mut nodes: Vec<[usize; 3]> = set_voxels(&bits)
                    .into_iter()
                    .map(|v| std::array::from_fn(|a| v[a] >> shift[a]))
                    .collect();
                nodes.sort_unstable();
                nodes.dedup();
                assert_eq!(level.nodes, nodes.len() as u64, "{level:?}");
                let dims: [u64; 3] =
                    std::array::from_fn(|a| (DIMS[a] as u64).div_ceil(1 << shift[a]));
                assert_eq!(level.dims, dims);
            }
        }
    }
}
