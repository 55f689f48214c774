//! Tiled images as if their rows ended with a tile.
//!
//! The decoder crops the tiles at the end of a row, and cannot do so for all that are packed by LZW. So it
//! is shown a width that is a multiple of the tiles' own.

use crate::error::Fault;
use std::io::{self, Cursor, Read, Seek, SeekFrom};

/// Bytes that stand for others in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patch {
    start: usize,
    bytes: [u8; 4],
    count: usize,
}

/// An entry of a directory of tags.
struct Entry {
    tag: u64,
    kind: u64,
    count: u64,
    /// Where its value stands, or where it is said where that stands.
    value: usize,
}

/// A number of some bytes in the byte order of the file.
fn number(file: &[u8], at: usize, count: usize) -> Option<u64> {
    let bytes = file.get(at..at.checked_add(count)?)?;
    let push = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    Some(match file.starts_with(b"II") {
        true => bytes.iter().rev().fold(0, push),
        false => bytes.iter().fold(0, push),
    })
}

fn is_big(file: &[u8]) -> bool {
    number(file, 2, 2) == Some(43)
}

/// The entries of the first directory; those that the file holds.
fn entries(file: &[u8]) -> impl Iterator<Item = Entry> {
    let [head, counted, size, long] = if is_big(file) {
        [8, 8, 20, 8]
    } else {
        [4, 2, 12, 4]
    };
    let start = number(file, head, long).and_then(|at| usize::try_from(at).ok());
    let start = start.unwrap_or(file.len());
    let count = number(file, start, counted).unwrap_or(0);
    (0..count).map_while(move |entry| {
        let at = start.checked_add(counted)?;
        let at = at.checked_add(usize::try_from(entry).ok()?.checked_mul(size)?)?;
        Some(Entry {
            tag: number(file, at, 2)?,
            kind: number(file, at + 2, 2)?,
            count: number(file, at + 4, long)?,
            value: at + 4 + long,
        })
    })
}

/// Errs where a tag of the first directory claims more values than the file holds: the decoder makes room
/// for them before it looks.
pub fn expect_values(file: &[u8]) -> Result<(), Fault> {
    const SIZES: [u64; 19] = [1, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 1, 1, 8, 8, 8];
    let long = if is_big(file) { 8 } else { 4 };
    for entry in entries(file) {
        let size = SIZES.get(entry.kind as usize).copied().unwrap_or(1);
        let bytes = entry.count.saturating_mul(size);
        let is_inside = bytes <= long as u64
            || number(file, entry.value, long)
                .is_some_and(|at| at.saturating_add(bytes) <= file.len() as u64);
        if !is_inside {
            let Entry { tag, count, .. } = entry;
            let length = file.len();
            let problem = format!(
                "tag {tag} has {count} values of {size} bytes, which the file's {length} do not hold"
            );
            return Err(Fault::whole(problem));
        }
    }
    Ok(())
}

/// The patch that makes the first image of a TIFF file this wide, if its width can be found and has room
/// for the number.
pub fn patch(file: &[u8], width: u32) -> Option<Patch> {
    let entry = entries(file).find(|entry| entry.tag == 256)?;
    let count = match entry.kind {
        3 if width <= u32::from(u16::MAX) => 2,
        4 => 4,
        _ => return None,
    };
    let mut bytes = [0; 4];
    match file.starts_with(b"II") {
        true => bytes = width.to_le_bytes(),
        false => bytes[..count].copy_from_slice(&width.to_be_bytes()[4 - count..]),
    }
    Some(Patch {
        start: entry.value,
        bytes,
        count,
    })
}

/// A file with a patch.
#[derive(Debug)]
pub struct Patched<'a> {
    file: Cursor<&'a [u8]>,
    patch: Option<Patch>,
}

impl<'a> Patched<'a> {
    pub fn new(file: &'a [u8], patch: Option<Patch>) -> Self {
        Patched {
            file: Cursor::new(file),
            patch,
        }
    }
}

impl Read for Patched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let from = self.file.position();
        let read = self.file.read(buffer)?;
        if let Some(patch) = &self.patch {
            for (at, byte) in (patch.start as u64..).zip(&patch.bytes[..patch.count]) {
                let within = at.checked_sub(from).filter(|n| *n < read as u64);
                if let Some(within) = within {
                    buffer[within as usize] = *byte;
                }
            }
        }
        Ok(read)
    }
}

impl Seek for Patched<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}
