//! Which atoms of a molecule count, and how large they are.

use super::altlocs;
use super::clearance::Ball;
use super::element::Element;
use super::molecule;
use super::molecule::Molecule;
use super::name::Name;
use super::polymer::{Class, classes};
use super::radii::{Origin, Radii};
use super::spacing::{NANOMETRES, median_spacing};
use crate::error::{Error, Fault, Result, number};
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// What is to be kept beside protein and nucleic acid, and with which radii.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SelectParams {
    /// Names of residues that are kept though they are no polymer: `HEM`, `ZN`, `HOH`.
    pub keep: Vec<String>,
    /// Indices of residues that are left out whatever they are.
    pub drop: Vec<u32>,
    /// The user's radii; empty for those of the file or of the elements.
    pub radii: Radii,
}

/// The atoms that count.
#[derive(Debug, Clone)]
pub struct Selected {
    /// Them as balls, in the order of the file; no two have one centre.
    pub balls: Vec<Ball>,
    /// Index of each ball's atom in the molecule; rising.
    pub atoms: Vec<u32>,
    /// How many there are, and how many were left out for what.
    pub counts: SelectionCounts,
    unknown: Tally,
    spacing: Option<f64>,
}

/// What was selected and what was left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct SelectionCounts {
    /// Atoms in the file, of all models.
    pub atoms_in_file: u64,
    /// Atoms in the model that was taken.
    pub atoms_in_model: u64,
    /// Atoms that count.
    pub atoms_used: u64,
    /// Atoms of water that were left out.
    pub waters_dropped: u64,
    /// What else was left out because it is no polymer, by name.
    pub hetero_dropped: Vec<NamedCount>,
    /// What was kept though it is no polymer, by name.
    pub hetero_kept: Vec<NamedCount>,
    /// Atoms left out because the search begins in their place.
    pub start_dropped: u64,
    /// Atoms left out because the same atom counts at another place.
    pub altlocs_dropped: u64,
    /// Atoms left out because a larger or an equal one has the same centre.
    pub coincident_dropped: u64,
    /// Hydrogens among those that count.
    pub hydrogens: u64,
    /// Those that count and have neither a known element nor a radius of their own.
    pub unknown_elements: u64,
    /// The radii of those that count, by element.
    pub radii: Vec<RadiusCount>,
}

/// How many residues and atoms have a name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct NamedCount {
    /// Name of the residues.
    pub name: String,
    /// The residues.
    pub residues: u64,
    /// Their atoms.
    pub atoms: u64,
}

/// The radii that the atoms of an element have.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RadiusCount {
    /// Symbol of the element; `X` where it is not known.
    pub element: String,
    /// The atoms.
    pub atoms: u64,
    /// The smallest of their radii.
    pub min: f64,
    /// The largest of their radii.
    pub max: f64,
}

/// Counts of residues by name, in alphabetical order.
#[derive(Debug, Default)]
pub(super) struct NamedCounts(BTreeMap<Name, (u64, u64)>);

impl NamedCounts {
    pub(super) fn add(&mut self, name: Name, atoms: u64) {
        let count = self.0.entry(name).or_default();
        *count = (count.0 + 1, count.1 + atoms);
    }

    pub(super) fn rows(self) -> Vec<NamedCount> {
        let rows = self.0.into_iter();
        rows.map(|(name, (residues, atoms))| NamedCount {
            name: name.to_string(),
            residues,
            atoms,
        })
        .collect()
    }
}

impl Selected {
    /// Selects the atoms of one model (an index) that count.
    ///
    /// Protein and nucleic acid count, with modified residues and caps ([`classes`]); water and all else
    /// does where `keep` names it. Of atoms at several places one counts (the most occupied, then the
    /// first letter); of those with exactly one centre the largest, and of equal ones the
    /// first. Hydrogens count where there are any. Errs with [`Error::Parameter`] where `keep` names what
    /// is not there, and with [`Error::Geometry`] where no atom counts. Cost: n log n in the atoms of the
    /// model.
    pub fn of(molecule: &Molecule, model: usize, params: &SelectParams) -> Result<Selected> {
        let mut counts = SelectionCounts {
            atoms_in_file: molecule.atoms.len() as u64,
            ..SelectionCounts::default()
        };
        check_names(molecule, model, &params.keep)?;
        let classes = classes(molecule, model);
        let first = molecule.residues_in(model).start;
        let kept = residues_kept(molecule, model, &classes, params, &mut counts);
        let mut atoms: Vec<u32> = kept
            .iter()
            .flat_map(|residue| molecule.residues[*residue].atoms.clone())
            .collect();
        let is_polymer = |residue: u32| classes[residue as usize - first] == Class::Polymer;
        let stays = altlocs::kept(molecule, &atoms, is_polymer);
        counts.altlocs_dropped = retain(&mut atoms, &stays);
        let radii: Vec<(f64, Origin)> = atoms
            .iter()
            .map(|index| {
                let atom = &molecule.atoms[*index as usize];
                params.radii.of(atom, molecule.residue_of(atom))
            })
            .collect();
        let stays = without_coincident(molecule, &atoms, &radii);
        let mut stay = stays.iter();
        let radii: Vec<_> = radii
            .into_iter()
            .filter(|_| stay.next() == Some(&true))
            .collect();
        counts.coincident_dropped = retain(&mut atoms, &stays);
        if atoms.is_empty() {
            return Err(nothing_left(&counts));
        }
        Ok(Selected::sized(molecule, atoms, &radii, counts))
    }

