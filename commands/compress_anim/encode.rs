//! `scantle compress-anim encode`: from an animation to a stream.

use super::picture;
use super::sources::{self, Sampling};
use super::{Asked as AnyAsked, Found as AnyFound, NAME};
use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Preview, Verify, named, positive};
use crate::table::short;
use crate::words;
use clap::{ArgGroup, value_parser};
use scantle::anim::Clip;
use scantle::anim::compress::{
    self, Allocate, Encoder, Frame, Ground, Made, Method, Params, Rounding, Stream, Target,
};
use scantle::error::{Error, Result, number};
use scantle::io::format::{Format, Kind};
use scantle::measure::animation_error::{AnimationError, Meter};
use scantle::report::Modelled;
use schemars::JsonSchema;
use serde::Serialize;

/// Make a stream of an animation
///
/// An animation is a cache of points (PC2, MDD) with a mesh of its faces, a glTF file, or a mesh file
/// for each frame: a folder, a pattern in quotes ('frame*.obj', 'frame%04d.obj') or several files.
/// Every stream is decoded again, and the error in the report is that of what came out.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER, group = ArgGroup::new("target"))]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// A mesh with the faces of the animation, for caches of points
    #[arg(long, value_name = "MESH")]
    base: Option<String>,
    /// Frames per second: glTF is sampled so often, and other files are said to be played so [default:
    /// what the file says, else 24]
    #[arg(long, value_name = "F", value_parser = positive)]
    fps: Option<f64>,
    /// The animation of a glTF file, by its name or number [default: the first]
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// Most error, in percent of frames drawn together to their centroids (Karni and Gotsman)
    /// [default: 0.1]
    #[arg(long, value_name = "PERCENT", value_parser = positive, group = "target")]
    target_kg: Option<f64>,
    /// Most error, as the root of the mean squared distance of a vertex, in the file's unit
    #[arg(long, value_name = "X", value_parser = positive, group = "target")]
    target_rmse: Option<f64>,
    /// Most distance of any vertex in any frame, in the file's unit
    #[arg(long, value_name = "X", value_parser = positive, group = "target")]
    target_max: Option<f64>,
    /// Most bits per vertex and frame, without those of the faces
    #[arg(long, value_name = "B", value_parser = positive, group = "target")]
    target_bpvf: Option<f64>,
    /// How motion is told: `trajectory`, components of all trajectories with weights over the mesh;
    /// `delta`, each frame from the one before; `auto`, the shorter of the two; `rlpca`, the paper's:
    /// clusters that move with frames of reference, and components in each; `lpca`, the clusters without
    /// frames; `pca`, components of all vertices together
    #[arg(long, default_value = Params::DEFAULT.method.name(), value_parser = named(Method::NAMES, Method::from_name))]
    method: Method,
    /// Frames that are told together, at most: what a range of frames is decoded by
    #[arg(long, value_name = "N", default_value_t = Params::DEFAULT.window as u16, value_parser = value_parser!(u16).range(1..=1024))]
    window: u16,
    /// Clusters for `rlpca` and `lpca`: a number, or `auto` for the one of 4 to 30 that is shortest
    #[arg(long, value_name = "N", default_value = "auto", value_parser = clusters)]
    clusters: Count,
    /// Components of every cluster for `rlpca`, `lpca` and `pca`, or as many in all as that makes,
    /// instead of a target
    #[arg(long, value_name = "L", value_parser = value_parser!(u16).range(1..), group = "target")]
    components: Option<u16>,
    /// Bits of the numbers of components for `rlpca`, `lpca` and `pca`, over the largest side of the
    /// animation [default: those that suit the target, or 12 with --components]
    #[arg(long, value_name = "Q", value_parser = value_parser!(u32).range(2..=24))]
    bits: Option<u32>,
    /// The triangles that carry frames of reference: `seed`, that of the mesh a cluster grew from;
    /// `wide`, three of its vertices far apart, which tremble less
    #[arg(long, default_value = Frame::Wide.name(), value_parser = named(Frame::NAMES, Frame::from_name))]
    frame: Frame,
    /// How components are shared out between clusters: `rd`, by the error that a bit takes off;
    /// `paper`, by what a component takes off; `uniform`, the same number for each
    #[arg(long, default_value = Allocate::RateDistortion.name(), value_parser = named(Allocate::NAMES, Allocate::from_name))]
    allocate: Allocate,
    /// How numbers of components are rounded: `balanced`, all to make the same error; `ranges`, as in the
    /// paper, each cluster's over their range
    #[arg(long, default_value = Rounding::Balanced.name(), value_parser = named(Rounding::NAMES, Rounding::from_name))]
    rounding: Rounding,
    /// Report the whole curve of bits and errors too: a stream for each of ten errors from 0.02 to 2 %
    #[arg(long)]
    ladder: bool,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    preview: Preview,
    #[command(flatten)]
    max_error: MaxError,
    #[command(flatten)]
    verify: Verify,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
