//! NRRD (Nearly Raw Raster Data), versions 1 to 5.
//!
//! Coordinates are the numbers of the file, whatever its `space` names: nothing is flipped between
//! left and right or front and back. Files are written with `space dimension: 3` and no named
//! space, which says the same to pynrrd and ITK: a point has the coordinates that scantle gave it.
//! Source: teem, "Definition of NRRD File Format".

mod frame;
mod header;

use super::header::join;
use super::refusal::Refusal;
use super::samples::{self, SampleType};
use crate::error::Fault;
use crate::io::source::Source;
use crate::report::Warning;
use crate::volume::Volume;
use flate2::read::MultiGzDecoder;
use header::{Encoding, Header};
use std::borrow::Cow;
use std::io::{self, Write};

/// Reads a volume: encodings raw, gzip and text, attached or in one data file beside the header.
///
/// Three axes, two (one slice), or four of which the first has size 1. The data is measured
/// against the header before room is made for it.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Volume, Refusal> {
    let header = Header::parse(source.bytes())?;
    let layout = frame::layout(&header)?;
    let sample = header.sample_type()?;
    let (dims, wanted) = samples::extent(layout.dims, sample.bytes())?;
    let order = header.byte_order(sample)?;
    let lines = header.skip("lineskip")?;
    let bytes = header.skip("byteskip")?;
    let stored: Cow<[u8]> = match header.data_file()? {
        Some(name) => source.companion(name)?.into(),
        None => source.bytes()[header.end..].into(),
    };
    let stored = after_lines(&stored, lines)?;
    let data = match header.encoding()? {
        Encoding::Raw => {
            let body = after_bytes(stored, bytes, wanted)?;
            samples::decode(
                samples::take(body, wanted, layout.dims, source.limit(), warnings)?,
                sample,
                order,
            )
        }
        Encoding::Gzip => {
            if bytes < 0 {
                return Err(Fault::whole(
                    "byte skip: -1 goes with the encoding raw alone, and this file is gzip",
                )
                .into());
            }
            let whole = usize::try_from(bytes)
                .ok()
                .and_then(|skip| skip.checked_add(wanted))
                .ok_or_else(|| Fault::whole(format!("byte skip: {bytes} is past the data")))?;
            let body = samples::unpack(MultiGzDecoder::new(stored), whole, source.limit())?;
            let body = after_bytes(&body, bytes, wanted)?;
            samples::decode(
                samples::take(body, wanted, layout.dims, source.limit(), warnings)?,
                sample,
                order,
            )
        }
        Encoding::Text => {
            let body = after_bytes(stored, bytes, wanted)?;
            samples::decode_text(body, sample, wanted / sample.bytes())?
        }
    };
    let frame = layout.frame(dims);
    Ok(Volume { frame, data })
}

/// The name of the data file that a header gives, as it stands there; `None` for data of its own,
/// and where the header is not sound.
pub fn named_file(bytes: &[u8]) -> Option<String> {
    let header = Header::parse(bytes).ok()?;
    header.data_file().ok()?.map(str::to_owned)
}

/// What follows `lines` lines.
fn after_lines(bytes: &[u8], lines: i64) -> Result<&[u8], Fault> {
    let mut rest = bytes;
    for line in 0..lines.max(0) {
        let Some(end) = rest.iter().position(|b| *b == b'\n') else {
            return Err(Fault::whole(format!(
                "line skip: {lines} lines are to be skipped, but the data has {line}"
            )));
        };
        rest = &rest[end + 1..];
    }
    Ok(rest)
}

/// What follows `skip` bytes; all but the last `wanted` are skipped when `skip` is -1.
fn after_bytes(bytes: &[u8], skip: i64, wanted: usize) -> Result<&[u8], Fault> {
    let found = bytes.len();
    let start = if skip < 0 {
        found.saturating_sub(wanted)
    } else {
        usize::try_from(skip).unwrap_or(usize::MAX)
    };
    bytes.get(start..).ok_or_else(|| {
        Fault::whole(format!(
            "byte skip: {skip} bytes are to be skipped, but the data has {found}"
        ))
    })
}

/// Writes a volume raw and little endian, header and data in one; bits as bytes of 0 and 1.
///
/// `space origin` is the centre of voxel (0, 0, 0), as NRRD has it. Bits are expanded a few slices
/// at a time.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    let frame = &volume.frame;
    let [nx, ny, nz] = frame.dims;
    let kind = match SampleType::of(&volume.data) {
        SampleType::U8 => "uint8",
        SampleType::I8 => "int8",
        SampleType::U16 => "uint16",
        SampleType::I16 => "int16",
        SampleType::U32 => "uint32",
        SampleType::I32 => "int32",
        SampleType::U64 => "uint64",
        SampleType::I64 => "int64",
        SampleType::F32 => "float",
        SampleType::F64 => "double",
    };
    let [a, b, c] = frame.axes.map(|axis| join(&axis, ","));
    write!(
        out,
        "NRRD0004\n\
         # written by scantle\n\
         type: {kind}\n\
         dimension: 3\n\
         space dimension: 3\n\
         sizes: {nx} {ny} {nz}\n\
         space directions: ({a}) ({b}) ({c})\n\
         centerings: cell cell cell\n\
         kinds: domain domain domain\n\
         endian: little\n\
         encoding: raw\n\
         space origin: ({})\n\
         \n",
        join(&frame.origin, ",")
    )?;
    samples::write_raw(volume, out)
}

#[cfg(test)]
mod tests;
