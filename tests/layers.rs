//! Imports point down only, and the library knows no terminal.

use crate::support::{files_below, root};
use std::fs;
use std::path::Path;

/// Each module of `src/`, and the modules it may use. A new module needs a row.
const MAY_USE: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("progress", &[]),
    ("report", &[]),
    ("trade", &[]),
    ("numeric", &[]),
    ("spatial", &["error", "numeric"]),
    ("image", &["error", "report"]),
    (
        "mesh",
        &["error", "numeric", "progress", "report", "spatial"],
    ),
    (
        "points",
        &[
            "error", "mesh", "numeric", "progress", "report", "spatial", "trade",
        ],
    ),
    ("vector", &["error", "numeric", "report", "spatial"]),
    ("camera", &["numeric", "spatial"]),
    (
        "volume",
        &[
            "error", "mesh", "numeric", "progress", "report", "spatial", "trade",
        ],
    ),
    (
        "render",
        &[
            "camera", "error", "image", "mesh", "numeric", "points", "progress", "report",
            "spatial", "trade", "volume",
        ],
    ),
    (
        "protein",
        &[
            "error", "mesh", "numeric", "progress", "report", "spatial", "trade", "volume",
        ],
    ),
    (
        "anim",
        &[
            "error", "mesh", "numeric", "progress", "report", "spatial", "trade",
        ],
    ),
    (
        "terrain",
        &[
            "camera", "error", "image", "numeric", "progress", "report", "spatial", "trade",
            "vector",
        ],
    ),
    (
        "measure",
        &[
            "anim", "camera", "error", "image", "mesh", "numeric", "points", "progress", "protein",
            "report", "spatial", "terrain", "trade", "vector", "volume",
        ],
    ),
    // Data types only: a reader calls no algorithm.
    (
        "io",
        &[
            "anim", "error", "image", "mesh", "numeric", "points", "protein", "report", "spatial",
            "terrain", "vector", "volume",
        ],
    ),
];

/// Macros stand at the root of a crate wherever they are written.
const MACROS: &[(&str, &str)] = &[("with_samples", "volume")];

/// What belongs to the command line, or to `src/io/`.
const NOT_IN_THE_LIBRARY: &[&str] = &["clap::", "indicatif::", "process::exit", "IsTerminal"];
const ONLY_IN_IO: &[&str] = &["std::fs", "fs::read", "fs::write", "File::"];

