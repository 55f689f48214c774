//! The file a stream stands in: a magic word, a version, and sections that check themselves.
//!
//! | bytes | what |
//! |---|---|
//! | 5 | `SANIM` |
//! | 1 | version: 1 |
//! | | sections, each of |
//! | 1 | kind: see [`Kind`] |
//! | 1 to 5 | length of its payload, 7 bits a byte, the lowest first, the eighth set but in the last |
//! | 1 | CRC-8 (polynomial 0x07) of kind and length |
//! | | payload |
//! | 4 | CRC-32 of the payload, lowest byte first |
//!
//! The last section is an empty one of the kind `end`; a stream without it was cut off, and what
//! stands before the cut is whole. Multi-byte numbers in payloads have their lowest byte first.

use crate::error::Fault;
use flate2::Crc;
use std::ops::Range;

/// What every stream begins with.
pub const MAGIC: &[u8] = b"SANIM";
/// The version that is written; the readers read all up to it.
pub const VERSION: u8 = 1;

/// What a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The last one.
    End,
    /// Counts, times and the method.
    Header,
    /// The faces.
    Faces,
    /// The beginning of a window of frames: what its parts share.
    Window,
    /// A part of a window; each makes what came before better or longer.
    Part,
    /// What keeps every vertex of a window within a bound.
    Corrections,
}

impl Kind {
    const ALL: [Kind; 6] = [
        Kind::End,
        Kind::Header,
        Kind::Faces,
        Kind::Window,
        Kind::Part,
        Kind::Corrections,
    ];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::End => "end",
            Kind::Header => "header",
            Kind::Faces => "faces",
            Kind::Window => "window",
            Kind::Part => "part",
            Kind::Corrections => "corrections",
        }
    }
}

/// A section of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Section<'a> {
    /// What it holds.
    pub kind: Kind,
    /// What it holds, as bytes.
    pub payload: &'a [u8],
    /// Bytes it takes in the stream, from its kind to its checksum.
    pub whole: usize,
}

/// The sections of a stream, as far as they are whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sections<'a> {
    /// In their order, without the end.
    pub list: Vec<Section<'a>>,
    /// Where the stream breaks off, if it does not end as it should.
    pub cut: Option<usize>,
}

/// CRC-8 of a few bytes.
fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc, _| {
            crc << 1 ^ if crc & 0x80 != 0 { 0x07 } else { 0 }
        })
    })
}

