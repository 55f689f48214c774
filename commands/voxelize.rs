//! `scantle voxelize`: a mesh becomes voxels.

use crate::context::{Context, Files};
use crate::destination::stem;
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Preview, Verify, list, named};
use clap::value_parser;
use scantle::error::Result;
use scantle::image::colour::{CLAY, OKABE_ITO};
use scantle::io::format::Kind;
use scantle::measure::voxel_error::{self, VoxelError};
use scantle::mesh::Mesh;
use scantle::render::preview::{self, Panel, What};
use scantle::report::Measures;
use scantle::volume::octree::MAX_DIM;
use scantle::volume::surface::boundary_faces;
use scantle::volume::voxelize::{self, Fill, Levels, Mode, Size, Storage};
use scantle::volume::{Volume, voxelize::Params};
use schemars::JsonSchema;
use serde::Serialize;

/// Turn a mesh, polylines or points into voxels
///
/// Voxel (i, j, k) is the cube from origin + h (i, j, k) to origin + h (i+1, j+1, k+1). Its lower
/// faces belong to it and its upper faces to the next one; the upper faces of the grid belong to
/// the last. A conservative voxel is set when the closed triangle meets the closed cube, so a face
/// that lies on a plane between voxels sets those on both sides.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// Voxels along the longest side of the box
    #[arg(long, value_name = "N", default_value_t = resolution(), value_parser = value_parser!(u32).range(1..=MOST), conflicts_with = "voxel_size")]
    resolution: u32,
    /// Edge of a voxel, in the mesh's unit, instead of --resolution
    #[arg(long, value_name = "H")]
    voxel_size: Option<f64>,
    /// Which voxels the surface sets: `z`, those it meets on the line through the centres along z;
    /// `three-axis`, the same along x, y and z (6-separating); `conservative`, all it touches
    /// (26-separating); `none`, only what --fill adds
    #[arg(long, default_value = Params::DEFAULT.mode.name(), value_parser = named(Mode::NAMES, Mode::from_name))]
    mode: Mode,
    /// Which voxels are set for their centre being inside: `parity`, behind an odd number of
    /// surfaces along x; `winding`, winding number above one half, right on open and
    /// self-intersecting surfaces too
    #[arg(long, default_value = Params::DEFAULT.fill.name(), value_parser = named(Fill::NAMES, Fill::from_name))]
    fill: Fill,
    /// Voxels of margin on each side; without --bounds only
    #[arg(long, value_name = "P", default_value_t = Params::DEFAULT.pad, value_parser = value_parser!(u32).range(..=MOST), conflicts_with = "bounds")]
    pad: u32,
    /// The box to cover, in the mesh's unit, instead of the model's own: voxels start at its lower
    /// corner, and no margin is added
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = list::<6>, allow_hyphen_values = true)]
    bounds: Option<[f64; 6]>,
    /// How the grid is held: `dense`, a bit per voxel; `sparse`, an octree that is never held
    /// densely; `auto`, dense up to 128 MiB (1024^3)
    #[arg(long, default_value = Params::DEFAULT.grid.name(), value_parser = named(Storage::NAMES, Storage::from_name))]
    grid: Storage,
    /// Along which axes the levels of the reported pyramid halve
    #[arg(long, default_value = Params::DEFAULT.levels.name(), value_parser = named(Levels::NAMES, Levels::from_name))]
    levels: Levels,
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
The output is a volume (nrrd, mha, mhd, nii, npy, binvox, vti, vdb, svo) or the faces of the set
voxels as a mesh (obj, ply, stl, off, glb). The first measure of `accuracy`, which --max-error
checks, is the largest distance from the centre of a set voxel to the model, in voxels.

A point sets the voxel that holds it, a segment those it touches; both in conservative mode only.
A triangle without area is met as the segment or point that it is.

Examples:
  scantle voxelize fixtures/shapes/torus-knot.ply -o knot.nrrd --preview knot.png
  scantle voxelize fixtures/shapes/sphere.stl --resolution 64 --fill winding -o sphere.vdb
";

/// Most voxels along an axis.
const MOST: i64 = MAX_DIM as i64;

fn resolution() -> u32 {
    match Params::DEFAULT.size {
        Size::Resolution(n) => n,
        Size::VoxelSize(_) => 128,
    }
}

/// What was made, and with `--verify` the error measured.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    #[serde(flatten)]
    made: voxelize::Stats,
    /// What `--verify` measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    verified: Option<VoxelError>,
}

/// The report of this command.
pub type Report = scantle::report::Report<Params, Stats>;

/// Voxelizes each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let size = args
        .voxel_size
        .map_or(Size::Resolution(args.resolution), Size::VoxelSize);
    let params = Params {
        size,
        mode: args.mode,
        fill: args.fill,
        pad: args.pad,
        bounds: args.bounds,
        grid: args.grid,
        levels: args.levels,
        max_memory: context.memory(),
    };
    params.check()?;
    let files = Files::each(&args.inputs)
        .output(&args.output)
        .preview(&args.preview);
    context.run("voxelize", &files, |job| voxelize(job, &params, args))
}

fn voxelize(job: &mut Job, params: &Params, args: &Args) -> Result<Found<Params, Stats>> {
    job.expect_output(&[Kind::Volume, Kind::Mesh])?;
    let mesh = job.read_mesh()?;
    let (volume, made) = voxelize::voxelize(&mesh, params, job.progress())?;
    job.warn(made.warnings.clone());
    let verified = args
        .verify
        .verify
        .then(|| {
            voxel_error::measure(
                &mesh,
                &volume,
                params,
                &made.lattice(),
                made.orientation(),
                job.progress(),
            )
        })
        .transpose()?;
    let accuracy = match &verified {
        Some(error) => error.accuracy(made.bounds(), made.spacing[0]),
        None => made.bounds(),
    };
    match job.output_format().map(scantle::io::format::Format::kind) {
        Some(Kind::Mesh) => job.write_mesh(&boundary_faces(&volume)?)?,
        _ => job.write_volume(&volume)?,
    }
    let [nx, ny, nz] = made.dims;
    let summary = format!("{} of {nx} x {ny} x {nz} voxels set", made.set_voxels);
    let name = job
        .input()
        .map(|input| stem(&input.path))
        .unwrap_or_default();
    job.write_preview(|_| picture(&name, &mesh, &volume, &made, &accuracy[0]));
    let modelled = made.modelled();
    let found = Found::new(params.clone(), Stats { made, verified }, summary);
    Ok(found
        .accuracy(Measures::Many(accuracy))
        .modelled(modelled)
        .check("max-error", args.max_error.max_error))
}

/// The mesh, and beside it its voxels.
fn picture(
    name: &str,
    mesh: &Mesh,
    volume: &Volume,
    made: &voxelize::Stats,
    error: &scantle::report::Accuracy,
) -> Result<Vec<u8>> {
    let [nx, ny, nz] = made.dims;
    let label = format!("{nx} × {ny} × {nz} voxels, {}", made.mode.name());
    let panels = [
        Panel {
            label: name,
            what: What::Mesh(mesh),
            colour: CLAY,
        },
        Panel {
            label: &label,
            what: What::Voxels(volume),
            colour: OKABE_ITO[2],
        },
    ];
    let (sign, amount) = match (error.reached, error.bound) {
        (Some(reached), _) => ("=", reached),
        (None, bound) => ("≤", bound.unwrap_or(f64::INFINITY)),
    };
    let caption = format!(
        "{} voxels set · error {sign} {amount:.2} voxel",
        made.set_voxels
    );
    preview::side_by_side(&panels, &caption, "", &preview::Params::DEFAULT)
}
