//! `tradeoff` and `stability` on the fixtures: the shape of the figures, never the seconds.

use crate::support::Workplace;
use serde_json::Value;
use std::fs;

const KNOT: &str = "fixtures/shapes/torus-knot.ply";

fn rows(report: &Value) -> &Vec<Value> {
    report["result"]["rows"].as_array().expect("rows")
}

/// The measure that voxelize's trade names, of a report.
fn two_sided(report: &Value) -> f64 {
    let all = report["accuracy"].as_array().expect("measures");
    let last = all.last().expect("a measure");
    assert_eq!(last["unit"], "file unit");
    last["reached"]
        .as_f64()
        .expect("an error that was measured")
}

#[test]
fn errors_fall_with_resolution_and_the_front_trades_cost_for_error() {
    let place = Workplace::new();
    let line = format!(
        "tradeoff voxelize {KNOT} --vary resolution=32,8,16 --vary mode=conservative,three-axis --repeat 2"
    );
    let ran = place.run(&line);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.stderr.starts_with("resolution  mode"), "{}", ran.stderr);
    let report = ran.document();
    assert_eq!(rows(&report).len(), 6);
    for mode in ["three-axis", "conservative"] {
        let of_mode = rows(&report)
            .iter()
            .filter(|r| r["setting"]["mode"] == mode);
        let errors: Vec<f64> = of_mode
            .map(|r| r["error"].as_f64().expect("an error"))
            .collect();
        assert!(errors.is_sorted_by(|a, b| a > b), "{mode}: {errors:?}");
    }
    for row in rows(&report) {
        let (error, bound) = (row["error"].as_f64(), row["bound"].as_f64());
        assert!(bound.is_none_or(|bound| error.is_some_and(|error| error <= bound)));
        assert_eq!((&row["runs"], &row["status"]), (&2.into(), &"done".into()));
        assert!(row["peak_bytes"].as_u64() > Some(0));
        assert!(row["modelled"]["share"].as_f64() > Some(0.0));
        let wall = &row["wall_s"];
        assert!(wall["min"].as_f64() <= wall["median"].as_f64());
        assert!(wall["median"].as_f64() <= wall["max"].as_f64());
    }
    let front = report["result"]["front"].as_array().expect("a front");
    assert!(!front.is_empty());
    let on_front: Vec<&Value> = front
        .iter()
        .map(|i| &rows(&report)[i.as_u64().expect("an index") as usize])
        .collect();
    assert!(on_front.iter().all(|row| row["on_front"] == true));
    assert!(on_front.is_sorted_by(|a, b| a["error"].as_f64() > b["error"].as_f64()));
    assert!(
        on_front.is_sorted_by(|a, b| {
            a["wall_s"]["median"].as_f64() < b["wall_s"]["median"].as_f64()
        })
    );
}

#[test]
fn the_setting_named_for_a_max_error_holds_when_its_line_is_pasted() {
    let place = Workplace::new();
    let knot = fs::read(place.path(KNOT)).expect("the knot");
    place.put("it's a knot.ply", knot);
    for most in [0.7, 0.3, 0.15] {
        let words = [
            "tradeoff",
            "voxelize",
            "it's a knot.ply",
            "--vary",
            "resolution=8,16,32",
        ];
        let limit = most.to_string();
        let more = ["--vary", "mode", "--repeat", "1", "--max-error", &limit];
        let output = place.command(words.iter().chain(&more)).output();
        let ran = crate::support::ran(output);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let report = ran.document();
        let command = report["result"]["choice"]["command"]
            .as_str()
            .expect("a line");
        assert!(
            ran.stderr.contains(&format!(": {command}\n")),
            "{}",
            ran.stderr
        );
        let pasted = place.shell(&format!("{command} --verify"));
        assert_eq!(pasted.code, 0, "{}", pasted.stderr);
        assert!(two_sided(&pasted.document()) <= most);
        // No cheaper setting holds.
        let row = report["result"]["choice"]["row"].as_u64().expect("a row") as usize;
        let cost = |row: &Value| row["wall_s"]["median"].as_f64();
        for other in rows(&report)
            .iter()
            .filter(|r| cost(r) < cost(&rows(&report)[row]))
        {
            assert!(other["error"].as_f64() > Some(most));
        }
    }
    let ran = place.run(&format!(
        "tradeoff voxelize {KNOT} --vary resolution=8,16 --repeat 1 --max-error 1e-6 --quiet"
    ));
    assert_eq!(ran.code, 1);
    assert_eq!(
        ran.stderr,
        "scantle: tradeoff: check failed: no setting was found with an error of at most 0.000001\n"
    );
    assert!(ran.document()["result"]["choice"].is_null());
}

