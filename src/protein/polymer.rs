//! What is protein or nucleic acid, what is water, and what is neither.

use super::molecule::{Atom, Molecule, Residue};

/// What a residue is part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// A chain of protein or nucleic acid.
    Polymer,
    /// Water.
    Water,
    /// A ligand, an ion, a sugar, a lipid.
    Hetero,
}

/// Residues whose atoms' first letters are their elements.
const STANDARD: [&str; 47] = [
    "A", "ALA", "ARG", "ASH", "ASN", "ASP", "ASX", "C", "CYM", "CYS", "CYX", "DA", "DC", "DG",
    "DI", "DT", "DU", "G", "GLH", "GLN", "GLU", "GLX", "GLY", "HID", "HIE", "HIP", "HIS", "HSD",
    "HSE", "HSP", "I", "ILE", "LEU", "LYN", "LYS", "MET", "N", "PHE", "PRO", "PYL", "SER", "THR",
    "TRP", "TYR", "U", "UNK", "VAL",
];

/// Residues that stand in chains although they are held as `HETATM`: the most frequent of the modified
/// ones, mirror images of the standard ones, and the caps of chains.
const MODIFIED: [&str; 62] = [
    "0TD", "1MA", "1MG", "2MG", "4SU", "5CM", "5MC", "5MU", "7MG", "A2M", "ACE", "AIB", "ALY",
    "CAS", "CGU", "CME", "CR2", "CRO", "CSD", "CSO", "CSS", "CSX", "DAL", "DAR", "DAS", "DCY",
    "DGL", "DGN", "DHI", "DIL", "DLE", "DLY", "DPN", "DPR", "DSG", "DSN", "DTH", "DTR", "DTY",
    "DVA", "FME", "FOR", "H2U", "HIC", "HYP", "KCX", "LLP", "M3L", "MLY", "MSE", "NH2", "NLE",
    "NME", "OCS", "OMC", "OMG", "PCA", "PSU", "PTR", "SAC", "SEP", "TPO",
];

const WATER: [&str; 14] = [
    "D2O", "DOD", "H2O", "HOH", "OPC", "SOL", "SPC", "SPCE", "TIP", "TIP3", "TIP4", "TIP5", "TP3",
    "WAT",
];

/// Ions of one atom, by the names that simulation programs hold as `ATOM`.
const IONS: [&str; 28] = [
    "AL", "BA", "BAR", "BR", "BR-", "CA", "CAL", "CD", "CES", "CL", "CL-", "CLA", "CS", "CU", "FE",
    "K", "K+", "LI", "LIT", "MG", "MN", "NA", "NA+", "POT", "RB", "SOD", "ZN", "ZN2",
];

/// Longest bond between the backbones of neighbours, with room for badly built models: the peptide
/// bond is 1.33, the one from sugar to phosphate 1.61 angstrom.
const LONGEST_BOND: f64 = 2.0;

fn is_listed(list: &[&str], name: &[u8]) -> bool {
    list.iter()
        .any(|known| known.as_bytes().eq_ignore_ascii_case(name))
}

/// Whether it is one of the standard amino acids or nucleotides, by any of their usual names.
pub fn is_standard(name: &[u8]) -> bool {
    name.len() <= 3 && is_listed(&STANDARD, name)
}

/// Whether it is water, by any of its usual names.
pub fn is_water(name: &[u8]) -> bool {
    is_listed(&WATER, name)
}

/// The class of each residue of a model, in their order.
///
/// Water is told by its name. Residues held as `ATOM` are polymer, but for ions of one atom. Of
/// those held as `HETATM` these are polymer: what the file itself places in one, the usual modified
/// residues and caps by their names, and what is bonded by its backbone to a neighbour in the file
/// that is polymer and of the same chain. Cost: linear.
pub fn classes(molecule: &Molecule, model: usize) -> Vec<Class> {
    let residues = &molecule.residues[molecule.residues_in(model)];
    let mut classes: Vec<Class> = residues
        .iter()
        .map(|residue| class_alone(molecule, residue))
        .collect();
    // What one bond shows to be polymer may show it of the next: once along the file, once back.
    for at in 1..residues.len() {
        if classes[at - 1] == Class::Polymer && joins(molecule, residues, at, classes[at], at) {
            classes[at] = Class::Polymer;
        }
    }
    for at in (1..residues.len()).rev() {
        if classes[at] == Class::Polymer && joins(molecule, residues, at, classes[at - 1], at - 1) {
            classes[at - 1] = Class::Polymer;
        }
    }
    classes
}

