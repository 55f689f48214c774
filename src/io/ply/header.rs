//! The header: which elements there are, of which properties, in which encoding.

use crate::error::Fault;
use crate::io::text::{shown, words};

/// How values are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &[u8]) -> Option<Scalar> {
        Some(match word {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// Bytes of a binary value.
    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// Whether values are whole numbers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

/// One number, or a count and that many numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

/// A column of an element.
#[derive(Debug, Clone)]
pub struct Property {
    pub name: String,
    pub shape: Shape,
}

/// A table of rows with the same properties.
#[derive(Debug, Clone)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
    /// The line that announces it.
    pub line: u64,
}

impl Element {
    /// Bytes of a binary row, when it has no lists.
    pub fn stride(&self) -> Option<usize> {
        self.properties
            .iter()
            .try_fold(0usize, |sum, p| match p.shape {
                Shape::Scalar(scalar) => sum.checked_add(scalar.size()),
                Shape::List { .. } => None,
            })
    }

    /// What several rows are called.
    pub fn plural(&self) -> String {
        match self.name.as_str() {
            "vertex" => "vertices".into(),
            "face" | "edge" | "point" => format!("{}s", self.name),
            _ => format!("rows of {}", shown(self.name.as_bytes())),
        }
    }

    /// The property of a name, and where it stands.
    pub fn property(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name)
    }
}

/// What the header says.
#[derive(Debug, Clone)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the values begin.
    pub data: usize,
    /// Lines up to and with `end_header`.
    pub lines: u64,
    /// What stands after `comment`.
    pub comments: Vec<String>,
}

impl Header {
    /// Reads a header. Lines end as the first does: with LF, CRLF or CR alone.
    pub fn parse(bytes: &[u8]) -> Result<Header, Fault> {
        let end = match bytes.iter().position(|b| matches!(b, b'\n' | b'\r')) {
            Some(at) if bytes[at] == b'\r' && bytes.get(at + 1) != Some(&b'\n') => b'\r',
            _ => b'\n',
        };
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut comments = Vec::new();
        let (mut at, mut line) = (0, 0);
        loop {
            let Some(length) = bytes[at..].iter().position(|b| *b == end) else {
                return Err(Fault::line(
                    line + 1,
                    "the file ends within the header, before end_header",
                ));
            };
            let text = &bytes[at..at + length];
            at += length + 1;
            line += 1;
            let mut words = words(text);
            let keyword = words.next().unwrap_or_default();
            let rest: Vec<&[u8]> = match keyword {
                b"comment" => {
                    let comment = text.trim_ascii_start().strip_prefix(keyword);
                    let comment = comment.unwrap_or_default().trim_ascii();
                    comments.push(String::from_utf8_lossy(comment).into_owned());
                    continue;
                }
                b"obj_info" => continue,
                _ => words.by_ref().take(6).collect(),
            };
            match (keyword, line) {
                (b"ply", 1) => {}
                (_, 1) => {
                    return Err(Fault::line(
                        1,
                        format!("expected ply, found {}", shown(keyword)),
                    ));
                }
                (b"end_header", _) => break,
                (b"format", _) => encoding = Some(parse_format(&rest, line)?),
                (b"element", _) => elements.push(parse_element(&rest, line, &elements)?),
                (b"property", _) => {
                    let element = elements.last_mut().ok_or_else(|| {
                        Fault::line(line, "a property stands before the first element")
                    })?;
                    let property = parse_property(&rest, line)?;
                    if element.property(&property.name).is_some() {
                        return Err(Fault::line(
                            line,
                            format!(
                                "element {} has the property {} twice",
                                shown(element.name.as_bytes()),
                                shown(property.name.as_bytes())
                            ),
                        ));
                    }
                    element.properties.push(property);
                }
                (b"", _) => {}
                _ => {
                    return Err(Fault::line(
                        line,
                        format!("{} is no keyword of a PLY header", shown(keyword)),
                    ));
                }
            }
        }
        Ok(Header {
            encoding: encoding.ok_or_else(|| Fault::line(line, "the header names no format"))?,
            elements,
            data: at,
            lines: line,
            comments,
        })
    }
}

fn parse_format(words: &[&[u8]], line: u64) -> Result<Encoding, Fault> {
    let encoding = match words.first().copied().unwrap_or_default() {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::Little,
        b"binary_big_endian" => Encoding::Big,
        word => {
            return Err(Fault::line(line, format!("{} is no format", shown(word)))
                .with_hint("ascii, binary_little_endian and binary_big_endian are"));
        }
    };
    match words.get(1).copied() {
        Some(b"1.0") => Ok(encoding),
        version => Err(Fault::line(
            line,
            format!(
                "version {} is not read, only 1.0",
                shown(version.unwrap_or_default())
            ),
        )),
    }
}

fn parse_element(words: &[&[u8]], line: u64, before: &[Element]) -> Result<Element, Fault> {
    let &[name, count] = words else {
        return Err(Fault::line(line, "an element needs a name and a count"));
    };
    let name = String::from_utf8_lossy(name).into_owned();
    if before.iter().any(|e| e.name == name) {
        return Err(Fault::line(
            line,
            format!("element {} is announced twice", shown(name.as_bytes())),
        ));
    }
    let count = std::str::from_utf8(count)
        .ok()
        .and_then(|text| text.parse().ok())
        .ok_or_else(|| {
            Fault::line(
                line,
                format!(
                    "{} is no count of rows for element {}",
                    shown(count),
                    shown(name.as_bytes())
                ),
            )
        })?;
    Ok(Element {
        name,
        count,
        properties: Vec::new(),
        line,
    })
}

fn parse_property(words: &[&[u8]], line: u64) -> Result<Property, Fault> {
    let scalar = |word: &[u8]| {
        Scalar::parse(word).ok_or_else(|| {
            Fault::line(line, format!("{} is no type", shown(word))).with_hint(
                "types are char, uchar, short, ushort, int, uint, float, double, or int8 to float64",
            )
        })
    };
    let (name, shape) = match words {
        [b"list", count, item, name] => {
            let (count, item) = (scalar(count)?, scalar(item)?);
            if !count.is_integer() {
                return Err(Fault::line(
                    line,
                    "a list is counted by a type that is not whole",
                ));
            }
            (name, Shape::List { count, item })
        }
        [word, name] if *word != b"list" => (name, Shape::Scalar(scalar(word)?)),
        _ => {
            return Err(Fault::line(
                line,
                "a property needs a type and a name, or: list, two types and a name",
            ));
        }
    };
    Ok(Property {
        name: String::from_utf8_lossy(name).into_owned(),
        shape,
    })
}
