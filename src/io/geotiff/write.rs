//! GeoTIFF as it is written: strips packed by deflate, in one pass.

use super::keys::{CITATION, GEOGRAPHIC, MODEL_TYPE, PROJECTED, RASTER_TYPE, TEXTS, USER_DEFINED};
use crate::error::number;
use crate::terrain::{Grid, Samples, Transform};
use crate::vector::crs::Crs;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use std::io::{self, Write};

/// Bytes of a strip before it is packed.
const STRIP: usize = 1 << 18;

/// Samples of a raster, row by row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cells<'a> {
    /// Whole numbers of 8 bits: masks.
    U8(&'a [u8]),
    /// Whole numbers of 16 bits: numbers of features.
    U16(&'a [u16]),
    /// Whole numbers of 32 bits: numbers of many features.
    U32(&'a [u32]),
    /// Whole numbers of 16 bits with a sign.
    I16(&'a [i16]),
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
}

impl Cells<'_> {
    fn bits(self) -> u16 {
        match self {
            Cells::U8(_) => 8,
            Cells::U16(_) | Cells::I16(_) => 16,
            Cells::U32(_) | Cells::F32(_) => 32,
            Cells::F64(_) => 64,
        }
    }

    /// TIFF's number of their kind: 1 whole, 2 with a sign, 3 floating.
    fn format(self) -> u16 {
        match self {
            Cells::U8(_) | Cells::U16(_) | Cells::U32(_) => 1,
            Cells::I16(_) => 2,
            Cells::F32(_) | Cells::F64(_) => 3,
        }
    }

    /// Neighbours differ by little: whole numbers pack better as differences (predictor 2 of TIFF 6.0,
    /// section 14), floats by their bytes in order of weight (predictor 3, Adobe's technical note 3).
    fn predictor(self) -> u16 {
        match self {
            Cells::U8(_) => 1,
            Cells::U16(_) | Cells::U32(_) | Cells::I16(_) => 2,
            Cells::F32(_) | Cells::F64(_) => 3,
        }
    }

    /// Rows `first..last` as they are packed.
    fn bytes(self, columns: usize, first: usize, last: usize) -> Vec<u8> {
        let range = first * columns..last * columns;
        match self {
            Cells::U8(all) => all[range].to_vec(),
            Cells::U16(all) => {
                differences(&all[range], columns, |a, b| a.wrapping_sub(b).to_le_bytes())
            }
            Cells::I16(all) => {
                differences(&all[range], columns, |a, b| a.wrapping_sub(b).to_le_bytes())
            }
            Cells::U32(all) => {
                differences(&all[range], columns, |a, b| a.wrapping_sub(b).to_le_bytes())
            }
            Cells::F32(all) => planes(&all[range], columns, |v| v.to_be_bytes()),
            Cells::F64(all) => planes(&all[range], columns, |v| v.to_be_bytes()),
        }
    }
}

fn differences<T: Copy + Default, const N: usize>(
    cells: &[T],
    columns: usize,
    less: impl Fn(T, T) -> [u8; N],
) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(cells.len() * N);
    for row in cells.chunks(columns) {
        let before = std::iter::once(T::default()).chain(row.iter().copied());
        bytes.extend(row.iter().zip(before).flat_map(|(a, b)| less(*a, b)));
    }
    bytes
}

fn planes<T: Copy, const N: usize>(
    cells: &[T],
    columns: usize,
    bytes_of: impl Fn(T) -> [u8; N],
) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(cells.len() * N);
    for row in cells.chunks(columns) {
        let start = bytes.len();
        for plane in 0..N {
            bytes.extend(row.iter().map(|v| bytes_of(*v)[plane]));
        }
        for at in (start + 1..bytes.len()).rev() {
            bytes[at] = bytes[at].wrapping_sub(bytes[at - 1]);
        }
    }
    bytes
}

/// A raster to be written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raster<'a> {
    /// Cells along a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Where the cells are.
    pub transform: Transform,
    /// Samples, row by row.
    pub cells: Cells<'a>,
    /// The value of cells without one.
    pub nodata: Option<f64>,
    /// What places mean.
    pub crs: Option<&'a Crs>,
}

/// Writes heights in the type that they are held in.
pub fn write(grid: &Grid, out: &mut dyn Write) -> io::Result<()> {
    let raster = Raster {
        columns: grid.columns,
        rows: grid.rows,
        transform: grid.transform,
        cells: match &grid.samples {
            Samples::I16(all) => Cells::I16(all),
            Samples::F32(all) => Cells::F32(all),
            Samples::F64(all) => Cells::F64(all),
        },
        nodata: grid.nodata,
        crs: grid.crs.as_ref(),
    };
    write_raster(&raster, out)
}

/// A tag: number, type and bytes of its values.
type Field = (u16, u16, Vec<u8>);

fn shorts(tag: u16, values: &[u16]) -> Field {
    (
        tag,
        3,
        values.iter().flat_map(|v| v.to_le_bytes()).collect(),
    )
}

fn longs(tag: u16, values: &[u32]) -> Field {
    (
        tag,
        4,
        values.iter().flat_map(|v| v.to_le_bytes()).collect(),
    )
}

fn doubles(tag: u16, values: &[f64]) -> Field {
    (
        tag,
        12,
        values.iter().flat_map(|v| v.to_le_bytes()).collect(),
    )
}

fn text(tag: u16, value: &str) -> Field {
    (tag, 2, value.bytes().chain([0]).collect())
}

