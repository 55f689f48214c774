//! What every command promises: exit codes, streams, options.

use crate::support::{Workplace, packed, ran, root};
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::fs::PermissionsExt;
use std::process::Stdio;

const CUBE: &str = "fixtures/shapes/cube.obj";

#[test]
fn exit_0_done() {
    let ran = Workplace::new().run("info fixtures/shapes/cube.obj");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
}

#[test]
fn exit_1_a_check_failed() {
    let place = Workplace::new();
    let line = "compare fixtures/shapes/cube.obj fixtures/shapes/torus.obj --tolerance 0.01";
    let ran = place.run(line);
    assert_eq!(ran.code, 1, "{}", ran.stderr);
    assert!(ran.stderr.contains("check failed: "), "{}", ran.stderr);
    ran.document();
    let line = "compare fixtures/shapes/cube.obj fixtures/shapes/cube.ply --tolerance 0";
    assert_eq!(place.run(line).code, 0);
}

#[test]
fn exit_2_usage() {
    for line in [
        "",
        "inform fixtures/shapes/cube.obj",
        "inf fixtures/shapes/cube.obj",
        "info",
        "info fixtures/shapes/cube.obj --nonsense",
        "info fixtures/shapes/cube.obj --thread 1",
        "info fixtures/shapes/cube.obj --threads -1",
        "info fixtures/shapes/cube.obj --threads 1025",
        "info fixtures/shapes/cube.obj --max-memory 2G",
        "info fixtures/shapes/cube.obj --quiet --verbose",
        "info - -",
        "convert fixtures/shapes/cube.obj",
        "convert fixtures/shapes/cube.obj -o cube.nonsense",
        "convert fixtures/shapes/cube.obj -o cube",
        "convert fixtures/shapes/cube.obj -o cube.nrrd",
        "convert fixtures/shapes/cube.obj -o out/",
        "convert fixtures/shapes/cube.obj -o fixtures/shapes/cube.obj",
        "convert fixtures/shapes/cube.obj -o cube.ply --report cube.ply",
        "convert fixtures/shapes/cube.obj -o - --output-format ply --report -",
        "convert fixtures/shapes/cube.obj fixtures/shapes/torus.obj -o both.ply",
        "schema nonsense",
    ] {
        let place = Workplace::new();
        let ran = place.run(line);
        assert_eq!(ran.code, 2, "{line}: {}", ran.stderr);
        assert!(ran.stdout.is_empty(), "{line}");
        assert!(!ran.stderr.is_empty(), "{line}");
        assert!(place.names().is_empty(), "{line}");
    }
}

#[test]
fn exit_3_bad_input() {
    let place = Workplace::new();
    let ran = place.run("info missing.obj");
    assert_eq!(ran.code, 3);
    assert!(
        ran.stderr
            .starts_with("scantle: missing.obj: cannot read: "),
        "{}",
        ran.stderr
    );
    assert_eq!(place.run("info fixtures").code, 3);
    place.put("empty.obj", "");
    let ran = place.run("info empty.obj");
    assert_eq!(ran.code, 3);
    assert_eq!(ran.stderr, "scantle: empty.obj: the file is empty\n");
}

#[test]
fn exit_4_not_written() {
    let place = Workplace::new();
    let ran = place.run("convert fixtures/shapes/cube.obj -o missing/cube.ply");
    assert_eq!(ran.code, 4);
    assert!(
        ran.stderr
            .starts_with("scantle: missing/cube.ply: cannot write: "),
        "{}",
        ran.stderr
    );
    let line = "info fixtures/shapes/cube.obj --report missing/report.json";
    assert_eq!(place.run(line).code, 4);
}

#[test]
fn exit_4_in_a_folder_that_cannot_be_written() {
    let place = Workplace::new();
    let locked = place.path("locked");
    fs::create_dir(&locked).expect("a folder");
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).expect("permissions");
    // The superuser may write everywhere; then there is nothing to see.
    let refused = File::create(locked.join("probe")).is_err();
    let ran = place.run("convert fixtures/shapes/cube.obj -o locked/cube.ply");
    assert_eq!(ran.code, if refused { 4 } else { 0 }, "{}", ran.stderr);
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).expect("permissions");
}

