//! The comparison of reports: integers and words exactly, real numbers to nine digits.

use serde_json::{Deserializer, Value};

/// The documents in a text, one after the other.
pub fn documents(text: &str) -> Vec<Value> {
    Deserializer::from_str(text)
        .into_iter()
        .map(|document| document.unwrap_or_else(|e| panic!("no JSON: {e}\n{text}")))
        .collect()
}

/// What became different, each with the path to it.
pub fn differences(want: &Value, got: &Value) -> Vec<String> {
    let mut found = Vec::new();
    compare("", want, got, &mut found);
    found
}

fn compare(at: &str, want: &Value, got: &Value, found: &mut Vec<String>) {
    match (want, got) {
        (Value::Object(a), Value::Object(b))
            if a.len() == b.len() && a.keys().all(|key| b.contains_key(key)) =>
        {
            for (key, value) in a {
                compare(&format!("{at}/{key}"), value, &b[key], found);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (index, (a, b)) in a.iter().zip(b).enumerate() {
                compare(&format!("{at}/{index}"), a, b, found);
            }
        }
        (Value::Number(a), Value::Number(b)) if a.is_f64() && b.is_f64() => {
            let (x, y) = (a.as_f64().expect("a float"), b.as_f64().expect("a float"));
            if (x - y).abs() > 1e-9 * x.abs().max(y.abs()) {
                found.push(format!("{at}: {x} became {y}"));
            }
        }
        (a, b) if a != b => found.push(format!("{at}: {a} became {b}")),
        _ => {}
    }
}

#[test]
fn integers_and_words_are_exact_and_real_numbers_are_not() {
    let same = |a: &str, b: &str| {
        let [a, b] = [a, b].map(|text| serde_json::from_str(text).expect("JSON"));
        differences(&a, &b).is_empty()
    };
    assert!(same(r#"{"a": [1, 2.0]}"#, r#"{"a": [1, 2.0000000001]}"#));
    assert!(!same(r#"{"a": 2.0}"#, r#"{"a": 2.00001}"#));
    assert!(!same("1", "2"));
    assert!(!same("1", "1.0"));
    assert!(!same("1.0", "null"));
    assert!(same(r#"{"a": 1, "b": 2.0}"#, r#"{"b": 2.0, "a": 1}"#));
    assert!(!same(r#"{"a": 1}"#, r#"{"b": 1}"#));
    assert!(!same("[1]", "[1, 1]"));
}
