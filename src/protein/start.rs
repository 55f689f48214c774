//! Where a search begins.

use super::altlocs;
use super::molecule::{Molecule, Residue, write_place};
use super::name::Name;
use super::polymer::{Class, classes};
use super::select::there_are;
use crate::error::{Error, Result};
use crate::numeric::vector::{Vec3, add, scale, sub};
use std::fmt;

/// The place in a molecule where a search begins, as a user names it.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// A point, in the unit of the coordinates.
    Point(Vec3),
    /// The centroid of the atoms of these residues.
    Residues(Vec<ResidueId>),
    /// The centroid of the atoms with these serial numbers.
    Atoms(Vec<i64>),
    /// The centroid of a ligand, which then is left out.
    Ligand(LigandId),
}

/// A residue as a user names it: `A:106`, `A:52A`, and `106` where there is one chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResidueId {
    /// The chain, where it is named.
    pub chain: Option<Name>,
    /// The number in the chain.
    pub number: i32,
    /// The insertion code; a blank where there is none.
    pub insertion: u8,
}

/// A ligand as a user names it: `HEM`, or `HEM:A:401` where there are several.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LigandId {
    /// Name of the residue.
    pub name: Name,
    /// Which one of them.
    pub place: Option<ResidueId>,
}

/// A place found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Where it is.
    pub position: Vec3,
    /// Indices of the residues that are to be left out: those of the ligand.
    pub drop: Vec<u32>,
}

impl fmt::Display for ResidueId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let chain = self.chain.unwrap_or_default();
        write_place(f, chain, self.number, self.insertion)
    }
}

impl fmt::Display for LigandId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name)?;
        self.place.map_or(Ok(()), |place| write!(f, ":{place}"))
    }
}

/// In the words that [`Start::point`] and its like read.
impl fmt::Display for Start {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |items: Vec<String>| items.join(",");
        match self {
            Start::Point(at) => f.write_str(&at.map(|c| format!("{c}")).join(",")),
            Start::Residues(ids) => {
                f.write_str(&list(ids.iter().map(|id| id.to_string()).collect()))
            }
            Start::Atoms(serials) => {
                f.write_str(&list(serials.iter().map(i64::to_string).collect()))
            }
            Start::Ligand(id) => id.fmt(f),
        }
    }
}

impl ResidueId {
    /// Reads `A:106`, `A:52A`, `A:-3` or `106`. Errs with what is wrong.
    pub fn read(text: &str) -> Result<ResidueId, String> {
        let wrong =
            || format!("{text:?} is no residue, which is CHAIN:NUMBER as in A:106 or A:52A");
        let (chain, rest) = match text.rsplit_once(':') {
            None => (None, text),
            Some((chain, rest)) => (Some(Name::new(chain.as_bytes()).ok_or_else(wrong)?), rest),
        };
        let letters = rest.trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let insertion = match &rest.as_bytes()[letters.len()..] {
            [] => b' ',
            [letter] => *letter,
            _ => return Err(wrong()),
        };
        let number = letters.parse().map_err(|_| wrong())?;
        Ok(ResidueId {
            chain,
            number,
            insertion,
        })
    }

    fn is(&self, residue: &Residue) -> bool {
        self.chain.is_none_or(|chain| chain == residue.chain)
            && (self.number, self.insertion) == (residue.number, residue.insertion)
    }
}

impl Start {
    /// Reads `1,2,3`. Errs with what is wrong.
    pub fn point(text: &str) -> Result<Start, String> {
        let numbers: Vec<f64> = text
            .split(',')
            .map(|word| word.trim().parse::<f64>())
            .collect::<Result<_, _>>()
            .map_err(|_| format!("{text:?} is no point, which is three numbers as in 1.5,-2,40"))?;
        match numbers[..] {
            [x, y, z] if [x, y, z].iter().all(|c| c.is_finite()) => Ok(Start::Point([x, y, z])),
            [_, _, _] => Err(format!("{text:?} is no point: not all of it is finite")),
            _ => Err(format!(
                "{text:?} has {} numbers, but 3 are needed",
                numbers.len()
            )),
        }
    }

    /// Reads `A:106,A:272`. Errs with what is wrong.
    pub fn residues(text: &str) -> Result<Start, String> {
        let ids = text.split(',').map(|word| ResidueId::read(word.trim()));
        ids.collect::<Result<_, _>>().map(Start::Residues)
    }

    /// Reads serial numbers of atoms: `1012,2045`. Errs with what is wrong.
    pub fn atoms(text: &str) -> Result<Start, String> {
        let serials = text.split(',').map(|word| {
            let serial = word.trim().parse::<i64>();
            serial.map_err(|_| format!("{word:?} is no serial number of an atom"))
        });
        serials.collect::<Result<_, _>>().map(Start::Atoms)
    }

