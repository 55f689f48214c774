//! The samples of a TIFF image, chunk by chunk.

use super::widened::{self, Patch};
use super::{File, damaged, open};
use crate::error::Fault;
use crate::report::Warning;
use crate::terrain::Samples;
use rayon::prelude::*;
use tiff::decoder::{ChunkType, DecodingResult};
use tiff::tags::Tag;

/// How an image is parted, and of what its samples are.
#[derive(Debug, Clone)]
pub struct Layout {
    size: [usize; 2],
    chunk: [usize; 2],
    /// Bands, and how far the next sample of a band is in a chunk.
    bands: usize,
    step: usize,
    /// Chunks in a row of them.
    across: usize,
    /// Chunks that are not stored: their cells have no height.
    gaps: Vec<bool>,
    kind: Kind,
    /// What makes rows end with a tile, where they do not.
    patch: Option<Patch>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// What fits 16 bits with a sign.
    Short,
    /// What fits single precision.
    Single,
    /// Whole numbers of 32 bits, of which single precision may hold all.
    Long,
    /// What needs double precision.
    Double,
}

impl Layout {
    /// Errs where the image has samples that are not read, or no chunks.
    pub fn of(file: &mut File, size: [u32; 2], bytes: &[u8]) -> Result<Self, Fault> {
        let shorts = |file: &mut File, tag, default| {
            let found = file.find_tag_unsigned_vec::<u16>(tag).map_err(damaged)?;
            Ok::<_, Fault>(
                found
                    .and_then(|all| all.first().copied())
                    .unwrap_or(default),
            )
        };
        let bits = shorts(file, Tag::BitsPerSample, 1)?;
        let format = shorts(file, Tag::SampleFormat, 1)?;
        let bands = shorts(file, Tag::SamplesPerPixel, 1)?.max(1);
        let is_planar = shorts(file, Tag::PlanarConfiguration, 1)? == 2;
        let kind = match (format, bits) {
            (1 | 4, 8) | (2, 8 | 16) => Kind::Short,
            (1 | 4, 16) | (3, 16 | 32) => Kind::Single,
            (1 | 2 | 4, 32) => Kind::Long,
            (3, 64) => Kind::Double,
            _ => {
                let what = [
                    "whole numbers",
                    "whole numbers with a sign",
                    "floats",
                    "numbers",
                ];
                let what = what
                    .get(usize::from(format).wrapping_sub(1))
                    .unwrap_or(&"samples");
                let problem = format!("its samples are {what} of {bits} bits, which are not read");
                let hint = "whole numbers of 8, 16 or 32 bits are, and floats of 16, 32 or 64";
                return Err(Fault::whole(problem).with_hint(hint));
            }
        };
        if size.contains(&0) {
            let problem = format!("a raster of {} x {} cells has none", size[0], size[1]);
            return Err(Fault::whole(problem));
        }
        expect_whole(file, bytes.len())?;
        let is_tiled = file.get_chunk_type() == ChunkType::Tile;
        let tag = if is_tiled {
            Tag::TileByteCounts
        } else {
            Tag::StripByteCounts
        };
        let stored = file.find_tag_unsigned_vec::<u64>(tag).map_err(damaged)?;
        let (wide, high) = file.chunk_dimensions();
        let size = size.map(|n| n as usize);
        let chunk = [wide as usize, (high as usize).min(size[1])];
        if chunk.contains(&0) {
            return Err(Fault::whole("its strips or tiles have no pixels"));
        }
        let across = size[0].div_ceil(chunk[0]);
        let needed = across * size[1].div_ceil(chunk[1]);
        let planes = if is_planar { usize::from(bands) } else { 1 };
        let gaps: Vec<bool> = stored.unwrap_or_default().iter().map(|n| *n == 0).collect();
        if gaps.len() < needed * planes {
            let (has, needed) = (gaps.len(), needed * planes);
            let problem = format!("has {has} strips or tiles, but its size needs {needed}");
            return Err(Fault::whole(problem));
        }
        let is_cropped = is_tiled && !size[0].is_multiple_of(chunk[0]);
        let full = u32::try_from(across * chunk[0]).ok().filter(|_| is_cropped);
        Ok(Layout {
            patch: full.and_then(|width| widened::patch(bytes, width)),
            size,
            chunk,
            bands: usize::from(bands),
            step: if is_planar { 1 } else { usize::from(bands) },
            across,
            gaps,
            kind,
        })
    }

    /// Bytes that a cell takes while it is read.
    pub fn bytes_of_cell(&self) -> u128 {
        match self.kind {
            Kind::Short => 2,
            Kind::Single => 4,
            Kind::Double => 8,
            Kind::Long => 12,
        }
    }

    /// Whether some chunks are not stored.
    pub fn has_gaps(&self) -> bool {
        self.gaps.iter().any(|gap| *gap)
    }

    /// Tells of bands that are not read.
    pub fn warn_of_bands(&self, warnings: &mut Vec<Warning>) {
        if self.bands > 1 {
            let message = "bands after the first; they are not read";
            let count = self.bands as u64 - 1;
            warnings.push(Warning::new("more-bands", message, count, None));
        }
    }
}

