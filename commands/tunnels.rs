//! `scantle tunnels`: the widest ways from inside a molecule to the outside.

mod frames;
mod models;
mod output;
mod picture;
mod plot;
mod profile;
mod result;
#[cfg(test)]
mod sample;
mod script;
mod solve;

use crate::context::{Context, Files};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::shared::{Common, Inputs, MaxError, Output, Verify, named, not_negative, positive};
use crate::streams::complain;
use clap::{ArgGroup, value_parser};
use frames::Frames;
use models::{Each, Models};
use output::Extras;
use result::Stats;
use scantle::error::{Error, Result};
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::protein::radii::Radii;
use scantle::protein::select::SelectionCounts;
use scantle::protein::start::Start;
use scantle::protein::tunnels::{Exit as WayOut, Extent, Method, Params, Prefer, Removal};
use scantle::report::Modelled;
use schemars::JsonSchema;
use serde::Serialize;
use solve::{accuracy, solve, verify};

/// Find the widest ways from inside a molecule to the outside, with a proof
///
/// Atoms are balls; a tunnel is a curve from the start to the outside, as wide as the largest ball that
/// passes along it. The narrowest place of the widest tunnel lies on a Voronoi diagram of the atoms, and
/// ways are searched on the dual of a Delaunay triangulation. `bottleneck` says what is certain: a way of
/// width `lower` was found, and none is wider than `upper`.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER, group = ArgGroup::new("from").required(true))]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// Start at this point
    #[arg(long, value_name = "X,Y,Z", group = "from", value_parser = Start::point, allow_hyphen_values = true)]
    start: Option<Start>,
    /// Start in the middle of these residues, such as A:106,A:272
    #[arg(long, value_name = "RESIDUE,...", group = "from", value_parser = Start::residues)]
    start_residues: Option<Start>,
    /// Start in the middle of the atoms with these serial numbers
    #[arg(long, value_name = "SERIAL,...", group = "from", value_parser = Start::atoms, allow_hyphen_values = true)]
    start_atoms: Option<Start>,
    /// Start in the middle of this ligand, such as HEM or HEM:A:401, which is left out
    #[arg(long, value_name = "NAME", group = "from", value_parser = Start::ligand)]
    start_ligand: Option<Start>,
    /// Find pores instead, from mouth to mouth through the molecule
    #[arg(long, group = "from")]
    pores: bool,
    /// Look for the widest place to start within this distance; 0 holds the start
    #[arg(long, value_name = "R", default_value_t = Params::DEFAULT.start_search, value_parser = not_negative)]
    start_search: f64,
    /// How widths are found: `conservative`, all atoms as large as the largest; `approximate`, gates by
    /// the ball that touches three atoms; `balls:K`, atoms as K + 1 balls (4, 6, 8, 12, 20); `grid:H`,
    /// over the points of a grid; `exact`, between bounds as close as --tolerance
    #[arg(long, default_value = "approximate", value_parser = method)]
    method: Method,
    /// Where ways end: `shell`, in the solvent, where a probe of --shell-radius comes from outside;
    /// `hull`, behind the convex hull
    #[arg(long, default_value = Params::DEFAULT.exit.name(), value_parser = named(WayOut::NAMES, WayOut::from_name))]
    exit: WayOut,
    /// Radius of the probe that tells the solvent from the molecule [default: 3, and 4 for pores]
    #[arg(long, value_name = "R", value_parser = positive)]
    shell_radius: Option<f64>,
    /// Find no tunnels narrower than this
    #[arg(long, value_name = "R", default_value_t = Params::DEFAULT.probe_radius, value_parser = not_negative)]
    probe_radius: f64,
    /// Find so many tunnels at most
    #[arg(long, value_name = "N", default_value_t = Params::DEFAULT.count as u32, value_parser = value_parser!(u32).range(1..=10_000))]
    count: u32,
    /// What is closed before the next tunnel is looked for: `a`, the narrowest gates; `b`, all from the
    /// narrowest to the surface; `c`, the narrowest and those around
    #[arg(long, default_value = Params::DEFAULT.removal.name(), value_parser = named(Removal::NAMES, Removal::from_name))]
    remove: Removal,
    /// Tunnels that end so near one another have one mouth, of which the widest is kept; with --pores,
    /// mouths are so deep, too
    #[arg(long, value_name = "R", default_value_t = Params::DEFAULT.mouth, value_parser = not_negative)]
    mouth: f64,
    /// Of ways that are as wide, take the one of least `length`, or of least `cost`, the integral of
    /// 1 / r^2
    #[arg(long, default_value = Params::DEFAULT.prefer.name(), value_parser = named(Prefer::NAMES, Prefer::from_name))]
    prefer: Prefer,
    /// How much a search looks at: `reduced`, until it is outside; `full`, everything
    #[arg(long, default_value = Params::DEFAULT.extent.name(), value_parser = named(Extent::NAMES, Extent::from_name))]
    search: Extent,
    /// How far the bounds of the exact method may be apart
    #[arg(long, value_name = "X", default_value_t = Params::DEFAULT.tolerance, value_parser = positive)]
    tolerance: f64,
    /// Largest distance between spheres on a tunnel
    #[arg(long, value_name = "X", default_value_t = Params::DEFAULT.step, value_parser = positive)]
    step: f64,
    /// Count these residues in though they are no protein or nucleic acid, such as HEM,ZN
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    keep: Vec<String>,
    /// A table of radii: lines of ELEMENT RADIUS or RESIDUE ATOM RADIUS
    #[arg(long, value_name = "FILE")]
    radii: Option<String>,
    /// Which models of a file: `first`, `all`, where one that fails does not keep the others from it, or
    /// one by its number
    #[arg(long, default_value = "first", value_parser = Models::read)]
    models: Models,
    /// Tell which tunnels are the same in all frames, and how wide each is over time, in a JSON file
    #[arg(long, value_name = "FILE")]
    clusters: Option<String>,
    /// Tunnels further apart than this, on average, are not the same
    #[arg(long, value_name = "D", default_value_t = 3.5, value_parser = positive, requires = "clusters")]
    cluster_threshold: f64,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    extras: Extras,
    #[command(flatten)]
    max_error: MaxError,
    #[command(flatten)]
    verify: Verify,
    #[command(flatten)]
    common: Common,
}

