//! The header of a NIfTI file: two versions of one list of fields.

use crate::error::{Fault, number};
use crate::io::samples::{ByteOrder, SampleType};
use crate::numeric::vector::Vec3;
use crate::report::Warning;

/// A version of the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// 348 bytes: sizes of 16 bits, numbers of single precision.
    One,
    /// 540 bytes: sizes of 64 bits, numbers of double precision.
    Two,
}

impl Version {
    /// Bytes of the header, which its first field says too.
    pub fn bytes(self) -> usize {
        match self {
            Version::One => 348,
            Version::Two => 540,
        }
    }

    /// Where the magic is, and what it is for one file and for two.
    fn magic(self) -> (usize, [&'static [u8]; 2]) {
        match self {
            Version::One => (344, [b"n+1\0", b"ni1\0"]),
            Version::Two => (4, [b"n+2\0\r\n\x1a\n", b"ni2\0\r\n\x1a\n"]),
        }
    }
}

/// A field that holds numbers, with its first byte and the bytes of a number in each version.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    name: &'static str,
    /// How many numbers it holds.
    count: usize,
    at: [usize; 2],
    width: [usize; 2],
}

const fn field(name: &'static str, count: usize, at: [usize; 2], width: [usize; 2]) -> Field {
    Field {
        name,
        count,
        at,
        width,
    }
}

const SIZEOF_HDR: Field = field("sizeof_hdr", 1, [0, 0], [4, 4]);
const DIM: Field = field("dim", 8, [40, 16], [2, 8]);
const DATATYPE: Field = field("datatype", 1, [70, 12], [2, 2]);
const BITPIX: Field = field("bitpix", 1, [72, 14], [2, 2]);
pub const PIXDIM: Field = field("pixdim", 8, [76, 104], [4, 8]);
const VOX_OFFSET: Field = field("vox_offset", 1, [108, 168], [4, 8]);
const SCL_SLOPE: Field = field("scl_slope", 1, [112, 176], [4, 8]);
const SCL_INTER: Field = field("scl_inter", 1, [116, 184], [4, 8]);
const XYZT_UNITS: Field = field("xyzt_units", 1, [123, 500], [1, 4]);
pub const QFORM_CODE: Field = field("qform_code", 1, [252, 344], [2, 4]);
pub const SFORM_CODE: Field = field("sform_code", 1, [254, 348], [2, 4]);
/// b, c and d of the quaternion.
pub const QUATERN: Field = field("quatern", 3, [256, 352], [4, 8]);
pub const QOFFSET: Field = field("qoffset", 3, [268, 376], [4, 8]);
/// Three rows of four numbers.
pub const SROW: Field = field("srow", 12, [280, 400], [4, 8]);

impl Field {
    /// First byte of a number of it.
    fn place(&self, version: Version, index: usize) -> usize {
        self.at[version as usize] + index * self.width[version as usize]
    }

    /// The name of a number of it, as the format writes it.
    fn name(&self, index: usize) -> String {
        let name = self.name;
        match name {
            "quatern" => format!("{name}_{}", ["b", "c", "d"][index]),
            "qoffset" => format!("{name}_{}", ["x", "y", "z"][index]),
            "srow" => format!("{name}_{}[{}]", ["x", "y", "z"][index / 4], index % 4),
            _ if self.count == 1 => name.to_owned(),
            _ => format!("{name}[{index}]"),
        }
    }
}

/// What stored samples are multiplied by, and what is then added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// The factor.
    pub slope: f64,
    /// What is added.
    pub intercept: f64,
    place: usize,
}

impl Scaling {
    /// A fault at the factor.
    pub fn fault(&self, problem: String) -> Fault {
        Fault::byte(self.place, problem)
    }
}

/// The header of a file.
#[derive(Debug, Clone, Copy)]
pub struct Header<'a> {
    bytes: &'a [u8],
    version: Version,
    order: ByteOrder,
    is_pair: bool,
}