/// A document that places one mesh of a point many times.
fn instances(nodes: usize) -> String {
    let nodes = vec!["{\"mesh\":0}"; nodes].join(",");
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{nodes}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"mode\":0}}]}}],\
         \"accessors\":[{{\"componentType\":5126,\"type\":\"VEC3\",\"count\":1,\"bufferView\":0}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":12}}],\
         \"buffers\":[{{\"byteLength\":12,\"uri\":\"data:application/octet-stream;base64,\
         AAAAAAAAAAAAAAAA\"}}]}}"
    )
}

#[test]
fn every_reader_that_makes_more_than_it_may_ends_with_5() {
    let place = Workplace::new();
    place.put("a.json", format!("[{}0]", "0,".repeat(100_000)));
    place.put("instances.gltf", instances(20_000));
    place.put("zeros.raw", vec![0; 2 << 20]);
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 128 128 128\nencoding: raw\n";
    place.put("beside.nhdr", format!("{header}data file: zeros.raw\n"));
    let mut plain = format!("{header}\n").into_bytes();
    plain.resize(plain.len() + (2 << 20), 0);
    place.put("plain.nrrd", plain);
    place.put("packed.ply.gz", packed(&vec![b' '; 2 << 20]));
    for name in ["b.nrrd", "b.mha", "b.nii", "b.vti", "b.npy", "b.binvox"] {
        let line = format!("voxelize {CUBE} --resolution 254 --pad 1 -o {name} --report r.json -q");
        assert_eq!(place.run(&line).code, 0);
    }
    for name in [
        "a.json",
        "instances.gltf",
        "beside.nhdr",
        "plain.nrrd",
        "packed.ply.gz",
        "b.nrrd",
        "b.mha",
        "b.nii",
        "b.vti",
        "b.npy",
        "b.binvox",
        "fixtures/pictures/torus-knot.png",
    ] {
        let line = format!("info {name} --max-memory 1MiB");
        let ran = place.run(&line);
        assert_eq!(ran.code, 5, "{line}: {}", ran.stderr);
        assert!(ran.stdout.is_empty(), "{line}");
        let [problem, hint] = ran.stderr.lines().collect::<Vec<_>>()[..] else {
            panic!("{line}: two lines, not {}", ran.stderr);
        };
        assert!(
            problem.starts_with(&format!("scantle: {name}: ")),
            "{problem}"
        );
        let end = " bytes, over the limit of 1048576 bytes";
        assert!(problem.ends_with(end), "{problem}");
        assert!(hint.starts_with("  raise --max-memory, or "), "{hint}");
        if name != "packed.ply.gz" {
            let ran = place.run(&format!("info {name} --max-memory 1GiB"));
            assert_eq!(ran.code, 0, "{name}: {}", ran.stderr);
        }
    }
}

#[test]
fn exit_5_over_a_limit() {
    let place = Workplace::new();
    let cube = fs::read(place.path(CUBE)).expect("the cube");
    let line = "info - --input-format obj --max-memory 100B";
    let ran = place.run_with_input(line, cube);
    assert_eq!(ran.code, 5, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("over the limit of 100 bytes"),
        "{}",
        ran.stderr
    );
    assert!(
        ran.stderr.contains("\n  raise --max-memory"),
        "{}",
        ran.stderr
    );
}

#[test]
fn every_input_is_tried_and_the_largest_code_wins() {
    let place = Workplace::new();
    let line = "info missing.obj fixtures/shapes/cube.obj fixtures/shapes/torus.obj";
    let ran = place.run(line);
    assert_eq!(ran.code, 3);
    let read: Vec<_> = ran
        .documents()
        .iter()
        .map(|report| report["input"][0]["path"].clone())
        .collect();
    assert_eq!(read, [CUBE, "fixtures/shapes/torus.obj"]);
    let line = "convert missing.obj fixtures/shapes/cube.obj -o missing/{stem}.ply";
    assert_eq!(place.run(line).code, 4);
}

