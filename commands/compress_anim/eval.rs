//! `scantle compress-anim eval`: how far one animation is from another.

use super::sources::{self, Sampling};
use super::{Asked as AnyAsked, Found as AnyFound, NAME};
use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, InputFormat, MaxError, positive};
use crate::words;
use scantle::error::Result;
use scantle::measure::animation_error::animation_error;
use schemars::JsonSchema;
use serde::Serialize;

/// Measure how far an animation is from another of as many vertices and frames
///
/// Each may be a stream, a cache of points, a glTF animation, or a folder or pattern with a file for
/// each frame. The first is the reference.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    /// The two animations; `-` for standard input
    #[arg(value_names = ["A", "B"], num_args = 2, required = true)]
    inputs: Vec<String>,
    #[command(flatten)]
    format: InputFormat,
    /// Frames per second at which glTF is sampled [default: 24]
    #[arg(long, value_name = "F", value_parser = positive)]
    fps: Option<f64>,
    #[command(flatten)]
    max_error: MaxError,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
The first measure of `accuracy`, which --max-error checks, is the error of Karni and Gotsman about
the centroids, in percent.

Examples:
  scantle compress-anim eval fixtures/animations/wave.pc2 fixtures/animations/wave.sanim
  scantle compress-anim eval fixtures/animations/wave.pc2 fixtures/animations/wave.mdd --max-error 0
";

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// Frames per second at which glTF is sampled, where they were given.
    fps: Option<f64>,
}

/// Measures it.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let files = Files::together(&args.inputs, &args.format);
    context.run(NAME, &files, |job| eval(job, args))
}

fn eval(job: &mut Job, args: &Args) -> Result<Found<AnyAsked, AnyFound>> {
    let sampling = Sampling {
        rate: args.fps,
        animation: None,
    };
    let a = sources::read_one(job, sampling)?;
    let b = sources::read_one(job, sampling)?;
    let error = animation_error(&a, &b)?;
    let summary = words::animation_error(&error);
    let accuracy = error.accuracy("every vertex of every frame");
    let asked = AnyAsked::Eval(Asked { fps: args.fps });
    Ok(Found::new(asked, AnyFound::Eval(Box::new(error)), summary)
        .accuracy(accuracy)
        .check("max-error", args.max_error.max_error))
}
