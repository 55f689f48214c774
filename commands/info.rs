//! `scantle info`: what is in a file, and what looks wrong with it.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, SkipBad};
use crate::words;
use scantle::anim::motion::{Motion, motion};
use scantle::error::{Result, number};
use scantle::io::Content;
use scantle::mesh::cloud::{CloudInventory, inventory as inventory_of_cloud};
use scantle::mesh::topology::{Topology, topology};
use scantle::points::Splats;
use scantle::protein::inventory::{Inventory, inventory};
use scantle::report::{Made, made_by};
use scantle::volume::Volume;
use scantle::{terrain, vector};
use schemars::JsonSchema;
use serde::Serialize;

/// Tell what is in a file, and what looks wrong with it
///
/// Counts, bounds and, of a mesh, its topology: whether it is closed, oriented and manifold. Of a
/// cloud, what its points carry, and which are duplicates; of splats, their radii and errors. Of a
/// volume, where it is, what is set and the range of values; of an image, its size and samples; of a
/// molecule, its chains, residues and elements; of an animation, its frames and what of it moves. Of a terrain, its cells, heights and
/// reference system; of features on a map, their shapes and properties. Of JSON, the documents, and which
/// commands they are reports of.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    skip_bad: SkipBad,
    #[command(flatten)]
    common: Common,
}

