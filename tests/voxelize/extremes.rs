//! Inputs at the edge of what there is, and limits.

use super::*;
use scantle::measure::voxel_error;
use scantle::mesh::shapes::{cuboid, icosphere, tetrahedron};
use scantle::numeric::vector::Vec3;

fn resolution(n: u32, mode: Mode) -> Params {
    Params {
        size: Size::Resolution(n),
        mode,
        ..Params::DEFAULT
    }
}

fn refused(mesh: &Mesh, params: &Params) -> String {
    voxelize(mesh, params, &Silent)
        .expect_err("a refusal")
        .to_string()
}

#[test]
fn a_triangle_between_the_lines_is_missed_by_all_but_the_conservative_rule() {
    // An edge of 0.1 voxels in the corner of a voxel, 0.3 from its crosshair.
    let at = [2.15, 3.15, 1.15];
    let corners = vec![at, [at[0] + 0.1, at[1], at[2]], [at[0], at[1] + 0.1, at[2]]];
    let mesh = Mesh::from_triangles(corners, vec![[0, 1, 2]]);
    for (mode, missed, voxels) in [
        (Mode::ThreeAxis, 1, 0),
        (Mode::Z, 1, 0),
        (Mode::Conservative, 0, 1),
    ] {
        for grid in [Storage::Dense, Storage::Sparse] {
            let params = Params {
                grid,
                ..unit([6; 3], mode, Fill::None)
            };
            let (volume, stats) = voxelize(&mesh, &params, &Silent).expect("a grid");
            let error = voxel_error::measure(
                &mesh,
                &volume,
                &params,
                &stats.lattice(),
                stats.orientation(),
                &Silent,
            )
            .expect("measures");
            assert_eq!(
                (error.missed_triangles, stats.set_voxels),
                (missed, voxels),
                "{mode:?}"
            );
            assert_eq!(error.missed_area, Some(missed as f64));
            assert_eq!((error.three_axis_voxels, error.conservative_voxels), (0, 1));
        }
    }
}

#[test]
fn nothing_sets_nothing() {
    for mode in [Mode::Z, Mode::ThreeAxis, Mode::Conservative] {
        for fill in [Fill::None, Fill::Parity, Fill::Winding] {
            for grid in [Storage::Dense, Storage::Sparse] {
                let params = Params {
                    fill,
                    grid,
                    ..resolution(16, mode)
                };
                let (bits, stats) = run(&Mesh::default(), &params);
                assert_eq!((bits.count(), stats.set_voxels, stats.dims), (0, 0, [3; 3]));
                assert!(stats.levels.iter().all(|l| l.nodes == 0));
                assert_eq!(warned(&stats, "nothing-set"), Some(1));
            }
        }
    }
}

#[test]
fn vertices_that_nothing_uses_are_no_part_of_the_model() {
    let cube = cuboid([0.0; 3], [1.0; 3]);
    let mut more = cube.clone();
    more.positions.extend([[1e6, 0.0, 0.0], [0.0, -3.0, 1e300]]);
    for fill in [Fill::None, Fill::Parity, Fill::Winding] {
        let params = Params {
            fill,
            ..resolution(8, Mode::Conservative)
        };
        let (bits, stats) = run(&cube, &params);
        let (same, other) = run(&more, &params);
        assert!(same == bits && other == stats, "{fill:?}");
    }
}

#[test]
fn a_grid_beside_the_model_is_told() {
    let cube = cuboid([0.0; 3], [1.0; 3]);
    let beside = Params {
        bounds: Some([2.0, 0.0, 0.0, 3.0, 1.0, 1.0]),
        ..resolution(4, Mode::Conservative)
    };
    let (bits, stats) = run(&cube, &beside);
    assert_eq!((bits.count(), warned(&stats, "nothing-set")), (0, Some(1)));
    let message = &stats.warnings[0].message;
    assert!(message.contains("outside of the box"), "{message}");
}

#[test]
fn a_point_sets_its_voxel_under_the_conservative_rule() {
    for at in [[1.5, 2.5, 3.5], [0.3, 0.4, 0.9], [2.0, 2.0, 2.0], [6.0; 3]] {
        let cloud = Mesh {
            positions: vec![at],
            points: vec![0],
            ..Mesh::default()
        };
        let (bits, stats) = run(&cloud, &unit([6; 3], Mode::Conservative, Fill::None));
        assert_eq!(set_voxels(&bits), [at.map(|c| (c as usize).min(5))]);
        assert!(stats.warnings.is_empty());
        for mode in [Mode::Z, Mode::ThreeAxis] {
            let (bits, stats) = run(&cloud, &unit([6; 3], mode, Fill::None));
            assert_eq!((bits.count(), warned(&stats, "no-area")), (0, Some(1)));
        }
        // A model without extent is put in the middle of one voxel and its margin.
        let (bits, stats) = run(&cloud, &resolution(64, Mode::Conservative));
        assert_eq!((stats.dims, stats.spacing), ([3; 3], [1.0; 3]));
        assert_eq!(set_voxels(&bits), [[1; 3]]);
    }
}

