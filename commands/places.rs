//! Where the commands that run another one put what they found.

use crate::destination::{check_folder, refuse_overlap};
use crate::shared::Wrapping;
use crate::streams::print;
use crate::table::Table;
use crate::words;
use scantle::error::Result;
use scantle::io::sink::Sink;
use scantle::report::{Input, Output, Report, SCHEMA};
use serde::Serialize;

/// Where results go.
pub struct Places {
    csv: Option<Sink>,
    report: Sink,
}

impl Places {
    /// Errs, before any work, where two results would go to one place or over an input, or a folder
    /// is not there.
    pub fn new(wrapping: &Wrapping, inputs: &[String]) -> Result<Self> {
        let places = Places {
            csv: wrapping.csv.as_deref().map(Sink::new),
            report: Sink::new(wrapping.report.report.as_deref().unwrap_or("-")),
        };
        let csv = places.csv.iter().map(|sink| ("csv", sink));
        let written: Vec<_> = csv.chain([("report", &places.report)]).collect();
        refuse_overlap(inputs, &written)?;
        written
            .iter()
            .try_for_each(|(_, sink)| check_folder(sink))?;
        Ok(places)
    }

    /// Writes the table, where it is wanted.
    pub fn write_csv(&self, table: &Table) -> Result<Vec<Output>> {
        let written = self.csv.as_ref().map(|sink| {
            let text = table.csv();
            sink.write_as("csv", |out| out.write_all(&text))
        });
        Ok(written.transpose()?.into_iter().collect())
    }

    /// Writes the report.
    pub fn deliver<P: Serialize, R: Serialize>(
        &self,
        command: &str,
        parameters: P,
        result: R,
        input: Vec<Input>,
        output: Vec<Output>,
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
