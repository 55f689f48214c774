//! Surfaces of volumes land where the file says, close, and stand for the same voxels.

use crate::support::{Workplace, root};
use scantle::io::format::Format;
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{read_mesh, write_volume};
use scantle::mesh::Mesh;
use scantle::mesh::topology::topology;
use scantle::progress::Silent;
use scantle::volume::isosurface::{Select, inside};
use scantle::volume::{Data, Frame, Volume};

fn mesh(place: &Workplace, name: &str) -> Mesh {
    let path = place.path(name);
    let source = Source::open(path.to_str().expect("a name"), u64::MAX).expect("a file");
    read_mesh(&source, None).expect("a mesh").0
}

/// An ellipsoid in a grid that is turned, offset, and where `mirrored` left-handed.
fn turned_ellipsoid(mirrored: bool) -> Volume {
    let (sin, cos) = 0.6f64.sin_cos();
    let sign = if mirrored { -1.0 } else { 1.0 };
    let dims = [26, 22, 20];
    let inside = |i: usize| {
        let p = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
        let q = [
            (p[0] as f64 - 12.0) / 9.0,
            (p[1] as f64 - 10.0) / 7.0,
            (p[2] as f64 - 9.0) / 5.0,
        ];
        u8::from(q.iter().map(|c| c * c).sum::<f64>() <= 1.0)
    };
    Volume {
        frame: Frame {
            dims,
            origin: [-120.5, 33.25, 71.0],
            axes: [
                [0.5 * cos, 0.5 * sin, 0.0],
                [-0.75 * sin, 0.75 * cos, 0.0],
                [0.0, 0.0, 1.25 * sign],
            ],
        },
        data: Data::U8((0..dims.iter().product()).map(inside).collect()),
    }
}

#[test]
fn a_surface_lands_where_the_affine_of_the_file_says() {
    for mirrored in [false, true] {
        let place = Workplace::new();
        let volume = turned_ellipsoid(mirrored);
        let sink = Sink::File(place.path("turned.nii"));
        write_volume(&volume, &sink, Format::Nifti).expect("a file");
        for line in [
            "smooth-mc turned.nii -o surface.ply",
            "isosurface turned.nii --iso 0.5 --border closed -o surface.ply",
        ] {
            let ran = place.run(line);
            assert_eq!(ran.code, 0, "{}", ran.stderr);
            let mesh = mesh(&place, "surface.ply");
            let found = topology(&mesh, &Silent).expect("a closed mesh");
            assert!(found.closed && found.oriented && found.manifold);
            let one = 0.5 * 0.75 * 1.25;
            let voxels = volume.count_set() as f64 * one;
            // Outwards, in space: a mirrored grid turns no surface inside out.
            let enclosed = found.volume.expect("a volume");
            assert!(
                (enclosed / voxels - 1.0).abs() < 0.02,
                "{line}: {enclosed} {voxels}"
            );
            let middle = |a: usize| {
                let steps = [12.0, 10.0, 9.0];
                volume.frame.origin[a]
                    + (0..3)
                        .map(|k| steps[k] * volume.frame.axes[k][a])
                        .sum::<f64>()
            };
            for a in 0..3 {
                let n = mesh.positions.len() as f64;
                let mean = mesh.positions.iter().map(|p| p[a]).sum::<f64>() / n;
                assert!(
                    (mean - middle(a)).abs() < 0.05,
                    "{line}: axis {a}: {mean} {}",
                    middle(a)
                );
            }
        }
    }
}

#[test]
fn each_label_is_closed_and_holds_its_voxels_and_no_other() {
    let place = Workplace::new();
    let labels = root().join("fixtures/volumes/labels.nii");
    let source = Source::open(labels.to_str().expect("a name"), u64::MAX).expect("a file");
    let volume = scantle::io::read_volume(&source, None).expect("a volume").0;
    let Data::U8(values) = &volume.data else {
        panic!("labels are bytes");
    };
    let ran = place.run("smooth-mc fixtures/volumes/labels.nii --labels all -o body-{label}.ply");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    for label in [1, 3, 4, 7, 9] {
        let name = format!("body-{label}.ply");
        let found = topology(&mesh(&place, &name), &Silent).expect("a mesh");
        assert!(found.closed && found.oriented, "label {label}: {found:?}");
        // Cubes of a quarter, of which each voxel's centre is the centre of one.
        let ran = place.run(&format!(
            "voxelize {name} --mode none --fill winding --voxel-size 0.25 \
             --bounds 9.875,-4.125,1.875,21.875,6.875,15.375 -o {label}.npy"
        ));
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let path = place.path(&format!("{label}.npy"));
        let source = Source::open(path.to_str().expect("a name"), u64::MAX).expect("a file");
        let filled = scantle::io::read_volume(&source, None).expect("voxels").0;
        let bits = inside(&filled, &Select::Set);
        let [nx, ny, nz] = volume.frame.dims;
        for (i, value) in values.iter().enumerate() {
            let [x, y, z] = [i % nx, i / nx % ny, i / nx / ny];
            assert!(z < nz);
            let found = bits.get(2 * x, 2 * y, 3 * z);
            assert_eq!(found, *value == label, "label {label} at {x}, {y}, {z}");
        }
    }
}

#[test]
fn walls_know_the_labels_on_both_sides() {
    let place = Workplace::new();
    let ran = place.run("smooth-mc fixtures/volumes/labels.nii --labels 1,3 -o walls.ply");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let bytes = std::fs::read(place.path("walls.ply")).expect("a file");
    let header = String::from_utf8_lossy(&bytes[..bytes.len().min(600)]).into_owned();
    assert!(
        header.contains("property int label\nproperty int label_outside\n"),
        "{header}"
    );
    let walls = mesh(&place, "walls.ply");
    let report = ran.document();
    assert_eq!(report["result"]["triangles"], walls.triangles.len());
    // Each wall counts once, and twice where both sides are labels.
    let around: u64 = report["result"]["labels"]
        .as_array()
        .expect("labels")
        .iter()
        .map(|body| body["triangles"].as_u64().expect("a count"))
        .sum();
    assert!(around > walls.triangles.len() as u64);
    let ran = place.run("smooth-mc fixtures/volumes/labels.nii --labels 1,3 -o walls.stl");
    assert!(
        ran.stderr.contains("stl files hold no labels of faces"),
        "{}",
        ran.stderr
    );
    let ran = place.run("smooth-mc fixtures/volumes/labels.nii --label 1 -o body-{label}.ply");
    assert_eq!(ran.code, 2, "{}", ran.stderr);
}