impl<'a> Header<'a> {
    /// The header that a file begins with: its size tells version and byte order. Errs where size
    /// or magic is none.
    pub fn parse(bytes: &'a [u8]) -> Result<Header<'a>, Fault> {
        let cut = |wanted: usize| {
            let problem = format!("the header of {wanted} bytes is cut short");
            Fault::byte(bytes.len(), problem)
        };
        let first = bytes.first_chunk::<4>().ok_or_else(|| cut(348))?;
        let (little, big) = (i32::from_le_bytes(*first), i32::from_be_bytes(*first));
        let (version, order) = match (little, big) {
            (348, _) => (Version::One, ByteOrder::Little),
            (_, 348) => (Version::One, ByteOrder::Big),
            (540, _) => (Version::Two, ByteOrder::Little),
            (_, 540) => (Version::Two, ByteOrder::Big),
            _ => {
                return Err(Fault::byte(
                    0,
                    format!("{} is {little}, but 348 or 540 is one", SIZEOF_HDR.name),
                ));
            }
        };
        let bytes = bytes
            .get(..version.bytes())
            .ok_or_else(|| cut(version.bytes()))?;
        let (at, [one, two]) = version.magic();
        let magic = &bytes[at..at + one.len()];
        if magic != one && magic != two {
            return Err(Fault::byte(
                at,
                format!(
                    "the magic is \"{}\", but \"{}\" or \"{}\" is one",
                    magic.escape_ascii(),
                    one.escape_ascii(),
                    two.escape_ascii()
                ),
            ));
        }
        Ok(Header {
            bytes,
            version,
            order,
            is_pair: magic == two,
        })
    }

    /// The order of the bytes of header and samples.
    pub fn order(&self) -> ByteOrder {
        self.order
    }

    /// Whether the samples are in a file beside the header.
    pub fn is_pair(&self) -> bool {
        self.is_pair
    }

    /// A fault at a number of a field: its name and value, then the problem.
    pub fn fault(&self, field: Field, index: usize, problem: impl std::fmt::Display) -> Fault {
        let place = field.place(self.version, index);
        Fault::byte(place, format!("{} {problem}", field.name(index)))
    }

    /// The bytes of a number, the least significant first, filled up with zeros.
    fn word(&self, field: Field, index: usize) -> [u8; 8] {
        let at = field.place(self.version, index);
        let bytes = &self.bytes[at..at + field.width[self.version as usize]];
        let mut word = [0; 8];
        for (i, byte) in bytes.iter().enumerate() {
            let to = match self.order {
                ByteOrder::Little => i,
                ByteOrder::Big => bytes.len() - 1 - i,
            };
            word[to] = *byte;
        }
        word
    }

    /// A signed integer.
    pub fn integer(&self, field: Field, index: usize) -> i64 {
        let unused = 64 - 8 * field.width[self.version as usize];
        i64::from_le_bytes(self.word(field, index)) << unused >> unused
    }

    /// A number of single or double precision.
    pub fn real(&self, field: Field, index: usize) -> f64 {
        let word = u64::from_le_bytes(self.word(field, index));
        match field.width[self.version as usize] {
            4 => f64::from(f32::from_bits(word as u32)),
            _ => f64::from_bits(word),
        }
    }

    /// A number that must be finite.
    pub fn finite(&self, field: Field, index: usize) -> Result<f64, Fault> {
        let value = self.real(field, index);
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.fault(field, index, format_args!("is {value}, which is no number")))
    }

    /// The distance between two neighbours of 1, by the precision of the header.
    pub fn epsilon(&self) -> f64 {
        match self.version {
            Version::One => f64::from(f32::EPSILON),
            Version::Two => f64::EPSILON,
        }
    }

    /// Dimensions that the file has.
    pub fn dimensions(&self) -> usize {
        usize::try_from(self.integer(DIM, 0)).unwrap_or(0)
    }

