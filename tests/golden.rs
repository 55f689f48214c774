//! Golden reports: a folder `fixtures/COMMAND/CASE/` for each.
//!
//! `cmd` holds the words after `scantle`, as if run from the repository root (what it writes goes
//! to a temporary folder); `report.json` what it prints; `stderr` what it says to a person, times
//! left out; `code` how it ends, where that is not with 0. What a report lists in `varies` is masked.
//! A run that fails leaves nothing behind. `UPDATE_GOLDEN=1 cargo test golden` rewrites them; read the
//! difference like code.

use crate::support::{Ran, Workplace, json, root, updating};
use jsonschema::Validator;
use scantle::report::stated_to_vary;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The folders of all cases.
fn cases() -> Vec<PathBuf> {
    let commands = crate::support::files_below(&root().join("fixtures"));
    commands
        .into_iter()
        .filter(|file| file.file_name().is_some_and(|name| name == "cmd"))
        .map(|file| file.parent().expect("a case has a folder").to_owned())
        .collect()
}

#[test]
fn reports_are_as_they_were() {
    let cases = cases();
    assert!(!cases.is_empty(), "there is no case below fixtures/");
    let mut schemas = BTreeMap::new();
    let mut wrong = Vec::new();
    for case in &cases {
        let name = case.strip_prefix(root()).expect("a case is in here");
        let line = fs::read_to_string(case.join("cmd")).expect("a case has a cmd");
        let place = Workplace::new();
        let ran = place.run(&line);
        if ran.code > 1 && !place.names().is_empty() {
            let left = place.names();
            wrong.push(format!("{} failed and left {left:?}", name.display()));
        }
        for report in ran.documents() {
            let problem = violation(&mut schemas, &line, &report);
            wrong.extend(problem.map(|problem| format!("{}: {problem}", name.display())));
        }
        if updating("UPDATE_GOLDEN") {
            rewrite(case, &ran);
            continue;
        }
        for difference in differences(case, &ran) {
            wrong.push(format!("{}: {difference}", name.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What of the report is not as the schema of its command says.
fn violation(
    schemas: &mut BTreeMap<String, Validator>,
    line: &str,
    report: &Value,
) -> Option<String> {
    let command = line
        .split_whitespace()
        .next()
        .expect("a line names a command");
    let schema = schemas.entry(command.to_owned()).or_insert_with(|| {
        let schema = Workplace::new()
            .run(&format!("schema {command}"))
            .document();
        jsonschema::validator_for(&schema).expect("a schema")
    });
    let error = schema.validate(report).err()?;
    Some(format!("{}: {error}", error.instance_path()))
}

fn kept(case: &Path, name: &str) -> String {
    fs::read_to_string(case.join(name)).unwrap_or_default()
}

fn differences(case: &Path, ran: &Ran) -> Vec<String> {
    let mut found = Vec::new();
    let code: i32 = kept(case, "code").trim().parse().unwrap_or(0);
    if code != ran.code {
        found.push(format!(
            "exit code {code} became {}\n{}",
            ran.code, ran.stderr
        ));
    }
    let (want, got) = (kept(case, "stderr"), timeless(&ran.stderr));
    // What is said of results that vary, varies.
    let varies = ran.documents().iter().any(|d| d.get("varies").is_some());
    if (code != 0 || !varies) && !is_same_text(&want, &got) {
        found.push(format!("standard error\n{want}became\n{got}"));
    }
    let got: Vec<Value> = ran.documents().into_iter().map(masked).collect();
    let want = json::documents(&kept(case, "report.json"));
    if want.len() != got.len() {
        found.push(format!("{} reports became {}", want.len(), got.len()));
    }
    for (want, got) in want.iter().zip(&got) {
        found.extend(json::differences(want, got));
    }
    found
}

/// A report with a word in place of all that it says to vary from run to run.
fn masked(mut report: Value) -> Value {
    let stated: Vec<String> = stated_to_vary(&report).map(str::to_owned).collect();
    for pointer in &stated {
        let tokens: Vec<&str> = pointer.split('/').skip(1).collect();
        mask(&mut report, &tokens);
    }
    report
}

fn mask(value: &mut Value, tokens: &[&str]) {
    match (tokens, value) {
        ([], value) => *value = "varies".into(),
        (["*", rest @ ..], Value::Array(items)) => {
            items.iter_mut().for_each(|item| mask(item, rest));
        }
        ([key, rest @ ..], Value::Object(members)) => {
            if let Some(member) = members.get_mut(*key) {
                mask(member, rest);
            }
        }
        (tokens, other) => panic!("{tokens:?} leads nowhere in {other}"),
    }
}

/// What is kept of the reports: as they were printed, where nothing varies.
fn printed(ran: &Ran) -> String {
    let reports = ran.documents();
    if reports
        .iter()
        .all(|report| stated_to_vary(report).count() == 0)
    {
        return ran.text();
    }
    let masked = reports.into_iter().map(masked);
    masked.map(|report| format!("{report:#}\n")).collect()
}

/// What was said, without the numbers of `read took 0.123 s, 0.120 s of processor time`.
fn timeless(said: &str) -> String {
    let lines = said.lines().map(|line| match line.split_once(" took ") {
        Some((stage, times)) if times.ends_with("of processor time") => format!("{stage} took …\n"),
        _ => format!("{line}\n"),
    });
    lines.collect()
}

/// Whether two texts are the same, words by words; numbers to nine digits, as in reports.
fn is_same_text(want: &str, got: &str) -> bool {
    let number = |word: &str| -> Option<f64> {
        let word = word.trim_matches(|c| "(),:;".contains(c));
        word.contains('.').then(|| word.parse().ok())?
    };
    let same = |a: &str, b: &str| match (number(a), number(b)) {
        (Some(a), Some(b)) => (a - b).abs() <= 1e-9 * a.abs().max(b.abs()),
        _ => a == b,
    };
    let lines = |text: &str| text.lines().count();
    let (a, b): (Vec<_>, Vec<_>) = (want.split(' ').collect(), got.split(' ').collect());
    lines(want) == lines(got) && a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| same(a, b))
}

#[test]
fn what_is_said_is_compared_but_for_times_and_last_digits() {
    let said = "scantle: a: read took 0.5 s, 0.1 s of processor time\nscantle: a: 8 vertices\n";
    let later = "scantle: a: read took 0.7 s, 0.2 s of processor time\nscantle: a: 8 vertices\n";
    assert_eq!(timeless(said), timeless(later));
    assert!(is_same_text(
        "rms 0.25, max 1\n",
        "rms 0.25000000000001, max 1\n"
    ));
    for other in [
        "rms 0.26, max 1\n",
        "rms 0.25, max 2\n",
        "rms 0.25\n",
        "",
        "rms 0.25, max 1\nx\n",
    ] {
        assert!(!is_same_text("rms 0.25, max 1\n", other), "{other}");
    }
}

fn rewrite(case: &Path, ran: &Ran) {
    let code = format!("{}\n", ran.code);
    let failed = ran.code != 0;
    let varies = ran.documents().iter().any(|d| d.get("varies").is_some());
    let files = [
        ("report.json", printed(ran), !ran.stdout.is_empty()),
        ("code", code, failed),
        (
            "stderr",
            timeless(&ran.stderr),
            !ran.stderr.is_empty() && (failed || !varies),
        ),
    ];
    for (name, content, wanted) in files {
        let path = case.join(name);
        if wanted {
            fs::write(path, content).expect("a case can be written");
        } else if path.exists() {
            fs::remove_file(path).expect("a case can be written");
        }
    }
}
