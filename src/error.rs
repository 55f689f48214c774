//! What can go wrong, said with the place and the numbers.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// The result of everything that can fail in this library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Where in a file or a geometry something is wrong. Indices count from 0, lines from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// The file or geometry as a whole.
    Whole,
    /// A line of a text file.
    Line(u64),
    /// A byte offset into a file (after decompression).
    Byte(u64),
    /// A numbered element: `("face", 12)` is face 12.
    Element(&'static str, u64),
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            At::Whole => Ok(()),
            At::Line(line) => write!(f, "{line}"),
            At::Byte(byte) => write!(f, "byte {byte}"),
            At::Element(kind, index) => write!(f, "{kind} {index}"),
        }
    }
}

/// A fault in data, before it is known which file the data came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Where it is.
    pub at: At,
    /// What is wrong, with the numbers.
    pub problem: String,
    /// The way out, where there is one.
    pub hint: Option<String>,
}

impl Fault {
    /// A fault at a place.
    pub fn new(at: At, problem: impl Into<String>) -> Self {
        Fault {
            at,
            problem: problem.into(),
            hint: None,
        }
    }

    /// A fault at a line (counted from 1).
    pub fn line(line: u64, problem: impl Into<String>) -> Self {
        Fault::new(At::Line(line), problem)
    }

    /// A fault at a byte offset.
    pub fn byte(byte: usize, problem: impl Into<String>) -> Self {
        Fault::new(At::Byte(byte as u64), problem)
    }

    /// A fault at a numbered element.
    pub fn element(kind: &'static str, index: usize, problem: impl Into<String>) -> Self {
        Fault::new(At::Element(kind, index as u64), problem)
    }

    /// A fault of the whole file.
    pub fn whole(problem: impl Into<String>) -> Self {
        Fault::new(At::Whole, problem)
    }

    /// The same fault with a way out.
    pub fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            At::Whole => f.write_str(&self.problem),
            at => write!(f, "{at}: {}", self.problem),
        }
    }
}

/// A number as messages say it: the shortest digits that read back, with an exponent where those
/// would be many zeros.
pub fn number(value: f64) -> String {
    let text = format!("{value:?}");
    match text.strip_suffix(".0") {
        Some(whole) => whole.to_owned(),
        None => text,
    }
}

/// Everything this library refuses or fails at.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that cannot be opened or read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file whose content is not what its format asks for.
    #[error("{}:{}{fault}", path.display(), if fault.at == At::Whole { " " } else { "" })]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong and where.
        fault: Fault,
    },
    /// Geometry that an algorithm cannot work with.
    #[error("{0}")]
    Geometry(Fault),
    /// A parameter out of its range, or in conflict with another.
    #[error("--{option} {value}: {problem}")]
    Parameter {
        /// The long option, without dashes.
        option: &'static str,
        /// The value as given.
        value: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Work refused because it would go over a stated limit.
    #[error("{what} needs {needed}, over the limit of {limit}")]
    Limit {
        /// What was about to be made.
        what: String,
        /// How much it needs, with its unit.
        needed: String,
        /// How much it may have, with its unit.
        limit: String,
        /// The way out.
        hint: Option<String>,
    },
    /// A file that cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

impl Error {
    /// A parameter error.
    pub fn parameter(
        option: &'static str,
        value: impl fmt::Display,
        problem: impl Into<String>,
    ) -> Self {
        Error::Parameter {
            option,
            value: value.to_string(),
            problem: problem.into(),
        }
    }

    /// A refusal over a limit of `limit` bytes.
    pub fn over_memory(
        what: impl Into<String>,
        needed: u128,
        limit: u64,
        hint: Option<&str>,
    ) -> Self {
        Error::Limit {
            what: what.into(),
            needed: format!("{needed} bytes"),
            limit: format!("{limit} bytes"),
            hint: hint.map(str::to_owned),
        }
    }

    /// The second line of the message: the way out, where there is one.
    pub fn hint(&self) -> Option<&str> {
        match self {
            Error::Malformed { fault, .. } | Error::Geometry(fault) => fault.hint.as_deref(),
            Error::Limit { hint, .. } => hint.as_deref(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let said = [0.0, 1.0, -2.5, 1e-300, 1e300, 0.1 + 0.2, f64::INFINITY].map(number);
        let wanted = [
            "0",
            "1",
            "-2.5",
            "1e-300",
            "1e300",
            "0.30000000000000004",
            "inf",
        ];
        assert_eq!(said, wanted);
    }

    #[test]
    fn a_message_names_file_place_and_numbers() {
        let malformed = |fault| Error::Malformed {
            path: "a.obj".into(),
            fault,
        };
        assert_eq!(
            malformed(Fault::line(7, "no such vertex 9")).to_string(),
            "a.obj:7: no such vertex 9"
        );
        assert_eq!(
            malformed(Fault::element("face", 3, "two corners")).to_string(),
            "a.obj:face 3: two corners"
        );
        assert_eq!(
            malformed(Fault::whole("no faces")).to_string(),
            "a.obj: no faces"
        );
    }
}
