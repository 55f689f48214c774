//! Raw samples: bytes to [`Data`] and back, and the checks of sizes that all volume formats share.

use super::header::excerpt;
use super::refusal::{RAISE, Refusal, expect_room};
use crate::error::Fault;
use crate::report::Warning;
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Volume};
use crate::with_samples;
use bytemuck::NoUninit;
use std::io::{self, Read, Write};
use std::str::FromStr;

/// The type of a stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SampleType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

/// The order of the bytes of a stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
}

impl SampleType {
    /// All types.
    #[cfg(test)]
    pub const ALL: [SampleType; 10] = [
        SampleType::U8,
        SampleType::I8,
        SampleType::U16,
        SampleType::I16,
        SampleType::U32,
        SampleType::I32,
        SampleType::U64,
        SampleType::I64,
        SampleType::F32,
        SampleType::F64,
    ];

    /// Bytes of one number.
    pub fn bytes(self) -> usize {
        match self {
            SampleType::U8 | SampleType::I8 => 1,
            SampleType::U16 | SampleType::I16 => 2,
            SampleType::U32 | SampleType::I32 | SampleType::F32 => 4,
            SampleType::U64 | SampleType::I64 | SampleType::F64 => 8,
        }
    }

    /// The type in which the samples of a volume are stored raw: bits as bytes of 0 and 1.
    pub fn of(data: &Data) -> Self {
        match data {
            Data::Bits(_) | Data::Sparse(_) | Data::U8(_) => SampleType::U8,
            Data::I8(_) => SampleType::I8,
            Data::U16(_) => SampleType::U16,
            Data::I16(_) => SampleType::I16,
            Data::U32(_) => SampleType::U32,
            Data::I32(_) => SampleType::I32,
            Data::U64(_) => SampleType::U64,
            Data::I64(_) => SampleType::I64,
            Data::F32(_) => SampleType::F32,
            Data::F64(_) => SampleType::F64,
        }
    }
}

/// The bytes that a grid takes, and its dims as they are used in memory.
///
/// Nothing is allocated; a size of 0 or a product over what can be addressed is a fault.
pub fn extent(dims: [u64; 3], sample: usize) -> Result<([usize; 3], usize), Fault> {
    let [x, y, z] = dims;
    if let Some(axis) = dims.iter().position(|d| *d == 0) {
        return Err(Fault::whole(format!(
            "the grid is {x} x {y} x {z}: it has no voxel along axis {axis}"
        )));
    }
    let bytes = u128::from(x)
        .checked_mul(u128::from(y))
        .and_then(|n| n.checked_mul(u128::from(z)))
        .and_then(|n| n.checked_mul(sample as u128))
        .and_then(|n| isize::try_from(n).ok());
    match bytes {
        Some(bytes) => Ok((dims.map(|d| d as usize), bytes as usize)),
        None => Err(Fault::whole(format!(
            "a grid of {x} x {y} x {z} voxels of {sample} bytes is larger than memory can be"
        ))),
    }
}

/// The first `wanted` of the bytes that are there; a fault when there are fewer, a warning when more.
/// Errs too when the samples that they are to become take more than `limit` bytes.
pub fn take<'a>(
    bytes: &'a [u8],
    wanted: usize,
    dims: [u64; 3],
    limit: u64,
    warnings: &mut Vec<Warning>,
) -> Result<&'a [u8], Refusal> {
    let [x, y, z] = dims;
    let found = bytes.len();
    if found < wanted {
        return Err(Fault::whole(format!(
            "a grid of {x} x {y} x {z} needs {wanted} bytes of data, but {found} are there"
        ))
        .into());
    }
    expect_room(
        || format!("a grid of {x} x {y} x {z} voxels"),
        wanted as u128,
        limit,
        RAISE,
    )?;
    if found > wanted {
        warn_trailing(found - wanted, warnings);
    }
    Ok(&bytes[..wanted])
}

/// Warns about bytes after the data.
pub fn warn_trailing(count: usize, warnings: &mut Vec<Warning>) {
    warnings.push(Warning::new(
        "trailing-bytes",
        "bytes after the data; ignored",
        count as u64,
        None,
    ));
}

/// Unpacks at most `wanted` bytes.
///
/// Room is made as the bytes come, so a stream that ends early costs no more than it holds.
/// `limit` is how many bytes may be held.
pub fn unpack(packed: impl Read, wanted: usize, limit: u64) -> Result<Vec<u8>, Refusal> {
    expect_room(
        || "unpacking its data".to_owned(),
        wanted as u128,
        limit,
        RAISE,
    )?;
    let mut bytes = Vec::new();
    packed
        .take(wanted as u64)
        .read_to_end(&mut bytes)
        .map_err(|e| {
            Fault::whole(format!(
                "the compressed data is damaged after {} bytes unpacked: {e}",
                bytes.len()
            ))
        })?;
    Ok(bytes)
}

