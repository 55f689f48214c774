use super::filled::INSIDE_SAMPLES;
use super::*;
use crate::mesh::shapes::{cuboid, octasphere, open_box, sheet, torus_knot};
use crate::progress::Silent;
use crate::volume::voxelize::{Params, Size, voxelize};

/// Voxels of edge 1 from the origin on.
fn unit(side: usize, mode: Mode) -> Params {
    let side = side as f64;
    Params {
        size: Size::VoxelSize(1.0),
        bounds: Some([0.0, 0.0, 0.0, side, side, side]),
        mode,
        ..Params::DEFAULT
    }
}

fn lattice(side: usize) -> Lattice {
    Lattice {
        anchor: [0.0; 3],
        margin: [0.0; 3],
        h: 1.0,
        dims: [side; 3],
    }
}

fn volume(side: usize, f: impl Fn(usize, usize, usize) -> bool) -> Volume {
    let mut grid = BitGrid::new([side; 3]);
    for z in 0..side {
        for y in 0..side {
            for x in (0..side).filter(|x| f(*x, y, z)) {
                grid.set(x, y, z);
            }
        }
    }
    Volume {
        frame: lattice(side).frame(),
        data: Data::Bits(grid),
    }
}

fn is_inside(x: usize, y: usize, z: usize) -> bool {
    [x, y, z].iter().all(|c| (2..=6).contains(c))
}

/// The voxels of the cube from 2 to 6 with a coordinate of 2 or 6.
fn is_shell(x: usize, y: usize, z: usize) -> bool {
    is_inside(x, y, z) && [x, y, z].iter().any(|c| *c == 2 || *c == 6)
}

#[test]
fn a_shell_leaks_where_a_voxel_is_missing() {
    let solid = volume(9, is_inside);
    let of = |f: &dyn Fn(usize, usize, usize) -> bool| leaks(&volume(9, f), &solid);
    assert_eq!(of(&is_shell), 0);
    // The 3 x 3 x 3 voxels within, and the missing one itself.
    assert_eq!(
        of(&|x, y, z| is_shell(x, y, z) && (x, y, z) != (2, 4, 3)),
        28
    );
    assert_eq!(
        of(&|x, y, z| is_shell(x, y, z) && (x, y, z) != (4, 4, 6)),
        28
    );
    // A voxel on an edge of the shell opens itself only: within, it touches by an edge.
    assert_eq!(
        of(&|x, y, z| is_shell(x, y, z) && (x, y, z) != (2, 2, 4)),
        1
    );
    assert_eq!(of(&|_, _, _| false), 125);
    assert_eq!(of(&|_, _, _| true), 0);
}

#[test]
fn a_flood_does_not_pass_diagonal_gaps() {
    let solid = volume(9, is_inside);
    // Without its edges and corners the shell is 6 faces that touch each other diagonally: paths of
    // 26 neighbours pass between them, paths of 6 do not.
    let faces = volume(9, |x, y, z| {
        is_shell(x, y, z) && [x, y, z].iter().filter(|c| **c == 2 || **c == 6).count() == 1
    });
    let edges_and_corners = 125 - 27 - 54;
    assert_eq!(leaks(&faces, &solid), edges_and_corners);
    // A wall in steps through the grid keeps its sides apart, until one of its voxels goes.
    let below = volume(9, |x, y, _| x + y < 8);
    let wall = |gap: bool| {
        volume(9, move |x, y, z| {
            x + y == 8 && !(gap && (x, y, z) == (4, 4, 4))
        })
    };
    // Both sides reach the border of the grid; a box around the lower one does not.
    let boxed = |gap: bool| {
        volume(9, move |x, y, z| {
            let wall = x + y == 8 && !(gap && (x, y, z) == (4, 4, 4));
            wall || x == 0 || y == 0 || z == 0 || z == 8
        })
    };
    assert!(leaks(&wall(false), &below) > 0);
    assert_eq!(leaks(&boxed(false), &below), 0);
    let within = (1..8u64).map(|x| 7 - x).sum::<u64>() * 7;
    assert_eq!(leaks(&boxed(true), &below), within);
}

