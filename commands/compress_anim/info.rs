//! `scantle compress-anim info`: what stands in a stream.

use super::sources::{self, malformed};
use super::{Asked as AnyAsked, Found as AnyFound, NAME};
use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs};
use crate::words;
use scantle::anim::compress::summary;
use scantle::error::Result;

/// Tell what stands in a stream
///
/// Every section is checked, but nothing is decoded.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
Examples:
  scantle compress-anim info fixtures/animations/wave.sanim
  scantle compress-anim info fixtures/animations/wave.sanim --report -
";

/// Looks into each stream.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let files = Files::each(&args.inputs);
    context.run(NAME, &files, info)
}

fn info(job: &mut Job) -> Result<Found<AnyAsked, AnyFound>> {
    let (bytes, word) = sources::read_stream(job)?;
    let told = summary(&bytes).map_err(|fault| malformed(&word, fault))?;
    let mut text = format!(
        "version {}, {} by {}",
        told.version,
        words::frames(told.frames, told.vertices),
        told.methods.join(", ")
    );
    if let Some(at) = told.cut_off_at {
        text += &format!(", cut off at byte {at}");
    }
    Ok(Found::new(
        AnyAsked::Info {},
        AnyFound::Info(Box::new(told)),
        text,
    ))
}