const AFTER: &str = "\
Lengths are in the unit of the coordinates, angstrom as a rule. The output holds the spheres along the
tunnels, their radius in the column of the temperature factor.

Examples:
  scantle tunnels fixtures/molecules/porthole.xyzr --start 0,0,0
  scantle tunnels fixtures/molecules/porthole.xyzr --start 0,0,0 --method exact -o tunnels.pdb
";

fn method(name: &str) -> Result<Method, String> {
    Method::from_name(name).ok_or_else(|| {
        "is none of conservative, approximate, balls:4, balls:6, balls:8, balls:12, balls:20, grid:H \
         with a spacing H above 0, exact"
            .to_owned()
    })
}

/// The solvent's probe for pores, whose mouths are wider than those of tunnels.
const PORES_SHELL: f64 = 4.0;

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The start, in the words of its option; null for pores.
    start: Option<String>,
    /// The option that it was given with; null for pores.
    start_option: Option<String>,
    /// Whether pores were looked for.
    pores: bool,
    /// How far from it a wider place was looked for.
    start_search: f64,
    /// How widths were found.
    method: String,
    /// Where ways end.
    exit: String,
    /// Radius of the probe that tells the solvent from the molecule; null where ways end at the hull.
    shell_radius: Option<f64>,
    /// Tunnels narrower than this were not looked for.
    probe_radius: f64,
    /// Tunnels at most.
    count: u32,
    /// What was closed before the next tunnel was looked for.
    remove: String,
    /// Tunnels that end so near one another have one mouth.
    mouth: f64,
    /// What decides between ways that are as wide.
    prefer: String,
    /// How much searches look at.
    search: String,
    /// How far the bounds may be apart; null but for the exact method.
    tolerance: Option<f64>,
    /// Largest distance between spheres on a tunnel.
    step: f64,
    /// Residues that count though they are no polymer.
    keep: Vec<String>,
    /// The table of radii.
    radii: Option<String>,
    /// Which models.
    models: String,
}

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

impl Args {
    fn from(&self) -> Option<&Start> {
        let given = [
            &self.start,
            &self.start_residues,
            &self.start_atoms,
            &self.start_ligand,
        ];
        given.into_iter().flatten().next()
    }

