//! Rows of the category `_atom_site`.

use crate::error::Fault;
use crate::io::gather::{BLANK, Gathered, name, single};
use crate::io::refusal::Refusal;
use crate::io::text::{finite, integer, shown};
use crate::protein::builder::Place;
use crate::protein::{Atom, Element, Molecule};
use crate::report::{Tally, Warning};
use std::collections::BTreeSet;

/// What is read of an atom; the position of a name is its place in a [`Row`].
const READ: [&str; 19] = [
    "Cartn_x",
    "Cartn_y",
    "Cartn_z",
    "group_PDB",
    "id",
    "type_symbol",
    "auth_atom_id",
    "label_atom_id",
    "label_alt_id",
    "auth_comp_id",
    "label_comp_id",
    "auth_asym_id",
    "label_asym_id",
    "auth_seq_id",
    "label_seq_id",
    "pdbx_PDB_ins_code",
    "pdbx_PDB_model_num",
    "occupancy",
    "B_iso_or_equiv",
];

const X: usize = 0;
const GROUP: usize = 3;
const ID: usize = 4;
const SYMBOL: usize = 5;
const ATOM: [usize; 2] = [6, 7];
const ALTERNATIVE: usize = 8;
const RESIDUE: [usize; 2] = [9, 10];
const CHAIN: [usize; 2] = [11, 12];
const NUMBER: [usize; 2] = [13, 14];
const IN_SEQUENCE: usize = 14;
const INSERTION: usize = 15;
const MODEL: usize = 16;
const OCCUPANCY: usize = 17;
const FACTOR: usize = 18;

/// The values of an atom that are read, `None` where there are none.
pub type Row<'a> = [Option<&'a [u8]>; READ.len()];

/// Which column of a table stands where in a [`Row`].
#[derive(Debug, Default)]
pub struct Columns(Vec<Option<usize>>);

impl Columns {
    /// Adds the next column, whose name is without its category.
    pub fn push(&mut self, column: &[u8]) {
        let is_it = |known: &str| known.as_bytes().eq_ignore_ascii_case(column);
        self.0.push(READ.iter().position(|known| is_it(known)));
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Errs where coordinates are lacking.
    pub fn check(&self, line: u64) -> Result<(), Fault> {
        let has = |place: usize| self.0.contains(&Some(place));
        match (X..X + 3).find(|place| !has(*place)) {
            Some(place) => {
                let problem = format!("the atoms that begin here have no column {}", READ[place]);
                Err(Fault::line(line, problem))
            }
            None => Ok(()),
        }
    }

    /// Puts the value of a column in its place.
    #[inline]
    pub fn set<'a>(&self, row: &mut Row<'a>, column: usize, value: Option<&'a [u8]>) {
        if let Some(place) = self.0[column] {
            row[place] = value;
        }
    }

    /// A row of these values.
    pub fn row<'a>(&self, values: &[Option<&'a [u8]>]) -> Row<'a> {
        let mut row = Row::default();
        for (column, value) in values.iter().enumerate() {
            self.set(&mut row, column, *value);
        }
        row
    }
}

/// The atoms, as they are read.
pub struct Sites {
    gathered: Gathered,
    models: BTreeSet<i32>,
    serial: i64,
    /// Whether a place in the sequence shows that a residue is of a polymer: some programs give every
    /// atom one, so that it does only where there are atoms without, or polymers are listed.
    trusts_sequence: bool,
    guessed: Tally,
}