/// Numbers stored one after the other, x fastest. Bytes of an unfinished number are left out.
pub fn decode(bytes: &[u8], sample: SampleType, order: ByteOrder) -> Data {
    macro_rules! numbers {
        ($type:ty) => {{
            let (chunks, _) = bytes.as_chunks::<{ size_of::<$type>() }>();
            match order {
                ByteOrder::Little => chunks.iter().map(|c| <$type>::from_le_bytes(*c)).collect(),
                ByteOrder::Big => chunks.iter().map(|c| <$type>::from_be_bytes(*c)).collect(),
            }
        }};
    }
    match sample {
        SampleType::U8 => Data::U8(bytes.to_vec()),
        SampleType::I8 => Data::I8(numbers!(i8)),
        SampleType::U16 => Data::U16(numbers!(u16)),
        SampleType::I16 => Data::I16(numbers!(i16)),
        SampleType::U32 => Data::U32(numbers!(u32)),
        SampleType::I32 => Data::I32(numbers!(i32)),
        SampleType::U64 => Data::U64(numbers!(u64)),
        SampleType::I64 => Data::I64(numbers!(i64)),
        SampleType::F32 => Data::F32(numbers!(f32)),
        SampleType::F64 => Data::F64(numbers!(f64)),
    }
}

/// Numbers written as text, separated by white space or commas, x fastest.
pub fn decode_text(bytes: &[u8], sample: SampleType, count: usize) -> Result<Data, Fault> {
    fn numbers<T: FromStr>(bytes: &[u8], count: usize, name: &str) -> Result<Vec<T>, Fault> {
        let words = bytes
            .split(|b| b.is_ascii_whitespace() || *b == b',')
            .filter(|w| !w.is_empty());
        // Each number takes a digit and a separator, so this is never more than the bytes there are.
        let mut values = Vec::with_capacity(count.min(bytes.len() / 2 + 1));
        for (i, word) in words.take(count).enumerate() {
            let text = String::from_utf8_lossy(word);
            let value = text.parse().map_err(|_| {
                Fault::element("sample", i, format!("{:?} is not {name}", excerpt(&text)))
            })?;
            values.push(value);
        }
        if values.len() < count {
            return Err(Fault::whole(format!(
                "{count} samples are needed, but {} are there",
                values.len()
            )));
        }
        Ok(values)
    }
    Ok(match sample {
        SampleType::U8 => Data::U8(numbers(bytes, count, "a u8")?),
        SampleType::I8 => Data::I8(numbers(bytes, count, "an i8")?),
        SampleType::U16 => Data::U16(numbers(bytes, count, "a u16")?),
        SampleType::I16 => Data::I16(numbers(bytes, count, "an i16")?),
        SampleType::U32 => Data::U32(numbers(bytes, count, "a u32")?),
        SampleType::I32 => Data::I32(numbers(bytes, count, "an i32")?),
        SampleType::U64 => Data::U64(numbers(bytes, count, "a u64")?),
        SampleType::I64 => Data::I64(numbers(bytes, count, "an i64")?),
        SampleType::F32 => Data::F32(numbers(bytes, count, "an f32")?),
        SampleType::F64 => Data::F64(numbers(bytes, count, "an f64")?),
    })
}

/// Bytes as bits: what is not 0 is set. `bytes` holds one byte per voxel, x fastest.
pub fn pack_bits(bytes: &[u8], dims: [usize; 3]) -> BitGrid {
    let mut grid = BitGrid::new(dims);
    let [nx, ny, nz] = dims;
    for z in 0..nz {
        for y in 0..ny {
            let from = &bytes[(z * ny + y) * nx..][..nx];
            for (word, bytes) in grid.row_mut(y, z).iter_mut().zip(from.chunks(64)) {
                for (bit, byte) in bytes.iter().enumerate() {
                    *word |= u64::from(*byte != 0) << bit;
                }
            }
        }
    }
    grid
}

/// The same volume as bits, where its samples are numbers and all of them 0 or 1.
pub fn as_bits(volume: &Volume) -> Option<Volume> {
    let is_mask = with_samples!(&volume.data, v => v.iter().all(|s| matches!(*s as f64, 0.0 | 1.0)), _ => false);
    is_mask.then(|| {
        let mut grid = BitGrid::new(volume.frame.dims);
        volume.read_bit_slices(0, &mut grid);
        Volume {
            frame: volume.frame,
            data: Data::Bits(grid),
        }
    })
}

/// Bytes that the samples of a volume take raw: bits as one byte each.
pub fn raw_length(volume: &Volume) -> u64 {
    volume.frame.len() as u64 * SampleType::of(&volume.data).bytes() as u64
}

/// Writes the samples raw, little endian, x fastest; bits as bytes of 0 and 1.
///
/// Bits are expanded a slab of slices at a time: memory stays at a few slices of bits.
pub fn write_raw(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    with_samples!(&volume.data, v => write_numbers(v, out), _ => {
        let mut bytes = Vec::with_capacity(BLOCK + volume.frame.dims[0]);
        for_each_slab(volume, |_, slab| {
            let [nx, ny, depth] = slab.dims();
            for z in 0..depth {
                for y in 0..ny {
                    expand_row(slab.row(y, z), nx, &mut bytes);
                    if bytes.len() >= BLOCK {
                        out.write_all(&bytes)?;
                        bytes.clear();
                    }
                }
            }
            Ok::<(), io::Error>(())
        })?;
        out.write_all(&bytes)
    })
}

