//! `scantle stability`: how far results drift at the extremes.

mod input;
mod result;

use crate::exit::Exit;
use crate::machine::{self, Moment};
use crate::places::Places;
use crate::progress::{self, Recorder};
use crate::runs::{self, Document, Runs};
use crate::shared::{Seed, Wrapping, not_negative, positive};
use crate::streams::{complain, say, show};
use crate::wrapped::Wrapped;
use result::{Asked, Outcome, Row, Stats};
use scantle::error::{Error, Result};
use scantle::io::format::{Format, Kind};
use scantle::io::source::Source;
use scantle::io::{self, Content};
use scantle::measure::stability::{
    Changed, Drift, Motion, Step, Subject, clip_drift, image_drift, mesh_drift, sphere_drift,
    steps, volume_drift,
};
use scantle::measure::tradeoff::Failed;
use scantle::progress::Progress;
use scantle::trade::{Placed, Tied};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Measure how far a command's result drifts when its input is taken to the extremes
///
/// Scales the input by powers of two, moves it far away, turns it, reorders, splits and doubles its
/// elements, adds triangles without area, and shakes the last bit of every coordinate; runs the
/// command on each, undoes the change on the result, and measures how far that is from the result
/// of the untouched input.
///
/// Of a molecule the atoms that count by default are taken, of the first model, and run as spheres
/// (xyzr) with the radii of the file, else of the elements; nothing else of it is left. Its atoms are
/// reordered and doubled; it has no faces to change.
///
/// An animation is run as a folder of PLY files, one for each frame, with every digit of its coordinates
/// and the faces of --base: caches of points hold single precision. Vertices that are reordered or split
/// are so in all frames, and told apart again in the result.
///
/// Where a change has to round coordinates, the result is compared with that of the input so
/// rounded, and what the rounding of the input itself does is a figure of its own. Changes under
/// which the result is promised to stay the same count for --max-error; the others are shown.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER, override_usage = USAGE)]
pub struct Args {
    #[command(flatten)]
    wrapping: Wrapping,
    /// Exit with 1 when the drift under a change that counts is larger than X, in the unit of the
    /// command's own error; 0 lets nothing change at all
    #[arg(long, value_name = "X", value_parser = not_negative)]
    max_error: Option<f64>,
    /// Powers of two to scale by, as exponents from -1000 to 1000
    #[arg(long, value_name = "K,...", value_parser = exponents, default_value = "-100,-50,-20,-5,-1,1,5,20,50,100", allow_hyphen_values = true)]
    scales: Exponents,
    /// How far to move, in extents of the input; each becomes the nearest power of two
    #[arg(long, value_name = "N,...", value_parser = offsets, default_value = "1,1e3,1e6,1e9")]
    offsets: Offsets,
    #[command(flatten)]
    seed: Seed,
}

/// Exponents of two, as one value of the command line.
#[derive(Debug, Clone)]
pub struct Exponents(pub Vec<i32>);

/// Offsets in extents, as one value of the command line.
#[derive(Debug, Clone)]
pub struct Offsets(pub Vec<f64>);

fn exponents(text: &str) -> Result<Exponents, String> {
    let all: Result<Vec<i32>, _> = text.split(',').map(|word| word.trim().parse()).collect();
    match all {
        Ok(all) if all.iter().all(|k| (-1000..=1000).contains(k)) => Ok(Exponents(all)),
        Ok(_) => Err("must be from -1000 to 1000".to_owned()),
        Err(_) => Err("has something that is no whole number".to_owned()),
    }
}

fn offsets(text: &str) -> Result<Offsets, String> {
    let all: Result<Vec<f64>, String> = text.split(',').map(|n| positive(n.trim())).collect();
    all.map(Offsets)
}

const USAGE: &str = "scantle stability COMMAND INPUT [OPTIONS]";

const AFTER: &str = "\
Options of the command that are lengths, points, directions or boxes are moved with the input; for
tunnels --shell-radius only where it is given. A picture is turned only where its --light and --camera
are given, and turn along.

Examples:
  scantle stability voxelize fixtures/shapes/torus-knot.ply --resolution 24 --max-error 0
  scantle stability tunnels fixtures/molecules/porthole.xyzr --start 0,0,0 --shell-radius 3
