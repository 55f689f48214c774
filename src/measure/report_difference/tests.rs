use super::*;
use crate::progress::Silent;
use serde_json::json;

fn differ(a: &Value, b: &Value, tolerance: f64) -> ReportDifference {
    let params = Params {
        tolerance,
        ..Params::DEFAULT
    };
    let (a, b) = (std::slice::from_ref(a), std::slice::from_ref(b));
    compare(a, b, &params, &Silent).expect("a comparison")
}

fn words(found: &ReportDifference) -> Vec<String> {
    found.first.iter().map(ToString::to_string).collect()
}

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn what_is_equal_is_identical_in_any_order_and_spelling() {
    let a = parsed(r#"{"a": [1, 2.5, null, true], "b": {"x": "y", "z": 1e2}}"#);
    let b = parsed(r#"{"b": {"z": 100, "x": "\u0079"}, "a": [1.0, 25e-1, null, true]}"#);
    let found = differ(&a, &b, 0.0);
    assert!(found.identical && found.first.is_empty() && found.worst.is_none());
    assert_eq!((found.values, found.differing, found.within), (6, 0, 0));
    assert_eq!((found.max_relative, found.max_absolute), (0.0, Some(0.0)));
    assert_eq!(found.accuracy().reached, Some(0.0));
}

#[test]
fn every_kind_of_difference_is_named_by_its_pointer() {
    let a = json!({"n": 2, "s": "a", "b": true, "t": null, "gone": [], "l": [1, 2, 3], "a/b~c": 1});
    let b = json!({"n": 1, "s": "b", "b": false, "t": 0, "l": [1, 9], "a/b~c": 2, "new": {}});
    let found = differ(&a, &b, 0.0);
    assert_eq!(
        words(&found),
        [
            "/n: 2 became 1, 5e-1 of the larger",
            "/s: \"a\" became \"b\"",
            "/b: true became false",
            "/t: null became number",
            "/gone: array is missing",
            "/l: 3 elements became 2",
            "/l/1: 2 became 9, 7.777777777777778e-1 of the larger",
            "/a~1b~0c: 1 became 2, 5e-1 of the larger",
            "/new: object is added",
        ]
    );
    assert_eq!((found.differing, found.other), (9, 6));
    // Nothing outweighs a difference that is not one of amounts, and the first of those is named.
    assert_eq!(found.worst.as_ref(), Some(&found.first[1]));
    assert_eq!(found.max_absolute, Some(7.0));
    assert_eq!(found.accuracy().reached, None);
    let whole = differ(&json!([]), &json!({}), 0.0);
    assert_eq!(words(&whole), ["document 0: array became object"]);
}

#[test]
fn exchanged_files_differ_as_much() {
    let a = json!({"x": [1, 2, {"y": 3.5}], "only": 1, "t": "a"});
    let b = json!({"x": [1, 2.25, {"y": -3.5}, 4], "t": 1});
    let (there, back) = (differ(&a, &b, 0.2), differ(&b, &a, 0.2));
    let counts = |d: &ReportDifference| (d.differing, d.other, d.within, d.max_relative);
    assert_eq!(counts(&there), counts(&back));
    assert_eq!(counts(&there), (4, 3, 1, 2.0));
}

#[test]
fn numbers_within_the_tolerance_are_counted_and_not_named() {
    let (a, b) = (json!([1.0, 100.0, 8.0]), json!([1.1, 100.5, 8.0]));
    let found = differ(&a, &b, 0.05);
    assert_eq!((found.differing, found.within, found.other), (1, 1, 0));
    assert_eq!(found.first[0].path, "/0");
    let reached = found.accuracy().reached.expect("an error");
    assert!((reached - 0.1 / 1.1).abs() < 1e-15, "{reached}");
    // The worst is named even where the tolerance lets it pass, and a tolerance of what was
    // reached lets everything pass.
    let lenient = differ(&a, &b, reached);
    assert_eq!((lenient.differing, lenient.within), (0, 2));
    assert_eq!(lenient.worst.map(|worst| worst.path).as_deref(), Some("/0"));
    assert!(!lenient.identical);
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        let params = Params {
            tolerance: wrong,
            ..Params::DEFAULT
        };
        assert!(compare(&[], &[], &params, &Silent).is_err());
    }
}

#[test]
fn the_first_twenty_are_named_and_all_are_counted() {
    let rising = |step: f64| Value::from((0..50).map(|i| f64::from(i) * step).collect::<Vec<_>>());
    let found = differ(&rising(1.0), &rising(2.0), 0.0);
    assert_eq!((found.differing, found.first.len()), (49, 20));
    assert_eq!(found.first[0].path, "/1");
    assert_eq!(found.first[19].path, "/20");
    // All differ by half: the first of the largest is the worst.
    assert_eq!(found.worst, Some(found.first[0].clone()));
    assert_eq!((found.max_relative, found.max_absolute), (0.5, Some(49.0)));
}

fn report(path: &str, wall: f64) -> Value {
    json!({
        "schema": 1, "scantle": "0.1.0", "command": "info",
        "input": [{"path": path, "bytes": 9}], "output": [{"path": path}],
        "result": {"path": "of tunnels", "run": 3},
        "run": {"wall_s": wall, "threads": 2}
    })
}

#[test]
fn what_varies_from_run_to_run_is_left_out_of_reports() {
    let (a, b) = (report("a.obj", 1.0), report("there/b.obj", 2.0));
    let found = differ(&a, &b, 0.0);
    assert!(found.identical, "{:?}", words(&found));
    assert_eq!(found.left_out, 3);
    // A report without the block equals one with it.
    let mut short = a.clone();
    short.as_object_mut().expect("an object").remove("run");
    assert!(differ(&a, &short, 0.0).identical && differ(&short, &a, 0.0).identical);
    let params = Params {
        everything: true,
        ..Params::DEFAULT
    };
    let (one, two) = (std::slice::from_ref(&a), std::slice::from_ref(&b));
    let all = compare(one, two, &params, &Silent).expect("a comparison");
    let paths: Vec<_> = all.first.iter().map(|d| d.path.as_str()).collect();
    assert_eq!(paths, ["/input/0/path", "/output/0/path", "/run/wall_s"]);
    assert_eq!(all.left_out, 0);
    // Only there, and only in reports.
    let mut other = a.clone();
    other["result"]["path"] = json!("x");
    other["result"]["run"] = json!(4);
    assert_eq!(differ(&a, &other, 0.0).differing, 2);
    assert_eq!(
        differ(&json!({"run": 1}), &json!({"run": 2}), 0.0).differing,
        1
    );
}

#[test]
fn what_both_reports_state_to_vary_is_left_out() {
    let stating = |varies: Value, seconds: f64| {
        let mut report = report("a.obj", 1.0);
        report["result"] = json!({"rows": [{"s": seconds, "e": 1}, {"s": 1.0}], "s": 1.0});
        report["varies"] = varies;
        report
    };
    let pointer = || json!(["/result/rows/*/s"]);
    let (a, b) = (stating(pointer(), 1.0), stating(pointer(), 2.0));
    let found = differ(&a, &b, 0.0);
    assert!(found.identical, "{:?}", words(&found));
    assert_eq!(found.left_out, 2 + 3);
    // What only one states is compared, and so is the statement.
    let alone = differ(&a, &stating(json!([]), 2.0), 0.0);
    let paths: Vec<_> = alone.first.iter().map(|d| d.path.as_str()).collect();
    assert_eq!(paths, ["/result/rows/0/s", "/varies"]);
    // A pointer names a member as a whole, no part of it and none of another depth.
    for other in ["/result/s", "/result/rows/0/s", "/result/rows/*", "s", ""] {
        let [a, b] = [1.0, 2.0].map(|s| stating(json!([other]), s));
        assert_eq!(differ(&a, &b, 0.0).differing, 1, "{other}");
    }
    let [a, b] = [1.0, 2.0].map(|s| stating(json!(["/result", 7]), s));
    assert!(differ(&a, &b, 0.0).identical);
}

#[test]
fn documents_are_compared_one_by_one() {
    let a = [json!(1), json!({"x": 1}), json!("end")];
    let b = [json!(1), json!({"x": 2})];
    let found = compare(&a, &b, &Params::DEFAULT, &Silent).expect("a comparison");
    assert_eq!((found.documents_a, found.documents_b), (3, 2));
    let named = [
        "document 1 /x: 1 became 2, 5e-1 of the larger",
        "document 2: string is missing",
    ];
    assert_eq!(words(&found), named);
    let back = compare(&b, &a, &Params::DEFAULT, &Silent).expect("a comparison");
    assert_eq!(words(&back)[1], "document 2: string is added");
}

#[test]
fn what_is_said_is_short_and_safe_for_a_terminal() {
    let long = "x".repeat(1000);
    let found = differ(
        &json!({"\u{1b}[2J": long}),
        &json!({"\u{1b}[2J": "\u{1b}[0m"}),
        0.0,
    );
    let [said] = &words(&found)[..] else {
        panic!("one difference, not {found:?}");
    };
    assert!(said.starts_with("/\\u{1b}[2J: \"xxx"), "{said}");
    assert!(said.ends_with("xxx...\" became \"\\u{1b}[0m\""), "{said}");
    assert!(
        said.chars().count() < 130 && !said.contains('\u{1b}'),
        "{said}"
    );
    assert_eq!(found.first[0].path, "/\u{1b}[2J");
}
