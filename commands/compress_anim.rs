//! `scantle compress-anim`: animations in as few bits as the error asked for allows.

mod decode;
mod encode;
mod eval;
mod info;
mod picture;
pub mod sources;

use crate::exit::Exit;
use scantle::anim::compress::Summary;
use scantle::error::Result;
use scantle::measure::animation_error::AnimationError;
use schemars::JsonSchema;
use serde::Serialize;

/// Make animations of one mesh small, to the error or the size asked for
///
/// `encode` makes a stream of a cache of points, of a file for each frame or of a glTF animation;
/// `decode` makes an animation of a stream, or of some of its frames; `eval` tells how far one
/// animation is from another; `info` tells what stands in a stream. Vertices, frames and faces keep
/// their number and their order.
#[derive(Debug, clap::Args)]
#[command(
    subcommand_required = true,
    arg_required_else_help = true,
    after_long_help = EXAMPLES
)]
pub struct Args {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  scantle compress-anim encode fixtures/animations/wave-morph.glb -o wave.sanim
  scantle compress-anim decode fixtures/animations/wave.sanim -o wave.glb
";

/// What to do.
#[derive(Debug, clap::Subcommand)]
enum Verb {
    Encode(Box<encode::Args>),
    Decode(Box<decode::Args>),
    Eval(eval::Args),
    Info(info::Args),
}

/// What was asked for, by verb.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(tag = "verb", rename_all = "kebab-case")]
pub enum Asked {
    /// To make a stream.
    Encode(Box<encode::Asked>),
    /// To make an animation of a stream.
    Decode(decode::Asked),
    /// To compare two animations.
    Eval(eval::Asked),
    /// To look into a stream.
    Info {},
}

/// What came of it, by verb.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Found {
    /// A stream.
    Encode(Box<encode::Stats>),
    /// An animation.
    Decode(decode::Stats),
    /// How far two animations are apart.
    Eval(Box<AnimationError>),
    /// What stands in a stream.
    Info(Box<Summary>),
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Found>;

/// The name of this command in its reports.
const NAME: &str = "compress-anim";

/// Does what the verb says.
pub fn run(args: &Args) -> Result<Exit> {
    match &args.verb {
        Verb::Encode(args) => encode::run(args),
        Verb::Decode(args) => decode::run(args),
        Verb::Eval(args) => eval::run(args),
        Verb::Info(args) => info::run(args),
    }
}
