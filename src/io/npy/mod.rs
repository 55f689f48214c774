//! NumPy arrays (`.npy`), versions 1 to 3, as grids indexed `[z, y, x]`.
//!
//! The format holds no place in space. What is read has voxel (0, 0, 0) centred at the origin and
//! steps of 1 along the coordinate axes; what is written keeps the order of its axes, and loses
//! origin, spacing and directions. Source: NumPy Enhancement Proposal 1, and `numpy.lib.format`.

mod header;

use super::refusal::Refusal;
use super::samples::{self, ByteOrder, SampleType};
use crate::io::source::Source;
use crate::report::Warning;
use crate::volume::{Data, Frame, Volume};
use crate::with_samples;
use header::Kind;
use std::io::{self, Write};

/// Reads an array of three axes, or two (one slice), of bool, integers or floats of 16 to 64 bits.
///
/// Both byte orders and both axis orders; bool becomes bits, half precision becomes single. The
/// data is measured against the shape before room is made for it.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Volume, Refusal> {
    let bytes = source.bytes();
    let header = header::parse(bytes)?;
    let sizes = header.sizes()?;
    let width = match header.kind {
        Kind::Bool => 1,
        Kind::Half => 2,
        Kind::Number(sample) => sample.bytes(),
    };
    let (dims, wanted) = samples::extent(sizes, width)?;
    let body = samples::take(
        &bytes[header.end..],
        wanted,
        sizes,
        source.limit(),
        warnings,
    )?;
    let stored = match header.kind {
        Kind::Bool => Data::U8(body.to_vec()),
        Kind::Half => Data::F32(halves(body, header.order)),
        Kind::Number(sample) => samples::decode(body, sample, header.order),
    };
    let ordered = if header.fortran {
        x_fastest(stored, dims)
    } else {
        stored
    };
    let data = match ordered {
        Data::U8(bytes) if header.kind == Kind::Bool => {
            Data::Bits(samples::pack_bits(&bytes, dims))
        }
        data => data,
    };
    Ok(Volume {
        frame: Frame::straight(dims, [0.0; 3], [1.0; 3]),
        data,
    })
}

/// Samples stored z fastest (Fortran order of `[z, y, x]`) as samples stored x fastest.
fn x_fastest(data: Data, [nx, ny, nz]: [usize; 3]) -> Data {
    fn turned<T: Copy>(v: &[T], [nx, ny, nz]: [usize; 3]) -> Vec<T> {
        let mut out = Vec::with_capacity(v.len());
        for z in 0..nz {
            for y in 0..ny {
                out.extend((0..nx).map(|x| v[z + nz * (y + ny * x)]));
            }
        }
        out
    }
    let dims = [nx, ny, nz];
    match data {
        Data::U8(v) => Data::U8(turned(&v, dims)),
        Data::I8(v) => Data::I8(turned(&v, dims)),
        Data::U16(v) => Data::U16(turned(&v, dims)),
        Data::I16(v) => Data::I16(turned(&v, dims)),
        Data::U32(v) => Data::U32(turned(&v, dims)),
        Data::I32(v) => Data::I32(turned(&v, dims)),
        Data::U64(v) => Data::U64(turned(&v, dims)),
        Data::I64(v) => Data::I64(turned(&v, dims)),
        Data::F32(v) => Data::F32(turned(&v, dims)),
        Data::F64(v) => Data::F64(turned(&v, dims)),
        bits @ (Data::Bits(_) | Data::Sparse(_)) => bits,
    }
}

/// Numbers of half precision (IEEE 754 binary16) as single precision, exactly.
fn halves(bytes: &[u8], order: ByteOrder) -> Vec<f32> {
    let (chunks, _) = bytes.as_chunks::<2>();
    let bits = |c: &[u8; 2]| match order {
        ByteOrder::Little => u16::from_le_bytes(*c),
        ByteOrder::Big => u16::from_be_bytes(*c),
    };
    chunks.iter().map(|c| half(bits(c))).collect()
}

