//! PDB, the format of fixed columns.
//!
//! Read are `ATOM`, `HETATM`, `MODEL`, `ENDMDL`, `TER`, `END`, the entry's name of `HEADER`, and which
//! residues `MODRES` places in a chain; no bonds, no symmetry, no temperature tensors. Lines may end
//! after the coordinates. Numbers that need more columns than there are may be hybrid-36,
//! or go over into the blank column beside theirs. Source: wwPDB, Protein Data
//! Bank Contents Guide 3.3, 2012.

#[cfg(test)]
mod tests;
mod write;

pub use write::{refusal, rounded, write};

use super::gather::{BLANK, Gathered, name, single};
use super::hybrid36;
use super::refusal::Refusal;
use super::text::{Lines, number, shown, words};
use crate::error::Fault;
use crate::io::source::Source;
use crate::protein::builder::Place;
use crate::protein::{Atom, Element, Molecule, Name};
use crate::report::{Tally, Warning};
use std::collections::BTreeSet;

/// Bytes of a line with its end, as most files have them.
const ROW: usize = 81;

/// Reads atoms, residues and models, in the order of the file.
///
/// Atoms without a model are of model 1. `ENDMDL` and `END` end a model: atoms that follow without a
/// `MODEL` are of the next number. An atom whose serial number is blank or stars counts on from the one
/// before; an occupancy that is missing is 1; an element that is missing is told by the name
/// ([`Element::of_columns`]).
///
/// # Errors
///
/// With the line: columns that hold no number or none that is finite, a line that ends before its
/// coordinates do; and atoms that take more than the source may hold.
///
/// # Cost
///
/// Linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Molecule, Refusal> {
    let bytes = source.bytes();
    let mut reader = Reader::new(Gathered::new(bytes.len(), ROW, source.limit()));
    let mut lines = Lines::new(bytes);
    while let Some(line) = lines.next() {
        let number = lines.number();
        match line {
            [b'A', b'T', b'O', b'M', b' ' | b'0'..=b'9', ..] => reader.atom(line, number, false)?,
            [b'H', b'E', b'T', b'A', b'T', b'M', ..] => reader.atom(line, number, true)?,
            _ => reader.other(line, number)?,
        }
    }
    reader.notes.warn(warnings);
    Ok(reader.gathered.finish())
}

/// Whether a text begins with records of a PDB file.
pub fn is_document(text: &[u8]) -> bool {
    const RECORDS: [&[u8]; 17] = [
        b"ATOM  ", b"AUTHOR", b"CAVEAT", b"COMPND", b"CRYST1", b"DBREF ", b"EXPDTA", b"HEADER",
        b"HETATM", b"KEYWDS", b"MODEL ", b"OBSLTE", b"REMARK", b"SEQRES", b"SOURCE", b"SPLIT ",
        b"TITLE ",
    ];
    let first = Lines::new(text).find(|line| !line.trim_ascii().is_empty());
    first.is_some_and(|line| RECORDS.iter().any(|record| line.starts_with(record)))
}

/// Columns of a line, counted from 1, both ends included; fewer where the line ends before.
#[inline]
fn columns(line: &[u8], from: usize, to: usize) -> &[u8] {
    line.get(from - 1..to.min(line.len())).unwrap_or_default()
}

/// Where a residue stands, as a record `MODRES` names it.
type Modified = (Name, Name, i32, u8);

struct Reader {
    gathered: Gathered,
    modified: BTreeSet<Modified>,
    /// The columns 18 to 27 of the atom before, and what they say.
    place: ([u8; 10], Place),
    serial: i64,
    has_ended: bool,
    notes: Notes,
}

#[derive(Default)]
struct Notes {
    serials: Tally,
    figures: Tally,
    elements: Tally,
}

impl Notes {
    fn warn(self, warnings: &mut Vec<Warning>) {
        self.serials.warn(
            "lost-serials",
            "serial numbers that are blank or stars; counted on from the atom before",
            warnings,
        );
        self.figures.warn(
            "lost-figures",
            "occupancies or temperature factors that are stars; taken for 1 and 0",
            warnings,
        );
        self.elements.warn(
            "guessed-elements",
            "atoms without an element; told by their names",
            warnings,
        );
    }
}

fn is_lost(word: &[u8]) -> bool {
    !word.is_empty() && word.iter().all(|b| *b == b'*')
}

impl Reader {
    fn new(gathered: Gathered) -> Self {
        Reader {
            gathered,
            modified: BTreeSet::new(),
            // No line has these bytes before its place is read.
            place: ([0; 10], Place::default()),
            serial: 0,
            has_ended: false,
            notes: Notes::default(),
        }
    }

    /// Reads a line that is no atom.
    fn other(&mut self, line: &[u8], number: u64) -> Result<(), Fault> {
        let builder = &mut self.gathered.builder;
        match columns(line, 1, 6).trim_ascii_end() {
            b"TER" => builder.end_residue(),
            b"ENDMDL" | b"END" => self.has_ended = true,
            b"MODEL" => {
                let word = words(columns(line, 7, 80)).next().unwrap_or_default();
                let next = builder.model().map_or(1, |model| model.saturating_add(1));
                let model = if word.is_empty() {
                    next
                } else {
                    whole(word, 9, "model number", number)?
                };
                builder.begin_model(model);
                self.has_ended = false;
            }
            b"HEADER" => {
                let id = String::from_utf8_lossy(columns(line, 63, 66).trim_ascii()).into_owned();
                builder.set_id(id);
            }
            b"MODRES" => self.modified.extend(modified(line)),
            _ => {}
        }
        Ok(())
    }

