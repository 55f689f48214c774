//! The only code that touches standard output and standard error.

use crate::exit::Exit;
use scantle::error::{Error, Result};
use std::cell::RefCell;
use std::fmt::Display;
use std::io::{self, Write};

/// What a run would have written to the two streams.
#[derive(Debug, Default)]
pub struct Captured {
    /// What would have gone to standard output.
    pub out: Vec<u8>,
    /// What would have gone to standard error.
    pub err: Vec<u8>,
}

thread_local! {
    /// Where this thread's streams go instead, while a command runs inside another. Commands print
    /// on the thread that runs them; workers never print.
    static CAPTURED: RefCell<Option<Captured>> = const { RefCell::new(None) };
}

/// Runs `work` with what this thread prints kept back.
pub fn capture<T>(work: impl FnOnce() -> T) -> (T, Captured) {
    let before = CAPTURED.replace(Some(Captured::default()));
    let done = work();
    let captured = CAPTURED.replace(before).unwrap_or_default();
    (done, captured)
}

/// Whether the bytes were kept back.
fn is_captured(of: fn(&mut Captured) -> &mut Vec<u8>, bytes: &[u8]) -> bool {
    CAPTURED.with_borrow_mut(|captured| match captured {
        Some(captured) => {
            of(captured).extend_from_slice(bytes);
            true
        }
        None => false,
    })
}

/// Writes one document to standard output.
pub fn print(bytes: &[u8]) -> Result<()> {
    if is_captured(|c| &mut c.out, bytes) {
        return Ok(());
    }
    let mut out = io::stdout().lock();
    out.write_all(bytes)
        .and_then(|()| out.flush())
        .map_err(|source| Error::Write {
            path: "-".into(),
            source,
        })
}

/// Shows text to the person at standard error. Nobody listening is no reason to stop.
pub fn show(text: &str) {
    if !is_captured(|c| &mut c.err, text.as_bytes()) {
        let _ = io::stderr().lock().write_all(text.as_bytes());
    }
}

/// Says one line to the person at standard error.
pub fn say(line: impl Display) {
    show(&format!("scantle: {line}\n"));
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
        (Error::Limit { .. } | Error::Parameter { .. }, Some(file)) => {
            say(format_args!("{file}: {error}"))
        }
        _ => say(error),
    }
    if let Some(hint) = error.hint() {
        show(&format!("  {hint}\n"));
    }
    exit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_inside_is_kept_back() {
        let (inner, outer) = capture(|| {
            say("before");
            let (_, inner) = capture(|| {
                print(b"document").expect("memory can be written");
                say("inside");
            });
            say("after");
            inner
        });
        assert_eq!(inner.out, b"document");
        assert_eq!(inner.err, b"scantle: inside\n");
        assert_eq!(outer.out, b"");
        assert_eq!(outer.err, b"scantle: before\nscantle: after\n");
    }
}