#[test]
fn standard_output_is_one_document_that_ends_its_line() {
    let ran = Workplace::new().run("info fixtures/shapes/cube.obj");
    let text = ran.text();
    assert!(text.starts_with("{\n") && text.ends_with("}\n"), "{text}");
    let report = ran.document();
    assert_eq!(report["schema"], 1);
    assert_eq!(report["command"], "info");
    assert!(report.get("run").is_none());
}

#[test]
fn several_inputs_make_a_line_each() {
    let line = "info fixtures/shapes/cube.obj fixtures/shapes/torus.obj";
    let place = Workplace::new();
    let text = place.run(line).text();
    assert_eq!(text.lines().count(), 2);
    for line in text.lines() {
        serde_json::from_str::<serde_json::Value>(line).expect("a document on each line");
    }
    let silent = place.run(&format!("{line} --report both.jsonl"));
    assert!(silent.stdout.is_empty());
    let kept = fs::read_to_string(place.path("both.jsonl")).expect("the report");
    assert_eq!(kept, text);
}

#[test]
fn data_on_standard_output_leaves_no_room_for_the_report() {
    let place = Workplace::new();
    assert_eq!(
        place
            .run("convert fixtures/shapes/cube.obj -o cube.ply")
            .code,
        0
    );
    let line = "convert fixtures/shapes/cube.obj -o - --output-format ply --report r.json";
    let ran = place.run(line);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(
        ran.stdout,
        fs::read(place.path("cube.ply")).expect("the file")
    );
    let report = fs::read_to_string(place.path("r.json")).expect("the report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["output"][0]["path"], "-");
    let alone = place.run("convert fixtures/shapes/cube.obj -o - --output-format ply");
    assert_eq!(alone.stdout, ran.stdout);
}

#[test]
fn standard_input_is_read_like_a_file() {
    let place = Workplace::new();
    let cube = fs::read(place.path(CUBE)).expect("the cube");
    let piped = place
        .run_with_input("info - --input-format obj", cube)
        .document();
    let read = place.run("info fixtures/shapes/cube.obj").document();
    assert_eq!(piped["input"][0]["path"], "-");
    assert_eq!(piped["input"][0]["sha256"], read["input"][0]["sha256"]);
    assert_eq!(piped["result"], read["result"]);
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let place = Workplace::new();
    for line in [
        "info fixtures/shapes/cube.obj",
        "info fixtures/shapes/cube.obj fixtures/shapes/torus.obj",
        "convert fixtures/shapes/torus.obj -o - --output-format ply",
        "completions bash",
        "schema info",
        "formats",
        "--help",
        "info --help",
        "--version",
    ] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let mut command = place.command(line.split_whitespace());
        command.stdout(writer).stderr(Stdio::piped());
        let ran = ran(command.output());
        assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
        assert!(!ran.stderr.contains("panicked"), "{line}: {}", ran.stderr);
    }
}

#[test]
fn nobody_at_standard_error_is_no_error() {
    let place = Workplace::new();
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut command = place.command(["info", CUBE, "--verbose"]);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(writer)
        .spawn()
        .expect("the binary starts");
    let mut text = String::new();
    let mut stdout = child.stdout.take().expect("its standard output");
    stdout.read_to_string(&mut text).expect("text");
    assert!(child.wait().expect("it ends").success());
    assert!(text.ends_with("}\n"));
}

#[test]
fn people_are_told_as_much_as_they_ask_for() {
    let place = Workplace::new();
    let normal = place.run("info fixtures/shapes/cube.obj");
    assert_eq!(normal.stderr.lines().count(), 1, "{}", normal.stderr);
    assert!(
        normal
            .stderr
            .starts_with("scantle: fixtures/shapes/cube.obj: 8 vertices, ")
    );
    let quiet = place.run("info fixtures/shapes/cube.obj --quiet");
    assert_eq!(quiet.stderr, "");
    let verbose = place.run("info fixtures/shapes/cube.obj --verbose");
    assert!(verbose.stderr.contains("read took "), "{}", verbose.stderr);
    assert_eq!(normal.stdout, quiet.stdout);
    assert_eq!(normal.stdout, verbose.stdout);
}

