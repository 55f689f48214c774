//! Atoms in residues and models.

use super::element::Element;
use super::name::Name;
use crate::error::Fault;
use crate::report::Content;
use crate::spatial::aabb::Aabb;
use std::fmt;
use std::ops::Range;

/// Atoms, in the order of the file, with the residues and models that they make.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Molecule {
    /// The entry's name as the file gives it (`1CQW`), else empty.
    pub id: String,
    /// The atoms of all models.
    pub atoms: Vec<Atom>,
    /// Runs of atoms; they follow one another and cover all atoms.
    pub residues: Vec<Residue>,
    /// Runs of atoms, each of whole residues; they follow one another and cover all atoms.
    pub models: Vec<Model>,
}

/// An atom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Atom {
    /// Where its centre is.
    pub position: [f64; 3],
    /// Its radius where the file itself gives one.
    pub radius: Option<f64>,
    /// Its number in the file, which need not be unique.
    pub serial: i64,
    /// Its name: `CA`, `OD1`.
    pub name: Name,
    /// Index of its residue.
    pub residue: u32,
    /// Share of the molecules that have it here, from 0 to 1.
    pub occupancy: f32,
    /// Its temperature factor, in square angstrom.
    pub b_factor: f32,
    /// Its element.
    pub element: Element,
    /// Letter of the alternative place that this is; a blank where there is no other.
    pub altloc: u8,
    /// Whether the file holds it for no part of a standard residue (`HETATM`).
    pub hetero: bool,
}

/// A residue, a ligand, an ion or a molecule of the solvent.
#[derive(Debug, Clone, PartialEq)]
pub struct Residue {
    /// Its name: `HIS`, `HEM`, `HOH`.
    pub name: Name,
    /// Its chain; of mmCIF the author's name of it.
    pub chain: Name,
    /// Its number in the chain, which may be negative; of mmCIF the author's.
    pub number: i32,
    /// Letter that tells residues of one number apart; a blank where there is none.
    pub insertion: u8,
    /// Whether the file itself places it in a polymer: by a record `MODRES`, or by a place in the
    /// sequence. Standard residues need not say so.
    pub in_polymer: bool,
    /// Indices of its atoms; never empty.
    pub atoms: Range<u32>,
}

/// One of several states or frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Its number in the file, which need not be unique.
    pub number: i32,
    /// Indices of its atoms; never empty.
    pub atoms: Range<u32>,
}

impl Residue {
    /// Whether two residues are at one place of one chain, whatever their names.
    pub fn is_at_place_of(&self, other: &Residue) -> bool {
        (self.chain, self.number, self.insertion) == (other.chain, other.number, other.insertion)
    }
}

/// `A:106`, `A:52A`, and `106` in a chain without a name.
impl fmt::Display for Residue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_place(f, self.chain, self.number, self.insertion)
    }
}

pub(super) fn write_place(
    f: &mut fmt::Formatter<'_>,
    chain: Name,
    number: i32,
    insertion: u8,
) -> fmt::Result {
    if !chain.is_empty() {
        write!(f, "{chain}:")?;
    }
    write!(f, "{number}")?;
    if insertion != b' ' {
        write!(f, "{}", char::from(insertion))?;
    }
    Ok(())
}

