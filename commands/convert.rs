//! `scantle convert`: from one format to another.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, Output};
use crate::words;
use scantle::error::{Error, Fault, Result};
use scantle::io;
use scantle::io::format::{Format, Kind};
use schemars::JsonSchema;
use serde::Serialize;

/// Write a mesh, a volume, an image, a molecule or an animation in another format
///
/// Vertices, faces, voxels, pixels, atoms, frames and their order stay as they are. What the output format cannot
/// hold is left out, and a warning counts it.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    common: Common,
}

const EXAMPLES: &str = "\
Examples:
  scantle convert fixtures/shapes/cube.obj -o cube.ply
  scantle convert fixtures/shapes/*.obj -o {stem}.stl
";

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Params {
    /// The format that was written.
    output_format: Option<&'static str>,
}

/// What was done.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// What was converted: `mesh`, `volume`, `image`, `molecule` or `animation`.
    kind: &'static str,
}

/// The report of this command.
pub type Report = scantle::report::Report<Params, Stats>;

/// Converts each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let files = Files::each(&args.inputs).output(&args.output);
    context.run("convert", &files, convert)
}

fn convert(job: &mut Job) -> Result<Found<Params, Stats>> {
    let content = job.read()?;
    let kind = content.kind();
    if kind != Kind::Report {
        job.expect_output(&[kind])?;
    }
    match &content {
        io::Content::Mesh(mesh) => job.write_mesh(mesh)?,
        io::Content::Volume(volume) => job.write_volume(volume)?,
        io::Content::Image(image) => job.write_image(image)?,
        io::Content::Molecule(molecule) => job.write_molecule(molecule)?,
        io::Content::Animation(clip) => job.write_animation(clip)?,
        io::Content::Report(_) => {
            let fault = Fault::whole("holds a report (json), which is written in no other format");
            let hint = "scantle info and scantle compare take reports";
            return Err(Error::Geometry(fault.with_hint(hint)));
        }
    }
    let params = Params {
        output_format: job.output_format().map(Format::name),
    };
    let summary = job
        .input()
        .map(|input| words::content(&input.content))
        .unwrap_or_default();
    Ok(Found::new(params, Stats { kind: kind.name() }, summary))
}
