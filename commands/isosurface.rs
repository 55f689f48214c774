//! `scantle isosurface`: the surface between what is inside of a volume and what is outside.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, Output, Preview, named};
use crate::smooth_mc::{empty, modelled};
use scantle::error::{Error, Result};
use scantle::image::colour::OKABE_ITO;
use scantle::io::format::Kind;
use scantle::mesh::Mesh;
use scantle::render::preview::{self, Panel, What};
use scantle::volume::isosurface::{self, Border, Select};
use schemars::JsonSchema;
use serde::Serialize;

/// Turn a volume into the mesh where it passes a level
///
/// Marching cubes over the centres of the voxels. Vertices lie where linear interpolation between
/// two neighbours meets the level; in a volume of bits, halfway. Faces whose corners alternate are cut
/// alike from both sides, so that the surface is a closed manifold but where the volume ends.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// The level; values at it and above are inside. Not needed for volumes of bits
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    iso: Option<f64>,
    /// Where the volume ends: `open`, the surface ends there too; `closed`, it turns and is closed
    #[arg(long, default_value = Border::Open.name(), value_parser = named(Border::NAMES, Border::from_name))]
    border: Border,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    preview: Preview,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
Examples:
  scantle isosurface fixtures/volumes/ball.nrrd --iso 0 -o ball.ply
  scantle isosurface fixtures/volumes/ball.mha --iso 0.25 --border closed -o inner.stl
";

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The level; null for volumes of bits.
    iso: Option<f64>,
    /// What happens where the volume ends.
    border: Border,
}

/// What was made.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// Vertices of the surface.
    vertices: u64,
    /// Its triangles.
    triangles: u64,
    /// Cells between voxel centres that hold a part of it.
    cells: u64,
    /// Vertices where it ends with the volume.
    boundary_vertices: u64,
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Makes the surface of each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    if args.iso.is_some_and(|iso| !iso.is_finite()) {
        return Err(Error::parameter(
            "iso",
            args.iso.unwrap_or_default(),
            "must be finite",
        ));
    }
    let files = Files::each(&args.inputs)
        .output(&args.output)
        .preview(&args.preview);
    context.run("isosurface", &files, |job| isosurface(job, args))
}

fn isosurface(job: &mut Job, args: &Args) -> Result<Found<Asked, Stats>> {
    job.expect_output(&[Kind::Mesh])?;
    let volume = job.read_volume()?;
    volume.check_numbers().map_err(Error::Geometry)?;
    let iso = args.iso.filter(|_| !volume.is_binary());
    let select = match iso {
        Some(iso) => Select::AtLeast(iso),
        None if volume.is_binary() => Select::Set,
        None => {
            let problem = format!(
                "is needed: the voxels are {}, from {}",
                volume.data.sample_type(),
                volume
                    .range()
                    .map_or("none".to_owned(), |[lo, hi]| format!("{lo} to {hi}"))
            );
            return Err(Error::parameter("iso", "V", problem));
        }
    };
    let surface = isosurface::extract(&volume, &select, args.border, job.progress())?;
    let offsets = match iso {
        Some(iso) => isosurface::at_level(&volume, &surface, iso),
        None => vec![0.0; surface.len()],
    };
    let positions = surface.positions(&volume.frame, |v| {
        let mut moved = [0.0; 3];
        moved[isosurface::axis_of(surface.places[v])] = offsets[v];
        moved
    });
    let mut mesh = Mesh::from_triangles(Vec::new(), surface.triangles(&positions));
    mesh.positions = positions;
    if volume.frame.is_mirrored() {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    job.warn(empty(&surface));
    job.write_mesh(&mesh)?;
    let stats = Stats {
        vertices: surface.len() as u64,
        triangles: mesh.triangles.len() as u64,
        cells: surface.cells,
        boundary_vertices: surface.ends() as u64,
    };
    let summary = format!("{} vertices, {} triangles", stats.vertices, stats.triangles);
    job.write_preview(|_| {
        let panel = Panel {
            label: "isosurface",
            what: What::Mesh(&mesh),
            colour: OKABE_ITO[2],
        };
        preview::side_by_side(&[panel], &summary, "", &preview::Params::DEFAULT)
    });
    let asked = Asked {
        iso,
        border: args.border,
    };
    let made = modelled(&surface, volume.frame.dims);
    Ok(Found::new(asked, stats, summary).modelled(made))
}
