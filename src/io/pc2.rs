//! PC2, the point cache of 3ds Max, Blender and others.
//!
//! Little endian throughout:
//!
//! | bytes | what |
//! |---|---|
//! | 12 | `POINTCACHE2` and a byte 0 |
//! | 4 | version, 1 |
//! | 4 | points of every sample |
//! | 4 | start (f32): the number of the frame of the first sample |
//! | 4 | sample rate (f32): frames from one sample to the next |
//! | 4 | samples |
//! | rest | x, y, z (three f32) of every point of every sample |
//!
//! A sample is a frame of the [`Clip`]. The file counts time in frames of a scene and does not say
//! how long one lasts: it is taken to be of [`Clip::DEFAULT_RATE`] frames per second, so the clip
//! starts at `start / DEFAULT_RATE` seconds and has `DEFAULT_RATE / sample rate` frames per second.
//! Faces are not in the file: a clip is a cloud until [`Clip::with_base`] gives it some.

use super::pointcache::{Stated, stated, word, write_positions};
use super::refusal::Refusal;
use super::source::Source;
use crate::anim::Clip;
use crate::error::Fault;
use crate::report::Warning;
use std::io::{self, Write};

/// First bytes.
pub const MAGIC: &[u8] = b"POINTCACHE2\0";
const VERSION: i32 = 1;
/// Bytes before the positions.
const HEADER: usize = 32;

/// Reads a cache as a clip without faces.
///
/// # Errors
///
/// A header that is cut short, of another version, or without points or samples; fewer positions
/// than it states; more than the limit of the source. A start or sample rate that is none is a
/// warning: 0 and 1 are taken.
///
/// # Cost
///
/// Linear in the bytes, on all threads; 24 bytes of memory a position.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Clip, Refusal> {
    let bytes = source.bytes();
    if !bytes.starts_with(MAGIC) {
        return Err(Fault::byte(0, "does not begin with \"POINTCACHE2\"").into());
    }
    if bytes.len() < HEADER {
        let problem = format!("the header of {HEADER} bytes is cut short");
        return Err(Fault::byte(bytes.len(), problem).into());
    }
    let word = |at| word(bytes, at).unwrap_or_default();
    let version = i32::from_le_bytes(word(12));
    if version != VERSION {
        let problem = format!("version {version} is not known, only {VERSION}");
        return Err(Fault::byte(12, problem).into());
    }
    let stated = Stated {
        vertices: i32::from_le_bytes(word(16)),
        vertices_at: 16,
        frames: i32::from_le_bytes(word(28)),
        frames_at: 28,
        start: HEADER,
    };
    let positions = stated.positions(source, f32::from_le_bytes, warnings)?;
    let [start, step] = [20, 24].map(|at| f64::from(f32::from_le_bytes(word(at))));
    let start = start_or_zero(start, warnings);
    let step = step_or_one(step, warnings);
    let rate = Clip::DEFAULT_RATE;
    Ok(Clip::cloud(
        stated.vertices as usize,
        positions,
        start / rate,
        rate / step,
    ))
}

fn start_or_zero(start: f64, warnings: &mut Vec<Warning>) -> f64 {
    if start.is_finite() {
        return start;
    }
    let message = format!("a start of {start} is no number of a frame; 0 is taken");
    warnings.push(Warning::new("start-unknown", message, 1, None));
    0.0
}

fn step_or_one(step: f64, warnings: &mut Vec<Warning>) -> f64 {
    if step.is_finite() && step > 0.0 {
        return step;
    }
    let message = format!("a sample rate of {step} frames is none; 1 is taken");
    warnings.push(Warning::new("rate-unknown", message, 1, None));
    1.0
}

