//! JSON (RFC 8259) and JSON Lines: reports, and any other documents.

use super::header::excerpt;
use super::refusal::{RAISE, Refusal};
use super::source::Source;
use crate::error::Fault;
use crate::report::Warning;
use serde::de::{DeserializeSeed, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::error::Category;
use serde_json::{Deserializer, Map, Value};
use std::fmt;
use std::ops::Range;

/// The byte order mark that some editors put in front of a text.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Arrays and objects that may lie in one another. Well below what the parser can hold, and far
/// above what reports need.
const MAX_DEPTH: usize = 100;

/// Bytes of a value in a list: one that grows holds up to twice its length.
const VALUE: u64 = 2 * size_of::<Value>() as u64;

/// Bytes of a member of an object beside its value: key, hash, and a place in the table.
const MEMBER: u64 = 2 * (size_of::<String>() + 16) as u64;

/// Bytes of an array or an object beside its values: the first takes room for four.
const FIRST: u64 = VALUE + MEMBER;

/// Bytes of a string beside its characters.
const STRING: u64 = 32;

/// Reads all documents of a file: one, or several with white space between them, as in JSON Lines.
///
/// Keys keep their order. Of a key that stands twice in an object the last value is taken, with a
/// warning. Numbers without fraction or exponent are exact up to 64 bits; all others are the
/// nearest double. Errors, with line and column from 1, where a text is no JSON, a number is
/// beyond a double, more than 100 arrays and objects lie in one another, or the documents need more
/// memory than the source may use. Cost: linear in the bytes, each of which is passed twice.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Vec<Value>, Refusal> {
    let text = unmarked(source.bytes());
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
        return Err(Fault::byte(0, "the text is UTF-16, but JSON is UTF-8").into());
    }
    let mut builder = Builder {
        limit: source.limit(),
        ..Builder::default()
    };
    let mut documents = Vec::new();
    let mut ranges = Deserializer::from_slice(text).into_iter::<IgnoredAny>();
    loop {
        let start = ranges.byte_offset();
        match ranges.next() {
            None => break,
            Some(Err(error)) => return Err(fault(text, 0, &error).into()),
            Some(Ok(_)) => {
                let range = start..ranges.byte_offset();
                documents.push(build(text, range, &mut builder)?);
            }
        }
    }
    if documents.is_empty() {
        return Err(Fault::whole("has no document, but white space alone").into());
    }
    if let Some(key) = builder.twice {
        let message = format!(
            "keys that stand twice in one object, such as {key:?}; the last value is taken"
        );
        warnings.push(Warning::new(
            "duplicate-keys",
            message,
            builder.doubles,
            None,
        ));
    }
    Ok(documents)
}

/// A text without its byte order mark.
pub fn unmarked(text: &[u8]) -> &[u8] {
    text.strip_prefix(MARK).unwrap_or(text)
}

fn build(text: &[u8], range: Range<usize>, builder: &mut Builder) -> Result<Value, Refusal> {
    let end = range.end;
    let part = text[range].trim_ascii_start();
    let start = end - part.len();
    let mut parser = Deserializer::from_slice(part);
    let seed = Node {
        builder: &mut *builder,
        depth: 0,
    };
    seed.deserialize(&mut parser).map_err(|error| {
        if builder.held <= builder.limit {
            return fault(text, start, &error).into();
        }
        let (line, column) = place(text, start, &error);
        Refusal::OverMemory {
            what: format!("the text up to line {line}, column {column},"),
            needed: u128::from(builder.held),
            limit: builder.limit,
            hint: RAISE,
        }
    })
}

/// Line and column, from 1, of an error in the part of a text from `start` on.
fn place(text: &[u8], start: usize, error: &serde_json::Error) -> (usize, usize) {
    let before = &text[..start];
    let lines = before.iter().filter(|b| **b == b'\n').count();
    let shift = match before.iter().rposition(|b| *b == b'\n') {
        _ if error.line() > 1 => 0,
        None => start,
        Some(end) => start - end - 1,
    };
    // What is wrong with a document before it begins has no line of its own.
    (lines + error.line().max(1), shift + error.column())
}

/// The fault that the parser found in the part of a text from `start` on.
fn fault(text: &[u8], start: usize, error: &serde_json::Error) -> Fault {
    let (line, column) = place(text, start, error);
    let words = error.to_string();
    let words = words.split(" at line ").next().unwrap_or_default();
    let problem = match error.classify() {
        Category::Eof => {
            let what = words.trim_start_matches("EOF while parsing ");
            format!("the text ends within {what}")
        }
        _ => format!("column {column}: {words}"),
    };
    Fault::line(line as u64, problem)
}

/// What the values of a file have in common while they are built.
#[derive(Default)]
struct Builder {
    /// Bytes that may be held.
    limit: u64,
    /// Bytes that are held, estimated from above.
    held: u64,
    /// Keys that stand twice.
    doubles: u64,
    /// The first of them.
    twice: Option<String>,
}

impl Builder {
    fn hold<E: serde::de::Error>(&mut self, bytes: u64) -> Result<(), E> {
        self.held = self.held.saturating_add(bytes);
        if self.held <= self.limit {
            return Ok(());
        }
        // Nothing is read after this, so that the count alone tells what the error is.
        Err(E::custom("takes more memory than there is"))
    }
}

/// Builds a value, inside `depth` arrays and objects.
struct Node<'b> {
    builder: &'b mut Builder,
    depth: usize,
}

impl Node<'_> {
    fn inner(&mut self) -> Node<'_> {
        Node {
            builder: &mut *self.builder,
            depth: self.depth + 1,
        }
    }

    fn check_depth<E: serde::de::Error>(&self) -> Result<(), E> {
        if self.depth < MAX_DEPTH {
            return Ok(());
        }
        Err(E::custom(format_args!(
            "more than {MAX_DEPTH} arrays and objects lie in one another"
        )))
    }
}