    /// The balls of the atoms that are left, counted.
    fn sized(
        molecule: &Molecule,
        atoms: Vec<u32>,
        radii: &[(f64, Origin)],
        mut counts: SelectionCounts,
    ) -> Selected {
        let atom = |index: &u32| &molecule.atoms[*index as usize];
        let balls: Vec<Ball> = atoms
            .iter()
            .zip(radii)
            .map(|(index, (radius, _))| Ball {
                centre: atom(index).position,
                radius: *radius,
            })
            .collect();
        let mut unknown = Tally::default();
        for (index, (_, origin)) in atoms.iter().zip(radii) {
            if *origin == Origin::Unknown {
                unknown.note(u64::from(*index));
                counts.unknown_elements += 1;
            }
        }
        let elements = atoms.iter().map(|index| atom(index).element);
        let sizes = radii.iter().map(|(radius, _)| *radius);
        counts.radii = radii_by_element(elements.zip(sizes));
        counts.hydrogens = atoms
            .iter()
            .filter(|index| atom(index).element.is_hydrogen())
            .count() as u64;
        counts.atoms_used = atoms.len() as u64;
        let centres: Vec<Vec3> = balls.iter().map(|ball| ball.centre).collect();
        Selected {
            spacing: median_spacing(&centres),
            balls,
            atoms,
            counts,
            unknown,
        }
    }

    /// What looks wrong: elements that are not known, lengths that seem to be nanometres, atoms on top
    /// of one another.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        self.unknown.warn(
            "unknown-elements",
            "atoms of no known element; their radius is 1.7",
            &mut warnings,
        );
        if self.counts.coincident_dropped > 0 {
            warnings.push(Warning::new(
                "coincident-atoms",
                "atoms with exactly the centre of another one; the largest counts",
                self.counts.coincident_dropped,
                None,
            ));
        }
        warnings.extend(self.spacing.and_then(in_nanometres));
        warnings
    }
}

/// The warning that lengths are of nanometres, where the median distance of neighbours tells so.
pub(super) fn in_nanometres(spacing: f64) -> Option<Warning> {
    (spacing < NANOMETRES).then(|| {
        let spacing = number((spacing * 1e4).round() / 1e4);
        let message = format!(
            "neighbouring atoms are {spacing} apart: the coordinates seem to be in nanometres, not angstrom"
        );
        Warning::new("nanometres", message, 1, None)
    })
}

/// Errs where a name is not that of a residue which is no polymer, or at least of some residue.
fn check_names(molecule: &Molecule, model: usize, names: &[String]) -> Result<()> {
    let residues = &molecule.residues[molecule.residues_in(model)];
    for name in names {
        if !residues.iter().any(|residue| residue.name.is(name)) {
            let there = there_are(molecule, model);
            let problem = format!("there is no residue of this name, but {there}");
            return Err(Error::parameter("keep", name, problem));
        }
    }
    Ok(())
}

/// Names of residues that are no polymer, as messages list them.
pub(super) fn there_are(molecule: &Molecule, model: usize) -> String {
    /// Most names that a message lists.
    const LISTED: usize = 24;
    let residues = &molecule.residues[molecule.residues_in(model)];
    let classes = classes(molecule, model);
    let other = residues.iter().zip(classes);
    let names: BTreeSet<Name> = other
        .filter(|(_, class)| *class != Class::Polymer)
        .map(|(residue, _)| residue.name)
        .collect();
    let listed: Vec<String> = names.iter().take(LISTED).map(Name::to_string).collect();
    match names.len() {
        0 => "polymer alone".to_owned(),
        count if count > LISTED => format!("{} and {} more", listed.join(", "), count - LISTED),
        _ => listed.join(", "),
    }
}

