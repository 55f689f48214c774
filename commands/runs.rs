//! Runs of scantle inside scantle: in a fresh process, or in this one.

use crate::exit::Exit;
use crate::machine::forget_peak;
use crate::streams::{capture, say};
use crate::{cli, words};
use scantle::measure::tradeoff::{Failed, Ran};
use scantle::report::{Accuracy, Input, Measures, Modelled, Run};
use scantle::trade::Trade;
use serde::Deserialize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::{Command, Stdio};

/// How commands are run.
#[derive(Debug, Clone, Copy)]
pub struct Runs {
    /// In this process rather than in a fresh one each time.
    pub in_process: bool,
    /// Whether each is said.
    pub verbose: bool,
}

/// What is read of a run's report.
#[derive(Debug, Deserialize)]
pub struct Document {
    /// What was read.
    pub input: Vec<Input>,
    /// The errors made.
    pub accuracy: Option<Measures>,
    /// How much was built.
    pub modelled: Option<Modelled>,
    /// What it took.
    pub run: Option<Run>,
}

impl Document {
    /// The measure that a trade names.
    pub fn error(&self, trade: &Trade) -> Option<&Accuracy> {
        let all = match self.accuracy.as_ref()? {
            Measures::One(accuracy) => std::slice::from_ref(accuracy),
            Measures::Many(all) => all,
        };
        all.iter().find(|a| a.measure == trade.error.name)
    }
}

impl Runs {
    /// Runs the words that follow the program's name; `options` are added for the report.
    pub fn run(&self, words: &[String], options: &[&str]) -> Result<Vec<Document>, Failed> {
        let named = command_words(words);
        let mut all = words[..named].to_vec();
        let added = ["--report", "-", "--quiet", "--timings"];
        all.extend(added.iter().chain(options).map(|word| (*word).to_owned()));
        all.extend_from_slice(&words[named..]);
        if self.verbose {
            say(format_args!("running {}", words::shell(&all)));
        }
        let (code, out, err) = if self.in_process {
            in_this_process(&all)
        } else {
            in_a_fresh_process(&all)?
        };
        if code > Exit::CheckFailed as u8 {
            return Err(Failed {
                code,
                message: message(&err),
            });
        }
        let documents = serde_json::Deserializer::from_slice(&out).into_iter();
        let documents: Result<Vec<Document>, _> = documents.collect();
        let mut documents = documents.map_err(|error| Failed {
            code: Exit::BadInput as u8,
            message: format!("its report cannot be read: {error}"),
        })?;
        if self.in_process && !forget_peak() {
            let runs = documents.iter_mut().filter_map(|d| d.run.as_mut());
            runs.for_each(|run| run.peak_bytes = None);
        }
        Ok(documents)
    }
}

/// How many words name the command: two where the second is a verb of the first.
fn command_words(words: &[String]) -> usize {
    let has_verb = words.len() > 1 && cli::find(&cli::command(), &words[..2].join(" ")).is_some();
    if has_verb { 2 } else { 1 }
}

/// Exit code and both streams of a run.
type Ended = (u8, Vec<u8>, Vec<u8>);

fn in_a_fresh_process(words: &[String]) -> Result<Ended, Failed> {
    let started = std::env::current_exe().and_then(|program| {
        let mut command = Command::new(program);
        command.args(words).stdin(Stdio::null()).output()
    });
    let output = started.map_err(|error| Failed {
        code: Exit::OverLimit as u8,
        message: format!("no process could be started: {error}"),
    })?;
    match output.status.code() {
        Some(code) => Ok((
            u8::try_from(code).unwrap_or(u8::MAX),
            output.stdout,
            output.stderr,
        )),
        None => Err(Failed {
            code: Exit::Bug as u8,
            message: format!("it was ended from outside: {}", output.status),
        }),
    }
}

fn in_this_process(words: &[String]) -> Ended {
    forget_peak();
    let run = || match cli::parse_words(words) {
        Ok(command) => crate::run(&command) as u8,
        Err(error) => {
            say(cli::message(&error));
            Exit::Usage as u8
        }
    };
    // A panic is a bug of the command that runs, and no reason to lose the figures of the others.
    let (code, captured) = capture(|| catch_unwind(AssertUnwindSafe(run)).unwrap_or(101));
    (code, captured.out, captured.err)
}

/// What a run said on standard error, in one line and without the program's name.
fn message(err: &[u8]) -> String {
    let text = String::from_utf8_lossy(err);
    let lines: Vec<&str> = text
        .lines()
        .map(|line| line.strip_prefix("scantle: ").unwrap_or(line).trim())
        .filter(|line| !line.is_empty())
        .collect();
    lines.join("; ")
}

/// The figures of a run over all its inputs: times add up, errors and memory count by the largest.
pub fn figures(documents: &[Document], trade: &Trade) -> Ran {
    let runs = || documents.iter().filter_map(|d| d.run.as_ref());
    let errors: Vec<&Accuracy> = documents.iter().filter_map(|d| d.error(trade)).collect();
    let largest = |of: fn(&Accuracy) -> Option<f64>| {
        let all: Option<Vec<f64>> = errors.iter().map(|a| of(a)).collect();
        all?.into_iter().reduce(f64::max)
    };
    let all_known = errors.len() == documents.len();
    let modelled = documents.iter().filter_map(|d| d.modelled.clone());
    Ran {
        wall_s: runs().map(|run| run.wall_s).sum(),
        cpu_s: runs().map(|run| run.cpu_s).sum(),
        peak_bytes: runs().filter_map(|run| run.peak_bytes).max(),
        error: largest(|a| a.reached.filter(|_| a.verified)).filter(|_| all_known),
        bound: largest(|a| a.bound).filter(|_| all_known),
        modelled: modelled.reduce(|a, b| {
            Modelled::new(&a.unit, a.made + b.made, a.full + b.full, a.bytes + b.bytes)
        }),
    }
}

/// Says why the work cannot begin.
pub fn refuse(command: &str, why: &str) -> Exit {
    say(format_args!("{command}: {why}"));
    Exit::Usage
}