";

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Takes the input to the extremes.
pub fn run(args: &Args) -> Result<Exit> {
    let wrapped = match Wrapped::new(&args.wrapping.command, &args.wrapping.words) {
        Ok(wrapped) => wrapped,
        Err(why) => return Ok(runs::refuse("stability", &why)),
    };
    let [name] = &wrapped.inputs[..] else {
        let why = format!("{} inputs, where one is taken", wrapped.inputs.len());
        return Ok(runs::refuse("stability", &why));
    };
    if let Some(why) = tied(&wrapped) {
        return Ok(runs::refuse("stability", &why));
    }
    let places = Places::new(&args.wrapping, &wrapped)?;
    let (subject, inputs) = match input::read(name, &wrapped) {
        Ok(read) => read,
        Err(error) => return Ok(complain(&error, Some(name))),
    };
    let bench = Bench::new(args, &wrapped, &subject)?;
    let untouched = match bench.run(&subject, &Motion::NONE, "untouched") {
        Ok(untouched) => untouched,
        Err(failed) => {
            say(format_args!(
                "stability: the untouched input fails: {}",
                failed.message
            ));
            return Ok(Exit::of_code(failed.code));
        }
    };
    let talk = &args.wrapping.talk;
    let with_bar = !talk.quiet && !talk.verbose && progress::is_watched();
    let mut recorder = Recorder::new(Moment::now(), with_bar);
    let all = steps(&args.scales.0, &args.offsets.0);
    recorder.stage("run", all.len() as u64);
    let mut rows = Vec::with_capacity(all.len());
    for step in all {
        rows.push(bench.row(step, &untouched));
        recorder.advance(1);
    }
    recorder.finish();
    let other = |content: &Content| matches!(content, Content::Image(_) | Content::Animation(_));
    let in_space = !untouched.content.as_ref().is_some_and(other);
    let unit = wrapped.trade.error.unit;
    let stats = Stats::new(subject.extent(), untouched.bound, unit, in_space, rows);
    let table = result::table(&stats);
    if !talk.quiet {
        show(&table.aligned());
        show(&result::summary(&stats));
    }
    let exit = judge(&stats, args.max_error);
    let (output, unwritten) = places.write(|| result::plot(&stats), || result::exported(&stats));
    let asked = Asked::new(&wrapped, args);
    places.deliver("stability", asked, stats, inputs, output, Vec::new())?;
    Ok(exit.max(unwritten))
}

/// Why the command cannot be run on changed copies with the options that it was given, if it cannot.
fn tied(wrapped: &Wrapped) -> Option<String> {
    let mut all = wrapped.trade.tied.iter();
    let Tied { option, instead } = all.find(|tied| wrapped.is_set(tied.option))?;
    Some(format!(
        "--{option} depends on what changed copies of the input do not hold; {instead}"
    ))
}

/// The check, where it was asked for.
fn judge(stats: &Stats, most: Option<f64>) -> Exit {
    let Some(most) = most else {
        return Exit::Done;
    };
    let broken: Vec<&Row> = stats.broken(most);
    if broken.is_empty() {
        return Exit::Done;
    }
    let names: Vec<String> = broken.iter().map(|row| row.name()).collect();
    say(format_args!(
        "stability: check failed: the drift is larger than --max-error {most} under {}",
        names.join(", ")
    ));
    Exit::CheckFailed
}

/// A result, read back.
struct Made {
    /// None where there was nothing to write.
    content: Option<Content>,
    bound: Option<f64>,
}

/// Where changed inputs are run.
struct Bench<'a> {
    wrapped: &'a Wrapped,
    subject: &'a Subject,
    seed: u64,
    runs: Runs,
    format: Format,
    folder: TempDir,
}

impl<'a> Bench<'a> {
    fn new(args: &Args, wrapped: &'a Wrapped, subject: &'a Subject) -> Result<Self> {
        let folder = tempfile::tempdir().map_err(|source| Error::Write {
            path: std::env::temp_dir(),
            source,
        })?;
        Ok(Bench {
            wrapped,
            subject,
            seed: args.seed.seed,
            runs: Runs {
                in_process: args.wrapping.in_process,
                verbose: args.wrapping.talk.verbose,
            },
            format: Format::from_name(wrapped.trade.result).unwrap_or(Format::Ply),
            folder,
        })
    }

