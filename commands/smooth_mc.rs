//! `scantle smooth-mc`: a binary volume becomes a smooth surface that keeps every voxel on its side.

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Preview, Verify, list, named};
use clap::value_parser;
use scantle::error::{Error, Result};
use scantle::image::colour::{CLAY, OKABE_ITO};
use scantle::io::format::Kind;
use scantle::measure::smooth_error::{self, SmoothError};
use scantle::mesh::Mesh;
use scantle::numeric::vector::length;
use scantle::render::preview::{self, Panel, What};
use scantle::report::{Accuracy, Measures, Modelled, Warning};
use scantle::volume::isosurface::{self, Border, Labels, Select, Surface};
use scantle::volume::smooth_mc::region::Constraint;
use scantle::volume::smooth_mc::{self, Energy, Params, Thin, Update};
use scantle::volume::{Frame, Volume};
use schemars::JsonSchema;
use serde::Serialize;

/// Smooth the surface of a binary volume or of labels, with every voxel kept on its side
///
/// A volume is cut by marching cubes, and the staircase taken off it. Vertices stay within half a
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
  scantle smooth-mc fixtures/volumes/labels.nii.gz --label 1 -o one.ply --preview one.png
  scantle smooth-mc fixtures/volumes/labels.nii.gz --labels all -o 'label-{label}.ply' --verify
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
    #[serde(flatten)]
    params: Params,
}

/// What counts as inside.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Inside {
    /// Every value but 0.
    Set,
    /// This value.
    Label(f64),
    /// Each of these values, a body of its own.
    Labels(Vec<f64>),
    /// This value and larger ones.
    AtLeast(f64),
}

/// A body.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Body {
    /// Its value.
    label: f64,
    /// Triangles around it.
    triangles: u64,
    /// Its voxels.
    voxels: i64,
    /// What marching cubes encloses, in percent of the voxels.
    volume_before_percent: f64,
    /// What is enclosed now, in percent of the voxels.
    volume_percent: f64,
    /// Voxels of it that lie outside, and others that lie inside; only with `--verify`.
    #[serde(skip_serializing_if = "Option::is_none")]
    misclassified_voxels: Option<u64>,
}

/// Distances between surfaces.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Hausdorff {
    /// In diagonals of a cell.
    cell_diagonals: f64,
    /// In the smallest spacing.
    voxels: f64,
    /// Whether it was measured; else it is the longest way of a vertex, which is no smaller.
    measured: bool,
}

/// What was made.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// Vertices of the surface.
    vertices: u64,
    /// Its triangles; a wall between two labels counts once.
    triangles: u64,
    /// Steps of the grid along its axes.
    spacing: [f64; 3],
    /// Centre of its first voxel.
    origin: [f64; 3],
    #[serde(flatten)]
    smoothing: smooth_mc::Stats,
    /// What is enclosed, in percent of what marching cubes encloses; null where the surface is open.
    volume_percent: Option<f64>,
    /// What is enclosed, in percent of the voxels; null where the surface is open.
    voxel_volume_percent: Option<f64>,
    /// The symmetric distance to the surface of marching cubes.
    hausdorff: Hausdorff,
    /// The bodies, where several labels were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    labels: Vec<Body>,
    /// What `--verify` measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    verified: Option<SmoothError>,
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