    fn atom(&mut self, line: &[u8], number: u64, hetero: bool) -> Result<(), Refusal> {
        if line.len() < 47 {
            let length = line.len();
            let problem =
                format!("ends at column {length}, but coordinates stand in columns 31 to 54");
            return Err(Fault::line(number, problem).into());
        }
        let position = [
            coordinate(line, 31, "x", number)?,
            coordinate(line, 39, "y", number)?,
            coordinate(line, 47, "z", number)?,
        ];
        self.serial = self.read_serial(line, hetero, number)?;
        let place = self.read_place(line, number)?;
        let atom = Atom {
            position,
            serial: self.serial,
            name: name(columns(line, 13, 16), "atom name", number)?,
            occupancy: self.figure(columns(line, 55, 60), 1.0, "occupancy", number)?,
            b_factor: self.figure(columns(line, 61, 66), 0.0, "temperature factor", number)?,
            element: self.read_element(line, &place, number),
            altloc: letter(line[16], "alternative", number)?,
            hetero,
            ..BLANK
        };
        if self.has_ended {
            let last = self.gathered.builder.model().unwrap_or(0);
            self.gathered.builder.begin_model(last.saturating_add(1));
            self.has_ended = false;
        }
        self.gathered.push(&place, atom)
    }

    /// Columns 7 to 11, and where the number is longer, what stands beside them.
    #[inline]
    fn read_serial(&mut self, line: &[u8], hetero: bool, number: u64) -> Result<i64, Fault> {
        let from = if hetero { 7 } else { 5 };
        let to = if line[11].is_ascii_digit() { 12 } else { 11 };
        let word = columns(line, from, to).trim_ascii();
        if word.is_empty() || is_lost(word) {
            self.notes.serials.note(number);
            return Ok(self.serial.saturating_add(1));
        }
        hybrid36::read(word, 5).ok_or_else(|| {
            Fault::line(number, format!("the serial number {} is none", shown(word)))
        })
    }

    /// Columns 18 to 27: most atoms say the same there as the one before.
    #[inline]
    fn read_place(&mut self, line: &[u8], number: u64) -> Result<Place, Fault> {
        let found: [u8; 10] = line[17..27].try_into().expect("ten columns");
        if self.place.0 == found {
            return Ok(self.place.1);
        }
        // A fifth digit goes over into the column of the insertion code.
        let longer = line[26].is_ascii_digit();
        let word = columns(line, 23, if longer { 27 } else { 26 }).trim_ascii();
        let mut place = Place {
            name: name(columns(line, 18, 21), "residue name", number)?,
            chain: name(columns(line, 22, 22), "chain", number)?,
            number: whole(word, if longer { 5 } else { 4 }, "residue number", number)?,
            insertion: if longer {
                b' '
            } else {
                letter(line[26], "insertion code", number)?
            },
            in_polymer: false,
        };
        let key = (place.name, place.chain, place.number, place.insertion);
        place.in_polymer = self.modified.contains(&key);
        self.place = (found, place);
        Ok(place)
    }

    /// The symbol of columns 77 and 78, else what the name tells.
    #[inline]
    fn read_element(&mut self, line: &[u8], place: &Place, number: u64) -> Element {
        let symbol = columns(line, 77, 78).trim_ascii();
        Element::from_symbol(symbol).unwrap_or_else(|| {
            self.notes.elements.note(number);
            Element::of_columns(&line[12..16], place.name.as_bytes())
        })
    }

    #[inline]
    fn figure(&mut self, word: &[u8], missing: f32, what: &str, line: u64) -> Result<f32, Fault> {
        let word = word.trim_ascii();
        if word.is_empty() {
            return Ok(missing);
        }
        if is_lost(word) {
            self.notes.figures.note(line);
            return Ok(missing);
        }
        single(word, what, line)
    }
}

/// What a record `MODRES` names; one that is not sound names nothing.
fn modified(line: &[u8]) -> Option<Modified> {
    let number = hybrid36::read(columns(line, 19, 22).trim_ascii(), 4)?;
    Some((
        Name::new(columns(line, 13, 15))?,
        Name::new(columns(line, 17, 17))?,
        i32::try_from(number).ok()?,
        columns(line, 23, 23).first().copied().unwrap_or(b' '),
    ))
}

/// Eight columns from `from` on.
#[inline]
fn coordinate(line: &[u8], from: usize, axis: &str, at: u64) -> Result<f64, Fault> {
    let word = columns(line, from, from + 7).trim_ascii();
    let wrong = |why: &str| {
        let to = from + 7;
        Fault::line(
            at,
            format!("{axis} in columns {from} to {to} is {}, {why}", shown(word)),
        )
    };
    match number(word) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(wrong("which is not finite")),
        None => Err(wrong("which is no number")),
    }
}

/// A whole number that fits 32 bits.
fn whole(word: &[u8], width: u32, what: &str, line: u64) -> Result<i32, Fault> {
    let value = hybrid36::read(word, width).and_then(|value| i32::try_from(value).ok());
    value.ok_or_else(|| Fault::line(line, format!("the {what} {} is none", shown(word))))
}

/// A printable character.
#[inline]
fn letter(byte: u8, what: &str, line: u64) -> Result<u8, Fault> {
    if (b' '..=b'~').contains(&byte) {
        Ok(byte)
    } else {
        let problem = format!("the {what} {} is no printable character", shown(&[byte]));
        Err(Fault::line(line, problem))
    }
}
