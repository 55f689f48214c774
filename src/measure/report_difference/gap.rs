//! How far two numbers of JSON are apart.

use serde_json::Number;

/// Doubles below this are taken as integers where they are whole: differences of two fit an `i128`.
const WHOLE: f64 = (1u128 << 100) as f64;

/// The difference of two numbers, as an amount and as a share of the larger one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// `|a - b|`; infinite where a double cannot hold it.
    pub absolute: f64,
    /// `|a - b| / max(|a|, |b|)`: 0 for equal numbers, else above 0 and at most 2.
    pub relative: f64,
}

/// The difference of two numbers, whichever way they are written.
///
/// Integers, be they written as `3` or as `3.0`, are subtracted exactly, and a difference that is
/// not 0 never becomes 0.
pub fn gap(a: &Number, b: &Number) -> Gap {
    match (integer(a), integer(b)) {
        (Some(a), Some(b)) if a == b => Gap {
            absolute: 0.0,
            relative: 0.0,
        },
        (Some(a), Some(b)) => {
            let absolute = a.abs_diff(b) as f64;
            let larger = a.unsigned_abs().max(b.unsigned_abs()) as f64;
            Gap {
                absolute,
                relative: absolute / larger,
            }
        }
        _ => doubles(real(a), real(b)),
    }
}

fn doubles(a: f64, b: f64) -> Gap {
    let absolute = (a - b).abs();
    let larger = a.abs().max(b.abs());
    let relative = if absolute.is_finite() {
        absolute / larger
    } else {
        // The signs differ, so nothing cancels.
        (a / larger - b / larger).abs()
    };
    Gap {
        absolute,
        // Equal numbers that are both 0 have no larger one.
        relative: if absolute == 0.0 { 0.0 } else { relative },
    }
}

/// The number as an integer, if it is one of less than 2^100.
fn integer(number: &Number) -> Option<i128> {
    if let Some(value) = number.as_i64() {
        return Some(i128::from(value));
    }
    if let Some(value) = number.as_u64() {
        return Some(i128::from(value));
    }
    let value = real(number);
    (value.fract() == 0.0 && value.abs() < WHOLE).then_some(value as i128)
}

/// The nearest double. Numbers that are read from JSON always have one.
fn real(number: &Number) -> f64 {
    number.as_f64().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn between(a: &str, b: &str) -> [f64; 2] {
        let [a, b] = [a, b].map(|text| serde_json::from_str(text).expect("a number"));
        let (there, back) = (gap(&a, &b), gap(&b, &a));
        assert_eq!(there, back, "{a} {b}");
        [there.absolute, there.relative]
    }

    #[test]
    fn equal_numbers_have_none_however_they_are_written() {
        for (a, b) in [
            ("0", "-0.0"),
            ("3", "3.0"),
            ("1e2", "100"),
            ("18446744073709551615", "18446744073709551615"),
            ("1e300", "1e300"),
            ("5e-324", "5e-324"),
        ] {
            assert_eq!(between(a, b), [0.0, 0.0], "{a} {b}");
        }
    }

    #[test]
    fn integers_are_told_apart_beyond_53_bits() {
        let [absolute, relative] = between("9007199254740993", "9007199254740992.0");
        assert_eq!(absolute, 1.0);
        assert!(relative > 0.0 && relative < 1.2e-16);
        assert_eq!(
            between("18446744073709551615", "18446744073709551614")[0],
            1.0
        );
        let ends = between("18446744073709551615", "-9223372036854775808");
        assert_eq!(ends, [27670116110564327423.0, 1.5]);
    }

    #[test]
    fn the_difference_is_a_share_of_the_larger() {
        assert_eq!(between("1", "2"), [1.0, 0.5]);
        assert_eq!(between("-1.5", "1.5"), [3.0, 2.0]);
        assert_eq!(between("0", "0.25"), [0.25, 1.0]);
        assert_eq!(between("0", "7"), [7.0, 1.0]);
        assert_eq!(between("5e-324", "1e-323"), [5e-324, 0.5]);
        assert_eq!(between("1e308", "-1e308"), [f64::INFINITY, 2.0]);
        assert_eq!(between("1e300", "1"), [1e300, 1.0]);
    }

    #[test]
    fn neighbouring_doubles_differ() {
        for value in [
            5e-324,
            2.2250738585072014e-308,
            1.0,
            0.1,
            1e22,
            1e200,
            f64::MAX,
        ] {
            let below = value.next_down();
            let [absolute, relative] = between(&format!("{value:e}"), &format!("{below:e}"));
            assert_eq!(absolute, value - below);
            assert!(relative > 0.0 && relative <= 1.0, "{value:e}: {relative:e}");
        }
    }
}
