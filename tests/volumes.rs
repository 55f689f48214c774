//! Voxels survive every way through the formats, and `compare` sees each one that does not.

use crate::support::{Workplace, root};
use scantle::io::read_volume;
use scantle::io::source::Source;
use scantle::with_samples;
use std::collections::BTreeMap;
use std::fs;

/// The names of the volume formats that are written and, where `read`, read too.
fn volume_formats(place: &Workplace, read: bool) -> Vec<String> {
    let table = place.run("formats --json").document();
    let rows = table["formats"].as_array().expect("rows");
    rows.iter()
        .filter(|row| row["kind"] == "volume" && row["write"] == true)
        .filter(|row| !read || row["read"] == true)
        .map(|row| row["name"].as_str().expect("a name").to_owned())
        .collect()
}

/// A ring in a cube of 20 voxels an edge, as an octree.
fn with_a_ring() -> Workplace {
    let place = Workplace::new();
    let line = "voxelize fixtures/shapes/torus.obj --resolution 20 --grid sparse \
                --bounds -1.5,-1.5,-1.5,1.5,1.5,1.5 -o ring.svo";
    let ran = place.run(line);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    place
}

/// The voxels that differ; `moved` says that the grids are at two places, which fails the check.
fn differing(place: &Workplace, a: &str, b: &str, moved: bool) -> u64 {
    let ran = place.run(&format!("compare {a} {b} --tolerance 0"));
    assert_eq!(ran.code, i32::from(moved), "{a} and {b}: {}", ran.stderr);
    let report = ran.document();
    assert_eq!(report["result"]["voxels"], 8000, "{a} and {b}");
    report["result"]["differing"].as_u64().expect("a count")
}

#[test]
fn every_way_between_formats_keeps_every_voxel() {
    let place = with_a_ring();
    let read = volume_formats(&place, true);
    assert!(read.len() >= 6, "{read:?}");
    for first in &read {
        let ran = place.run(&format!("convert ring.svo -o first.{first}"));
        assert_eq!(ran.code, 0, "{first}: {}", ran.stderr);
        for second in volume_formats(&place, false) {
            let line = format!("convert first.{first} -o second.{second}");
            let ran = place.run(&line);
            assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
            if read.contains(&second) {
                // What passes an npy file has lost its place.
                let moved = first == "npy" && second != "npy";
                let differing = differing(&place, &format!("second.{second}"), "ring.svo", moved);
                assert_eq!(differing, 0, "{line}");
            }
        }
    }
}

#[test]
fn a_sparse_grid_is_written_as_a_dense_one_is() {
    let place = with_a_ring();
    for format in volume_formats(&place, false) {
        for grid in ["dense", "sparse"] {
            let line = format!(
                "voxelize fixtures/shapes/torus.obj --resolution 70 --fill winding --grid {grid} \
                 --bounds -1.5,-1.5,-1.5,1.5,1.5,1.5 -o {grid}.{format}"
            );
            let ran = place.run(&line);
            assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
        }
        let read = |grid: &str| fs::read(place.path(&format!("{grid}.{format}"))).expect("a file");
        // The header names the data file beside it, which has the name of its own header.
        let (dense, sparse) = if format == "mhd" {
            let read = |grid: &str| fs::read(place.path(&format!("{grid}.raw"))).expect("a file");
            (read("dense"), read("sparse"))
        } else {
            (read("dense"), read("sparse"))
        };
        assert!(dense == sparse, "{format}");
    }
}

#[test]
fn one_voxel_that_differs_fails_the_check() {
    let place = with_a_ring();
    let ran = place.run("convert ring.svo -o flipped.npy");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let mut bytes = fs::read(place.path("flipped.npy")).expect("the file");
    *bytes.last_mut().expect("a byte") ^= 1;
    place.put("flipped.npy", bytes);
    let ran = place.run("compare ring.svo flipped.npy --tolerance 0");
    assert_eq!(ran.code, 1, "{}", ran.stderr);
    assert_eq!(ran.document()["result"]["differing"], 1);
    let why = "check failed: differing voxels is 1 voxel, larger than --tolerance 0\n";
    assert!(ran.stderr.ends_with(why), "{}", ran.stderr);
    let ran = place.run("compare ring.svo flipped.npy --tolerance 1");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
}