    /// Reads `HEM` or `HEM:A:401`. Errs with what is wrong.
    pub fn ligand(text: &str) -> Result<Start, String> {
        let (name, place) = match text.split_once(':') {
            None => (text, None),
            Some((name, place)) => (name, Some(ResidueId::read(place)?)),
        };
        let name = Name::new(name.as_bytes()).filter(|name| !name.is_empty());
        let name = name.ok_or_else(|| format!("{text:?} is no ligand, as in HEM or HEM:A:401"))?;
        Ok(Start::Ligand(LigandId { name, place }))
    }

    /// The option that takes it.
    pub fn option(&self) -> &'static str {
        match self {
            Start::Point(_) => "start",
            Start::Residues(_) => "start-residues",
            Start::Atoms(_) => "start-atoms",
            Start::Ligand(_) => "start-ligand",
        }
    }

    /// Finds the place in one model (an index).
    ///
    /// The centroid of residues and ligands is the mean of their atoms but hydrogens, each at one place
    /// where it has several; that of atoms by number is of just those. Errs with [`Error::Parameter`],
    /// which names what there is, where something is not there, or where it is there more than once.
    /// Cost: linear.
    pub fn resolve(&self, molecule: &Molecule, model: usize) -> Result<Found> {
        let wrong = |problem| Error::parameter(self.option(), self, problem);
        let found = |position| Found {
            position,
            drop: Vec::new(),
        };
        match self {
            Start::Point(at) => Ok(found(*at)),
            Start::Residues(ids) if ids.is_empty() => Err(wrong("names no residue".to_owned())),
            Start::Atoms(serials) if serials.is_empty() => Err(wrong("names no atom".to_owned())),
            Start::Residues(ids) => {
                let mut residues = Vec::new();
                for id in ids {
                    residues.extend(find_residues(molecule, model, id).map_err(wrong)?);
                }
                residues.sort_unstable();
                residues.dedup();
                Ok(found(centroid(molecule, &residues)))
            }
            Start::Atoms(serials) => {
                let atoms = find_atoms(molecule, model, serials).map_err(wrong)?;
                Ok(found(mean(molecule, &atoms)))
            }
            Start::Ligand(id) => {
                let drop = find_ligand(molecule, model, id).map_err(wrong)?;
                let position = centroid(molecule, &drop);
                Ok(Found { position, drop })
            }
        }
    }
}

/// Indices of all residues of a model that an id means: alternatives may make several at one place.
fn find_residues(molecule: &Molecule, model: usize, id: &ResidueId) -> Result<Vec<u32>, String> {
    let all = molecule.residues_in(model);
    let residue = |index: &usize| &molecule.residues[*index];
    let found: Vec<usize> = all.clone().filter(|i| id.is(residue(i))).collect();
    let Some(first) = found.first() else {
        return Err(no_residue(molecule, model, id));
    };
    let elsewhere = found
        .iter()
        .find(|i| !residue(i).is_at_place_of(residue(first)));
    if let Some(other) = elsewhere {
        return Err(format!(
            "residue {id} is there in several chains: {} and {}; name one",
            residue(first),
            residue(other)
        ));
    }
    Ok(found.iter().map(|index| *index as u32).collect())
}

/// `no residue A:999: chain A has 4 to 297`.
fn no_residue(molecule: &Molecule, model: usize, id: &ResidueId) -> String {
    let residues = &molecule.residues[molecule.residues_in(model)];
    let classes = classes(molecule, model);
    let numbers = |chain: &Name| -> Vec<i32> {
        let of_it = residues.iter().zip(&classes);
        let of_it = of_it.filter(|(residue, _)| residue.chain == *chain);
        // Numbers of water may be far from those of its chain.
        let is_polymer = |class: &Class| *class == Class::Polymer;
        let has_polymer = of_it.clone().any(|(_, class)| is_polymer(class));
        of_it
            .filter(|(_, class)| is_polymer(class) || !has_polymer)
            .map(|(residue, _)| residue.number)
            .collect()
    };
    let mut chains: Vec<Name> = residues.iter().map(|residue| residue.chain).collect();
    chains.sort_unstable();
    chains.dedup();
    let wanted = id.chain.or(if chains.len() == 1 {
        chains.first().copied()
    } else {
        None
    });
    let there = wanted.map(|chain| numbers(&chain)).unwrap_or_default();
    let chain = wanted.unwrap_or_default();
    let which = if chain.is_empty() {
        "the chain".to_owned()
    } else {
        format!("chain {chain}")
    };
    match (there.iter().min(), there.iter().max()) {
        (Some(least), Some(most)) => format!("no residue {id}: {which} has {least} to {most}"),
        _ => {
            let names: Vec<String> = chains.iter().map(|chain| format!("{chain:?}")).collect();
            match &chains[..] {
                [only] if only.is_empty() => format!(
                    "no residue {id}: the only chain has no name; give the number alone, as in {}",
                    id.number
                ),
                _ => format!("no residue {id}: the chains are {}", names.join(", ")),
            }
        }
    }
}