#[test]
fn timings_are_there_when_asked_for_and_add_up() {
    let place = Workplace::new();
    let line = "convert fixtures/shapes/torus.obj -o torus.ply --timings --threads 2";
    let report = place.run(line).document();
    let run = &report["run"];
    assert_eq!(run["threads"], 2);
    assert!(run["peak_bytes"].is_null() || run["peak_bytes"].as_u64() > Some(1 << 16));
    let stages = run["stages"].as_array().expect("stages");
    let names: Vec<_> = stages.iter().map(|stage| &stage["name"]).collect();
    assert_eq!(names, ["read", "write"]);
    let sum: f64 = stages.iter().filter_map(|s| s["wall_s"].as_f64()).sum();
    let wall = run["wall_s"].as_f64().expect("seconds");
    assert!(wall > 0.0 && (sum - wall).abs() < 1e-9, "{sum} of {wall}");
}

#[test]
fn several_outputs_go_to_a_folder_or_a_pattern() {
    let place = Workplace::new();
    let both = "fixtures/shapes/cube.obj fixtures/shapes/torus.obj";
    let ran = place.run(&format!("convert {both} -o made/ --output-format stl"));
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let ran = place.run(&format!("convert {both} -o {{stem}}-copy.ply"));
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(place.names(), ["cube-copy.ply", "made", "torus-copy.ply"]);
    assert!(place.path("made/cube.stl").exists() && place.path("made/torus.stl").exists());
}

#[test]
fn the_batch_system_limits_the_threads() {
    let place = Workplace::new();
    let mut command = place.command(["info", CUBE, "--timings"]);
    let granted = ran(command.env("SLURM_CPUS_PER_TASK", "1").output()).document();
    assert_eq!(granted["run"]["threads"], 1);
    let mut command = place.command(["info", CUBE, "--timings", "--threads", "3"]);
    let asked = ran(command.env("SLURM_CPUS_PER_TASK", "1").output()).document();
    assert_eq!(asked["run"]["threads"], 3);
}

#[test]
fn schemas_are_schemas() {
    let place = Workplace::new();
    // Each command has a page; these print no report.
    let without = ["completions", "schema"];
    let pages = fs::read_dir(root().join("man")).expect("the pages");
    let pages = pages.filter_map(|page| page.expect("an entry").file_name().into_string().ok());
    let mut commands: Vec<String> = pages
        .filter_map(|page| {
            Some(
                page.strip_prefix("scantle-")?
                    .strip_suffix(".1")?
                    .to_owned(),
            )
        })
        .filter(|command| !without.contains(&command.as_str()))
        .collect();
    // The schema of a command holds what each of its verbs reports.
    let all = commands.clone();
    let is_verb = |page: &String| all.iter().any(|c| page.starts_with(&format!("{c}-")));
    commands.retain(|page| !is_verb(page));
    assert!(commands.len() >= 8, "{commands:?}");
    commands.push(String::new());
    for command in commands {
        let ran = place.run(&format!("schema {command}"));
        assert_eq!(ran.code, 0, "{command} has no schema: {}", ran.stderr);
        jsonschema::validator_for(&ran.document()).expect("a schema");
    }
    let formats = place.run("formats --json").document();
    let schema = place.run("schema formats").document();
    assert!(jsonschema::is_valid(&schema, &formats));
    let report = place.run("info fixtures/shapes/cube.obj").document();
    let envelope = place.run("schema").document();
    assert!(jsonschema::is_valid(&envelope, &report));
}

#[test]
fn a_preview_is_named_as_what_it_is() {
    let place = Workplace::new();
    let ran = place.run("voxelize fixtures/shapes/cube.obj --resolution 4 --preview a.jpg");
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    let wanted =
        "scantle: --preview a.jpg: a preview is a PNG picture, and its name must end in .png\n";
    assert_eq!(ran.stderr, wanted);
    assert!(place.names().is_empty());
}

#[test]
fn a_picture_that_cannot_be_written_costs_no_report() {
    let place = Workplace::new();
    // No file may grow past two blocks of 1024 bytes: the volume fits, the picture does not.
    let line = "trap '' XFSZ; ulimit -f 2; \
        scantle voxelize fixtures/shapes/cube.obj --resolution 4 -o y.nrrd --preview y.png";
    let ran = place.shell(line);
    assert_eq!(ran.code, 4, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("scantle: y.png: cannot write: "),
        "{}",
        ran.stderr
    );
    let report = ran.document();
    assert_eq!(report["output"].as_array().map(Vec::len), Some(1));
    assert_eq!(report["output"][0]["path"], "y.nrrd");
    assert_eq!(place.names(), ["y.nrrd"]);
}

