//! `scantle completions`: words that a shell can fill in.

use crate::cli;
use crate::exit::Exit;
use crate::streams::print;
use clap_complete::Shell;
use scantle::error::Result;

/// Print the completions for a shell
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

const EXAMPLES: &str = "\
Examples:
  scantle completions bash > scantle.bash
  scantle completions zsh > _scantle
";

/// Prints them.
pub fn run(args: &Args) -> Result<Exit> {
    // clap_complete panics when its stream closes, so it writes to memory.
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut cli::command(), "scantle", &mut script);
    print(&script)?;
    Ok(Exit::Done)
}