#[test]
fn a_leak_is_found_around_corners_and_across_words() {
    // A tunnel of one voxel that winds through a full grid wider than a word.
    let side = 70;
    let path = |x: usize, y: usize, z: usize| match z {
        3 => y == 5 && (1..=68).contains(&x),
        4 => (x, y) == (68, 5),
        5 => x == 68 && (5..=60).contains(&y) || y == 60 && (2..=68).contains(&x),
        _ => false,
    };
    let open = |x: usize, y: usize, z: usize| path(x, y, z) || (x, y, z) == (0, 5, 3);
    let tunnel = volume(side, path);
    let length = tunnel.count_set();
    assert_eq!(length, 68 + 1 + 56 + 66);
    assert_eq!(leaks(&volume(side, |x, y, z| !path(x, y, z)), &tunnel), 0);
    assert_eq!(
        leaks(&volume(side, |x, y, z| !open(x, y, z)), &tunnel),
        length
    );
}

#[test]
fn distances_from_and_to_the_surface_are_those_of_the_voxels() {
    // The square from 2 to 7 in the plane z = 3.25.
    let mut mesh = sheet(5.0, 5.0, 2, 2);
    mesh.positions
        .iter_mut()
        .for_each(|p| *p = [p[0] + 4.5, p[1] + 4.5, 3.25]);
    let of = |f: &dyn Fn(usize, usize, usize) -> bool, mode| {
        measure(
            &mesh,
            &volume(9, f),
            &unit(9, mode),
            &lattice(9),
            &Orientation::default(),
            &Silent,
        )
        .expect("measures")
    };
    // One voxel, right above the square's middle.
    let one = of(&|x, y, z| (x, y, z) == (4, 4, 7), Mode::Conservative);
    assert!(
        (one.to_surface_max - 4.25).abs() < 1e-12,
        "{}",
        one.to_surface_max
    );
    assert_eq!(one.to_surface_max, one.to_surface_mean);
    // A corner of the square is farthest from the voxel's box, whose low side is at (4, 4, 7) and
    // high side at (5, 5, 8).
    let farthest = (2.0f64 * 2.0 + 2.0 * 2.0 + 3.75 * 3.75).sqrt();
    assert!((one.from_surface_max.expect("a voxel") - farthest).abs() < 1e-12);
    assert_eq!((one.missed_triangles, one.missed_area), (8, Some(1.0)));
    // Diagonally off a corner.
    let corner = of(&|x, y, z| (x, y, z) == (8, 8, 3), Mode::Conservative);
    let wanted = (1.5f64 * 1.5 * 2.0 + 0.25 * 0.25).sqrt();
    assert!((corner.to_surface_max - wanted).abs() < 1e-12);
    // The layer that holds the square, and nothing.
    let layer = of(
        &|x, y, z| z == 3 && (1..=7).contains(&x) && (1..=7).contains(&y),
        Mode::Conservative,
    );
    assert_eq!(
        (layer.from_surface_max, layer.missed_triangles),
        (Some(0.0), 0)
    );
    assert!((layer.to_surface_max - (0.5f64 * 0.5 * 2.0 + 0.25 * 0.25).sqrt()).abs() < 1e-12);
    let nothing = of(&|_, _, _| false, Mode::ThreeAxis);
    assert_eq!(
        (nothing.to_surface_max, nothing.from_surface_max),
        (0.0, None)
    );
    assert_eq!(
        (nothing.missed_triangles, nothing.missed_area),
        (8, Some(1.0))
    );
    assert_eq!((nothing.surface_voxels, nothing.three_axis_voxels), (0, 25));
    assert_eq!(nothing.conservative_voxels, 49);
    assert_eq!(nothing.leaks, None);
}

