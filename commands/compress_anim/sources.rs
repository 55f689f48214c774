//! Animations as they are named: caches, folders, patterns and lists of frames, glTF, streams.

use crate::job::Job;
use scantle::anim::Clip;
use scantle::anim::compress::{Stream, is_stream};
use scantle::error::{Error, Fault, Result};
use scantle::io::format::{self, Format, Kind};
use scantle::io::source::Source;
use scantle::io::{self, sequence};
use scantle::mesh::Mesh;
use scantle::report::{Input, Warning};
use std::path::PathBuf;

/// How animations are read.
#[derive(Debug, Clone, Copy)]
pub struct Sampling<'a> {
    /// Frames per second, where a file names none or is sampled.
    pub rate: Option<f64>,
    /// The animation of a glTF file.
    pub animation: Option<&'a str>,
}

/// What reading gives.
pub type Read = Result<(Clip, Vec<Input>, Vec<Warning>)>;

/// Whether words are the frames of one animation, one mesh each.
pub fn are_frames(words: &[String]) -> bool {
    let is_mesh = |word: &String| {
        let extension = PathBuf::from(word)
            .extension()
            .map(|e| e.to_ascii_lowercase());
        let format = extension.and_then(|e| Format::from_extension(e.to_str()?));
        format.is_some_and(|f| f.kind() == Kind::Mesh && !matches!(f, Format::Gltf | Format::Glb))
    };
    words.len() > 1 && words.iter().all(is_mesh)
}

/// Reads the next input as an animation; `base` has its faces, where the file has none.
pub fn read(job: &mut Job, sampling: Sampling, base: Option<&str>) -> Result<Clip> {
    let clip = if are_frames(job.words()) {
        let paths: Vec<PathBuf> = job.words().iter().map(PathBuf::from).collect();
        job.read_beside(|memory| sequence::read(&paths, None, sampling.rate(), memory))?
    } else {
        read_one(job, sampling)?
    };
    let Some(path) = base else {
        return Ok(clip);
    };
    let mesh = job.read_beside(|memory| {
        let source = Source::open(path, memory)?;
        let (mesh, input, warnings) = io::read_mesh(&source, None)?;
        Ok((mesh, vec![input], warnings))
    })?;
    with_base(clip, mesh, path)
}

/// The animation with the faces of a mesh that was read from `path`.
pub fn with_base(clip: Clip, mesh: Mesh, path: &str) -> Result<Clip> {
    clip.with_base(mesh).map_err(|fault| Error::Malformed {
        path: path.into(),
        fault,
    })
}

impl Sampling<'_> {
    fn rate(&self) -> f64 {
        self.rate.unwrap_or(Clip::DEFAULT_RATE)
    }
}

/// Reads what a word names as an animation, holding at most `memory` bytes at once.
pub fn animation(word: &str, format: Option<Format>, sampling: Sampling, memory: u64) -> Read {
    if word != "-" && sequence::is_sequence(word) {
        let paths = sequence::find(word, format)?;
        return sequence::read(&paths, format, sampling.rate(), memory);
    }
    let source = Source::open(word, memory)?;
    let bytes = source.bytes();
    let found = format.or_else(|| format::sniff(bytes, source.extension()).ok());
    let (mut clip, input, warnings) = match found {
        Some(Format::Gltf | Format::Glb) => {
            io::read_gltf_clip(&source, found, sampling.rate(), sampling.animation)?
        }
        Some(format) if format.kind() == Kind::Mesh => {
            let problem = "is one mesh; an animation of files for each frame is a folder, a pattern \
                           such as 'frame*.obj', or several files";
            return Err(Error::Malformed {
                path: word.into(),
                fault: Fault::whole(problem),
            });
        }
        _ => io::read_animation(&source, format)?,
    };
    if let Some(rate) = sampling.rate {
        clip.rate = rate;
    }
    Ok((clip, vec![input], warnings))
}

/// Reads the next of several inputs, each of which is an animation of its own.
pub fn read_one(job: &mut Job, sampling: Sampling) -> Result<Clip> {
    job.read_as(|word, format, memory| animation(word, format, sampling, memory))
}

/// Reads the next input as the bytes of a stream.
pub fn read_stream(job: &mut Job) -> Result<(Vec<u8>, String)> {
    job.read_as(|word, _, memory| {
        let source = Source::open(word, memory)?;
        if !is_stream(source.bytes()) {
            let problem = "is no stream of `compress-anim encode`: it does not begin with SANIM";
            return Err(malformed(word, Fault::byte(0, problem)));
        }
        let bytes = source.bytes().to_vec();
        let input = Input {
            path: source.name().to_owned(),
            format: Format::Sanim.name().to_owned(),
            bytes: source.stored_bytes(),
            sha256: source.sha256(),
            content: Default::default(),
        };
        Ok(((bytes, word.to_owned()), vec![input], Vec::new()))
    })
}

/// What is wrong with a file.
pub fn malformed(word: &str, fault: Fault) -> Error {
    Error::Malformed {
        path: word.into(),
        fault,
    }
}

/// The warning of a stream that is cut off, if it is.
pub fn cut(stream: &Stream) -> Vec<Warning> {
    let at = stream.cut_off_at();
    let said = at.map(|at| {
        let message = format!("the stream breaks off at byte {at}; what came before is decoded");
        Warning::new("cut-off", message, 1, None)
    });
    said.into_iter().collect()
}