fn smooth(job: &mut Job, params: &Params, args: &Args, memory: u64) -> Result<Found<Asked, Stats>> {
    job.expect_output(&[Kind::Mesh])?;
    let mut volume = job.read_volume()?;
    place(&mut volume.frame, args);
    isosurface::check_numbers(&volume).map_err(Error::Geometry)?;
    let what = inside(&volume, args)?;
    let (surface, bits) = match &what {
        Inside::Labels(values) => {
            let labels = Labels::new(values.clone());
            (
                isosurface::extract_labels(&volume, &labels, job.progress())?,
                None,
            )
        }
        one => {
            let select = one.select();
            let surface = isosurface::extract(&volume, &select, args.border, job.progress())?;
            let closed = args.border == Border::Closed && args.verify.verify;
            (
                surface,
                closed.then(|| isosurface::inside(&volume, &select)),
            )
        }
    };
    if surface.is_empty() {
        job.warn(vec![Warning::new(
            "empty-surface",
            "no voxel is inside: the surface is empty",
            1,
            None,
        )]);
    }
    let steps = volume.frame.spacing();
    let (offsets, triangles, smoothing) =
        smooth_mc::smooth(&surface, None, steps, params, job.progress())?;
    job.warn(thin_warning(&smoothing));
    let positions = surface.positions(&volume.frame, |v| offsets[v]);
    let verified = args
        .verify
        .verify
        .then(|| {
            smooth_error::measure(
                &surface,
                steps,
                bits.as_ref(),
                &offsets,
                &triangles,
                memory,
                job.progress(),
            )
        })
        .transpose()?;
    let mirrored = volume.frame.is_mirrored();
    let out = |triangles: &[[u32; 3]]| turned(triangles, mirrored);
    let mut bodies = Vec::new();
    if let Inside::Labels(values) = &what {
        for (i, value) in values.iter().enumerate() {
            let own = surface.triangles_around(i as u16 + 1, &triangles);
            let misclassified_voxels = args
                .verify
                .verify
                .then(|| {
                    let bits = isosurface::inside(&volume, &Select::Equal(*value));
                    smooth_error::misclassified(
                        &surface,
                        &bits,
                        &offsets,
                        &own,
                        memory,
                        job.progress(),
                    )
                })
                .transpose()?;
            let part = &smoothing.parts[i + 1];
            let voxels = part.voxels.unwrap_or(0);
            let percent = |volume: f64| 100.0 * volume / voxels as f64;
            bodies.push(Body {
                label: *value,
                triangles: own.len() as u64,
                voxels,
                volume_before_percent: percent(part.volume_before),
                volume_percent: percent(part.volume_after),
                misclassified_voxels,
            });
        }
        if job.takes_labels() {
            for (i, value) in values.iter().enumerate() {
                let own = surface.triangles_around(i as u16 + 1, &triangles);
                let mesh = Mesh::from_triangles(positions.clone(), out(&own)).compacted();
                job.write_labelled(&scantle::error::number(*value), &mesh)?;
            }
        }
    }
    let mut mesh = Mesh::from_triangles(positions, out(&triangles));
    if let Inside::Labels(values) = &what {
        let name = |side: u16| match usize::from(side) {
            0 => 0,
            i => values[i - 1] as i32,
        };
        let of = |t: &[u32; 3]| surface.sides_of(t).unwrap_or_default().map(name);
        mesh.sides = Some(triangles.iter().map(of).collect());
    }
    if !job.takes_labels() {
        job.write_mesh(&mesh)?;
    }
    let stats = Stats::new(
        &surface,
        &volume.frame,
        smoothing,
        bodies,
        verified,
        &offsets,
        triangles.len(),
    );
    let summary = stats.summary();
    let accuracy = stats.accuracy(params);
    let wrong = stats.wrong(params);
    job.write_preview(|_| picture(&surface, &volume.frame, &mesh, &stats));
    let asked = Asked {
        inside: what,
        border: args.border,
        params: *params,
    };
    let made = modelled(&surface, volume.frame.dims);
    Ok(Found::new(asked, stats, summary)
        .accuracy(Measures::Many(accuracy))
        .modelled(made)
        .check("max-error", args.max_error.max_error)
        .beyond_measure(wrong))
}