impl<'de> DeserializeSeed<'de> for Node<'_> {
    type Value = Value;

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        self.builder.hold(VALUE)?;
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Node<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::from(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::from(value))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Value::from(value))
    }

    fn visit_str<E: serde::de::Error>(self, value: &str) -> Result<Value, E> {
        self.builder.hold(STRING + value.len() as u64)?;
        Ok(Value::from(value))
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut items: A) -> Result<Value, A::Error> {
        self.check_depth()?;
        self.builder.hold(FIRST)?;
        let mut values = Vec::new();
        while let Some(value) = items.next_element_seed(self.inner())? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut members: A) -> Result<Value, A::Error> {
        self.check_depth()?;
        self.builder.hold(FIRST)?;
        let mut object = Map::new();
        while let Some(key) = members.next_key::<String>()? {
            self.builder.hold(MEMBER + STRING + key.len() as u64)?;
            let value = members.next_value_seed(self.inner())?;
            if object.contains_key(&key) {
                self.builder.doubles += 1;
                let first = &mut self.builder.twice;
                first.get_or_insert_with(|| excerpt(&key));
            }
            object.insert(key, value);
        }
        Ok(Value::Object(object))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::At;
    use serde_json::json;

    fn parsed(text: &[u8]) -> Result<(Vec<Value>, Vec<Warning>), Fault> {
        let source = Source::from_bytes("a.json", text.to_vec()).expect("held bytes");
        let mut warnings = Vec::new();
        let documents = read(&source, &mut warnings).map_err(Refusal::fault)?;
        Ok((documents, warnings))
    }

    fn documents(text: &str) -> Vec<Value> {
        parsed(text.as_bytes()).expect(text).0
    }

    fn refused(text: impl AsRef<[u8]>) -> (At, String) {
        let fault = parsed(text.as_ref()).expect_err("no JSON");
        (fault.at, fault.problem)
    }

    fn nested(depth: usize) -> String {
        "[".repeat(depth) + &"]".repeat(depth)
    }

    #[test]
    fn one_document_or_several_are_read() {
        assert_eq!(
            documents(" {\"a\": [1, null]}\n"),
            [json!({"a": [1, null]})]
        );
        assert_eq!(
            documents("1\n\n2.5\r\n\"x\""),
            [json!(1), json!(2.5), json!("x")]
        );
        assert_eq!(documents("{\n}\n{\n}\n"), [json!({}), json!({})]);
        assert_eq!(documents("\u{feff}[]"), [json!([])]);
    }

    #[test]
    fn numbers_are_exact_or_nearest() {
        let big = documents("[18446744073709551615, -9223372036854775808, 9007199254740993]");
        assert_eq!(
            big,
            [json!([u64::MAX, i64::MIN, 9_007_199_254_740_993_u64])]
        );
        // A parser that is one unit off in the last place would not give these back.
        for value in [
            5e-324,
            2.2250738585072014e-308,
            31.245270191439438,
            0.1 + 0.2,
        ] {
            assert_eq!(documents(&format!("{value:e}")), [json!(value)]);
        }
    }

    #[test]
    fn faults_have_line_and_column_in_the_whole_text() {
        let line = |n, words: &str| (At::Line(n), words.to_owned());
        assert_eq!(
            refused("{\"a\": 1}\n  {\"a\": 1e999}\n"),
            line(2, "column 13: number out of range")
        );
        assert_eq!(
            refused("[1] [\n2,, 3]"),
            line(2, "column 3: expected value")
        );
        assert_eq!(refused("[1, 2"), line(1, "the text ends within a list"));
        assert_eq!(
            refused(b"[1] [\"\xff\"]"),
            line(1, "column 7: invalid unicode code point")
        );
        assert_eq!(refused(" \n").0, At::Whole);
        assert_eq!(refused(b"\xff\xfe{\0}\0").0, At::Byte(0));
    }

    #[test]
    fn depth_is_limited_with_words() {
        assert_eq!(documents(&nested(MAX_DEPTH)).len(), 1);
        let deep = "more than 100 arrays and objects lie in one another";
        for depth in [MAX_DEPTH + 1, 127, 128, 1_000_000] {
            let (at, problem) = refused(nested(depth));
            assert_eq!(at, At::Line(1));
            assert!(problem.ends_with(deep), "{depth}: {problem}");
        }
    }

    #[test]
    fn a_key_that_stands_twice_is_warned_of() {
        let text = br#"{"a": 1, "b": {"a": 2}, "a": 3}"#;
        let (documents, warnings) = parsed(text).expect("JSON");
        assert_eq!(documents, [json!({"a": 3, "b": {"a": 2}})]);
        let [warning] = &warnings[..] else {
            panic!("one warning, not {warnings:?}");
        };
        assert_eq!(
            (warning.code.as_str(), warning.count),
            ("duplicate-keys", 1)
        );
        assert!(warning.message.contains("\"a\""), "{}", warning.message);
    }

    #[test]
    fn what_does_not_fit_is_refused_before_it_is_held() {
        let mut builder = Builder {
            limit: 1000,
            ..Builder::default()
        };
        let text = format!("[{}0]", "0,".repeat(100));
        let refusal = build(text.as_bytes(), 0..text.len(), &mut builder).expect_err("too much");
        let Refusal::OverMemory {
            what,
            needed,
            limit,
            ..
        } = refusal
        else {
            panic!("no fault is in the text: {refusal:?}");
        };
        assert!(what.starts_with("the text up to line 1, column "), "{what}");
        assert!(needed > 1000 && limit == 1000, "{needed} of {limit}");
    }
}
