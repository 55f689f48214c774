//! Exit codes: a promise to the programs that call this one.

use scantle::error::Error;
use std::io::ErrorKind;
use std::process::ExitCode;

/// How a run ended. Of several endings the largest one counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// Done, and a check that was asked for failed.
    CheckFailed = 1,
    /// The command line asks for something that is not there or contradicts itself.
    Usage = 2,
    /// An input cannot be read, or is not what it should be.
    BadInput = 3,
    /// An output cannot be written.
    NotWritten = 4,
    /// Refused: over a stated limit.
    OverLimit = 5,
    /// A bug, always: a run inside this one panicked, or ended in a way that is no promise.
    Bug = 101,
}

impl Exit {
    /// The ending of a run that ended with this code; codes that are no promise are a bug.
    pub fn of_code(code: u8) -> Exit {
        match code {
            0 => Exit::Done,
            1 => Exit::CheckFailed,
            2 => Exit::Usage,
            3 => Exit::BadInput,
            4 => Exit::NotWritten,
            5 => Exit::OverLimit,
            _ => Exit::Bug,
        }
    }

    /// The ending that an error makes. A reader of standard output that leaves early is no error.
    pub fn of(error: &Error) -> Exit {
        match error {
            Error::Parameter { .. } => Exit::Usage,
            Error::Read { .. } | Error::Malformed { .. } | Error::Geometry(_) => Exit::BadInput,
            Error::Write { path, source }
                if source.kind() == ErrorKind::BrokenPipe && path.as_os_str() == "-" =>
            {
                Exit::Done
            }
            Error::Write { .. } => Exit::NotWritten,
            Error::Limit { .. } => Exit::OverLimit,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scantle::error::Fault;
    use std::io;

    fn unwritten(path: &str, kind: ErrorKind) -> Error {
        Error::Write {
            path: path.into(),
            source: io::Error::from(kind),
        }
    }

    #[test]
    fn every_error_has_its_code() {
        let read = Error::Read {
            path: "a.obj".into(),
            source: io::Error::from(ErrorKind::NotFound),
        };
        let malformed = Error::Malformed {
            path: "a.obj".into(),
            fault: Fault::whole("no faces"),
        };
        let rows = [
            (Error::parameter("threads", 0, "too few"), 2),
            (read, 3),
            (malformed, 3),
            (Error::Geometry(Fault::whole("is open")), 3),
            (unwritten("a.obj", ErrorKind::PermissionDenied), 4),
            (unwritten("a.obj", ErrorKind::BrokenPipe), 4),
            (unwritten("-", ErrorKind::StorageFull), 4),
            (unwritten("-", ErrorKind::BrokenPipe), 0),
            (Error::over_memory("the grid", 9, 8, None), 5),
        ];
        for (error, code) in rows {
            assert_eq!(Exit::of(&error) as u8, code, "{error}");
        }
    }

    #[test]
    fn a_crash_is_no_refusal() {
        for code in 0..=5 {
            assert_eq!(Exit::of_code(code) as u8, code);
        }
        for code in [6, 101, 134, 139, 255] {
            assert_eq!(Exit::of_code(code), Exit::Bug, "{code}");
        }
        assert!(Exit::Bug > Exit::OverLimit);
    }

    #[test]
    fn the_largest_ending_counts() {
        assert_eq!(
            [Exit::BadInput, Exit::Done, Exit::CheckFailed]
                .into_iter()
                .max(),
            Some(Exit::BadInput)
        );
    }
}
