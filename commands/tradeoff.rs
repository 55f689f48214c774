//! `scantle tradeoff`: what each setting of a command costs, and how exact it is.

mod result;
mod vary;

use crate::exit::Exit;
use crate::machine::Moment;
use crate::places::Places;
use crate::progress::{self, Recorder};
use crate::runs::{self, Document, Runs};
use crate::shared::{Wrapping, named, not_negative, positive, size};
use crate::streams::{say, show};
use crate::wrapped::Wrapped;
use clap::value_parser;
use result::{Asked, Stats};
use scantle::error::Result;
use scantle::measure::tradeoff::{self, Choice, Cost, Failed, Limits, Ran, Row, Status};
use scantle::report::Input;
use std::time::Instant;
use vary::Knobs;

/// Measure what each setting of a command costs, and how exact it is
///
/// Runs every combination of the values of some of the command's options: once each to verify the
/// error against the command's reference, then a few times each to measure time and memory, to and
/// fro over all settings, so that a machine that slows down does so for all alike. Marks the
/// settings that no other beats in both cost and error.
///
/// The own options may stand anywhere; all other words are the command's, and so are those after
/// `--` in front of the command. A setting that fails is a line of the table like any other. Times
/// and memory are those of the command's own `run` block, so starting it costs nothing here; they
/// vary from run to run, the errors do not.
#[derive(Debug, clap::Args)]
#[command(after_long_help = AFTER, override_usage = USAGE)]
pub struct Args {
    #[command(flatten)]
    wrapping: Wrapping,
    /// An option of the command, and the values it is to have; without them those of its ladder.
    /// May be given for several options: all combinations are run
    #[arg(long, value_name = "KNOB[=A,B,...]", required = true)]
    vary: Vec<String>,
    /// Timed runs of each setting, of which the middle one counts
    #[arg(long, value_name = "N", default_value_t = tradeoff::Params::DEFAULT.repeat, value_parser = value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Seconds for all of it: settings are taken up from the cheapest on, for as long as the time
    /// is predicted to suffice; the first is run in any case
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    budget: Option<f64>,
    /// The cost that orders settings: `wall`, seconds by the clock; `cpu`, processor seconds;
    /// `memory`, bytes
    #[arg(long, default_value = tradeoff::Params::DEFAULT.cost.name(), value_parser = named(Cost::NAMES, Cost::from_name))]
    cost: Cost,
    /// Name the cheapest setting whose verified error is at most X, in the unit of the table; exit
    /// with 1 when there is none
    #[arg(long, value_name = "X", value_parser = not_negative)]
    max_error: Option<f64>,
    /// Name the most exact setting that takes at most S seconds; with --max-error, the cheapest
    /// that keeps to both
    #[arg(long, value_name = "S", value_parser = positive)]
    max_seconds: Option<f64>,
    /// Name the most exact setting that takes at most this much memory, such as 2GiB or 500MB;
    /// with --max-error, the cheapest that keeps to both
    #[arg(long, value_name = "SIZE", value_parser = size)]
    max_memory: Option<u64>,
}

const USAGE: &str = "scantle tradeoff COMMAND INPUT... --vary KNOB[=A,B,...]... [OPTIONS]";

const AFTER: &str = "\
The runs themselves may take what the command takes by default; --max-memory chooses among them. To
set the command's own limit, write `tradeoff --vary KNOB -- COMMAND INPUT --max-memory SIZE`. Where
verifying would take more, the setting is a line that says so.

Examples:
  scantle tradeoff voxelize fixtures/shapes/torus-knot.ply --vary resolution=8,16,32 --vary mode
  scantle tradeoff voxelize fixtures/shapes/sphere.stl --vary resolution=8,16,32 --max-error 0.2
";

/// The report of this command.
pub type Report = scantle::report::Report<Asked, Stats>;