#[test]
fn centres_inside_of_a_filled_model_are_on_it() {
    let cube = cuboid([2.3; 3], [6.4; 3]);
    let solid = volume(9, is_inside);
    let params = |fill| Params {
        fill,
        ..unit(9, Mode::Conservative)
    };
    let of = |fill| {
        measure(
            &cube,
            &solid,
            &params(fill),
            &lattice(9),
            &Orientation::default(),
            &Silent,
        )
        .expect("measures")
    };
    // The middle voxel's centre is 1.9 from the upper face.
    let surface = of(Fill::None);
    assert!(
        (surface.to_surface_max - 1.9).abs() < 1e-12,
        "{}",
        surface.to_surface_max
    );
    // Filled, the farthest are the corners at (6.5, 6.5, 6.5).
    let filled = of(Fill::Winding);
    assert!(
        (filled.to_surface_max - 0.1 * 3f64.sqrt()).abs() < 1e-12,
        "{}",
        filled.to_surface_max
    );
    assert_eq!((surface.leaks, filled.leaks), (Some(0), Some(0)));
}

#[test]
fn missed_triangles_are_those_without_a_voxel_of_their_own() {
    let small = |x: f64| {
        let corners = vec![[x, 1.1, 1.1], [x + 0.2, 1.1, 1.1], [x, 1.3, 1.2]];
        Mesh::from_triangles(corners, vec![[0, 1, 2]])
    };
    let mut mesh = crate::mesh::shapes::joined(small(1.1), &small(3.1));
    // Twice the edge, four times the area.
    let large = vec![[5.1, 1.1, 1.1], [5.5, 1.1, 1.1], [5.1, 1.5, 1.3]];
    mesh = crate::mesh::shapes::joined(mesh, &Mesh::from_triangles(large, vec![[0, 1, 2]]));
    let of = |set: &[usize]| {
        let held = volume(8, |x, y, z| (y, z) == (1, 1) && set.contains(&x));
        missed(&mesh, &held, [8; 3])
    };
    assert_eq!(of(&[1, 3, 5]), (0, Some(0.0)));
    let (count, share) = of(&[1, 5]);
    let share = share.expect("triangles");
    assert!(
        count == 1 && (share - 1.0 / 6.0).abs() < 1e-12,
        "{count} {share}"
    );
    let (count, share) = of(&[3]);
    let share = share.expect("triangles");
    assert!(
        count == 2 && (share - 5.0 / 6.0).abs() < 1e-12,
        "{count} {share}"
    );
    // Neighbours of their voxels do not count.
    assert_eq!(of(&[0, 2, 4, 6]).0, 3);
    // What lies outside of the grid is not missed in it.
    let held = volume(3, |_, _, _| false);
    assert_eq!(missed(&mesh, &held, [3; 3]).0, 1);
}

#[test]
fn open_and_cut_surfaces_have_no_leaks_to_count() {
    let params = unit(9, Mode::ThreeAxis);
    let of = |mesh: &Mesh| {
        let (made, stats) = voxelize(mesh, &params, &Silent).expect("a grid");
        measure(
            mesh,
            &made,
            &params,
            &stats.lattice(),
            stats.orientation(),
            &Silent,
        )
        .expect("measures")
        .leaks
    };
    assert_eq!(of(&cuboid([2.3; 3], [6.4; 3])), Some(0));
    assert_eq!(of(&open_box([2.3; 3], [6.4; 3])), None);
    assert_eq!(of(&cuboid([2.3; 3], [16.4; 3])), None);
    assert_eq!(of(&Mesh::default()), None);
}

