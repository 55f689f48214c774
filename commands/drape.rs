//! `scantle drape`: lines and outlines of areas laid on terrain.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::found::Found;
use crate::job::Job;
use crate::land::Land;
use crate::shared::{Common, InputFormat, MaxError, Output, Verify};
use scantle::error::{Result, number};
use scantle::io::format::Kind;
use scantle::measure::drape_error::drape_error;
use scantle::mesh::Mesh;
use scantle::numeric::vector::Vec3;
use scantle::report::{Accuracy, Measures, Modelled, Warning};
use scantle::terrain::Grid;
use scantle::terrain::drape::{self, Draped, Params};
use scantle::terrain::surface::{self, Surface};
use scantle::vector::{Feature, Layer, Raised, Shape};
use schemars::JsonSchema;
use serde::Serialize;

/// Lay lines and the outlines of areas on terrain
///
/// Lines are split at every edge of the surface that they cross, so that they lie on it everywhere and not
/// only at their vertices. Lengths and areas are measured along it. What is outside the terrain or over
/// missing heights is cut out. Layers in another reference system are brought into that of the terrain.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER)]
pub struct Args {
    #[command(flatten)]
    land: Land,
    /// Farthest that a piece may be above or below a bilinear patch, in the unit of heights
    #[arg(long, value_name = "Z", default_value_t = Params::DEFAULT.max_error, allow_hyphen_values = true)]
    patch_error: f64,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    max_error: MaxError,
    #[command(flatten)]
    verify: Verify,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
The result is GeoJSON with heights, or a mesh of lines (OBJ, GLB, PLY). The measure of `accuracy` is the
largest height of a line over the surface or under it; --verify measures it on all pieces.

Examples:
  scantle drape --terrain fixtures/terrain/hills.tif \\
    --vectors fixtures/vectors/hills.geojson -o draped.geojson
  scantle drape --terrain fixtures/terrain/hills.tif \\
    --vectors fixtures/vectors/walk.gpx --surface bilinear --verify
";

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The surface between heights.
    surface: surface::Kind,
    /// Farthest that a piece may be from a bilinear patch.
    patch_error: f64,
}

/// What was found.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// Sums over all layers.
    all: drape::Stats,
    /// Each feature, layer by layer in the order of its file.
    features: Vec<Measured>,
}

/// A feature on the surface.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Measured {
    /// The layer, from 0 in the order in which they are named.
    layer: usize,
    /// The feature, from 0.
    feature: usize,
    #[serde(flatten)]
    measures: drape::Measures,
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Drapes all layers.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let params = Params {
        max_error: args.patch_error,
    };
    params.check()?;
    let words = args.land.words();
    let format = InputFormat { input_format: None };
    let files = Files::together(&words, &format).output(&args.output);
    context.run("drape", &files, |job| run_job(job, &params, args))
}

fn run_job(job: &mut Job, params: &Params, args: &Args) -> Result<Found<Asked, Stats>> {
    job.expect_output(&[Kind::Vectors, Kind::Mesh])?;
    let (grid, layers) = args.land.read(job)?;
    let kind = args.land.surface();
    let surface = args.land.surface_of(&grid)?;
    let all = gathered(layers);
    let (draped, stats) = drape::drape(&all.layer.features, &surface, params, job.progress())?;
    let lines = || {
        draped
            .iter()
            .flat_map(|draped| draped.lines.iter().cloned())
    };
    let reached = args.verify.verify.then(|| {
        job.progress().stage("check", 0);
        let lines: Vec<Vec<Vec3>> = lines().collect();
        drape_error(&grid, kind, &lines).0
    });
    job.warn(warnings(&stats));
    match job
        .output_format_for(Kind::Vectors)
        .map(|format| format.kind())
    {
        Some(Kind::Mesh) => job.write_mesh(&mesh_of(lines()))?,
        Some(_) => {
            let shapes = all.layer.features.iter().zip(&draped);
            let shapes: Vec<Raised> = shapes.map(|(f, d)| raised(f, d)).collect();
            job.write_raised_vectors(&all.layer, &shapes)?;
        }
        None => {}
    }
    let summary = format!(
        "{} of {} features on the surface, {} vertices, {} long",
        stats.features,
        all.layer.features.len(),
        stats.sum.vertices,
        number((stats.sum.length_3d * 1e3).round() / 1e3)
    );
    let features = draped.iter().zip(&all.numbers);
    let features = features.map(|(draped, (layer, feature))| Measured {
        layer: *layer,
        feature: *feature,
        measures: draped.measures,
    });
    let rounding = rounding(&grid, &surface);
    let accuracy = Accuracy {
        measure: "largest distance along z between a line and the surface".to_owned(),
        unit: "unit of heights".to_owned(),
        bound: Some(match kind {
            surface::Kind::Tin => rounding,
            surface::Kind::Bilinear => params.max_error + rounding,
        }),
        reached,
        reference: "heights of the surface found anew at nine places of each piece".to_owned(),
        verified: reached.is_some(),
    };
    let [columns, rows] = surface.squares();
    let modelled = Modelled::new(
        "vertices",
        stats.sum.vertices,
        (columns * rows * 2) as u64,
        stats.sum.vertices * size_of::<Vec3>() as u64,
    );
    let found = Stats {
        all: stats,
        features: features.collect(),
    };
    let asked = Asked {
        surface: kind,
        patch_error: params.max_error,
    };
    Ok(Found::new(asked, found, summary)
        .accuracy(Measures::One(accuracy))
        .modelled(modelled)
        .check("max-error", args.max_error.max_error))
}

