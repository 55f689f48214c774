//! `scantle compress-anim decode`: from a stream to an animation.

use super::sources::{self, malformed};
use super::{Asked as AnyAsked, Found as AnyFound, NAME};
use crate::context::{Context, Files};
use crate::destination::FRAME;
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, Output};
use crate::words;
use scantle::anim::Clip;
use scantle::anim::compress::{self, Stream, summary};
use scantle::error::{Error, Result};
use scantle::io::format::{Format, Kind};
use scantle::report::Modelled;
use schemars::JsonSchema;
use serde::Serialize;
use std::ops::Range;

/// Make an animation of a stream, or of some of its frames
///
/// As a cache of points (PC2, MDD), a GLB of morph targets that browsers play, or a mesh file for
/// each frame where the output has `{frame}`. Only the windows that hold the frames are decoded. A
/// stream that was cut off is decoded as far as it goes, with a warning.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// The frames from A on and before B, counted from 0; either may be left out
    #[arg(long, value_name = "A:B", value_parser = frames)]
    frames: Option<Frames>,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
Examples:
  scantle compress-anim decode fixtures/animations/wave.sanim -o wave.glb
  scantle compress-anim decode fixtures/animations/wave.sanim --frames 2:5 -o wave-{frame}.obj
";

/// A range of frames, as it was given.
#[derive(Debug, Clone, Copy)]
pub struct Frames {
    from: usize,
    to: Option<usize>,
}

fn frames(text: &str) -> Result<Frames, String> {
    let (from, to) = text
        .split_once(':')
        .ok_or("not two numbers with a colon between them")?;
    let number = |text: &str| {
        text.parse::<usize>()
            .map_err(|_| format!("`{text}` is no number"))
    };
    let from = if from.is_empty() { 0 } else { number(from)? };
    let to = if to.is_empty() {
        None
    } else {
        Some(number(to)?)
    };
    match to {
        Some(to) if to <= from => Err(format!("there is no frame from {from} on and before {to}")),
        _ => Ok(Frames { from, to }),
    }
}

impl Frames {
    /// The range, of which all frames must be there.
    fn among(self, all: usize) -> Result<Range<usize>> {
        let range = self.from..self.to.unwrap_or(all);
        if range.start < all && range.end <= all {
            return Ok(range);
        }
        let to = self.to.map_or(String::new(), |to| to.to_string());
        let problem = match all {
            1 => "there is only frame 0".to_owned(),
            _ => format!("there are only the frames from 0 to {}", all - 1),
        };
        let value = format!("{}:{to}", self.from);
        Err(Error::parameter("frames", value, problem))
    }
}

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The first frame and the one after the last.
    frames: [u64; 2],
}

/// What was decoded.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// Vertices of every frame.
    vertices: u64,
    /// Frames that were decoded.
    frames: u64,
    /// Faces.
    faces: u64,
    /// Frames per second.
    rate: f64,
}

/// Decodes each stream.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let files = Files::each(&args.inputs)
        .output(&args.output)
        .several(Some(FRAME));
    context.run(NAME, &files, |job| decode(job, args))
}

fn decode(job: &mut Job, args: &Args) -> Result<Found<AnyAsked, AnyFound>> {
    expect_output(job)?;
    let (bytes, word) = sources::read_stream(job)?;
    let told = summary(&bytes).map_err(|fault| malformed(&word, fault))?;
    let all = told.frames as usize;
    let range = args.frames.map_or(Ok(0..all), |asked| asked.among(all))?;
    let count = range.len();
    job.expect_room(
        "decoding the stream",
        compress::room_to_decode(&told, count),
    )?;
    if job.is_pattern(FRAME) {
        job.expect_each(FRAME, range.clone().map(|f| padded(f, all)))?;
    }
    job.progress().stage("decode", 0);
    let stream = Stream::open(&bytes, Some(range.clone())).map_err(|f| malformed(&word, f))?;
    job.warn(sources::cut(&stream));
    let clip = stream
        .clip(range.clone())
        .map_err(|f| malformed(&word, f))?;
    write(job, &clip, &range, all)?;
    let stats = Stats {
        vertices: clip.vertices() as u64,
        frames: count as u64,
        faces: clip.mesh.face_count() as u64,
        rate: clip.rate,
    };
    let summary = {
        let some = words::frames(stats.frames, stats.vertices);
        match count == all {
            true => some,
            false => format!("{some}, from frame {} of {all}", range.start),
        }
    };
    let asked = AnyAsked::Decode(Asked {
        frames: [range.start as u64, range.end as u64],
    });
    let windows =
        range.end.div_ceil(told.windows[1] as usize) - range.start / told.windows[1] as usize;
    let modelled = Modelled::new(
        "windows",
        windows as u64,
        told.windows[0],
        bytes.len() as u64,
    );
    Ok(Found::new(asked, AnyFound::Decode(stats), summary).modelled(modelled))
}

/// Refuses, before any work, an output that holds no animation.
fn expect_output(job: &Job) -> Result<()> {
    if job.is_pattern(FRAME) {
        return job.expect_output(&[Kind::Mesh]);
    }
    job.expect_output(&[Kind::Animation, Kind::Mesh])?;
    match job.output_format().filter(|f| f.kind() == Kind::Mesh) {
        // The only meshes that hold more than one frame.
        None | Some(Format::Gltf | Format::Glb) => Ok(()),
        Some(_) => Err(job.wrong_output(format!(
            "holds one mesh; for a file for each frame the name must have {FRAME} in it"
        ))),
    }
}

/// The number of a frame, as wide as that of the last.
fn padded(frame: usize, all: usize) -> String {
    let width = all.saturating_sub(1).to_string().len();
    format!("{frame:0width$}")
}

fn write(job: &mut Job, clip: &Clip, range: &Range<usize>, all: usize) -> Result<()> {
    if !job.is_pattern(FRAME) {
        return job.write_animation(clip);
    }
    for (i, frame) in range.clone().enumerate() {
        job.write_each(FRAME, &padded(frame, all), &clip.mesh_at(i))?;
    }
    Ok(())
}
