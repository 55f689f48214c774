//! What is in a molecule, and what looks wrong with it.

use super::altlocs;
use super::element::Element;
use super::molecule::{Atom, Molecule, Residue};
use super::polymer::{Class, classes};
use super::select::{NamedCount, NamedCounts, in_nanometres};
use super::spacing::median_spacing;
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// What is in a molecule. All but the counts of models and atoms is of its first model.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Inventory {
    /// The entry's name, null where the file gives none.
    pub id: Option<String>,
    /// Models.
    pub models: u64,
    /// Atoms of all models.
    pub atoms: u64,
    /// Atoms of the first model.
    pub atoms_in_model: u64,
    /// Names of the chains, in the order in which they begin.
    pub chains: Vec<String>,
    /// Residues of protein and nucleic acid, modified ones and caps included.
    pub polymer_residues: u64,
    /// Molecules of water.
    pub waters: u64,
    /// What is neither, by name.
    pub hetero: Vec<NamedCount>,
    /// Atoms by element, in the order of atomic numbers.
    pub elements: Vec<ElementCount>,
    /// Atoms that are one of several alternatives.
    pub altlocs: u64,
    /// Residues with an insertion code.
    pub insertions: u64,
    /// Atoms with a radius of their own.
    pub with_radius: u64,
    /// Atoms with exactly the centre of an earlier one, alternatives left out.
    pub coincident: u64,
    /// Median distance from an atom to its nearest neighbour, over a sample; null where there is none.
    pub median_spacing: Option<f64>,
    #[serde(skip)]
    unknown: Tally,
    #[serde(skip)]
    first_other_size: Option<u64>,
}

/// How many atoms there are of an element.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ElementCount {
    /// Its symbol; `X` where it is not known.
    pub symbol: String,
    /// The atoms.
    pub atoms: u64,
}

/// Counts what is in a molecule.
///
/// Cost: n log n in the atoms.
pub fn inventory(molecule: &Molecule) -> Inventory {
    let classes = classes(molecule, 0);
    let residues = &molecule.residues[molecule.residues_in(0)];
    let first = molecule.models.first().map_or(0..0, |m| m.atoms.clone());
    let atoms = molecule.atoms_in(&first);
    let of_class = |wanted| classes.iter().filter(|class| **class == wanted).count() as u64;
    let count = |holds: fn(&Atom) -> bool| atoms.iter().filter(|atom| holds(atom)).count() as u64;
    let mut unknown = Tally::default();
    let is_unknown = |atom: &Atom| atom.element == Element::UNKNOWN && atom.radius.is_none();
    for (index, _) in (0..).zip(atoms).filter(|(_, atom)| is_unknown(atom)) {
        unknown.note(index);
    }
    let centers = centers_of_one_each(molecule, &classes);
    let mut models = molecule.models.iter();
    let other_size = models.position(|model| model.atoms.len() != first.len());
    Inventory {
        id: Some(molecule.id.clone()).filter(|id| !id.is_empty()),
        models: molecule.models.len() as u64,
        atoms: molecule.atoms.len() as u64,
        atoms_in_model: atoms.len() as u64,
        chains: chains(residues),
        polymer_residues: of_class(Class::Polymer),
        waters: of_class(Class::Water),
        hetero: hetero(residues, &classes),
        elements: elements(atoms),
        altlocs: count(|atom| atom.altloc != b' '),
        insertions: residues.iter().filter(|r| r.insertion != b' ').count() as u64,
        with_radius: count(|atom| atom.radius.is_some()),
        coincident: coincident(&centers),
        median_spacing: median_spacing(&centers),
        unknown,
        first_other_size: other_size.map(|index| index as u64),
    }
}

/// Names of chains, in the order in which they begin.
fn chains(residues: &[Residue]) -> Vec<String> {
    let mut known = BTreeSet::new();
    let first_time = residues
        .iter()
        .filter(|residue| known.insert(residue.chain));
    first_time
        .map(|residue| residue.chain.to_string())
        .collect()
}

