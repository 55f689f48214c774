//! Where the commands that run another one put what they found.

use crate::destination::check_place;
use crate::exit::Exit;
use crate::machine::default_memory;
use crate::shared::Wrapping;
use crate::streams::{complain, print};
use crate::table::Table;
use crate::taken::{Taken, Writes};
use crate::words;
use crate::wrapped::Wrapped;
use scantle::error::{Error, Result};
use scantle::image::plot::Plot;
use scantle::io::sink::Sink;
use scantle::report::{Input, Output, Report, SCHEMA};
use serde::Serialize;

/// Where a plot goes, and as what.
struct Picture {
    sink: Sink,
    name: &'static str,
}

impl Picture {
    fn new(word: &str) -> Result<Self> {
        let sink = Sink::new(word);
        let extension = sink.path().extension().map(|e| e.to_ascii_lowercase());
        let name = ["svg", "png"].into_iter().find(|name| {
            let wanted = extension.as_deref();
            wanted.is_some_and(|extension| extension == *name)
        });
        let problem = "its name must end in .svg or .png";
        let name = name.ok_or_else(|| Error::parameter("plot", word, problem))?;
        Ok(Picture { sink, name })
    }
}

/// A plot as the bytes of a file, `svg` or else `png`.
pub fn drawn(plot: &Plot, format: &str) -> Vec<u8> {
    match format {
        "svg" => plot.svg().into_bytes(),
        _ => plot.png(),
    }
}

/// Where results go.
pub struct Places {
    csv: Option<Sink>,
    plot: Option<Picture>,
    report: Sink,
}

impl Places {
    /// Errs, before any work, where two results would go to one place or over what the command reads, or a
    /// folder is not there or stands in the way.
    pub fn new(wrapping: &Wrapping, wrapped: &Wrapped) -> Result<Self> {
        let places = Places {
            csv: wrapping.csv.as_deref().map(Sink::new),
            plot: wrapping.plot.as_deref().map(Picture::new).transpose()?,
            report: Sink::new(wrapping.report.report.as_deref().unwrap_or("-")),
        };
        let place = |option, sink| Writes {
            option,
            sink,
            format: None,
        };
        let csv = places.csv.iter().map(|sink| place("csv", sink));
        let plot = places.plot.iter().map(|plot| place("plot", &plot.sink));
        let report = [place("report", &places.report)];
        let written: Vec<_> = plot.chain(csv).chain(report).collect();
        let mut taken = Taken::by(wrapped.reads(), default_memory())?;
        written.iter().try_for_each(|place| taken.take(place))?;
        written
            .iter()
            .try_for_each(|place| check_place(place.sink))?;
        Ok(places)
    }

    /// Writes the plot and the table, where they are wanted: what was written, and the exit code of
    /// what could not be, which is said. The report is due all the same.
    pub fn write(
        &self,
        plot: impl FnOnce() -> Plot,
        table: impl FnOnce() -> Table,
    ) -> (Vec<Output>, Exit) {
        let mut written = Vec::new();
        let mut exit = Exit::Done;
        let mut keep = |result: Result<Output>| match result {
            Ok(output) => written.push(output),
            Err(error) => exit = exit.max(complain(&error, None)),
        };
        if let Some(Picture { sink, name }) = &self.plot {
            let drawn = drawn(&plot(), name);
            keep(sink.write_as(name, |out| out.write_all(&drawn)));
        }
        if let Some(sink) = &self.csv {
            let text = table().csv();
            keep(sink.write_as("csv", |out| out.write_all(&text)));
        }
        (written, exit)
    }

    /// Writes the report; `varies` names what of it does from run to run.
    pub fn deliver<P: Serialize, R: Serialize>(
        &self,
        command: &str,
        parameters: P,
        result: R,
        input: Vec<Input>,
        output: Vec<Output>,
        varies: Vec<&'static str>,
    ) -> Result<()> {
        let report = Report {
            schema: SCHEMA,
            scantle: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            input,
            output,
            parameters,
            result,
            accuracy: None,
            modelled: None,
            warnings: Vec::new(),
            varies,
            run: None,
        };
        let document = words::json(&report, true);
        match &self.report {
            Sink::Stdout => print(&document),
            sink => sink
                .write_as("json", |out| out.write_all(&document))
                .map(|_| ()),
        }
    }
}
