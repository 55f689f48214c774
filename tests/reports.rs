//! Reports as inputs: compared with each other, and told from other JSON.

use crate::support::{Workplace, packed, root};
use std::fs;

#[test]
fn a_report_equals_itself_whatever_varies_from_run_to_run() {
    let place = Workplace::new();
    fs::copy(
        root().join("fixtures/shapes/torus.obj"),
        place.path("moved.obj"),
    )
    .expect("a copy");
    let first = place.run("info fixtures/shapes/torus.obj --report first.json");
    assert_eq!(first.code, 0, "{}", first.stderr);
    let again = place.run("info moved.obj --timings --threads 3");
    assert!(again.text().contains("\"run\""));
    let line = "compare first.json - --tolerance 0";
    let ran = place.run_with_input(line, again.stdout.clone());
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let report = ran.document();
    assert_eq!(report["input"][1]["path"], "-");
    assert_eq!(report["result"]["identical"], true);
    assert_eq!(report["result"]["left_out"], 2);
    let whole = place.run_with_input(&format!("{line} --everything"), again.stdout);
    assert_eq!(whole.code, 1, "{}", whole.stderr);
    let report = whole.document();
    assert_eq!(report["result"]["differing"], 2);
    assert_eq!(report["result"]["first"][0]["path"], "/input/0/path");
    assert_eq!(report["result"]["first"][1]["path"], "/run");
}

#[test]
fn packed_json_and_lines_are_compared() {
    let place = Workplace::new();
    place.put("a.jsonl", "{\"x\": 1}\n\n{\"x\": 2}\n");
    place.put("b.json.gz", packed(b"{\"x\": 1.0}\r\n{\"x\": 2.5}\r\n"));
    let ran = place.run("compare a.jsonl b.json.gz --tolerance 0.2");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let said = "2 values, 1 more within the tolerance; the worst is document 1 /x: 2 became 2.5";
    assert!(ran.stderr.contains(said), "{}", ran.stderr);
    assert_eq!(ran.document()["accuracy"]["reached"], 0.2);
    assert_eq!(
        place.run("compare a.jsonl b.json.gz --tolerance 0.1").code,
        1
    );
}

#[test]
fn json_without_a_name_is_told_from_gltf() {
    let place = Workplace::new();
    let report = place.run("info fixtures/shapes/cube.obj");
    let looked = place.run_with_input("info -", report.stdout.clone());
    assert_eq!(looked.code, 0, "{}", looked.stderr);
    assert_eq!(looked.document()["result"]["reports"][0]["command"], "info");
    let gltf = br#" {"scene": 0, "asset": {"version": "2.0"}}"#.to_vec();
    let looked = place.run_with_input("info -", gltf);
    assert_eq!(looked.code, 3);
    assert!(looked.stderr.contains("-:scene 0: "), "{}", looked.stderr);
    let meant = place.run_with_input("info - --input-format gltf", report.stdout);
    assert_eq!(meant.code, 3);
    assert!(
        meant.stderr.contains("missing field `asset`"),
        "{}",
        meant.stderr
    );
}

#[test]
fn json_that_does_not_fit_is_refused() {
    let place = Workplace::new();
    place.put("list.json", format!("[{}0]", "0,".repeat(100_000)));
    place.put("lines.jsonl", "0\n".repeat(100_000));
    for (name, at) in [
        ("list.json", "line 1, column "),
        ("lines.jsonl", "line 7282, column "),
    ] {
        let ran = place.run(&format!("info {name} --max-memory 1MiB"));
        assert_eq!(ran.code, 5, "{}", ran.stderr);
        let [problem, hint] = ran.stderr.lines().collect::<Vec<_>>()[..] else {
            panic!("two lines, not {}", ran.stderr);
        };
        assert!(
            problem.starts_with(&format!("scantle: {name}: the text up to {at}")),
            "{problem}"
        );
        assert!(
            problem.ends_with(" bytes, over the limit of 1048576 bytes"),
            "{problem}"
        );
        assert_eq!(hint, "  raise --max-memory, or make the input smaller");
        let ran = place.run(&format!("info {name} --max-memory 64MiB"));
        assert_eq!(ran.code, 0, "{}", ran.stderr);
    }
}
