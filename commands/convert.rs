//! `scantle convert`: from one format to another.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, Output, SkipBad};
use crate::words;
use scantle::error::{Error, Fault, Result};
use scantle::io;
use scantle::io::format::{Format, Kind};
use schemars::JsonSchema;
use serde::Serialize;

/// Write a mesh, a cloud, splats, a volume, an image, a molecule, an animation or a map in another format
///
/// Vertices, faces, voxels, pixels, atoms, frames, heights, features and their order stay as they are. What the output format cannot
/// hold is left out, and a warning counts it. Splats are written as polygons where the output format is
/// one of meshes.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    skip_bad: SkipBad,
    /// Sides of the polygons that splats are written as, in a format of meshes
    #[arg(long, value_name = "N", default_value_t = SIDES, value_parser = clap::value_parser!(u16).range(3..=1024))]
    sides: u16,
    #[command(flatten)]
    common: Common,
}

const EXAMPLES: &str = "\
Examples:
  scantle convert fixtures/shapes/cube.obj -o cube.ply
  scantle convert fixtures/shapes/*.obj -o {stem}.stl
";

/// Sides of a polygon that stands for a disc: it lacks at most 3.5 % of the radius.
const SIDES: u16 = 12;

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Params {
    /// Whether points that have a number which is not finite are left out of clouds.
    skip_bad: bool,
    /// Sides of the polygons that splats are written as, in a format of meshes; null for other results.
    #[serde(skip_serializing_if = "Option::is_none")]
    sides: Option<u16>,
    /// The format that was written.
    output_format: Option<&'static str>,
}

/// What was done.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// What was converted: `mesh`, `splats`, `volume`, `image`, `molecule`, `animation`, `terrain` or `vectors`.
    kind: &'static str,
}

/// The report of this command.
pub type Report = scantle::report::Report<Params, Stats>;

/// Converts each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let files = Files::each(&args.inputs).output(&args.output);
    context.run("convert", &files, |job| convert(job, args))
}

fn convert(job: &mut Job, args: &Args) -> Result<Found<Params, Stats>> {
    let skip_bad = args.skip_bad.skip_bad;
    job.skip_bad(skip_bad);
    let content = job.read()?;
    let kind = content.kind();
    match kind {
        Kind::Report => {}
        Kind::Splats => job.expect_output(&[Kind::Splats, Kind::Mesh])?,
        kind => job.expect_output(&[kind])?,
    }
    let written = job.output_format_for(kind);
    let is_polygons =
        kind == Kind::Splats && written.is_some_and(|format| format.kind() == Kind::Mesh);
    match &content {
        io::Content::Mesh(mesh) => job.write_mesh(mesh)?,
        io::Content::Splats(splats) if is_polygons => {
            job.write_mesh(&io::splats::discs(splats, usize::from(args.sides))?)?;
        }
        io::Content::Splats(splats) => job.write_splats(splats)?,
        io::Content::Volume(volume) => job.write_volume(volume)?,
        io::Content::Image(image) => job.write_image(image)?,
        io::Content::Molecule(molecule) => job.write_molecule(molecule)?,
        io::Content::Animation(clip) => job.write_animation(clip)?,
        io::Content::Terrain(grid) => job.write_terrain(grid)?,
        io::Content::Vectors(layer) => job.write_vectors(layer)?,
        io::Content::Report(_) => {
            let fault = Fault::whole("holds a report (json), which is written in no other format");
            let hint = "scantle info and scantle compare take reports";
            return Err(Error::Geometry(fault.with_hint(hint)));
        }
    }
    let params = Params {
        skip_bad,
        sides: is_polygons.then_some(args.sides),
        output_format: written.map(Format::name),
    };
    let summary = job
        .input()
        .map(|input| words::content(&input.content))
        .unwrap_or_default();
    Ok(Found::new(params, Stats { kind: kind.name() }, summary))
}
