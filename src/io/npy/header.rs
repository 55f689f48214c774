//! The header of a NumPy array: a Python dictionary of three entries.

use crate::error::Fault;
use crate::io::header::excerpt;
use crate::io::samples::{ByteOrder, SampleType};

/// What an array holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Bytes of 0 and 1.
    Bool,
    /// Floats of 16 bits.
    Half,
    /// Numbers that a volume holds as they are.
    Number(SampleType),
}

/// A header, parsed.
#[derive(Debug)]
pub struct Header {
    /// What the array holds.
    pub kind: Kind,
    /// In which byte order.
    pub order: ByteOrder,
    /// Whether the first index runs fastest.
    pub fortran: bool,
    /// Offset of the data.
    pub end: usize,
    shape: Vec<u64>,
}

impl Header {
    /// Voxels along x, y, z: the shape reversed.
    pub fn sizes(&self) -> Result<[u64; 3], Fault> {
        match *self.shape.as_slice() {
            [z, y, x] => Ok([x, y, z]),
            [y, x] => Ok([x, y, 1]),
            _ => Err(Fault::whole(format!(
                "an array of {} axes, but 3 (z, y, x) or 2 (y, x) are read",
                self.shape.len()
            ))),
        }
    }
}

/// Parses magic, version, length and dictionary.
pub fn parse(bytes: &[u8]) -> Result<Header, Fault> {
    let short = || Fault::byte(bytes.len(), "the file ends within its header");
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(Fault::byte(0, "does not begin with \\x93NUMPY"));
    }
    let [major, minor] = *bytes[6..].first_chunk::<2>().ok_or_else(short)?;
    let (start, length) = match major {
        1 => {
            let length = bytes[8..].first_chunk::<2>().ok_or_else(short)?;
            (10, usize::from(u16::from_le_bytes(*length)))
        }
        2 | 3 => {
            let length = bytes[8..].first_chunk::<4>().ok_or_else(short)?;
            (12, u32::from_le_bytes(*length) as usize)
        }
        _ => {
            return Err(Fault::byte(
                6,
                format!("is of version {major}.{minor}, but versions 1 to 3 are read"),
            ));
        }
    };
    let end = start + length;
    let Some(text) = bytes.get(start..end) else {
        return Err(Fault::byte(
            8,
            format!(
                "states a header of {length} bytes, but {} follow",
                bytes.len() - start
            ),
        ));
    };
    let text = String::from_utf8_lossy(text);
    let mut parser = Parser {
        rest: &text,
        start,
        whole: text.len(),
    };
    let (kind, order, fortran, shape) = parser.dictionary()?;
    Ok(Header {
        kind,
        order,
        fortran,
        end,
        shape,
    })
}

/// Reads the few forms of Python literals that a header is made of.
struct Parser<'a> {
    rest: &'a str,
    start: usize,
    whole: usize,
}

type Entries = (Kind, ByteOrder, bool, Vec<u64>);

impl<'a> Parser<'a> {
    fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::byte(self.start + self.whole - self.rest.len(), problem)
    }

    fn skip_space(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn eat(&mut self, token: &str) -> bool {
        self.skip_space();
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn need(&mut self, token: &str) -> Result<(), Fault> {
        if self.eat(token) {
            return Ok(());
        }
        let found = self.rest.split_whitespace().next().unwrap_or("its end");
        Err(self.fault(format!(
            "the header has {:?} where {token:?} is needed",
            excerpt(found)
        )))
    }

    fn text(&mut self) -> Result<&'a str, Fault> {
        let quote = if self.eat("'") {
            '\''
        } else {
            self.need("\"")?;
            '"'
        };
        let Some((text, rest)) = self.rest.split_once(quote) else {
            return Err(self.fault("the header has a text without an end"));
        };
        self.rest = rest;
        Ok(text)
    }

    fn dictionary(&mut self) -> Result<Entries, Fault> {
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        self.need("{")?;
        while !self.eat("}") {
            let key = self.text()?;
            self.need(":")?;
            match key {
                "descr" => descr = Some(self.kind()?),
                "fortran_order" if self.eat("True") => fortran = Some(true),
                "fortran_order" => {
                    self.need("False")?;
                    fortran = Some(false);
                }
                "shape" => shape = Some(self.tuple()?),
                other => {
                    return Err(
                        self.fault(format!("the header has the entry {:?}", excerpt(other)))
                    );
                }
            }
            if !self.eat(",") {
                self.need("}")?;
                break;
            }
        }
        match (descr, fortran, shape) {
            (Some((kind, order)), Some(fortran), Some(shape)) => Ok((kind, order, fortran, shape)),
            _ => Err(self.fault("the header lacks one of descr, fortran_order and shape")),
        }
    }

    fn tuple(&mut self) -> Result<Vec<u64>, Fault> {
        let mut values = Vec::new();
        self.need("(")?;
        while !self.eat(")") {
            self.skip_space();
            let digits = self.rest.bytes().take_while(u8::is_ascii_digit).count();
            let (number, rest) = self.rest.split_at(digits);
            let value = number.parse().map_err(|_| {
                let found = self.rest.split([',', ')']).next().unwrap_or_default();
                self.fault(format!("the shape has {:?} for a size", excerpt(found)))
            })?;
            values.push(value);
            // Python 2 wrote long integers with an L.
            self.rest = rest.strip_prefix('L').unwrap_or(rest);
            if !self.eat(",") {
                self.need(")")?;
                break;
            }
        }
        Ok(values)
    }

    fn kind(&mut self) -> Result<(Kind, ByteOrder), Fault> {
        self.skip_space();
        if self.rest.starts_with('[') {
            return Err(
                self.fault("the array holds records of several fields, but numbers are read")
            );
        }
        let text = self.text()?;
        let (order, name) = match text.split_at_checked(1) {
            Some(("<" | "|", name)) => (ByteOrder::Little, name),
            Some((">", name)) => (ByteOrder::Big, name),
            Some(("=", name)) if cfg!(target_endian = "big") => (ByteOrder::Big, name),
            Some(("=", name)) => (ByteOrder::Little, name),
            _ => (ByteOrder::Little, text),
        };
        let kind = match name {
            "b1" | "?" => Kind::Bool,
            "f2" => Kind::Half,
            "u1" => Kind::Number(SampleType::U8),
            "i1" => Kind::Number(SampleType::I8),
            "u2" => Kind::Number(SampleType::U16),
            "i2" => Kind::Number(SampleType::I16),
            "u4" => Kind::Number(SampleType::U32),
            "i4" => Kind::Number(SampleType::I32),
            "u8" => Kind::Number(SampleType::U64),
            "i8" => Kind::Number(SampleType::I64),
            "f4" => Kind::Number(SampleType::F32),
            "f8" => Kind::Number(SampleType::F64),
            _ => {
                return Err(self.fault(format!(
                    "the array holds {:?}, but bool, integers and floats of up to 64 bits are read",
                    excerpt(text)
                )));
            }
        };
        Ok((kind, order))
    }
}