#[test]
fn messages_blame_what_was_said_and_are_short() {
    let place = Workplace::new();
    place.put("empty", "");
    place.put("cube.stl", fs::read(place.path(CUBE)).expect("the cube"));
    for (line, code, said) in [
        (
            "convert fixtures/images/pattern.png -o x.ply",
            2,
            "--output x.ply: ply holds a mesh, but an image is made here",
        ),
        (
            "convert fixtures/images/pattern.png -o x --output-format ply",
            2,
            "--output-format ply: holds a mesh, but an image is made here",
        ),
        (
            "voxelize fixtures/shapes/torus.obj --resolution 4 -o x.binvox",
            2,
            "--output x.binvox: binvox holds cubes only, and the grid is 6 x 6 x 3; \
             make one of 6 x 6 x 6, or choose another format",
        ),
        ("info empty", 3, "empty: the file is empty"),
        ("info cube.stl", 3, "cube.stl: is text that begins with \""),
        (
            "voxelize fixtures/shapes/cube.obj --voxel-size 1e-300",
            5,
            "a grid with voxels of 1e-300 needs 9.999999999999999e299 voxels along x, over the limit of 65536 voxels",
        ),
    ] {
        let ran = place.run(line);
        assert_eq!(ran.code, code, "{line}: {}", ran.stderr);
        assert!(ran.stderr.contains(said), "{line}: {}", ran.stderr);
    }
    let piped = place.run_with_input("info -", Vec::new());
    assert_eq!(
        (piped.code, piped.stderr.as_str()),
        (3, "scantle: -: the file is empty\n")
    );
}

#[test]
fn grids_at_two_places_are_not_the_same_within_any_tolerance() {
    let place = Workplace::new();
    let text = |origin: &str, step: &str| {
        format!(
            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: ascii\n\
             space dimension: 3\nspace directions: ({step},0,0) (0,1,0) (0,0,1)\n\
             space origin: ({origin},0,0)\n\n1 0 1 0 1 0 1 0\n"
        )
    };
    place.put("a.nrrd", text("0", "1"));
    place.put("moved.nrrd", text("0.25", "1"));
    place.put("wider.nrrd", text("0", "1.5"));
    place.put("same.nrrd", text("1e-9", "1"));
    for (other, code) in [("moved", 1), ("wider", 1), ("same", 0)] {
        let ran = place.run(&format!("compare a.nrrd {other}.nrrd --tolerance 100"));
        assert_eq!(ran.code, code, "{other}: {}", ran.stderr);
        let why = "check failed: the grids are not at the same place: ";
        assert_eq!(ran.stderr.contains(why), code == 1, "{}", ran.stderr);
        assert_eq!(place.run(&format!("compare a.nrrd {other}.nrrd")).code, 0);
    }
}

#[test]
fn a_table_that_cannot_be_written_costs_no_measurement() {
    let place = Workplace::new();
    // Reports and pictures of runs inside go elsewhere; no file may grow past a block here.
    let line = "trap '' XFSZ; ulimit -f 1; scantle tradeoff voxelize fixtures/shapes/cube.obj \
        --vary resolution=4,5 --repeat 1 --in-process --plot t.svg";
    let ran = place.shell(line);
    assert_eq!(ran.code, 4, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("scantle: t.svg: cannot write: "),
        "{}",
        ran.stderr
    );
    let report = ran.document();
    assert_eq!(
        report["result"]["rows"].as_array().map_or(0, Vec::len),
        2,
        "{report}"
    );
    assert_eq!(report["output"].as_array().map(Vec::len), Some(0));
    fs::create_dir(place.path("t.csv")).expect("a folder");
    let line = "tradeoff voxelize fixtures/shapes/cube.obj --vary resolution=4 --csv t.csv";
    let ran = place.run(line);
    assert_eq!((ran.code, ran.stdout.len()), (4, 0), "{}", ran.stderr);
}
