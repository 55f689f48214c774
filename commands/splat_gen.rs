//! `scantle splat-gen`: a cloud of points under discs that keep to an error bound.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::found::Found;
use crate::job::Job;
use crate::shared::{
    Common, Inputs, MaxError, Output, Preview, Seed, SkipBad, Verify, named, parsed,
};
use crate::table::short;
use clap::value_parser;
use scantle::error::{Result, number};
use scantle::image::colour::CLAY;
use scantle::io;
use scantle::io::format::{Format, Kind};
use scantle::measure::splat_cover::{self, Coverage};
use scantle::measure::splat_holes::{self, Holes, Piece, Truth, Views};
use scantle::mesh::Mesh;
use scantle::mesh::sampling;
use scantle::points::Splats;
use scantle::points::splat::{self, Cover, Length, Order, Orient, Params};
use scantle::render::preview::{self, Panel, Up, What};
use scantle::report::{Accuracy, Measures, Modelled};
use schemars::JsonSchema;
use serde::Serialize;

/// Cover a point cloud by discs that keep to an error bound
///
/// Each disc has a field of normals, so that few are enough where a surface is smooth. Every point is
/// measured against the discs afterwards: how far it is from the one that covers it, and whether one does.
/// Normals are those of the file, or estimated from neighbours and turned outwards.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// How far points may be above or below the disc that covers them: in the cloud's unit, or as a share
    /// of the diagonal of its box
    #[arg(long, value_name = "X|X%", default_value = "0.1%", value_parser = parsed(Length::from_name, "a length such as 0.05, or a share of the diagonal such as 0.1%"), allow_hyphen_values = true)]
    delta: Length,
    /// Points covered within this share of a disc's radius start no disc of their own, from 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = Params::DEFAULT.perc, allow_hyphen_values = true)]
    perc: f64,
    /// Neighbours that normals are estimated from
    #[arg(long, value_name = "K", default_value_t = Params::DEFAULT.neighbors as u16, value_parser = value_parser!(u16).range(*Params::NEIGHBORS.start() as i64..=*Params::NEIGHBORS.end() as i64))]
    neighbors: u16,
    /// Which side of the surface is outside: `mst`, by a minimum spanning tree over neighbours;
    /// `viewpoint:X,Y,Z`, the side that a scanner there saw; `keep`, as given, and upwards where normals
    /// are estimated
    #[arg(long, value_name = "WAY", default_value = "mst", value_parser = parsed(Orient::from_name, "mst, viewpoint:X,Y,Z or keep"))]
    orient: Orient,
    /// Which discs are kept: `paper`, one from each point that none before it covers near its centre;
    /// `greedy`, always the one that covers most of what is left, which gives fewer
    #[arg(long, default_value = Params::DEFAULT.cover.name(), value_parser = named(Cover::NAMES, Cover::from_name))]
    cover: Cover,
    /// In which order points start discs: `morton`, along a curve through space; `file`, as they stand
    /// there; `random:SEED`
    #[arg(long, value_name = "ORDER", default_value = "morton", value_parser = parsed(Order::from_name, "morton, file or random:SEED"))]
    order: Order,
    /// The largest radius of a disc, as --delta
    #[arg(long, value_name = "R|R%", default_value = "5%", value_parser = parsed(Length::from_name, "a length such as 2.5, or a share of the diagonal such as 5%"), allow_hyphen_values = true)]
    max_radius: Length,
    /// Estimate normals though the file has some; these are what the result is then measured against
    #[arg(long)]
    estimate_normals: bool,
    /// Keep the sign of given normals even where many disagree with those beside them
    #[arg(long, conflicts_with = "estimate_normals")]
    trust_normals: bool,
    /// Cover so many points spread evenly over the triangles of a mesh, instead of its vertices
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1 << 30))]
    sample: Option<u32>,
    /// What is written: `scantle`, all that is known of each disc (PLY); `gaussian`, 3D Gaussians, which
    /// viewers of splats open (PLY); `discs`, polygons, in any format of meshes. Without it the file's
    /// name tells
    #[arg(long, value_name = "FORMAT", requires = "output", conflicts_with = "output_format", value_parser = named(Form::NAMES, Form::from_name))]
    format: Option<Form>,
    /// Sides of the polygons that stand for discs in a mesh
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = value_parser!(u16).range(3..=1024))]
    sides: u16,
    #[command(flatten)]
    skip_bad: SkipBad,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    preview: Preview,
    #[command(flatten)]
    seed: Seed,
    #[command(flatten)]
    max_error: MaxError,
    #[command(flatten)]
    verify: Verify,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
