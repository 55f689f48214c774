//! The bytes of an array: a count or a table of blocks, then the data.

use super::document::{Appended, Array, Image, Packing};
use crate::error::Fault;
use crate::io::base64::Stream;
use crate::io::header::excerpt;
use crate::io::samples::ByteOrder;
use flate2::read::ZlibDecoder;
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Read;

/// What a byte of zlib data unpacks to at most: two bits are a run of 258 bytes.
const LARGEST_RATIO: u128 = 1032;

/// The `wanted` bytes of the samples of an array that is no text.
///
/// Errs where the array says or holds another number of bytes; no room is made before it is known
/// that the stored bytes can hold them.
pub fn bytes<'a>(
    image: &Image<'a>,
    array: &'a Array<'a>,
    wanted: usize,
) -> Result<Cow<'a, [u8]>, Fault> {
    let mut stored = Stored {
        left: left(image, array)?,
        array,
        order: image.order,
        width: image.width,
    };
    match &image.packing {
        Packing::None => {
            let count = stored.number()?;
            expect_same(array, u128::from(count), wanted)?;
            stored.take(wanted)
        }
        Packing::Zlib => unpacked(&mut stored, wanted).map(Cow::Owned),
        Packing::Other(name) => Err(array
            .fault(format_args!(
                "is packed with {name}, but vtkZLibDataCompressor alone is read"
            ))
            .with_hint("write the file with the compressor zlib or none")),
    }
}

/// Where an array is stored.
fn left<'a>(image: &Image<'a>, array: &'a Array<'a>) -> Result<Left<'a>, Fault> {
    match array.format() {
        "binary" => return Ok(Left::Base64(Stream::new(&array.text))),
        "appended" => {}
        other => {
            let other = excerpt(other);
            return Err(array.fault(format_args!("has the format {other:?}, which is not known")));
        }
    }
    let appended = image
        .appended
        .ok_or_else(|| array.fault("is appended, but the file has no AppendedData"))?;
    let offset = array.offset()?;
    let (Appended::Raw(bytes) | Appended::Base64(bytes)) = appended;
    let from = bytes.get(offset..).ok_or_else(|| {
        array.fault(format_args!(
            "begins at byte {offset} of the appended data, which has {}",
            bytes.len()
        ))
    })?;
    Ok(match appended {
        Appended::Raw(_) => Left::Raw(from),
        Appended::Base64(_) => Left::Base64(Stream::new(from)),
    })
}

fn expect_same(array: &Array, found: u128, wanted: usize) -> Result<(), Fault> {
    if found == wanted as u128 {
        return Ok(());
    }
    Err(array.fault(format_args!(
        "says {found} bytes, but the image needs {wanted}"
    )))
}

/// What is left of the stored bytes.
enum Left<'a> {
    Raw(&'a [u8]),
    Base64(Stream<'a>),
}

/// The stored bytes of an array, taken one part after the other.
struct Stored<'a> {
    left: Left<'a>,
    array: &'a Array<'a>,
    order: ByteOrder,
    /// Bytes of a number before the data.
    width: usize,
}

impl<'a> Stored<'a> {
    /// No more bytes than these are left.
    fn most(&self) -> usize {
        match &self.left {
            Left::Raw(bytes) => bytes.len(),
            Left::Base64(stream) => stream.most(),
        }
    }

    /// The next `count` bytes.
    fn take(&mut self, count: usize) -> Result<Cow<'a, [u8]>, Fault> {
        let most = self.most();
        if count > most {
            return Err(self.array.fault(format_args!(
                "needs {count} bytes more, but no more than {most} are there"
            )));
        }
        match &mut self.left {
            Left::Raw(bytes) => {
                let (taken, after) = bytes.split_at(count);
                *bytes = after;
                Ok(taken.into())
            }
            Left::Base64(stream) => stream
                .take(count)
                .map(Cow::Owned)
                .map_err(|problem| self.array.fault(format_args!("is damaged: {problem}"))),
        }
    }

    /// The next `count` numbers of those before the data.
    fn numbers(&mut self, count: usize) -> Result<Vec<u64>, Fault> {
        let (order, width) = (self.order, self.width);
        let bytes = self.take(count.saturating_mul(width))?;
        let number = |bytes: &[u8]| {
            let place = |i: usize| match order {
                ByteOrder::Little => i,
                ByteOrder::Big => width - 1 - i,
            };
            (0..width).fold(0, |n, i| n | u64::from(bytes[place(i)]) << (8 * i))
        };
        Ok(bytes.chunks_exact(width).map(number).collect())
    }

    fn number(&mut self) -> Result<u64, Fault> {
        Ok(self.numbers(1)?.first().copied().unwrap_or(0))
    }
}

/// Data in blocks packed with zlib: how many, the size of all but the last, that of the last where
/// it is smaller (else 0), then the packed size of each.
fn unpacked(stored: &mut Stored, wanted: usize) -> Result<Vec<u8>, Fault> {
    let array = stored.array;
    let [count, size, last] = [stored.number()?, stored.number()?, stored.number()?];
    let whole = if last == 0 {
        count
    } else {
        count.saturating_sub(1)
    };
    let total = u128::from(whole) * u128::from(size) + u128::from(last);
    expect_same(array, total, wanted)?;
    // Of the sizes none is 0 then, and none is beyond what can be addressed.
    if last > size || (whole > 0 && size == 0) {
        return Err(array.fault(format_args!(
            "has blocks of {size} bytes and a last one of {last}"
        )));
    }
    let sizes = stored.numbers(usize::try_from(count).unwrap_or(usize::MAX))?;
    let packed: u128 = sizes.iter().map(|size| u128::from(*size)).sum();
    if packed * LARGEST_RATIO < total {
        return Err(array.fault(format_args!(
            "says {total} bytes in {packed} packed ones, which cannot hold so many"
        )));
    }
    let packed = stored.take(usize::try_from(packed).unwrap_or(usize::MAX))?;
    let mut blocks = Vec::with_capacity(sizes.len());
    let mut rest = &*packed;
    for size in sizes {
        let (block, after) = rest.split_at(size as usize);
        blocks.push(block);
        rest = after;
    }
    let mut bytes = vec![0; wanted];
    let places = bytes.par_chunks_mut((size as usize).max(1));
    let unpacked = places.zip(blocks).enumerate();
    let faults = unpacked.filter_map(|(index, (place, block))| {
        let problem = unpack_block(block, place).err()?;
        Some((index, problem))
    });
    match faults.min_by_key(|(index, _)| *index) {
        Some((index, problem)) => {
            Err(array.fault(format_args!("is damaged in block {index}: {problem}")))
        }
        None => Ok(bytes),
    }
}

/// Unpacks a block that fills its place.
fn unpack_block(block: &[u8], place: &mut [u8]) -> Result<(), String> {
    let mut packed = ZlibDecoder::new(block);
    packed
        .read_exact(place)
        .and_then(|()| packed.read(&mut [0]))
        .map_err(|e| e.to_string())
        .and_then(|more| match more {
            0 => Ok(()),
            _ => Err(format!("it holds more than {} bytes", place.len())),
        })
}
