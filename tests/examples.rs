//! Every command line that is shown to a reader runs: in the README and in the help.

use crate::support::{Workplace, root};
use std::fs;

/// How the README starts the program from a clone; the tests have built it already.
const FROM_A_CLONE: &str = "cargo run --release -- ";

/// The blocks of a Markdown text that are marked `sh` or `console`.
fn blocks(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut block: Option<Vec<&str>> = None;
    for line in text.lines() {
        match (&mut block, line.trim_end()) {
            (None, "```sh" | "```console") => block = Some(Vec::new()),
            (Some(lines), "```") => {
                found.push(lines.join("\n"));
                block = None;
            }
            (Some(lines), line) => lines.push(line),
            (None, _) => {}
        }
    }
    found
}

/// The command lines of a block: those after `$ ` where it has any, else all.
fn command_lines(block: &str) -> String {
    let shown: Vec<&str> = block.lines().filter_map(|l| l.strip_prefix("$ ")).collect();
    if shown.is_empty() {
        block.to_owned()
    } else {
        shown.join("\n")
    }
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).expect("README.md")
}

#[test]
fn every_block_of_the_readme_runs() {
    let blocks = blocks(&readme());
    assert!(!blocks.is_empty(), "README.md shows no command");
    // One place for all blocks: a later one may use what an earlier one made.
    let place = Workplace::new();
    for block in blocks {
        let script = command_lines(&block);
        if script.trim() == "cargo test" {
            continue;
        }
        let script = script.replace(FROM_A_CLONE, "scantle ");
        assert!(!script.contains("cargo "), "not run by this test: {script}");
        let ran = place.shell(&script);
        assert_eq!(ran.code, 0, "{script}\n{}", ran.stderr);
    }
}

#[test]
fn the_readme_and_the_checks_name_one_test_command() {
    let shown = blocks(&readme());
    assert!(shown.iter().any(|block| block.trim() == "cargo test"));
    let checks = fs::read_to_string(root().join(".ci/run")).expect(".ci/run");
    assert!(checks.lines().any(|line| line == "cargo test"));
}

/// The commands, as the completions know them: those that are not hidden.
fn commands(place: &Workplace) -> Vec<String> {
    let script = place.run("completions fish").text();
    let mut names: Vec<String> = script
        .lines()
        .filter(|line| line.contains("__fish_scantle_needs_command"))
        .filter_map(|line| line.split_once(" -a \""))
        .filter_map(|(_, rest)| rest.split_once('"'))
        .map(|(name, _)| name.to_owned())
        .filter(|name| name != "help" && name != "man")
        .collect();
    names.sort();
    names.dedup();
    let verbs: Vec<String> = names.iter().flat_map(|name| verbs(place, name)).collect();
    names.extend(verbs);
    names
}

/// The verbs of a command that has some, each behind its name.
fn verbs(place: &Workplace, command: &str) -> Vec<String> {
    let help = place.run(&format!("{command} --help")).text();
    let Some((_, listed)) = help.split_once("\nCommands:\n") else {
        return Vec::new();
    };
    let listed = listed.lines().take_while(|line| !line.is_empty());
    let names = listed.filter_map(|line| {
        let is_name = line.starts_with("  ") && !line.starts_with("   ");
        line.split_whitespace().next().filter(|_| is_name)
    });
    names
        .filter(|name| *name != "help")
        .map(|name| format!("{command} {name}"))
        .collect()
}

#[test]
fn the_help_of_each_command_ends_with_two_examples_that_run() {
    let place = Workplace::new();
    let commands = commands(&place);
    for known in ["info", "compress-anim", "compress-anim encode"] {
        assert!(commands.contains(&known.to_owned()), "{commands:?}");
    }
    for command in commands {
        let help = place.run(&format!("{command} --help")).text();
        let (_, examples) = help
            .split_once("\nExamples:\n")
            .unwrap_or_else(|| panic!("the help of {command} shows no examples"));
        // Lines that end with a backslash go on.
        let examples = examples.trim_end().replace("\\\n", " ");
        let examples: Vec<&str> = examples.lines().map(str::trim).collect();
        assert_eq!(examples.len(), 2, "{command}: {examples:?}");
        for example in examples {
            assert!(
                example.starts_with(&format!("scantle {command}")),
                "{example}"
            );
            let ran = Workplace::new().shell(example);
            assert_eq!(ran.code, 0, "{example}\n{}", ran.stderr);
        }
    }
}

#[test]
fn blocks_are_found_and_output_is_not_run() {
    let text = "text\n```console\n$ a b\nout\n$ c\n```\n```json\n{}\n```\n```sh\nd\n```\n";
    let lines: Vec<String> = blocks(text).iter().map(|b| command_lines(b)).collect();
    assert_eq!(lines, ["a b\nc", "d"]);
}
