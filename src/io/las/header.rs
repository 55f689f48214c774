//! The header of a LAS file: counts, scale, and how a point is laid out.

use crate::error::Fault;

/// First bytes.
pub const MAGIC: &[u8] = b"LASF";
/// Bytes of a header of version 1.0 to 1.2, the shortest.
pub const SHORTEST: usize = 227;
/// Bytes of a header of version 1.4.
pub const LONGEST: usize = 375;
/// Bytes of a variable length record before what it holds.
pub const RECORD: usize = 54;
/// Who wrote the record that says how points are packed, and its number.
pub const LASZIP: (&[u8], u16) = (b"laszip encoded", 22204);

/// Where the number of the point format stands; its two upper bits say that points are packed.
const FORMAT: usize = 104;
/// Bytes of a point of each format.
const LENGTHS: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// What the header says.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The number of the point format.
    pub format: u8,
    /// Whether points are packed by LASzip.
    pub is_packed: bool,
    /// Bytes of a point.
    pub length: usize,
    pub points: u64,
    pub scale: [f64; 3],
    pub offset: [f64; 3],
    /// Where the points begin.
    pub data: usize,
    /// Where the variable length records begin, and how many there are.
    pub records: (usize, u32),
}

impl Header {
    /// Reads a header. Errs with the byte where it is cut short, of an unknown version or point format,
    /// has a scale or offset that is none, or states a place outside of the file.
    pub fn parse(bytes: &[u8]) -> Result<Header, Fault> {
        if !bytes.starts_with(MAGIC) {
            return Err(Fault::byte(0, "does not begin with \"LASF\""));
        }
        if bytes.len() < SHORTEST {
            let problem = format!("the header of {SHORTEST} bytes is cut short");
            return Err(Fault::byte(bytes.len(), problem));
        }
        let (major, minor) = (bytes[24], bytes[25]);
        if major != 1 || minor > 4 {
            let problem = format!("version {major}.{minor} is not read, only 1.0 to 1.4");
            return Err(Fault::byte(24, problem));
        }
        if minor == 4 && bytes.len() < LONGEST {
            let problem = format!("the header of {LONGEST} bytes is cut short");
            return Err(Fault::byte(bytes.len(), problem));
        }
        let format = bytes[FORMAT] & 0x3f;
        let Some(least) = LENGTHS.get(usize::from(format)) else {
            let problem = format!("point format {format} is not read, only 0 to 10");
            return Err(Fault::byte(FORMAT, problem));
        };
        let length = usize::from(u16_at(bytes, 105));
        if length < *least {
            let problem = format!("points of {length} bytes, but format {format} has {least}");
            return Err(Fault::byte(105, problem));
        }
        let data = u32_at(bytes, 96) as usize;
        if data < SHORTEST || data > bytes.len() {
            let there = bytes.len();
            let problem = format!("points begin at byte {data}, but the file has {there}");
            return Err(Fault::byte(96, problem));
        }
        let legacy = u64::from(u32_at(bytes, 107));
        let points = match minor {
            4 => Some(u64_at(bytes, 247)).filter(|points| *points > 0),
            _ => None,
        };
        Ok(Header {
            format,
            is_packed: bytes[FORMAT] & 0xc0 != 0,
            length,
            points: points.unwrap_or(legacy),
            scale: numbers(bytes, 131, "scale", |scale| {
                scale.is_finite() && scale != 0.0
            })?,
            offset: numbers(bytes, 155, "offset", f64::is_finite)?,
            data,
            records: (usize::from(u16_at(bytes, 94)), u32_at(bytes, 100)),
        })
    }

    /// What the record holds that says how points are packed.
    pub fn packing<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], Fault> {
        let (mut at, count) = self.records;
        for _ in 0..count {
            let Some(head) = bytes[..self.data].get(at..at.saturating_add(RECORD)) else {
                break;
            };
            let length = usize::from(u16_at(head, 20));
            let (user, number) = LASZIP;
            let is_it = head[2..18].starts_with(user) && u16_at(head, 18) == number;
            if is_it {
                let start = at + RECORD;
                return bytes[..self.data]
                    .get(start..start + length)
                    .ok_or_else(|| {
                        let problem = "the record of LASzip goes on into the points";
                        Fault::byte(at, problem)
                    });
            }
            at += RECORD + length;
        }
        Err(Fault::byte(
            self.records.0,
            "points are packed, but no record of LASzip says how",
        ))
    }

    /// Where a point has its colour.
    pub fn color(&self) -> Option<usize> {
        match self.format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        }
    }

    /// Whether points are of the longer kind that came with version 1.4.
    pub fn is_new(&self) -> bool {
        self.format >= 6
    }

    /// What of a point is not read.
    pub fn ignored(&self) -> Vec<String> {
        let least = LENGTHS[usize::from(self.format)];
        let parts = [
            ("intensity", true),
            ("returns", true),
            ("scan angle", true),
            ("user data", true),
            ("point source", true),
            ("GPS time", !matches!(self.format, 0 | 2)),
            ("near infrared", matches!(self.format, 8 | 10)),
            ("wave packets", matches!(self.format, 4 | 5 | 9 | 10)),
            ("extra bytes", self.length > least),
        ];
        let parts = parts.into_iter().filter(|(_, has)| *has);
        parts.map(|(name, _)| name.to_owned()).collect()
    }
}

/// Three numbers of 64 bits that are to be sound.
fn numbers(
    bytes: &[u8],
    at: usize,
    what: &str,
    is_sound: impl Fn(f64) -> bool,
) -> Result<[f64; 3], Fault> {
    let mut values = [0.0; 3];
    for (axis, value) in values.iter_mut().enumerate() {
        let at = at + 8 * axis;
        *value = f64::from_bits(u64_at(bytes, at));
        if !is_sound(*value) {
            let name = ["x", "y", "z"][axis];
            let problem = format!("the {what} of {name} is {value}");
            return Err(Fault::byte(at, problem));
        }
    }
    Ok(values)
}

/// A number of 16 bits at a place that is there.
pub fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

/// A number of 32 bits at a place that is there.
pub fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from(u16_at(bytes, at)) | u32::from(u16_at(bytes, at + 2)) << 16
}

/// A number of 64 bits at a place that is there.
pub fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}