#[test]
fn a_sphere_reaches_the_proven_bounds() {
    let mesh = octasphere([10.137, 10.291, 10.413], 8.0, 20);
    for (mode, bound) in [(Mode::ThreeAxis, 0.5), (Mode::Conservative, 0.75f64.sqrt())] {
        let of = |storage| {
            let params = Params {
                grid: storage,
                ..unit(21, mode)
            };
            let (made, stats) = voxelize(&mesh, &params, &Silent).expect("a grid");
            measure(
                &mesh,
                &made,
                &params,
                &stats.lattice(),
                stats.orientation(),
                &Silent,
            )
            .expect("measures")
        };
        let error = of(Storage::Dense);
        assert_eq!(error, of(Storage::Sparse));
        assert!(error.to_surface_max <= bound && error.to_surface_max > 0.9 * bound);
        assert_eq!((error.leaks, error.not_conservative), (Some(0), 0));
        match mode {
            Mode::Conservative => assert_eq!(error.from_surface_max, Some(0.0)),
            _ => assert!(
                error
                    .from_surface_max
                    .is_some_and(|e| e > 0.05 && e <= 1.23)
            ),
        }
        assert!(error.samples > 64 * 800);
    }
}

#[test]
fn a_knot_of_many_voxels_does_not_leak() {
    let mesh = torus_knot(2, 3, 0.4, 288, 92);
    let made = |mode, fill| {
        let params = Params {
            mode,
            fill,
            ..Params::DEFAULT
        };
        voxelize(&mesh, &params, &Silent).expect("a grid").0
    };
    let inside = made(Mode::None, Fill::Winding);
    assert_eq!(leaks(&made(Mode::ThreeAxis, Fill::None), &inside), 0);
    assert!(leaks(&made(Mode::Z, Fill::None), &inside) > 1000);
}

#[test]
fn segments_and_points_are_sampled_as_triangles_are() {
    let mut mesh = cuboid([2.3; 3], [4.4; 3]);
    let from = mesh.positions.len() as u32;
    mesh.positions
        .extend([[9.5, 3.5, 3.5], [9.5, 5.5, 3.5], [3.5, 3.5, 9.5]]);
    let cube = mesh.clone();
    mesh.segments.push([from, from + 1]);
    let of = |mesh: &Mesh, mode| {
        let params = unit(11, mode);
        let (made, stats) = voxelize(mesh, &params, &Silent).expect("a grid");
        let lattice = stats.lattice();
        measure(mesh, &made, &params, &lattice, stats.orientation(), &Silent).expect("measures")
    };
    // No line through centres meets a segment: its far end is 9.5 - 5 away in x, 5.5 - 4 in y.
    let missed = of(&mesh, Mode::ThreeAxis);
    let farthest = (4.5f64 * 4.5 + 1.5 * 1.5).sqrt();
    let found = missed.from_surface_max.expect("voxels");
    assert!((found - farthest).abs() < 1e-12, "{found}");
    assert_eq!(of(&cube, Mode::ThreeAxis).samples + 17, missed.samples);
    let met = of(&mesh, Mode::Conservative);
    assert_eq!((met.from_surface_max, met.not_conservative), (Some(0.0), 0));
    assert!(met.to_surface_max <= 0.75f64.sqrt());

    let thin = Mesh {
        triangles: Vec::new(),
        points: vec![from + 2],
        ..mesh.clone()
    };
    let met = of(&thin, Mode::Conservative);
    assert_eq!((met.samples, met.from_surface_max), (18, Some(0.0)));
    assert_eq!((met.missed_triangles, met.missed_area), (0, None));
    let bounds = |error: &VoxelError| error.accuracy(Vec::new(), 1.0);
    assert!(
        bounds(&met)
            .iter()
            .all(|a| a.measure != "triangles none of whose voxels is set" || !a.verified)
    );
    let unmet = of(&thin, Mode::ThreeAxis);
    assert_eq!((unmet.samples, unmet.from_surface_max), (18, None));
    // Out of the grid there is no sample, and nothing is known.
    let params = unit(2, Mode::Conservative);
    let (made, stats) = voxelize(&thin, &params, &Silent).expect("a grid");
    let lattice = stats.lattice();
    let out = measure(
        &thin,
        &made,
        &params,
        &lattice,
        stats.orientation(),
        &Silent,
    );
    let out = out.expect("measures");
    assert_eq!((out.samples, out.from_surface_max), (0, None));
}

