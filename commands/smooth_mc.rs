//! `scantle smooth-mc`: a binary volume becomes a smooth surface that keeps every voxel on its side.

mod beside;
mod names;
mod result;
mod select;

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Preview, Verify, list, named};
use beside::Other;
use clap::value_parser;
use result::{Body, Stats};
use scantle::error::{Error, Fault, Result, number};
use scantle::image::colour::{CLAY, OKABE_ITO};
use scantle::io::Content;
use scantle::io::format::Kind;
use scantle::measure::smooth_error::{self, Smoothed, Voxels};
use scantle::mesh::Mesh;
use scantle::render::preview::{self, Panel, What};
use scantle::report::{Measures, Modelled, Warning};
use scantle::volume::bits::BitGrid;
use scantle::volume::isosurface::{self, Border, Labels, Select, Surface};
use scantle::volume::smooth_mc::lattice::{self, Given, Lattice};
use scantle::volume::smooth_mc::region::Constraint;
use scantle::volume::smooth_mc::{self, Energy, Made, Params, Thin, Update};
use scantle::volume::{Frame, Volume};
use schemars::JsonSchema;
use select::Inside;
use serde::Serialize;
use std::collections::BTreeMap;

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
        .labelled(args.labels.is_some())
        .preview(&args.preview);
    context.run("smooth-mc", &files, |job| {
        smooth(job, &params, args, context.memory())
    })
}

/// A surface to be smoothed, and what is known of where it comes from.
pub struct Piece {
    surface: Surface,
    frame: Frame,
    inside: Inside,
    /// The voxels, where they are needed to verify.
    bits: Option<BitGrid>,
    /// The mesh that it was read from.
    mesh: Option<(Mesh, Lattice)>,
    /// The volume that it was taken from.
    volume: Option<Volume>,
}

impl Piece {
    fn voxels(&self, border: Border) -> Voxels<'_> {
        match (&self.bits, &self.mesh) {
            (Some(bits), _) if border == Border::Closed => Voxels::Given(bits),
            (_, Some(_)) if self.surface.ends() == 0 => Voxels::Enclosed,
            _ => Voxels::Unknown,
        }
    }

    /// Vertices of the result, as they are in the file.
    fn positions(&self, offsets: &[[f64; 3]]) -> Vec<[f64; 3]> {
        match &self.mesh {
            Some((mesh, lattice)) => lattice.positions(mesh, offsets),
            None => self.surface.positions(&self.frame, |v| offsets[v]),
        }
    }
}

fn smooth(job: &mut Job, params: &Params, args: &Args, memory: u64) -> Result<Found<Asked, Stats>> {
    job.expect_output(&[Kind::Mesh])?;
    match job.read()? {
        Content::Volume(volume) => of_volume(job, volume, params, args, memory),
        Content::Mesh(mesh) => of_mesh(job, mesh, params, args, memory),
        other => {
            let found = other.kind().with_article();
            let fault = Fault::whole(format!("holds {found}, but a volume or a mesh is needed"));
            Err(Error::Geometry(fault))
        }
    }
}

fn of_volume(
    job: &mut Job,
    mut volume: Volume,
    params: &Params,
    args: &Args,
    memory: u64,
) -> Result<Found<Asked, Stats>> {
    place(&mut volume.frame, args);
    volume.check_numbers().map_err(Error::Geometry)?;
    let what = select::inside(&volume, args)?;
    let one = what.select();
    let dual = params.constraint == Constraint::CellCenter;
    let several = matches!(what, Inside::Labels(_));
    if several && (dual || !args.compare.is_empty()) {
        let option = if dual { "constraint" } else { "compare" };
        let problem = "takes one label, and --labels names several; give --label";
        return Err(Error::parameter(option, params.constraint.name(), problem));
    }
    let steps = volume.frame.spacing();
    let room = |job: &Job, surface: &Surface| {
        // Offsets, the steps' own list and triangles, some of them twice.
        job.expect_room("smoothing the surface", 300 * surface.len() as u128)
    };
    let (surface, made) = match &what {
        Inside::Labels(values) => {
            let labels = Labels::new(values.clone());
            let walls = isosurface::extract_labels(&volume, &labels, job.progress())?;
            room(job, &walls)?;
            let made = smooth_mc::smooth(&walls, None, steps, params, job.progress())?;
            (walls, made)
        }
        _ if dual => smooth_mc::smooth_net(&volume, &one, args.border, params, job.progress())?,
        _ => {
            let surface = isosurface::extract(&volume, &one, args.border, job.progress())?;
            room(job, &surface)?;
            let made = smooth_mc::smooth(&surface, None, steps, params, job.progress())?;
            (surface, made)
        }
    };
    job.warn(empty(&surface));
    let needed = !several && (args.verify.verify || !args.compare.is_empty());
    let piece = Piece {
        surface,
        frame: volume.frame,
        bits: needed.then(|| isosurface::inside(&volume, &one)),
        inside: what,
        mesh: None,
        volume: Some(volume),
    };
    finish(job, piece, made, params, args, memory)
}

