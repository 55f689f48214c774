//! Numbers of voxels that are known beforehand.

use super::*;
use scantle::measure::voxel_error;
use scantle::mesh::shapes::{cuboid, octasphere, torus_knot};
use scantle::numeric::vector::{Vec3, add, cross, normalize, scale};

/// A sphere of 100,352 triangles; they stand at most 0.003 voxels below a radius of 60 voxels.
fn sphere(radius: f64) -> (Mesh, usize) {
    let side = 2 * (radius as usize + 3);
    let middle = (side / 2) as f64;
    let centre = [middle + 0.137, middle + 0.291, middle + 0.413];
    (octasphere(centre, radius, 112), side)
}

fn is_near(found: u64, wanted: f64, share: f64) -> bool {
    (found as f64 / wanted - 1.0).abs() <= share
}

#[test]
fn a_sphere_sets_the_counts_of_the_exact_sphere() {
    // Counted for the exact sphere with this centre.
    let wanted = [
        (10.0, [630, 1_045, 1_892]),
        (30.0, [5_650, 9_401, 16_972]),
        (60.0, [22_620, 37_599, 67_882]),
    ];
    for (radius, counts) in wanted {
        let (mesh, side) = sphere(radius);
        let modes = [Mode::Z, Mode::ThreeAxis, Mode::Conservative];
        for (mode, count) in modes.into_iter().zip(counts) {
            let (_, stats) = run(&mesh, &unit([side; 3], mode, Fill::None));
            let found = stats.set_voxels;
            assert!(
                is_near(found, f64::from(count), 0.005),
                "{radius} {mode:?}: {found} for {count}"
            );
        }
    }
}

#[test]
fn a_filled_sphere_has_its_volume() {
    let (mesh, side) = sphere(30.0);
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 27_000.0;
    for fill in [Fill::Parity, Fill::Winding] {
        let (_, stats) = run(&mesh, &unit([side; 3], Mode::None, fill));
        assert!(
            is_near(stats.set_voxels, volume, 0.002),
            "{}",
            stats.set_voxels
        );
    }
}

/// The grid of `side` in which exactly the voxels that `f` accepts are set.
fn grid_of(side: usize, f: impl Fn([usize; 3]) -> bool) -> BitGrid {
    let mut grid = BitGrid::new([side; 3]);
    for [x, y, z] in voxels([side; 3]).filter(|v| f(*v)) {
        grid.set(x, y, z);
    }
    grid
}

#[test]
fn a_cube_on_lattice_planes_sets_both_sides_or_the_upper_one() {
    let cube = cuboid([2.0; 3], [5.0; 3]);
    let [three, all] = [Mode::ThreeAxis, Mode::Conservative]
        .map(|mode| run(&cube, &unit([8; 3], mode, Fill::None)).0);
    // Closed cubes meet the closed solid for 1..=5, and are inside of the open one for 3 only.
    let closed = grid_of(8, |v| v.iter().all(|c| (1..=5).contains(c)) && v != [3; 3]);
    assert_eq!(closed.count(), 124);
    assert!(all == closed);
    // Lines through centres 2, 3, 4 meet the lower face in voxel 2, the upper one in voxel 5.
    let on_faces = |upper: usize| {
        move |v: [usize; 3]| {
            (0..3).any(|a| {
                (v[a] == 2 || v[a] == upper) && (0..3).all(|b| b == a || (2..=4).contains(&v[b]))
            })
        }
    };
    assert!(three == grid_of(8, on_faces(5)));
    assert_eq!(three.count(), 46);
    // The same lines, along z only.
    let z = run(&cube, &unit([8; 3], Mode::Z, Fill::None)).0;
    assert!(
        z == grid_of(8, |[x, y, z]| {
            (2..=4).contains(&x) && (2..=4).contains(&y) && (z == 2 || z == 5)
        })
    );
    // On the upper face of the grid the surface belongs to the last voxel.
    let three = run(&cube, &unit([5; 3], Mode::ThreeAxis, Fill::None)).0;
    assert!(three == grid_of(5, on_faces(4)));
    assert_eq!(three.count(), 26);
    let solid = run(&cube, &unit([8; 3], Mode::None, Fill::Winding)).0;
    assert!(solid == grid_of(8, |v| v.iter().all(|c| (2..=4).contains(c))));
}

#[test]
fn one_direction_sees_two_faces_of_a_cube() {
    let cube = cuboid([2.3; 3], [5.6; 3]);
    let z = run(&cube, &unit([8; 3], Mode::Z, Fill::None)).0;
    let caps = grid_of(8, |[x, y, z]| {
        (2..=5).contains(&x) && (2..=5).contains(&y) && (z == 2 || z == 5)
    });
    assert!(z == caps);
}

