//! What the readers of molecules share.

use super::refusal::{RAISE, Refusal, expect_room};
use super::text::{number, shown};
use crate::error::Fault;
use crate::protein::builder::{Builder, Place};
use crate::protein::{Atom, Element, Molecule, Name};

/// An atom of which nothing is known but that it is there.
pub const BLANK: Atom = Atom {
    position: [0.0; 3],
    radius: None,
    serial: 0,
    name: Name::EMPTY,
    residue: 0,
    occupancy: 1.0,
    b_factor: 0.0,
    element: Element::UNKNOWN,
    altloc: b' ',
    hetero: false,
};

/// A molecule that is being read, and may take so many bytes.
#[derive(Debug)]
pub struct Gathered {
    pub builder: Builder,
    limit: u64,
}

impl Gathered {
    /// Nothing yet; there is room for as many atoms as a file of `bytes` bytes holds, each of which
    /// takes `row` bytes of it, but not for more than the limit.
    pub fn new(bytes: usize, row: usize, limit: u64) -> Self {
        let mut builder = Builder::default();
        let most = limit / size_of::<Atom>() as u64;
        builder.reserve((bytes / row).min(usize::try_from(most).unwrap_or(usize::MAX)));
        Gathered { builder, limit }
    }

    /// Adds an atom. Errs where all of them would take more than may be held.
    #[inline]
    pub fn push(&mut self, place: &Place, atom: Atom) -> Result<(), Refusal> {
        if let Some(needed) = self.builder.growth() {
            let what = || format!("reading more than {} atoms", self.builder.len());
            expect_room(what, needed, self.limit, RAISE)?;
        }
        self.builder.push(place, atom)?;
        Ok(())
    }

    /// The molecule.
    pub fn finish(self) -> Molecule {
        self.builder.finish()
    }
}

/// A name, or what is wrong with it.
#[inline]
pub fn name(word: &[u8], what: &str, line: u64) -> Result<Name, Fault> {
    Name::new(word).ok_or_else(|| {
        let longest = Name::LONGEST;
        let problem = format!(
            "the {what} {} is longer than {longest} characters, or not all of it is printable ASCII",
            shown(word)
        );
        Fault::line(line, problem)
    })
}

/// A finite number that fits single precision, which the readers of molecules keep some in.
#[inline]
pub fn single(word: &[u8], what: &str, line: u64) -> Result<f32, Fault> {
    match number(word).map(|value| value as f32) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(Fault::line(
            line,
            format!("the {what} {} is not finite", shown(word)),
        )),
        None => Err(Fault::line(
            line,
            format!("the {what} {} is no number", shown(word)),
        )),
    }
}

/// A radius: finite and not negative.
#[inline]
pub fn radius(word: &[u8], line: u64) -> Result<f64, Fault> {
    let wrong = |why: &str| Fault::line(line, format!("the radius {} is {why}", shown(word)));
    match number(word) {
        Some(value) if !value.is_finite() => Err(wrong("not finite")),
        Some(value) if value < 0.0 => Err(wrong("negative")),
        Some(value) => Ok(value),
        None => Err(wrong("no number")),
    }
}
