//! GeoTIFF: heights, and masks, on a map.
//!
//! Source: TIFF revision 6.0 (Adobe 1992), and OGC 19-008r4, GeoTIFF 1.1; the value of cells without
//! a height is GDAL's tag 42113.

mod cells;
mod keys;
#[cfg(test)]
mod tests;
mod widened;
mod write;

pub use write::{Cells, Raster, write, write_raster};

use super::refusal::{RAISE, Refusal, expect_room};
use super::source::Source;
use crate::error::Fault;
use crate::report::Warning;
use crate::terrain::Grid;
use tiff::TiffError;
use tiff::decoder::{Decoder, Limits};
use tiff::tags::Tag;
use widened::{Patch, Patched};

/// Extensions of world files, which may say where the cells of a raster are.
pub const BESIDE: &[&str] = &["tfw", "tifw", "tiffw", "wld"];

/// Entries of tables of strips and tiles may take this many bytes.
const LONGEST_TABLE: usize = 1 << 28;
/// A strip or a tile may take this many bytes.
const LARGEST_CHUNK: usize = 1 << 30;
/// A byte of LZW or deflate stands for at most this many.
const MOST_PACKED: u128 = 4096;

type File<'a> = Decoder<Patched<'a>>;

/// Whether bytes start as those of TIFF or BigTIFF do.
pub fn is_header(bytes: &[u8]) -> bool {
    let starts: [&[u8]; 4] = [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"];
    starts.iter().any(|start| bytes.starts_with(start))
}

/// Reads the first image of a TIFF or BigTIFF file as heights, with its place on the map.
///
/// Whole numbers of 8 to 32 bits and floats of 16 to 64, in strips or tiles, plain or packed by LZW,
/// deflate or PackBits, with either predictor. Of several bands the first is taken, with a warning.
/// Pixels that are points are centres of cells. Errs where the file is damaged, of another kind of
/// sample, or takes more memory than the source may use. Cost: linear in the cells, on all threads; beside
/// the result a chunk per thread is held, and for whole numbers of 32 bits another copy.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Grid, Refusal> {
    let bytes = source.bytes();
    widened::expect_values(bytes)?;
    let mut file = open(bytes, None)?;
    let (width, height) = file.dimensions().map_err(damaged)?;
    let layout = cells::Layout::of(&mut file, [width, height], bytes)?;
    let needed = u128::from(width) * u128::from(height) * layout.bytes_of_cell();
    let what = || format!("a raster of {width} x {height} cells");
    if needed > isize::MAX as u128 {
        return Err(Fault::whole(format!("{} is larger than memory can be", what())).into());
    }
    let packed = bytes.len();
    if !layout.has_gaps() && needed > 2 * MOST_PACKED * packed as u128 {
        let problem = format!(
            "{} holds more than the file's {packed} bytes can stand for",
            what()
        );
        return Err(Fault::whole(problem).into());
    }
    expect_room(what, needed, source.limit(), RAISE)?;
    let text = |file: &mut File, tag| file.get_tag_ascii_string(tag).ok();
    let nodata = text(&mut file, Tag::GdalNodata);
    let nodata = nodata.and_then(|text| text.trim_matches(['\0', ' ']).parse().ok());
    if let Some(about) = text(&mut file, Tag::from_u16_exhaustive(42112)) {
        warn_of_scale(&about, warnings);
    }
    let keys = keys::Keys::of(&mut file)?;
    let transform = keys.transform(source, height, warnings)?;
    let crs = keys.crs(warnings);
    layout.warn_of_bands(warnings);
    let fill = nodata.unwrap_or(0.0);
    let samples = cells::read(bytes, &layout, fill)?;
    let nodata = nodata.map(|value| cells::as_sample(value, &samples));
    Ok(Grid {
        columns: width as usize,
        rows: height as usize,
        transform,
        samples,
        nodata: nodata.filter(|value| !value.is_nan()),
        crs,
    })
}

fn open(bytes: &[u8], patch: Option<Patch>) -> Result<File<'_>, Fault> {
    let mut limits = Limits::default();
    limits.ifd_value_size = LONGEST_TABLE.min(bytes.len());
    let largest = bytes.len().saturating_mul(MOST_PACKED as usize);
    limits.decoding_buffer_size = LARGEST_CHUNK.min(largest);
    limits.intermediate_buffer_size = LARGEST_CHUNK.min(largest);
    let file = Decoder::new(Patched::new(bytes, patch)).map_err(damaged)?;
    Ok(file.with_limits(limits))
}

/// A fault in the words of the decoder.
fn damaged(error: TiffError) -> Fault {
    let text = error.to_string();
    let (kind, words) = text.split_once(": ").unwrap_or(("", &text));
    match kind {
        "unsupported error" => Fault::whole(format!("is TIFF of a kind that is not read: {words}")),
        _ => Fault::whole(format!("the TIFF is damaged: {words}")),
    }
}

/// Heights are as they are stored: metadata that scales them is only told of.
fn warn_of_scale(about: &str, warnings: &mut Vec<Warning>) {
    let is_scaled = |item: &str| {
        let Some((tag, rest)) = item.split_once('>') else {
            return false;
        };
        let value: Option<f64> = rest.split('<').next().and_then(|v| v.trim().parse().ok());
        tag.contains("role=\"scale\"") && value.is_some_and(|v| v != 1.0)
            || tag.contains("role=\"offset\"") && value.is_some_and(|v| v != 0.0)
    };
    let count = about.split("<Item").filter(|item| is_scaled(item)).count() as u64;
    if count > 0 {
        let message = "scales or offsets of the stored numbers in the file's metadata; not applied";
        warnings.push(Warning::new("scaled-heights", message, count, None));
    }
}
