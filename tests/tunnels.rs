//! What `scantle tunnels` finds, and says of what it cannot.

use crate::support::Workplace;
use crate::tunnel_outputs::crystal;
use serde_json::Value;
use std::fmt::Write;
use std::fs;

const MIDDLE: &str = "--start 10.5,10.5,10.5";

/// Models, each the lines of a file.
fn models(all: &[&str]) -> String {
    let mut text = String::new();
    for (lines, number) in all.iter().zip(1..) {
        let lines = lines.trim_end_matches("END\n");
        writeln!(text, "MODEL {number:>8}\n{lines}ENDMDL").expect("text");
    }
    text + "END\n"
}

/// The first lines of a text.
fn first_lines(text: &str, count: usize) -> String {
    text.split_inclusive('\n').take(count).collect()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

fn list(value: &Value) -> &[Value] {
    value
        .as_array()
        .unwrap_or_else(|| panic!("{value} is no list"))
}

#[test]
fn a_model_that_fails_does_not_keep_the_others_from_their_tunnels() {
    let place = Workplace::new();
    let whole = crystal();
    // Atoms of two walls do not enclose the start, and of all but the last 20 the last is not there.
    let few = first_lines(&whole, 40);
    let cut = first_lines(&whole, 188);
    place.put("few.pdb", models(&[&whole, &few, &whole]));
    place.put("cut.pdb", models(&[&cut, &whole, &whole]));
    place.put("none.pdb", models(&[&few, &few]));
    for (file, start, fails, why) in [
        ("few.pdb", MIDDLE, 1, "lies outside of the molecule"),
        ("cut.pdb", "--start-atoms 0,215", 0, "215"),
    ] {
        let line = format!(
            "tunnels {file} {start} --models all --count 2 -o {{stem}}.xyzr --clusters c.json"
        );
        let ran = place.run(&line);
        assert_eq!(ran.code, 3, "{file}: {}", ran.stderr);
        let number = fails + 1;
        let said = ran.stderr.lines().filter(|line| line.contains(why));
        let said: Vec<&str> = said.collect();
        assert_eq!(said.len(), 1, "{file}: {}", ran.stderr);
        assert!(
            said[0].starts_with(&format!("scantle: {file}: ")),
            "{said:?}"
        );
        assert!(
            said[0].contains(&format!("in model {number}, ")),
            "{said:?}"
        );
        let report = ran.document();
        let result = &report["result"];
        let failed = list(&result["failed_models"]);
        assert_eq!(failed.len(), 1, "{file}");
        assert_eq!(
            (&failed[0]["index"], &failed[0]["model"]),
            (&fails.into(), &number.into())
        );
        assert!(
            failed[0]["message"]
                .as_str()
                .is_some_and(|m| m.contains(why)),
            "{failed:?}"
        );
        let others = list(&result["other_models"]);
        let found: Vec<&Value> = [result].into_iter().chain(others).collect();
        let numbers: Vec<u64> = found.iter().filter_map(|m| m["model"].as_u64()).collect();
        let expected: Vec<u64> = (1..=3).filter(|n| *n != number).collect();
        assert_eq!(numbers, expected, "{file}");
        for model in found {
            assert_eq!(list(&model["tunnels"]).len(), 2, "{file}");
        }
        let stem = file.trim_end_matches(".pdb");
        assert!(place.path(&format!("{stem}.xyzr")).exists());
        let clusters = fs::read_to_string(place.path("c.json")).expect("clusters");
        let clusters: Value = serde_json::from_str(&clusters).expect("JSON");
        let frames = list(&clusters["frames"])
            .iter()
            .filter_map(|f| f["model"].as_u64());
        assert_eq!(frames.collect::<Vec<_>>(), expected);
    }
    // Where all fail there is nothing to report, and every one is told.
    fs::remove_file(place.path("c.json")).expect("it was there");
    let before = place.names();
    let line = format!("tunnels none.pdb {MIDDLE} --models all -o x.xyzr --clusters c.json");
    let ran = place.run(&line);
    assert_eq!(
        (ran.code, ran.stdout.as_slice()),
        (3, &b""[..]),
        "{}",
        ran.stderr
    );
    for number in [1, 2] {
        assert!(
            ran.stderr.contains(&format!("in model {number}, ")),
            "{}",
            ran.stderr
        );
    }
    assert_eq!(place.names(), before);
    // What is in no model is a wrong command line.
    let ran = place.run("tunnels none.pdb --start-atoms 7,999 --models all");
    assert_eq!(
        (ran.code, ran.stdout.as_slice()),
        (2, &b""[..]),
        "{}",
        ran.stderr
    );
    // One alone is as ever.
    let ran = place.run(&format!("tunnels few.pdb {MIDDLE} --models 2"));
    assert_eq!(
        (ran.code, ran.stdout.as_slice()),
        (3, &b""[..]),
        "{}",
        ran.stderr
    );
    assert!(!ran.stderr.contains("in model"), "{}", ran.stderr);
    let ran = place.run(&format!("tunnels few.pdb {MIDDLE} --models 3 -q"));
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.document()["result"].get("failed_models").is_none());
}