    fn params(&self, memory: u64) -> Params {
        Params {
            method: self.method,
            exit: self.exit,
            start_search: self.start_search,
            probe_radius: self.probe_radius,
            shell_radius: self.shell_radius.unwrap_or(match self.pores {
                true => PORES_SHELL,
                false => Params::DEFAULT.shell_radius,
            }),
            mouth: self.mouth,
            count: self.count as usize,
            removal: self.remove,
            prefer: self.prefer,
            extent: self.search,
            tolerance: self.tolerance,
            step: self.step,
            memory,
            ..Params::DEFAULT
        }
    }

    fn asked(&self, params: &Params) -> Asked {
        let start = self.from();
        Asked {
            start: start.map(Start::to_string),
            start_option: start.map(|start| start.option().to_owned()),
            pores: self.pores,
            start_search: self.start_search,
            method: self.method.name(),
            exit: self.exit.name().to_owned(),
            shell_radius: (self.exit == WayOut::Shell).then_some(params.shell_radius),
            probe_radius: self.probe_radius,
            count: self.count,
            remove: self.remove.name().to_owned(),
            mouth: self.mouth,
            prefer: self.prefer.name().to_owned(),
            search: self.search.name().to_owned(),
            tolerance: (self.method == Method::Exact).then_some(self.tolerance),
            step: self.step,
            keep: self.keep.clone(),
            radii: self.radii.clone(),
            models: self.models.name(),
        }
    }
}

/// Finds the tunnels of each input.
pub fn run(args: &Args) -> Result<Exit> {
    let context = Context::new(&args.common)?;
    let params = args.params(context.memory());
    params.check()?;
    let frames = args
        .clusters
        .as_deref()
        .map(|word| Frames::new(Sink::new(word), args.cluster_threshold));
    let files = args
        .extras
        .of(Files::each(&args.inputs).output(&args.output))
        .reads("radii", &args.radii)
        .once("clusters", frames.as_ref().map(Frames::sink));
    files.check_reads()?;
    let radii = match &args.radii {
        None => Radii::default(),
        Some(word) => {
            let source = Source::open(word, context.memory())?;
            let text = String::from_utf8_lossy(source.bytes()).into_owned();
            Radii::read(&text).map_err(|fault| Error::Malformed {
                path: word.into(),
                fault,
            })?
        }
    };
    let exit = context.run("tunnels", &files, |job| {
        tunnels(job, &params, args, &radii, frames.as_ref())
    })?;
    let written = frames.map_or(Ok(()), Frames::write);
    Ok(exit.max(written.map_or_else(|error| complain(&error, None), |()| Exit::Done)))
}

fn tunnels(
    job: &mut Job,
    params: &Params,
    args: &Args,
    radii: &Radii,
    frames: Option<&Frames>,
) -> Result<Found<Asked, Stats>> {
    job.expect_output(&output::KINDS)?;
    let molecule = job.read_molecule()?;
    let path = job.input().map(|input| input.path.clone());
    let Each {
        first,
        own,
        others,
        failed,
    } = models::each(job, &molecule, args.models, |job, index| {
        let model = solve(job, &molecule, index, params, args, radii)?;
        if let (Some(frames), Some(path)) = (frames, &path) {
            frames.add(path, &model);
        }
        Ok(model)
    })?;
    job.warn(first.selected.warnings());
    job.warn(result::warnings(&first, params));
    let summary = result::summary(&first);
    let verified = match args.verify.verify {
        true => verify(job, &first, params)?,
        false => None,
    };
    job.warn(result::doubts(verified.as_ref()));
    let made = output::Found {
        molecule: &molecule,
        balls: &first.selected.balls,
        atoms: &first.selected.atoms,
        tunnels: &first.tunnels,
        probe_radius: params.probe_radius,
        memory: params.memory,
    };
    output::write(job, &made)?;
    let accuracy = accuracy(&first, verified.as_ref());
    let counts: &SelectionCounts = &first.selected.counts;
    let searched = first.searched;
    let made = Modelled::new("atom", searched.atoms, counts.atoms_used, searched.bytes);
    let of_all = args.models == Models::All;
    let stats = Stats {
        own,
        verified,
        other_models: of_all.then_some(others),
        failed_models: of_all.then_some(failed),
    };
    let found = Found::new(args.asked(params), stats, summary).modelled(made);
    Ok(found
        .accuracy(accuracy)
        .check("max-error", args.max_error.max_error))
}