fn of_mesh(
    job: &mut Job,
    mesh: Mesh,
    params: &Params,
    args: &Args,
    memory: u64,
) -> Result<Found<Asked, Stats>> {
    let dual = params.constraint == Constraint::CellCenter;
    let label = args.label.map(number).unwrap_or_default();
    let level = args.threshold_value.map(number).unwrap_or_default();
    let of_volumes = [
        ("label", args.label.is_some(), label.as_str()),
        ("labels", args.labels.is_some(), "K,K"),
        ("threshold-value", args.threshold_value.is_some(), &level),
        ("constraint", dual, "cell-center"),
    ];
    if let Some((option, _, value)) = of_volumes.into_iter().find(|(_, given, _)| *given) {
        let problem = "is for volumes, and this is a mesh";
        return Err(Error::parameter(option, value, problem));
    }
    let given = Given {
        spacing: args.spacing,
        origin: args.origin,
    };
    let lattice = match lattice::recover(&mesh, given, job.progress()) {
        Err(Error::Geometry(_)) if params.constraint == Constraint::CellSize => {
            return of_any_mesh(job, mesh, params, args);
        }
        other => other?,
    };
    job.warn(lattice.warnings.clone());
    let frame = lattice.frame();
    let made = smooth_mc::smooth(
        &lattice.surface,
        Some(lattice.triangles()),
        frame.spacing(),
        params,
        job.progress(),
    )?;
    let piece = Piece {
        surface: lattice.surface.clone(),
        frame,
        inside: Inside::Set,
        bits: None,
        volume: None,
        mesh: Some((mesh, lattice)),
    };
    finish(job, piece, made, params, args, memory)
}

/// Measures what was made, writes and reports it.
fn finish(
    job: &mut Job,
    piece: Piece,
    (offsets, triangles, smoothing): Made,
    params: &Params,
    args: &Args,
    memory: u64,
) -> Result<Found<Asked, Stats>> {
    job.warn(thin_warning(&smoothing));
    let smoothed = Smoothed {
        surface: &piece.surface,
        spacing: piece.frame.spacing(),
        offsets: &offsets,
        triangles: &triangles,
    };
    let verified = args
        .verify
        .verify
        .then(|| {
            let voxels = piece.voxels(args.border);
            smooth_error::measure(&smoothed, voxels, memory, job.progress())
        })
        .transpose()?;
    let compared = beside::compare(job, &piece, &smoothed, params, args, memory)?;
    let bodies = bodies(job, &piece, &smoothed, &smoothing, args, memory)?;
    let mirrored = piece.frame.is_mirrored();
    let positions = piece.positions(&offsets);
    let mut mesh = match &piece.mesh {
        Some((mesh, lattice)) => Mesh {
            triangles: turned(&mesh.triangles, lattice.inverted),
            colors: mesh.colors.clone(),
            ..Mesh::from_triangles(positions, Vec::new())
        },
        None => Mesh::from_triangles(positions, turned(&triangles, mirrored)),
    };
    if let Inside::Labels(values) = &piece.inside {
        let name = |side: u16| match usize::from(side) {
            0 => 0,
            i => values[i - 1] as i32,
        };
        let of = |t: &[u32; 3]| piece.surface.sides_of(t).unwrap_or_default().map(name);
        mesh.sides = Some(triangles.iter().map(of).collect());
    }
    if job.takes_labels() {
        for (i, body) in bodies.iter().enumerate() {
            let own = piece.surface.triangles_around(i as u16 + 1, &triangles);
            let own = Mesh::from_triangles(mesh.positions.clone(), turned(&own, mirrored));
            job.write_labelled(&number(body.label), &own.compacted())?;
        }
    } else {
        job.write_mesh(&mesh)?;
    }
    let turned_by = beside::directions(&piece, &mesh, args, memory)?;
    let stats = Stats::new(&piece, smoothing, &offsets, triangles.len())
        .with(bodies, verified, compared, turned_by);
    let summary = stats.summary();
    let accuracy = stats.accuracy(params);
    let wrong = stats.wrong(params);
    job.write_preview(|_| picture(&piece, &mesh, &stats));
    let made = modelled(&piece.surface, piece.frame.dims);
    let asked = Asked {
        inside: piece.inside,
        border: args.border,
        reference: args.reference.clone(),
        params: *params,
    };
    Ok(Found::new(asked, stats, summary)
        .accuracy(Measures::Many(accuracy))
        .modelled(made)
        .check("max-error", args.max_error.max_error)
        .beyond_measure(wrong))
}

