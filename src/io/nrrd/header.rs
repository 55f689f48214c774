//! The fields of a NRRD header.

use crate::error::Fault;
use crate::io::header::{Field, Lines, excerpt};
use crate::io::samples::{ByteOrder, SampleType};
use std::collections::BTreeMap;

/// How the samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// As in memory.
    Raw,
    /// Raw, packed with gzip.
    Gzip,
    /// Decimal numbers.
    Text,
}

/// A header, parsed into fields.
#[derive(Debug)]
pub struct Header {
    fields: BTreeMap<String, Field>,
    /// Offset of the first byte after the header.
    pub end: usize,
}

impl Header {
    /// Splits the header into fields; key/value pairs (`:=`) and comments are passed over.
    pub fn parse(bytes: &[u8]) -> Result<Header, Fault> {
        let mut lines = Lines::new(bytes);
        let (_, magic) = lines.next().unwrap_or_default();
        if !matches!(
            magic.as_bytes(),
            [b'N', b'R', b'R', b'D', b'0', b'0', b'0', b'1'..=b'5']
        ) {
            return Err(Fault::line(
                1,
                format!(
                    "begins with {:?}, but NRRD0001 to NRRD0005 are read",
                    excerpt(&magic)
                ),
            ));
        }
        let mut fields = BTreeMap::new();
        for (line, text) in &mut lines {
            if text.is_empty() {
                break;
            }
            if text.starts_with('#') {
                continue;
            }
            let Some((name, value)) = text.split_once(':') else {
                return Err(Fault::line(
                    line,
                    format!("{:?} is neither a field nor a comment", excerpt(&text)),
                ));
            };
            if value.starts_with('=') {
                continue;
            }
            let field = Field {
                name: name.trim().to_owned(),
                text: value.trim().to_owned(),
                line,
            };
            if let Some(first) = fields.insert(plain(name), field) {
                return Err(Fault::line(
                    line,
                    format!(
                        "{:?} stands twice, first in line {}",
                        first.name, first.line
                    ),
                ));
            }
        }
        Ok(Header {
            fields,
            end: lines.offset(),
        })
    }

    /// A field by its name without spaces.
    pub fn get(&self, name: &str) -> Option<&Field> {
        self.fields.get(name)
    }

    fn need(&self, name: &str) -> Result<&Field, Fault> {
        self.get(name)
            .ok_or_else(|| Fault::whole(format!("the header has no field {name:?}")))
    }

    /// Sizes of all axes, the fastest first.
    pub fn sizes(&self) -> Result<Vec<u64>, Fault> {
        let dimension = self.need("dimension")?;
        let count: usize = dimension.one("a number of axes")?;
        if !(2..=4).contains(&count) {
            return Err(dimension.fault(format!(
                "{count} axes, but grids of 2 or 3 (or 4, the first of size 1) are read"
            )));
        }
        self.need("sizes")?.list(count, "a size")
    }

    /// Type of the samples.
    pub fn sample_type(&self) -> Result<SampleType, Fault> {
        let field = self.need("type")?;
        let name = field.text.split_whitespace().collect::<Vec<_>>().join(" ");
        Ok(match name.as_str() {
            "signed char" | "int8" | "int8_t" => SampleType::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => SampleType::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                SampleType::I16
            }
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
                SampleType::U16
            }
            "int" | "signed int" | "int32" | "int32_t" => SampleType::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => SampleType::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => SampleType::I64,
            "ulonglong"
            | "unsigned long long"
            | "unsigned long long int"
            | "uint64"
            | "uint64_t" => SampleType::U64,
            "float" => SampleType::F32,
            "double" => SampleType::F64,
            other => {
                return Err(field.fault(format!(
                    "{:?} is not one of the integer and float types",
                    excerpt(other)
                )));
            }
        })
    }

    /// How the samples are stored.
    pub fn encoding(&self) -> Result<Encoding, Fault> {
        let field = self.need("encoding")?;
        match field.text.to_ascii_lowercase().as_str() {
            "raw" => Ok(Encoding::Raw),
            "gzip" | "gz" => Ok(Encoding::Gzip),
            "text" | "txt" | "ascii" => Ok(Encoding::Text),
            "hex" | "bzip2" | "bz2" => Err(field
                .fault(format!("{} is not read", field.text))
                .with_hint("store it with the encoding raw, gzip or text")),
            other => Err(field.fault(format!("{:?} is not an encoding", excerpt(other)))),
        }
    }

    /// Byte order; it must be stated where it matters.
    pub fn byte_order(&self, sample: SampleType) -> Result<ByteOrder, Fault> {
        match self.get("endian") {
            Some(field) => match field.text.to_ascii_lowercase().as_str() {
                "little" => Ok(ByteOrder::Little),
                "big" => Ok(ByteOrder::Big),
                other => {
                    Err(field.fault(format!("{:?} is neither little nor big", excerpt(other))))
                }
            },
            None if sample.bytes() == 1 || self.encoding()? == Encoding::Text => {
                Ok(ByteOrder::Little)
            }
            None => Err(Fault::whole(format!(
                "the header has no field \"endian\", but its samples have {} bytes",
                sample.bytes()
            ))),
        }
    }

    /// The value of `lineskip` or `byteskip`: 0 where there is none; only bytes may be -1.
    pub fn skip(&self, name: &str) -> Result<i64, Fault> {
        let Some(field) = self.get(name) else {
            return Ok(0);
        };
        let value: i64 = field.one("a number to skip")?;
        if value < if name == "byteskip" { -1 } else { 0 } {
            return Err(field.fault(format!("{value} cannot be skipped")));
        }
        Ok(value)
    }

    /// The name of the one data file, where the data is not in this file.
    pub fn data_file(&self) -> Result<Option<&str>, Fault> {
        let Some(field) = self.get("datafile") else {
            return Ok(None);
        };
        let list = field.text == "LIST" || field.text.starts_with("LIST ");
        if list || field.text.contains('%') {
            return Err(field
                .fault(format!(
                    "{:?} stands for several files, but data in one file is read",
                    excerpt(&field.text)
                ))
                .with_hint("store the slices in one file"));
        }
        Ok(Some(&field.text))
    }
}

/// A field name as it is looked up: lower case, without spaces (`data file` is `datafile`), and one
/// of each pair of aliases.
fn plain(name: &str) -> String {
    let name: String = name
        .chars()
        .filter(|c| !c.is_whitespace())
        .map(|c| c.to_ascii_lowercase())
        .collect();
    if name == "centerings" {
        return "centers".to_owned();
    }
    name
}