The first measure of `accuracy`, which --max-error checks, is the error of Karni and Gotsman about
the centroids, in percent; it is always measured on what is decoded, with --verify or without.

Examples:
  scantle compress-anim encode fixtures/animations/wave.pc2 --base fixtures/animations/wave.obj
  scantle compress-anim encode fixtures/animations/bar-skin.glb --target-max 0.001 -o bar.sanim
";

/// The errors of the ladder, in percent.
const LADDER: [f64; 10] = [2.0, 1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 0.07, 0.04, 0.02];

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The mesh with the faces.
    base: Option<String>,
    /// Frames per second, where they were given.
    fps: Option<f64>,
    /// The animation of a glTF file, where it was named.
    animation: Option<String>,
    /// How the motion is told.
    method: String,
    /// What decides the accuracy: the name of the option.
    target: String,
    /// Its value.
    target_value: f64,
    /// Frames that are told together, at most.
    window: u64,
    /// Clusters, null where several numbers are tried.
    clusters: Option<u64>,
    /// Components of every cluster, where they stand for a target.
    components: Option<u64>,
    /// Bits of the numbers of components, null where they are chosen.
    bits: Option<u32>,
    /// The triangles that carry frames of reference.
    frame: String,
    /// How components are shared out.
    allocate: String,
    /// How numbers of components are rounded.
    rounding: String,
}

/// What a stream became.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// Vertices of every frame.
    vertices: u64,
    /// Frames.
    frames: u64,
    /// Bytes of the stream.
    bytes: u64,
    /// Bits per vertex and frame.
    bpvf: Bpvf,
    /// What was made on the way.
    #[serde(flatten)]
    made: compress::Stats,
    /// The error of Karni and Gotsman about the centroids that the encoder expected, in percent.
    predicted_kg_centroid_percent: Option<f64>,
    /// The errors of what is decoded.
    error: AnimationError,
    /// Bits and errors from coarse to fine, with `--ladder`.
    #[serde(skip_serializing_if = "Option::is_none")]
    ladder: Option<Vec<Rung>>,
}

/// Bits per vertex and frame.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Bpvf {
    /// All but the faces.
    geometry: f64,
    /// The whole stream. Raw coordinates of four bytes take 96.
    total: f64,
    /// By what they tell.
    by_part: compress::Bits,
}

/// A stream of the ladder.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Rung {
    /// The error asked for, in percent.
    target_kg: f64,
    /// How the motion is told.
    method: String,
    /// Bits per vertex and frame, without the faces.
    bpvf_geometry: f64,
    /// Bits per vertex and frame.
    bpvf_total: f64,
    /// The error of Karni and Gotsman about the centroids, in percent.
    kg_centroid_percent: Option<f64>,
    /// The same about the means over time.
    kg_mean_percent: Option<f64>,
    /// Root of the mean squared distance of a vertex.
    rmse: f64,
    /// Largest distance.
    max_error: f64,
    /// Components of all windows.
    components: u64,
}

/// A number of clusters, none where several are tried.
#[derive(Debug, Clone, Copy)]
pub struct Count(Option<usize>);