    /// Voxels along each axis; 1 along those that the file has not.
    pub fn sizes(&self) -> Result<[u64; 3], Fault> {
        let count = self.integer(DIM, 0);
        if !(1..=7).contains(&count) {
            return Err(self.fault(DIM, 0, format_args!("is {count}, but 1 to 7 are possible")));
        }
        let mut sizes = [1; 3];
        for index in 1..=self.dimensions() {
            let size = self.integer(DIM, index);
            let place = DIM.place(self.version, index);
            match (u64::try_from(size), index) {
                (Err(_) | Ok(0), _) => {
                    let problem = format_args!("is {size}, but a size is 1 or more");
                    return Err(self.fault(DIM, index, problem));
                }
                (Ok(size), 1..=3) => sizes[index - 1] = size,
                (Ok(1), _) => {}
                (Ok(size), 4) => {
                    let problem = format!("holds {size} volumes (dim[4]), one is needed");
                    return Err(Fault::byte(place, problem)
                        .with_hint("take one out first, with nibabel: image.slicer[..., 0]"));
                }
                (Ok(size), _) => {
                    let problem =
                        format!("holds {size} values at each voxel (dim[{index}]), one is needed");
                    return Err(Fault::byte(place, problem));
                }
            }
        }
        Ok(sizes)
    }

    /// The type of the samples. Warns where `bitpix` is not that of the type.
    pub fn sample_type(&self, warnings: &mut Vec<Warning>) -> Result<SampleType, Fault> {
        let code = self.integer(DATATYPE, 0);
        let refused = match code {
            1 => "bits, whose order the format leaves open",
            32 | 1792 | 2048 => "complex numbers",
            128 | 2304 => "colours",
            1536 => "numbers of quadruple precision",
            _ => "of no known type",
        };
        let Some((_, sample)) = TYPES.iter().find(|(known, _)| i64::from(*known) == code) else {
            let problem = format_args!("is {code}: the samples are {refused}");
            return Err(self
                .fault(DATATYPE, 0, problem)
                .with_hint("store integers of 8 to 64 bits, float32 or float64"));
        };
        let bits = self.integer(BITPIX, 0);
        let wanted = 8 * sample.bytes() as i64;
        if bits != wanted {
            let message = format!(
                "bitpix is {bits}, but samples of datatype {code} have {wanted}; bitpix is ignored"
            );
            warnings.push(Warning::new("nifti-bitpix", message, 1, None));
        }
        Ok(*sample)
    }

    /// The first byte of the samples in the file of `length` bytes that holds them.
    pub fn data_start(&self, length: usize) -> Result<usize, Fault> {
        let least = if self.is_pair {
            0
        } else {
            self.version.bytes()
        };
        let fault = |problem: String| Err(self.fault(VOX_OFFSET, 0, problem));
        let start = match self.version {
            Version::One => {
                let start = self.finite(VOX_OFFSET, 0)?;
                if start.fract() != 0.0 {
                    return fault(format!(
                        "is {}, which is no whole number of bytes",
                        number(start)
                    ));
                }
                start as i64
            }
            Version::Two => self.integer(VOX_OFFSET, 0),
        };
        match usize::try_from(start) {
            Ok(start) if start > length => fault(format!(
                "is {start}, past the end of the data file of {length} bytes"
            )),
            Ok(start) if start >= least => Ok(start),
            _ => fault(format!(
                "is {start}, but the samples begin at byte {least} or later"
            )),
        }
    }

    /// How samples are scaled; `None` where they stand as they are: a slope of 0 or none at all, or
    /// of 1 with nothing to add.
    pub fn scaling(&self) -> Result<Option<Scaling>, Fault> {
        let slope = self.real(SCL_SLOPE, 0);
        if slope == 0.0 || !slope.is_finite() {
            return Ok(None);
        }
        let scaling = Scaling {
            slope,
            intercept: self.finite(SCL_INTER, 0)?,
            place: SCL_SLOPE.place(self.version, 0),
        };
        Ok((scaling.slope != 1.0 || scaling.intercept != 0.0).then_some(scaling))
    }

