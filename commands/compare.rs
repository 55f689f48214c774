//! `scantle compare`: how far two results of one kind are from each other.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, InputFormat, Seed, not_negative};
use crate::words;
use scantle::anim::Clip;
use scantle::error::{Error, Fault, Result, number};
use scantle::image::samples::Image;
use scantle::io::Content;
use scantle::io::format::{Format, Kind};
use scantle::measure::animation_error::{AnimationError, animation_error};
use scantle::measure::image_difference::{self, ImageDifference};
use scantle::measure::mesh_distance::{self, MeshDifference};
use scantle::measure::report_difference::{self, ReportDifference};
use scantle::measure::volume_difference::{self, VolumeDifference};
use scantle::mesh::Mesh;
use scantle::report::Measures;
use scantle::volume::Volume;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

/// Measure how far two meshes, volumes, images, animations or reports are from each other
///
/// Meshes: the Hausdorff distance with a proven bound, mean and root mean square distances, area
/// and volume. Volumes of the same dimensions: the voxels that differ, and by how much. Images of
/// the same size: the pixels that differ, the largest difference of a channel, PSNR and SSIM.
/// Animations of as many vertices and frames (pc2, mdd, sanim): the errors of Karni and Gotsman, root
/// mean square and largest distance, frame by frame; those of other kinds are for `compress-anim eval`.
/// Reports, or any other JSON: what differs, each place named by its JSON pointer, and the largest
/// relative difference of two numbers. JSON Lines are compared document by document. Of two reports
/// of scantle, what depends on the run and not on the result is left out: the block `run`, the
/// `path` of each input and output, and what both reports list in `varies`, such as the seconds that
/// `tradeoff` measures.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// The two files; `-` for standard input
    #[arg(value_names = ["A", "B"], num_args = 2, required = true)]
    inputs: Vec<String>,
    #[command(flatten)]
    format: InputFormat,
    /// Exit with 1 when they differ by more than X: for meshes the Hausdorff distance in the file's
    /// unit, for volumes the number of voxels that differ, while another place of the grid fails, for
    /// images the largest difference of a channel in steps of eight bits (255 is full), for animations
    /// the error about the centroids in percent, for reports the largest relative difference of two
    /// numbers, |a - b| / max(|a|, |b|), while any other difference fails
    #[arg(long, value_name = "X", value_parser = not_negative)]
    tolerance: Option<f64>,
    /// Points spread over each mesh for mean and root mean square
    #[arg(long, value_name = "N", default_value_t = mesh_distance::Params::DEFAULT.samples)]
    samples: u64,
    /// Compare reports whole: `run`, paths and what they list in `varies` too
    #[arg(long)]
    everything: bool,
    #[command(flatten)]
    seed: Seed,
    #[command(flatten)]
    common: Common,
}

const EXAMPLES: &str = "\
Examples:
  scantle compare fixtures/shapes/cube.obj fixtures/shapes/cube.ply --tolerance 0
  scantle compare fixtures/shapes/torus.obj fixtures/shapes/sphere.stl
";

/// What was asked for.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub struct Params {
    /// The largest difference allowed, null without a check.
    tolerance: Option<f64>,
    /// How meshes were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<mesh_distance::Params>,
    /// How volumes were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    volume: Option<volume_difference::Params>,
    /// How reports were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<report_difference::Params>,
}

/// How they differ.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Stats {
    /// Two meshes.
    Mesh(Box<MeshDifference>),
    /// Two volumes.
    Volume(Box<VolumeDifference>),
    /// Two images.
    Image(Box<ImageDifference>),
    /// Two animations.
    Animation(Box<AnimationError>),
    /// Two reports, or other files of JSON.
    Report(Box<ReportDifference>),
}

/// The report of this command.
pub type Report = scantle::report::Report<Params, Stats>;

/// What the comparison of two things of one kind found.
type Compared = Result<Found<Params, Stats>>;

/// Compares the two.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    args.for_meshes().check()?;
    args.for_reports().check()?;
    let files = Files::together(&args.inputs, &args.format);
    context.run("compare", &files, |job| {
        let found = match job.read()? {
            Content::Mesh(a) => meshes(job, &a, args),
            Content::Volume(a) => volumes(job, &a, args),
            Content::Image(a) => images(job, &a, args),
            Content::Animation(a) => animations(job, &a, args),
            Content::Report(a) => reports(job, &a, args),
            Content::Molecule(_) => Err(no_measure(job, Kind::Molecule)),
            Content::Splats(_) => Err(no_measure(job, Kind::Splats)),
            Content::Terrain(_) => Err(no_measure(job, Kind::Terrain)),
            Content::Vectors(_) => Err(no_measure(job, Kind::Vectors)),
        };
        Ok(found?.check("tolerance", args.tolerance))
    })
}

