//! `scantle smooth-mc`: a binary volume becomes a smooth surface that keeps every voxel on its side.

mod beside;
mod input;
mod known;
mod names;
mod output;
mod result;
mod select;

use crate::context::{Context, Files};
use crate::destination::LABEL;
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Preview, Verify, list, named};
use beside::Other;
use clap::value_parser;
use known::Known;
pub use output::{empty, modelled};
use result::Stats;
use scantle::error::{Error, Fault, Result};
use scantle::io::Content;
use scantle::io::format::Kind;
use scantle::volume::isosurface::Border;
use scantle::volume::smooth_mc::region::Constraint;
use scantle::volume::smooth_mc::{Energy, Params, Thin, Update};
use schemars::JsonSchema;
use select::Inside;
use serde::Serialize;

/// Smooth the surface of a binary volume or of labels, with every voxel kept on its side
///
/// A volume is cut by marching cubes, and the staircase taken off it; a mesh must be one that marching
/// cubes made of a binary volume, whose grid is read from the mesh. Vertices stay within half a
/// voxel of where they start, in a region that no voxel's centre can be passed from: the smooth
/// surface stands for the same voxels, which --verify counts anew. The volume enclosed is held to
/// theirs.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// The value that is inside; without it all but 0 is, where there is one such value
    #[arg(long, value_name = "K", allow_hyphen_values = true, conflicts_with_all = ["labels", "threshold_value"])]
    label: Option<f64>,
    /// Several values, each a body of its own, with shared walls between them: a list, or `all` but 0
    #[arg(long, value_name = "K,K,...", value_parser = chosen, allow_hyphen_values = true, conflicts_with = "threshold_value")]
    labels: Option<Chosen>,
    /// Values from this one on are inside
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    threshold_value: Option<f64>,
    /// Where vertices may go: `diamond`, half a voxel around their start, in the sum along the axes;
    /// `cell-edge`, along the edge between two voxel centres; `cell-center`, in a cell, on the dual
    /// surface (CESN); `cell-size`, half a voxel along each axis, which lets voxels change sides
    #[arg(long, default_value = Constraint::Diamond.name(), value_parser = named(Constraint::NAMES, Constraint::from_name))]
    constraint: Constraint,
    /// What is made small: `laplacian`, the way to the mean of the neighbours, as in the paper;
    /// `bilaplacian`, the bending, with the volume held
    #[arg(long, default_value = Params::DEFAULT.energy.name(), value_parser = named(Energy::NAMES, Energy::from_name))]
    energy: Energy,
    /// For the laplacian: `jacobi`, all vertices at once; `gauss-seidel`, one after the other
    #[arg(long, default_value = Params::DEFAULT.update.name(), value_parser = named(Update::NAMES, Update::from_name))]
    update: Update,
    /// End when no vertex moves by this share of the smallest spacing in a step
    #[arg(long, value_name = "T", default_value_t = Params::DEFAULT.threshold)]
    threshold: f64,
    /// Most steps [default: 20, and 2000 for the laplacian]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(..=1_000_000))]
    max_iterations: Option<u32>,
    /// Share of the region that is used
    #[arg(long, value_name = "S", default_value_t = Params::DEFAULT.scale)]
    scale: f64,
    /// Where the surface is one voxel thick: `guard`, vertices go inwards half as far; `keep`, they
    /// stay; `off`, they go as elsewhere, and thin parts may lose their thickness
    #[arg(long, default_value = Params::DEFAULT.thin.name(), value_parser = named(Thin::NAMES, Thin::from_name))]
    thin: Thin,
    /// Where the volume ends: `closed`, the surface is closed there; `open`, it ends
    #[arg(long, default_value = Border::Closed.name(), value_parser = named(Border::NAMES, Border::from_name), conflicts_with = "labels")]
    border: Border,
    /// Surfaces to judge beside this one: `mc`, as it was; `cesn`, the dual surface relaxed in its cells;
    /// `taubin`, 110 rounds without a constraint
    #[arg(long, value_name = "METHOD,...", value_delimiter = ',', value_parser = named(Other::NAMES, Other::from_name))]
    compare: Vec<Other>,
    /// A mesh to compare directions with: the true shape, where it is known
    #[arg(long, value_name = "FILE")]
    reference: Option<String>,
    /// A table of labels and their names, as comma-separated values
    #[arg(long, value_name = "FILE", requires = "labels")]
    label_names: Option<String>,
    /// Steps of the grid along x, y, z, instead of the file's
    #[arg(long, value_name = "DX,DY,DZ", value_parser = spacing)]
    spacing: Option<[f64; 3]>,
    /// Centre of the first voxel, instead of the file's
    #[arg(long, value_name = "X,Y,Z", value_parser = list::<3>, allow_hyphen_values = true)]
    origin: Option<[f64; 3]>,
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
With --labels the output is one mesh in which each triangle knows the labels on both sides (ply), or
with `{label}` in its name a closed mesh for each.

