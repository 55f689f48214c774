//! Outputs are whole or not there, and inputs are never touched.

use crate::support::Workplace;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let place = Workplace::new();
    place.put("old.ply", "old");
    place.put("bad.obj", "v 0 0 0\nf 1 2 3\n");
    let ran = place.run("convert bad.obj -o old.ply");
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert_eq!(fs::read_to_string(place.path("old.ply")).unwrap(), "old");
    assert_eq!(place.names(), ["bad.obj", "old.ply"]);
}

#[test]
fn a_write_that_fails_half_way_leaves_the_old_file_and_nothing_else() {
    let place = Workplace::new();
    place.put("old.ply", "old");
    // No file may grow past one block of 1024 bytes: the disk is full half way.
    let line = "trap '' XFSZ; ulimit -f 1; scantle convert fixtures/shapes/torus.obj -o old.ply";
    let ran = place.shell(line);
    assert_eq!(ran.code, 4, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("scantle: old.ply: cannot write: "),
        "{}",
        ran.stderr
    );
    assert_eq!(fs::read_to_string(place.path("old.ply")).unwrap(), "old");
    assert_eq!(place.names(), ["old.ply"]);
}

#[test]
fn a_folder_in_the_way_is_not_replaced() {
    let place = Workplace::new();
    fs::create_dir(place.path("cube.ply")).unwrap();
    let line = "convert fixtures/shapes/cube.obj -o cube.ply --output-format ply";
    assert_eq!(place.run(line).code, 0);
    assert!(place.path("cube.ply/cube.ply").exists());
    fs::create_dir(place.path("report.json")).unwrap();
    let ran = place.run("info fixtures/shapes/cube.obj --report report.json");
    assert_eq!(ran.code, 4, "{}", ran.stderr);
    assert!(place.path("report.json").is_dir());
}

#[test]
fn a_replaced_file_keeps_its_permissions() {
    let place = Workplace::new();
    place.put("cube.ply", "old");
    let path = place.path("cube.ply");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    let ran = place.run("convert fixtures/shapes/cube.obj -o cube.ply");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let mode = fs::metadata(&path).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    assert_ne!(fs::read(&path).unwrap(), b"old");
}

#[test]
fn an_input_is_not_written_over_by_any_name() {
    let place = Workplace::new();
    let cube = fs::read(place.path("fixtures/shapes/cube.obj")).unwrap();
    place.put("cube.obj", &cube);
    symlink("cube.obj", place.path("other.obj")).unwrap();
    for line in [
        "convert cube.obj -o cube.obj",
        "convert cube.obj -o ./cube.obj",
        "convert cube.obj -o other.obj",
        "convert other.obj -o cube.obj",
        "convert cube.obj -o {stem}.obj",
        "convert cube.obj -o cube.ply --report cube.obj",
        "info cube.obj --report cube.obj",
    ] {
        let ran = place.run(line);
        assert_eq!(ran.code, 2, "{line}: {}", ran.stderr);
        assert!(ran.stderr.contains("inputs are never touched"), "{line}");
    }
    assert_eq!(fs::read(place.path("cube.obj")).unwrap(), cube);
    assert_eq!(place.names(), ["cube.obj", "other.obj"]);
}