#[test]
fn a_voxel_too_many_is_found_in_every_mode() {
    let cube = cuboid([2.3; 3], [6.4; 3]);
    for mode in [Mode::Z, Mode::ThreeAxis, Mode::Conservative] {
        let params = unit(9, mode);
        let (made, stats) = voxelize(&cube, &params, &Silent).expect("a grid");
        let of = |made: &Volume| {
            let lattice = stats.lattice();
            measure(&cube, made, &params, &lattice, stats.orientation(), &Silent).expect("measures")
        };
        assert_eq!(of(&made).not_conservative, 0);
        for extra in [[4, 4, 4], [0, 8, 3], [1, 4, 4], [7, 7, 7]] {
            let more = volume(9, |x, y, z| {
                [x, y, z] == extra || Held::of(&made).get(x, y, z)
            });
            assert_eq!(of(&more).not_conservative, 1, "{extra:?}");
        }
    }
}

#[test]
fn a_wrong_fill_is_no_error_of_nothing() {
    let cube = cuboid([2.3; 3], [6.4; 3]);
    let params = |fill| Params {
        fill,
        ..unit(9, Mode::None)
    };
    for fill in [Fill::Parity, Fill::Winding] {
        let of = |f: &dyn Fn(usize, usize, usize) -> bool, orientation: &Orientation| {
            let made = volume(9, f);
            measure(
                &cube,
                &made,
                &params(fill),
                &lattice(9),
                orientation,
                &Silent,
            )
            .expect("measures")
        };
        let as_is = Orientation::default();
        // Centres from 2.5 to 5.5 are inside: 4 x 4 x 4 of 9 x 9 x 9.
        let solid = |x: usize, y: usize, z: usize| [x, y, z].iter().all(|c| (2..=5).contains(c));
        let right = of(&solid, &as_is);
        assert_eq!(
            (
                right.to_surface_max,
                right.not_conservative,
                right.inside_missed
            ),
            (0.0, 0, Some(0))
        );
        let samples = right.inside_samples.expect("a fill") as f64;
        let share = 64.0 / 729.0 * INSIDE_SAMPLES as f64;
        assert!((samples / share - 1.0).abs() < 0.05, "{samples} of {share}");
        // A row that runs on to the border of the grid.
        let leaked = of(&|x, y, z| solid(x, y, z) || (y, z) == (3, 3), &as_is);
        assert!(
            (leaked.to_surface_max - 2.1).abs() < 1e-12,
            "{}",
            leaked.to_surface_max
        );
        assert_eq!(leaked.not_conservative, 4);
        // A hole of one voxel, whose centre is half a voxel from the next set one.
        let holed = of(&|x, y, z| solid(x, y, z) && (x, y, z) != (3, 3, 3), &as_is);
        assert!(holed.inside_missed.is_some_and(|n| n > 40));
        // The cube's corner at 6.4 is farther off than that.
        let corner = holed.from_surface_max.expect("voxels");
        assert!((corner - 0.4 * 3f64.sqrt()).abs() < 1e-12, "{corner}");
        let made = volume(9, |x, y, z| solid(x, y, z) && (x, y, z) != (3, 3, 3));
        let inside = Inside::of(&cube, fill, &as_is).expect("a fill");
        let room = Room::new(&cube, &made, &params(fill), &lattice(9)).expect("room");
        let cells = Cells::of(&made, &room).expect("room");
        let filled = missed_inside(&cube, &made, &cells, &inside);
        assert_eq!(filled.farthest, Some(0.5));
        // The other way round nothing is inside by the winding number, and the same by parity.
        let inverted = Orientation {
            inverted: true,
            ..Orientation::default()
        };
        let turned = of(&solid, &inverted);
        assert_eq!(turned.inside_samples == Some(0), fill == Fill::Winding);
        assert_eq!(turned.to_surface_max > 1.0, fill == Fill::Winding);
    }
}
