//! What the readers of text formats share: lines, words, numbers.

use crate::error::Fault;
use std::io::{self, Write};

/// Lines with their numbers, counted from 1; their ends (LF, CRLF, or CR alone in a text without
/// any LF) are taken off.
#[derive(Debug, Clone)]
pub struct Lines<'a> {
    rest: Option<&'a [u8]>,
    end: u8,
    number: u64,
}

impl<'a> Lines<'a> {
    /// The lines of a text.
    pub fn new(text: &'a [u8]) -> Self {
        Lines::with_end(text, line_end(text), 0)
    }

    /// The lines of a part of a text that ends its lines with `end`, after `before` lines.
    pub fn with_end(part: &'a [u8], end: u8, before: u64) -> Self {
        Lines {
            rest: Some(part),
            end,
            number: before,
        }
    }

    /// Number of the line given last; 0 before the first.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// How many bytes are still to come.
    pub fn bytes_left(&self) -> usize {
        self.rest.map_or(0, <[u8]>::len)
    }

    /// The next line with anything but blanks in it before a `#`, cut there.
    pub fn next_filled(&mut self) -> Option<&'a [u8]> {
        self.by_ref()
            .map(|line| uncommented(line).trim_ascii())
            .find(|line| !line.is_empty())
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest?;
        if rest.is_empty() {
            self.rest = None;
            return None;
        }
        self.number += 1;
        let line = match rest.iter().position(|b| *b == self.end) {
            Some(at) => {
                self.rest = Some(&rest[at + 1..]);
                &rest[..at]
            }
            None => {
                self.rest = None;
                rest
            }
        };
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

/// The byte that ends a line: LF, or CR where there is no LF.
pub fn line_end(text: &[u8]) -> u8 {
    if text.contains(&b'\n') || !text.contains(&b'\r') {
        b'\n'
    } else {
        b'\r'
    }
}

/// A line up to its first `#`.
pub fn uncommented(line: &[u8]) -> &[u8] {
    match line.iter().position(|b| *b == b'#') {
        Some(at) => &line[..at],
        None => line,
    }
}

/// The words of a line, parted by blanks.
#[derive(Debug, Clone)]
pub struct Words<'a> {
    rest: &'a [u8],
}

/// The words of a line, parted by blanks.
#[inline]
pub fn words(line: &[u8]) -> Words<'_> {
    Words { rest: line }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let blank = |b: &u8| *b <= b' ';
        let start = self.rest.iter().position(|b| !blank(b))?;
        let rest = &self.rest[start..];
        let end = rest.iter().position(blank).unwrap_or(rest.len());
        self.rest = &rest[end..];
        Some(&rest[..end])
    }
}

/// A word as a message shows it: quoted, and cut when long.
pub fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    if word.len() <= LONGEST {
        format!("{:?}", String::from_utf8_lossy(word))
    } else {
        format!("{:?}...", String::from_utf8_lossy(&word[..LONGEST]))
    }
}

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// The nearest 64-bit number to a decimal one; infinite when it is beyond them. `None` when the
/// word is no number.
///
/// Up to 15 digits and small powers of ten are exact as they stand, and one correctly rounded
/// operation finishes them (Clinger 1990); the rest goes to the standard library.
#[inline]
pub fn number(word: &[u8]) -> Option<f64> {
    fast_number(word).or_else(|| std::str::from_utf8(word).ok()?.parse().ok())
}

