//! Why a reader gives up.

use super::source::Source;
use crate::error::{Error, Fault};

/// Why a file is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// What it holds is not what its format asks for.
    Fault(Fault),
    /// What it holds, or claims to hold, takes more memory than may be held.
    OverMemory {
        /// What takes it, with the numbers.
        what: String,
        /// How many bytes it takes.
        needed: u128,
        /// How many may be held.
        limit: u64,
        /// The way out.
        hint: &'static str,
    },
}

/// The way out of most refusals over the limit.
pub const RAISE: &str = "raise --max-memory, or make the input smaller";

impl Refusal {
    /// The error that it is for a file. As all refusals over a limit it does not name the file: who
    /// reads it knows.
    pub fn of(self, source: &Source) -> Error {
        match self {
            Refusal::Fault(fault) => Error::Malformed {
                path: source.path().to_owned(),
                fault,
            },
            Refusal::OverMemory {
                what,
                needed,
                limit,
                hint,
            } => Error::over_memory(what, needed, limit, Some(hint)),
        }
    }

    /// The fault that a test expects.
    #[cfg(test)]
    pub fn fault(self) -> Fault {
        match self {
            Refusal::Fault(fault) => fault,
            over => panic!("no fault, but {over:?}"),
        }
    }
}

impl From<Fault> for Refusal {
    fn from(fault: Fault) -> Self {
        Refusal::Fault(fault)
    }
}

/// Errs when what is about to be made takes more than `limit` bytes.
pub fn expect_room(
    what: impl FnOnce() -> String,
    needed: u128,
    limit: u64,
    hint: &'static str,
) -> Result<(), Refusal> {
    if needed <= u128::from(limit) {
        return Ok(());
    }
    Err(Refusal::OverMemory {
        what: what(),
        needed,
        limit,
        hint,
    })
}
