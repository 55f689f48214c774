//! The options that mean the same in every command that has them.
//!
//! A command flattens the groups it needs; none is defined anywhere else.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, value_parser};
use scantle::io::format::Format;
use scantle::render::view::MOST_PIXELS;

const IN_AND_OUT: &str = "Input and output";
const REPORT: &str = "Report";
const MACHINE: &str = "Machine";
const TALK: &str = "Messages";

/// Any number of inputs, each worked on alone.
#[derive(Debug, Args)]
pub struct Inputs {
    /// Files to read; `-` for standard input
    #[arg(value_name = "INPUT", required = true)]
    pub inputs: Vec<String>,
    #[command(flatten)]
    pub format: InputFormat,
}

/// The format of what is read.
#[derive(Debug, Args)]
pub struct InputFormat {
    /// Format of the input, where its first bytes and its name do not tell
    #[arg(long, value_name = "FORMAT", value_parser = readable(), hide_possible_values = true, help_heading = IN_AND_OUT)]
    pub input_format: Option<Format>,
}

/// What becomes of points that are none.
#[derive(Debug, Args)]
pub struct SkipBad {
    /// Leave out points of clouds that have a number which is not finite; a warning counts them
    #[arg(long, help_heading = IN_AND_OUT)]
    pub skip_bad: bool,
}

/// Where the result goes.
#[derive(Debug, Args)]
pub struct Output {
    /// Write the result here, in the format of the extension; `-` for standard output
    ///
    /// Without it only the report is made. An existing file is replaced in one step, when all is
    /// written. With several inputs this is a folder (`out/`) or a pattern with `{stem}`, the
    /// input's name without folder and extension.
    #[arg(short, long, value_name = "FILE", help_heading = IN_AND_OUT)]
    pub output: Option<String>,
    /// Format of the output, where its name does not tell: a name from `scantle formats`
    #[arg(long, value_name = "FORMAT", requires = "output", value_parser = writable(), hide_possible_values = true, help_heading = IN_AND_OUT)]
    pub output_format: Option<Format>,
}

/// A picture of the result.
#[derive(Debug, Args)]
pub struct Preview {
    /// Draw what was made, as a PNG picture
    ///
    /// With several inputs this is a folder (`out/`) or a pattern with `{stem}`.
    #[arg(long, value_name = "FILE", help_heading = IN_AND_OUT)]
    pub preview: Option<String>,
}

/// A check of the error that was made.
#[derive(Debug, Args)]
pub struct MaxError {
    /// Exit with 1 when the error reached is larger than X, in the unit of the report's `accuracy`
    #[arg(long, value_name = "X", value_parser = not_negative, help_heading = REPORT)]
    pub max_error: Option<f64>,
}

/// A measurement of the error against an exact reference.
#[derive(Debug, Args)]
pub struct Verify {
    /// Measure the error against the exact reference, which is slow, and not only its bound
    #[arg(long, help_heading = REPORT)]
    pub verify: bool,
}

/// What random numbers are drawn from.
#[derive(Debug, Args)]
pub struct Seed {
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

/// Where the report goes.
#[derive(Debug, Args)]
pub struct ReportTo {
    /// Write the JSON report here; `-` for standard output, where it goes by itself
    #[arg(long, value_name = "FILE", help_heading = REPORT)]
    pub report: Option<String>,
}

/// How much is said on standard error.
#[derive(Debug, Args)]
pub struct Talk {
    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = TALK)]
    pub quiet: bool,
    /// Say what was read and how long each stage took
    #[arg(short, long, help_heading = TALK)]
    pub verbose: bool,
}

/// What every command that reads files has.
#[derive(Debug, Args)]
pub struct Common {
    #[command(flatten)]
    pub report: ReportTo,
    /// Add the `run` block to the report: seconds, threads, memory, and the seconds of each stage
    #[arg(long, help_heading = REPORT)]
    pub timings: bool,
    /// Worker threads; 0 for all. Never changes a byte of any output
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = value_parser!(u16).range(..=1024), help_heading = MACHINE)]
    pub threads: u16,
    /// Refuse to take more memory than this, such as 2GiB or 500MB; by default 80 % of what is free
    #[arg(long, value_name = "SIZE", value_parser = size, help_heading = MACHINE)]
    pub max_memory: Option<u64>,
    #[command(flatten)]
    pub talk: Talk,
}

/// What the commands have that run another one.
#[derive(Debug, Args)]
pub struct Wrapping {
    /// The command to run
    #[arg(value_name = "COMMAND")]
    pub command: String,
    /// What it reads, and its options
    #[arg(value_name = "INPUT")]
    pub words: Vec<String>,
    /// Run it in this process rather than in a fresh one each time: faster to start, but memory
    /// that an earlier run has touched is warm
    #[arg(long)]
    pub in_process: bool,
    /// Draw the table here, as an SVG or PNG picture: the extension says which
    #[arg(long, value_name = "FILE", help_heading = IN_AND_OUT)]
    pub plot: Option<String>,
    /// Write the table here too, as comma-separated values (RFC 4180)
    #[arg(long, value_name = "FILE", help_heading = IN_AND_OUT)]
    pub csv: Option<String>,
    #[command(flatten)]
    pub report: ReportTo,
    #[command(flatten)]
    pub talk: Talk,
}