/// The error of a kind that there is no measure for.
fn no_measure(job: &Job, kind: Kind) -> Error {
    let format = job.input().map_or("", |input| input.format.as_str());
    let problem = format!(
        "holds {} ({format}), which has no measure here",
        kind.with_article()
    );
    let hint = "two meshes, volumes, images, animations or reports can be compared";
    Error::Geometry(Fault::whole(problem).with_hint(hint))
}

impl Args {
    /// The parameters that every kind has.
    fn for_any_kind(&self) -> Params {
        Params {
            tolerance: self.tolerance,
            ..Params::default()
        }
    }

    fn for_meshes(&self) -> mesh_distance::Params {
        mesh_distance::Params {
            samples: self.samples,
            seed: self.seed.seed,
            ..mesh_distance::Params::DEFAULT
        }
    }

    fn for_reports(&self) -> report_difference::Params {
        let default = report_difference::Params::DEFAULT;
        report_difference::Params {
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            everything: self.everything,
        }
    }
}

fn meshes(job: &mut Job, a: &Mesh, args: &Args) -> Compared {
    let b = job.read_mesh()?;
    let params = args.for_meshes();
    let difference = mesh_distance::compare(a, &b, &params, job.progress())?;
    let params = Params {
        mesh: Some(params),
        ..args.for_any_kind()
    };
    let summary = format!(
        "hausdorff distance {} (at most {}), rms {}",
        number(difference.hausdorff),
        number(difference.hausdorff_bound),
        number(difference.rms)
    );
    let accuracy = Measures::One(difference.accuracy());
    Ok(Found::new(params, Stats::Mesh(Box::new(difference)), summary).accuracy(accuracy))
}

fn volumes(job: &mut Job, a: &Volume, args: &Args) -> Compared {
    let a_is_placed = is_placed(job);
    let b = job.read_volume()?;
    let both_placed = a_is_placed && is_placed(job);
    let params = volume_difference::Params::DEFAULT;
    let difference = volume_difference::compare(a, &b, &params, job.progress())?;
    job.warn(difference.warnings());
    let params = Params {
        volume: Some(params),
        ..args.for_any_kind()
    };
    let (differing, voxels) = (difference.differing, difference.voxels);
    let summary = format!("{differing} of {voxels} voxels differ");
    let accuracy = Measures::One(difference.accuracy());
    let beyond = difference.beyond_measure().filter(|_| both_placed);
    Ok(
        Found::new(params, Stats::Volume(Box::new(difference)), summary)
            .accuracy(accuracy)
            .beyond_measure(beyond),
    )
}

/// Whether the volume read last says where it is.
fn is_placed(job: &Job) -> bool {
    let format = job
        .input()
        .and_then(|input| Format::from_name(&input.format));
    format.is_none_or(Format::holds_place)
}

fn images(job: &mut Job, a: &Image, args: &Args) -> Compared {
    let b = job.read_image()?;
    job.expect_room("comparing two images", image_difference::room(a))?;
    let difference = image_difference::compare(a, &b, job.progress())?;
    let params = args.for_any_kind();
    let (differing, pixels, max) = (difference.differing, difference.pixels, difference.max);
    let summary = format!(
        "{differing} of {pixels} pixels differ, by at most {} of 255",
        number(max)
    );
    let accuracy = Measures::One(difference.accuracy());
    Ok(Found::new(params, Stats::Image(Box::new(difference)), summary).accuracy(accuracy))
}

fn animations(job: &mut Job, a: &Clip, args: &Args) -> Compared {
    let b = job.read_animation()?;
    let error = animation_error(a, &b)?;
    let (summary, accuracy) = (
        words::animation_error(&error),
        error.accuracy("every vertex of every frame"),
    );
    let params = args.for_any_kind();
    Ok(Found::new(params, Stats::Animation(Box::new(error)), summary).accuracy(accuracy))
}

fn reports(job: &mut Job, a: &[Value], args: &Args) -> Compared {
    let b = job.read_report()?;
    let params = args.for_reports();
    let difference = report_difference::compare(a, &b, &params, job.progress())?;
    let params = Params {
        report: Some(params),
        ..args.for_any_kind()
    };
    let (differing, within) = (difference.differing, difference.within);
    let mut summary = words::counted(differing, "difference", "differences");
    summary += &format!(
        " in {}",
        words::counted(difference.values, "value", "values")
    );
    if within > 0 {
        summary += &format!(", {within} more within the tolerance");
    }
    let worst = difference.worst.as_ref().map(ToString::to_string);
    if let Some(worst) = &worst {
        summary += &format!("; the worst is {worst}");
    }
    let beyond = worst.filter(|_| difference.other > 0);
    let accuracy = Measures::One(difference.accuracy());
    Ok(
        Found::new(params, Stats::Report(Box::new(difference)), summary)
            .accuracy(accuracy)
            .beyond_measure(beyond),
    )
}