#[test]
fn closed_surfaces_keep_the_outside_out() {
    let cube = cuboid([2.3; 3], [5.6; 3]);
    let knot = torus_knot(2, 3, 0.4, 144, 46);
    for (mesh, resolution) in [(&cube, 9), (&knot, 16), (&knot, 64)] {
        for mode in [Mode::ThreeAxis, Mode::Conservative] {
            let params = Params {
                size: Size::Resolution(resolution),
                mode,
                ..Params::DEFAULT
            };
            let (volume, stats) = voxelize(mesh, &params, &Silent).expect("a grid");
            let error = voxel_error::measure(
                mesh,
                &volume,
                &params,
                &stats.lattice(),
                stats.orientation(),
                &Silent,
            )
            .expect("measures");
            assert_eq!(error.leaks, Some(0), "{mode:?} at {resolution}");
            assert_eq!(error.not_conservative, 0);
            assert_eq!(error.surface_voxels, stats.set_voxels);
            let within = match mode {
                Mode::Conservative => {
                    assert_eq!(
                        (error.from_surface_max, error.missed_triangles),
                        (Some(0.0), 0)
                    );
                    3f64.sqrt() / 2.0
                }
                _ => 0.5,
            };
            assert!(
                error.to_surface_max <= within + 1e-12,
                "{}",
                error.to_surface_max
            );
            let (mean, max) = (error.to_surface_mean, error.to_surface_max);
            assert!(
                mean > 0.0 && mean <= max,
                "{mean} {max}: {mode:?} at {resolution}"
            );
        }
    }
}

#[test]
fn one_direction_lets_the_outside_in() {
    let cube = cuboid([2.3; 3], [5.6; 3]);
    let params = unit([8; 3], Mode::Z, Fill::None);
    let (volume, stats) = voxelize(&cube, &params, &Silent).expect("a grid");
    let error = voxel_error::measure(
        &cube,
        &volume,
        &params,
        &stats.lattice(),
        stats.orientation(),
        &Silent,
    )
    .expect("measures");
    // 4 x 4 x 4 centres are inside; the caps are set, the two layers between them lie open.
    assert_eq!(error.leaks, Some(32));
}

#[test]
fn a_tilted_plane_sets_what_its_normal_says() {
    for normal in [[0.3, 0.5, 0.81], [1.0, -1.0, 1.0], [0.05, 0.9, 0.2]] {
        let n = normalize(normal);
        let u = normalize(cross(n, [0.9, 0.1, -0.4]));
        let v = cross(n, u);
        let side = 600.0;
        let middle = [450.123, 450.456, 450.789];
        let corner =
            |s: f64, t: f64| -> Vec3 { add(middle, add(scale(u, s * side), scale(v, t * side))) };
        let corners = vec![
            corner(-0.5, -0.5),
            corner(0.5, -0.5),
            corner(0.5, 0.5),
            corner(-0.5, 0.5),
        ];
        let mesh = Mesh::from_triangles(corners, vec![[0, 1, 2], [0, 2, 3]]);
        let sizes = n.map(f64::abs);
        let largest = sizes.iter().fold(0.0f64, |m, c| m.max(*c));
        for (mode, wanted) in [
            (Mode::Z, sizes[2]),
            (Mode::ThreeAxis, largest),
            (Mode::Conservative, sizes.iter().sum()),
        ] {
            let params = Params {
                grid: Storage::Sparse,
                ..unit([900; 3], mode, Fill::None)
            };
            let (_, stats) = voxelize(&mesh, &params, &Silent).expect("a grid");
            let wanted = wanted * side * side;
            assert!(
                is_near(stats.set_voxels, wanted, 0.01),
                "{normal:?} {mode:?}: {} for {wanted}",
                stats.set_voxels
            );
        }
    }
}

#[test]
fn a_sparse_sphere_takes_a_fiftieth_of_the_dense_grid() {
    let mesh = octasphere([0.01, 0.02, 0.03], 1.0, 64);
    let params = Params {
        size: Size::Resolution(512),
        mode: Mode::ThreeAxis,
        pad: 0,
        grid: Storage::Sparse,
        ..Params::DEFAULT
    };
    let (volume, stats) = voxelize(&mesh, &params, &Silent).expect("a grid");
    assert_eq!(stats.dims, [512; 3]);
    assert_eq!(stats.dense_bytes, 16_777_216);
    assert!(is_near(
        stats.set_voxels,
        0.8312 * std::f64::consts::PI * 512.0 * 512.0,
        0.01
    ));
    let mut file = Vec::new();
    scantle::io::svo::write(&volume, &mut file).expect("a file in memory");
    assert!(
        50 * file.len() as u64 <= stats.dense_bytes,
        "{}",
        file.len()
    );
    // Magic, version and flags; then R, and R + 1 numbers after dims, origin and spacing.
    let root = u32::from_le_bytes(file[20..24].try_into().expect("four bytes")) as usize;
    let counts: Vec<u64> = file[96..96 + 8 * (root + 1)]
        .chunks_exact(8)
        .map(|c| u64::from_le_bytes(c.try_into().expect("eight bytes")))
        .collect();
    let levels: Vec<u64> = stats.levels.iter().rev().map(|l| l.nodes).collect();
    assert_eq!(counts, levels);
    let masks: u64 = counts[..root].iter().sum();
    assert_eq!(masks, stats.sparse_bytes);
    assert_eq!(file.len() as u64, 96 + 8 * (root as u64 + 1) + masks);
    assert_eq!(stats.octree_nodes, levels.iter().sum::<u64>());
}
