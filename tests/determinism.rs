//! The same bytes on any number of threads, from a file and from a pipe.

use crate::support::Workplace;
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
];

/// Command lines whose report is compared.
const REPORTS: &[&str] = &[
    "info fixtures/shapes/torus.obj",
    "compare fixtures/shapes/cube.obj fixtures/shapes/torus.obj",
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