/// Indices of the residues that count, rising.
fn residues_kept(
    molecule: &Molecule,
    model: usize,
    classes: &[Class],
    params: &SelectParams,
    counts: &mut SelectionCounts,
) -> Vec<usize> {
    let dropped: BTreeSet<u32> = params.drop.iter().copied().collect();
    let mut kept = Vec::with_capacity(classes.len());
    let [mut others, mut others_kept] = [NamedCounts::default(), NamedCounts::default()];
    for (index, class) in molecule.residues_in(model).zip(classes) {
        let residue = &molecule.residues[index];
        let atoms = molecule::indices(&residue.atoms).len() as u64;
        counts.atoms_in_model += atoms;
        let is_asked_for = || params.keep.iter().any(|name| residue.name.is(name));
        if dropped.contains(&(index as u32)) {
            counts.start_dropped += atoms;
        } else if *class == Class::Polymer {
            kept.push(index);
        } else if is_asked_for() {
            others_kept.add(residue.name, atoms);
            kept.push(index);
        } else if *class == Class::Water {
            counts.waters_dropped += atoms;
        } else {
            others.add(residue.name, atoms);
        }
    }
    counts.hetero_dropped = others.rows();
    counts.hetero_kept = others_kept.rows();
    kept
}

/// Keeps what stays; returns how many go.
fn retain(atoms: &mut Vec<u32>, stays: &[bool]) -> u64 {
    let before = atoms.len();
    let mut stays = stays.iter();
    atoms.retain(|_| stays.next() == Some(&true));
    (before - atoms.len()) as u64
}

/// The coordinates in an order in which equal ones are neighbours; 0 and -0 are equal.
fn in_space(a: Vec3, b: Vec3) -> Ordering {
    let along = |k: usize| (a[k] + 0.0).total_cmp(&(b[k] + 0.0));
    along(0).then_with(|| along(1)).then_with(|| along(2))
}

/// Which atoms stay when of those with one centre the largest does, and of equal ones the first.
fn without_coincident(molecule: &Molecule, atoms: &[u32], radii: &[(f64, Origin)]) -> Vec<bool> {
    // Coordinates beside their indices: the sort is most of the work of a large selection.
    let mut order: Vec<(Vec3, u32)> = (0..)
        .zip(atoms)
        .map(|(at, index)| (molecule.atoms[*index as usize].position, at))
        .collect();
    let size = |at: u32| radii[at as usize].0;
    order.par_sort_unstable_by(|(p, a), (q, b)| {
        let place = in_space(*p, *q);
        place.then_with(|| size(*b).total_cmp(&size(*a)).then(a.cmp(b)))
    });
    let mut stays = vec![true; atoms.len()];
    for pair in order.windows(2) {
        if in_space(pair[0].0, pair[1].0) == Ordering::Equal {
            stays[pair[1].1 as usize] = false;
        }
    }
    stays
}

fn radii_by_element(atoms: impl Iterator<Item = (Element, f64)>) -> Vec<RadiusCount> {
    let mut found: BTreeMap<Element, RadiusCount> = BTreeMap::new();
    for (element, radius) in atoms {
        let row = found.entry(element).or_insert_with(|| RadiusCount {
            element: element.symbol().to_owned(),
            atoms: 0,
            min: radius,
            max: radius,
        });
        row.atoms += 1;
        row.min = row.min.min(radius);
        row.max = row.max.max(radius);
    }
    found.into_values().collect()
}

