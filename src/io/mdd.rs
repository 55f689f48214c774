//! MDD, the point cache of LightWave, Maya and others.
//!
//! Big endian throughout:
//!
//! | bytes | what |
//! |---|---|
//! | 4 | frames |
//! | 4 | points of every frame |
//! | 4 n | the time of each frame in seconds (f32) |
//! | rest | x, y, z (three f32) of every point of every frame |
//!
//! Nothing at its start tells the format: a file is one where its size is exactly what the two
//! counts ask for. A [`Clip`] has one rate: where the times are not even it is their mean, with a
//! warning. Faces are not in the file: a clip is a cloud until [`Clip::with_base`] gives it some.

use super::pointcache::{Stated, stated, word, write_positions};
use super::refusal::Refusal;
use super::source::Source;
use crate::anim::Clip;
use crate::error::Fault;
use crate::report::{Tally, Warning};
use std::io::{self, Write};

/// Bytes before the times.
const HEADER: usize = 8;
/// How far a time may be from where the mean rate puts it, in frames.
const UNEVEN: f64 = 0.01;

/// Whether the size is what the two counts at the start ask for.
pub fn is_exact(bytes: &[u8]) -> bool {
    let stated = header(bytes).and_then(|stated| stated.bytes());
    stated == Some(bytes.len() as u128)
}

/// What the header states, where it is whole.
fn header(bytes: &[u8]) -> Option<Stated> {
    let frames = i32::from_be_bytes(word(bytes, 0)?);
    Some(Stated {
        frames,
        frames_at: 0,
        vertices: i32::from_be_bytes(word(bytes, 4)?),
        vertices_at: 4,
        start: HEADER.saturating_add(usize::try_from(frames).unwrap_or(0).saturating_mul(4)),
    })
}

/// Reads a cache as a clip without faces.
///
/// # Errors
///
/// A header that is cut short or states no frames or points; fewer times or positions than it
/// states; more than the limit of the source. Times that are not even, do not rise or are no numbers
/// are a warning.
///
/// # Cost
///
/// Linear in the bytes, on all threads; 24 bytes of memory a position.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Clip, Refusal> {
    let bytes = source.bytes();
    let Some(stated) = header(bytes) else {
        let problem = format!("the header of {HEADER} bytes is cut short");
        return Err(Fault::byte(bytes.len(), problem).into());
    };
    let positions = stated.positions(source, f32::from_be_bytes, warnings)?;
    // The positions after the times are there, so the times are.
    let (words, _) = bytes[HEADER..stated.start].as_chunks::<4>();
    let times: Vec<f32> = words.iter().map(|w| f32::from_be_bytes(*w)).collect();
    let (start, rate) = start_and_rate(&times, warnings);
    Ok(Clip::cloud(
        stated.vertices as usize,
        positions,
        start,
        rate,
    ))
}

/// The time of the first frame and the frames per second that fit all times best, with a warning
/// about those they do not fit.
fn start_and_rate(times: &[f32], warnings: &mut Vec<Warning>) -> (f64, f64) {
    let first = times.first().copied().map_or(0.0, f64::from);
    let last = times.last().copied().map_or(0.0, f64::from);
    let start = if first.is_finite() { first } else { 0.0 };
    let steps = times.len().saturating_sub(1) as f64;
    let mean = steps / (last - first);
    let rate = match mean.is_finite() && mean > 0.0 {
        true => whole_rate(times, start, mean).unwrap_or(mean),
        false => Clip::DEFAULT_RATE,
    };
    let mut uneven = Tally::default();
    for (f, time) in times.iter().enumerate() {
        let time = f64::from(*time);
        let off = (time - (start + f as f64 / rate)).abs();
        // Single precision rounds large times by more than that.
        let rounding = f64::from(f32::EPSILON) * time.abs();
        // Written so that a time which is no number is off too.
        let fits = off <= (UNEVEN / rate).max(rounding);
        if !fits {
            uneven.note(f as u64);
        }
    }
    let message = format!("frames at other times than {rate} frames per second put them");
    uneven.warn("uneven-times", message, warnings);
    (start, rate)
}

/// The whole number of frames per second near the mean that gives the very times of the file, which
/// are rounded, if there is one.
fn whole_rate(times: &[f32], start: f64, mean: f64) -> Option<f64> {
    let whole = mean.round();
    let is_it = |(f, time): (usize, &f32)| (start + f as f64 / whole) as f32 == *time;
    (whole > 0.0 && times.iter().enumerate().all(is_it)).then_some(whole)
}