/// Balls at random around a hole, as lines of a file.
fn packing(seed: u64) -> String {
    let mut state = seed;
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31)
    };
    let mut balls: Vec<([f64; 3], f64)> = Vec::new();
    let length = |p: [f64; 3]| p.iter().map(|c| c * c).sum::<f64>().sqrt();
    while balls.len() < 150 {
        let centre = [0; 3].map(|_| 18.0 * draw() - 9.0);
        let radius = 1.2 + 0.6 * draw();
        let away = length(centre);
        let apart = |(other, _): &([f64; 3], f64)| {
            length([0, 1, 2].map(|axis| other[axis] - centre[axis])) > 1.6
        };
        if away < 9.0 && away > 1.5 + radius && balls.iter().all(apart) {
            balls.push((centre, radius));
        }
    }
    let mut text = String::new();
    for ([x, y, z], radius) in balls {
        writeln!(text, "{x:.6} {y:.6} {z:.6} {radius:.6}").expect("text");
    }
    text
}

#[test]
fn a_start_near_the_surface_is_verified() {
    let place = Workplace::new();
    // There the widest place near lies in a cell that the solvent holds, though its own does not.
    for (seed, start) in [
        (2, "-4.877,-4.706,-1.903"),
        (4, "4.858,-5.907,-0.500"),
        (7, "-5.988,2.042,-3.663"),
        (22, "-3.893,-1.559,-5.381"),
    ] {
        place.put("a.xyzr", packing(seed));
        let line = format!("tunnels a.xyzr --start={start} --method exact --verify -q");
        let ran = place.run(&line);
        assert_eq!(ran.code, 0, "{seed}: {}", ran.stderr);
        let report = ran.document();
        assert_eq!(report["accuracy"]["verified"], true, "{seed}");
        assert!(number(&report["accuracy"]["reached"]) <= 1e-6, "{seed}");
        let [widest, verified] = ["widest", "verified"].map(|key| &report["result"][key]);
        let [low, high] = [0, 1].map(|k| number(&verified["exact"][k]));
        assert!(low <= number(&widest["upper"]) + 1e-9, "{seed}: {widest}");
        assert!(number(&widest["lower"]) <= high + 1e-9, "{seed}: {widest}");
    }
}

#[test]
fn a_way_that_its_start_limits_is_told() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    let limited = |start: &str| {
        let ran = place.run(&format!("tunnels a.pdb {start} --probe-radius 0 -q"));
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let report = ran.document();
        let [start, widest] = ["start", "widest"].map(|key| &report["result"][key]);
        let narrower = number(&widest["lower"]) < number(&start["clearance"]);
        assert_eq!(start["limited"], !narrower, "{start} {widest}");
        !narrower
    };
    assert!(!limited(MIDDLE));
    // 0.3 from the surface of an atom at (4.2, 8.4, 8.4).
    assert!(limited("--start 6.2,8.4,8.4 --start-search 0"));
    // What is closed for that alone has a way out.
    for (words, is_told) in [
        ("--start 6.2,8.4,8.4 --start-search 0", true),
        ("--start 10.5,10.5,10.5 --probe-radius 2", false),
    ] {
        let ran = place.run(&format!("tunnels a.pdb {words}"));
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        assert!(
            ran.stderr.contains(": no way out is as wide as"),
            "{}",
            ran.stderr
        );
        let hint = "a larger --start-search may find a wider place";
        assert_eq!(ran.stderr.contains(hint), is_told, "{}", ran.stderr);
    }
}

#[test]
fn of_several_inputs_the_one_that_lacks_the_start_is_named() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    place.put("b.pdb", first_lines(&crystal(), 188));
    let lacks = "--start-atoms 0,215: no atom 215: the numbers are 0 to 195";
    let ran = place.run("tunnels a.pdb b.pdb --start-atoms 0,215 -q");
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    assert!(
        ran.stderr.starts_with(&format!("scantle: b.pdb: {lacks}")),
        "{}",
        ran.stderr
    );
    assert_eq!(ran.documents().len(), 1);
    let ran = place.run("tunnels b.pdb --start-atoms 0,215");
    assert!(
        ran.stderr.starts_with(&format!("scantle: {lacks}")),
        "{}",
        ran.stderr
    );
    // A chain without a name cannot be named.
    let unnamed = crystal().replace("ALA A", "ALA  ");
    place.put("c.pdb", unnamed);
    let ran = place.run("tunnels c.pdb --start-residues A:1");
    let why = "no residue A:1: the only chain has no name; give the number alone, as in 1";
    assert!(ran.stderr.contains(why), "{}", ran.stderr);
    assert_eq!(ran.code, 2);
}