#[test]
fn segments_set_the_voxels_they_run_through() {
    let mesh = Mesh {
        positions: vec![[0.5, 0.5, 0.5], [4.5, 0.5, 0.5], [4.5, 3.5, 3.5]],
        segments: vec![[0, 1], [1, 2]],
        ..Mesh::default()
    };
    let (bits, _) = run(&mesh, &unit([6; 3], Mode::Conservative, Fill::None));
    let mut wanted: Vec<[usize; 3]> = (0..5).map(|x| [x, 0, 0]).collect();
    // On the diagonal the closed cubes beside each passed edge are met too.
    for i in 0..3 {
        wanted.extend([[4, i + 1, i], [4, i, i + 1], [4, i + 1, i + 1]]);
    }
    wanted.sort_unstable();
    let mut found = set_voxels(&bits);
    found.sort_unstable();
    assert_eq!(found, wanted);
    let (bits, stats) = run(&mesh, &unit([6; 3], Mode::ThreeAxis, Fill::None));
    assert_eq!((bits.count(), warned(&stats, "no-area")), (0, Some(2)));
}

#[test]
fn triangles_without_area_are_counted_and_met_as_segments() {
    let mesh = Mesh::from_triangles(
        vec![
            [0.5, 0.5, 0.5],
            [4.5, 0.5, 0.5],
            [2.5, 0.5, 0.5],
            [0.5, 3.5, 2.25],
        ],
        vec![[0, 1, 3], [0, 1, 2], [3, 3, 3]],
    );
    let (bits, stats) = run(&mesh, &unit([6; 3], Mode::Conservative, Fill::None));
    assert_eq!(
        (
            stats.degenerate_triangles,
            warned(&stats, "degenerate-triangles")
        ),
        (2, Some(2))
    );
    assert!((0..5).all(|x| bits.get(x, 0, 0)));
    let alone = Mesh {
        triangles: vec![[0, 1, 2]],
        ..mesh.clone()
    };
    let (bits, _) = run(&alone, &unit([6; 3], Mode::Conservative, Fill::None));
    assert_eq!(bits.count(), 5);
    let (bits, _) = run(&alone, &unit([6; 3], Mode::ThreeAxis, Fill::Winding));
    assert_eq!(bits.count(), 0);
}

#[test]
fn a_flat_model_has_a_grid_of_one_layer() {
    let mut flat = icosphere([0.0; 3], 3.0, 3);
    flat.positions.iter_mut().for_each(|p| p[1] = 7.0);
    for mode in [Mode::ThreeAxis, Mode::Conservative] {
        let params = Params {
            pad: 0,
            ..resolution(20, mode)
        };
        let (bits, stats) = run(&flat, &params);
        assert_eq!(stats.dims[1], 1);
        // The disc of radius 10 voxels, at least the voxels whose centres it covers.
        assert!(bits.count() > 290 && bits.count() < 400, "{}", bits.count());
    }
}

#[test]
fn the_smallest_and_the_farthest_models_look_like_any_other() {
    // Turned, so that it meets each side of its box, a plane between voxels, in one point alone.
    let mut mesh = icosphere([0.0; 3], 1.0, 2);
    let (s, c) = 0.7f64.sin_cos();
    for [x, y, z] in &mut mesh.positions {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
        (*y, *z) = (c * *y - s * *z, s * *y + c * *z);
        (*x, *y, *z) = (*x + 0.1, *y + 0.2, *z + 0.3);
    }
    for mode in [Mode::ThreeAxis, Mode::Conservative] {
        let params = Params {
            fill: Fill::Winding,
            ..resolution(24, mode)
        };
        let (_, wanted) = run(&mesh, &params);
        let place = |f: &dyn Fn(Vec3) -> Vec3| {
            let mut mesh = mesh.clone();
            mesh.positions.iter_mut().for_each(|p| *p = f(*p));
            run(&mesh, &params).1
        };
        // Not a power of two, so vertices are rounded; the counts may differ by a voxel at each side.
        for scale in [1e-30, 1e-300, 1e200] {
            let stats = place(&|p| p.map(|c| c * scale));
            assert_eq!(stats.dims, wanted.dims);
            let found = stats.set_voxels;
            assert!(
                found.abs_diff(wanted.set_voxels) <= 6,
                "{scale}: {found} for {}",
                wanted.set_voxels
            );
        }
        let stats = place(&|p| p.map(|c| c + 1e9));
        assert!(stats.set_voxels.abs_diff(wanted.set_voxels) <= 6);
        assert_eq!(stats.warnings, []);
    }
    let tiny = cuboid([0.0; 3], [1e-310; 3]);
    assert!(
        refused(&tiny, &resolution(16, Mode::Conservative)).contains("below the smallest normal")
    );
    let huge = cuboid([-1.7e308; 3], [1.7e308; 3]);
    assert!(refused(&huge, &resolution(16, Mode::Conservative)).contains("its extent overflows"));
    let far = unit([4; 3], Mode::Conservative, Fill::None);
    let message = refused(&cuboid([0.0; 3], [1e100; 3]), &far);
    assert!(
        message.contains("voxels from the grid, over 2^300"),
        "{message}"
    );
}

