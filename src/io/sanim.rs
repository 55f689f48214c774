//! The stream of an animation; see [`crate::anim::compress`].

use super::refusal::{Refusal, expect_room};
use super::source::Source;
use crate::anim::Clip;
use crate::anim::compress::{Stream, room_to_decode, summary};
use crate::report::Warning;

/// Decodes all frames.
///
/// # Errors
///
/// Damage, named by the section; a stream that breaks off before all frames are told, or that takes
/// more than the limit of the source. One that breaks off later is decoded with a warning.
///
/// # Cost
///
/// That of every component at every vertex and frame; 24 bytes of memory a position.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Clip, Refusal> {
    let bytes = source.bytes();
    let told = summary(bytes)?;
    let frames = told.frames as usize;
    let what = || {
        format!(
            "an animation of {frames} frames of {} vertices",
            told.vertices
        )
    };
    let hint = "decode some of its frames, or raise --max-memory";
    expect_room(what, room_to_decode(&told, frames), source.limit(), hint)?;
    let stream = Stream::open(bytes, None)?;
    if let Some(at) = stream.cut_off_at() {
        let message = format!("the stream breaks off at byte {at}; what came before is decoded");
        warnings.push(Warning::new("cut-off", message, 1, None));
    }
    Ok(stream.clip(0..frames)?)
}