/// Indices of the atoms with these numbers.
fn find_atoms(molecule: &Molecule, model: usize, serials: &[i64]) -> Result<Vec<u32>, String> {
    let atoms = molecule
        .models
        .get(model)
        .map_or(0..0, |model| model.atoms.clone());
    let serial = |index: &u32| molecule.atoms[*index as usize].serial;
    let mut found = Vec::new();
    for wanted in serials {
        let of_it: Vec<u32> = atoms.clone().filter(|i| serial(i) == *wanted).collect();
        match of_it[..] {
            [one] => found.push(one),
            [] => {
                let there = atoms.clone().map(|i| serial(&i));
                let (least, most) = (there.clone().min(), there.max());
                let [least, most] = [least, most].map(Option::unwrap_or_default);
                return Err(format!(
                    "no atom {wanted}: the numbers are {least} to {most}"
                ));
            }
            [..] => {
                let count = of_it.len();
                return Err(format!(
                    "{count} atoms have the number {wanted}; name residues or a point"
                ));
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

/// Indices of the residues of a ligand.
fn find_ligand(molecule: &Molecule, model: usize, id: &LigandId) -> Result<Vec<u32>, String> {
    let all = molecule.residues_in(model);
    let residue = |index: &usize| &molecule.residues[*index];
    let is_named = |index: &usize| residue(index).name.is(id.name.as_str());
    let named: Vec<usize> = all.filter(is_named).collect();
    let is_there = |index: &&usize| id.place.is_none_or(|place| place.is(residue(index)));
    let found: Vec<usize> = named.iter().filter(is_there).copied().collect();
    let listed = |indices: &[usize]| {
        /// Most ligands that a message lists.
        const LISTED: usize = 12;
        let name = |index: &usize| format!("{}:{}", residue(index).name, residue(index));
        let names: Vec<String> = indices.iter().take(LISTED).map(name).collect();
        let more = if indices.len() > LISTED { ", ..." } else { "" };
        format!("{}{more}", names.join(", "))
    };
    let Some(first) = found.first() else {
        return Err(if named.is_empty() {
            format!(
                "no ligand {}: there are {}",
                id.name,
                there_are(molecule, model)
            )
        } else {
            format!("no ligand {id}: there are {}", listed(&named))
        });
    };
    if found
        .iter()
        .any(|i| !residue(i).is_at_place_of(residue(first)))
    {
        return Err(format!(
            "{} ligands are meant: {}; name one",
            found.len(),
            listed(&found)
        ));
    }
    Ok(found.iter().map(|index| *index as u32).collect())
}

/// The mean place of the atoms of residues that are no hydrogens, each atom at one place.
fn centroid(molecule: &Molecule, residues: &[u32]) -> Vec3 {
    let mut atoms: Vec<u32> = residues
        .iter()
        .flat_map(|residue| molecule.residues[*residue as usize].atoms.clone())
        .collect();
    let mut stays = altlocs::kept(molecule, &atoms, |_| true).into_iter();
    atoms.retain(|_| stays.next() == Some(true));
    let is_hydrogen = |index: &u32| molecule.atoms[*index as usize].element.is_hydrogen();
    if !atoms.iter().all(is_hydrogen) {
        atoms.retain(|index| !is_hydrogen(index));
    }
    mean(molecule, &atoms)
}

/// The mean place of atoms, of which there is at least one.
fn mean(molecule: &Molecule, atoms: &[u32]) -> Vec3 {
    // Differences from the first, so that a far model gives the same; made small by a power of two, so
    // that no sum goes over; and added in halves, as the mean may be that far from the first.
    let count = atoms.len() as f64;
    let small = 0.125 / (atoms.len().next_power_of_two() as f64);
    let place = |index: u32| molecule.atoms[index as usize].position;
    let first = place(atoms[0]);
    let moved = atoms
        .iter()
        .map(|index| sub(scale(place(*index), small), scale(first, small)));
    let half = moved
        .fold([0.0; 3], add)
        .map(|sum| sum / (2.0 * count * small));
    add(add(first, half), half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};
    use crate::protein::molecule::Atom;

    fn sample() -> Molecule {
        let hetero = |name: &str, x| Atom {
            hetero: true,
            ..atom(name, x)
        };
        let other = |x, altloc, occupancy| Atom {
            altloc,
            occupancy,
            ..atom("CB", x)
        };
        built(&[
            ("A:4:ALA", atom("N", 0.0)),
            ("A:4:ALA", atom("CA", 2.0)),
            ("A:4:ALA", atom("H", 100.0)),
            ("A:52A:SER", other(7.0, b'A', 0.4)),
            ("A:52A:SER", other(8.0, b'B', 0.6)),
            ("B:4:GLY", atom("N", 30.0)),
            ("A:401:HEM", hetero("FE", 5.0)),
            ("B:401:HEM", hetero("FE", 6.0)),
            ("B:402:HOH", hetero("O", 9.0)),
        ])
    }

    fn resolve(start: Result<Start, String>) -> Result<f64, String> {
        let found = start?.resolve(&sample(), 0);
        found.map(|f| f.position[0]).map_err(|e| e.to_string())
    }

    #[test]
    fn words_are_read_and_said_again() {
        for (start, text) in [
            (Start::point("1.5, -2,40"), "1.5,-2,40"),
            (
                Start::residues("A:106, 7,B:-3,CC:52A"),
                "A:106,7,B:-3,CC:52A",
            ),
            (Start::atoms("1,22"), "1,22"),
            (Start::ligand("HEM"), "HEM"),
            (Start::ligand("HEM:A:401"), "HEM:A:401"),
        ] {
            assert_eq!(start.expect("a start").to_string(), text);
        }
        for wrong in [
            Start::point("1,2"),
            Start::point("1,2,inf"),
            Start::point("a,b,c"),
            Start::residues("A:"),
            Start::residues("A:1,"),
            Start::residues("A:1AB"),
            Start::residues("HIS"),
            Start::atoms("1,x"),
            Start::ligand(""),
            Start::ligand("HEM:A"),
        ] {
            assert!(wrong.is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn places_are_means_of_heavy_atoms() {
        assert_eq!(resolve(Start::point("3,4,5")), Ok(3.0));
        assert_eq!(resolve(Start::residues("A:4")), Ok(1.0));
        assert_eq!(resolve(Start::residues("52A")), Ok(8.0));
        assert_eq!(resolve(Start::residues("A:4,A:4,B:4")), Ok(32.0 / 3.0));
        assert_eq!(resolve(Start::atoms("1,2,3")), Ok(34.0));
        let ligand = Start::ligand("hem:B:401").expect("a start");
        let found = ligand.resolve(&sample(), 0).expect("a ligand");
        assert_eq!((found.position[0], &found.drop[..]), (6.0, &[4][..]));
    }

    #[test]
    fn what_is_not_there_is_named_with_what_is() {
        for (start, problem) in [
            (
                Start::residues("A:999"),
                "--start-residues A:999: no residue A:999: chain A has 4 to 52",
            ),
            (
                Start::residues("C:4"),
                "--start-residues C:4: no residue C:4: the chains are \"A\", \"B\"",
            ),
            (
                Start::residues("4"),
                "--start-residues 4: residue 4 is there in several chains: A:4 and B:4; name one",
            ),
            (
                Start::atoms("77"),
                "--start-atoms 77: no atom 77: the numbers are 1 to 9",
            ),
            (
                Start::ligand("ABC"),
                "--start-ligand ABC: no ligand ABC: there are HEM, HOH",
            ),
            (
                Start::ligand("HEM"),
                "--start-ligand HEM: 2 ligands are meant: HEM:A:401, HEM:B:401; name one",
            ),
            (
                Start::ligand("HEM:A:402"),
                "--start-ligand HEM:A:402: no ligand HEM:A:402: there are HEM:A:401, HEM:B:401",
            ),
        ] {
            assert_eq!(resolve(start), Err(problem.to_owned()));
        }
        let mut doubled = sample();
        doubled.atoms[1].serial = 1;
        let error = Start::Atoms(vec![1])
            .resolve(&doubled, 0)
            .expect_err("an error");
        assert_eq!(
            error.to_string(),
            "--start-atoms 1: 2 atoms have the number 1; name residues or a point"
        );
    }

    #[test]
    fn means_of_far_places_are_finite() {
        let far = built(&[
            ("A:1:ALA", atom("N", 1.5e308)),
            ("A:1:ALA", atom("C", 1.7e308)),
        ]);
        let found = Start::Atoms(vec![1, 2]).resolve(&far, 0).expect("a place");
        assert!((found.position[0] / 1.6e308 - 1.0).abs() < 1e-12);
    }
}