    /// A length of the file in millimetres; as it stands where the file does not tell its unit.
    pub fn in_millimetres(&self, length: f64) -> f64 {
        // The lowest three bits are the unit of space, the next three that of time.
        match self.integer(XYZT_UNITS, 0) & 7 {
            1 => length * 1000.0,
            3 => length / 1000.0,
            _ => length,
        }
    }
}

/// Codes of the types that are read.
const TYPES: [(i16, SampleType); 10] = [
    (2, SampleType::U8),
    (4, SampleType::I16),
    (8, SampleType::I32),
    (16, SampleType::F32),
    (64, SampleType::F64),
    (256, SampleType::I8),
    (512, SampleType::U16),
    (768, SampleType::U32),
    (1024, SampleType::I64),
    (1280, SampleType::U64),
];

/// A header that is being made, little endian, of one file.
#[derive(Debug)]
pub struct Draft {
    bytes: Vec<u8>,
    version: Version,
}

impl Draft {
    /// A header with its size, its magic, and the place of the samples right after it.
    pub fn new(version: Version) -> Self {
        // Four zeros after the header say that no extension follows.
        let start = version.bytes() + 4;
        let mut draft = Draft {
            bytes: vec![0; start],
            version,
        };
        let (at, [magic, _]) = version.magic();
        draft.bytes[at..at + magic.len()].copy_from_slice(magic);
        draft.put_integer(SIZEOF_HDR, 0, version.bytes());
        match version {
            Version::One => draft.put_real(VOX_OFFSET, 0, start as f64),
            Version::Two => draft.put_integer(VOX_OFFSET, 0, start),
        }
        draft.put_real(SCL_SLOPE, 0, 1.0);
        draft
    }

    fn put(&mut self, field: Field, index: usize, word: [u8; 8]) {
        let at = field.place(self.version, index);
        let width = field.width[self.version as usize];
        self.bytes[at..at + width].copy_from_slice(&word[..width]);
    }

    fn put_integer(&mut self, field: Field, index: usize, value: usize) {
        self.put(field, index, (value as u64).to_le_bytes());
    }

    fn put_real(&mut self, field: Field, index: usize, value: f64) {
        let bits = match field.width[self.version as usize] {
            4 => u64::from((value as f32).to_bits()),
            _ => value.to_bits(),
        };
        self.put(field, index, bits.to_le_bytes());
    }

    /// Voxels along each axis.
    pub fn put_sizes(&mut self, [x, y, z]: [usize; 3]) {
        for (index, size) in [3, x, y, z, 1, 1, 1, 1].into_iter().enumerate() {
            self.put_integer(DIM, index, size);
        }
    }

    /// The type of the samples.
    pub fn put_type(&mut self, sample: SampleType) {
        let code = TYPES.iter().find(|(_, known)| *known == sample);
        self.put_integer(DATATYPE, 0, code.map_or(0, |(code, _)| *code as usize));
        self.put_integer(BITPIX, 0, 8 * sample.bytes());
    }

    /// The length of the step along each axis.
    pub fn put_steps(&mut self, [x, y, z]: Vec3) {
        for (index, step) in [1.0, x, y, z].into_iter().enumerate() {
            self.put_real(PIXDIM, index, step);
        }
    }

    /// The rows of the affine matrix, with code 1.
    pub fn put_sform(&mut self, rows: &[[f64; 4]; 3]) {
        self.put_integer(SFORM_CODE, 0, 1);
        for (index, number) in rows.as_flattened().iter().enumerate() {
            self.put_real(SROW, index, *number);
        }
    }

    /// The bytes up to the samples.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}
