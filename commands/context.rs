//! What a command works in: threads, memory, and the reports of its jobs.

use crate::destination::{self, Beside, Destination, Extra, Target};
use crate::exit::Exit;
use crate::job::{Found, Job};
use crate::machine::{self, Moment};
use crate::progress;
use crate::shared::{Common, InputFormat, Inputs, Output, Preview};
use crate::streams::{complain, print};
use crate::taken::{Reads, Taken, Writes, check_streams};
use rayon::{ThreadPool, ThreadPoolBuilder};
use scantle::error::{Error, Result};
use scantle::io::format::Format;
use scantle::io::sink::Sink;
use serde::Serialize;
use std::cell::Cell;
use std::slice;
use std::sync::Mutex;

/// Threads, memory limit and clock of one run.
pub struct Context<'a> {
    common: &'a Common,
    pool: ThreadPool,
    memory: u64,
    start: Moment,
}

/// The files of a run, as the command line names them.
pub struct Files<'a> {
    inputs: &'a [String],
    format: Option<Format>,
    together: bool,
    output: Option<&'a Output>,
    extras: Vec<(Extra, &'a str)>,
    placeholder: Option<&'static str>,
    /// What is read beside the inputs.
    beside: Vec<Reads>,
    /// What is written once, for all inputs: the option, and where.
    once: Vec<(&'static str, Sink)>,
}

impl<'a> Files<'a> {
    /// Inputs that are worked on one after the other, with a report for each.
    pub fn each(inputs: &'a Inputs) -> Self {
        Files {
            together: false,
            ..Files::together(&inputs.inputs, &inputs.format)
        }
    }

    /// Inputs that belong together, with one report.
    pub fn together(inputs: &'a [String], format: &InputFormat) -> Self {
        Files {
            inputs,
            format: format.input_format,
            together: true,
            output: None,
            extras: Vec::new(),
            placeholder: None,
            beside: Vec::new(),
            once: Vec::new(),
        }
    }

    /// With a file that an option, one of [`READ`](crate::taken::READ), has read beside the inputs.
    pub fn reads(mut self, option: &'static str, word: &Option<String>) -> Self {
        let word = word.as_deref();
        self.beside
            .extend(word.map(|word| Reads::beside(option, word)));
        self
    }

    /// With a result that is written where the user says.
    pub fn output(mut self, output: &'a Output) -> Self {
        self.output = Some(output);
        self
    }

    /// With several results of one input, one for each of what a placeholder stands for, where the
    /// place has it.
    pub fn several(mut self, placeholder: Option<&'static str>) -> Self {
        self.placeholder = placeholder;
        self
    }

    /// With a picture, where the user wants one.
    pub fn preview(self, preview: &'a Preview) -> Self {
        self.also(Extra::PREVIEW, &preview.preview)
    }

    /// With something else beside the result, where the user wants it: the word of its option.
    ///
    /// [`Job::write_also`] writes it.
    pub fn also(mut self, extra: Extra, word: &'a Option<String>) -> Self {
        self.extras
            .extend(word.as_deref().map(|word| (extra, word)));
        self
    }

    /// All that is read.
    fn all_read(&self) -> Vec<Reads> {
        let inputs = self.inputs.iter();
        let inputs = inputs.map(|word| Reads::input(word, self.format));
        inputs.chain(self.beside.clone()).collect()
    }

    /// Errs where standard input is to be read twice: for commands that read what options name before
    /// [`Context::run`] says so.
    pub fn check_reads(&self) -> Result<()> {
        check_streams(&self.all_read())
    }

    /// With what the command itself writes after all jobs, where an option says.
    pub fn once(mut self, option: &'static str, sink: Option<&Sink>) -> Self {
        self.once.extend(sink.map(|sink| (option, sink.clone())));
        self
    }

    /// The inputs of each job.
    fn jobs(&self) -> Vec<&'a [String]> {
        if self.together {
            vec![self.inputs]
        } else {
            self.inputs.iter().map(slice::from_ref).collect()
        }
    }

    /// The name of each job: its first input.
    fn names(&self) -> Vec<String> {
        self.jobs().iter().map(|job| job[0].clone()).collect()
    }

    fn plan_outputs(&self) -> Result<Option<Vec<Target>>> {
        let Some((word, asked)) = self
            .output
            .and_then(|o| Some((o.output.as_deref()?, o.output_format)))
        else {
            return Ok(None);
        };
        let planned = destination::plan(
            "output",
            word,
            asked.map(|format| format.extensions()[0]),
            &self.names(),
            self.placeholder,
        )?;
        planned
            .into_iter()
            .map(|place| {
                let format = output_format(word, asked, &place.sink)?;
                Ok(Target {
                    place,
                    format,
                    is_named: asked.is_some(),
                })
            })
            .collect::<Result<_>>()
            .map(Some)
    }

    /// What is written beside the result of each job.
    fn plan_extras(&self) -> Result<Vec<Vec<Beside>>> {
        let names = self.names();
        let mut planned = vec![Vec::with_capacity(self.extras.len()); names.len()];
        for (extra, word) in &self.extras {
            for (all, beside) in planned.iter_mut().zip(extra.plan(word, &names)?) {
                all.push(beside);
            }
        }
        Ok(planned)
    }
}

