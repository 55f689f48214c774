//! gltf.

use crate::error::Fault;
use crate::io::source::Source;
use crate::mesh::Mesh;
use crate::report::Warning;
use std::io::{self, Write};

/// Reads.
pub fn read(_source: &Source, _warnings: &mut Vec<Warning>) -> Result<Mesh, Fault> {
    todo!()
}

/// Writes.
pub fn write(_mesh: &Mesh, _out: &mut dyn Write) -> io::Result<()> {
    todo!()
}