/// Runs the grid.
pub fn run(args: &Args) -> Result<Exit> {
    let wrapped = Wrapped::new(&args.wrapping.command, &args.wrapping.words);
    let ready = wrapped.and_then(|wrapped| {
        let knobs = Knobs::new(&args.vary, &wrapped)?;
        Ok((wrapped, knobs))
    });
    let (wrapped, knobs) = match ready {
        Ok(ready) => ready,
        Err(why) => return Ok(runs::refuse("tradeoff", &why)),
    };
    let places = Places::new(&args.wrapping, &wrapped)?;
    let params = tradeoff::Params {
        repeat: args.repeat,
        budget_s: args.budget,
        cost: args.cost,
    };
    let limits = Limits {
        max_error: args.max_error,
        max_seconds: args.max_seconds,
        max_memory: args.max_memory,
    };
    let (rows, input) = measure(args, &wrapped, &knobs, &params);
    let asked = Asked::new(&wrapped, &knobs, params, limits, args.wrapping.in_process);
    let choice = tradeoff::choose(&rows, &limits, args.cost);
    let stats = Stats::new(&wrapped, &knobs, &rows, choice, &limits);
    let talk = &args.wrapping.talk;
    if !talk.quiet {
        show(&result::shown(&stats).aligned());
    }
    let (output, unwritten) = places.write(
        || result::plot(&stats, args.cost, &limits),
        || result::exported(&stats),
    );
    let exit = judge(&stats, &rows, choice, &limits, talk.quiet);
    let varies = Stats::varies(&params);
    places.deliver("tradeoff", asked, stats, input, output, varies)?;
    Ok(exit.max(unwritten))
}

/// Runs the grid: the rows, and the inputs as the first run that went well read them.
fn measure(
    args: &Args,
    wrapped: &Wrapped,
    knobs: &Knobs,
    params: &tradeoff::Params,
) -> (Vec<Row>, Vec<Input>) {
    let talk = &args.wrapping.talk;
    let runs = Runs {
        in_process: args.wrapping.in_process,
        verbose: talk.verbose,
    };
    let mut input = Vec::new();
    let mut runner = |setting: &[usize], verify: bool| -> Result<Ran, Failed> {
        let words = wrapped.words(&wrapped.inputs, &knobs.options(setting));
        let options: &[&str] = if verify { &["--verify"] } else { &[] };
        let documents = runs.run(&words, options)?;
        let ran = runs::figures(&documents, wrapped.trade);
        if input.is_empty() {
            let read = documents.into_iter().flat_map(|d: Document| d.input);
            input.extend(read);
        }
        Ok(ran)
    };
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let with_bar = !talk.quiet && !talk.verbose && progress::is_watched();
    let mut recorder = Recorder::new(Moment::now(), with_bar);
    let rows = tradeoff::run(&knobs.grid(), params, &mut runner, &clock, &recorder);
    recorder.finish();
    (rows, input)
}

/// Says what was chosen, or why nothing was; the exit code that it means.
fn judge(stats: &Stats, rows: &[Row], choice: Choice, limits: &Limits, quiet: bool) -> Exit {
    if rows.iter().all(|row| row.status == Status::Failed) {
        let worst = rows.iter().map(|row| row.code).max().unwrap_or(0);
        let why = rows.iter().find_map(|row| row.message.as_deref());
        say(format_args!(
            "tradeoff: every setting failed: {}",
            why.unwrap_or("for no known reason")
        ));
        return Exit::of_code(worst);
    }
    let limits = result::limits(limits);
    match (choice, &stats.choice) {
        (Choice::NotAsked, _) => Exit::Done,
        (_, Some(chosen)) => {
            if !quiet {
                let best = chosen.best;
                say(format_args!(
                    "{best} setting with {limits}: {}",
                    chosen.command
                ));
            }
            Exit::Done
        }
        (_, None) => {
            say(format_args!(
                "tradeoff: check failed: no setting was found with {limits}"
            ));
            Exit::CheckFailed
        }
    }
}
