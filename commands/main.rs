//! The `scantle` command line: reads its words, runs a command, ends with a code.
//!
//! Everything about the terminal is here: the options ([`shared`]), the streams ([`streams`]),
//! the exit codes ([`exit`]). The geometry is in the library.

mod cli;
mod context;
mod destination;
mod exit;
mod job;
mod machine;
mod progress;
mod shared;
mod streams;
mod words;

mod compare;
mod completions;
mod convert;
mod formats;
mod info;
mod man;
mod schema;
mod voxelize;

use cli::Command;
use std::process::ExitCode;

fn main() -> ExitCode {
    let command = match cli::parse() {
        Ok(command) => command,
        Err(exit) => return exit.into(),
    };
    let ended = match &command {
        Command::Voxelize(args) => voxelize::run(args),
        Command::Info(args) => info::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Formats(args) => formats::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Completions(args) => completions::run(args),
        Command::Man(args) => man::run(args),
    };
    let exit = ended.unwrap_or_else(|error| streams::complain(&error, None));
    exit.into()
}
