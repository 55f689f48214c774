//! `scantle man`: the manual pages that are checked in under `man/`.

use crate::cli;
use crate::exit::Exit;
use scantle::error::{Error, Result};
use std::fs;
use std::path::PathBuf;

/// Write the manual pages into a folder
#[derive(Debug, clap::Args)]
#[command(hide = true)]
pub struct Args {
    /// The folder; it is made when it is not there
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Writes `scantle.1` and a page per command.
pub fn run(args: &Args) -> Result<Exit> {
    fs::create_dir_all(&args.folder)
        .and_then(|()| clap_mangen::generate_to(cli::command(), &args.folder))
        .map_err(|source| Error::Write {
            path: args.folder.clone(),
            source,
        })?;
    Ok(Exit::Done)
}
