//! `scantle formats`: the table of formats.

use crate::exit::Exit;
use crate::streams::print;
use crate::words;
use scantle::error::Result;
use scantle::io::format::Format;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt::Write;

/// List the file formats that are read and written
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// As JSON, for programs
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  scantle formats
  scantle formats --json
";

/// The table, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Table {
    /// Version of scantle.
    scantle: &'static str,
    /// The formats.
    formats: Vec<Row>,
}

/// A format.
#[derive(Debug, Serialize, JsonSchema)]
struct Row {
    /// Its name, for `--input-format` and `--output-format`.
    name: &'static str,
    /// What it holds: `mesh`, `volume`, `image`, `molecule`, `animation`,
    /// `terrain`, `vectors` or `report`.
    kind: &'static str,
    /// File name extensions, the usual one first.
    extensions: &'static [&'static str],
    /// Whether it is read.
    read: bool,
    /// Whether it is written.
    write: bool,
    /// One line about it.
    about: &'static str,
}

/// Prints the table.
pub fn run(args: &Args) -> Result<Exit> {
    let formats: Vec<Row> = Format::all()
        .map(|format| Row {
            name: format.name(),
            kind: format.kind().name(),
            extensions: format.extensions(),
            read: format.is_read(),
            write: format.is_written(),
            about: format.about(),
        })
        .collect();
    if args.json {
        let scantle = env!("CARGO_PKG_VERSION");
        print(&words::json(&Table { scantle, formats }, true))?;
    } else {
        print(table(&formats).as_bytes())?;
    }
    Ok(Exit::Done)
}

fn table(formats: &[Row]) -> String {
    let mut text = format!(
        "{:<11} {:<9} {:<5} {:<6} about\n",
        "name", "kind", "read", "write"
    );
    let yes = |there| if there { "yes" } else { "-" };
    for row in formats {
        let (read, write) = (yes(row.read), yes(row.write));
        let _ = writeln!(
            text,
            "{:<11} {:<9} {read:<5} {write:<6} {}",
            row.name, row.kind, row.about
        );
    }
    text
}
