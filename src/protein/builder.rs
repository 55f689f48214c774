//! Putting a molecule together, atom by atom in the order of a file.

use super::molecule::{Atom, Model, Molecule, Residue};
use super::name::Name;
use crate::error::Fault;

/// The residue that an atom belongs to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Place {
    /// Name of the residue.
    pub name: Name,
    /// Name of the chain.
    pub chain: Name,
    /// Number of the residue in the chain.
    pub number: i32,
    /// Insertion code; a blank where there is none.
    pub insertion: u8,
    /// Whether the file places the residue in a polymer.
    pub in_polymer: bool,
}

/// A molecule that is being read.
///
/// Atoms of one place that follow one another make a residue; so a residue of several
/// alternatives whose atoms are mixed makes several, as it stands in the file.
#[derive(Debug, Default)]
pub struct Builder {
    molecule: Molecule,
    place: Option<Place>,
}

impl Builder {
    /// How many atoms there are.
    pub fn len(&self) -> usize {
        self.molecule.atoms.len()
    }

    /// Whether there are no atoms yet.
    pub fn is_empty(&self) -> bool {
        self.molecule.atoms.is_empty()
    }

    /// Bytes that the atoms take once there is one more, where that needs new room.
    pub fn growth(&self) -> Option<u128> {
        let held = self.molecule.atoms.capacity();
        // The old atoms are still there while they are copied to a place of twice the size.
        let full = self.molecule.atoms.len() == held;
        full.then(|| 3 * held.max(1) as u128 * size_of::<Atom>() as u128)
    }

    /// Makes room for so many atoms.
    pub fn reserve(&mut self, atoms: usize) {
        self.molecule.atoms.reserve_exact(atoms);
    }

    /// Names the entry.
    pub fn set_id(&mut self, id: String) {
        self.molecule.id = id;
    }

    /// Begins a model. One that gets no atoms is no model.
    pub fn begin_model(&mut self, number: i32) {
        self.end_residue();
        let end = self.molecule.atoms.len() as u32;
        let model = Model {
            number,
            atoms: end..end,
        };
        match self.molecule.models.last_mut() {
            Some(last) if last.atoms.is_empty() => *last = model,
            _ => self.molecule.models.push(model),
        }
    }

    /// Number of the current model, which may have no atoms yet; `None` before the first.
    pub fn model(&self) -> Option<i32> {
        self.molecule.models.last().map(|model| model.number)
    }

    /// Whether the current model has atoms.
    pub fn model_is_filled(&self) -> bool {
        let last = self.molecule.models.last();
        last.is_some_and(|model| !model.atoms.is_empty())
    }

    /// Ends the residue: the next atom begins one, though it be of the same place.
    pub fn end_residue(&mut self) {
        self.place = None;
    }

    /// The name of the first atom of the residue that is still open.
    pub fn first_name_of_residue(&self) -> Option<Name> {
        self.place?;
        let residue = self.molecule.residues.last()?;
        Some(self.molecule.atoms[residue.atoms.start as usize].name)
    }

    /// Adds an atom; which residue it names is overwritten. Errs at the 2^32nd atom.
    #[inline]
    pub fn push(&mut self, place: &Place, mut atom: Atom) -> Result<(), Fault> {
        let molecule = &mut self.molecule;
        let index = u32::try_from(molecule.atoms.len())
            .ok()
            .filter(|index| *index < u32::MAX)
            .ok_or_else(|| Fault::whole(format!("has more than {} atoms", u32::MAX)))?;
        if molecule.models.is_empty() {
            molecule.models.push(Model {
                number: 1,
                atoms: 0..0,
            });
        }
        if self.place != Some(*place) {
            self.place = Some(*place);
            molecule.residues.push(Residue {
                name: place.name,
                chain: place.chain,
                number: place.number,
                insertion: place.insertion,
                in_polymer: place.in_polymer,
                atoms: index..index,
            });
        }
        atom.residue = molecule.residues.len() as u32 - 1;
        molecule.atoms.push(atom);
        if let Some(residue) = molecule.residues.last_mut() {
            residue.atoms.end = index + 1;
        }
        if let Some(model) = molecule.models.last_mut() {
            model.atoms.end = index + 1;
        }
        Ok(())
    }

    /// The molecule; a last model without atoms is left out.
    pub fn finish(mut self) -> Molecule {
        self.molecule.models.retain(|model| !model.atoms.is_empty());
        self.molecule
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::protein::element::Element;

    /// An atom of the element that its name tells in a ligand, at `x` on the first axis.
    pub(crate) fn atom(name: &str, x: f64) -> Atom {
        Atom {
            position: [x, 0.0, 0.0],
            radius: None,
            serial: 0,
            name: Name::new(name.as_bytes()).expect("a name"),
            residue: 0,
            occupancy: 1.0,
            b_factor: 0.0,
            element: Element::of_name(name.as_bytes(), b"LIG"),
            altloc: b' ',
            hetero: false,
        }
    }

    /// `A:52A:HIS`, an insertion code being a letter after the number.
    pub(crate) fn place(text: &str) -> Place {
        let parts: Vec<&str> = text.split(':').collect();
        let name = |text: &str| Name::new(text.as_bytes()).expect("a name");
        let number = parts[1].trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let insertion = parts[1].as_bytes().get(number.len());
        Place {
            name: name(parts[2]),
            chain: name(parts[0]),
            number: number.parse().expect("a number"),
            insertion: insertion.copied().unwrap_or(b' '),
            in_polymer: false,
        }
    }

    /// The molecule of these atoms, with serials from 1.
    pub(crate) fn built(rows: &[(&str, Atom)]) -> Molecule {
        let mut builder = Builder::default();
        for (serial, (residue, atom)) in (1..).zip(rows) {
            let atom = Atom { serial, ..*atom };
            builder.push(&place(residue), atom).expect("room");
        }
        builder.finish()
    }

    #[test]
    fn atoms_make_residues_and_models() {
        let mut builder = Builder::default();
        let put = |builder: &mut Builder, residue| {
            let pushed = builder.push(&place(residue), atom("CA", 0.0));
            pushed.expect("room");
        };
        put(&mut builder, "A:1:GLY");
        put(&mut builder, "A:1:GLY");
        put(&mut builder, "A:1A:GLY");
        builder.end_residue();
        put(&mut builder, "A:1A:GLY");
        builder.begin_model(7);
        builder.begin_model(8);
        assert!(!builder.model_is_filled());
        put(&mut builder, "A:1A:GLY");
        builder.begin_model(9);
        let molecule = builder.finish();
        molecule.check().expect("a sound molecule");
        let residues: Vec<_> = molecule.residues.iter().map(|r| r.atoms.clone()).collect();
        assert_eq!(residues, [0..2, 2..3, 3..4, 4..5]);
        let models: Vec<_> = molecule
            .models
            .iter()
            .map(|m| (m.number, m.atoms.clone()))
            .collect();
        assert_eq!(models, [(1, 0..4), (8, 4..5)]);
        assert_eq!(molecule.residues_in(1), 3..4);
    }
}