fn half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    match exponent {
        0 => sign * fraction * 2f32.powi(-24),
        31 if fraction == 0.0 => sign * f32::INFINITY,
        31 => f32::NAN,
        _ => sign * (1.0 + fraction / 1024.0) * 2f32.powi(exponent - 15),
    }
}

/// Writes an array indexed `[z, y, x]` in C order, little endian, version 1; bits as bool.
///
/// Origin, spacing and directions are lost: the format has no place for them. Bits are expanded a
/// few slices at a time.
pub fn write(volume: &Volume, out: &mut dyn Write) -> io::Result<()> {
    let [nx, ny, nz] = volume.frame.dims;
    let kind = with_samples!(&volume.data, _v => match SampleType::of(&volume.data) {
        SampleType::U8 => "|u1",
        SampleType::I8 => "|i1",
        SampleType::U16 => "<u2",
        SampleType::I16 => "<i2",
        SampleType::U32 => "<u4",
        SampleType::I32 => "<i4",
        SampleType::U64 => "<u8",
        SampleType::I64 => "<i8",
        SampleType::F32 => "<f4",
        SampleType::F64 => "<f8",
    }, _ => "|b1");
    let mut header =
        format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({nz}, {ny}, {nx}), }}");
    // Magic, version and length take 10 bytes; all before the data is a multiple of 64.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    header.push_str(&" ".repeat(padded - header.len() - 1));
    header.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(header.len() as u16).to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    samples::write_raw(volume, out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Fault;
    use crate::io::written_volume::{damaged, parsed, raw, twelve, volumes, written};
    use proptest::prelude::*;

    fn parse(bytes: &[u8]) -> Result<Volume, Fault> {
        parsed("a.npy", bytes, read).map(|(volume, _)| volume)
    }

    /// An array of version 1 by its header text.
    fn array(header: &str, data: &[u8]) -> Result<Volume, Fault> {
        let length = (header.len() as u16).to_le_bytes();
        parse(
            &[
                b"\x93NUMPY\x01\x00",
                length.as_slice(),
                header.as_bytes(),
                data,
            ]
            .concat(),
        )
    }

    proptest! {
        #[test]
        fn what_is_written_comes_back(volume in volumes()) {
            let bytes = written(&volume, write);
            prop_assert_eq!((bytes.len() as u64 - samples::raw_length(&volume)) % 64, 0);
            let back = parse(&bytes).unwrap();
            prop_assert_eq!(back.frame.dims, volume.frame.dims);
            prop_assert_eq!(back.data.sample_type(), volume.data.sample_type());
            prop_assert_eq!(raw(&back), raw(&volume));
        }

        #[test]
        fn any_bytes_are_read_or_refused(cut in 0usize..160, at in 0usize..160, byte in any::<u8>()) {
            let _ = parse(&damaged(written(&twelve(), write), at, byte, cut));
        }
    }

    #[test]
    fn fortran_order_has_the_first_index_fastest() {
        let header = "{'descr': '>i2', 'fortran_order': True, 'shape': (2, 1, 3)}";
        // Element [z, y, x] is 10 z + x, stored for z = 0, 1 within each x.
        let data = [0, 0, 0, 10, 0, 1, 0, 11, 0, 2, 0, 12];
        let volume = array(header, &data).unwrap();
        assert_eq!(volume.frame.dims, [3, 1, 2]);
        assert_eq!(volume.data, Data::I16(vec![0, 1, 2, 10, 11, 12]));
    }

    #[test]
    fn two_axes_are_one_slice_and_halves_are_exact() {
        let header = "{'shape': (2, 3), \"fortran_order\": False, 'descr': '<f2'}\n";
        let values: Vec<u8> = [0x0000u16, 0x3c00, 0xc000, 0x0001, 0x7bff, 0x3555]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let volume = array(header, &values).unwrap();
        assert_eq!(volume.frame.dims, [3, 2, 1]);
        let wanted = vec![0.0, 1.0, -2.0, 2f32.powi(-24), 65504.0, 0.333_251_95];
        assert_eq!(volume.data, Data::F32(wanted));
        assert!(half(0x7e00).is_nan() && half(0xfc00) == f32::NEG_INFINITY);
    }
}