/// Whether `which`, one of the residues `after - 1` and `after`, is held as `HETATM`, is of no class yet,
/// and is bonded to the other.
fn joins(
    molecule: &Molecule,
    residues: &[Residue],
    after: usize,
    class: Class,
    which: usize,
) -> bool {
    let [before, after] = [&residues[after - 1], &residues[after]];
    class == Class::Hetero
        && before.chain == after.chain
        && molecule.atoms_in(&residues[which].atoms)[0].hetero
        && are_bonded(molecule, before, after)
}

/// What a residue is by itself.
fn class_alone(molecule: &Molecule, residue: &Residue) -> Class {
    let name = residue.name.as_bytes();
    let atoms = molecule.atoms_in(&residue.atoms);
    if is_water(name) {
        Class::Water
    } else if residue.in_polymer {
        Class::Polymer
    } else if atoms[0].hetero {
        if is_listed(&MODIFIED, name) {
            Class::Polymer
        } else {
            Class::Hetero
        }
    } else if atoms.len() == 1 && is_listed(&IONS, name) {
        Class::Hetero
    } else {
        Class::Polymer
    }
}

/// Whether the backbone goes on from one residue to the next.
fn are_bonded(molecule: &Molecule, before: &Residue, after: &Residue) -> bool {
    let [before, after] = [before, after].map(|residue| molecule.atoms_in(&residue.atoms));
    let links: [(&[&str], &[&str]); 2] = [(&["C"], &["N"]), (&["O3'", "O3*"], &["P"])];
    let named = |atom: &Atom, names: &[&str]| names.iter().any(|name| atom.name.is(name));
    let near = |a: &Atom, b: &Atom| {
        let squares = (0..3).map(|k| (a.position[k] - b.position[k]).powi(2));
        squares.sum::<f64>() <= LONGEST_BOND * LONGEST_BOND
    };
    links.iter().any(|(end, start)| {
        let mut ends = before.iter().filter(|atom| named(atom, end));
        ends.any(|a| {
            let mut starts = after.iter().filter(|atom| named(atom, start));
            starts.any(|b| near(a, b))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};

    fn hetero(name: &str, x: f64) -> Atom {
        Atom {
            hetero: true,
            ..atom(name, x)
        }
    }

    #[test]
    fn lists_are_sorted() {
        for list in [&STANDARD[..], &MODIFIED, &WATER, &IONS] {
            assert!(list.is_sorted(), "{list:?}");
        }
    }

    #[test]
    fn residues_are_told_by_names_records_and_bonds() {
        use Class::{Hetero, Polymer, Water};
        let mut molecule = built(&[
            // Bonded to what follows.
            ("A:1:XAA", hetero("C", 0.0)),
            ("A:2:GLY", atom("N", 1.3)),
            ("A:2:GLY", atom("C", 3.0)),
            // Bonded to what is before, one after the other.
            ("A:3:XAB", hetero("N", 4.3)),
            ("A:3:XAB", hetero("C", 6.0)),
            ("A:4:XAC", hetero("N", 7.3)),
            // In reach, but of another chain.
            ("B:5:XAD", hetero("N", 1.3)),
            ("A:6:MSE", hetero("CA", 50.0)),
            ("A:7:SOL", atom("OW", 60.0)),
            ("A:8:NA", atom("NA", 70.0)),
            ("A:9:ZN", hetero("ZN", 80.0)),
            ("A:10:HEM", hetero("FE", 90.0)),
            ("A:11:XAE", hetero("CA", 95.0)),
        ]);
        molecule.residues[10].in_polymer = true;
        let expected = [
            Polymer, Polymer, Polymer, Polymer, Hetero, Polymer, Water, Hetero, Hetero, Hetero,
            Polymer,
        ];
        assert_eq!(classes(&molecule, 0), expected);
    }
}