    /// Where a changed input goes: a file, or a folder of its own for the frames of an animation.
    fn input(&self, subject: &Subject, name: &str) -> PathBuf {
        match subject {
            Subject::Clip(_) => self.folder.path().join(name),
            _ => self.path(name, input::format_of(subject)),
        }
    }

    fn path(&self, name: &str, format: Format) -> PathBuf {
        let extension = format.extensions()[0];
        self.folder.path().join(format!("{name}.{extension}"))
    }

    /// The options that stand in the input's space, moved; with `undo`, moved and taken back, which
    /// leaves the rounding of their far place.
    fn options(
        &self,
        motion: &Motion,
        undo: bool,
    ) -> Result<Vec<(String, Option<String>)>, String> {
        let mut options = Vec::new();
        for placed in self.wrapped.trade.placed {
            let Placed {
                option,
                prefix,
                parts,
            } = placed;
            for value in self.wrapped.values(option) {
                let Some(numbers) = value.strip_prefix(prefix) else {
                    continue;
                };
                if numbers.ends_with('%') {
                    continue;
                }
                let wrong = |why: String| format!("--{option} {value}: {why}");
                let numbers = numbers.split(',').map(|n| n.trim().parse());
                let numbers: Result<Vec<f64>, _> = numbers.collect();
                let numbers = numbers.map_err(|_| wrong("something is no number".to_owned()))?;
                let mut placed = motion.place(parts, &numbers).map_err(wrong)?;
                if undo {
                    placed = motion.place_back(parts, &placed).map_err(wrong)?;
                }
                let words: Vec<String> = placed.iter().map(|n| format!("{n:?}")).collect();
                options.push((
                    (*option).to_owned(),
                    Some(format!("{prefix}{}", words.join(","))),
                ));
            }
        }
        Ok(options)
    }

    /// Why a motion shows another result than the one untouched, where it does.
    ///
    /// What is seen of a model that turns stays the same only where all that looks and shines turns
    /// along; what the command places by itself does not.
    fn is_another(&self, motion: &Motion) -> Option<String> {
        if motion.turn == Motion::NONE.turn || self.format.kind() != Kind::Image {
            return None;
        }
        let placed = self.wrapped.trade.placed.iter();
        let free = placed.filter(|placed| !self.wrapped.is_set(placed.option));
        let free: Vec<String> = free.map(|placed| format!("--{}", placed.option)).collect();
        let needed = free.join(" and ");
        (!free.is_empty()).then(|| format!("shows another side without {needed}"))
    }

    /// Runs the command on a changed input, with its places moved.
    fn run(&self, subject: &Subject, motion: &Motion, name: &str) -> Result<Made, Failed> {
        let options = self.options(motion, false).map_err(unfit)?;
        self.run_with(subject, &options, name)
    }

    fn run_with(
        &self,
        subject: &Subject,
        options: &[(String, Option<String>)],
        name: &str,
    ) -> Result<Made, Failed> {
        let format = input::format_of(subject);
        let (from, to) = (
            self.input(subject, name),
            self.path(&format!("{name}-made"), self.format),
        );
        input::write(subject, &from).map_err(broken)?;
        forget(&to).map_err(broken)?;
        let (input, output) = (from.display().to_string(), to.display().to_string());
        let mut options = options.to_vec();
        if self.wrapped.is_set("input-format") && !matches!(subject, Subject::Clip(_)) {
            let format = format.name().to_owned();
            options.push(("input-format".to_owned(), Some(format)));
        }
        let without = input::stands_for(subject);
        let inputs = std::slice::from_ref(&input);
        let words = self.wrapped.words_without(without, inputs, &options);
        let documents = self.runs.run(&words, &["--output", &output]);
        let documents: Vec<Document> = documents.map_err(|failed| Failed {
            message: failed.message.replace(&input, &self.wrapped.inputs[0]),
            ..failed
        })?;
        let content = read_back(&to, self.format).map_err(broken)?;
        let error = documents.first().and_then(|d| d.error(self.wrapped.trade));
        Ok(Made {
            content,
            bound: error.and_then(|error| error.bound),
        })
    }