/// An octree of 65536 voxels an edge with the first one set, in 248 bytes.
fn huge_and_empty() -> Vec<u8> {
    let mut bytes = b"SCANTLE-SVO\n".to_vec();
    bytes.extend([1u32, 0, 16].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend([1u64 << 16; 3].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(
        [0.0f64, 0.0, 0.0, 1.0, 1.0, 1.0]
            .iter()
            .flat_map(|n| n.to_le_bytes()),
    );
    bytes.extend([1u64; 17].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend([1; 16]);
    bytes
}

#[test]
fn a_sparse_grid_too_large_to_expand_is_refused_where_the_format_is_dense() {
    let place = Workplace::new();
    place.put("huge.svo", huge_and_empty());
    let dense = ["nrrd", "mha", "mhd", "nii", "npy", "binvox", "vti"];
    for format in dense {
        let line = format!("convert huge.svo -o huge.{format} --max-memory 100MiB");
        let ran = place.run(&line);
        assert_eq!(ran.code, 5, "{line}: {}", ran.stderr);
        assert!(ran.stderr.contains("sparse"), "{}", ran.stderr);
    }
    assert_eq!(place.names(), ["huge.svo"]);
    let ran = place.run("convert huge.svo -o same.svo --max-memory 100MiB");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let ran = place.run("convert huge.svo -o huge.vdb --max-memory 100MiB");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let read = |name| fs::read(place.path(name)).expect("a file");
    assert!(read("same.svo") == read("huge.svo"));
}

#[test]
fn numbers_other_than_0_and_1_are_no_bits() {
    let place = Workplace::new();
    for format in ["svo", "vdb", "binvox"] {
        let ran = place.run(&format!(
            "convert fixtures/volumes/ball.nrrd -o ball.{format}"
        ));
        assert_eq!(ran.code, 2, "{}", ran.stderr);
        let why = "holds bits only, and the voxels are f32 with values other than 0 and 1\n";
        assert!(ran.stderr.ends_with(why), "{}", ran.stderr);
    }
    assert!(place.names().is_empty());
}

#[test]
fn files_of_nibabel_and_vtk_hold_what_those_find_in_them() {
    let folder = root().join("fixtures/volumes");
    let text = fs::read_to_string(folder.join("peers.json")).expect("the list");
    let files: BTreeMap<String, Vec<[f64; 4]>> = serde_json::from_str(&text).expect("a list");
    assert_eq!(files.len(), 9);
    for (name, voxels) in files {
        let path = folder.join(&name);
        let source = Source::open(path.to_str().expect("a name"), u64::MAX).expect("a file");
        let (volume, _, warnings) = read_volume(&source, None).expect(&name);
        // The files of VTK have an array of vectors too.
        let codes: Vec<_> = warnings.iter().map(|warning| &*warning.code).collect();
        assert_eq!(
            codes,
            ["vti-arrays"][usize::from(!name.ends_with("vti"))..],
            "{name}"
        );
        let frame = &volume.frame;
        assert_eq!(frame.dims, [5, 4, 3], "{name}");
        let values: Vec<f64> =
            with_samples!(&volume.data, v => v.iter().map(|s| *s as f64).collect(), _ => vec![]);
        assert_eq!(values.len(), voxels.len(), "{name}");
        for (index, [place @ .., value]) in voxels.iter().enumerate() {
            let steps = [index % 5, index / 5 % 4, index / 20].map(|i| i as f64);
            for axis in 0..3 {
                let moved: f64 = (0..3).map(|a| steps[a] * frame.axes[a][axis]).sum();
                let apart = (frame.origin[axis] + moved - place[axis]).abs();
                assert!(apart <= 1e-12, "{name}: voxel {index} is {apart} off");
            }
            let apart = (values[index] - value).abs();
            assert!(
                apart <= 1e-14,
                "{name}: voxel {index} is {} not {value}",
                values[index]
            );
        }
    }
}