#[test]
fn a_setting_that_fails_is_a_row_and_all_that_fail_are_an_error() {
    let place = Workplace::new();
    let ran = place.run(&format!(
        "tradeoff voxelize {KNOT} --vary fill --mode none --resolution 8 --repeat 1 -q"
    ));
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let report = ran.document();
    let row = &rows(&report)[0];
    assert_eq!(
        (&row["status"], &row["exit_code"]),
        (&"failed".into(), &2.into())
    );
    assert_eq!(row["message"], "--mode none: sets nothing without --fill");
    assert_eq!(rows(&report)[1]["status"], "done");
    let ran = place.run("tradeoff voxelize missing.ply --vary mode -q");
    assert_eq!(ran.code, 3);
    let why = "scantle: tradeoff: every setting failed: missing.ply: cannot read: ";
    assert!(ran.stderr.starts_with(why), "{}", ran.stderr);
    assert!(
        rows(&ran.document())
            .iter()
            .all(|row| row["exit_code"] == 3)
    );
}

#[test]
fn a_budget_leaves_rows_that_say_so() {
    let place = Workplace::new();
    let ran = place.run(&format!(
        "tradeoff voxelize {KNOT} --vary resolution=8,256 --budget 0.001 -q --csv t.csv --plot t.svg"
    ));
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let report = ran.document();
    let status: Vec<&Value> = rows(&report).iter().map(|row| &row["status"]).collect();
    assert_eq!(status, ["done", "not-run"]);
    let why = "predicted to take longer than is left of the budget";
    assert_eq!(rows(&report)[1]["message"], why);
    let table = fs::read_to_string(place.path("t.csv")).expect("the table");
    let lines: Vec<&str> = table.split_terminator("\r\n").collect();
    assert_eq!(lines.len(), 3);
    assert!(lines[0].starts_with("resolution,status,exit_code,error,bound,wall_s,"));
    assert!(lines[1].starts_with("8,done,0,0.") && lines[2].starts_with("256,not-run,0,,,,"));
    assert_eq!(report["output"][0]["path"], "t.svg");
    assert_eq!(report["output"][1]["path"], "t.csv");
    let plot = fs::read_to_string(place.path("t.svg")).expect("the plot");
    assert!(
        plot.starts_with("<svg") || plot.starts_with("<?xml"),
        "{plot}"
    );
    assert!(plot.contains("on the front") && plot.contains("error (file unit)"));
}

#[test]
fn one_process_finds_the_errors_of_many() {
    let place = Workplace::new();
    let figures = |more: &str| {
        let line = format!(
            "tradeoff voxelize {KNOT} fixtures/shapes/cube.ply --vary resolution=8,16 --repeat 1 -q {more}"
        );
        let ran = place.run(&line);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
        let report = ran.document();
        let of_row = |row: &Value| {
            let keys = ["setting", "error", "bound", "modelled", "status"];
            keys.map(|key| row[key].clone())
        };
        (
            report["input"].clone(),
            rows(&report).iter().map(of_row).collect::<Vec<_>>(),
        )
    };
    let (fresh, inside) = (figures(""), figures("--in-process"));
    assert_eq!(fresh, inside);
    assert_eq!(fresh.0.as_array().map(Vec::len), Some(2));
}

#[test]
fn two_runs_of_one_grid_compare_equal_but_for_what_varies() {
    let place = Workplace::new();
    let grid = format!("voxelize {KNOT} --vary resolution=8,16 --vary mode --repeat 2");
    let shadow = "shadow fixtures/shapes/torus.obj --size 24x16 --vary rays=1,2 --resolution 16";
    for line in [
        format!("tradeoff {grid} --max-error 0.5 --plot p.svg --csv t.csv -q"),
        format!("tradeoff {grid} --budget 0.05 -q"),
        format!("tradeoff {shadow} --repeat 1 --in-process -q"),
        format!("stability voxelize {KNOT} --resolution 12 --in-process -q"),
    ] {
        for name in ["a.json", "b.json"] {
            let ran = place.run(&format!("{line} --report {name}"));
            assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
        }
        let ran = place.run("compare a.json b.json --tolerance 0");
        assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
        let whole = place.run("compare a.json b.json --tolerance 0 --everything");
        let varies = line.starts_with("tradeoff");
        assert_eq!(whole.code, i32::from(varies), "{line}: {}", whole.stderr);
        // Another result does not hide behind what varies.
        let text = fs::read_to_string(place.path("b.json")).expect("a report");
        place.put("b.json", text.replace("\"rows\"", "\"lines\""));
        assert_eq!(place.run("compare a.json b.json --tolerance 0").code, 1);
    }
}