#[inline]
fn fast_number(word: &[u8]) -> Option<f64> {
    let (negative, mut rest) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, word),
    };
    let mut mantissa = 0u64;
    let mut digits = 0usize;
    let mut power = 0i32;
    let take = |rest: &mut &[u8], mantissa: &mut u64| {
        let before = rest.len();
        while let [digit @ b'0'..=b'9', after @ ..] = *rest {
            *mantissa = mantissa
                .wrapping_mul(10)
                .wrapping_add(u64::from(digit - b'0'));
            *rest = after;
        }
        before - rest.len()
    };
    digits += take(&mut rest, &mut mantissa);
    if let [b'.', after @ ..] = rest {
        rest = after;
        let decimals = take(&mut rest, &mut mantissa);
        digits += decimals;
        power = -i32::try_from(decimals).ok()?;
    }
    // 18 digits fit the mantissa; leading zeros count as digits, which only sends more to the rest.
    if digits == 0 || digits > 18 || mantissa > 1 << 53 {
        return None;
    }
    if let [b'e' | b'E', after @ ..] = rest {
        power += small_integer(after)?;
        rest = &[];
    }
    if !rest.is_empty() || power.unsigned_abs() > 22 {
        return None;
    }
    let ten = POWERS[power.unsigned_abs() as usize];
    let exact = mantissa as f64;
    let value = if power < 0 { exact / ten } else { exact * ten };
    Some(if negative { -value } else { value })
}

fn small_integer(word: &[u8]) -> Option<i32> {
    let (sign, digits) = match word {
        [b'-', rest @ ..] => (-1, rest),
        [b'+', rest @ ..] => (1, rest),
        _ => (1, word),
    };
    if digits.is_empty() || digits.len() > 4 || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let value = digits
        .iter()
        .fold(0, |value, d| 10 * value + i32::from(d - b'0'));
    Some(sign * value)
}

/// A number that is finite.
#[inline]
pub fn finite(word: &[u8], line: u64) -> Result<f64, Fault> {
    match number(word) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(Fault::line(line, format!("{} is not finite", shown(word)))),
        None => Err(Fault::line(
            line,
            format!("{} is not a number", shown(word)),
        )),
    }
}

/// A whole number, with an optional sign; `None` when the word is none, or is beyond 64 bits.
#[inline]
pub fn integer(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, word),
    };
    if digits.is_empty() || digits.len() > 18 || !digits.iter().all(u8::is_ascii_digit) {
        return std::str::from_utf8(word).ok()?.parse().ok();
    }
    let value = digits
        .iter()
        .fold(0i64, |value, d| 10 * value + i64::from(d - b'0'));
    Some(if negative { -value } else { value })
}

/// Three finite numbers.
pub fn triple<'a>(
    words: &mut impl Iterator<Item = &'a [u8]>,
    line: u64,
    what: &str,
) -> Result<[f64; 3], Fault> {
    let mut values = [0.0; 3];
    for (found, value) in values.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| {
            Fault::line(
                line,
                format!("{what} has {found} numbers, but 3 are needed"),
            )
        })?;
        *value = finite(word, line)?;
    }
    Ok(values)
}

/// Appends the shortest decimal that reads back as the same number.
pub fn push_number(text: &mut Vec<u8>, value: f64) {
    let size = value.abs();
    let thousandths = (value * 1e3).round();
    // Most numbers in files have few digits. Of up to 15 each decimal is read as another number, so
    // that these are the shortest.
    if value != 0.0 && size < 1e9 && thousandths / 1e3 == value {
        push_decimal(text, thousandths as i64, 3);
        let digits = text.iter().rev().take_while(|b| **b == b'0').count();
        text.truncate(text.len() - digits);
        if text.last() == Some(&b'.') {
            text.pop();
        }
        return;
    }
    // Writing into a vector does not fail.
    let _ = if size == 0.0 || (1e-5..1e16).contains(&size) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
}

/// Appends a number with so many decimals (at least one, at most 17), of which `value` is the last
/// one's count.
pub fn push_decimal(text: &mut Vec<u8>, value: i64, decimals: usize) {
    let mut digits = [b'0'; 40];
    let mut rest = value.unsigned_abs();
    let mut at = digits.len();
    let point = digits.len() - decimals - 1;
    while rest > 0 || at > point - 1 {
        at -= 1;
        if at == point {
            digits[at] = b'.';
            continue;
        }
        digits[at] = b'0' + (rest % 10) as u8;
        rest /= 10;
    }
    if value < 0 {
        text.push(b'-');
    }
    text.extend_from_slice(&digits[at..]);
}