    /// Takes one step, and measures.
    fn row(&self, step: Step, untouched: &Made) -> Row {
        let wrapped = self.wrapped;
        let promised = wrapped
            .trade
            .is_invariant(step.change(), |option| wrapped.value(option));
        let mut row = Row::new(step, promised);
        let changed = match step.apply(self.subject, self.seed) {
            Ok(changed) => changed,
            Err(why) => return row.skipped(why),
        };
        if let Some(why) = self.is_another(&changed.motion) {
            return row.skipped(why);
        }
        row.rounding(changed.rounding);
        match self.drifts(&changed, untouched) {
            Ok((drift, by_input)) => row.done(drift, by_input),
            Err(failed) => row.failed(failed),
        }
    }

    /// The drift of the command, and that which the rounding of its input makes.
    fn drifts(
        &self,
        changed: &Changed,
        untouched: &Made,
    ) -> Result<(Drift, Option<Drift>), Failed> {
        let (motion, order) = (&changed.motion, changed.order.as_deref());
        let made = self.run(&changed.subject, motion, "changed")?;
        let given = self.options(&Motion::NONE, false).map_err(unfit)?;
        let options = self.options(motion, true).map_err(unfit)?;
        if changed.rounded.is_none() && given == options || motion.turn != Motion::NONE.turn {
            return Ok((drift(untouched, &made, motion, order)?, None));
        }
        let subject = changed.rounded.as_ref().unwrap_or(self.subject);
        let reference = self.run_with(subject, &options, "rounded")?;
        let by_input = drift(untouched, &reference, &Motion::NONE, None)?;
        Ok((drift(&reference, &made, motion, order)?, Some(by_input)))
    }
}

fn unfit(message: String) -> Failed {
    Failed {
        code: Outcome::SKIPPED,
        message,
    }
}

fn broken(error: Error) -> Failed {
    Failed {
        code: Exit::of(&error) as u8,
        message: error.to_string(),
    }
}

/// Removes the result of a run before, which a run that makes nothing would leave there.
fn forget(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(source) if source.kind() != ErrorKind::NotFound => Err(Error::Write {
            path: path.to_owned(),
            source,
        }),
        _ => Ok(()),
    }
}

/// A result; none where a command that found nothing wrote no file, or not a byte.
fn read_back(path: &Path, format: Format) -> Result<Option<Content>> {
    if fs::metadata(path).map_or(true, |file| file.len() == 0) {
        return Ok(None);
    }
    let source = Source::open(&path.display().to_string(), machine::default_memory())?;
    let (content, ..) = io::read(&source, Some(format))?;
    Ok(Some(content))
}

/// Sides of the polygons that stand for discs where these are compared.
const SIDES: usize = 6;

/// `order` tells which vertex of the reference each is, where an input has them in another order.
fn drift(
    reference: &Made,
    made: &Made,
    motion: &Motion,
    order: Option<&[usize]>,
) -> Result<Drift, Failed> {
    let (a, b) = match (&reference.content, &made.content) {
        (Some(a), Some(b)) => (a, b),
        (None, None) => return Ok(Drift::NONE),
        _ => return Ok(Drift::ALL),
    };
    match (a, b) {
        (Content::Volume(a), Content::Volume(b)) => Ok(volume_drift(a, b, motion)),
        (Content::Mesh(a), Content::Mesh(b)) => mesh_drift(a, b, motion).map_err(broken),
        (Content::Splats(a), Content::Splats(b)) => {
            let polygons = |splats| io::splats::discs(splats, SIDES).map_err(broken);
            mesh_drift(&polygons(a)?, &polygons(b)?, motion).map_err(broken)
        }
        (Content::Animation(a), Content::Animation(b)) => {
            clip_drift(a, b, motion, order).map_err(broken)
        }
        (Content::Image(a), Content::Image(b)) => image_drift(a, b).map_err(broken),
        (Content::Molecule(a), Content::Molecule(b)) => {
            Ok(sphere_drift(&a.spheres(), &b.spheres(), motion))
        }
        _ => Err(unfit(
            "the results are not of one kind that drift is measured for".to_owned(),
        )),
    }
}
