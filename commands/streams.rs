//! The only code that touches standard output and standard error.

use crate::exit::Exit;
use scantle::error::{Error, Result};
use std::fmt::Display;
use std::io::{self, Write};

/// Writes one document to standard output.
pub fn print(bytes: &[u8]) -> Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)
        .and_then(|()| out.flush())
        .map_err(|source| Error::Write {
            path: "-".into(),
            source,
        })
}

/// Says one line to the person at standard error. Nobody listening is no reason to stop.
pub fn say(line: impl Display) {
    let _ = writeln!(io::stderr().lock(), "scantle: {line}");
}

/// Says what went wrong, and on a second line the way out; returns the exit code that it means.
///
/// `about` is the input the error is about, for errors that do not name a file themselves.
pub fn complain(error: &Error, about: Option<&str>) -> Exit {
    let exit = Exit::of(error);
    if exit == Exit::Done {
        return exit;
    }
    match (error, about) {
        (Error::Limit { .. }, Some(file)) => say(format_args!("{file}: {error}")),
        _ => say(error),
    }
    if let Some(hint) = error.hint() {
        let _ = writeln!(io::stderr().lock(), "  {hint}");
    }
    exit
}
