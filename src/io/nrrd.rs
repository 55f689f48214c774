//! nrrd.

use crate::error::Fault;
use crate::io::source::Source;
use crate::report::Warning;
use crate::volume::Volume;
use std::io::{self, Write};

/// Reads.
pub fn read(_source: &Source, _warnings: &mut Vec<Warning>) -> Result<Volume, Fault> {
    todo!()
}

/// Writes.
pub fn write(_volume: &Volume, _out: &mut dyn Write) -> io::Result<()> {
    todo!()
}
