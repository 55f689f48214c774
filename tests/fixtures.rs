//! Fixtures that are made by formula are what the formula makes, but for the last digits of sines
//! and cosines, which differ between systems.
//!
//! `UPDATE_FIXTURES=1 cargo test fixtures` writes them anew.

use crate::support::{Workplace, files_below, root, updating};
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{read_mesh, write_mesh, write_volume};
use scantle::mesh::{Mesh, shapes};
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