#[test]
fn lights_and_cameras_move_with_the_model() {
    let place = Workplace::new();
    let scene = "--light 3,-4,6,0.25 --light=-2,5,3,1 --camera 4,-3,2,0.1,0,0,0,0,1,50";
    let figures = |scene: &str| {
        let ran = place.run(&format!(
            "stability shadow fixtures/shapes/torus.obj --size 40x30 --resolution 24 --rays 4 {scene} --in-process --max-error 0 -q --csv s.csv"
        ));
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{scene}");
        ran.document()
    };
    let report = figures(scene);
    assert_eq!(report["result"]["unit"], "share of the light");
    let unchanged = &report["result"]["unchanged"];
    assert_eq!(unchanged["smallest_scale"], -100);
    assert_eq!(unchanged["largest_scale"], 100);
    assert_eq!(unchanged["offset"], 1e9);
    let of_turns = |report: &Value| -> Vec<Value> {
        let turns = rows(report).iter();
        let turns = turns.filter(|row| row["change"] == "turn" || row["change"] == "quarter-turn");
        turns.cloned().collect()
    };
    // A picture whose lights and camera were left behind would be of something else.
    for row in of_turns(&report) {
        assert_eq!(row["status"], "done", "{row}");
        let pixels = row["drift"].as_f64();
        assert!(pixels.is_some(), "{row}");
    }
    for row in of_turns(&figures("--light 3,-4,6,0.25")) {
        assert_eq!(row["status"], "skipped", "{row}");
        assert_eq!(row["message"], "shows another side without --camera");
    }
}

#[test]
fn what_cannot_be_varied_is_refused_with_words() {
    for (line, why) in [
        (
            "tradeoff nonsense a --vary mode",
            "tradeoff: there is no command nonsense; those with a trade: voxelize, shadow, smooth-mc, tunnels, splat-gen, splat-trace, vector-overlay, compress-anim encode",
        ),
        (
            "tradeoff info a --vary mode",
            "tradeoff: info has no trade: it counts, exactly",
        ),
        (
            "stability formats a",
            "stability: formats has no trade: it reads no data",
        ),
        (
            "tradeoff voxelize a.ply --vary colour=1",
            "tradeoff: --vary colour=1: voxelize has no such knob; it has: resolution, mode, fill, grid, levels",
        ),
        (
            "tradeoff voxelize a.ply --vary resolution=",
            "tradeoff: --vary resolution=: there is no value",
        ),
        (
            "tradeoff voxelize a.ply --vary mode --vary mode=z",
            "tradeoff: --vary mode=z: mode is varied already",
        ),
        (
            "tradeoff voxelize a.ply --vary mode=z,z",
            "tradeoff: --vary mode=z,z: the value 'z' is there twice",
        ),
        (
            "tradeoff voxelize a.ply --vary mode --mode z",
            "tradeoff: --vary mode: --mode is among the options of voxelize already",
        ),
        (
            "tradeoff voxelize a.ply --vary resolution=8,x",
            "tradeoff: invalid value 'x' for '--resolution <N>': invalid digit found in string\n\nFor more information, try '--help'.",
        ),
        (
            "tradeoff voxelize a.ply --vary mode -o a.svo",
            "tradeoff: --output is set for voxelize here, and cannot be given",
        ),
        (
            "tradeoff --vary mode voxelize -",
            "tradeoff: standard input can be read only once, and voxelize is run many times: name a file",
        ),
        (
            "tradeoff voxelize a.ply --vary mode --csv -",
            "--report -: is where --csv goes already",
        ),
        (
            "tradeoff voxelize a.ply --vary mode --plot a.pdf",
            "--plot a.pdf: its name must end in .svg or .png",
        ),
        (
            "stability tunnels a.pdb --start-residues A:106,A:272",
            "stability: --start-residues depends on what changed copies of the input do not hold; give the place itself as --start X,Y,Z",
        ),
        (
            "stability tunnels a.pdb --start 1,2,3 --keep HEM",
            "stability: --keep depends on what changed copies of the input do not hold; give a file of the spheres themselves (xyzr)",
        ),
        (
            "stability tunnels a.pdb --pores --clusters a.json",
            "stability: --clusters is set for tunnels here, and cannot be given",
        ),
        (
            "stability voxelize a.ply b.ply",
            "stability: 2 inputs, where one is taken",
        ),
    ] {
        let place = Workplace::new();
        let ran = place.run(line);
        assert_eq!(ran.code, 2, "{line}: {}", ran.stderr);
        assert_eq!(ran.stderr, format!("scantle: {why}\n"), "{line}");
        assert!(ran.stdout.is_empty() && place.names().is_empty(), "{line}");
    }
}