/// Indices into slices, from those kept in 32 bits.
pub fn indices(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

impl Molecule {
    /// The residue of an atom.
    #[inline]
    pub fn residue_of(&self, atom: &Atom) -> &Residue {
        &self.residues[atom.residue as usize]
    }

    /// The atoms of a residue, a model or any other run.
    pub fn atoms_in(&self, range: &Range<u32>) -> &[Atom] {
        &self.atoms[indices(range)]
    }

    /// Indices of the residues of a model, which is an index too; empty where there is no such model.
    pub fn residues_in(&self, model: usize) -> Range<usize> {
        let Some(model) = self.models.get(model) else {
            return 0..0;
        };
        let of = |atom: u32| self.atoms[atom as usize].residue as usize;
        of(model.atoms.start)..of(model.atoms.end - 1) + 1
    }

    /// The box around all centres.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.atoms.iter().map(|atom| &atom.position))
    }

    /// What every reader promises: finite places and figures, radii that are not negative, residues
    /// and models that follow one another.
    ///
    /// Errs with the first atom, residue or model of which that is not so. Cost: linear.
    pub fn check(&self) -> Result<(), Fault> {
        if self.atoms.is_empty() {
            return Err(Fault::whole("holds no atoms"));
        }
        for (index, atom) in self.atoms.iter().enumerate() {
            atom.check()
                .map_err(|problem| Fault::element("atom", index, problem))?;
        }
        let residues = self.residues.iter().map(|residue| &residue.atoms);
        self.check_runs("residue", residues)?;
        let models = self.models.iter().map(|model| &model.atoms);
        self.check_runs("model", models)?;
        for (index, residue) in self.residues.iter().enumerate() {
            let own = |atom: &Atom| atom.residue as usize == index;
            if !self.atoms_in(&residue.atoms).iter().all(own) {
                let problem = "has atoms that name another residue";
                return Err(Fault::element("residue", index, problem));
            }
        }
        for (index, model) in self.models.iter().enumerate().skip(1) {
            let first = &self.residues[self.atoms[model.atoms.start as usize].residue as usize];
            if first.atoms.start != model.atoms.start {
                let problem = format!("begins within residue {first}");
                return Err(Fault::element("model", index, problem));
            }
        }
        Ok(())
    }

    /// Errs unless runs of atoms follow one another, none is empty, and they cover all atoms.
    fn check_runs<'a>(
        &self,
        kind: &'static str,
        runs: impl Iterator<Item = &'a Range<u32>>,
    ) -> Result<(), Fault> {
        let mut end = 0;
        for (index, run) in runs.enumerate() {
            if run.start != end || run.end <= run.start {
                let problem = format!(
                    "has the atoms {} to {}, but begins after {end} others",
                    run.start, run.end
                );
                return Err(Fault::element(kind, index, problem));
            }
            end = run.end;
        }
        if end as usize != self.atoms.len() {
            let atoms = self.atoms.len();
            return Err(Fault::whole(format!(
                "has {atoms} atoms, but its {kind}s hold {end}"
            )));
        }
        Ok(())
    }

    /// Counts and bounds for a report.
    pub fn content(&self) -> Content {
        let bounds = self.bounds();
        Content {
            atoms: Some(self.atoms.len() as u64),
            residues: Some(self.residues.len() as u64),
            models: (self.models.len() > 1).then_some(self.models.len() as u64),
            bounds: (!bounds.is_empty()).then_some([bounds.lo, bounds.hi]),
            ..Content::default()
        }
    }
}

impl Atom {
    /// Errs with what is wrong with its figures.
    fn check(&self) -> Result<(), String> {
        let [x, y, z] = self.position;
        if !self.position.iter().all(|c| c.is_finite()) {
            return Err(format!("coordinates ({x}, {y}, {z}) are not finite"));
        }
        if let Some(radius) = self.radius.filter(|r| !(r.is_finite() && *r >= 0.0)) {
            return Err(format!("radius {radius} is not finite or is negative"));
        }
        for (what, value) in [("occupancy", self.occupancy), ("b-factor", self.b_factor)] {
            if !value.is_finite() {
                return Err(format!("{what} {value} is not finite"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};

    #[test]
    fn an_atom_takes_little_room() {
        assert!(size_of::<Atom>() <= 88, "{}", size_of::<Atom>());
    }

    #[test]
    fn what_a_reader_promises_is_checked() {
        let molecule = built(&[("A:1:GLY", atom("N", 0.0)), ("A:2:ALA", atom("CA", 1.5))]);
        molecule.check().expect("a sound molecule");
        assert_eq!(molecule.residues_in(0), 0..2);
        assert_eq!(molecule.residues_in(1), 0..0);
        let wrong = |change: fn(&mut Molecule)| {
            let mut other = molecule.clone();
            change(&mut other);
            other.check().expect_err("a fault").to_string()
        };
        assert_eq!(
            wrong(|m| m.atoms[1].position[2] = f64::NAN),
            "atom 1: coordinates (1.5, 0, NaN) are not finite"
        );
        assert_eq!(
            wrong(|m| m.atoms[0].radius = Some(-1.0)),
            "atom 0: radius -1 is not finite or is negative"
        );
        assert_eq!(
            wrong(|m| m.atoms[1].residue = 0),
            "residue 1: has atoms that name another residue"
        );
        assert_eq!(
            wrong(|m| m.residues[1].atoms = 0..2),
            "residue 1: has the atoms 0 to 2, but begins after 1 others"
        );
        assert_eq!(
            wrong(|m| m.models.clear()),
            "has 2 atoms, but its models hold 0"
        );
        assert_eq!(wrong(|m| *m = Molecule::default()), "holds no atoms");
    }
}
