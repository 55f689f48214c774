//! The `scantle` command line: reads its words, runs a command, ends with a code.
//!
//! Everything about the terminal is here: the options ([`shared`]), the streams ([`streams`]),
//! the exit codes ([`exit`]). The geometry is in the library.

mod cli;
mod context;
mod destination;
mod exit;
mod found;
mod job;
mod land;
mod machine;
mod places;
mod progress;
mod runs;
mod shared;
mod streams;
mod table;
mod taken;
mod trade;
mod words;
mod wrapped;

mod compare;
mod completions;
mod compress_anim;
mod convert;
mod drape;
mod formats;
mod info;
mod isosurface;
mod man;
mod schema;
mod shadow;
mod smooth_mc;
mod splat_gen;
mod splat_trace;
mod stability;
mod tradeoff;
mod tunnels;
mod vector_overlay;
mod voxelize;

use cli::Command;
use exit::Exit;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::parse() {
        Ok(command) => run(&command).into(),
        Err(exit) => exit.into(),
    }
}

/// Runs a command; says what went wrong.
fn run(command: &Command) -> Exit {
    let ended = match command {
        Command::Voxelize(args) => voxelize::run(args),
        Command::Shadow(args) => shadow::run(args),
        Command::SplatGen(args) => splat_gen::run(args),
        Command::SplatTrace(args) => splat_trace::run(args),
        Command::VectorOverlay(args) => vector_overlay::run(args),
        Command::Drape(args) => drape::run(args),
        Command::SmoothMc(args) => smooth_mc::run(args),
        Command::Isosurface(args) => isosurface::run(args),
        Command::Tunnels(args) => tunnels::run(args),
        Command::CompressAnim(args) => compress_anim::run(args),
        Command::Info(args) => info::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Tradeoff(args) => tradeoff::run(args),
        Command::Stability(args) => stability::run(args),
        Command::Formats(args) => formats::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Completions(args) => completions::run(args),
        Command::Man(args) => man::run(args),
    };
    ended.unwrap_or_else(|error| streams::complain(&error, None))
}
