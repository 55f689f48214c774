use super::*;
use crate::error::Error;
use crate::io::samples::pack_bits;
use crate::io::written_volume::{Parsed, damaged, parsed, raw, volumes, written};
use crate::numeric::vector::Vec3;
use crate::volume::Frame;
use proptest::prelude::*;
use std::fs;

/// A header by the places of the format's own description, which the reader's table must agree with.
#[derive(Clone)]
struct File {
    version: usize,
    big: bool,
    magic: &'static str,
    dim: [i64; 8],
    datatype: i64,
    bitpix: i64,
    pixdim: [f64; 8],
    offset: Option<f64>,
    slope: f64,
    inter: f64,
    units: i64,
    /// qform_code and sform_code.
    codes: [i64; 2],
    quatern: Vec3,
    qoffset: Vec3,
    srow: [[f64; 4]; 3],
    data: Vec<u8>,
}

/// 2 x 3 x 2 bytes from 0 to 11.
const SMALL: File = File {
    version: 1,
    big: false,
    magic: "n",
    dim: [3, 2, 3, 2, 1, 1, 1, 1],
    datatype: 2,
    bitpix: 8,
    pixdim: [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    offset: None,
    slope: 1.0,
    inter: 0.0,
    units: 2,
    codes: [0, 0],
    quatern: [0.0; 3],
    qoffset: [0.0; 3],
    srow: [[0.0; 4]; 3],
    data: Vec::new(),
};

fn small() -> File {
    File {
        data: (0..12).collect(),
        ..SMALL
    }
}

impl File {
    fn bytes(&self) -> Vec<u8> {
        let one = self.version == 1;
        let size = if one { 348 } else { 540 };
        let mut bytes = vec![0; size + 4];
        let mut put = |at: [usize; 2], width: [usize; 2], little: [u8; 8]| {
            let (at, width) = (at[self.version - 1], width[self.version - 1]);
            let place = &mut bytes[at..at + width];
            place.copy_from_slice(&little[..width]);
            if self.big {
                place.reverse();
            }
        };
        let real = |value: f64| match one {
            true => u64::from((value as f32).to_bits()).to_le_bytes(),
            false => value.to_bits().to_le_bytes(),
        };
        put([0, 0], [4, 4], (size as u64).to_le_bytes());
        for (i, size) in self.dim.iter().enumerate() {
            put([40 + 2 * i, 16 + 8 * i], [2, 8], size.to_le_bytes());
        }
        put([70, 12], [2, 2], self.datatype.to_le_bytes());
        put([72, 14], [2, 2], self.bitpix.to_le_bytes());
        let reals = |at: [usize; 2], i: usize| [at[0] + 4 * i, at[1] + 8 * i];
        let mut put_real = |at, i, value| put(reals(at, i), [4, 8], real(value));
        for (i, value) in self.pixdim.iter().enumerate() {
            put_real([76, 104], i, *value);
        }
        put_real([112, 176], 0, self.slope);
        put_real([116, 184], 0, self.inter);
        for i in 0..3 {
            put_real([256, 352], i, self.quatern[i]);
            put_real([268, 376], i, self.qoffset[i]);
        }
        for (i, value) in self.srow.as_flattened().iter().enumerate() {
            put_real([280, 400], i, *value);
        }
        let is_pair = self.magic == "ni";
        let offset = self
            .offset
            .unwrap_or(if is_pair { 0 } else { size + 4 } as f64);
        put(
            [108, 168],
            [4, 8],
            if one {
                real(offset)
            } else {
                (offset as i64).to_le_bytes()
            },
        );
        put([123, 500], [1, 4], self.units.to_le_bytes());
        put([252, 344], [2, 4], self.codes[0].to_le_bytes());
        put([254, 348], [2, 4], self.codes[1].to_le_bytes());
        let sign = if is_pair { "ni" } else { "n+" };
        let magic = match one {
            true => format!("{sign}1\0"),
            false => format!("{sign}2\0\r\n\x1a\n"),
        };
        let at = if one { 344 } else { 4 };
        bytes[at..at + magic.len()].copy_from_slice(magic.as_bytes());
        if !is_pair {
            bytes.extend(&self.data);
        }
        bytes
    }

    fn read(&self) -> Result<(Volume, Vec<Warning>), Fault> {
        parse(&self.bytes())
    }

    fn frame(&self) -> Frame {
        self.read().unwrap().0.frame
    }

    fn refusal(&self) -> String {
        self.read().unwrap_err().to_string()
    }

    /// The same in each version and byte order.
    fn everywhere(&self) -> impl Iterator<Item = File> {
        let file = self.clone();
        [(1, false), (1, true), (2, false), (2, true)]
            .into_iter()
            .map(move |(version, big)| File {
                version,
                big,
                ..file.clone()
            })
    }
}

fn parse(bytes: &[u8]) -> Parsed {
    parsed("a.nii", bytes, read)
}

/// Where a voxel is.
fn place(frame: &Frame, index: Vec3) -> Vec3 {
    std::array::from_fn(|c| {
        frame.origin[c] + (0..3).map(|a| index[a] * frame.axes[a][c]).sum::<f64>()
    })
}

fn assert_near(found: Vec3, wanted: Vec3, tolerance: f64) {
    for c in 0..3 {
        assert!(
            (found[c] - wanted[c]).abs() <= tolerance,
            "{found:?}, not {wanted:?}"
        );
    }
}

#[test]
fn each_type_is_read_in_both_versions_and_byte_orders() {
    let codes = [2, 256, 512, 4, 768, 8, 1280, 1024, 16, 64];
    for (code, sample) in codes.into_iter().zip(SampleType::ALL) {
        let data: Vec<u8> = (0..12 * sample.bytes())
            .map(|i| (i * 89 + 7) as u8)
            .collect();
        let wanted = samples::decode(&data, sample, ByteOrder::Little);
        let file = File {
            datatype: code,
            bitpix: 8 * sample.bytes() as i64,
            data,
            ..SMALL
        };
        for mut file in file.everywhere() {
            if file.big {
                file.data
                    .chunks_exact_mut(sample.bytes())
                    .for_each(<[u8]>::reverse);
            }
            let (volume, warnings) = file.read().unwrap();
            assert_eq!(volume.data, wanted);
            assert_eq!(volume.frame, Frame::straight([2, 3, 2], [0.0; 3], [1.0; 3]));
            assert_eq!(warnings, []);
        }
    }
}

#[test]
fn the_sform_places_voxels_by_its_rows() {
    let file = File {
        codes: [0, 2],
        srow: [
            [0.5, -1.5, 0.0, 10.0],
            [2.0, 0.25, 0.0, -20.0],
            [0.0, 0.125, 3.0, 30.0],
        ],
        // What does not count may be anything.
        quatern: [f64::NAN; 3],
        pixdim: [0.0; 8],
        ..small()
    };
    for file in file.everywhere() {
        let (volume, warnings) = file.read().unwrap();
        assert_eq!(warnings, []);
        assert_eq!(volume.frame.origin, [10.0, -20.0, 30.0]);
        // 0.5 - 3 + 10, 2 + 0.5 - 20, 0.25 + 9 + 30
        assert_eq!(place(&volume.frame, [1.0, 2.0, 3.0]), [7.5, -17.5, 39.25]);
        assert!(volume.check().is_ok());
    }
}

#[test]
fn the_qform_turns_steps_and_its_sign_flips_the_third() {
    // 120 degrees about (1, 1, 1): x goes to y, y to z, z to x.
    let file = File {
        codes: [1, 0],
        quatern: [0.5; 3],
        qoffset: [10.0, -20.0, 30.0],
        pixdim: [-1.0, 2.0, 3.0, 5.0, 0.0, 0.0, 0.0, 0.0],
        ..small()
    };
    for mut file in file.everywhere() {
        assert_eq!(
            file.frame().axes,
            [[0.0, 2.0, 0.0], [0.0, 0.0, 3.0], [-5.0, 0.0, 0.0]]
        );
        assert_eq!(place(&file.frame(), [1.0, 2.0, 4.0]), [-10.0, -18.0, 36.0]);
        for sign in [0.0, 1.0] {
            file.pixdim[0] = sign;
            assert_eq!(file.frame().axes[2], [5.0, 0.0, 0.0]);
        }
    }
    // About z by the angle of 3-4-5: the cosine of its half is sqrt(0.8), the sine sqrt(0.2).
    let file = File {
        quatern: [0.0, 0.0, 0.2f64.sqrt()],
        ..file
    };
    for file in file.everywhere() {
        let near = if file.version == 1 { 1e-6 } else { 1e-14 };
        let wanted = [[1.2, 1.6, 0.0], [-2.4, 1.8, 0.0], [0.0, 0.0, -5.0]];
        for (found, wanted) in file.frame().axes.into_iter().zip(wanted) {
            assert_near(found, wanted, near);
        }
        // 10 + 1.2 - 4.8, -20 + 1.6 + 3.6, 30 - 20
        let found = place(&file.frame(), [1.0, 2.0, 4.0]);
        assert_near(found, [6.4, -14.8, 10.0], 4.0 * near);
    }
}

#[test]
fn a_half_turn_survives_the_rounding_of_its_quaternion() {
    // About (1, 1, 0): x and y change places, z turns round. In single precision the square of the
    // quaternion is 3e-8 from 1, of which a careless root would make a turn of 0.02 degrees.
    let file = File {
        codes: [1, 0],
        quatern: [0.5f64.sqrt(), 0.5f64.sqrt(), 0.0],
        ..small()
    };
    for file in file.everywhere() {
        let wanted = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
        for (found, wanted) in file.frame().axes.into_iter().zip(wanted) {
            assert_near(found, wanted, 1e-15);
        }
    }
}

#[test]
fn steps_alone_place_the_first_voxel_at_the_origin() {
    let mut file = File {
        pixdim: [-1.0, 0.5, 2.0, 4.0, 0.0, 0.0, 0.0, 0.0],
        qoffset: [9.0; 3],
        srow: [[9.0; 4]; 3],
        ..small()
    };
    assert_eq!(
        file.frame(),
        Frame::straight([2, 3, 2], [0.0; 3], [0.5, 2.0, 4.0])
    );
    // Without a third dimension its size and step are what a slice has.
    file.dim = [2, 2, 3, -7, 0, 0, 0, 0];
    file.pixdim[3] = 0.0;
    file.data.truncate(6);
    assert_eq!(
        file.frame(),
        Frame::straight([2, 3, 1], [0.0; 3], [0.5, 2.0, 1.0])
    );
    // Further dimensions of 1 change nothing.
    file.dim = [7, 2, 3, 1, 1, 1, 1, 1];
    file.pixdim[3] = 4.0;
    assert_eq!(
        file.frame(),
        Frame::straight([2, 3, 1], [0.0; 3], [0.5, 2.0, 4.0])
    );
}

#[test]
fn lengths_become_millimetres_where_the_unit_is_known() {
    let row = |a: usize| std::array::from_fn(|b| if a == b { 2.0 } else { 0.0 });
    let mut srow: [[f64; 4]; 3] = std::array::from_fn(row);
    srow[1][3] = -5.0;
    // The unit of time, 8 for seconds, is beside that of space.
    for (units, factor) in [(0, 1.0), (1, 1000.0), (2, 1.0), (3, 0.001), (8 + 1, 1000.0)] {
        for file in (File {
            units,
            srow,
            codes: [0, 1],
            ..small()
        })
        .everywhere()
        {
            let [y, step] = [-5.0 * factor, 2.0 * factor];
            let wanted = Frame::straight([2, 3, 2], [0.0, y, 0.0], [step; 3]);
            assert_eq!(file.frame(), wanted);
        }
        let steps = File {
            units,
            pixdim: [2.0; 8],
            ..small()
        };
        assert_eq!(steps.frame().axes[2], [0.0, 0.0, 2.0 * factor]);
    }
}

#[test]
fn a_qform_that_says_otherwise_than_the_sform_is_warned_of() {
    let mut file = File {
        codes: [1, 1],
        pixdim: [1.0, 1.0, 2.0, 4.0, 0.0, 0.0, 0.0, 0.0],
        qoffset: [7.0, 8.0, 9.0],
        srow: [
            [1.0, 0.0, 0.0, 7.0],
            [0.0, 2.0, 0.0, 8.0],
            [0.0, 0.0, 4.0, 9.0],
        ],
        ..small()
    };
    let warned = |file: &File| {
        let (volume, warnings) = file.read().unwrap();
        assert_eq!(volume.frame.origin[1], 8.0);
        warnings
            .into_iter()
            .map(|w| (w.code, w.message))
            .collect::<Vec<_>>()
    };
    assert_eq!(warned(&file), []);
    file.srow[2][2] = 4.0005;
    assert_eq!(warned(&file), []);
    file.srow[2][2] = 4.5;
    let message = "sform and qform are up to 0.500000 voxels apart; the sform is used";
    let code = "nifti-affines".to_owned();
    assert_eq!(warned(&file), [(code.clone(), message.to_owned())]);
    file.quatern[1] = f64::NAN;
    let message = "the qform is not sound, and the sform is used: byte 260: quatern_c is NaN, \
                   which is no number";
    assert_eq!(warned(&file), [(code, message.to_owned())]);
}

#[test]
fn slope_and_intercept_scale_samples() {
    let with = |slope, inter| File {
        slope,
        inter,
        ..small()
    };
    for file in with(0.5, -3.0).everywhere() {
        let wanted = (0..12).map(|i| 0.5 * f64::from(i) - 3.0).collect();
        assert_eq!(file.read().unwrap().0.data, Data::F64(wanted));
    }
    let shifted = (0..12).map(|i| f64::from(i) + 5.0).collect();
    assert_eq!(with(1.0, 5.0).read().unwrap().0.data, Data::F64(shifted));
    let stored = Data::U8((0..12).collect());
    for (slope, inter) in [
        (1.0, 0.0),
        (0.0, 5.0),
        (f64::NAN, 5.0),
        (f64::INFINITY, 0.0),
    ] {
        assert_eq!(with(slope, inter).read().unwrap().0.data, stored);
    }
    let single = |slope| File {
        datatype: 16,
        bitpix: 32,
        data: (0..12).flat_map(|i| (i as f32).to_le_bytes()).collect(),
        ..with(slope, 1.0)
    };
    let wanted = (0..12)
        .map(|i| (f64::from(i) * f64::from(0.1f32) + 1.0) as f32)
        .collect();
    assert_eq!(single(0.1).read().unwrap().0.data, Data::F32(wanted));
    assert_eq!(
        single(1e38).refusal(),
        "byte 112: scl_slope 9.999999680285692e37 and scl_inter 1 take samples out of the range of f32"
    );
    assert_eq!(
        with(2.0, f64::NAN).refusal(),
        "byte 116: scl_inter is NaN, which is no number"
    );
}

#[test]
fn what_a_header_claims_wrongly_is_named_with_its_place() {
    let check = |file: File, wanted: &str| assert_eq!(file.refusal(), wanted);
    let dim = |index: usize, size: i64| {
        let mut file = small();
        file.dim[index] = size;
        file
    };
    check(dim(0, 0), "byte 40: dim[0] is 0, but 1 to 7 are possible");
    check(dim(0, 8), "byte 40: dim[0] is 8, but 1 to 7 are possible");
    check(dim(2, 0), "byte 44: dim[2] is 0, but a size is 1 or more");
    check(dim(3, -5), "byte 46: dim[3] is -5, but a size is 1 or more");
    let more = |index: usize| {
        let mut file = dim(index, 200);
        file.dim[0] = index as i64;
        file
    };
    check(
        more(4),
        "byte 48: holds 200 volumes (dim[4]), one is needed",
    );
    check(
        more(5),
        "byte 50: holds 200 values at each voxel (dim[5]), one is needed",
    );
    check(
        dim(3, 3),
        "byte 352: a grid of 2 x 3 x 3 needs 18 bytes of data, but 12 are there",
    );
    let two = |dim: [i64; 8]| File {
        version: 2,
        dim,
        ..small()
    };
    check(
        two([3, i64::MAX, i64::MAX, i64::MAX, 1, 1, 1, 1]),
        "a grid of 9223372036854775807 x 9223372036854775807 x 9223372036854775807 voxels of 1 \
         bytes is larger than memory can be",
    );
    check(
        two([3, 1 << 40, 1, 1, 1, 1, 1, 1]),
        "byte 544: a grid of 1099511627776 x 1 x 1 needs 1099511627776 bytes of data, but 12 are there",
    );
    let at = |offset: f64| File {
        offset: Some(offset),
        ..small()
    };
    check(
        at(365.0),
        "byte 108: vox_offset is 365, past the end of the data file of 364 bytes",
    );
    check(
        at(1e30),
        "byte 108: vox_offset is 9223372036854775807, past the end of the data file of 364 bytes",
    );
    check(
        at(347.0),
        "byte 108: vox_offset is 347, but the samples begin at byte 348 or later",
    );
    check(
        at(-1.0),
        "byte 108: vox_offset is -1, but the samples begin at byte 348 or later",
    );
    check(
        at(352.5),
        "byte 108: vox_offset is 352.5, which is no whole number of bytes",
    );
    check(
        at(f64::NAN),
        "byte 108: vox_offset is NaN, which is no number",
    );
    let of = |datatype: i64| File {
        datatype,
        ..small()
    };
    check(
        of(1),
        "byte 70: datatype is 1: the samples are bits, whose order the format leaves open",
    );
    check(
        of(32),
        "byte 70: datatype is 32: the samples are complex numbers",
    );
    check(of(128), "byte 70: datatype is 128: the samples are colours");
    check(
        of(1536),
        "byte 70: datatype is 1536: the samples are numbers of quadruple precision",
    );
    check(
        of(3),
        "byte 70: datatype is 3: the samples are of no known type",
    );
}

#[test]
fn frames_that_are_no_frames_are_named() {
    let check = |file: File, wanted: &str| assert_eq!(file.refusal(), wanted);
    let mut file = File {
        codes: [0, 1],
        ..small()
    };
    file.srow[1][3] = f64::NAN;
    check(file, "byte 308: srow_y[3] is NaN, which is no number");
    let turned = |quatern, qoffset| File {
        codes: [1, 0],
        quatern,
        qoffset,
        ..small()
    };
    check(
        turned([0.0, f64::INFINITY, 0.0], [0.0; 3]),
        "byte 260: quatern_c is inf, which is no number",
    );
    check(
        turned([0.0; 3], [0.0, 0.0, f64::NAN]),
        "byte 276: qoffset_z is NaN, which is no number",
    );
    check(
        turned([0.0, 3.0, 4.0], [0.0; 3]),
        "byte 256: quatern_b to quatern_d have the length 5, but in a rotation it is 1 at most",
    );
    let steps = |y: f64| File {
        pixdim: [1.0, 1.0, y, 1.0, 0.0, 0.0, 0.0, 0.0],
        ..small()
    };
    check(
        steps(-2.0),
        "byte 84: pixdim[2] is -2, but a step is above 0",
    );
    check(
        steps(f64::NAN),
        "byte 84: pixdim[2] is NaN, which is no number",
    );
    // No step along an axis that is there: no frame, as every reader's frames are checked.
    let flat = steps(0.0).read().unwrap().0.check().unwrap_err();
    assert!(
        flat.problem
            .starts_with("the axes of the grid do not span space")
    );
}

#[test]
fn what_is_no_header_is_named() {
    assert_eq!(
        parse(b"abc").unwrap_err().to_string(),
        "byte 3: the header of 348 bytes is cut short"
    );
    let mut bytes = small().bytes();
    let refusal = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
    assert_eq!(
        refusal(&bytes[..347]),
        "byte 347: the header of 348 bytes is cut short"
    );
    bytes[344..348].fill(0);
    assert_eq!(
        refusal(&bytes),
        r#"byte 344: the magic is "\x00\x00\x00\x00", but "n+1\x00" or "ni1\x00" is one"#
    );
    bytes[0] = 0;
    assert_eq!(
        refusal(&bytes),
        "byte 0: sizeof_hdr is 256, but 348 or 540 is one"
    );
}

#[test]
fn bytes_that_nothing_speaks_of_are_warned_of() {
    let mut file = small();
    file.bitpix = 16;
    file.data.push(0);
    let (_, warnings) = file.read().unwrap();
    let codes: Vec<_> = warnings.iter().map(|w| w.code.as_str()).collect();
    assert_eq!(codes, ["nifti-bitpix", "trailing-bytes"]);
    // An extension is between header and samples.
    let mut file = small();
    file.offset = Some(368.0);
    file.data.splice(0..0, [9; 16]);
    let (volume, warnings) = file.read().unwrap();
    assert_eq!(
        (volume.data, warnings),
        (Data::U8((0..12).collect()), vec![])
    );
}

#[test]
fn a_pair_is_a_header_and_the_samples_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let open = |name: &str| {
        let path = folder.path().join(name);
        Source::open(path.to_str().unwrap(), u64::MAX).unwrap()
    };
    let pack = |bytes: &[u8]| {
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packer.write_all(bytes).unwrap();
        packer.finish().unwrap()
    };
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    for version in [1, 2] {
        let file = File {
            version,
            magic: "ni",
            offset: Some(3.0),
            ..small()
        };
        let mut data = vec![9; 3];
        data.extend(&file.data);
        put("a.hdr", &file.bytes());
        put("a.img", &data);
        put("b.hdr.gz", &pack(&file.bytes()));
        put("b.img.gz", &pack(&data));
        put("c.hdr", &file.bytes());
        put("c.img", &data[..9]);
        for name in ["a.hdr", "b.hdr.gz"] {
            let mut warnings = Vec::new();
            let volume = read(&open(name), &mut warnings).unwrap();
            assert_eq!(volume.data, Data::U8((0..12).collect()));
            assert_eq!(warnings, []);
        }
        assert_eq!(named_file(&open("a.hdr")).unwrap(), "a.img");
        assert_eq!(named_file(&open("b.hdr.gz")).unwrap(), "b.img.gz");
        let refused = |name: &str| read(&open(name), &mut Vec::new()).map_err(Refusal::fault);
        let short = "a grid of 2 x 3 x 2 needs 12 bytes of data, but 6 are there";
        assert_eq!(refused("c.hdr").unwrap_err().to_string(), short);
        put("b.img.gz", &pack(&data)[..15]);
        let damaged = refused("b.hdr.gz").unwrap_err().problem;
        assert!(
            damaged.starts_with("the compressed data is damaged"),
            "{damaged}"
        );
        fs::remove_file(folder.path().join("c.img")).unwrap();
        let lacking = refused("c.hdr").unwrap_err().problem;
        assert!(
            lacking.starts_with("names the data file \"c.img\""),
            "{lacking}"
        );
    }
    let single = Source::from_bytes("a.nii", small().bytes()).unwrap();
    assert_eq!(named_file(&single), None);
}