The first measure of `accuracy`, which --max-error checks, is the distance to the fairest surface
there is in the diamond, which --verify looks for with a thousand steps.

Examples:
  scantle smooth-mc fixtures/volumes/labels.nii --label 1 -o one.ply --preview one.png
  scantle smooth-mc fixtures/volumes/labels.nii --labels all -o label-{label}.ply --verify
";

/// Which labels.
#[derive(Debug, Clone)]
enum Chosen {
    All,
    These(Vec<f64>),
}

fn chosen(text: &str) -> Result<Chosen, String> {
    if text == "all" {
        return Ok(Chosen::All);
    }
    let values: Result<Vec<f64>, _> = text.split(',').map(|w| w.trim().parse()).collect();
    values
        .map(Chosen::These)
        .map_err(|_| "neither `all` nor numbers with commas between them".to_owned())
}

fn spacing(text: &str) -> Result<[f64; 3], String> {
    let steps = list::<3>(text)?;
    if steps.iter().all(|s| s.is_finite() && *s > 0.0) {
        Ok(steps)
    } else {
        Err("must be finite and above 0".to_owned())
    }
}

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// What is inside.
    inside: Inside,
    /// What happens where the volume ends.
    border: Border,
    /// The mesh that directions were compared with.
    reference: Option<String>,
    #[serde(flatten)]
    params: Params,
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Smooths each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let most = match args.energy {
        Energy::Laplacian => Params::LAPLACIAN_ITERATIONS,
        Energy::Bilaplacian => Params::DEFAULT.max_iterations,
    };
    let params = Params {
        constraint: args.constraint,
        energy: args.energy,
        update: args.update,
        threshold: args.threshold,
        max_iterations: args.max_iterations.unwrap_or(most),
        scale: args.scale,
        thin: args.thin,
    };
    params.check()?;
    let files = Files::each(&args.inputs)
        .output(&args.output)
        .several(args.labels.is_some().then_some(LABEL))
        .reads("reference", &args.reference)
        .reads("label-names", &args.label_names)
        .preview(&args.preview);
    files.check_reads()?;
    let known = Known::read(args, context.memory())?;
    context.run("smooth-mc", &files, |job| {
        smooth(job, &params, args, &known)
    })
}

fn smooth(
    job: &mut Job,
    params: &Params,
    args: &Args,
    known: &Known,
) -> Result<Found<Asked, Stats>> {
    job.expect_output(&[Kind::Mesh])?;
    match job.read()? {
        Content::Volume(volume) => {
            let (piece, made) = input::of_volume(job, volume, params, args)?;
            output::finish(job, piece, made, params, args, known)
        }
        Content::Mesh(mesh) => match input::lattice_of(job, &mesh, params, args)? {
            Some(lattice) => {
                let (piece, made) = input::of_mesh(job, mesh, lattice, params)?;
                output::finish(job, piece, made, params, args, known)
            }
            None => output::of_any_mesh(job, mesh, params, args),
        },
        other => {
            let found = other.kind().with_article();
            let fault = Fault::whole(format!("holds {found}, but a volume or a mesh is needed"));
            Err(Error::Geometry(fault))
        }
    }
}