The first measure of `accuracy`, which --max-error checks, is the largest distance of a point to the
disc that covers it best, as a share of the diagonal; it is always measured. --verify also looks at the
discs from all around, for holes.

Examples:
  scantle splat-gen fixtures/clouds/ball.xyz --delta 2% --max-radius 20% -o ball.ply
  scantle splat-gen fixtures/shapes/torus-knot.ply --sample 20000 --delta 0.5% -o knot.glb
";

/// What is written of discs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// All that is known.
    Scantle,
    /// 3D Gaussians.
    Gaussian,
    /// Polygons.
    Discs,
}

impl Form {
    const NAMES: &'static [&'static str] = &["scantle", "gaussian", "discs"];

    fn from_name(name: &str) -> Option<Self> {
        match name {
            "scantle" => Some(Form::Scantle),
            "gaussian" => Some(Form::Gaussian),
            "discs" => Some(Form::Discs),
            _ => None,
        }
    }
}

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    #[serde(flatten)]
    params: Params,
    /// Whether given normals were left aside.
    estimate_normals: bool,
    /// Points sampled on the mesh; null where the vertices were covered.
    sample: Option<u32>,
    /// What samples were drawn from; null where there are none.
    seed: Option<u64>,
    /// Whether bad points were left out.
    skip_bad: bool,
    /// What was written; null where nothing was.
    format: Option<Form>,
    /// Sides of the polygons; null where none were written.
    sides: Option<u16>,
}

/// What was found.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    #[serde(flatten)]
    made: splat::Stats,
    /// Every point against all discs over it.
    coverage: Coverage,
    /// What is seen from around, where `--verify` looked.
    #[serde(skip_serializing_if = "Option::is_none")]
    holes: Option<Holes>,
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Bytes that covering takes for each point, at most.
const BYTES_PER_POINT: u128 = 400;

/// The views that holes are looked for from.
const VIEWS: Views = Views {
    count: 20,
    pixels: 512,
};

/// How far behind the surface a disc fills it, in bounds: discs that cover the same points are up to two
/// apart, and so are the points beside them that noise puts on either side.
const BEHIND: f64 = 4.0;

/// Covers each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let params = Params {
        delta: args.delta,
        perc: args.perc,
        neighbors: usize::from(args.neighbors),
        max_radius: args.max_radius,
        order: args.order,
        cover: args.cover,
        orient: args.orient,
        trust_normals: args.trust_normals,
    };
    params.check()?;
    let files = Files::each(&args.inputs)
        .output(&args.output)
        .preview(&args.preview);
    context.run("splat-gen", &files, |job| splat_gen(job, &params, args))
}

fn splat_gen(job: &mut Job, params: &Params, args: &Args) -> Result<Found<Asked, Stats>> {
    let form = form(job, args)?;
    job.skip_bad(args.skip_bad.skip_bad);
    let mut mesh = job.read_mesh()?;
    let name = job.words()[0].clone();
    let points = args.sample.map_or(mesh.positions.len() as u128, u128::from);
    job.expect_room("the cloud", points * BYTES_PER_POINT)?;
    let mut cloud = match args.sample {
        Some(count) => sampling::sample(&mesh, u64::from(count), args.seed.seed)?,
        None => std::mem::take(&mut mesh),
    };
    let truth = cloud.normals.clone();
    if args.estimate_normals {
        cloud.normals = None;
    }
    let (splats, made) = splat::generate(&cloud, params, job.progress())?;
    job.progress().stage("check", 0);
    let coverage = splat_cover::coverage(
        &cloud.positions,
        &splats.splats,
        made.delta.abs,
        truth.as_deref(),
    );
    let holes = args.verify.verify.then(|| {
        job.progress().stage("holes", 0);
        let behind = BEHIND * made.delta.abs.max(made.error.max);
        let holes = |truth| splat_holes::holes(&truth, &splats.splats, behind, VIEWS);
        match args.sample {
            Some(_) => holes(Truth::Mesh(&mesh)),
            None => holes(Truth::Pieces(&Piece::around(
                &cloud.positions,
                params.neighbors,
            ))),
        }
    });
    job.warn(made.warnings());
    match form {
        Some(Form::Discs) => {
            job.write_mesh(&io::splats::discs(&splats, usize::from(args.sides))?)?;
        }
        Some(Form::Gaussian) => job.write_splats_as(&splats, Format::Gaussians)?,
        Some(Form::Scantle) => job.write_splats(&splats)?,
        None => {}
    }
    // Laser scans of land stand upright in what surveyors call z.
    let is_scan = job
        .input()
        .is_some_and(|input| ["las", "laz"].contains(&&*input.format));
    let up = if is_scan { Up::Z } else { Up::Y };
    job.write_preview(|_| picture(&name, up, &cloud, &splats, &made));
    let summary = match coverage.max_distance {
        Some(distance) => format!(
            "{} discs for {} points, {} not covered, at most {} away",
            made.splats,
            made.points,
            coverage.uncovered,
            number(distance)
        ),
        None => format!("no disc for {} points", made.points),
    };
    let asked = Asked {
        params: *params,
        estimate_normals: args.estimate_normals,
        sample: args.sample,
        seed: args.sample.map(|_| args.seed.seed),
        skip_bad: args.skip_bad.skip_bad,
        format: form,
        sides: (form == Some(Form::Discs)).then_some(args.sides),
    };
    let accuracy = accuracy(&made, &coverage, holes.as_ref(), args.sample.is_some());
    let modelled = Modelled::new("discs", made.splats, made.points, made.bytes_after);
    let stats = Stats {
        made,
        coverage,
        holes,
    };
    Ok(Found::new(asked, stats, summary)
        .accuracy(Measures::Many(accuracy))
        .modelled(modelled)
        .check("max-error", args.max_error.max_error))
}