fn nothing_left(counts: &SelectionCounts) -> Error {
    let names: Vec<&str> = counts
        .hetero_dropped
        .iter()
        .map(|row| row.name.as_str())
        .collect();
    let problem = format!(
        "no atom of {} counts: {} are of water, {} of other residues that are no polymer ({})",
        counts.atoms_in_model,
        counts.waters_dropped,
        counts
            .hetero_dropped
            .iter()
            .map(|row| row.atoms)
            .sum::<u64>(),
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    );
    let fault = Fault::whole(problem);
    Error::Geometry(fault.with_hint("--keep NAME,... keeps residues that are no polymer"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};
    use crate::protein::molecule::Atom;

    fn hetero(name: &str, x: f64) -> Atom {
        Atom {
            hetero: true,
            ..atom(name, x)
        }
    }

    fn sample() -> Molecule {
        built(&[
            ("A:1:ALA", atom("N", 0.0)),
            ("A:1:ALA", atom("CA", 1.5)),
            ("A:1:ALA", atom("HA", 2.5)),
            ("A:2:HEM", hetero("FE", 9.0)),
            ("A:2:HEM", hetero("NA", 11.0)),
            ("A:3:HOH", hetero("O", 20.0)),
            ("A:4:HOH", hetero("O", 23.0)),
        ])
    }

    fn keeping(names: &[&str]) -> SelectParams {
        SelectParams {
            keep: names.iter().map(|name| name.to_string()).collect(),
            ..SelectParams::default()
        }
    }

    #[test]
    fn polymer_counts_and_what_is_asked_for() {
        let molecule = sample();
        let selected = Selected::of(&molecule, 0, &SelectParams::default()).expect("atoms");
        assert_eq!(selected.atoms, [0, 1, 2]);
        let counts = &selected.counts;
        assert_eq!((counts.atoms_in_file, counts.atoms_in_model), (7, 7));
        assert_eq!((counts.atoms_used, counts.hydrogens), (3, 1));
        assert_eq!(counts.waters_dropped, 2);
        let heme = NamedCount {
            name: "HEM".into(),
            residues: 1,
            atoms: 2,
        };
        assert_eq!(counts.hetero_dropped, std::slice::from_ref(&heme));
        let radii: Vec<f64> = selected.balls.iter().map(|b| b.radius).collect();
        assert_eq!(radii, [1.55, 1.7, 1.2]);
        let with = Selected::of(&molecule, 0, &keeping(&["hem", "HOH"])).expect("atoms");
        assert_eq!(with.atoms.len(), 7);
        assert_eq!(with.counts.hetero_kept[0], heme);
        assert_eq!(with.counts.waters_dropped, 0);
    }

    #[test]
    fn names_that_are_not_there_are_refused() {
        let error = Selected::of(&sample(), 0, &keeping(&["HEN"])).expect_err("an error");
        assert_eq!(
            error.to_string(),
            "--keep HEN: there is no residue of this name, but HEM, HOH"
        );
        let water = built(&[("A:3:HOH", hetero("O", 20.0))]);
        let error = Selected::of(&water, 0, &SelectParams::default()).expect_err("an error");
        assert_eq!(
            error.to_string(),
            "no atom of 1 counts: 1 are of water, 0 of other residues that are no polymer (none)"
        );
    }

    #[test]
    fn of_coincident_atoms_the_largest_counts() {
        let sized = |name: &str, x: f64, radius| Atom {
            radius: Some(radius),
            ..atom(name, x)
        };
        let molecule = built(&[
            ("A:1:ALA", sized("C1", 1.0, 1.0)),
            ("A:1:ALA", sized("C2", 0.0, 1.0)),
            ("A:1:ALA", sized("C3", 1.0, 2.0)),
            ("A:1:ALA", sized("C4", -0.0, 1.0)),
        ]);
        let selected = Selected::of(&molecule, 0, &SelectParams::default()).expect("atoms");
        assert_eq!(selected.atoms, [1, 2]);
        assert_eq!(selected.counts.coincident_dropped, 2);
        let codes: Vec<_> = selected.warnings().into_iter().map(|w| w.code).collect();
        assert_eq!(codes, ["coincident-atoms"]);
    }

    #[test]
    fn what_looks_wrong_is_said() {
        let nameless = |x| Atom {
            element: Element::UNKNOWN,
            ..atom("Q", x)
        };
        let molecule = built(&[("A:1:LIG", nameless(0.0)), ("A:1:LIG", nameless(0.15))]);
        let selected = Selected::of(&molecule, 0, &SelectParams::default()).expect("atoms");
        let warnings = selected.warnings();
        let codes: Vec<_> = warnings.iter().map(|w| (&*w.code, w.count)).collect();
        assert_eq!(codes, [("unknown-elements", 2), ("nanometres", 1)]);
        assert!(
            warnings[1]
                .message
                .starts_with("neighbouring atoms are 0.15 apart")
        );
    }

    #[test]
    fn residues_are_dropped_for_the_start() {
        let params = SelectParams {
            drop: vec![1],
            ..keeping(&["HEM"])
        };
        let selected = Selected::of(&sample(), 0, &params).expect("atoms");
        assert_eq!(selected.atoms, [0, 1, 2]);
        assert_eq!(selected.counts.start_dropped, 2);
        assert!(selected.counts.hetero_dropped.is_empty());
    }
}