/// The bodies, where there are several.
fn bodies(
    job: &mut Job,
    piece: &Piece,
    smoothed: &Smoothed,
    smoothing: &smooth_mc::Stats,
    args: &Args,
    memory: u64,
) -> Result<Vec<Body>> {
    let (Inside::Labels(values), Some(volume)) = (&piece.inside, &piece.volume) else {
        return Ok(Vec::new());
    };
    let names = match &args.label_names {
        Some(file) => names::read(file, memory)?,
        None => BTreeMap::new(),
    };
    let mut bodies = Vec::with_capacity(values.len());
    for (i, value) in values.iter().enumerate() {
        let own = piece
            .surface
            .triangles_around(i as u16 + 1, smoothed.triangles);
        let mut misclassified_voxels = None;
        if args.verify.verify {
            let bits = isosurface::inside(volume, &Select::Equal(*value));
            let around = Smoothed {
                triangles: &own,
                ..*smoothed
            };
            let voxels = Voxels::Given(&bits);
            misclassified_voxels = around.misclassified(voxels, memory, job.progress())?;
        }
        let part = &smoothing.parts[i + 1];
        let voxels = part.voxels.unwrap_or(0);
        let percent = |volume: f64| 100.0 * volume / voxels as f64;
        bodies.push(Body {
            label: *value,
            name: names.get(&number(*value)).cloned(),
            triangles: own.len() as u64,
            voxels,
            volume_before_percent: percent(part.volume_before),
            volume_percent: percent(part.volume_after),
            misclassified_voxels,
        });
    }
    Ok(bodies)
}

/// Smooths a mesh of which nothing is known but the size of a cell: what is left of the method then is
/// the box around each vertex.
fn of_any_mesh(
    job: &mut Job,
    mesh: Mesh,
    params: &Params,
    args: &Args,
) -> Result<Found<Asked, Stats>> {
    let Some(spacing) = args.spacing else {
        let problem = "is needed: the mesh is not one of marching cubes, and shows no grid";
        return Err(Error::parameter("spacing", "DX,DY,DZ", problem));
    };
    let message =
        "the mesh is not one of marching cubes: voxels are not known, and may change sides";
    job.warn(vec![Warning::new("no-lattice", message, 1, None)]);
    let (positions, smoothing) =
        smooth_mc::smooth_in_boxes(&mesh, spacing, params, job.progress())?;
    let smooth = Mesh {
        positions,
        normals: None,
        ..mesh.clone()
    };
    job.write_mesh(&smooth)?;
    let stats = Stats::of_any_mesh(&mesh, spacing, smoothing);
    let summary = stats.summary();
    let accuracy = stats.accuracy(params);
    job.write_preview(|_| side_by_side(&mesh, &smooth, &stats));
    let asked = Asked {
        inside: Inside::Set,
        border: args.border,
        reference: args.reference.clone(),
        params: *params,
    };
    Ok(Found::new(asked, stats, summary)
        .accuracy(Measures::Many(accuracy))
        .check("max-error", args.max_error.max_error))
}

/// Triangles, turned over where that is asked for.
fn turned(triangles: &[[u32; 3]], over: bool) -> Vec<[u32; 3]> {
    let turn = |[a, b, c]: &[u32; 3]| if over { [*a, *c, *b] } else { [*a, *b, *c] };
    triangles.iter().map(turn).collect()
}

/// The grid where the user says that it is.
fn place(frame: &mut Frame, args: &Args) {
    if let Some(steps) = args.spacing {
        *frame = Frame::straight(frame.dims, frame.origin, steps);
    }
    if let Some(origin) = args.origin {
        frame.origin = origin;
    }
}

fn thin_warning(stats: &smooth_mc::Stats) -> Vec<Warning> {
    let message = "parts keep less than a tenth of their volume; --thin guard holds more";
    if stats.vanishing == 0 {
        return Vec::new();
    }
    vec![Warning::new(
        "vanishing-parts",
        message,
        stats.vanishing,
        None,
    )]
}

/// Says so where there is no surface.
pub fn empty(surface: &Surface) -> Vec<Warning> {
    let message = "the surface is empty: no voxel is inside, or all are and the border is open";
    let warning = || Warning::new("empty-surface", message, 1, None);
    surface.is_empty().then(warning).into_iter().collect()
}

/// Cells that hold the surface, of those of the volume.
pub fn modelled(surface: &Surface, dims: [usize; 3]) -> Modelled {
    let full = dims.iter().map(|n| *n as u64 + 1).product();
    Modelled::new("cells", surface.cells, full, surface.bytes())
}

/// The surface of marching cubes, and beside it the smooth one.
fn picture(piece: &Piece, smooth: &Mesh, stats: &Stats) -> Result<Vec<u8>> {
    let before = Mesh::from_triangles(
        piece.positions(&vec![[0.0; 3]; piece.surface.len()]),
        smooth.triangles.clone(),
    );
    side_by_side(&before, smooth, stats)
}

fn side_by_side(before: &Mesh, smooth: &Mesh, stats: &Stats) -> Result<Vec<u8>> {
    let panels = [
        Panel {
            label: "marching cubes",
            what: What::Mesh(before),
            colour: CLAY,
        },
        Panel {
            label: "smooth",
            what: What::Mesh(smooth),
            colour: OKABE_ITO[2],
        },
    ];
    let params = preview::Params {
        up: preview::Up::Z,
        ..preview::Params::DEFAULT
    };
    preview::side_by_side(&panels, &stats.turned(), "", &params)
}