#[test]
fn what_an_option_reads_is_not_written_over() {
    let place = Workplace::new();
    place.put("radii.txt", "C 1.7\n");
    symlink("radii.txt", place.path("radii.json")).unwrap();
    symlink("radii.txt", place.path("radii.pdb")).unwrap();
    let grey = fs::read(place.path("fixtures/shapes/grey.ply")).unwrap();
    place.put("grey.ply", &grey);
    place.put("1.ply", &grey);
    symlink("grey.ply", place.path("3.ply")).unwrap();
    let names = fs::read(place.path("fixtures/volumes/names.csv")).unwrap();
    place.put("names.csv", &names);
    let before = place.names();
    let tunnels = "fixtures/molecules/porthole.xyzr --start 0,0,0 --radii radii.txt";
    let ball = "fixtures/volumes/ball.nrrd --threshold-value 0 --reference";
    let labels = "fixtures/volumes/labels.nii --labels all --label-names names.csv";
    for (line, option) in [
        (format!("tunnels {tunnels} -o radii.pdb"), "radii"),
        (format!("tunnels {tunnels} --report radii.txt"), "radii"),
        (format!("tunnels {tunnels} --clusters radii.json"), "radii"),
        (
            format!("tradeoff tunnels {tunnels} --vary method --csv radii.txt"),
            "radii",
        ),
        (
            format!("smooth-mc {ball} grey.ply -o grey.ply"),
            "reference",
        ),
        (format!("smooth-mc {ball} grey.ply -o 3.ply"), "reference"),
        (
            format!("tradeoff smooth-mc {ball} grey.ply --vary energy --csv grey.ply"),
            "reference",
        ),
        (
            format!("smooth-mc {labels} -o names.csv --output-format ply"),
            "label-names",
        ),
        (
            format!("smooth-mc {labels} --report names.csv"),
            "label-names",
        ),
        // A file for each label, of which one would go over what is read.
        (
            format!("smooth-mc {labels} --reference 1.ply -o {{label}}.ply"),
            "reference",
        ),
        (
            format!("smooth-mc {labels} --reference grey.ply -o {{label}}.ply"),
            "reference",
        ),
    ] {
        let ran = place.run(&line);
        assert_eq!(ran.code, 2, "{line}: {}", ran.stderr);
        let why = format!("is what --{option} reads, and inputs are never touched");
        assert!(ran.stderr.contains(&why), "{line}: {}", ran.stderr);
        assert_eq!(ran.stdout, b"", "{line}");
    }
    assert_eq!(place.names(), before);
    assert_eq!(fs::read(place.path("grey.ply")).unwrap(), grey);
    assert_eq!(fs::read(place.path("names.csv")).unwrap(), names);
}

#[test]
fn the_data_beside_what_an_option_reads_is_not_written_over() {
    let place = Workplace::new();
    let gltf = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"true.ply"}]}"#;
    place.put("true.gltf", gltf);
    let corners = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let data = corners.map(f32::to_le_bytes).concat();
    place.put("true.ply", &data);
    let line = "smooth-mc fixtures/volumes/ball.nrrd --threshold-value 0 --reference true.gltf";
    let ran = place.run(&format!("{line} -o true.ply"));
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("holds the data of true.gltf"),
        "{}",
        ran.stderr
    );
    assert_eq!(fs::read(place.path("true.ply")).unwrap(), data);
}

#[test]
fn standard_input_is_not_read_twice() {
    let place = Workplace::new();
    let porthole = fs::read(place.path("fixtures/molecules/porthole.xyzr")).unwrap();
    let line = "tunnels - --input-format xyzr --start 0,0,0 --radii -";
    let ran = place.run_with_input(line, porthole);
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    let why = "scantle: --radii -: standard input can be read only once\n";
    assert_eq!(ran.stderr, why);
    // For several inputs, what an option reads is read once.
    let grey = fs::read(place.path("fixtures/shapes/grey.ply")).unwrap();
    let ball = "fixtures/volumes/ball.nrrd";
    let line = format!("smooth-mc {ball} {ball} --threshold-value 0 --reference - -q");
    let ran = place.run_with_input(&line, grey);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(ran.documents().len(), 2);
}

#[test]
fn two_results_do_not_go_to_one_file_that_is_not_there_yet() {
    let place = Workplace::new();
    fs::create_dir(place.path("b")).unwrap();
    symlink("b", place.path("link")).unwrap();
    let cube = "fixtures/shapes/cube.obj";
    let tunnels = "tunnels fixtures/molecules/porthole.xyzr --start 0,0,0";
    let labels = "smooth-mc fixtures/volumes/labels.nii --labels all";
    for line in [
        format!("convert {cube} -o ./b/n.ply --report b/n.ply"),
        format!("convert {cube} -o link/n.ply --report b/n.ply"),
        format!("convert {cube} -o new/ --output-format ply --report ./new/cube.ply"),
        format!("voxelize {cube} -o b/y.png --output-format ply --preview b/../b/y.png"),
        format!("voxelize {cube} -o b/z.mhd --report b/z.raw"),
        format!("voxelize {cube} -o b/z.mhd --report link/../b/./z.raw"),
        format!("tradeoff voxelize {cube} --vary resolution=4 --csv b/t --report ./b/t"),
        format!("{tunnels} --clusters b/t.pdb -o link/t.pdb"),
        format!("{tunnels} --clusters b/t.csv --profile b/t.csv"),
        format!("{tunnels} --clusters b/t.svg --plot ./b/t.svg"),
        format!("{tunnels} --clusters b/t.pml --script b/t.pml"),
        format!("{tunnels} --clusters b/t.png --preview b/t.png"),
        format!("{tunnels} --clusters b/t.json --report b/t.json"),
        format!("{tunnels} --clusters -"),
        format!("{labels} -o b/{{label}}.ply --report b/3.ply"),
    ] {
        let ran = place.run(&line);
        assert_eq!(ran.code, 2, "{line}: {}", ran.stderr);
        assert!(
            ran.stderr.contains("goes already"),
            "{line}: {}",
            ran.stderr
        );
        assert_eq!(ran.stdout, b"", "{line}");
    }
    assert_eq!(fs::read_dir(place.path("b")).unwrap().count(), 0);
    assert_eq!(place.names(), ["b", "link"]);
}