fn readable() -> impl TypedValueParser<Value = Format> {
    one_of(Format::all().filter(|format| format.is_read()))
}

fn writable() -> impl TypedValueParser<Value = Format> {
    one_of(Format::all().filter(|format| format.is_written()))
}

fn one_of(formats: impl Iterator<Item = Format>) -> impl TypedValueParser<Value = Format> {
    let names: Vec<&'static str> = formats.map(Format::name).collect();
    PossibleValuesParser::new(names)
        .map(|name| Format::from_name(&name).expect("the parser knows only names of formats"))
}

/// One of a list of names, as the value that it stands for.
pub fn named<T: Clone + Send + Sync + 'static>(
    names: &'static [&'static str],
    value: fn(&str) -> Option<T>,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names)
        .try_map(move |name| value(&name).ok_or("not a name in the list"))
}

/// What a word names; `wanted` says what it may be.
pub fn parsed<T: Clone + Send + Sync + 'static>(
    value: fn(&str) -> Option<T>,
    wanted: &'static str,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |word| value(word).ok_or_else(|| format!("not {wanted}"))
}

/// `N` finite numbers with commas between them.
pub fn list<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|word| word.trim().parse()).collect();
    let numbers = numbers.map_err(|_| "has something that is no number".to_owned())?;
    let count = numbers.len();
    numbers
        .try_into()
        .map_err(|_| format!("has {count} numbers, not {N}"))
}

/// Columns and rows of a picture: two numbers with an `x` between them.
pub fn picture_size(text: &str) -> Result<[u32; 2], String> {
    let side = |word: &str| word.parse().ok().filter(|n| (1..=MOST_PIXELS).contains(n));
    let sides = text.split_once('x').map(|(w, h)| (side(w), side(h)));
    match sides {
        Some((Some(width), Some(height))) => Ok([width, height]),
        _ => Err(format!(
            "not two numbers from 1 to {MOST_PIXELS} such as 1024x768"
        )),
    }
}

/// A finite number that is 0 or more.
pub fn not_negative(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if number.is_finite() && number >= 0.0 {
        Ok(number)
    } else {
        Err("must be finite and not negative".to_owned())
    }
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    match not_negative(text) {
        Ok(number) if number > 0.0 => Ok(number),
        Ok(_) => Err("must be finite and above 0".to_owned()),
        Err(problem) => Err(problem),
    }
}

/// A number of bytes: `2GiB`, `500MB`, `1e9`.
pub fn size(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, f64); 9] = [
        ("KiB", 1024.0),
        ("MiB", 1_048_576.0),
        ("GiB", 1_073_741_824.0),
        ("TiB", 1_099_511_627_776.0),
        ("kB", 1e3),
        ("MB", 1e6),
        ("GB", 1e9),
        ("TB", 1e12),
        ("B", 1.0),
    ];
    let unit = UNITS.iter().find(|(name, _)| text.ends_with(name));
    let (name, factor) = unit.copied().unwrap_or(("", 1.0));
    let number = text[..text.len() - name.len()].trim_end();
    let bytes = number.parse::<f64>().map(|number| number * factor);
    match bytes {
        Ok(bytes) if bytes >= 1.0 && bytes < u64::MAX as f64 => Ok(bytes as u64),
        Ok(_) => Err("must be at least one byte, and less than 16 EiB".to_owned()),
        Err(_) => Err("not a size such as 2GiB, 500MB or 1e9".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_in_both_kinds_of_units() {
        assert_eq!(size("2GiB"), Ok(2 << 30));
        assert_eq!(size("500MB"), Ok(500_000_000));
        assert_eq!(size("1.5 KiB"), Ok(1536));
        assert_eq!(size("1e9"), Ok(1_000_000_000));
        assert_eq!(size("7B"), Ok(7));
        for wrong in [
            "", "GiB", "2G", "2gib", "-1", "0", "nan", "inf", "1e30", "ß",
        ] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn lists_have_their_length() {
        assert_eq!(list::<3>("1,-2.5, 4e1"), Ok([1.0, -2.5, 40.0]));
        assert_eq!(list::<2>("1,2,3"), Err("has 3 numbers, not 2".to_owned()));
        assert!(list::<2>("1,x").is_err());
    }

    #[test]
    fn a_tolerance_is_finite_and_not_negative() {
        assert_eq!(not_negative("0.5"), Ok(0.5));
        for wrong in ["-1", "nan", "inf", "x"] {
            assert!(not_negative(wrong).is_err(), "{wrong}");
        }
    }
}