#[test]
fn no_voxel_changes_under_what_is_promised() {
    for (input, options) in [
        (KNOT, "--resolution 24"),
        (KNOT, "--resolution 20 --mode three-axis --fill winding"),
        (KNOT, "--voxel-size 0.3 --bounds=-2,-2,-2,2,3,1.5 --mode z"),
        (
            "fixtures/shapes/sphere.stl",
            "--resolution 16 --fill parity",
        ),
        (
            "fixtures/shapes/torus.obj",
            "--resolution 16 --mode three-axis",
        ),
        (
            "fixtures/shapes/open-box.obj",
            "--resolution 12 --fill winding",
        ),
        ("fixtures/shapes/points.ply", "--resolution 12"),
    ] {
        let place = Workplace::new();
        let ran = place.run(&format!(
            "stability voxelize {input} {options} --in-process --max-error 0 -q"
        ));
        assert_eq!(
            (ran.code, ran.stderr.as_str()),
            (0, ""),
            "{input} {options}"
        );
        let report = ran.document();
        let result = &report["result"];
        assert_eq!(result["drift"], 0.0, "{input} {options}");
        let unchanged = &result["unchanged"];
        assert_eq!(unchanged["smallest_scale"], -100, "{input} {options}");
        assert_eq!(unchanged["largest_scale"], 100, "{input} {options}");
        assert_eq!(unchanged["offset"], 1e9, "{input} {options}");
        for row in rows(&report) {
            let counts = row["promised"] == true && row["status"] == "done";
            assert!(!counts || row["differing_voxels"] == 0, "{input} {row}");
        }
    }
}

#[test]
fn tunnels_bear_scales_orders_and_doubled_atoms() {
    const PORTHOLES: &str = "fixtures/molecules/porthole.xyzr --start 0,0,0";
    for (input, options) in [
        (PORTHOLES, "--shell-radius 3"),
        (PORTHOLES, "--shell-radius 3 --method exact --count 1"),
        (PORTHOLES, "--shell-radius 3 --method grid:0.8 --remove c"),
        // Atoms of a PDB file without water and ions, sized by element; there are no pores.
        ("fixtures/molecules/helix.pdb", "--pores --shell-radius 4"),
    ] {
        let place = Workplace::new();
        let ran = place.run(&format!(
            "stability tunnels {input} {options} --in-process --max-error 0 -q"
        ));
        let case = format!("{input} {options}");
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{case}");
        let report = ran.document();
        assert_eq!(report["result"]["drift"], 0.0, "{case}");
        let unchanged = &report["result"]["unchanged"];
        assert_eq!(unchanged["smallest_scale"], -100, "{case}");
        assert_eq!(unchanged["largest_scale"], 100, "{case}");
        for row in rows(&report) {
            let of_faces = ["face-order", "split-vertices", "degenerate-faces"];
            let is_skipped = of_faces.iter().any(|name| row["change"] == *name);
            let wanted = if is_skipped { "skipped" } else { "done" };
            assert_eq!(row["status"], wanted, "{case}: {row}");
            let known = row["change"] == "vertex-order" || row["change"] == "duplicate-faces";
            assert!(!known || row["promised"] == true, "{case}: {row}");
        }
    }
}

