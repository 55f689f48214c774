//! NIfTI-1 and NIfTI-2: one file (`.nii`), or a header (`.hdr`) with the samples beside it (`.img`).
//!
//! Three places can say where the voxels are, and the first that its code marks as set counts:
//!
//! 1. the sform (`sform_code` above 0), an affine matrix, which holds any frame;
//! 2. the qform (`qform_code` above 0), a rotation, a handedness and the steps `pixdim`;
//! 3. the steps `pixdim` alone, with voxel (0, 0, 0) at the origin.
//!
//! The format ranks sform and qform nowhere; this is the order of nibabel, and the sform is what
//! registration writes. Where both are set and place voxels differently, a warning says so. Without
//! either, nibabel centres and flips the grid; scantle keeps the format's own "method 1". Indices
//! are those of the file and coordinates run to the right, front and top, as the format has it:
//! nothing is flipped.
//!
//! Coordinates are in millimetres where `xyzt_units` tells the unit of the file, else as they
//! stand. Sources: R. Cox and others, "nifti1.h" (NIfTI DFWG, 2007); "nifti2.h" (2011).

mod frame;
mod header;

use super::refusal::{RAISE, Refusal, expect_room};
use super::samples::{self, ByteOrder, SampleType};
use crate::error::{At, Fault, number};
use crate::io::source::Source;
use crate::report::Warning;
use crate::volume::{Data, Volume};
use crate::with_samples;
use flate2::read::MultiGzDecoder;
use header::{Draft, Header, Scaling, Version};
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

/// Reads a volume of one sample at each voxel, of both versions and byte orders.
///
/// Samples are as stored, or scaled where the header has a slope and an intercept that change
/// them: then they are f64, and f32 where they are stored so; integers beyond 2^53 are rounded.
/// Of frames, see the module. Errs where the header has more than one volume, holds what is no real
/// number, or claims what the data does not hold; no room is made before. Cost: linear in the
/// samples.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Volume, Refusal> {
    let header = Header::parse(source.bytes())?;
    let sizes = header.sizes()?;
    let sample = header.sample_type(warnings)?;
    let (dims, wanted) = samples::extent(sizes, sample.bytes())?;
    let scaling = header.scaling()?;
    let frame = frame::frame(&header, dims, warnings)?;
    let stored = stored(source, &header, wanted)?;
    let start = header.data_start(stored.len())?;
    let body = samples::take(&stored[start..], wanted, sizes, source.limit(), warnings)
        .map_err(|refusal| at_data(refusal, &header, start))?;
    let data = match scaling {
        Some(scaling) => {
            let bytes = if sample == SampleType::F32 { 4 } else { 8 };
            let needed = frame.len() as u128 * bytes;
            expect_room(
                || "scaling its samples".into(),
                needed,
                source.limit(),
                RAISE,
            )?;
            scaled(body, sample, header.order(), scaling)?
        }
        None => samples::decode(body, sample, header.order()),
    };
    Ok(Volume { frame, data })
}

/// Whether the first bytes are those of a NIfTI header.
pub fn is_header(bytes: &[u8]) -> bool {
    Header::parse(bytes).is_ok()
}

/// The name of the data file beside a header; `None` for data in the same file, and where the
/// header is not sound. `NAME.img` goes with `NAME.hdr`, and `NAME.img.gz` with `NAME.hdr.gz`.
pub fn named_file(source: &Source) -> Option<String> {
    let header = Header::parse(source.bytes()).ok()?;
    header.is_pair().then(|| image_name(source.path()))
}

fn image_name(path: &Path) -> String {
    let is_gzip = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let mut name = path.to_owned();
    if is_gzip {
        name.set_extension("");
    }
    name.set_extension(if is_gzip { "img.gz" } else { "img" });
    let name = name.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// The bytes of the file that holds the samples.
fn stored<'a>(
    source: &'a Source,
    header: &Header,
    wanted: usize,
) -> Result<Cow<'a, [u8]>, Refusal> {
    if !header.is_pair() {
        return Ok(source.bytes().into());
    }
    let name = image_name(source.path());
    let bytes = source.companion(&name)?;
    if !name.ends_with(".gz") {
        return Ok(bytes.into());
    }
    // One byte more than is wanted tells of others.
    let most = header.data_start(usize::MAX)?.saturating_add(wanted);
    let packed = MultiGzDecoder::new(bytes.as_slice());
    samples::unpack(packed, most.saturating_add(1), source.limit()).map(Cow::Owned)
}

/// Lack of data, with where in the file the data begins.
fn at_data(refusal: Refusal, header: &Header, start: usize) -> Refusal {
    match refusal {
        Refusal::Fault(fault) if !header.is_pair() => Refusal::Fault(Fault {
            at: At::Byte(start as u64),
            ..fault
        }),
        other => other,
    }
}

/// Samples decoded at a time where they are scaled.
const AT_A_TIME: usize = 1 << 16;

/// `slope * sample + intercept` of each sample, computed in f64; f32 samples stay f32.
fn scaled(
    bytes: &[u8],
    sample: SampleType,
    order: ByteOrder,
    scaling: Scaling,
) -> Result<Data, Fault> {
    let is_single = sample == SampleType::F32;
    let largest = if is_single {
        f64::from(f32::MAX)
    } else {
        f64::MAX
    };
    let mut overflows = false;
    let mut apply = |stored: f64| {
        let value = scaling.slope * stored + scaling.intercept;
        overflows |= stored.is_finite() && value.abs() > largest;
        value
    };
    let count = bytes.len() / sample.bytes();
    let parts = bytes.chunks(AT_A_TIME * sample.bytes());
    let parts = parts.map(|part| samples::decode(part, sample, order));
    let data = if is_single {
        let mut values = Vec::with_capacity(count);
        for part in parts {
            with_samples!(&part, v => values.extend(v.iter().map(|s| apply(*s as f64) as f32)), _ => {});
        }
        Data::F32(values)
    } else {
        let mut values = Vec::with_capacity(count);
        for part in parts {
            with_samples!(&part, v => values.extend(v.iter().map(|s| apply(*s as f64))), _ => {});
        }
        Data::F64(values)
    };
    if overflows {
        return Err(scaling.fault(format!(
            "scl_slope {} and scl_inter {} take samples out of the range of {}",
            number(scaling.slope),
            number(scaling.intercept),
            data.sample_type()
        )));
    }
    Ok(data)
}

/// Writes a volume as one file, little endian; bits as bytes of 0 and 1.
///
/// The frame is the sform, with code 1. It is NIfTI-1 where that loses nothing: its numbers are of
/// single precision and its sizes end at 32767; else NIfTI-2. The unit is left unknown. Bits are
/// expanded a few slices at a time.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    let sample = SampleType::of(&volume.data);
    let [a, b, c] = volume.frame.axes;
    let origin = volume.frame.origin;
    let rows: [[f64; 4]; 3] = std::array::from_fn(|row| [a[row], b[row], c[row], origin[row]]);
    let fits = rows
        .as_flattened()
        .iter()
        .all(|number| f64::from(*number as f32) == *number)
        && volume.frame.dims.iter().all(|d| i16::try_from(*d).is_ok());
    let mut draft = Draft::new(if fits { Version::One } else { Version::Two });
    draft.put_sizes(volume.frame.dims);
    draft.put_type(sample);
    draft.put_steps(volume.frame.spacing());
    draft.put_sform(&rows);
    out.write_all(&draft.finish())?;
    samples::write_raw(volume, out)
}

#[cfg(test)]
mod tests;
