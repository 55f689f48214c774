//! Text headers in front of binary data: lines with their numbers and offsets, and numbers in them.

use crate::error::Fault;
use std::borrow::Cow;
use std::fmt::Write as _;

/// The lines of a header, and where the bytes after them begin.
#[derive(Debug, Clone)]
pub struct Lines<'a> {
    bytes: &'a [u8],
    offset: usize,
    number: u64,
}

impl<'a> Lines<'a> {
    /// The lines from the first byte on.
    pub fn new(bytes: &'a [u8]) -> Self {
        Lines {
            bytes,
            offset: 0,
            number: 0,
        }
    }

    /// Offset of the first byte after the lines taken so far.
    pub fn offset(&self) -> usize {
        self.offset
    }

    /// Number of the line taken last, from 1.
    pub fn number(&self) -> u64 {
        self.number
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (u64, Cow<'a, str>);

    /// The next line with its number from 1, without its end (`\n` or `\r\n`).
    fn next(&mut self) -> Option<Self::Item> {
        let rest = self.bytes.get(self.offset..).filter(|r| !r.is_empty())?;
        let end = rest.iter().position(|b| *b == b'\n');
        let line = &rest[..end.unwrap_or(rest.len())];
        self.offset += end.map_or(rest.len(), |end| end + 1);
        self.number += 1;
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        Some((self.number, String::from_utf8_lossy(line)))
    }
}

/// A value of a header with the line it stands in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// The name as it stands in the file.
    pub name: String,
    /// The value, trimmed.
    pub text: String,
    /// Its line, from 1.
    pub line: u64,
}

impl Field {
    /// A fault at the line of this field: its name, then the problem.
    pub fn fault(&self, problem: impl std::fmt::Display) -> Fault {
        Fault::line(self.line, format!("{}: {problem}", self.name))
    }

    /// The value as `count` numbers separated by spaces.
    pub fn list<T: std::str::FromStr>(&self, count: usize, what: &str) -> Result<Vec<T>, Fault> {
        let words: Vec<_> = self.text.split_whitespace().collect();
        if words.len() != count {
            return Err(self.fault(format!("{} values, but {count} are needed", words.len())));
        }
        words
            .iter()
            .map(|word| {
                word.parse()
                    .map_err(|_| self.fault(format!("{:?} is not {what}", excerpt(word))))
            })
            .collect()
    }

    /// The value as one number.
    pub fn one<T: std::str::FromStr>(&self, what: &str) -> Result<T, Fault> {
        self.text
            .parse()
            .map_err(|_| self.fault(format!("{:?} is not {what}", excerpt(&self.text))))
    }
}

/// The start of a text that may be of any length, for a message.
pub fn excerpt(text: &str) -> String {
    const SHOWN: usize = 40;
    if text.chars().count() <= SHOWN {
        text.to_owned()
    } else {
        text.chars().take(SHOWN).chain("...".chars()).collect()
    }
}

/// A number in the fewest digits that read back as the same number.
pub fn shortest(value: f64) -> String {
    // The debug form switches to an exponent where digits would run on; the plain form does not.
    let mut text = format!("{value:?}");
    if text.ends_with(".0") {
        text.truncate(text.len() - 2);
    }
    text
}

/// Numbers in their shortest form with a separator between them.
pub fn join(values: &[f64], separator: &str) -> String {
    let mut text = String::new();
    for (i, value) in values.iter().enumerate() {
        let between = if i == 0 { "" } else { separator };
        let _ = write!(text, "{between}{}", shortest(*value));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_know_where_they_end() {
        let mut lines = Lines::new(b"a\r\nbc\n\xff");
        assert_eq!(lines.next(), Some((1, "a".into())));
        assert_eq!(lines.offset(), 3);
        assert_eq!(lines.next(), Some((2, "bc".into())));
        assert_eq!(lines.offset(), 6);
        assert_eq!(lines.next(), Some((3, "\u{fffd}".into())));
        assert_eq!(lines.next(), None);
    }

    #[test]
    fn numbers_keep_every_bit() {
        for value in [0.0, 1.0, -2.5, 0.1, 1e300, 5e-324, 1.0 / 3.0, 123456789.125] {
            assert_eq!(shortest(value).parse::<f64>(), Ok(value));
        }
        assert_eq!(join(&[1.0, 0.5, -3.0], ","), "1,0.5,-3");
        assert_eq!(shortest(1e300), "1e300");
    }
}