#[test]
fn a_pipe_takes_two_results() {
    let place = Workplace::new();
    let line = "mkfifo p; exec 3<>p; \
        scantle convert fixtures/shapes/cube.obj -o p --output-format ply --report p; \
        head -c 4 <&3";
    let ran = place.shell(line);
    assert_eq!(
        (ran.code, ran.stdout.as_slice()),
        (0, b"ply\n".as_slice()),
        "{}",
        ran.stderr
    );
}

#[test]
fn data_beside_an_input_is_not_written_over() {
    let place = Workplace::new();
    let made = place.run("voxelize fixtures/shapes/cube.obj --resolution 5 -o b.mhd");
    assert_eq!(made.code, 0, "{}", made.stderr);
    fs::rename(place.path("b.mhd"), place.path("in.mhd")).unwrap();
    place.put(
        "in.nrrd",
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 7 7 7\nencoding: raw\ndata file: b.raw\n",
    );
    let gltf = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"./b%2Eraw"}]}"#;
    place.put("in.gltf", gltf);
    let data = fs::read(place.path("b.raw")).unwrap();
    for line in [
        "convert in.mhd -o b.mhd",
        "convert in.mhd -o {stem}/../b.raw --output-format nrrd",
        "convert in.nrrd -o ./b.mhd",
        "info in.nrrd --report b.raw",
        "info fixtures/shapes/cube.obj in.mhd --report b.raw",
        "info in.gltf --report b.raw",
        "voxelize in.gltf --resolution 4 -o b.mhd",
        "tradeoff voxelize in.gltf --vary resolution=4 --csv b.raw",
    ] {
        fs::create_dir_all(place.path("in")).unwrap();
        let ran = place.run(line);
        assert_eq!(ran.code, 2, "{line}: {}", ran.stderr);
        let why = "which holds the data of in.";
        let why = if line.contains("b.mhd") {
            why
        } else {
            &why[6..]
        };
        assert!(ran.stderr.contains(why), "{line}: {}", ran.stderr);
        assert!(ran.stderr.contains("inputs are never touched"), "{line}");
    }
    assert_eq!(fs::read(place.path("b.raw")).unwrap(), data);
    // A name of the same kind elsewhere is free.
    let ran = place.run("convert in.mhd -o in/b.mhd");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(fs::read(place.path("in/b.raw")).unwrap(), data);
}

#[test]
fn a_pipe_is_written_to_and_stays_a_pipe() {
    let place = Workplace::new();
    let line = "mkfifo cube.ply; cat cube.ply > copy.ply & \
        scantle convert fixtures/shapes/cube.obj -o cube.ply; wait; test -p cube.ply; \
        scantle convert fixtures/shapes/cube.obj -o plain.ply; cmp copy.ply plain.ply; \
        scantle convert fixtures/shapes/cube.obj -o >(cat > other.ply) --output-format ply; \
        wait $!; cmp other.ply plain.ply";
    let ran = place.shell(line);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(
        place.names(),
        ["copy.ply", "cube.ply", "other.ply", "plain.ply"]
    );
}

#[test]
fn a_link_is_followed_and_stays_a_link() {
    let place = Workplace::new();
    fs::create_dir(place.path("far")).unwrap();
    place.put("far/cube.ply", "old");
    symlink("far/cube.ply", place.path("cube.ply")).unwrap();
    let ran = place.run("convert fixtures/shapes/cube.obj -o cube.ply");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(place.path("cube.ply").is_symlink());
    assert!(
        fs::read(place.path("far/cube.ply"))
            .unwrap()
            .starts_with(b"ply")
    );
    assert_eq!(place.names(), ["cube.ply", "far"]);
}
