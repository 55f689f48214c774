//! One place for each atom that has several.

use super::molecule::Molecule;
use super::name::Name;
use std::cmp::Ordering;

/// A place in a chain: alternatives of one residue may have different names there. What is no polymer
/// may share its number with something else in old files, so its name counts.
type Site = (Name, i32, u8, Option<Name>);

const NO_OTHER: u8 = b' ';

/// Which of these atoms (indices into the molecule, rising) stay when each atom is kept at one place.
///
/// The alternative of the highest occupancy stays, and of equal ones that of the first letter, a blank
/// coming before all. Where residues of different names stand at one place of a polymer the name is
/// chosen first, by the highest occupancy of its atoms. Atoms without alternatives stay. Cost: linear
/// in the atoms, and n log n in those at places that have alternatives.
pub fn kept(molecule: &Molecule, atoms: &[u32], is_polymer: impl Fn(u32) -> bool) -> Vec<bool> {
    let mut stays = vec![true; atoms.len()];
    let site_of = |residue: u32| -> Site {
        let at = &molecule.residues[residue as usize];
        let name = (!is_polymer(residue)).then_some(at.name);
        (at.chain, at.number, at.insertion, name)
    };
    let has_others = |index: &&u32| molecule.atoms[**index as usize].altloc != NO_OTHER;
    let residue_of = |index: &u32| molecule.atoms[*index as usize].residue;
    let mut sites: Vec<Site> = Vec::new();
    let mut last = None;
    for residue in atoms.iter().filter(has_others).map(residue_of) {
        if last != Some(residue) {
            sites.push(site_of(residue));
        }
        last = Some(residue);
    }
    if sites.is_empty() {
        return stays;
    }
    sites.sort_unstable();
    sites.dedup();
    let mut members: Vec<(u32, u32)> = Vec::new();
    let mut looked_up = (u32::MAX, None);
    for (position, index) in atoms.iter().enumerate() {
        let residue = residue_of(index);
        if looked_up.0 != residue {
            looked_up = (residue, sites.binary_search(&site_of(residue)).ok());
        }
        if let Some(site) = looked_up.1 {
            members.push((site as u32, position as u32));
        }
    }
    members.sort_unstable();
    for site in members.chunk_by(|a, b| a.0 == b.0) {
        let positions: Vec<usize> = site.iter().map(|(_, at)| *at as usize).collect();
        choose(molecule, atoms, &positions, &mut stays);
    }
    stays
}

/// Chooses among the atoms of one site, given by their positions in `atoms`.
fn choose(molecule: &Molecule, atoms: &[u32], positions: &[usize], stays: &mut [bool]) {
    let atom = |position: usize| &molecule.atoms[atoms[position] as usize];
    let residue = |position: usize| molecule.residue_of(atom(position)).name;
    let better = |a: &usize, b: &usize| -> Ordering {
        let [x, y] = [atom(*a), atom(*b)];
        let by_share = y.occupancy.total_cmp(&x.occupancy);
        by_share.then(x.altloc.cmp(&y.altloc)).then(a.cmp(b))
    };
    let others = positions.iter().filter(|at| atom(**at).altloc != NO_OTHER);
    let Some(best) = others.copied().min_by(better) else {
        return;
    };
    let mut left = Vec::with_capacity(positions.len());
    for at in positions {
        if atom(*at).altloc != NO_OTHER && residue(*at) != residue(best) {
            stays[*at] = false;
        } else {
            left.push(*at);
        }
    }
    left.sort_by_key(|at| (atom(*at).name, *at));
    for group in left.chunk_by(|a, b| atom(*a).name == atom(*b).name) {
        let has_others = group.iter().any(|at| atom(*at).altloc != NO_OTHER);
        let best = group.iter().copied().min_by(better);
        for at in group.iter().filter(|at| has_others && Some(**at) != best) {
            stays[*at] = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};
    use crate::protein::molecule::Atom;

    fn other(name: &str, altloc: u8, occupancy: f32) -> Atom {
        Atom {
            altloc,
            occupancy,
            ..atom(name, 0.0)
        }
    }

    fn kept_of(rows: &[(&str, Atom)]) -> Vec<bool> {
        let molecule = built(rows);
        let all: Vec<u32> = (0..molecule.atoms.len() as u32).collect();
        kept(&molecule, &all, |_| true)
    }

    #[test]
    fn the_most_occupied_stays_and_then_the_first_letter() {
        let rows = [
            ("A:1:SER", other("CA", b' ', 1.0)),
            ("A:1:SER", other("OG", b'A', 0.4)),
            ("A:1:SER", other("OG", b'B', 0.6)),
            ("A:1:SER", other("CB", b'B', 0.5)),
            ("A:1:SER", other("CB", b'A', 0.5)),
            ("A:1:SER", other("CB", b'C', 0.1)),
            // A place of its own, though its name is the same.
            ("A:1A:SER", other("OG", b'B', 0.1)),
            // The first place has a blank.
            ("A:2:SER", other("OG", b' ', 0.5)),
            ("A:2:SER", other("OG", b'B', 0.5)),
        ];
        let expected = [true, false, true, false, true, false, true, true, false];
        assert_eq!(kept_of(&rows), expected);
    }

    #[test]
    fn alternatives_stand_apart_in_some_files() {
        let rows = [
            ("A:1:SER", other("OG", b'A', 0.5)),
            ("A:2:GLY", other("CA", b' ', 1.0)),
            ("A:1:SER", other("OG", b'B', 0.5)),
        ];
        assert_eq!(kept_of(&rows), [true, true, false]);
    }

    #[test]
    fn one_name_of_residue_stays_at_a_place() {
        let rows = [
            ("A:22:PRO", other("N", b'A', 0.4)),
            ("A:22:SER", other("N", b'B', 0.6)),
            ("A:22:PRO", other("CG", b'A', 0.4)),
            ("A:22:SER", other("OG", b'B', 0.6)),
        ];
        assert_eq!(kept_of(&rows), [false, true, false, true]);
    }

    #[test]
    fn doubled_atoms_without_letters_are_no_alternatives() {
        let rows = [
            ("A:1:SER", other("OG", b' ', 0.5)),
            ("A:1:SER", other("OG", b' ', 0.5)),
        ];
        assert_eq!(kept_of(&rows), [true, true]);
    }
}