#[test]
fn an_input_that_the_command_cannot_take_is_said_to_be_one() {
    for (line, why) in [
        (
            "stability voxelize fixtures/molecules/ring.xyzr",
            "stability: the untouched input fails: fixtures/molecules/ring.xyzr: holds a molecule (xyzr), but a mesh is needed",
        ),
        (
            "stability voxelize fixtures/volumes/ball.nrrd",
            "fixtures/volumes/ball.nrrd: holds a volume (nrrd), but a mesh or a molecule or a set of splats is needed",
        ),
        (
            "stability compress-anim encode fixtures/volumes/ball.nrrd",
            "fixtures/volumes/ball.nrrd: holds a volume (nrrd), but an animation is needed",
        ),
        (
            "stability compress-anim encode fixtures/animations/wave.pc2 --base fixtures/shapes/cube.obj",
            "fixtures/shapes/cube.obj: the animation has 45 vertices, but its base mesh 8",
        ),
    ] {
        let place = Workplace::new();
        let ran = place.run(line);
        assert_eq!(
            (ran.code, ran.stderr),
            (3, format!("scantle: {why}\n")),
            "{line}"
        );
    }
}

#[test]
fn drift_beyond_the_limit_ends_with_1_and_names_the_change() {
    // So far away the place of the result itself has no digits left.
    let place = Workplace::new();
    let ran = place.run(&format!(
        "stability voxelize {KNOT} --resolution 24 --offsets 1e16 --scales 1 --max-error 0 -q --csv s.csv --plot s.png"
    ));
    assert_eq!(ran.code, 1, "{}", ran.stderr);
    let why = "scantle: stability: check failed: the drift is larger than --max-error 0 under shift 1e16 extents\n";
    assert_eq!(ran.stderr, why);
    let report = ran.document();
    assert!(report["result"]["unchanged"]["offset"].is_null());
    let table = fs::read_to_string(place.path("s.csv")).expect("the table");
    assert_eq!(table.lines().count(), 1 + rows(&report).len());
    let plot = fs::read(place.path("s.png")).expect("the plot");
    assert!(plot.starts_with(b"\x89PNG"));
}

const WAVE: &str =
    "compress-anim encode fixtures/animations/wave.pc2 --base fixtures/animations/wave.obj";

#[test]
fn a_knob_whose_larger_values_are_cheaper_is_tried_from_them_on() {
    let place = Workplace::new();
    let ran = place.run(&format!(
        "tradeoff {WAVE} --vary target-kg=0.1,2,0.5 --repeat 1 --in-process -q --max-error 0.6"
    ));
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let report = ran.document();
    let settings: Vec<f64> = rows(&report)
        .iter()
        .map(|row| {
            let asked = row["setting"]["target-kg"].as_f64().expect("a number");
            assert!(row["error"].as_f64() <= Some(asked), "{row}");
            asked
        })
        .collect();
    assert_eq!(settings, [2.0, 0.5, 0.1]);
    let choice = report["result"]["choice"]["command"].as_str();
    let choice = choice.expect("a setting that holds");
    assert!(
        choice.starts_with("scantle compress-anim encode "),
        "{choice}"
    );
    let pasted = place.shell(choice);
    assert_eq!(pasted.code, 0, "{choice}: {}", pasted.stderr);
}

#[test]
fn streams_bear_every_scale_and_far_places_but_for_their_rounding() {
    for (input, options) in [
        (WAVE, ""),
        // A length is scaled along.
        (
            "compress-anim encode fixtures/animations/bar-skin.glb",
            "--animation bend --fps 10 --target-max 0.01",
        ),
        (
            "compress-anim encode fixtures/animations/frames/frame*.obj",
            "--method delta --target-rmse 0.001",
        ),
    ] {
        let place = Workplace::new();
        let ran = place.run(&format!(
            "stability {input} {options} --in-process --scales -100,-3,1,100 --max-error 1e-3 -q"
        ));
        let case = format!("{input} {options}");
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{case}");
        let report = ran.document();
        assert_eq!(report["result"]["unit"], "percent", "{case}");
        let unchanged = &report["result"]["unchanged"];
        assert_eq!(unchanged["smallest_scale"], -100, "{case}");
        assert_eq!(unchanged["largest_scale"], 100, "{case}");
        for row in rows(&report) {
            assert_eq!(row["status"], "done", "{case}: {row}");
            // Reordered or split vertices are told apart again: nothing like the size of the model.
            assert!(row["drift"].as_f64() < Some(5.0), "{case}: {row}");
        }
    }
}