const EXAMPLES: &str = "\
Examples:
  scantle info fixtures/shapes/cube.obj
  scantle info fixtures/shapes/*.obj --report shapes.jsonl
";

/// Commands, versions and kinds of residues that are named to a person.
const NAMED: usize = 4;

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Params {
    /// Whether points that have a number which is not finite are left out of clouds.
    skip_bad: bool,
}

/// What is in the file.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Stats {
    /// Triangles, polylines, points.
    Mesh(Box<Topology>),
    /// Points alone.
    Cloud(Box<CloudInventory>),
    /// Discs with a field of normals.
    Splats(Box<SplatStats>),
    /// Voxels.
    Volume(VolumeStats),
    /// Pixels.
    Image(ImageStats),
    /// Atoms.
    Molecule(Box<Inventory>),
    /// A mesh, or a cloud, whose vertices move.
    Animation(Motion),
    /// Heights on a map.
    Terrain(Box<terrain::inventory::Inventory>),
    /// Features on a map.
    Vectors(Box<vector::inventory::Inventory>),
    /// JSON documents.
    Report(ReportStats),
}

/// What is in a volume.
#[derive(Debug, Serialize, JsonSchema)]
pub struct VolumeStats {
    /// Centre of voxel (0, 0, 0).
    origin: [f64; 3],
    /// Distance between neighbouring voxels along each axis.
    spacing: [f64; 3],
    /// Whether each axis of the grid points along its own coordinate axis.
    straight: bool,
    /// Voxels.
    voxels: u64,
    /// Voxels that are not 0.
    set: u64,
    /// Smallest value, null where there is no number or it is infinite.
    min: Option<f64>,
    /// Largest value, null where there is no number or it is infinite.
    max: Option<f64>,
}

/// What is in a set of splats.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SplatStats {
    /// Splats.
    splats: u64,
    /// Smallest, median (the lower of two) and largest radius, in the file's unit.
    radius: [Option<f64>; 3],
    /// The largest height of a point above or below its splat, in the file's unit.
    max_error: f64,
    /// Points that all splats cover, each counted once for every splat that does.
    covered: u64,
    /// Whether splats have colours.
    colours: bool,
    /// Whether splats have classes.
    classes: bool,
    /// Bytes that they take in memory.
    bytes: u64,
}

/// What is in an image.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ImageStats {
    /// Pixels along a row.
    width: u64,
    /// Rows.
    height: u64,
    /// Samples of a pixel: 1 grey, 2 with opacity, 3 colour, 4 with opacity.
    channels: u64,
    /// Bits of a sample.
    bits: u32,
}

/// What is in a file of JSON.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ReportStats {
    /// Documents.
    documents: u64,
    /// Those of them that are reports of scantle, by command and version.
    reports: Vec<Made>,
}

/// The report of this command.
pub type Report = scantle::report::Report<Params, Stats>;

/// Looks into each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let params = || Params {
        skip_bad: args.skip_bad.skip_bad,
    };
    context.run("info", &Files::each(&args.inputs), |job| {
        look(job, params())
    })
}

fn look(job: &mut Job, params: Params) -> Result<Found<Params, Stats>> {
    job.skip_bad(params.skip_bad);
    let content = job.read()?;
    let mut summary = job
        .input()
        .map(|input| words::content(&input.content))
        .unwrap_or_default();
    let stats = match content {
        Content::Mesh(mesh) if mesh.is_cloud() => {
            job.progress().stage("count", 0);
            let inventory = inventory_of_cloud(&mesh)?;
            job.warn(inventory.warnings());
            summary += &carried_in_words(&inventory);
            Stats::Cloud(Box::new(inventory))
        }
        Content::Splats(splats) => {
            job.progress().stage("count", 0);
            let stats = splat_stats(&splats);
            if let [Some(min), _, Some(max)] = stats.radius {
                summary += &format!(", of radius {} to {}", number(min), number(max));
            }
            Stats::Splats(Box::new(stats))
        }
        Content::Mesh(mesh) => {
            let topology = topology(&mesh, job.progress())?;
            job.warn(topology.warnings());
            summary += if topology.closed { ", closed" } else { "" };
            Stats::Mesh(Box::new(topology))
        }
        Content::Volume(volume) => {
            job.progress().stage("count", 0);
            job.warn(volume.warnings());
            let stats = volume_stats(&volume);
            summary += &format!(", {} set", stats.set);
            Stats::Volume(stats)
        }
        Content::Image(image) => Stats::Image(ImageStats {
            width: image.width as u64,
            height: image.height as u64,
            channels: image.channels as u64,
            bits: image.bits(),
        }),
        Content::Molecule(molecule) => {
            job.progress().stage("count", 0);
            let inventory = inventory(&molecule);
            job.warn(inventory.warnings());
            summary += &chains_in_words(&inventory);
            Stats::Molecule(Box::new(inventory))
        }
        Content::Animation(clip) => {
            let motion = motion(&clip, job.progress());
            job.warn(motion.warnings());
            summary += &format!(
                " at {} a second, {} of the vertices move",
                number(motion.rate),
                motion.moving_vertices
            );
            Stats::Animation(motion)
        }
        Content::Terrain(grid) => {
            job.progress().stage("count", 0);
            let found = terrain::inventory::inventory(&grid);
            job.warn(found.warnings());
            if let (Some(min), Some(max)) = (found.min, found.max) {
                summary += &format!(", {} to {} high", number(min), number(max));
            }
            Stats::Terrain(Box::new(found))
        }
        Content::Vectors(layer) => {
            job.progress().stage("count", 0);
            let found = vector::inventory::inventory(&layer);
            job.warn(found.warnings());
            summary += &shapes_in_words(&found);
            Stats::Vectors(Box::new(found))
        }
        Content::Report(documents) => {
            let reports = made_by(&documents);
            summary += &made_in_words(&reports);
            Stats::Report(ReportStats {
                documents: documents.len() as u64,
                reports,
            })
        }
    };
    Ok(Found::new(params, stats, summary))
}

/// `, 2 reports of info by scantle 0.1.0`, for the first few.
fn made_in_words(reports: &[Made]) -> String {
    let mut text = String::new();
    for made in reports.iter().take(NAMED) {
        let count = words::counted(made.documents, "report", "reports");
        let [command, version] = [&made.command, &made.scantle].map(|word| words::shown(word));
        text += &format!(", {count} of {command} by scantle {version}");
    }
    if reports.len() > NAMED {
        text += &format!(", and reports of {} more kinds", reports.len() - NAMED);
    }
    text
}

/// `, 2 chains, 396 of water, 1 HEM`, for the first few.
fn chains_in_words(inventory: &Inventory) -> String {
    let chains = words::counted(inventory.chains.len() as u64, "chain", "chains");
    let mut text = format!(", {chains}");
    if inventory.waters > 0 {
        text += &format!(", {} of water", inventory.waters);
    }
    for row in inventory.hetero.iter().take(NAMED) {
        text += &format!(", {} {}", row.residues, words::shown(&row.name));
    }
    if inventory.hetero.len() > NAMED {
        text += &format!(", and {} more kinds", inventory.hetero.len() - NAMED);
    }
    text
}

/// `, 345 of lines, 2 of polygons`.
fn shapes_in_words(found: &vector::inventory::Inventory) -> String {
    let kinds = [
        (found.points[0], "of points"),
        (found.lines[0], "of lines"),
        (found.polygons[0], "of polygons"),
        (found.empty, "empty"),
    ];
    let kinds = kinds.into_iter().filter(|(count, _)| *count > 0);
    kinds
        .map(|(count, what)| format!(", {count} {what}"))
        .collect()
}

/// `, normals, 3 classes`.
fn carried_in_words(inventory: &CloudInventory) -> String {
    let parts = [
        (", normals", inventory.normals),
        (", colours", inventory.colours),
    ];
    let parts = parts.into_iter().filter(|(_, has)| *has);
    let mut text: String = parts.map(|(what, _)| what).collect();
    if !inventory.classes.is_empty() {
        let classes = inventory.classes.len() as u64;
        text += &format!(", {}", words::counted(classes, "class", "classes"));
    }
    text
}

fn splat_stats(splats: &Splats) -> SplatStats {
    let all = &splats.splats;
    let mut radii: Vec<f64> = all.iter().map(|splat| splat.radius).collect();
    radii.sort_unstable_by(f64::total_cmp);
    let middle = radii.get(radii.len().saturating_sub(1) / 2);
    SplatStats {
        splats: all.len() as u64,
        radius: [radii.first(), middle, radii.last()].map(Option::<&f64>::copied),
        max_error: all
            .iter()
            .fold(0.0, |most: f64, splat| most.max(splat.error)),
        covered: all.iter().map(|splat| u64::from(splat.count)).sum(),
        colours: splats.colors.is_some(),
        classes: splats.classes.is_some(),
        bytes: std::mem::size_of_val(all.as_slice()) as u64,
    }
}

fn volume_stats(volume: &Volume) -> VolumeStats {
    let frame = &volume.frame;
    let range = volume.range();
    VolumeStats {
        origin: frame.origin,
        spacing: frame.spacing(),
        straight: frame.is_straight(),
        voxels: frame.len() as u64,
        set: volume.count_set(),
        min: range.map(|[min, _]| min),
        max: range.map(|[_, max]| max),
    }
}