/// Writes a raster of one band: little endian, strips of 256 KiB packed by deflate.
///
/// Errs where it takes more than the 4 GiB that TIFF can address. Cost: linear; the packed strips are
/// held until all are made, on all threads.
pub fn write_raster(raster: &Raster, out: &mut dyn Write) -> io::Result<()> {
    let (columns, rows) = (raster.columns, raster.rows);
    let cells = raster.cells;
    let width = columns * usize::from(cells.bits() / 8);
    let rows_of_strip = (STRIP / width.max(1)).clamp(1, rows.max(1));
    let strips: io::Result<Vec<Vec<u8>>> = (0..rows.div_ceil(rows_of_strip))
        .into_par_iter()
        .map(|strip| {
            let first = strip * rows_of_strip;
            let last = (first + rows_of_strip).min(rows);
            let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
            packer.write_all(&cells.bytes(columns, first, last))?;
            packer.finish()
        })
        .collect();
    let strips = strips?;
    let too_large = || io::Error::other("the raster takes more than the 4 GiB that TIFF can hold");
    let size = |n: usize| u32::try_from(n).map_err(|_| too_large());
    let mut counts = Vec::with_capacity(strips.len());
    let mut offsets = Vec::with_capacity(strips.len());
    for strip in &strips {
        counts.push(size(strip.len())?);
    }
    let mut fields = vec![
        longs(256, &[size(columns)?]),
        longs(257, &[size(rows)?]),
        shorts(258, &[cells.bits()]),
        shorts(259, &[8]),
        shorts(262, &[1]),
        longs(273, &counts),
        shorts(277, &[1]),
        longs(278, &[size(rows_of_strip)?]),
        longs(279, &counts),
        shorts(284, &[1]),
        shorts(317, &[cells.predictor()]),
        shorts(339, &[cells.format()]),
    ];
    fields.extend(place(&raster.transform));
    fields.extend(keys(raster.crs));
    if let Some(nodata) = raster.nodata {
        fields.push(text(42113, &number(nodata)));
    }
    fields.sort_by_key(|field| field.0);
    let mut at = 8 + lengths(&fields).0 + lengths(&fields).1;
    for count in &counts {
        offsets.push(size(at)?);
        at += *count as usize;
    }
    size(at)?;
    for field in fields.iter_mut().filter(|field| field.0 == 273) {
        *field = longs(273, &offsets);
    }
    out.write_all(b"II*\0\x08\0\0\0")?;
    out.write_all(&directory(&fields))?;
    strips.iter().try_for_each(|strip| out.write_all(strip))
}

/// Bytes of the directory, and of the values behind it.
fn lengths(fields: &[Field]) -> (usize, usize) {
    let outside = fields
        .iter()
        .map(|(.., bytes)| bytes.len())
        .filter(|n| *n > 4);
    (
        2 + 12 * fields.len() + 4,
        outside.map(|n| n.next_multiple_of(2)).sum(),
    )
}

fn directory(fields: &[Field]) -> Vec<u8> {
    let mut entries = (fields.len() as u16).to_le_bytes().to_vec();
    let mut values = Vec::new();
    let behind = 8 + lengths(fields).0;
    for (tag, kind, bytes) in fields {
        let width = [1, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8][usize::from(*kind)];
        entries.extend(tag.to_le_bytes());
        entries.extend(kind.to_le_bytes());
        entries.extend(((bytes.len() / width) as u32).to_le_bytes());
        if bytes.len() > 4 {
            entries.extend(((behind + values.len()) as u32).to_le_bytes());
            values.extend(bytes);
            values.resize(values.len().next_multiple_of(2), 0);
        } else {
            let mut inline = [0; 4];
            inline[..bytes.len()].copy_from_slice(bytes);
            entries.extend(inline);
        }
    }
    entries.extend([0; 4]);
    entries.extend(values);
    entries
}

/// Where the cells are: by their size and corner, or by a matrix where they are turned.
fn place(transform: &Transform) -> Vec<Field> {
    let Transform {
        origin: [x, y],
        across,
        down,
    } = *transform;
    if transform.is_north_up() {
        return vec![
            doubles(33550, &[across[0], -down[1], 0.0]),
            doubles(33922, &[0.0, 0.0, 0.0, x, y, 0.0]),
        ];
    }
    let matrix = [
        [across[0], down[0], 0.0, x],
        [across[1], down[1], 0.0, y],
        [0.0; 4],
        [0.0, 0.0, 0.0, 1.0],
    ];
    vec![doubles(34264, matrix.as_flattened())]
}

/// The keys of a reference system: its number, or its name.
fn keys(crs: Option<&Crs>) -> Vec<Field> {
    let mut entries = vec![[RASTER_TYPE, 0, 1, 1]];
    let mut texts = String::new();
    if let Some(crs) = crs {
        let is_geographic = crs.is_geographic().unwrap_or(false);
        let (model, key) = if is_geographic {
            (2, GEOGRAPHIC)
        } else {
            (1, PROJECTED)
        };
        let code = crs.epsg.and_then(|code| u16::try_from(code).ok());
        entries.push([MODEL_TYPE, 0, 1, model]);
        entries.push([key, 0, 1, code.unwrap_or(USER_DEFINED)]);
        let name: String = crs
            .name
            .chars()
            .filter(|c| c.is_ascii() && *c != '|')
            .collect();
        if !name.is_empty() && name.len() < usize::from(u16::MAX) {
            texts = name + "|";
            entries.push([CITATION, TEXTS, texts.len() as u16, 0]);
        }
    }
    entries.sort_unstable();
    let mut directory = vec![[1, 1, 0, entries.len() as u16]];
    directory.extend(entries);
    let mut fields = vec![shorts(34735, directory.as_flattened())];
    if !texts.is_empty() {
        fields.push(text(TEXTS, &texts));
    }
    fields
}