/// Writes the positions of a clip, rounded to single precision; faces have no place in the file.
///
/// Start and rate are counted in frames of [`Clip::DEFAULT_RATE`] a second. A coordinate beyond
/// single precision is an error, as are more than 2^31 - 1 vertices or frames.
pub fn write(clip: &Clip, out: &mut dyn Write) -> io::Result<()> {
    let (vertices, frames) = (clip.vertices(), clip.frames());
    out.write_all(MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&stated(vertices, "vertices")?.to_le_bytes())?;
    let rate = Clip::DEFAULT_RATE;
    for number in [clip.start * rate, rate / clip.rate] {
        out.write_all(&(number as f32).to_le_bytes())?;
    }
    out.write_all(&stated(frames, "frames")?.to_le_bytes())?;
    write_positions(clip, f32::to_le_bytes, out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(bytes: Vec<u8>) -> Result<(Clip, Vec<Warning>), Fault> {
        let source = Source::from_bytes("a.pc2", bytes).expect("a source");
        let mut warnings = Vec::new();
        let clip = read(&source, &mut warnings).map_err(Refusal::fault)?;
        clip.check()?;
        Ok((clip, warnings))
    }

    fn header(vertices: i32, start: f32, step: f32, frames: i32) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(1i32.to_le_bytes());
        bytes.extend(vertices.to_le_bytes());
        bytes.extend(start.to_le_bytes());
        bytes.extend(step.to_le_bytes());
        bytes.extend(frames.to_le_bytes());
        bytes
    }

    fn file(vertices: i32, start: f32, step: f32, frames: i32) -> Vec<u8> {
        let mut bytes = header(vertices, start, step, frames);
        let numbers = 0..3 * vertices * frames;
        bytes.extend(numbers.flat_map(|i| (i as f32).to_le_bytes()));
        bytes
    }

    #[test]
    fn frames_and_times_are_as_the_header_states() {
        let (clip, warnings) = parse(file(2, 12.0, 0.5, 3)).expect("a clip");
        assert_eq!((clip.vertices(), clip.frames()), (2, 3));
        assert_eq!(clip.frame(1), [[6.0, 7.0, 8.0], [9.0, 10.0, 11.0]]);
        assert_eq!((clip.start, clip.rate), (0.5, 48.0));
        assert!(clip.mesh.is_cloud() && warnings.is_empty());
    }

    #[test]
    fn headers_that_claim_more_than_is_there_are_refused() {
        let said = |bytes| {
            let fault = parse(bytes).expect_err("a fault");
            crate::error::Error::Malformed {
                path: "a".into(),
                fault,
            }
            .to_string()
        };
        let mut short = file(2, 0.0, 1.0, 3);
        short.truncate(32 + 24 + 23);
        assert_eq!(
            said(short),
            "a:byte 79: the file ends after 1 of 3 frames of 2 vertices"
        );
        assert_eq!(
            said(header(i32::MAX, 0.0, 1.0, i32::MAX)),
            "a:byte 32: the file ends after 0 of 2147483647 frames of 2147483647 vertices"
        );
        assert_eq!(
            said(header(-2, 0.0, 1.0, 3)),
            "a:byte 16: states -2 vertices"
        );
        assert_eq!(said(header(2, 0.0, 1.0, 0)), "a:byte 28: states 0 frames");
        assert_eq!(
            said(header(2, 0.0, 1.0, 3)[..31].to_vec()),
            "a:byte 31: the header of 32 bytes is cut short"
        );
        let mut broken = file(2, 0.0, 1.0, 3);
        broken[32 + 4 * 13..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(
            said(broken),
            "a:frame 2: vertex 0: coordinates (12, NaN, 14) are not finite"
        );
    }

    #[test]
    fn what_looks_wrong_is_warned_of() {
        let mut bytes = file(1, f32::NAN, 0.0, 2);
        bytes.push(0);
        let (clip, warnings) = parse(bytes).expect("a clip");
        let codes: Vec<_> = warnings.iter().map(|w| w.code.as_str()).collect();
        assert_eq!(codes, ["trailing-bytes", "start-unknown", "rate-unknown"]);
        assert_eq!((clip.start, clip.rate), (0.0, 24.0));
    }

    #[test]
    fn a_clip_over_the_limit_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.pc2");
        std::fs::write(&path, file(10, 0.0, 1.0, 10)).expect("a file");
        let open = |limit| Source::open(path.to_str().expect("a name"), limit).expect("a source");
        let refusal = read(&open(2399), &mut Vec::new()).expect_err("a refusal");
        assert!(
            matches!(refusal, Refusal::OverMemory { needed: 2400, .. }),
            "{refusal:?}"
        );
        assert!(read(&open(2400), &mut Vec::new()).is_ok());
    }

    proptest! {
        #[test]
        fn what_is_written_comes_back(
            vertices in 1usize..20,
            frames in 1usize..9,
            start in -1e6f32..1e6,
            step in 1e-3f32..1e3,
            seed in prop::collection::vec(any::<f32>().prop_filter("finite", |c| c.is_finite()), 27),
        ) {
            let number = |i: usize| f64::from(seed[i % 27]);
            let positions = (0..vertices * frames)
                .map(|i| [number(3 * i), number(3 * i + 1), number(3 * i + 2)])
                .collect();
            let rate = Clip::DEFAULT_RATE;
            let clip = Clip::cloud(vertices, positions, f64::from(start) / rate, rate / f64::from(step));
            let mut bytes = Vec::new();
            write(&clip, &mut bytes).unwrap();
            let (back, warnings) = parse(bytes.clone()).unwrap();
            prop_assert!(warnings.is_empty());
            prop_assert_eq!(&back, &clip);
            let mut again = Vec::new();
            write(&back, &mut again).unwrap();
            prop_assert_eq!(again, bytes);
        }

        #[test]
        fn any_bytes_are_read_or_refused(
            changes in prop::collection::vec((0usize..100, any::<u8>()), 1..5),
            cut in 0usize..100,
        ) {
            let mut bytes = file(2, 0.0, 1.0, 2);
            let length = bytes.len();
            for (at, byte) in changes {
                bytes[at % length] = byte;
            }
            bytes.truncate(length - cut % length);
            let _ = parse(bytes);
        }
    }
}