#[test]
fn a_table_of_radii_makes_ways_wider_by_as_much() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    let run = |words: &str| {
        let line = format!("tunnels a.pdb {MIDDLE} --start-search 0 --count 1 -q {words}");
        let ran = place.run(&line);
        assert_eq!(ran.code, 0, "{words}: {}", ran.stderr);
        ran.document()
    };
    let width = |report: &Value| number(&report["result"]["widest"]["radius"]);
    let first = run("");
    assert_eq!(first["parameters"]["radii"], Value::Null);
    for (table, wider) in [
        ("C 1.5\n", 0.2),
        ("# ours\nC 1.6\nN 9\n", 0.1),
        ("ALA CA 1.7\nALA CB 1.7\nC 0.5\n", 0.0),
    ] {
        place.put("radii.txt", table);
        let report = run("--radii radii.txt");
        assert_eq!(report["parameters"]["radii"], "radii.txt");
        let off = width(&report) - width(&first) - wider;
        assert!(off.abs() < 1e-9, "{table}: {off}");
    }
    for (table, code, place_of_fault) in [
        (Some("C 1.7\nC x\n"), 3, "radii.txt:2: "),
        (Some("C -1\n"), 3, "radii.txt:1: "),
        (None, 3, "none.txt: cannot read"),
    ] {
        let file = if table.is_some() {
            "radii.txt"
        } else {
            "none.txt"
        };
        place.put("radii.txt", table.unwrap_or_default());
        let ran = place.run(&format!("tunnels a.pdb {MIDDLE} --radii {file}"));
        assert_eq!(ran.code, code, "{}", ran.stderr);
        assert!(
            ran.stderr.contains(place_of_fault),
            "{table:?}: {}",
            ran.stderr
        );
        assert_eq!(ran.stdout, b"");
    }
}

#[test]
fn clusters_hold_the_tunnels_of_all_frames() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    // One frame with a channel, which is wider than any way of the others.
    let closes = ["   8.400   4.200   8.400", "   8.400   0.000   8.400"];
    let open: String = crystal()
        .lines()
        .filter(|line| !closes.iter().any(|place| line.contains(place)))
        .flat_map(|line| [line, "\n"])
        .collect();
    place.put("b.pdb", models(&[&crystal(), &open]));
    let line = format!(
        "tunnels a.pdb b.pdb {MIDDLE} --models all --count 2 --clusters c.json --cluster-threshold 3 -q"
    );
    let ran = place.run(&line);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let reports = ran.documents();
    let second = list(&reports[1]["result"]["other_models"]);
    let found = [&reports[0]["result"], &reports[1]["result"], &second[0]];
    let text = fs::read_to_string(place.path("c.json")).expect("clusters");
    assert!(text.ends_with("}\n"), "{text}");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(number(&document["threshold"]), 3.0);
    let frames: Vec<_> = list(&document["frames"])
        .iter()
        .map(|f| {
            (
                f["input"].as_str(),
                f["model"].as_u64(),
                f["tunnels"].as_u64(),
            )
        })
        .collect();
    let count = |k: usize| Some(list(&found[k]["tunnels"]).len() as u64);
    assert_eq!(
        frames,
        [
            (Some("a.pdb"), Some(1), count(0)),
            (Some("b.pdb"), Some(1), count(1)),
            (Some("b.pdb"), Some(2), count(2))
        ]
    );
    let clusters = list(&document["clusters"]);
    let all: u64 = clusters.iter().filter_map(|c| c["tunnels"].as_u64()).sum();
    assert_eq!(Some(all), (0..3).map(count).sum::<Option<u64>>());
    let (mut gaps, mut shared) = (0, 0);
    for cluster in clusters {
        let by_frame = list(&cluster["by_frame"]);
        assert_eq!(by_frame.len(), 3);
        for (seen, result) in by_frame
            .iter()
            .zip(found)
            .filter(|(seen, _)| !seen.is_null())
        {
            let is_it = |tunnel: &&Value| {
                tunnel["bottleneck"]["lower"] == seen["bottleneck"]
                    && tunnel["length"] == seen["length"]
                    && tunnel["throughput"] == seen["throughput"]
            };
            assert!(list(&result["tunnels"]).iter().any(|t| is_it(&t)), "{seen}");
        }
        // The first two frames are the same molecule.
        assert_eq!(by_frame[0], by_frame[1]);
        let seen: Vec<&Value> = by_frame.iter().filter(|seen| !seen.is_null()).collect();
        assert_eq!(cluster["frames"].as_u64(), Some(seen.len() as u64));
        let easy: f64 = seen.iter().map(|s| number(&s["throughput"])).sum();
        assert!((number(&cluster["priority"]) - easy / 3.0).abs() < 1e-12);
        let widths: Vec<f64> = seen.iter().map(|s| number(&s["bottleneck"])).collect();
        let mean = widths.iter().sum::<f64>() / widths.len() as f64;
        let [low, middle, high] = [0, 1, 2].map(|k| number(&cluster["bottleneck"][k]));
        assert_eq!(low, widths.iter().copied().fold(f64::INFINITY, f64::min));
        assert_eq!(high, widths.iter().copied().fold(0.0, f64::max));
        assert!((middle - mean).abs() < 1e-12);
        gaps += 3 - seen.len();
        shared += usize::from(seen.len() > 1);
    }
    assert!(gaps > 0 && shared > 0, "{document}");
    let priorities = clusters.iter().map(|c| number(&c["priority"]));
    assert!(priorities.is_sorted_by(|a, b| a >= b), "{document}");
}
