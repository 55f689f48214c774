//! What `scantle tunnels` writes beside its report.

use crate::support::Workplace;
use std::fmt::Write;
use std::fs;

/// A cubic crystal with a hole in its middle, in the columns of a PDB file: residues of two atoms.
pub fn crystal() -> String {
    let mut text = String::new();
    for k in 0..216 {
        let [x, y, z] = [k % 6, k / 6 % 6, k / 36].map(|c| 4.2 * f64::from(c));
        let from_middle = [x, y, z].map(|c| (c - 10.5).abs());
        if from_middle.iter().all(|c| *c < 4.0) {
            continue;
        }
        let name = if k % 2 == 0 { "CA" } else { "CB" };
        let number = k / 2 + 1;
        let line = format!("ATOM  {k:>5}  {name:<3} ALA A{number:>4}    {x:8.3}{y:8.3}{z:8.3}");
        writeln!(text, "{line}  1.00  0.00           C  ").expect("text");
    }
    text + "END\n"
}

const ALL: &str = "-o t.pdb --profile t.csv --plot t.svg --script t.pml --preview t.png";

#[test]
fn all_that_is_written_is_the_same_on_any_number_of_threads() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    let run = |threads: u32| {
        let line = format!(
            "tunnels a.pdb --start 10.5,10.5,10.5 --count 2 {ALL} --report r.json -q --threads {threads}"
        );
        let ran = place.run(&line);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let names = ["t.pdb", "t.csv", "t.svg", "t.pml", "t.png", "r.json"];
        names.map(|name| fs::read(place.path(name)).expect("a result"))
    };
    let one = run(1);
    assert!(one == run(3), "threads change a result");
    let report: serde_json::Value = serde_json::from_slice(&one[5]).expect("JSON");
    let output = report["output"].as_array().expect("a list");
    let formats: Vec<_> = output.iter().map(|o| o["format"].as_str()).collect();
    assert_eq!(formats, ["pdb", "csv", "svg", "pml", "png"].map(Some));
    let spheres = report["result"]["tunnels"].as_array().expect("tunnels");
    let spheres = spheres
        .iter()
        .map(|t| t["spheres"].as_array().map_or(0, Vec::len));
    let spheres: usize = spheres.sum();
    let lines = |bytes: &[u8], start: &str| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        text.lines().filter(|line| line.starts_with(start)).count()
    };
    assert!(spheres > 20);
    assert_eq!(lines(&one[0], "HETATM"), spheres);
    assert_eq!(lines(&one[1], ""), spheres + 1);
    assert_eq!(lines(&one[3], "create tunnel_"), 2);
}

#[test]
fn a_format_of_meshes_takes_the_surface() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    let ran = place.run("tunnels a.pdb --start 10.5,10.5,10.5 --count 2 -o t.ply -q");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let about = place.run("info t.ply").document();
    let result = &about["result"];
    let is_closed = result.to_string().contains("\"closed\":true");
    assert!(is_closed, "{result}");
}

#[test]
fn several_inputs_have_files_of_their_own() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    place.put("b.pdb", crystal());
    let ran = place.run(
        "tunnels a.pdb b.pdb --start 10.5,10.5,10.5 --count 1 --profile out/ --script {stem}-x.cxc -q",
    );
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(
        place.names(),
        ["a-x.cxc", "a.pdb", "b-x.cxc", "b.pdb", "out"]
    );
    let script = fs::read_to_string(place.path("b-x.cxc")).expect("a script");
    assert!(script.contains("open \"b.pdb\" id 1\n"), "{script}");
    let [a, b] = ["a", "b"].map(|name| fs::read(place.path(&format!("out/{name}.csv"))));
    assert_eq!(a.expect("a table"), b.expect("a table"));
}

#[test]
fn places_that_cannot_be_are_refused_before_the_work() {
    let place = Workplace::new();
    place.put("a.pdb", crystal());
    fs::create_dir(place.path("b")).expect("a folder");
    for (words, code, why) in [
        ("--plot b/t.png --preview b/../b/t.png", 2, "goes already"),
        ("--script a.pdb", 2, "must end in .pml or .cxc"),
        ("--plot t.jpg", 2, "must end in .svg or .png"),
        ("--profile -", 2, "a table goes to a file"),
        ("--profile none/t.csv", 4, "there is no folder none"),
        ("--preview b --plot b/a.png", 2, "goes already"),
    ] {
        let ran = place.run(&format!("tunnels a.pdb --start 10.5,10.5,10.5 {words}"));
        assert_eq!(ran.code, code, "{words}: {}", ran.stderr);
        assert!(ran.stderr.contains(why), "{words}: {}", ran.stderr);
        assert_eq!(ran.stdout, b"", "{words}");
    }
    assert_eq!(place.names(), ["a.pdb", "b"]);
}

#[test]
fn one_entry_in_two_formats_has_one_result() {
    let place = Workplace::new();
    let result = |file: &str| {
        let file = crate::support::root().join("fixtures/molecules").join(file);
        let line = format!(
            "tunnels {} --start-residues A:4 --keep HOH --probe-radius 0.1 --report r.json -q",
            file.display()
        );
        assert_eq!(place.run(&line).code, 0);
        let report = fs::read(place.path("r.json")).expect("a report");
        let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
        assert!(
            !report["result"]["tunnels"]
                .as_array()
                .expect("a list")
                .is_empty()
        );
        report["result"].clone()
    };
    assert_eq!(result("helix.pdb"), result("helix.cif"));
}