#[test]
fn samples_that_grow_by_scaling_count_as_what_they_become() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nii");
    fs::write(
        &path,
        File {
            slope: 2.0,
            ..small()
        }
        .bytes(),
    )
    .unwrap();
    let with = |limit| {
        let source = Source::open(path.to_str().unwrap(), limit).unwrap();
        read(&source, &mut Vec::new()).map_err(|refusal| refusal.of(&source))
    };
    assert!(with(96).is_ok());
    let refused = with(95).unwrap_err();
    assert!(matches!(refused, Error::Limit { .. }));
    assert_eq!(
        refused.to_string(),
        "scaling its samples needs 96 bytes, over the limit of 95 bytes"
    );
}

proptest! {
    #[test]
    fn what_is_written_comes_back(volume in volumes()) {
        let (back, warnings) = parse(&written(&volume, write)).unwrap();
        prop_assert!(warnings.is_empty());
        prop_assert_eq!(back.frame, volume.frame);
        prop_assert_eq!(raw(&back), raw(&volume));
    }

    #[test]
    fn any_bytes_are_read_or_refused(
        two in any::<bool>(), cut in 0usize..600, at in 0usize..600, byte in any::<u8>()
    ) {
        let bytes = File { version: 1 + usize::from(two), codes: [1, 1], ..small() }.bytes();
        let _ = parse(&damaged(bytes, at, byte, cut));
    }
}

#[test]
fn version_1_is_written_where_it_loses_nothing() {
    let write = |frame: Frame| {
        let bits = vec![1; frame.len()];
        let mut bytes = Vec::new();
        let data = Data::Bits(pack_bits(&bits, frame.dims));
        super::write(&Volume { frame, data }, &mut bytes).unwrap();
        let back = parse(&bytes).unwrap().0;
        assert_eq!((back.frame, back.data), (frame, Data::U8(bits)));
        u32::from_le_bytes(*bytes.first_chunk().unwrap())
    };
    let frame = Frame::straight([3, 2, 2], [0.5, -1.0, 1e9], [0.25, 1.0, 3.0]);
    assert_eq!(write(frame), 348);
    assert_eq!(
        write(Frame {
            origin: [0.1, 0.0, 0.0],
            ..frame
        }),
        540
    );
    assert_eq!(
        write(Frame {
            dims: [32767, 1, 1],
            ..frame
        }),
        348
    );
    assert_eq!(
        write(Frame {
            dims: [1, 32768, 1],
            ..frame
        }),
        540
    );
}
