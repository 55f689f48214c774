//! One difference: where it is, and what it is.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Number, Value};
use std::fmt;

/// Characters of a string that are shown.
const SHOWN: usize = 80;

/// One difference of two files of JSON.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// The document, from 0: in JSON Lines, the line that is not blank.
    pub document: u64,
    /// Where in the document, as a JSON pointer (RFC 6901): empty for the document itself.
    pub path: String,
    /// What it is.
    #[serde(flatten)]
    pub change: Change,
}

/// What is different at a place; `a` and `b` stand for the first file and the second.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "change", rename_all = "kebab-case")]
pub enum Change {
    /// Two numbers.
    Number {
        /// As the first file has it.
        a: Number,
        /// As the second file has it.
        b: Number,
        /// `|a - b|`, null where it is beyond the largest double.
        absolute: Option<f64>,
        /// `|a - b| / max(|a|, |b|)`.
        relative: f64,
    },
    /// Two strings.
    String {
        /// At most 80 characters of the first.
        a: String,
        /// At most 80 characters of the second.
        b: String,
    },
    /// True and false.
    Boolean {
        /// The first.
        a: bool,
        /// The second.
        b: bool,
    },
    /// Values of different types.
    Type {
        /// `null`, `boolean`, `number`, `string`, `array` or `object`.
        a: String,
        /// The type of the second.
        b: String,
    },
    /// Arrays of different lengths.
    Length {
        /// Elements of the first.
        a: u64,
        /// Elements of the second.
        b: u64,
    },
    /// What only the first file has: a member of an object, or a document.
    Missing {
        /// Its type.
        a: String,
    },
    /// What only the second file has: a member of an object, or a document.
    Added {
        /// Its type.
        b: String,
    },
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Change::Number { a, b, relative, .. } => {
                write!(f, "{a} became {b}, {relative:e} of the larger")
            }
            Change::String { a, b } => write!(f, "{a:?} became {b:?}"),
            Change::Boolean { a, b } => write!(f, "{a} became {b}"),
            Change::Type { a, b } => write!(f, "{a} became {b}"),
            Change::Length { a, b } => write!(f, "{a} elements became {b}"),
            Change::Missing { a } => write!(f, "{a} is missing"),
            Change::Added { b } => write!(f, "{b} is added"),
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.document > 0 || self.path.is_empty() {
            write!(f, "document {}", self.document)?;
            f.write_str(if self.path.is_empty() { "" } else { " " })?;
        }
        // A key may hold what a terminal takes for a command.
        for c in self.path.chars() {
            if c.is_control() {
                write!(f, "{}", c.escape_default())?;
            } else {
                write!(f, "{c}")?;
            }
        }
        write!(f, ": {}", self.change)
    }
}

/// A string in at most as many characters as are shown.
pub(super) fn shown(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        None => text.to_owned(),
        Some(_) => text.chars().take(SHOWN - 3).chain("...".chars()).collect(),
    }
}

/// The name of a value's type.
pub(super) fn type_name(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

/// A step down: to a member or to an element.
#[derive(Debug, Clone, Copy)]
pub(super) enum Step<'v> {
    Key(&'v str),
    Index(usize),
}

/// The way from a document down to a value.
pub(super) struct Path<'v> {
    document: u64,
    steps: Vec<Step<'v>>,
}

impl<'v> Path<'v> {
    pub(super) fn new(document: u64) -> Self {
        Path {
            document,
            steps: Vec::new(),
        }
    }

    pub(super) fn push(&mut self, step: Step<'v>) {
        self.steps.push(step);
    }

    pub(super) fn pop(&mut self) {
        self.steps.pop();
    }

    /// Whether the member `key` of the object here is what a pointer with `*` for indices names.
    pub(super) fn is_at(&self, key: &str, pointer: &str) -> bool {
        let mut tokens = pointer.split('/').skip(1);
        self.steps.iter().all(|step| match step {
            Step::Key(here) => tokens.next() == Some(here),
            Step::Index(_) => tokens.next() == Some("*"),
        }) && tokens.eq([key])
    }

    /// A difference here.
    pub(super) fn difference(&self, change: Change) -> Difference {
        Difference {
            document: self.document,
            path: self.pointer(),
            change,
        }
    }

    fn pointer(&self) -> String {
        let mut text = String::new();
        for step in &self.steps {
            text.push('/');
            match step {
                Step::Key(key) => text += &key.replace('~', "~0").replace('/', "~1"),
                Step::Index(index) => text += &index.to_string(),
            }
        }
        text
    }
}