/// What is to be written, which the format of the output must be able to hold.
fn form(job: &Job, args: &Args) -> Result<Option<Form>> {
    let Some(format) = job.output_format_for(Kind::Splats) else {
        return Ok(None);
    };
    let form = args.format.unwrap_or(match (format, format.kind()) {
        (Format::Gaussians, _) => Form::Gaussian,
        (_, Kind::Mesh) => Form::Discs,
        _ => Form::Scantle,
    });
    match form {
        Form::Discs => job.expect_output(&[Kind::Mesh])?,
        _ => job.expect_output(&[Kind::Splats])?,
    }
    Ok(Some(form))
}

fn accuracy(
    made: &splat::Stats,
    coverage: &Coverage,
    holes: Option<&Holes>,
    sampled: bool,
) -> Vec<Accuracy> {
    let diagonal = made.delta.diag.map(|share| made.delta.abs / share);
    let of_diagonal = |length: f64| diagonal.map(|diagonal| length / diagonal);
    let trade = &splat::TRADE;
    let mut all = vec![
        Accuracy {
            measure: trade.error.name.to_owned(),
            unit: trade.error.unit.to_owned(),
            // Points on lines have no disc, and may be any distance from those of others.
            bound: made.delta.diag.filter(|_| made.lines == 0),
            reached: coverage.max_distance.and_then(of_diagonal),
            reference: trade.reference.to_owned(),
            verified: true,
        },
        Accuracy {
            measure: "points that no disc covers".to_owned(),
            unit: "points".to_owned(),
            bound: Some(made.lines as f64),
            reached: Some(coverage.uncovered as f64),
            reference: trade.reference.to_owned(),
            verified: true,
        },
    ];
    if let Some(angle) = coverage.normal_rms_deg {
        all.push(Accuracy {
            measure: "root mean square of the angle between given normals and the discs' fields"
                .into(),
            unit: "degrees".to_owned(),
            bound: None,
            reached: Some(angle),
            reference: "the normals of the input, or of the triangles sampled".to_owned(),
            verified: true,
        });
    }
    if let Some(holes) = holes {
        all.push(Accuracy {
            measure: "share of the visible surface that no disc covers".to_owned(),
            unit: "share of pixels".to_owned(),
            bound: None,
            reached: Some(holes.share),
            reference: format!(
                "{}, seen from {} sides, with a disc at most {BEHIND} bounds behind it",
                match sampled {
                    true => "the mesh",
                    false => "a disc of the spacing around each point",
                },
                VIEWS.count
            ),
            verified: true,
        });
    }
    all
}

fn picture(
    name: &str,
    up: Up,
    cloud: &Mesh,
    splats: &Splats,
    made: &splat::Stats,
) -> Result<Vec<u8>> {
    let discs = io::splats::discs(splats, 12)?;
    let label = format!("{} points, {} discs", cloud.positions.len(), made.splats);
    let panels = [Panel {
        label: &label,
        what: What::Mesh(&discs),
        colour: CLAY,
    }];
    let caption = format!("{name}: every point within {}", short(made.delta.abs));
    let params = preview::Params {
        up,
        ..preview::Params::DEFAULT
    };
    preview::side_by_side(&panels, &caption, "", &params)
}