/// CRC-32 of bytes.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// Appends a number, 7 bits a byte.
pub fn push_number(out: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

/// Takes a number of 7 bits a byte from the front; none where the bytes end or it is too long.
pub fn take_number(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0u64;
    for place in 0..10 {
        let (byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7f) << (7 * place);
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}

/// Takes eight bytes of a number from the front.
pub fn take_f64(bytes: &mut &[u8]) -> Option<f64> {
    let (number, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(f64::from_le_bytes(*number))
}

/// A stream that begins.
pub fn begin() -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.push(VERSION);
    out
}

/// Appends a section.
pub fn push(out: &mut Vec<u8>, kind: Kind, payload: &[u8]) {
    let start = out.len();
    out.push(kind as u8);
    push_number(out, payload.len() as u64);
    let check = crc8(&out[start..]);
    out.push(check);
    out.extend_from_slice(payload);
    out.extend_from_slice(&crc32(payload).to_le_bytes());
}

/// Bytes that a section of this payload takes.
pub fn whole(payload: usize) -> usize {
    let mut length = Vec::new();
    push_number(&mut length, payload as u64);
    1 + length.len() + 1 + payload + 4
}

/// The head of a section at `at`: kind and span of the payload; none where the bytes end before.
fn head(bytes: &[u8], at: usize, number: usize) -> Result<Option<(Kind, Range<usize>)>, Fault> {
    let damaged = |problem: String| Err(Fault::byte(at, problem));
    let mut rest = &bytes[at..];
    let Some((kind, after)) = rest.split_first() else {
        return Ok(None);
    };
    rest = after;
    let Some(length) = take_number(&mut rest) else {
        return match rest.is_empty() {
            true => Ok(None),
            false => damaged(format!(
                "section {number}: its length does not end; damaged"
            )),
        };
    };
    let from = bytes.len() - rest.len();
    let Some((check, _)) = rest.split_first() else {
        return Ok(None);
    };
    if crc8(&bytes[at..from]) != *check {
        return damaged(format!(
            "section {number}: the checksum of its head is wrong; damaged"
        ));
    }
    let Some(kind) = Kind::ALL.get(usize::from(*kind)) else {
        return damaged(format!(
            "section {number} is of kind {kind}, which version {VERSION} does not know"
        ));
    };
    let from = from + 1;
    let to = usize::try_from(length)
        .ok()
        .and_then(|length| from.checked_add(length));
    Ok(to.map(|to| (*kind, from..to)))
}

/// The sections of a stream.
///
/// A stream that breaks off is no fault: what is whole before is given. Errs with the byte and the
/// section where a checksum is wrong, and where the version is a later one. Cost: one pass.
pub fn parse(bytes: &[u8]) -> Result<Sections<'_>, Fault> {
    if !bytes.starts_with(MAGIC) {
        return Err(Fault::byte(
            0,
            "is no stream of an animation: it does not begin with SANIM",
        ));
    }
    match bytes.get(MAGIC.len()) {
        Some(version) if (1..=VERSION).contains(version) => {}
        Some(version) => {
            let problem = format!("is of version {version}; those up to {VERSION} are known");
            return Err(Fault::byte(MAGIC.len(), problem));
        }
        None => return Err(Fault::byte(MAGIC.len(), "ends before its version")),
    }
    let mut list = Vec::new();
    let mut at = MAGIC.len() + 1;
    loop {
        let number = list.len();
        let cut = Some(at);
        let Some((kind, span)) = head(bytes, at, number)? else {
            return Ok(Sections { list, cut });
        };
        let Some((payload, stated)) = bytes
            .get(span.clone())
            .zip(bytes.get(span.end..).and_then(|rest| rest.first_chunk()))
        else {
            return Ok(Sections { list, cut });
        };
        let (found, stated) = (crc32(payload), u32::from_le_bytes(*stated));
        if found != stated {
            return Err(Fault::byte(
                at,
                format!(
                    "section {number} ({}, {} bytes): its checksum is {found:08x}, but {stated:08x} is stated; damaged",
                    kind.name(),
                    payload.len()
                ),
            ));
        }
        let end = span.end + 4;
        if kind == Kind::End {
            if end < bytes.len() {
                let problem = format!("{} bytes follow the end of the stream", bytes.len() - end);
                return Err(Fault::byte(end, problem));
            }
            return Ok(Sections { list, cut: None });
        }
        list.push(Section {
            kind,
            payload,
            whole: end - at,
        });
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream() -> Vec<u8> {
        let mut out = begin();
        push(&mut out, Kind::Header, b"head");
        push(&mut out, Kind::Part, &[7; 300]);
        push(&mut out, Kind::End, &[]);
        out
    }

    #[test]
    fn sections_come_back() {
        let bytes = stream();
        let sections = parse(&bytes).unwrap();
        assert_eq!(sections.cut, None);
        assert_eq!(sections.list.len(), 2);
        assert_eq!(sections.list[0].payload, b"head");
        assert_eq!(sections.list[1].payload, &[7; 300]);
        assert_eq!(sections.list[1].whole, whole(300));
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let bytes = stream();
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut damaged = bytes.clone();
                damaged[at] ^= 1 << bit;
                assert!(parse(&damaged).is_err(), "byte {at} bit {bit}");
            }
        }
    }

    #[test]
    fn a_cut_keeps_what_is_whole() {
        let bytes = stream();
        for length in 6..bytes.len() {
            let sections = parse(&bytes[..length]).unwrap();
            assert!(sections.cut.is_some(), "{length}");
            let whole: usize = sections.list.iter().map(|s| s.whole).sum();
            assert!(6 + whole <= length);
            assert_eq!(sections.cut, Some(6 + whole));
        }
    }

    #[test]
    fn numbers_come_back() {
        for number in [0, 1, 127, 128, 300, u64::from(u32::MAX), u64::MAX] {
            let mut out = Vec::new();
            push_number(&mut out, number);
            assert_eq!(take_number(&mut out.as_slice()), Some(number));
        }
        assert_eq!(take_number(&mut [0xff; 20].as_slice()), None);
    }
}
