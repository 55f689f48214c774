//! Writing a sequence.

use crate::anim::Clip;
use crate::error::{Error, Result};
use crate::io::format::Format;
use crate::io::sink::Sink;
use crate::io::write_mesh;
use crate::report::{Output, Warning};
use std::fs;
use std::path::{Path, PathBuf};

/// What stands for the number of the frame in a pattern.
const FRAME: &str = "{frame}";

/// The files that a clip of so many frames goes to: those of a pattern with `{frame}`, or
/// `frame{frame}` with the extension of the format in a folder.
///
/// Numbers count from 0 and are filled with zeros to the width of the last. Errs for what is neither
/// a folder (there, or with `/` at its end) nor a pattern.
pub fn places(word: &str, format: Format, frames: usize) -> Result<Vec<PathBuf>> {
    let is_folder = word.ends_with('/') || Path::new(word).is_dir();
    let pattern = if word.contains(FRAME) {
        word.to_owned()
    } else if is_folder {
        let name = format!("frame{FRAME}.{}", format.extensions()[0]);
        Path::new(word).join(name).display().to_string()
    } else {
        let problem = format!(
            "one place for {frames} frames of {} files; name a folder (out/) or use {FRAME}",
            format.name()
        );
        return Err(Error::parameter("output", word, problem));
    };
    let width = frames.saturating_sub(1).to_string().len();
    let place = |f: usize| PathBuf::from(pattern.replace(FRAME, &format!("{f:0width$}")));
    Ok((0..frames).map(place).collect())
}

/// Writes each frame of a clip as a mesh file; see [`places`] for their names.
///
/// A folder is made where its name ends in `/`. Every file is whole or not there, as
/// [`Sink::write`] has it; where one cannot be written, those before it stay. Returns a line for the
/// report for each, and the warnings that every frame has alike once.
pub fn write(clip: &Clip, word: &str, format: Format) -> Result<(Vec<Output>, Vec<Warning>)> {
    let places = places(word, format, clip.frames())?;
    let folder = places.first().and_then(|place| place.parent());
    if let Some(folder) = folder.filter(|_| word.ends_with('/')) {
        fs::create_dir_all(folder).map_err(|source| Error::Write {
            path: folder.to_owned(),
            source,
        })?;
    }
    let (mut outputs, mut warnings) = (Vec::with_capacity(places.len()), Vec::new());
    for (f, place) in places.into_iter().enumerate() {
        let (output, said) = write_mesh(&clip.mesh_at(f), &Sink::File(place), format)?;
        outputs.extend(output);
        for warning in said {
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
    }
    Ok((outputs, warnings))
}
