//! Numbers in few columns: decimal as far as they go, then in base 36.
//!
//! Width 4: -999 to 9999, then A000 (10000) to ZZZZ, then a000 (1223056) to zzzz (2436111).
//! Width 5: -9999 to 99999, then A0000 (100000) to ZZZZZ, then a0000 to zzzzz (87440031).
//! Source: R. W. Grosse-Kunstleve, "Hybrid-36", Computational Crystallography Toolbox, 2007.

/// The number that a word of `width` columns says; `None` where it is no number.
///
/// A word of five columns or more that begins with a digit and has letters up to f is hexadecimal, as
/// VMD and NAMD count on after 99999.
pub fn read(word: &[u8], width: u32) -> Option<i64> {
    let upper = word
        .iter()
        .all(|b| b.is_ascii_uppercase() || b.is_ascii_digit());
    let lower = word
        .iter()
        .all(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
    match word.first()? {
        first if first.is_ascii_alphabetic() => {
            if word.len() as u32 != width || !(upper || lower) {
                return None;
            }
            let value = in_base(word, 36)?;
            Some(value + offset(width, lower))
        }
        b'0'..=b'9' if word.len() >= 5 && word.iter().any(u8::is_ascii_alphabetic) => {
            in_base(word, 16)
        }
        _ => super::text::integer(word),
    }
}

/// The word of a number, at most `width` columns; `None` where it does not fit.
pub fn write(number: i64, width: u32) -> Option<String> {
    let decimal = 10i64.pow(width);
    if number > -decimal / 10 && number < decimal {
        return Some(number.to_string());
    }
    let letters = |lower: bool| -> Option<String> {
        let value = number.checked_sub(offset(width, lower))?;
        let digit = |place: u32| {
            let digit = value / 36i64.pow(place) % 36;
            char::from_digit(digit as u32, 36)
                .map(|c| if lower { c } else { c.to_ascii_uppercase() })
        };
        let in_reach = value < 36i64.pow(width) && value >= 10 * 36i64.pow(width - 1);
        in_reach.then(|| (0..width).rev().map(digit).collect())?
    };
    letters(false).or_else(|| letters(true))
}

/// What is added to the value in base 36.
fn offset(width: u32, lower: bool) -> i64 {
    let first = 36i64.pow(width - 1);
    let before = if lower { 16 * first } else { -10 * first };
    10i64.pow(width) + before
}

fn in_base(word: &[u8], base: u32) -> Option<i64> {
    word.iter().try_fold(0i64, |value, b| {
        let digit = char::from(*b).to_digit(base)?;
        value
            .checked_mul(i64::from(base))?
            .checked_add(i64::from(digit))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_follow_the_last_decimal() {
        for (word, width, number) in [
            ("9999", 4, 9999),
            ("A000", 4, 10000),
            ("A00Z", 4, 10035),
            ("ZZZZ", 4, 1_223_055),
            ("a000", 4, 1_223_056),
            ("zzzz", 4, 2_436_111),
            ("-999", 4, -999),
            ("99999", 5, 99999),
            ("A0000", 5, 100_000),
            ("ZZZZZ", 5, 43_770_015),
            ("a0000", 5, 43_770_016),
            ("zzzzz", 5, 87_440_031),
        ] {
            assert_eq!(read(word.as_bytes(), width), Some(number), "{word}");
            assert_eq!(write(number, width).as_deref(), Some(word), "{number}");
        }
        assert_eq!(read(b"186a0", 5), Some(100_000));
        for word in [
            "", "A00", "A00a0", "Aa000", "*****", "1.5", "1g", "A00-0", "52A", "1 0a0",
        ] {
            assert_eq!(read(word.as_bytes(), 5), None, "{word}");
        }
        for number in [87_440_032, -10_000, i64::MAX, i64::MIN] {
            assert_eq!(write(number, 5), None, "{number}");
        }
    }

    #[test]
    fn all_numbers_of_four_columns_are_read_back() {
        for number in (-999..2_436_112).step_by(7) {
            let word = write(number, 4).expect("it fits");
            assert_eq!(read(word.as_bytes(), 4), Some(number), "{word}");
        }
    }
}