fn hetero(residues: &[Residue], classes: &[Class]) -> Vec<NamedCount> {
    let mut counts = NamedCounts::default();
    for (residue, class) in residues.iter().zip(classes) {
        if *class == Class::Hetero {
            counts.add(residue.name, residue.atoms.len() as u64);
        }
    }
    counts.rows()
}

fn elements(atoms: &[Atom]) -> Vec<ElementCount> {
    let mut counts: BTreeMap<Element, u64> = BTreeMap::new();
    for atom in atoms {
        *counts.entry(atom.element).or_default() += 1;
    }
    let rows = counts.into_iter().map(|(element, atoms)| ElementCount {
        symbol: element.symbol().to_owned(),
        atoms,
    });
    rows.collect()
}

/// Centres of the atoms of the first model, each at one of its places.
fn centers_of_one_each(molecule: &Molecule, classes: &[Class]) -> Vec<Vec3> {
    let begin = molecule.residues_in(0).start;
    let is_polymer = |residue: u32| classes[residue as usize - begin] == Class::Polymer;
    let first = molecule.models.first().map_or(0..0, |m| m.atoms.clone());
    let all: Vec<u32> = first.collect();
    let stays = altlocs::kept(molecule, &all, is_polymer);
    let kept = all.iter().zip(stays).filter(|(_, stays)| *stays);
    kept.map(|(index, _)| molecule.atoms[*index as usize].position)
        .collect()
}

/// How many points are exactly where another one is.
fn coincident(points: &[Vec3]) -> u64 {
    let mut bits: Vec<[u64; 3]> = points
        .iter()
        .map(|p| p.map(|c| (c + 0.0).to_bits()))
        .collect();
    bits.par_sort_unstable();
    bits.dedup();
    (points.len() - bits.len()) as u64
}

impl Inventory {
    /// What looks wrong.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        self.unknown.warn(
            "unknown-elements",
            "atoms of no known element, and without a radius of their own",
            &mut warnings,
        );
        if self.coincident > 0 {
            warnings.push(Warning::new(
                "coincident-atoms",
                "atoms with exactly the centre of another one",
                self.coincident,
                None,
            ));
        }
        warnings.extend(self.median_spacing.and_then(in_nanometres));
        if self.first_other_size.is_some() {
            let message = "a model has another number of atoms than the first";
            warnings.push(Warning::new(
                "other-models",
                message,
                1,
                self.first_other_size,
            ));
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};

    #[test]
    fn everything_is_counted() {
        let hetero = |name: &str, x| Atom {
            hetero: true,
            ..atom(name, x)
        };
        let other = |x, altloc| Atom {
            altloc,
            ..atom("CB", x)
        };
        let mut molecule = built(&[
            ("B:1:ALA", atom("N", 0.0)),
            ("B:1A:ALA", other(1.5, b'A')),
            ("B:1A:ALA", other(1.5, b'B')),
            ("A:2:HEM", hetero("FE", 5.0)),
            ("A:2:HEM", hetero("NA", 5.0)),
            ("A:3:HOH", hetero("O", 8.0)),
        ]);
        molecule.id = "1XYZ".into();
        molecule.atoms[5].radius = Some(1.4);
        molecule.atoms[4].element = Element::UNKNOWN;
        let found = inventory(&molecule);
        assert_eq!(found.chains, ["B", "A"]);
        assert_eq!((found.models, found.atoms, found.atoms_in_model), (1, 6, 6));
        assert_eq!((found.polymer_residues, found.waters), (2, 1));
        assert_eq!((found.altlocs, found.insertions), (2, 1));
        assert_eq!((found.with_radius, found.coincident), (1, 1));
        assert_eq!(found.median_spacing, Some(3.0));
        assert_eq!(found.hetero[0].atoms, 2);
        let symbols: Vec<_> = found
            .elements
            .iter()
            .map(|e| (&*e.symbol, e.atoms))
            .collect();
        assert_eq!(symbols, [("X", 1), ("C", 2), ("N", 1), ("O", 1), ("Fe", 1)]);
        let warnings = found.warnings();
        let codes: Vec<_> = warnings.iter().map(|w| (&*w.code, w.count)).collect();
        assert_eq!(codes, [("unknown-elements", 1), ("coincident-atoms", 1)]);
    }
}