impl Sites {
    pub fn new(gathered: Gathered) -> Self {
        Sites {
            gathered,
            models: BTreeSet::new(),
            serial: 0,
            trusts_sequence: false,
            guessed: Tally::default(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.gathered.builder.is_empty()
    }

    pub fn set_id(&mut self, block: &[u8]) {
        let id = String::from_utf8_lossy(block).into_owned();
        self.gathered.builder.set_id(id);
    }

    /// Polymers are listed.
    pub fn trust_sequence(&mut self) {
        self.trusts_sequence = true;
    }

    /// The molecule.
    pub fn finish(self, warnings: &mut Vec<Warning>) -> Molecule {
        self.guessed.warn(
            "guessed-elements",
            "atoms without an element; told by their names",
            warnings,
        );
        let mut molecule = self.gathered.finish();
        if !self.trusts_sequence {
            let residues = molecule.residues.iter_mut();
            residues.for_each(|residue| residue.in_polymer = false);
        }
        molecule
    }

    /// Adds the atom of a row that begins in a line.
    #[inline]
    pub fn push(&mut self, row: &Row, line: u64) -> Result<(), Refusal> {
        let mut position = [0.0; 3];
        for (axis, coordinate) in position.iter_mut().enumerate() {
            let word = row[X + axis].ok_or_else(|| lacks(READ[X + axis], line))?;
            *coordinate = finite(word, line)?;
        }
        self.begin_model(row[MODEL], line)?;
        self.serial = match row[ID] {
            Some(word) => integer(word).ok_or_else(|| {
                Fault::line(line, format!("the id {} is no whole number", shown(word)))
            })?,
            None => self.serial.saturating_add(1),
        };
        let of = |places: [usize; 2]| row[places[0]].or(row[places[1]]).unwrap_or_default();
        let place = Place {
            name: name(of(RESIDUE), "residue name", line)?,
            chain: name(of(CHAIN), "chain", line)?,
            number: whole(of(NUMBER), "residue number", line)?,
            insertion: letter(row[INSERTION], "insertion code", line)?,
            in_polymer: row[IN_SEQUENCE].is_some(),
        };
        self.trusts_sequence |= !place.in_polymer;
        let atom = Atom {
            position,
            serial: self.serial,
            name: name(of(ATOM), "atom name", line)?,
            occupancy: figure(row[OCCUPANCY], 1.0, "occupancy", line)?,
            b_factor: figure(row[FACTOR], 0.0, "temperature factor", line)?,
            altloc: letter(row[ALTERNATIVE], "alternative", line)?,
            hetero: row[GROUP].is_some_and(|group| group.eq_ignore_ascii_case(b"HETATM")),
            element: Element::UNKNOWN,
            ..BLANK
        };
        let element = row[SYMBOL]
            .and_then(Element::from_symbol)
            .unwrap_or_else(|| {
                self.guessed.note(line);
                Element::of_name(atom.name.as_bytes(), place.name.as_bytes())
            });
        // Water that is numbered by nothing: a molecule begins where its first atom comes again.
        let builder = &mut self.gathered.builder;
        if of(NUMBER).is_empty() && builder.first_name_of_residue() == Some(atom.name) {
            builder.end_residue();
        }
        self.gathered.push(&place, Atom { element, ..atom })
    }

    fn begin_model(&mut self, word: Option<&[u8]>, line: u64) -> Result<(), Fault> {
        let number = match word {
            Some(word) => whole(word, "model number", line)?,
            None => 1,
        };
        let builder = &mut self.gathered.builder;
        if builder.model() == Some(number) {
            return Ok(());
        }
        if !self.models.insert(number) {
            let last = builder.model().unwrap_or_default();
            let problem = format!("model {number} goes on after model {last}");
            return Err(Fault::line(line, problem));
        }
        builder.begin_model(number);
        Ok(())
    }
}

fn lacks(column: &str, line: u64) -> Fault {
    Fault::line(line, format!("the atom has no {column}"))
}

/// A whole number that fits 32 bits; 0 where there is none.
#[inline]
fn whole(word: &[u8], what: &str, line: u64) -> Result<i32, Fault> {
    if word.is_empty() {
        return Ok(0);
    }
    let value = integer(word).and_then(|value| i32::try_from(value).ok());
    value.ok_or_else(|| {
        let problem = format!("the {what} {} is no whole number of 32 bits", shown(word));
        Fault::line(line, problem)
    })
}

/// A single character; a blank where there is none.
#[inline]
fn letter(word: Option<&[u8]>, what: &str, line: u64) -> Result<u8, Fault> {
    match word {
        None | Some([]) => Ok(b' '),
        Some([letter @ b' '..=b'~']) => Ok(*letter),
        Some(word) => {
            let problem = format!("the {what} {} is no single character", shown(word));
            Err(Fault::line(line, problem))
        }
    }
}

#[inline]
fn figure(word: Option<&[u8]>, missing: f32, what: &str, line: u64) -> Result<f32, Fault> {
    word.map_or(Ok(missing), |word| single(word, what, line))
}
