//! Files that are not what they should be are refused with words, and nothing else happens.
//!
//! Beside each file of `fixtures/malformed/` stands `FILE.expected`: the message as it follows the
//! file's name, and on a second line the way out, where there is one. `UPDATE_GOLDEN=1` rewrites it.

use crate::support::{Workplace, files_below, packed, root, updating};
use std::fs;
use std::path::{Path, PathBuf};

/// Whether a file of the folder is about the others.
fn is_about_others(file: &Path) -> bool {
    file.extension()
        .is_some_and(|e| ["expected", "md", "py"].iter().any(|other| e == *other))
}

/// The files that are to be refused.
fn malformed() -> Vec<PathBuf> {
    let mut files = files_below(&root().join("fixtures/malformed"));
    files.retain(|file| !is_about_others(file));
    files
}

fn expected_beside(file: &Path) -> PathBuf {
    let mut name = file.file_name().expect("a name").to_owned();
    name.push(".expected");
    file.with_file_name(name)
}

fn expected_of(file: &Path) -> String {
    let expected = expected_beside(file);
    fs::read_to_string(&expected).unwrap_or_else(|e| panic!("{}: {e}", expected.display()))
}

/// What `scantle info` says of a file whose fault reads `expected`: a place follows the file's name
/// after a colon alone, the fault of a whole file after a space too.
fn messages(name: &str, expected: &str) -> [String; 2] {
    let mut lines = expected.lines();
    let problem = lines.next().unwrap_or_default();
    let hint = lines.map(|hint| format!("  {}\n", hint.trim_start()));
    let hint: String = hint.collect();
    ["", " "].map(|space| format!("scantle: {name}:{space}{problem}\n{hint}"))
}

#[test]
fn malformed_files_are_refused_with_words() {
    let mut wrong = Vec::new();
    for file in malformed() {
        let name = file
            .strip_prefix(root())
            .expect("a fixture")
            .display()
            .to_string();
        let place = Workplace::new();
        let ran = place.run(&format!("info {name}"));
        if updating("UPDATE_GOLDEN") {
            let said = ran.stderr.replace(&format!("scantle: {name}:"), "");
            let lines: Vec<&str> = said.lines().map(str::trim_start).collect();
            fs::write(expected_beside(&file), lines.join("\n") + "\n").expect("a fixture");
        }
        let expected = messages(&name, &expected_of(&file));
        if ran.code != 3 || !ran.stdout.is_empty() || !expected.contains(&ran.stderr) {
            wrong.push(format!("{name} ends with {}:\n{}", ran.code, ran.stderr));
        }
        assert!(place.names().is_empty(), "{name} left {:?}", place.names());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn packed_malformed_files_are_refused_with_the_same_words() {
    if updating("UPDATE_GOLDEN") {
        return;
    }
    let place = Workplace::new();
    let mut files = malformed();
    files.retain(|file| file.extension().is_none_or(|e| e != "gz"));
    let mut names = vec!["info".to_owned()];
    for file in &files {
        let name = format!("{}.gz", file.file_name().expect("a name").display());
        place.put(&name, packed(&fs::read(file).expect("a fixture")));
        names.push(name);
    }
    let ran = crate::support::ran(place.command(&names).output());
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert!(ran.stdout.is_empty(), "{}", ran.text());
    let mut said = ran.stderr.as_str();
    for (file, name) in files.iter().zip(&names[1..]) {
        let expected = messages(name, &expected_of(file));
        let rest = expected.iter().find_map(|words| said.strip_prefix(words));
        let Some(rest) = rest else {
            panic!("of {name}: not\n{}but\n{said}", expected[0]);
        };
        said = rest;
    }
    assert_eq!(said, "");
}

#[test]
fn every_expectation_has_its_file() {
    for expected in files_below(&root().join("fixtures/malformed")) {
        if expected.extension().is_some_and(|e| e == "expected") {
            let file = expected.with_extension("");
            assert!(file.exists(), "{} stands alone", expected.display());
        }
    }
}
