//! STAR, the syntax of CIF: words, quoted words, blocks of text.
//!
//! Source: S. R. Hall and N. Spadaccini, "The STAR File", J. Chem. Inf. Comput. Sci. 34, 1994, as CIF 1.1
//! restricts it: no nested loops.

use crate::error::Fault;
use crate::io::text::{line_end, shown};

/// A part of a STAR text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Token<'a> {
    /// `data_NAME`: a block begins.
    Block(&'a [u8]),
    /// `loop_`: names follow, and then rows of their values.
    Loop,
    /// Any other reserved word.
    Other,
    /// `_name`.
    Tag(&'a [u8]),
    /// A value; `None` where it is `?` or `.`, which stand for none.
    Value(Option<&'a [u8]>),
}

/// The parts of a text, in order, with the lines they begin in.
#[derive(Debug, Clone)]
pub struct Tokens<'a> {
    text: &'a [u8],
    at: usize,
    /// The byte that ends lines, and how many have ended before `at`.
    end: u8,
    lines: u64,
    /// Line of the token given last, counted from 1.
    line: u64,
}

fn is_blank(byte: u8) -> bool {
    byte <= b' '
}

impl<'a> Tokens<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        Tokens {
            text,
            at: 0,
            end: line_end(text),
            lines: 0,
            line: 1,
        }
    }

    /// Line of the token given last, counted from 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// The next token. Errs where a quote or a block of text does not end.
    #[inline]
    pub fn next(&mut self) -> Result<Option<Token<'a>>, Fault> {
        self.skip_blanks();
        self.line = self.lines + 1;
        let Some(first) = self.text.get(self.at) else {
            return Ok(None);
        };
        let starts_line = self.at == 0 || matches!(self.text[self.at - 1], b'\n' | b'\r');
        match first {
            b'\'' | b'"' => self.quoted(*first).map(Some),
            b';' if starts_line => self.block().map(Some),
            _ => Ok(Some(self.word())),
        }
    }

    /// The next token, which is not taken.
    #[inline]
    pub fn peek(&self) -> Result<Option<Token<'a>>, Fault> {
        self.clone().next()
    }

    #[inline]
    fn skip_blanks(&mut self) {
        while let Some(byte) = self.text.get(self.at) {
            if *byte == b'#' {
                let rest = &self.text[self.at..];
                let length = rest.iter().position(|b| *b == self.end);
                self.at += length.unwrap_or(rest.len());
            } else if is_blank(*byte) {
                self.lines += u64::from(*byte == self.end);
                self.at += 1;
            } else {
                return;
            }
        }
    }

    #[inline]
    fn word(&mut self) -> Token<'a> {
        let rest = &self.text[self.at..];
        let length = rest.iter().position(|b| is_blank(*b)).unwrap_or(rest.len());
        let word = &rest[..length];
        self.at += length;
        match word {
            b"?" | b"." => Token::Value(None),
            [b'_', ..] => Token::Tag(word),
            _ => reserved(word).unwrap_or(Token::Value(Some(word))),
        }
    }

    /// A quote ends where a blank follows it, on its own line.
    fn quoted(&mut self, quote: u8) -> Result<Token<'a>, Fault> {
        let from = self.at + 1;
        let mut at = from;
        while let Some(byte) = self.text.get(at) {
            if *byte == quote && self.text.get(at + 1).is_none_or(|next| is_blank(*next)) {
                self.at = at + 1;
                return Ok(Token::Value(Some(&self.text[from..at])));
            }
            if matches!(byte, b'\n' | b'\r') {
                break;
            }
            at += 1;
        }
        let problem = format!(
            "the quote {} does not end on its line",
            shown(&self.text[from - 1..at])
        );
        Err(Fault::line(self.line, problem))
    }

    /// Lines after a `;` that begins one, up to another.
    fn block(&mut self) -> Result<Token<'a>, Fault> {
        let from = self.at + 1;
        let mut at = from;
        while let Some(length) = self.text[at..].iter().position(|b| *b == self.end) {
            at += length + 1;
            self.lines += 1;
            if self.text.get(at) == Some(&b';') {
                self.at = at + 1;
                return Ok(Token::Value(Some(&self.text[from..at - 1])));
            }
        }
        let problem = "the block of text that begins here does not end: no line begins with \";\"";
        Err(Fault::line(self.line, problem))
    }
}

#[inline]
fn reserved(word: &[u8]) -> Option<Token<'_>> {
    // All of them have it as their fifth or a later byte, and few values have it at all.
    if word.len() < 5 || !word[4..].contains(&b'_') {
        return None;
    }
    let begins = |start: &[u8]| {
        let head = word.get(..start.len());
        head.is_some_and(|head| head.eq_ignore_ascii_case(start))
    };
    let is = |whole: &[u8]| word.eq_ignore_ascii_case(whole);
    if begins(b"data_") {
        Some(Token::Block(&word[5..]))
    } else if is(b"loop_") {
        Some(Token::Loop)
    } else if begins(b"save_") || is(b"stop_") || is(b"global_") {
        Some(Token::Other)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Result<Vec<(u64, Token<'_>)>, Fault> {
        let mut tokens = Tokens::new(text.as_bytes());
        let mut found = Vec::new();
        while let Some(token) = tokens.next()? {
            found.push((tokens.line(), token));
        }
        Ok(found)
    }

    fn value(text: &str) -> Token<'_> {
        Token::Value(Some(text.as_bytes()))
    }

    #[test]
    fn words_quotes_and_blocks_are_told_apart() {
        let text = "# a comment\ndata_1ABC loop_\n_a.b\n1 'O5'x y' \"C'\" ? . '?'\n;two\nlines\n;\nx#y\nSAVE_z";
        let expected = [
            (2, Token::Block(b"1ABC")),
            (2, Token::Loop),
            (3, Token::Tag(b"_a.b")),
            (4, value("1")),
            (4, value("O5'x y")),
            (4, value("C'")),
            (4, Token::Value(None)),
            (4, Token::Value(None)),
            (4, value("?")),
            (5, value("two\nlines")),
            (8, value("x#y")),
            (9, Token::Other),
        ];
        assert_eq!(all(text).expect("tokens"), expected);
        for end in ["\r\n", "\r"] {
            let text = text.replace('\n', end);
            let lines: Vec<u64> = all(&text).expect("tokens").iter().map(|t| t.0).collect();
            assert_eq!(lines, expected.map(|(line, _)| line), "{end:?}");
        }
    }

    #[test]
    fn what_does_not_end_is_named_where_it_begins() {
        let message = |text| all(text).expect_err("a fault").to_string();
        assert_eq!(
            message("a\n'b\nc'"),
            "2: the quote \"'b\" does not end on its line"
        );
        assert_eq!(
            message("a\n;b\nc\n"),
            "2: the block of text that begins here does not end: no line begins with \";\""
        );
    }
}
