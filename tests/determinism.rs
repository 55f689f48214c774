//! The same bytes on any number of threads, from a file and from a pipe.

use crate::support::{Workplace, packed};
use serde_json::Value;
use std::fs;

/// An input, its format, and a command line for it that puts its result on standard output. `IN`
/// stands for the input.
const CASES: &[(&str, &str, &str)] = &[
    (
        "fixtures/shapes/torus.obj",
        "obj",
        "convert IN -o - --output-format ply",
    ),
    (
        "fixtures/shapes/torus.obj",
        "obj",
        "convert IN -o - --output-format stl",
    ),
    (
        "fixtures/shapes/torus.obj",
        "obj",
        "convert IN -o - --output-format glb",
    ),
    (
        "fixtures/shapes/torus.obj",
        "obj",
        "shadow IN --size 50x40 --resolution 32 --seed 7 -o - --output-format png",
    ),
    (
        "fixtures/shapes/torus.obj",
        "obj",
        "shadow IN --resolution 32 --bake vertices -o - --output-format ply",
    ),
    (
        "fixtures/volumes/labels.nii",
        "nii",
        "smooth-mc IN --labels all -o - --output-format ply",
    ),
    (
        "fixtures/volumes/labels.nii",
        "nii",
        "smooth-mc IN --label 3 --energy laplacian -o - --output-format ply",
    ),
    (
        "fixtures/shapes/staircase.ply",
        "ply",
        "smooth-mc IN -o - --output-format obj",
    ),
    (
        "fixtures/volumes/ball.nrrd",
        "nrrd",
        "isosurface IN --iso 0.1 -o - --output-format ply",
    ),
    (
        "fixtures/animations/wave.pc2",
        "pc2",
        "compress-anim encode IN --base fixtures/animations/wave.obj -o - --output-format sanim",
    ),
    (
        "fixtures/animations/wave.mdd",
        "mdd",
        "compress-anim encode IN --method delta --target-max 0.001 -o - --output-format sanim",
    ),
    (
        "fixtures/animations/bar-skin.glb",
        "glb",
        "compress-anim encode IN --window 10 --target-bpvf 4 -o - --output-format sanim",
    ),
    (
        "fixtures/animations/bar.sanim",
        "sanim",
        "compress-anim decode IN -o - --output-format glb",
    ),
];

/// Command lines whose report is compared.
const REPORTS: &[&str] = &[
    "info fixtures/shapes/torus.obj",
    "compare fixtures/shapes/cube.obj fixtures/shapes/torus.obj",
    "shadow fixtures/shapes/torus.obj --size 50x40 --resolution 32 --verify",
    "smooth-mc fixtures/volumes/labels.nii --labels all --verify",
    "smooth-mc fixtures/volumes/labels.nii --label 1 --verify --compare mc,cesn,taubin",
    "shadow fixtures/shapes/torus.obj --size 50x40 --method exact --verify",
    "compress-anim encode fixtures/animations/bar-skin.glb --ladder",
    "compress-anim eval fixtures/animations/wave-morph.glb fixtures/animations/wave.sanim",
];

#[test]
fn results_depend_on_no_thread_and_no_pipe() {
    let place = Workplace::new();
    for (input, format, line) in CASES {
        let run = |threads: u32| {
            let line = line.replace("IN", input);
            let ran = place.run(&format!("{line} --threads {threads}"));
            assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
            ran.stdout
        };
        let want = run(1);
        assert!(!want.is_empty(), "{line}");
        assert!(want == run(2), "{line} differs on 2 threads");
        assert!(want == run(8), "{line} differs on 8 threads");
        let bytes = fs::read(place.path(input)).expect("the input");
        let piped = format!("{} --input-format {format}", line.replace("IN", "-"));
        let piped = place.run_with_input(&piped, bytes).stdout;
        assert!(want == piped, "{line} differs through a pipe");
    }
}

/// Words after `scantle voxelize INPUT`; the name of the output says its format.
const VOXELIZATIONS: &[&str] = &[
    "-o v.nrrd --grid dense --fill winding",
    "-o v.nrrd --grid sparse --fill winding",
    "-o v.svo --grid dense --fill parity",
    "-o v.svo --grid sparse --fill parity --levels xy",
    "-o v.vdb --grid sparse --mode three-axis --fill winding",
    "-o v.binvox --grid dense --mode z --bounds -3.5,-3.5,-3.5,3.5,3.5,3.5",
    "-o v.npy.gz --mode none --fill winding",
    "-o v.ply --preview v.png --verify",
];

/// The report without what names the input.
fn without_input(place: &Workplace) -> Value {
    let text = fs::read_to_string(place.path("r.json")).expect("the report");
    let mut report: Value = serde_json::from_str(&text).expect("JSON");
    for key in ["path", "bytes", "sha256"] {
        report["input"][0][key].take();
    }
    report
}

#[test]
fn voxels_depend_on_no_thread_no_pipe_and_no_packing() {
    const INPUT: &str = "fixtures/shapes/torus-knot.ply";
    let place = Workplace::new();
    let knot = fs::read(place.path(INPUT)).expect("the input");
    place.put("knot.ply.gz", packed(&knot));
    for words in VOXELIZATIONS {
        let written = words
            .split_whitespace()
            .filter(|word| word.starts_with("v."));
        let run = |input: &str, threads: u32| {
            let line = format!(
                "voxelize {input} --input-format ply --resolution 32 {words} --report r.json --threads {threads}"
            );
            let stdin = if input == "-" {
                knot.clone()
            } else {
                Vec::new()
            };
            let ran = place.run_with_input(&line, stdin);
            assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
            let read = |name| fs::read(place.path(name)).expect("a result");
            let files: Vec<Vec<u8>> = written.clone().map(read).collect();
            (files, without_input(&place))
        };
        let want = run(INPUT, 1);
        // The picture has the input's name in it, so those below are of a file of another name.
        let drawn = words.contains("--preview");
        assert!(want.0.iter().all(|file| !file.is_empty()), "{words}");
        assert!(want == run(INPUT, 2), "{words} differs on 2 threads");
        assert!(want == run(INPUT, 8), "{words} differs on 8 threads");
        if !drawn {
            assert!(want == run("-", 2), "{words} differs through a pipe");
            assert!(want == run("knot.ply.gz", 2), "{words} differs packed");
        }
    }
}

#[test]
fn reports_depend_on_no_thread() {
    let place = Workplace::new();
    for line in REPORTS {
        let run = |threads| place.run(&format!("{line} --threads {threads}"));
        let want = run(1);
        assert_eq!(want.code, 0, "{line}: {}", want.stderr);
        assert_eq!(want.text(), run(2).text(), "{line}");
        assert_eq!(want.text(), run(8).text(), "{line}");
    }
}