#[test]
fn bounds_beside_the_model_hold_nothing_of_it() {
    let mesh = cuboid([0.0; 3], [4.0; 3]);
    for grid in [Storage::Dense, Storage::Sparse] {
        for fill in [Fill::None, Fill::Parity, Fill::Winding] {
            for lo in [
                [10.0, 0.0, 0.0],
                [-20.0, 0.0, 0.0],
                [0.0, 0.0, 90.0],
                [-1e9; 3],
            ] {
                let bounds = Some([lo[0], lo[1], lo[2], lo[0] + 5.0, lo[1] + 5.0, lo[2] + 5.0]);
                let params = Params {
                    grid,
                    bounds,
                    ..unit([5; 3], Mode::Conservative, fill)
                };
                let (bits, stats) = run(&mesh, &params);
                assert_eq!((bits.count(), stats.dims), (0, [5; 3]));
            }
            // Inside of the model there is no surface, and all is filled.
            let bounds = Some([1.25, 1.25, 1.25, 2.75, 2.75, 2.75]);
            let size = Size::VoxelSize(0.25);
            let params = Params {
                size,
                grid,
                bounds,
                ..unit([6; 3], Mode::Conservative, fill)
            };
            let wanted = if fill == Fill::None { 0 } else { 216 };
            assert_eq!(run(&mesh, &params).0.count(), wanted);
        }
    }
}

#[test]
fn a_grid_states_its_bytes_and_is_refused_over_the_limit() {
    let mesh = cuboid([0.0; 3], [1.0; 3]);
    let made = |n: u32, grid| Params {
        pad: 0,
        grid,
        ..resolution(n, Mode::ThreeAxis)
    };
    for (n, bytes) in [(128, 262_144), (512, 16_777_216)] {
        for grid in [Storage::Dense, Storage::Sparse] {
            let (_, stats) = voxelize(&mesh, &made(n, grid), &Silent).expect("a grid");
            assert_eq!(stats.dense_bytes, bytes);
        }
    }
    let limited = Params {
        max_memory: 1 << 29,
        ..made(2048, Storage::Dense)
    };
    let error = voxelize(&mesh, &limited, &Silent).expect_err("too much memory");
    assert!(matches!(error, Error::Limit { .. }), "{error:?}");
    assert!(error.hint().is_some_and(|h| h.contains("--grid sparse")));
    let sparse = Params {
        max_memory: 1 << 12,
        ..made(512, Storage::Sparse)
    };
    assert!(matches!(
        voxelize(&mesh, &sparse, &Silent),
        Err(Error::Limit { .. })
    ));
    // By itself a grid of more than 1024^3 is sparse.
    let (_, stats) = voxelize(
        &Mesh::default(),
        &Params {
            bounds: Some([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
            ..made(1025, Storage::Auto)
        },
        &Silent,
    )
    .expect("a grid");
    assert_eq!(stats.grid, Storage::Sparse);
}

#[test]
fn parameters_out_of_range_are_refused_with_the_option() {
    let mesh = cuboid([0.0; 3], [1.0; 3]);
    let base = Params::DEFAULT;
    let bounds = |b: [f64; 6]| Params {
        bounds: Some(b),
        ..base.clone()
    };
    let size = |size: Size| Params {
        size,
        ..base.clone()
    };
    for (params, wanted) in [
        (size(Size::Resolution(0)), "--resolution 0: "),
        (size(Size::Resolution(65_537)), "--resolution 65537: "),
        (size(Size::VoxelSize(0.0)), "--voxel-size 0: "),
        (size(Size::VoxelSize(f64::NAN)), "--voxel-size NaN: "),
        (
            size(Size::VoxelSize(1e-9)),
            "a grid with voxels of 1e-9 needs ",
        ),
        (
            Params {
                pad: 70_000,
                ..base.clone()
            },
            "--pad 70000: ",
        ),
        (
            bounds([0.0; 6]),
            "--bounds 0.0,0.0,0.0,0.0,0.0,0.0: has no extent",
        ),
        (
            bounds([0.0, 0.0, 2.0, 1.0, 1.0, 1.0]),
            "--bounds 0.0,0.0,2.0,1.0,1.0,1.0: the lower corner",
        ),
        (
            bounds([0.0, 0.0, 0.0, 1.0, f64::INFINITY, 1.0]),
            "--bounds 0.0,0.0,0.0,1.0,inf,1.0: has a number",
        ),
        (
            Params {
                mode: Mode::None,
                ..base.clone()
            },
            "--mode none: sets nothing",
        ),
    ] {
        let message = refused(&mesh, &params);
        assert!(message.starts_with(wanted), "{message}");
    }
}

#[test]
fn a_grid_of_one_voxel_works() {
    let mesh = tetrahedron([0.5; 3], 0.4);
    for mode in [Mode::Z, Mode::ThreeAxis, Mode::Conservative] {
        let (bits, stats) = run(&mesh, &unit([1; 3], mode, Fill::Winding));
        assert_eq!((bits.count(), stats.inside_voxels), (1, Some(1)));
        assert_eq!(stats.levels.len(), 1);
    }
}