/// Triangles turned over where the axes of the grid are left-handed.
fn turned(triangles: &[[u32; 3]], mirrored: bool) -> Vec<[u32; 3]> {
    let turn = |[a, b, c]: &[u32; 3]| if mirrored { [*a, *c, *b] } else { [*a, *b, *c] };
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

/// What is inside: what was asked for, else the only value there is beside 0.
fn inside(volume: &Volume, args: &Args) -> Result<Inside> {
    if let Some(level) = args.threshold_value {
        return Ok(Inside::AtLeast(level));
    }
    if volume.is_binary() {
        return Ok(Inside::Set);
    }
    let kind = volume.data.sample_type();
    let found = isosurface::values(volume, MOST_VALUES);
    let Some(found) = found.filter(|f| f.iter().all(|v| v.fract() == 0.0 && v.abs() < 2e9)) else {
        let range = volume.range().unwrap_or_default();
        let problem = format!(
            "is needed: the voxels are {kind} from {} to {}, amounts rather than labels",
            range[0], range[1]
        );
        return Err(Error::parameter("threshold-value", "V", problem));
    };
    let there: Vec<f64> = found.into_iter().filter(|v| *v != 0.0).collect();
    let missing = |option, value: f64| {
        let problem = format!("is no label of the volume, which has {}", listed(&there));
        Error::parameter(option, scantle::error::number(value), problem)
    };
    match (args.label, &args.labels) {
        (Some(label), _) if there.contains(&label) => Ok(Inside::Label(label)),
        (Some(label), _) => Err(missing("label", label)),
        (None, Some(Chosen::All)) => Ok(Inside::Labels(there)),
        (None, Some(Chosen::These(values))) => {
            if let Some(value) = values.iter().find(|v| !there.contains(v)) {
                return Err(missing("labels", *value));
            }
            let mut values = values.clone();
            values.sort_by(f64::total_cmp);
            values.dedup();
            Ok(Inside::Labels(values))
        }
        (None, None) if there.len() > 1 => Err(Error::parameter(
            "label",
            "K",
            format!(
                "is needed, or --labels or --threshold-value: the volume has {}",
                listed(&there)
            ),
        )),
        (None, None) => Ok(there
            .first()
            .map_or(Inside::Set, |label| Inside::Label(*label))),
    }
}

/// Most different values that a volume of labels has.
const MOST_VALUES: usize = 4096;

/// Most labels that an error names.
const NAMED: usize = 24;

fn listed(labels: &[f64]) -> String {
    let names: Vec<String> = labels
        .iter()
        .take(NAMED)
        .map(|l| scantle::error::number(*l))
        .collect();
    let more = if labels.len() > NAMED { ", ..." } else { "" };
    match labels.len() {
        0 => "no label but 0".to_owned(),
        1 => format!("the label {}", names[0]),
        n => format!("{n} labels: {}{more}", names.join(", ")),
    }
}

impl Inside {
    fn select(&self) -> Select {
        match self {
            Inside::Label(label) => Select::Equal(*label),
            Inside::AtLeast(level) => Select::AtLeast(*level),
            Inside::Set | Inside::Labels(_) => Select::Set,
        }
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

/// Cells that hold the surface, of those of the volume.
pub fn modelled(surface: &Surface, dims: [usize; 3]) -> Modelled {
    let full = dims.iter().map(|n| *n as u64 + 1).product();
    Modelled::new("cells", surface.cells, full, surface.bytes())
}

impl Stats {
    fn new(
        surface: &Surface,
        frame: &Frame,
        smoothing: smooth_mc::Stats,
        labels: Vec<Body>,
        verified: Option<SmoothError>,
        offsets: &[[f64; 3]],
        triangles: usize,
    ) -> Self {
        let spacing = frame.spacing();
        let smallest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
        let way = |o: &[f64; 3]| length([0, 1, 2].map(|a| o[a] * spacing[a] / smallest));
        let distance = match &verified {
            Some(found) => found.hausdorff_bound,
            None => offsets.iter().map(way).fold(0.0, f64::max),
        };
        let percent = |of: Option<f64>| Some(100.0 * smoothing.volume_after? / of?);
        Stats {
            vertices: surface.len() as u64,
            triangles: triangles as u64,
            spacing,
            origin: frame.origin,
            volume_percent: percent(smoothing.volume_before),
            voxel_volume_percent: percent(smoothing.voxels.map(|v| v as f64)),
            hausdorff: Hausdorff {
                cell_diagonals: distance * smallest / length(spacing),
                voxels: distance,
                measured: verified.is_some(),
            },
            smoothing,
            labels,
            verified,
        }
    }

    fn summary(&self) -> String {
        let turning = [
            self.smoothing.turning_before_deg,
            self.smoothing.turning_after_deg,
        ];
        format!(
            "{} vertices, {} triangles; chords turn by {:.1} degrees, {:.1} before; {} steps",
            self.vertices, self.triangles, turning[1], turning[0], self.smoothing.iterations
        )
    }

    /// Voxels on the wrong side, of all labels.
    fn misclassified(&self) -> Option<u64> {
        if self.labels.is_empty() {
            return self.verified.as_ref()?.misclassified_voxels;
        }
        self.labels
            .iter()
            .map(|body| body.misclassified_voxels)
            .sum()
    }

    /// A voxel on the wrong side, where the constraint rules that out.
    fn wrong(&self, params: &Params) -> Option<String> {
        let count = self
            .misclassified()
            .filter(|n| *n > 0 && params.constraint.is_faithful())?;
        Some(format!("{count} voxels changed sides"))
    }

    fn accuracy(&self, params: &Params) -> Vec<Accuracy> {
        let measure = |measure: &str, unit: &str, bound, reached: Option<f64>, by: &str| Accuracy {
            measure: measure.to_owned(),
            unit: unit.to_owned(),
            bound,
            reached,
            reference: by.to_owned(),
            verified: reached.is_some(),
        };
        let verified = self.verified.as_ref();
        let off = self.smoothing.volume_after.zip(self.smoothing.voxels);
        vec![
            measure(
                smooth_mc::TRADE.error.name,
                smooth_mc::TRADE.error.unit,
                None,
                verified.map(|v| v.from_fairest),
                smooth_mc::TRADE.reference,
            ),
            measure(
                "voxels on another side",
                "voxel",
                params.constraint.is_faithful().then_some(0.0),
                self.misclassified().map(|n| n as f64),
                "a voxelization of the result",
            ),
            measure(
                "largest distance to the surface of marching cubes",
                "voxel",
                Some(self.hausdorff.voxels),
                verified.map(|v| v.hausdorff),
                "marching cubes",
            ),
            measure(
                "volume enclosed",
                "share of the voxels'",
                None,
                off.map(|(after, voxels)| (after / voxels as f64 - 1.0).abs())
                    .filter(|share| share.is_finite()),
                "the volume of the voxels",
            ),
        ]
    }
}

/// The surface of marching cubes, and beside it the smooth one.
fn picture(surface: &Surface, frame: &Frame, smooth: &Mesh, stats: &Stats) -> Result<Vec<u8>> {
    let positions = surface.positions(frame, |_| [0.0; 3]);
    let triangles = turned(&surface.triangles(&positions), frame.is_mirrored());
    let before = Mesh::from_triangles(positions, triangles);
    let panels = [
        Panel {
            label: "marching cubes",
            what: What::Mesh(&before),
            colour: CLAY,
        },
        Panel {
            label: "smooth",
            what: What::Mesh(smooth),
            colour: OKABE_ITO[2],
        },
    ];
    let caption = format!(
        "chords turn by {:.1}°, {:.1}° before",
        stats.smoothing.turning_after_deg, stats.smoothing.turning_before_deg
    );
    let params = preview::Params {
        up: preview::Up::Z,
        ..preview::Params::DEFAULT
    };
    preview::side_by_side(&panels, &caption, "", &params)
}