fn clusters(text: &str) -> Result<Count, String> {
    match text.parse::<usize>() {
        _ if text == "auto" => Ok(Count(None)),
        Ok(count @ 1..=4096) => Ok(Count(Some(count))),
        _ => Err("not `auto`, nor a number from 1 to 4096".to_owned()),
    }
}

impl Args {
    /// Errs where what is asked for has no meaning together.
    fn check(&self) -> Result<()> {
        let clustered = self.method.space().is_some();
        if let Some(components) = self.components.filter(|_| !clustered) {
            let problem = format!(
                "--method {} finds its own components; rlpca, lpca and pca take a number of them",
                self.method.name()
            );
            return Err(Error::parameter("components", components, problem));
        }
        Ok(())
    }

    fn target(&self) -> Target {
        let Args {
            target_kg,
            target_rmse,
            target_max,
            target_bpvf,
            ..
        } = *self;
        target_kg
            .map(Target::Kg)
            .or(target_rmse.map(Target::Rmse))
            .or(target_max.map(Target::Max))
            .or(target_bpvf.map(Target::Bpvf))
            .unwrap_or(Params::DEFAULT.target)
    }

    fn params(&self) -> Params {
        Params {
            method: self.method,
            target: self.target(),
            window: usize::from(self.window),
            clusters: compress::Clusters {
                count: self.clusters.0,
                components: self.components.map(usize::from),
                bits: self.bits,
                frame: self.frame,
                allocate: self.allocate,
                rounding: self.rounding,
            },
        }
    }
}

/// Makes the stream of each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    args.check()?;
    let files = match sources::are_frames(&args.inputs.inputs) {
        true => Files::together(&args.inputs.inputs, &args.inputs.format),
        false => Files::each(&args.inputs),
    };
    let files = files
        .reads("base", &args.base)
        .output(&args.output)
        .preview(&args.preview);
    context.run(NAME, &files, |job| encode(job, args))
}

fn encode(job: &mut Job, args: &Args) -> Result<Found<AnyAsked, AnyFound>> {
    job.expect_output(&[Kind::Animation])?;
    if let Some(format) = job
        .output_format()
        .filter(|format| *format != Format::Sanim)
    {
        let problem = "is no stream: the result is written as sanim";
        return Err(Error::parameter("output-format", format.name(), problem));
    }
    let sampling = Sampling {
        rate: args.fps,
        animation: args.animation.as_deref(),
    };
    let clip = sources::read(job, sampling, args.base.as_deref())?;
    let params = args.params();
    job.expect_room("coding the animation", compress::room(&clip, &params))?;
    let ground = Ground::new(&clip.mesh)?;
    let encoder = Encoder::new(&clip, &ground, &params, job.progress())?;
    let made = encoder.make(params.target, job.progress())?;
    job.progress().stage("verify", 0);
    let error = measured(&clip, &made)?;
    if let Target::Max(bound) = params.target
        && error.max_error.distance > bound
    {
        return Err(out_of_reach(&clip, bound));
    }
    let ladder = args.ladder.then(|| ladder(&clip, &encoder, job));
    let ladder = ladder.transpose()?;
    job.write_bytes(&made.bytes)?;
    let summary = summary(&clip, &made, &error);
    job.write_preview(|_| picture::of_stream(&clip, &made.bytes, &error, &summary));
    let stats = stats(&clip, &encoder, &made, error, ladder);
    let accuracy = stats.error.accuracy(compress::TRADE.reference);
    let modelled = modelled(&clip, &made);
    let asked = AnyAsked::Encode(Box::new(Asked {
        base: args.base.clone(),
        fps: args.fps,
        animation: args.animation.clone(),
        method: params.method.name().to_owned(),
        target: params.target.option().to_owned(),
        target_value: params.target.value(),
        window: params.window as u64,
        clusters: params.clusters.count.map(|count| count as u64),
        components: params.clusters.components.map(|count| count as u64),
        bits: params.clusters.bits,
        frame: params.clusters.frame.name().to_owned(),
        allocate: params.clusters.allocate.name().to_owned(),
        rounding: params.clusters.rounding.name().to_owned(),
    }));
    Ok(
        Found::new(asked, AnyFound::Encode(Box::new(stats)), summary)
            .accuracy(accuracy)
            .modelled(modelled)
            .check("max-error", args.max_error.max_error),
    )
}