/// Writes the positions of a clip, rounded to single precision, and the times of its frames; faces
/// have no place in the file.
///
/// A coordinate beyond single precision is an error, as are more than 2^31 - 1 vertices or frames.
pub fn write(clip: &Clip, out: &mut dyn Write) -> io::Result<()> {
    let (vertices, frames) = (clip.vertices(), clip.frames());
    out.write_all(&stated(frames, "frames")?.to_be_bytes())?;
    out.write_all(&stated(vertices, "vertices")?.to_be_bytes())?;
    for f in 0..frames {
        let time = clip.start + f as f64 / clip.rate;
        out.write_all(&(time as f32).to_be_bytes())?;
    }
    write_positions(clip, f32::to_be_bytes, out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(bytes: Vec<u8>) -> Result<(Clip, Vec<Warning>), Fault> {
        let source = Source::from_bytes("a.mdd", bytes).expect("a source");
        let mut warnings = Vec::new();
        let clip = read(&source, &mut warnings).map_err(Refusal::fault)?;
        clip.check()?;
        Ok((clip, warnings))
    }

    fn file(vertices: i32, times: &[f32]) -> Vec<u8> {
        let mut bytes = (times.len() as i32).to_be_bytes().to_vec();
        bytes.extend(vertices.to_be_bytes());
        bytes.extend(times.iter().flat_map(|t| t.to_be_bytes()));
        let numbers = 0..3 * vertices * times.len() as i32;
        bytes.extend(numbers.flat_map(|i| (i as f32).to_be_bytes()));
        bytes
    }

    #[test]
    fn frames_and_times_are_as_the_file_has_them() {
        let times = [0.5, 0.5 + 1.0 / 30.0, 0.5 + 2.0 / 30.0];
        let (clip, warnings) = parse(file(2, &times)).expect("a clip");
        assert_eq!((clip.vertices(), clip.frames()), (2, 3));
        assert_eq!(clip.frame(2), [[12.0, 13.0, 14.0], [15.0, 16.0, 17.0]]);
        assert_eq!((clip.start, clip.rate), (0.5, 30.0));
        assert!(clip.mesh.is_cloud() && warnings.is_empty());
    }

    #[test]
    fn times_that_are_not_even_are_counted() {
        let read = |times: &[f32]| {
            let (clip, warnings) = parse(file(1, times)).expect("a clip");
            let warning = warnings.first().map(|w| (w.count, w.first));
            (clip.start, clip.rate, warning)
        };
        assert_eq!(read(&[0.0, 1.0, 3.0, 4.0]), (0.0, 0.75, Some((2, Some(1)))));
        assert_eq!(read(&[7.0]), (7.0, Clip::DEFAULT_RATE, None));
        // Times that stand still or fall tell no rate.
        let still = read(&[2.0, 2.0, 2.0]);
        assert_eq!(still, (2.0, Clip::DEFAULT_RATE, Some((2, Some(1)))));
        assert_eq!(read(&[1.0, 0.0]).1, Clip::DEFAULT_RATE);
        let none = read(&[f32::NAN, 0.0]);
        assert_eq!((none.0, none.1), (0.0, Clip::DEFAULT_RATE));
        assert_eq!(none.2.map(|w| w.1), Some(Some(0)));
        // Rounding of large times is none of the file's.
        let far: Vec<f32> = (0..100)
            .map(|f| (1e5 + f64::from(f) / 29.97) as f32)
            .collect();
        assert_eq!(read(&far).2, None);
    }

    #[test]
    fn the_exact_size_tells_the_format() {
        let bytes = file(2, &[0.0, 1.0]);
        assert!(is_exact(&bytes));
        assert!(!is_exact(&bytes[..bytes.len() - 1]));
        assert!(!is_exact(&[]) && !is_exact(&[0; 8]));
        assert!(!is_exact(b"solid of some length"));
    }

    #[test]
    fn headers_that_claim_more_than_is_there_are_refused() {
        let mut bytes = file(2, &[0.0, 1.0, 2.0]);
        bytes.truncate(8 + 12 + 24 + 5);
        let fault = parse(bytes).expect_err("a fault");
        assert_eq!(
            fault.problem,
            "the file ends after 1 of 3 frames of 2 vertices"
        );
        for bytes in [
            vec![0x7f; 8],
            vec![0x7f; 7],
            vec![0xff; 100],
            file(2, &[])[..8].to_vec(),
        ] {
            assert!(parse(bytes).is_err());
        }
    }

    proptest! {
        #[test]
        fn what_is_written_comes_back(
            vertices in 1usize..20,
            frames in 2usize..40,
            start in -10.0f32..10.0,
            rate in 1u32..120,
        ) {
            let number = |i: usize| f64::from((i as f32).sin());
            let positions = (0..vertices * frames)
                .map(|i| [number(3 * i), number(3 * i + 1), number(3 * i + 2)])
                .collect();
            let clip = Clip::cloud(vertices, positions, f64::from(start), f64::from(rate));
            let mut bytes = Vec::new();
            write(&clip, &mut bytes).unwrap();
            prop_assert!(is_exact(&bytes));
            let (back, warnings) = parse(bytes).unwrap();
            prop_assert!(warnings.is_empty());
            prop_assert_eq!(back, clip);
        }

        #[test]
        fn any_bytes_are_read_or_refused(
            changes in prop::collection::vec((0usize..100, any::<u8>()), 1..5),
            cut in 0usize..100,
        ) {
            let mut bytes = file(2, &[0.0, 0.5]);
            let length = bytes.len();
            for (at, byte) in changes {
                bytes[at % length] = byte;
            }
            bytes.truncate(length - cut % length);
            let _ = parse(bytes);
        }
    }
}
