//! metaimage.

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

/// Writes the header and, beside it, the data.
pub fn write_pair(
    _volume: &Volume,
    _sink: &crate::io::sink::Sink,
) -> crate::error::Result<Vec<crate::report::Output>> {
    todo!()
}