/// Hands on what was gathered, once it is worth a call.
pub fn spill(text: &mut Vec<u8>, out: &mut dyn Write) -> io::Result<()> {
    const ENOUGH: usize = 1 << 16;
    if text.len() >= ENOUGH {
        out.write_all(text)?;
        text.clear();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn lines_end_in_every_usual_way() {
        let split = |text: &'static str| Lines::new(text.as_bytes()).collect::<Vec<_>>();
        let expected: [&[u8]; 3] = [b"a", b"", b"b"];
        assert_eq!(split("a\n\nb"), expected);
        assert_eq!(split("a\r\n\r\nb\r\n"), expected);
        assert_eq!(split("a\r\rb\r"), expected);
        assert!(split("").is_empty());
        let mut lines = Lines::new(b" # no\n\n x y # z\n");
        assert_eq!(lines.next_filled(), Some(&b"x y"[..]));
        assert_eq!(lines.number(), 3);
        assert_eq!(lines.next_filled(), None);
    }

    #[test]
    fn words_are_parted_by_blanks() {
        let found: Vec<_> = words(b"  f\t1/2 3  ").collect();
        assert_eq!(found, [&b"f"[..], b"1/2", b"3"]);
    }

    #[test]
    fn only_numbers_are_numbers() {
        for word in [
            "", "-", ".", "1e", "e5", "1x", "0x10", "1,5", "1.2.3", "--1", "1e+", "1d3",
        ] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        for (word, value) in [("1.", 1.0), (".5", 0.5), ("+2e3", 2000.0), ("-7E-2", -0.07)] {
            assert_eq!(number(word.as_bytes()), Some(value), "{word}");
        }
        assert!(number(b"-0").is_some_and(|v| v == 0.0 && v.is_sign_negative()));
        assert_eq!(
            finite(b"1e400", 3).unwrap_err().to_string(),
            "3: \"1e400\" is not finite"
        );
        assert!(finite(b"nan", 3).is_err() && finite(b"-inf", 3).is_err());
        for word in ["", "-", "1.0", "9223372036854775808", "1 ", "x"] {
            assert_eq!(integer(word.as_bytes()), None, "{word}");
        }
        assert_eq!(integer(b"-9223372036854775808"), Some(i64::MIN));
        assert_eq!(integer(b"+12"), Some(12));
    }

    proptest! {
        #[test]
        fn numbers_are_rounded_as_the_standard_library_rounds(
            word in "[+-]?[0-9]{0,20}(\\.[0-9]{0,22})?([eE][+-]?[0-9]{1,3})?",
        ) {
            let expected: Option<f64> = word.parse().ok();
            prop_assert_eq!(number(word.as_bytes()).map(f64::to_bits), expected.map(f64::to_bits));
        }

        #[test]
        fn numbers_of_few_digits_are_written_as_by_the_standard_library(
            thousandths in -1_000_000_000_000..1_000_000_000_000i64,
            small in -2000..2000i64,
        ) {
            for count in [thousandths, small, small * 100] {
                let value = count as f64 / 1000.0;
                let [mut text, mut fixed] = [Vec::new(), Vec::new()];
                push_number(&mut text, value);
                push_decimal(&mut fixed, count, 3);
                prop_assert_eq!(String::from_utf8(text).expect("text"), format!("{value}"));
                prop_assert_eq!(String::from_utf8(fixed).expect("text"), format!("{value:.3}"));
            }
        }

        #[test]
        fn numbers_read_back_as_written(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            let mut text = Vec::new();
            push_number(&mut text, value);
            prop_assert!(text.len() <= 24);
            prop_assert_eq!(number(&text).map(f64::to_bits), Some(bits));
        }
    }
}
