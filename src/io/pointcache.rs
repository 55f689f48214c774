//! What the caches of points share: positions in single precision, frame after frame.

use super::refusal::{RAISE, Refusal, expect_room};
use super::samples::warn_trailing;
use super::source::Source;
use crate::anim::Clip;
use crate::error::Fault;
use crate::numeric::vector::Vec3;
use crate::report::Warning;
use rayon::prelude::*;
use std::io::{self, Write};

/// Bytes of a position.
const RECORD: usize = 12;
/// Positions that one task reads, or that are gathered before they are written.
const TASK: usize = 1 << 13;

/// What a header states of the positions after it.
#[derive(Debug, Clone, Copy)]
pub struct Stated {
    /// Frames.
    pub frames: i32,
    /// The byte that states them.
    pub frames_at: usize,
    /// Vertices of each.
    pub vertices: i32,
    /// The byte that states them.
    pub vertices_at: usize,
    /// The byte where the first position begins.
    pub start: usize,
}

impl Stated {
    /// Bytes of a file that holds this and nothing more; none where a count is not above 0.
    pub fn bytes(&self) -> Option<u128> {
        let positions = u128::from(self.counts().ok()?[0]) * u128::from(self.counts().ok()?[1]);
        Some(self.start as u128 + RECORD as u128 * positions)
    }

    /// Frames and vertices, which are above 0.
    pub fn counts(&self) -> Result<[u64; 2], Fault> {
        let above = |count: i32, at: usize, what: &str| match u64::try_from(count) {
            Ok(count) if count > 0 => Ok(count),
            _ => Err(Fault::byte(at, format!("states {count} {what}"))),
        };
        Ok([
            above(self.frames, self.frames_at, "frames")?,
            above(self.vertices, self.vertices_at, "vertices")?,
        ])
    }

    /// All positions, which `number` makes of four bytes each coordinate; every thread takes a part.
    ///
    /// What is stated is held against the bytes that are there, and against the limit of the source,
    /// before room is made.
    pub fn positions(
        &self,
        source: &Source,
        number: fn([u8; 4]) -> f32,
        warnings: &mut Vec<Warning>,
    ) -> Result<Vec<Vec3>, Refusal> {
        let [frames, vertices] = self.counts()?;
        let bytes = source.bytes();
        let records = bytes.get(self.start..).unwrap_or_default();
        let count = u128::from(frames) * u128::from(vertices);
        let whole = records.len() as u128 / RECORD as u128;
        if whole < count {
            let problem = format!(
                "the file ends after {} of {frames} frames of {vertices} vertices",
                whole / u128::from(vertices)
            );
            return Err(Fault::byte(bytes.len(), problem).into());
        }
        let what = || format!("an animation of {frames} frames of {vertices} vertices");
        let needed = count * size_of::<Vec3>() as u128;
        expect_room(what, needed, source.limit(), RAISE)?;
        // No more than the bytes hold, so it fits.
        let count = count as usize;
        if records.len() > count * RECORD {
            warn_trailing(records.len() - count * RECORD, warnings);
        }
        let mut positions = vec![[0.0; 3]; count];
        positions
            .par_chunks_mut(TASK)
            .zip(records.par_chunks(TASK * RECORD))
            .for_each(|(positions, records)| {
                let coordinates = positions.as_flattened_mut();
                let (words, _) = records.as_chunks::<4>();
                for (to, word) in coordinates.iter_mut().zip(words) {
                    *to = f64::from(number(*word));
                }
            });
        Ok(positions)
    }
}

/// Bytes from `at` on, where there are so many.
pub fn word(bytes: &[u8], at: usize) -> Option<[u8; 4]> {
    bytes.get(at..)?.first_chunk().copied()
}

/// A count that the header states in four bytes; an error where they cannot hold it.
pub fn stated(count: usize, what: &str) -> io::Result<i32> {
    i32::try_from(count).map_err(|_| {
        invalid(format!(
            "{count} {what}, but the format counts up to {}",
            i32::MAX
        ))
    })
}

/// Writes all positions, rounded to single precision. Those beyond it are an error.
pub fn write_positions(
    clip: &Clip,
    bytes_of: fn(f32) -> [u8; 4],
    out: &mut dyn Write,
) -> io::Result<()> {
    if let Some(at) = clip.positions.par_iter().position_first(is_beyond) {
        let (frame, vertex) = (at / clip.vertices(), at % clip.vertices());
        let [x, y, z] = clip.positions[at];
        return Err(invalid(format!(
            "frame {frame}, vertex {vertex} at ({x}, {y}, {z}) is beyond single precision, which \
             the format holds"
        )));
    }
    let mut bytes = Vec::with_capacity(TASK * RECORD);
    for chunk in clip.positions.chunks(TASK) {
        bytes.clear();
        let coordinates = chunk.as_flattened().iter();
        bytes.extend(coordinates.flat_map(|c| bytes_of(*c as f32)));
        out.write_all(&bytes)?;
    }
    Ok(())
}

fn is_beyond(p: &Vec3) -> bool {
    p.iter().any(|c| !(*c as f32).is_finite())
}

/// How many positions change by rounding to single precision, and the first frame that has one.
pub fn rounded(clip: &Clip) -> (u64, Option<u64>) {
    let changes = |p: &Vec3| p.iter().any(|c| f64::from(*c as f32) != *c);
    let count = clip.positions.par_iter().filter(|p| changes(p)).count();
    let first = clip.positions.par_iter().position_first(changes);
    let frame = first.map(|at| (at / clip.vertices().max(1)) as u64);
    (count as u64, frame)
}

fn invalid(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}
