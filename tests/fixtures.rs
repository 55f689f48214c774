//! Fixtures that are made by formula are what the formula makes, but for the last digits of sines
//! and cosines, which differ between systems.
//!
//! `UPDATE_FIXTURES=1 cargo test fixtures` writes them anew.

use crate::support::{Workplace, files_below, root, updating};
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{read_mesh, write_mesh, write_volume};
use scantle::mesh::{Mesh, shapes};
use scantle::progress::Silent;
use scantle::volume::isosurface::{Border, Select, at_level, axis_of, extract};
use scantle::volume::{Data, Frame, Volume};
use std::fs;

/// A file below `fixtures/`, and what is in it. Its format is that of its name.
type Row<T> = (&'static str, fn() -> T);

const MESHES: &[Row<Mesh>] = &[
    ("shapes/cube.obj", || shapes::cuboid([0.0; 3], [1.0; 3])),
    ("shapes/cube.ply", || shapes::cuboid([0.0; 3], [1.0; 3])),
    ("shapes/open-box.obj", || {
        shapes::open_box([-1.0, -1.0, 0.0], [1.0, 1.0, 0.5])
    }),
    ("shapes/sheet.off", || shapes::sheet(2.0, 1.0, 8, 4)),
    ("shapes/sphere.stl", || {
        shapes::uv_sphere([0.0; 3], 1.0, 16, 8)
    }),
    ("shapes/torus.obj", || {
        shapes::torus([0.0; 3], 1.0, 0.25, 48, 16)
    }),
    ("shapes/torus-knot.ply", || {
        shapes::torus_knot(2, 3, 0.4, 160, 24)
    }),
    ("shapes/staircase.ply", || marching_cubes(false)),
    ("shapes/grey.ply", || marching_cubes(true)),
    ("shapes/points.ply", || Mesh {
        points: (0..96).collect(),
        ..helix(96)
    }),
    ("shapes/polyline.obj", || Mesh {
        segments: (1..96).map(|i| [i - 1, i]).collect(),
        ..helix(96)
    }),
];

const VOLUMES: &[Row<Volume>] = &[
    ("volumes/ball.nrrd", || ball(16)),
    ("volumes/ball.mha", || ball(16)),
    ("volumes/labels.nii", labels),
    ("volumes/nothing.npy", || of_values(|_| 0)),
    ("volumes/not-a-number.npy", || Volume {
        data: Data::F32(
            (0..64)
                .map(|i| if i == 21 { f32::NAN } else { i as f32 })
                .collect(),
        ),
        ..of_values(|_| 0)
    }),
];

/// Vertices along three turns of a helix: radius 1, height 1.5, 32 to a turn.
fn helix(n: u32) -> Mesh {
    let at = |i: u32| {
        let turns = f64::from(i) / 32.0;
        let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
        [cos, sin, 0.5 * turns]
    };
    Mesh {
        positions: (0..n).map(at).collect(),
        ..Mesh::default()
    }
}

/// The signed distance to a sphere of radius 0.75 around the origin, positive inside, in a cube
/// of edge 2 with `n` samples along each axis.
fn ball(n: usize) -> Volume {
    let spacing = 2.0 / n as f64;
    let first = -1.0 + spacing / 2.0;
    let frame = Frame::straight([n; 3], [first; 3], [spacing; 3]);
    let at = |i: usize| first + spacing * i as f64;
    let samples = (0..n * n * n).map(|i| {
        let [x, y, z] = [at(i % n), at(i / n % n), at(i / n / n)];
        (0.75 - (x * x + y * y + z * z).sqrt()) as f32
    });
    Volume {
        frame,
        data: Data::F32(samples.collect()),
    }
}

/// Two halves of a ball that touch (1 and 3), a plate of one voxel that stands in both (4), a voxel of
/// its own (7) and a rod (9); voxels are not cubes, and the grid is not at the origin.
fn labels() -> Volume {
    let dims = [24, 22, 18];
    let value = |i: usize| {
        let [x, y, z] = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
        let [dx, dy, dz] = [x as f64 - 10.2, y as f64 - 10.7, 1.5 * (z as f64 - 8.4)];
        if [x, y, z] == [21, 3, 3] {
            7
        } else if y == 1 && z == 15 && (2..22).contains(&x) {
            9
        } else if z == 8 && y > 4 && x > 4 && x < 22 {
            4
        } else if dx * dx + dy * dy + dz * dz > 64.0 {
            0
        } else if dx + 0.3 * dy < 0.0 {
            1
        } else {
            3
        }
    };
    Volume {
        frame: Frame::straight(dims, [10.0, -4.0, 2.0], [0.5, 0.5, 0.75]),
        data: Data::U8((0..dims.iter().product()).map(value).collect()),
    }
}

/// A cube of four voxels along each side.
fn of_values(value: impl Fn(usize) -> u8) -> Volume {
    Volume {
        frame: Frame::straight([4; 3], [0.0; 3], [1.0; 3]),
        data: Data::U8((0..64).map(value).collect()),
    }
}

/// The surface of marching cubes around label 1 of [`labels`], or where [`ball`] is 0.
fn marching_cubes(grey: bool) -> Mesh {
    let (volume, select) = if grey {
        (ball(16), Select::AtLeast(0.0))
    } else {
        (labels(), Select::Equal(1.0))
    };
    let surface = extract(&volume, &select, Border::Closed, &Silent).expect("a surface");
    let along = if grey {
        at_level(&volume, &surface, 0.0)
    } else {
        vec![0.0; surface.len()]
    };
    let positions = surface.positions(&volume.frame, |v| {
        let mut offset = [0.0; 3];
        offset[axis_of(surface.places[v])] = along[v];
        offset
    });
    let triangles = surface.triangles(&positions);
    Mesh::from_triangles(positions, triangles)
}

/// Whether two files are the same, or hold meshes that differ by the roundings of single precision.
fn are_near(name: &str, a: Vec<u8>, b: Vec<u8>) -> bool {
    let mesh = |bytes| {
        let source = Source::from_bytes(name, bytes).ok()?;
        read_mesh(&source, None).ok().map(|(mesh, _, _)| mesh)
    };
    if a == b {
        return true;
    }
    let (Some(a), Some(b)) = (mesh(a), mesh(b)) else {
        return false;
    };
    let coordinates = a
        .positions
        .iter()
        .flatten()
        .zip(b.positions.iter().flatten());
    a.positions.len() == b.positions.len()
        && a.triangles == b.triangles
        && a.segments == b.segments
        && a.points == b.points
        && coordinates.into_iter().all(|(x, y)| (x - y).abs() < 1e-6)
}

#[test]
fn made_fixtures_are_current() {
    let place = Workplace::new();
    let mut stale = Vec::new();
    let mut check = |name: &str, write: &dyn Fn(&Sink) -> scantle::error::Result<()>| {
        let fresh = place.path(&name.replace('/', "-"));
        write(&Sink::File(fresh.clone())).expect("a fixture is written");
        let (fresh, kept) = (
            fs::read(fresh).expect("it"),
            root().join("fixtures").join(name),
        );
        if updating("UPDATE_FIXTURES") {
            fs::create_dir_all(kept.parent().expect("a folder")).expect("a folder");
            fs::write(kept, fresh).expect("a fixture is written");
        } else if !fs::read(kept).is_ok_and(|kept| are_near(name, kept, fresh)) {
            stale.push(name.to_owned());
        }
    };
    for (name, make) in MESHES {
        check(name, &|sink| {
            let format = sink.format().expect("the name tells the format");
            write_mesh(&make(), sink, format).map(drop)
        });
    }
    for (name, make) in VOLUMES {
        check(name, &|sink| {
            let format = sink.format().expect("the name tells the format");
            write_volume(&make(), sink, format).map(drop)
        });
    }
    assert!(stale.is_empty(), "{stale:?} are not what the formula makes");
}

#[test]
fn every_folder_of_fixtures_says_where_they_are_from() {
    let readme = fs::read_to_string(root().join("fixtures/README.md")).expect("fixtures/README.md");
    for folder in fs::read_dir(root().join("fixtures")).expect("fixtures/") {
        let folder = folder.expect("an entry");
        if folder.path().is_dir() {
            let name = format!("`{}/`", folder.file_name().display());
            let is_golden = files_below(&folder.path())
                .iter()
                .any(|file| file.file_name().is_some_and(|name| name == "cmd"));
            let is_described = readme.contains(&name);
            assert!(is_golden || is_described, "fixtures/README.md lacks {name}");
        }
    }
}
