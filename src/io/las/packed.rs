//! Points packed by LASzip, chunk by chunk.
//!
//! The crate `laz` unpacks a chunk; here it is made sure first that what its tables state is there, so
//! that nothing is made room for which the file does not hold.

use super::header::{Header, u16_at, u32_at, u64_at};
use super::points::{Part, Records};
use crate::error::Fault;
use laz::laszip::{ChunkTable, LazItemType, LazVlr};
use laz::record::{
    LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor,
};
use laz::{DecompressionSelection, LasZipError};
use rayon::prelude::*;
use std::io::{self, Cursor};

/// Bytes before the points: where the table of chunks is.
const PLACE: usize = 8;
/// A kind of packing, as the record of LASzip numbers them: all points in a row.
const IN_A_ROW: u16 = 1;
/// Points in chunks.
const CHUNKED: u16 = 2;
/// Points in chunks of one layer for each part of a point.
const LAYERED: u16 = 3;

/// A run of points that is packed by itself.
#[derive(Debug, Clone, Copy)]
struct Chunk<'a> {
    bytes: &'a [u8],
    /// Where it begins in the file.
    at: usize,
    points: u64,
}

/// The chunks of a file, which it is known to hold, and how they are packed.
#[derive(Debug)]
pub struct Packed<'a> {
    chunks: Vec<Chunk<'a>>,
    vlr: LazVlr,
    is_layered: bool,
}

/// Finds the chunks. Errs with the byte where the record of LASzip or the table of chunks is damaged, or
/// states other points than the header.
pub fn find<'a>(bytes: &'a [u8], header: &Header) -> Result<Packed<'a>, Fault> {
    let at = header.records.0;
    let packing = header.packing(bytes)?;
    let unknown = |error: LasZipError| Fault::byte(at, format!("the record of LASzip: {error}"));
    let vlr = LazVlr::read_from(packing).map_err(unknown)?;
    // The record was long enough to be read.
    let kind = u16_at(packing, 0);
    let length: usize = vlr
        .items()
        .iter()
        .map(|item| usize::from(item.size()))
        .sum();
    if length != header.length {
        let stated = header.length;
        let problem = format!("LASzip packs points of {length} bytes, but they have {stated}");
        return Err(Fault::byte(at, problem));
    }
    let first = vlr.items().first().map(|item| item.item_type());
    let is_whole = match first {
        Some(LazItemType::Point10) => !header.is_new() && kind != LAYERED,
        Some(LazItemType::Point14) => header.is_new() && kind == LAYERED,
        _ => false,
    };
    if !is_whole {
        let format = header.format;
        let problem = format!("LASzip packs points of another kind than format {format}");
        return Err(Fault::byte(at, problem));
    }
    let chunks = match kind {
        IN_A_ROW => vec![Chunk {
            bytes: &bytes[header.data..],
            at: header.data,
            points: header.points,
        }],
        CHUNKED | LAYERED => chunks(bytes, header, &vlr)?,
        other => {
            let problem = format!("points are packed in the way {other}, which is not known");
            return Err(Fault::byte(at, problem));
        }
    };
    Ok(Packed {
        chunks,
        vlr,
        is_layered: kind == LAYERED,
    })
}

impl Packed<'_> {
    /// Unpacks all points, in their order, on all threads. Errs with the first chunk that is damaged.
    pub fn unpack(&self, records: &Records) -> Result<Vec<Part>, Fault> {
        let parts: Vec<Result<Part, Fault>> = self
            .chunks
            .par_iter()
            .map(|chunk| match self.is_layered {
                true => layered(chunk, &self.vlr, records),
                false => sequential(chunk, &self.vlr, records),
            })
            .collect();
        // The fault that stands first in the file is the one reported.
        parts.into_iter().collect()
    }
}