/// The format to write: as asked, or as the name tells.
fn output_format(word: &str, asked: Option<Format>, sink: &Sink) -> Result<Format> {
    let format = asked.or_else(|| sink.format());
    format.filter(|format| format.is_written()).ok_or_else(|| {
        let names: Vec<_> = Format::all()
            .filter(|format| format.is_written())
            .map(Format::name)
            .collect();
        let names = names.join(", ");
        let problem =
            format!("its name tells no format that is written; --output-format is one of: {names}");
        Error::parameter("output", word, problem)
    })
}

impl<'a> Context<'a> {
    /// Starts the clock and the threads.
    pub fn new(common: &'a Common) -> Result<Self> {
        let start = Moment::now();
        let threads = machine::threads(common.threads);
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::parameter("threads", threads, e.to_string()))?;
        Ok(Context {
            common,
            pool,
            memory: common.max_memory.unwrap_or_else(machine::default_memory),
            start,
        })
    }

    /// Bytes that may be taken.
    pub fn memory(&self) -> u64 {
        self.memory
    }

    /// Worker threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// The options that every working command has.
    pub fn common(&self) -> &Common {
        self.common
    }

    /// Does `work` for each job and reports on it; says what went wrong and goes on with the next.
    ///
    /// What is wrong with the command line as a whole is an error before any work is done.
    pub fn run<P, R>(
        &self,
        command: &'static str,
        files: &Files,
        work: impl Fn(&mut Job) -> Result<Found<P, R>> + Sync,
    ) -> Result<Exit>
    where
        P: Serialize + Send,
        R: Serialize + Send,
    {
        let jobs = files.jobs();
        let outputs = files.plan_outputs()?;
        let extras = files.plan_extras()?;
        let report = self.report_sink(outputs.as_deref())?;
        let taken = taken(files, self.memory, outputs.as_deref(), &extras, &report)?;
        let taken = Mutex::new(taken);
        let results = outputs.iter().flatten().map(|target| &target.place);
        results
            .chain(extras.iter().flatten().map(|beside| &beside.place))
            .try_for_each(Destination::check)?;
        let once = files.once.iter().map(|(_, sink)| sink);
        once.chain(&report).try_for_each(destination::check_place)?;

        let with_bar = !self.common.talk.quiet && progress::is_watched();
        let start = Cell::new(self.start);
        let mut lines = Vec::new();
        let mut worst = Exit::Done;
        for ((index, inputs), extras) in jobs.iter().enumerate().zip(extras) {
            let output = outputs.as_ref().map(|all| all[index].clone());
            let job = Job::new(self, inputs, files.format, start.get(), with_bar);
            let mut job = job.among_others(jobs.len() > 1);
            job.send_to(output, extras, &taken);
            let found = self.pool.install(|| work(&mut job));
            worst = worst.max(match found {
                Err(error) => job.fail(error),
                Ok(found) => {
                    let (document, exit) = job.finish(command, found, jobs.len() == 1);
                    if report == Some(Sink::Stdout) {
                        exit.max(ending(print(&document)))
                    } else {
                        lines.extend(document);
                        exit
                    }
                }
            });
            start.set(Moment::now());
        }
        match report {
            Some(sink @ Sink::File(_)) if !lines.is_empty() => {
                let written = sink.write_as("json", |out| out.write_all(&lines));
                Ok(worst.max(ending(written)))
            }
            _ => Ok(worst),
        }
    }

    /// Where reports go: standard output carries the result or the report, never both.
    fn report_sink(&self, outputs: Option<&[Target]>) -> Result<Option<Sink>> {
        let data_on_stdout =
            outputs.is_some_and(|all| all.iter().any(|to| to.place.sink == Sink::Stdout));
        match (self.common.report.report.as_deref(), data_on_stdout) {
            (Some("-"), true) => Err(Error::parameter(
                "report",
                "-",
                "standard output carries the result already (--output -)",
            )),
            (Some(word), _) => Ok(Some(Sink::new(word))),
            (None, true) => Ok(None),
            (None, false) => Ok(Some(Sink::Stdout)),
        }
    }
}

fn ending<T>(result: Result<T>) -> Exit {
    match result {
        Ok(_) => Exit::Done,
        Err(error) => complain(&error, None),
    }
}

/// All places of a run: what is read, and what is written where.
fn taken(
    files: &Files,
    memory: u64,
    outputs: Option<&[Target]>,
    extras: &[Vec<Beside>],
    report: &Option<Sink>,
) -> Result<Taken> {
    let mut taken = Taken::by(files.all_read(), memory)?;
    let outputs = outputs.into_iter().flatten();
    let extras = extras.iter().flatten();
    let place = |option, sink| Writes {
        option,
        sink,
        format: None,
    };
    outputs
        .map(Target::writes)
        .chain(extras.map(|to| place(to.option, &to.place.sink)))
        .chain(files.once.iter().map(|(option, sink)| place(option, sink)))
        .chain(report.iter().map(|sink| place("report", sink)))
        .try_for_each(|output| taken.take(&output))?;
    Ok(taken)
}