/// Errs where a strip or a tile lies beyond the end of the file.
fn expect_whole(file: &mut File, length: usize) -> Result<(), Fault> {
    let tags = match file.get_chunk_type() {
        ChunkType::Tile => [Tag::TileOffsets, Tag::TileByteCounts],
        ChunkType::Strip => [Tag::StripOffsets, Tag::StripByteCounts],
    };
    let [starts, counts] = tags.map(|tag| file.find_tag_unsigned_vec::<u64>(tag));
    let starts = starts.map_err(damaged)?.unwrap_or_default();
    let counts = counts.map_err(damaged)?.unwrap_or_default();
    for (index, (start, count)) in starts.iter().zip(&counts).enumerate() {
        if start.saturating_add(*count) > length as u64 {
            let problem = format!("has {count} bytes from byte {start}, but the file has {length}");
            return Err(Fault::element("chunk", index, problem));
        }
    }
    Ok(())
}

/// A value as samples of a kind can hold it, so that it compares as equal with one that was written so.
pub fn as_sample(value: f64, samples: &Samples) -> f64 {
    match samples {
        Samples::F32(_) => f64::from(value as f32),
        _ => value,
    }
}

/// Reads all cells; those of chunks that are not stored are `fill`.
pub fn read(bytes: &[u8], layout: &Layout, fill: f64) -> Result<Samples, Fault> {
    use DecodingResult as From;
    Ok(match layout.kind {
        Kind::Short => Samples::I16(cells(
            bytes,
            layout,
            fill as i16,
            |chunk, at| match chunk {
                From::U8(all) => all.get(at).map(|v| i16::from(*v)),
                From::I8(all) => all.get(at).map(|v| i16::from(*v)),
                From::I16(all) => all.get(at).copied(),
                _ => None,
            },
        )?),
        Kind::Single => Samples::F32(cells(
            bytes,
            layout,
            fill as f32,
            |chunk, at| match chunk {
                From::U16(all) => all.get(at).map(|v| f32::from(*v)),
                From::F16(all) => all.get(at).map(|v| v.to_f32()),
                From::F32(all) => all.get(at).copied(),
                _ => None,
            },
        )?),
        Kind::Double | Kind::Long => {
            let all = cells(bytes, layout, fill, |chunk, at| match chunk {
                From::U32(all) => all.get(at).map(|v| f64::from(*v)),
                From::I32(all) => all.get(at).map(|v| f64::from(*v)),
                From::F64(all) => all.get(at).copied(),
                _ => None,
            })?;
            match layout.kind {
                Kind::Long => Samples::narrowest(all),
                _ => Samples::F64(all),
            }
        }
    })
}

/// Rows of chunks are read on all threads, each into its own rows of the result.
fn cells<T: Copy + Send + Sync>(
    bytes: &[u8],
    layout: &Layout,
    fill: T,
    sample: impl Fn(&DecodingResult, usize) -> Option<T> + Sync,
) -> Result<Vec<T>, Fault> {
    let [columns, rows] = layout.size;
    let mut all = Vec::new();
    let refused = |_| Fault::whole(format!("{columns} x {rows} cells do not fit the memory"));
    all.try_reserve_exact(columns * rows).map_err(refused)?;
    all.resize(columns * rows, fill);
    let bands = all.par_chunks_mut(layout.chunk[1] * columns).enumerate();
    let done: Vec<Result<(), Fault>> = bands
        .map_init(
            || open(bytes, layout.patch),
            |file, (band, rows)| {
                let file = file.as_mut().map_err(|fault| fault.clone())?;
                for across in 0..layout.across {
                    let index = band * layout.across + across;
                    if !layout.gaps[index] {
                        place(file, layout, index, across, rows, &sample)?;
                    }
                }
                Ok(())
            },
        )
        .collect();
    done.into_iter().collect::<Result<Vec<()>, _>>()?;
    Ok(all)
}

/// Reads one chunk into the rows of its band.
fn place<T>(
    file: &mut File,
    layout: &Layout,
    index: usize,
    across: usize,
    rows: &mut [T],
    sample: &impl Fn(&DecodingResult, usize) -> Option<T>,
) -> Result<(), Fault> {
    let wrong = |fault: Fault| {
        let Fault { problem, hint, .. } = fault;
        Fault {
            hint,
            ..Fault::element("chunk", index, problem)
        }
    };
    let number = u32::try_from(index).map_err(|_| Fault::whole("has too many chunks"))?;
    let chunk = file.read_chunk(number).map_err(|e| wrong(damaged(e)))?;
    let columns = layout.size[0];
    let start = across * layout.chunk[0];
    let width = layout.chunk[0].min(columns - start);
    let stride = if layout.patch.is_some() {
        layout.chunk[0]
    } else {
        width
    };
    for (row, cells) in rows.chunks_mut(columns).enumerate() {
        for (column, cell) in cells[start..start + width].iter_mut().enumerate() {
            let at = (row * stride + column) * layout.step;
            *cell = sample(&chunk, at)
                .ok_or_else(|| wrong(Fault::whole(format!("ends before its row {row}"))))?;
        }
    }
    Ok(())
}