/// Code without comments: a link in documentation is no import.
fn code(text: &str) -> String {
    let lines = text.lines().map(|line| match line.find("//") {
        Some(at) if !line[..at].contains('"') => &line[..at],
        _ => line,
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn identifier(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// The first names after each `crate::` in a code.
fn imports(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, path) in code.match_indices("crate::") {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &code[at + path.len()..];
        match rest.strip_prefix('{') {
            Some(list) => found.extend(first_names(list)),
            None => found.push(identifier(rest).to_owned()),
        }
    }
    found
}

/// The first name of each item of `a::b, c::{d, e}}`.
fn first_names(list: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut depth = 0;
    let mut fresh = true;
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => fresh = true,
            c if fresh && !c.is_whitespace() => {
                names.push(identifier(&list[at..]).to_owned());
                fresh = false;
            }
            _ => {}
        }
    }
    names
}

/// Whether `super::super::…` leads to the root of the crate from a file at `depth` modules below.
fn climbs_to_the_root(code: &str, depth: usize) -> bool {
    let tests = code.find("mod tests {").unwrap_or(code.len());
    let mut at = 0;
    while let Some(start) = code[at..].find("super::").map(|found| found + at) {
        let mut end = start;
        while code[end..].starts_with("super::") {
            end += "super::".len();
        }
        let steps = (end - start) / "super::".len();
        if steps >= depth + usize::from(start > tests) {
            return true;
        }
        at = end;
    }
    false
}

/// The module that a name after `crate::` belongs to.
fn home(name: &str) -> &str {
    let found = MACROS.iter().find(|(macro_name, _)| *macro_name == name);
    found.map_or(name, |(_, home)| home)
}

fn violations(path: &Path, text: &str) -> Vec<String> {
    let code = code(text);
    let parts: Vec<String> = path
        .with_extension("")
        .iter()
        .map(|part| part.display().to_string())
        .filter(|part| part != "mod")
        .collect();
    let module = parts[0].as_str();
    let Some((_, allowed)) = MAY_USE.iter().find(|(name, _)| *name == module) else {
        return vec![format!("module {module} has no row in tests/layers.rs")];
    };
    let mut found = Vec::new();
    for name in imports(&code) {
        let home = home(&name);
        if home != module && !allowed.contains(&home) {
            found.push(format!("{module} may not use {name}"));
        }
    }
    if climbs_to_the_root(&code, parts.len()) {
        found.push("super:: leads out of the module; write crate::".to_owned());
    }
    let terminal = NOT_IN_THE_LIBRARY
        .iter()
        .filter(|word| code.contains(**word));
    found.extend(terminal.map(|word| format!("{word} belongs to commands/")));
    if module != "io" {
        let files = ONLY_IN_IO.iter().filter(|word| code.contains(**word));
        found.extend(files.map(|word| format!("{word} belongs to src/io/")));
    }
    found
}

#[test]
fn imports_point_down_only() {
    let source = root().join("src");
    let mut wrong = Vec::new();
    for file in files_below(&source) {
        let path = file.strip_prefix(&source).expect("a file of src/");
        if path != Path::new("lib.rs") {
            let text = fs::read_to_string(&file).expect("a source file");
            let found = violations(path, &text);
            wrong.extend(
                found
                    .iter()
                    .map(|why| format!("src/{}: {why}", path.display())),
            );
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_permission_is_left_over() {
    let source = root().join("src");
    for (module, uses) in MAY_USE {
        let files = files_below(&source).into_iter().filter(|file| {
            let path = file.strip_prefix(&source).expect("a file of src/");
            path.with_extension("").starts_with(module)
        });
        let used: Vec<String> = files
            .flat_map(|file| imports(&code(&fs::read_to_string(file).expect("a source file"))))
            .map(|name| home(&name).to_owned())
            .collect();
        for allowed in *uses {
            let is_used = used.iter().any(|name| name == allowed);
            assert!(
                is_used,
                "{module} may use {allowed}, and does not: take it away"
            );
        }
    }
}

#[test]
fn no_row_is_left_over() {
    for (module, uses) in MAY_USE {
        let there = ["", "/mod"].iter().any(|end| {
            let file = format!("src/{module}{end}.rs");
            root().join(file).exists()
        });
        assert!(there, "module {module} is gone");
        for used in *uses {
            let row = MAY_USE.iter().position(|(name, _)| name == used);
            let own = MAY_USE.iter().position(|(name, _)| name == module);
            assert!(row < own, "{module} uses {used}, which stands above it");
        }
    }
}

#[test]
fn a_wrong_import_is_found() {
    let why = |path: &str, text: &str| violations(Path::new(path), text).join("; ");
    assert_eq!(why("mesh/weld.rs", "use crate::numeric::vector::Vec3;"), "");
    assert_eq!(why("mesh/weld.rs", "/// See [`crate::io`].\nfn f() {}"), "");
    assert_eq!(why("mesh/weld.rs", "use super::Mesh;"), "");
    assert_eq!(why("error.rs", "mod tests {\n    use super::*;\n}"), "");
    assert_eq!(
        why("mesh/mod.rs", "use crate::{error::{At, Fault}, io};"),
        "mesh may not use io"
    );
    assert_eq!(
        why("numeric/svd.rs", "fn f(m: &crate::mesh::Mesh) {}"),
        "numeric may not use mesh"
    );
    assert_eq!(
        why("mesh/weld.rs", "use super::super::io;"),
        "super:: leads out of the module; write crate::"
    );
    assert_eq!(
        why("mesh/weld.rs", "use std::fs;"),
        "std::fs belongs to src/io/"
    );
    assert_eq!(
        why("tunnels/mod.rs", ""),
        "module tunnels has no row in tests/layers.rs"
    );
}