/// What a few roundings of places on the map and of heights may come to, on the steepest slope there can be.
fn rounding(grid: &Grid, surface: &Surface) -> f64 {
    let largest = |all: &[f64]| all.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    let [bottom, top] = surface.range();
    let [width, height] = grid.transform.cell_size();
    let steepest = (top - bottom) / width.min(height);
    let place = largest(grid.extent().as_flattened());
    16.0 * f64::EPSILON * (largest(&[bottom, top]) + place * steepest)
}

/// All features as one layer, and of each its layer and its number in it.
struct Gathered {
    layer: Layer,
    numbers: Vec<(usize, usize)>,
}

/// Several layers become one; features then have the name of theirs as a property.
fn gathered(mut layers: Vec<Layer>) -> Gathered {
    let mut numbers = Vec::new();
    for (number, layer) in layers.iter().enumerate() {
        numbers.extend((0..layer.features.len()).map(|feature| (number, feature)));
    }
    let several = layers.len() > 1;
    for layer in &mut layers {
        for feature in layer.features.iter_mut().filter(|_| several) {
            let name = layer.name.clone().into();
            feature.properties.insert("layer".to_owned(), name);
        }
    }
    let mut layers = layers.into_iter();
    let mut layer = layers.next().unwrap_or_default();
    layer
        .features
        .extend(layers.flat_map(|other| other.features));
    Gathered { layer, numbers }
}

/// What was draped as a shape: outlines are lines, as the surface within them is not flat.
fn raised(feature: &Feature, draped: &Draped) -> Raised {
    match &feature.shape {
        _ if draped.lines.is_empty() => Raised::Empty,
        Shape::Points(_) => Raised::Points(draped.lines.iter().flatten().copied().collect()),
        _ => Raised::Lines(draped.lines.clone()),
    }
}

fn mesh_of(lines: impl Iterator<Item = Vec<Vec3>>) -> Mesh {
    let mut mesh = Mesh::default();
    for line in lines {
        let first = mesh.positions.len() as u32;
        let last = first + line.len() as u32 - 1;
        match line.len() {
            1 => mesh.points.push(first),
            _ => mesh.segments.extend((first..last).map(|v| [v, v + 1])),
        }
        mesh.positions.extend(line);
    }
    mesh
}

fn warnings(stats: &drape::Stats) -> Vec<Warning> {
    let mut all = Vec::new();
    let mut warn = |code, count: u64, message: &str| {
        if count > 0 {
            all.push(Warning::new(code, message, count, None));
        }
    };
    warn(
        "empty-features",
        stats.empty,
        "features have no usable shape",
    );
    warn(
        "outside",
        stats.outside,
        "features lie wholly outside the terrain or over missing heights",
    );
    warn(
        "short-rings",
        stats.dropped.too_short + stats.dropped.zero_area,
        "lines and rings of too few places, or on one line, are left out",
    );
    if stats.sum.length_cut > 0.0 {
        let message = format!(
            "a length of {} lies outside the terrain or over missing heights, and is cut out",
            number((stats.sum.length_cut * 1e3).round() / 1e3)
        );
        all.push(Warning::new("cut", message, 1, None));
    }
    all
}