/// Bytes handed on at a time: larger than the buffer of a sink, so that it is not copied again.
const BLOCK: usize = 1 << 19;

fn write_numbers<T: NoUninit>(numbers: &[T], out: &mut dyn Write) -> io::Result<()> {
    if cfg!(target_endian = "little") {
        return out.write_all(bytemuck::cast_slice(numbers));
    }
    let mut bytes = Vec::with_capacity(BLOCK);
    for chunk in numbers.chunks(BLOCK / size_of::<T>()) {
        bytes.clear();
        for number in chunk {
            bytes.extend(bytemuck::bytes_of(number).iter().rev());
        }
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// Slices in a slab: two layers of the bricks of an octree.
const SLAB: usize = 8;

/// Bytes of a slab of a grid.
pub fn slab_bytes([nx, ny, nz]: [usize; 3]) -> u128 {
    BitGrid::bytes_for([nx, ny, SLAB.min(nz)])
}

/// Calls `f(z, slab)` for each slab of up to 8 slices of bits, `z` its first slice.
pub fn for_each_slab<E>(
    volume: &Volume,
    mut f: impl FnMut(usize, &BitGrid) -> Result<(), E>,
) -> Result<(), E> {
    let [nx, ny, nz] = volume.frame.dims;
    let mut slab = BitGrid::new([nx, ny, SLAB.min(nz)]);
    for z in (0..nz).step_by(SLAB) {
        let depth = SLAB.min(nz - z);
        if depth != slab.dims()[2] {
            slab = BitGrid::new([nx, ny, depth]);
        }
        volume.read_bit_slices(z, &mut slab);
        f(z, &slab)?;
    }
    Ok(())
}

/// Eight bits as eight bytes of 0 and 1, the lowest first.
const SPREAD: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut bit = 0;
        while bit < 8 {
            table[byte][bit] = (byte >> bit & 1) as u8;
            bit += 1;
        }
        byte += 1;
    }
    table
};

/// Appends the first `nx` bits of a row as bytes of 0 and 1.
fn expand_row(row: &[u64], nx: usize, out: &mut Vec<u8>) {
    let start = out.len();
    for word in row {
        let mut bytes = [[0; 8]; 8];
        for (to, from) in bytes.iter_mut().zip(word.to_le_bytes()) {
            *to = SPREAD[from as usize];
        }
        out.extend_from_slice(bytes.as_flattened());
    }
    out.truncate(start + nx);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::written_volume::{raw, volumes};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn raw_samples_come_back(volume in volumes()) {
            let bytes = raw(&volume);
            prop_assert_eq!(bytes.len() as u64, raw_length(&volume));
            let sample = SampleType::of(&volume.data);
            let back = decode(&bytes, sample, ByteOrder::Little);
            let again = Volume { frame: volume.frame, data: back };
            prop_assert_eq!(raw(&again), bytes.clone());
            let mut swapped = bytes.clone();
            swapped.chunks_exact_mut(sample.bytes()).for_each(<[u8]>::reverse);
            let again = Volume { frame: volume.frame, data: decode(&swapped, sample, ByteOrder::Big) };
            prop_assert_eq!(raw(&again), bytes);
        }

        #[test]
        fn bits_expand_to_what_they_are(volume in volumes()) {
            if let Data::Bits(grid) = &volume.data {
                let [nx, ny, nz] = grid.dims();
                let wanted: Vec<u8> = (0..nx * ny * nz)
                    .map(|i| u8::from(grid.get(i % nx, i / nx % ny, i / nx / ny)))
                    .collect();
                prop_assert_eq!(raw(&volume), wanted);
            }
        }
    }

    #[test]
    fn sizes_beyond_memory_are_refused_with_numbers() {
        let fault = extent([1 << 60, 1 << 60, 1 << 60], 8).unwrap_err();
        assert!(fault.problem.starts_with("a grid of 1152921504606846976 x"));
        assert!(extent([1 << 30, 1 << 30, 8], 1).is_err());
        assert_eq!(extent([4, 5, 6], 2).unwrap(), ([4, 5, 6], 240));
        let fault = extent([4, 0, 6], 2).unwrap_err();
        assert_eq!(
            fault.problem,
            "the grid is 4 x 0 x 6: it has no voxel along axis 1"
        );
    }

    #[test]
    fn text_samples_name_what_is_wrong() {
        let data = decode_text(b" 1, 2\n3 300", SampleType::U8, 3).unwrap();
        assert_eq!(data, Data::U8(vec![1, 2, 3]));
        let fault = decode_text(b"1 2 3 300", SampleType::U8, 4).unwrap_err();
        assert_eq!(fault.to_string(), "sample 3: \"300\" is not a u8");
        let fault = decode_text(b"1 2", SampleType::F32, 1 << 60).unwrap_err();
        assert_eq!(
            fault.problem,
            "1152921504606846976 samples are needed, but 2 are there"
        );
    }
}