/// The error of a bound below what coordinates are held to.
fn out_of_reach(clip: &Clip, bound: f64) -> Error {
    let bounds = clip.bounds();
    let corners = bounds.lo.iter().chain(&bounds.hi);
    let largest = corners.fold(0.0f64, |most, c| most.max(c.abs()));
    let (spacing, largest) = (number(largest.next_up() - largest), number(largest));
    let problem =
        format!("cannot be reached: coordinates up to {largest} are held to {spacing} at the best");
    Error::parameter("target-max", number(bound), problem)
}

/// The error of what a stream decodes to.
fn measured(clip: &Clip, made: &Made) -> Result<AnimationError> {
    let stream = Stream::open(&made.bytes, None).map_err(Error::Geometry)?;
    let mut meter = Meter::new(clip, 0);
    let frames = 0..clip.frames();
    stream
        .each_frame(frames, |_, frame| meter.frame(frame))
        .map_err(Error::Geometry)?;
    Ok(meter.finish())
}

fn bpvf(clip: &Clip, made: &Made) -> Bpvf {
    let positions = (clip.vertices() * clip.frames()) as f64;
    let bits = made.stats.bits;
    Bpvf {
        geometry: (bits.total - bits.faces) / positions,
        total: bits.total / positions,
        by_part: bits.scaled(1.0 / positions),
    }
}

fn ladder(clip: &Clip, encoder: &Encoder, job: &Job) -> Result<Vec<Rung>> {
    let rung = |target_kg: f64| {
        let made = encoder.make(Target::Kg(target_kg), job.progress())?;
        let (error, bpvf) = (measured(clip, &made)?, bpvf(clip, &made));
        Ok(Rung {
            target_kg,
            method: made.stats.method,
            bpvf_geometry: bpvf.geometry,
            bpvf_total: bpvf.total,
            kg_centroid_percent: error.kg_centroid_percent,
            kg_mean_percent: error.kg_mean_percent,
            rmse: error.rmse,
            max_error: error.max_error.distance,
            components: made.stats.components.iter().sum(),
        })
    };
    LADDER.into_iter().map(rung).collect()
}

fn stats(
    clip: &Clip,
    encoder: &Encoder,
    made: &Made,
    error: AnimationError,
    ladder: Option<Vec<Rung>>,
) -> Stats {
    let norm = encoder.norm();
    let predicted = made.stats.predicted_squared_error;
    Stats {
        vertices: clip.vertices() as u64,
        frames: clip.frames() as u64,
        bytes: made.bytes.len() as u64,
        bpvf: bpvf(clip, made),
        made: made.stats.clone(),
        predicted_kg_centroid_percent: (norm > 0.0).then(|| 100.0 * (predicted / norm).sqrt()),
        error,
        ladder,
    }
}

fn summary(clip: &Clip, made: &Made, error: &AnimationError) -> String {
    let bpvf = bpvf(clip, made);
    let kg = error.kg_centroid_percent;
    let kg = kg.map_or("no share".to_owned(), |kg| format!("{} %", short(kg)));
    format!(
        "{} in {} bytes: {:.3} bits per vertex and frame, {:.3} with the faces, error {kg}",
        words::frames(clip.frames() as u64, clip.vertices() as u64),
        made.bytes.len(),
        bpvf.geometry,
        bpvf.total
    )
}

/// How much of the coordinates was told.
fn modelled(clip: &Clip, made: &Made) -> Modelled {
    let full = (3 * clip.vertices() * clip.frames()) as u64;
    Modelled::new("numbers", made.stats.numbers, full, made.bytes.len() as u64)
}