/// The chunks by their table, once it is known that the file holds them.
fn chunks<'a>(bytes: &'a [u8], header: &Header, vlr: &LazVlr) -> Result<Vec<Chunk<'a>>, Fault> {
    let start = header.data + PLACE;
    let cut_short = || Fault::byte(bytes.len(), "the file ends before its packed points");
    if bytes.len() < start + PLACE {
        return Err(cut_short());
    }
    let is_table = |at: u64| at >= start as u64 && at <= (bytes.len() - PLACE) as u64;
    // Who could not go back to write the place has it at the end.
    let places = [header.data, bytes.len() - PLACE].map(|at| u64_at(bytes, at));
    let Some(table_at) = places.into_iter().find(|at| is_table(*at)) else {
        let problem = format!(
            "the table of chunks is at byte {}, which is not there",
            places[0]
        );
        return Err(Fault::byte(header.data, problem));
    };
    let table_at = table_at as usize;
    let count = u32_at(bytes, table_at + 4) as usize;
    // Each chunk begins with a point as it is.
    let most = (table_at - start) / header.length;
    if count > most {
        let problem = format!("the table has {count} chunks, but the file holds {most} at most");
        return Err(Fault::byte(table_at + 4, problem));
    }
    let mut cursor = Cursor::new(&bytes[table_at..]);
    let is_variable = vlr.uses_variable_size_chunks();
    let damaged = |error: io::Error| Fault::byte(table_at, format!("the table of chunks: {error}"));
    let table = ChunkTable::read(&mut cursor, is_variable).map_err(damaged)?;
    let (mut at, mut left) = (start, header.points);
    let mut chunks = Vec::with_capacity(count);
    for entry in &table {
        let length = usize::try_from(entry.byte_count).unwrap_or(usize::MAX);
        let Some(part) = bytes[..table_at].get(at..at.saturating_add(length)) else {
            let number = chunks.len();
            let problem =
                format!("chunk {number} of {length} bytes goes on after the packed points");
            return Err(Fault::byte(at, problem));
        };
        let full = match is_variable {
            true => entry.point_count,
            false => u64::from(vlr.chunk_size()),
        };
        let points = full.min(left);
        left -= points;
        chunks.push(Chunk {
            bytes: part,
            at,
            points,
        });
        at += length;
    }
    if left > 0 {
        let (points, there) = (header.points, header.points - left);
        let problem = format!("the file ends after {there} of {points} points");
        return Err(Fault::byte(table_at, problem));
    }
    Ok(chunks)
}

fn sequential(chunk: &Chunk, vlr: &LazVlr, records: &Records) -> Result<Part, Fault> {
    let mut decompressor = SequentialPointRecordDecompressor::new(Cursor::new(chunk.bytes));
    points_of(chunk, vlr, records, &mut decompressor)
}

fn layered(chunk: &Chunk, vlr: &LazVlr, records: &Records) -> Result<Part, Fault> {
    check_layers(chunk, vlr)?;
    let mut decompressor = LayeredPointRecordDecompressor::new(Cursor::new(chunk.bytes));
    points_of(chunk, vlr, records, &mut decompressor)
}

/// Errs where the layers of a chunk are longer together than the chunk is.
fn check_layers(chunk: &Chunk, vlr: &LazVlr) -> Result<(), Fault> {
    let layers = vlr.items().iter().map(|item| match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => usize::from(count),
        _ => 1,
    });
    let (layers, bytes): (usize, &[u8]) = (layers.sum(), chunk.bytes);
    let record: usize = vlr
        .items()
        .iter()
        .map(|item| usize::from(item.size()))
        .sum();
    let start = record + 4 * (1 + layers);
    if bytes.len() < start {
        let problem = format!(
            "a chunk of {} bytes has no room for its layers",
            bytes.len()
        );
        return Err(Fault::byte(chunk.at, problem));
    }
    let sizes = bytes[record + 4..start].chunks_exact(4);
    let needed: u64 = sizes.map(|size| u64::from(u32_at(size, 0))).sum();
    let there = (bytes.len() - start) as u64;
    if needed > there {
        let problem = format!("layers of {needed} bytes in a chunk that has {there} for them");
        return Err(Fault::byte(chunk.at, problem));
    }
    Ok(())
}

/// The points of a chunk; room is made only for those that are there.
fn points_of<'a>(
    chunk: &Chunk<'a>,
    vlr: &LazVlr,
    records: &Records,
    decompressor: &mut impl RecordDecompressor<Cursor<&'a [u8]>>,
) -> Result<Part, Fault> {
    let fault = |problem: String| Fault::byte(chunk.at, problem);
    let unknown = |error: LasZipError| fault(format!("the packed points: {error}"));
    decompressor.set_fields_from(vlr.items()).map_err(unknown)?;
    let read = DecompressionSelection::xy_returns_channel()
        .decompress_z()
        .decompress_classification()
        .decompress_flags()
        .decompress_rgb();
    decompressor.set_selection(read);
    let mut record = vec![0; decompressor.record_size()];
    let mut part = Part::default();
    for index in 0..chunk.points {
        decompressor.decompress_next(&mut record).map_err(|_| {
            let points = chunk.points;
            fault(format!("a chunk ends after {index} of {points} points"))
        })?;
        records.take(&record, &mut part);
    }
    Ok(part)
}
