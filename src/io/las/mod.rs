//! LAS, the exchange format of laser scans (ASPRS LAS specification 1.4, R15), and LAZ, in which LASzip
//! packs its points.
//!
//! Read are versions 1.0 to 1.4 with all point formats, 0 to 10: coordinates, colours and classes. The
//! rest of a point is left out, with a warning that names it; points marked as withheld are kept, and
//! counted. Colours are of 16 bits; those that are all below 256 are taken for bytes, and those that are
//! all black for none. Where no point has a class but 0, which is that of points never classified, the
//! cloud has none.

mod header;
mod packed;
mod points;
#[cfg(test)]
mod tests;
mod write;

pub use write::{rounded, write, write_packed};

use super::cloud;
use super::refusal::Refusal;
use super::source::Source;
use crate::error::Fault;
use crate::mesh::Mesh;
use crate::report::Warning;
use header::Header;
use points::{Part, Records};
use rayon::prelude::*;

/// Points that one task reads.
const TASK: usize = 1 << 14;

/// Reads the points of a LAS or LAZ file, in their order.
///
/// Coordinates are the whole numbers of the file times its scale, plus its offset, in double precision:
/// large offsets lose nothing.
///
/// # Errors
///
/// A header that is cut short, of another version or with a scale that is none; a point format above 10,
/// with its number; fewer points than the header states; packed points that are damaged; all with the
/// byte. No points at all; more than the source may hold.
///
/// # Cost
///
/// Linear in the bytes, on all threads: LAZ files by their chunks, of usually 50,000 points.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Mesh, Refusal> {
    let bytes = source.bytes();
    let header = Header::parse(bytes)?;
    let has_colors = header.color().is_some();
    let row = 2 * cloud::bytes_of(false, has_colors, true);
    let there = (bytes.len() - header.data) / header.length;
    if !header.is_packed && (there as u64) < header.points {
        let problem = format!("the file ends after {there} of {} points", header.points);
        return Err(Fault::byte(bytes.len(), problem).into());
    }
    let packed = match header.is_packed && header.points > 0 {
        true => Some(packed::find(bytes, &header)?),
        false => None,
    };
    cloud::expect_points(header.points, row, source.limit())?;
    let records = Records::of(&header);
    let parts = match packed {
        Some(packed) => packed.unpack(&records)?,
        None => plain(&bytes[header.data..], &header, &records),
    };
    let all = Part::joined(parts, warnings);
    cloud::warn_of_ignored(&header.ignored(), warnings);
    let mesh = Mesh {
        positions: all.positions,
        colors: points::colors(&all.colors, warnings),
        classes: Some(all.classes).filter(|classes| classes.iter().any(|class| *class != 0)),
        ..Mesh::default()
    };
    Ok(cloud::of_all(mesh)?)
}

/// The points of a file that is not packed, and has enough of them.
fn plain(bytes: &[u8], header: &Header, records: &Records) -> Vec<Part> {
    let length = header.length;
    let part = |bytes: &[u8]| {
        let mut part = Part::default();
        let each = bytes.chunks_exact(length);
        each.for_each(|record| records.take(record, &mut part));
        part
    };
    let bytes = &bytes[..header.points as usize * length];
    bytes.par_chunks(TASK * length).map(part).collect()
}

/// Whether bytes begin as LAS and LAZ files do, and whether their points are packed.
pub fn is_packed(bytes: &[u8]) -> Option<bool> {
    let format = bytes.get(104)?;
    bytes
        .starts_with(header::MAGIC)
        .then_some(format & 0xc0 != 0)
}
