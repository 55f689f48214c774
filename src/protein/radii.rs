//! Radii of atoms.

use super::element::Element;
use super::molecule::{Atom, Residue};
use super::name::Name;
use crate::error::{Fault, number};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// What stands for any residue or any atom in a table of radii.
const ANY: &str = "*";

/// Radius of an atom whose element is not known, in angstrom: that of carbon.
pub const UNKNOWN: f64 = 1.70;

/// Radius of metals and other elements that the table has no figure for, in angstrom: that of iron.
pub const OTHER: f64 = 2.00;

/// Van der Waals radii in angstrom, by atomic number.
///
/// Bondi (J. Phys. Chem. 68, 441, 1964, table I), but H, C, N, O, F, P, S and Cl as usual for tunnels,
/// which for all but none of them are Bondi's too. Sodium and potassium are left to [`OTHER`]: in
/// proteins they are ions, and Bondi's 2.27 and 2.75 are of the metal.
const TABLE: &[(u8, f64)] = &[
    (1, 1.20),
    (2, 1.40),
    (3, 1.82),
    (6, 1.70),
    (7, 1.55),
    (8, 1.52),
    (9, 1.47),
    (10, 1.54),
    (12, 1.73),
    (14, 2.10),
    (15, 1.80),
    (16, 1.80),
    (17, 1.75),
    (18, 1.88),
    (28, 1.63),
    (29, 1.40),
    (30, 1.39),
    (31, 1.87),
    (33, 1.85),
    (34, 1.90),
    (35, 1.85),
    (36, 2.02),
    (46, 1.63),
    (47, 1.72),
    (48, 1.58),
    (49, 1.93),
    (52, 2.06),
    (53, 1.98),
    (54, 2.16),
    (78, 1.72),
    (79, 1.66),
    (80, 1.55),
    (81, 1.96),
    (82, 2.02),
    (92, 1.86),
];

/// The radius of an element in angstrom; [`UNKNOWN`] and [`OTHER`] for those without a figure.
#[inline]
pub fn of_element(element: Element) -> f64 {
    match element {
        Element::UNKNOWN => UNKNOWN,
        Element(known) => TABLE
            .iter()
            .find(|(number, _)| *number == known)
            .map_or(OTHER, |(_, radius)| *radius),
    }
}

/// Radii of atoms: those of a user's table, else of the file, else of the element.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Radii {
    named: BTreeMap<(Option<Name>, Option<Name>), f64>,
    elements: BTreeMap<Element, f64>,
    any: Option<f64>,
}

/// Where a radius is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The user's table.
    Given,
    /// The file of the atoms.
    File,
    /// The table of elements.
    Element,
    /// Nothing: the element is not known.
    Unknown,
}

impl Radii {
    /// Reads a table: lines of `ELEMENT RADIUS` or `RESIDUE ATOM RADIUS`, parted by blanks or commas.
    ///
    /// `*` stands for any residue, any atom or any element, `#` begins a comment. Names are compared in
    /// any case. A line for residue and atom comes before one for the residue alone (`HEM * 1.8`), that
    /// before one for the atom alone (`* CA 1.9`), and all of them before an element's. Radii are in the
    /// unit of the coordinates. Errs with the line where there are not two or three words, the radius is
    /// no finite number that is not negative, a name is none, or a line says what another one says.
    pub fn read(text: &str) -> Result<Radii, Fault> {
        let mut radii = Radii::default();
        let mut lines_of = BTreeMap::new();
        for (line, content) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
            let content = content.split('#').next().unwrap_or_default();
            let words: Vec<&str> = content
                .split(|c: char| c == ',' || c.is_whitespace())
                .filter(|word| !word.is_empty())
                .collect();
            let Some((radius, names)) = words.split_last() else {
                continue;
            };
            let radius = radius_of(radius, line)?;
            radii.add(names, radius, line)?;
            let key: Vec<String> = names.iter().map(|name| name.to_uppercase()).collect();
            match lines_of.entry(key) {
                Entry::Vacant(place) => drop(place.insert(line)),
                Entry::Occupied(earlier) => {
                    let problem = format!(
                        "the radius of {} is given in line {} already",
                        names.join(" "),
                        earlier.get()
                    );
                    return Err(Fault::line(line, problem));
                }
            }
        }
        if radii == Radii::default() {
            return Err(Fault::whole("holds no radii"));
        }
        Ok(radii)
    }

    fn add(&mut self, names: &[&str], radius: f64, line: u64) -> Result<(), Fault> {
        match names {
            [ANY] => self.any = Some(radius),
            [symbol] => {
                let element = Element::from_symbol(symbol.as_bytes()).ok_or_else(|| {
                    Fault::line(line, format!("{symbol:?} is no symbol of an element"))
                })?;
                self.elements.insert(element, radius);
            }
            [ANY, ANY] => self.any = Some(radius),
            [residue, atom] => {
                let key = (upper_name(residue, line)?, upper_name(atom, line)?);
                self.named.insert(key, radius);
            }
            _ => {
                let words = names.len() + 1;
                let problem = format!("has {words} words, but 2 or 3 are needed");
                return Err(Fault::line(line, problem)
                    .with_hint("ELEMENT RADIUS, or RESIDUE ATOM RADIUS, where * is any"));
            }
        }
        Ok(())
    }

    /// The radius of an atom of a residue, and where it is from.
    #[inline]
    pub fn of(&self, atom: &Atom, residue: &Residue) -> (f64, Origin) {
        if let Some(radius) = self.given(atom, residue) {
            return (radius, Origin::Given);
        }
        match (atom.radius, atom.element) {
            (Some(radius), _) => (radius, Origin::File),
            (None, Element::UNKNOWN) => (UNKNOWN, Origin::Unknown),
            (None, element) => (of_element(element), Origin::Element),
        }
    }

    /// The radius that the user's table gives an atom.
    fn given(&self, atom: &Atom, residue: &Residue) -> Option<f64> {
        if !self.named.is_empty() {
            let [residue, atom] = [residue.name, atom.name].map(|name| Some(upper(name)));
            let keys = [(residue, atom), (residue, None), (None, atom)];
            if let Some(radius) = keys.iter().find_map(|key| self.named.get(key)) {
                return Some(*radius);
            }
        }
        let of_element = self.elements.get(&atom.element).copied();
        of_element.or(self.any)
    }
}

fn radius_of(word: &str, line: u64) -> Result<f64, Fault> {
    let radius: f64 = word
        .parse()
        .map_err(|_| Fault::line(line, format!("{word:?} is no radius")))?;
    if radius.is_finite() && radius >= 0.0 {
        Ok(radius)
    } else {
        let problem = format!("radius {} is not finite or is negative", number(radius));
        Err(Fault::line(line, problem))
    }
}

fn upper(name: Name) -> Name {
    Name::new(&name.as_bytes().to_ascii_uppercase()).unwrap_or(name)
}

/// A name in upper case; `None` for any.
fn upper_name(word: &str, line: u64) -> Result<Option<Name>, Fault> {
    if word == ANY {
        return Ok(None);
    }
    let name = Name::new(&word.as_bytes().to_ascii_uppercase());
    let longest = Name::LONGEST;
    name.map(Some).ok_or_else(|| {
        Fault::line(
            line,
            format!("{word:?} is no name: those have up to {longest} letters, digits and signs"),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protein::builder::tests::{atom, built};

    fn message(text: &str) -> String {
        Radii::read(text).expect_err("a fault").to_string()
    }

    #[test]
    fn elements_have_radii() {
        let of = |symbol: &str| of_element(Element::from_symbol(symbol.as_bytes()).expect("one"));
        let found = [
            "H", "C", "N", "O", "F", "P", "S", "Cl", "Se", "Mg", "Zn", "Fe", "Na",
        ]
        .map(of);
        let expected = [
            1.20, 1.70, 1.55, 1.52, 1.47, 1.80, 1.80, 1.75, 1.90, 1.73, 1.39, 2.00, 2.00,
        ];
        assert_eq!(found, expected);
        assert_eq!(of_element(Element::UNKNOWN), 1.70);
        assert!(TABLE.is_sorted_by_key(|(number, _)| *number));
    }

    #[test]
    fn the_users_table_comes_first_and_the_file_next() {
        let table = "# radii\nc 1.9, \n HEM, FE 1.3\nHEM * 1.4 # any\n* CB 1.5\n";
        let radii = Radii::read(table).expect("a table");
        let molecule = built(&[
            ("A:1:HEM", atom("FE", 0.0)),
            ("A:1:HEM", atom("CB", 0.0)),
            ("A:2:ALA", atom("CB", 0.0)),
            ("A:2:ALA", atom("CA", 0.0)),
            ("A:2:ALA", atom("N", 0.0)),
        ]);
        let of = |radii: &Radii, index: usize, radius| {
            let atom = Atom {
                radius,
                ..molecule.atoms[index]
            };
            radii.of(&atom, molecule.residue_of(&atom))
        };
        let found: Vec<f64> = (0..5).map(|i| of(&radii, i, None).0).collect();
        assert_eq!(found, [1.3, 1.4, 1.5, 1.9, 1.55]);
        assert_eq!(of(&radii, 3, Some(1.1)), (1.9, Origin::Given));
        assert_eq!(of(&radii, 4, Some(1.1)), (1.1, Origin::File));
        assert_eq!(of(&Radii::default(), 0, None), (2.0, Origin::Element));
        let nameless = Atom {
            element: Element::UNKNOWN,
            ..molecule.atoms[0]
        };
        let residue = &molecule.residues[0];
        let any = Radii::read("* 2.5").expect("a table");
        assert_eq!(any.of(&nameless, residue), (2.5, Origin::Given));
        let none = Radii::default();
        assert_eq!(none.of(&nameless, residue), (1.7, Origin::Unknown));
    }

    #[test]
    fn faults_name_the_line() {
        assert_eq!(message("C 1.7\nN x\n"), "2: \"x\" is no radius");
        assert_eq!(
            message("C 1e999\n"),
            "1: radius inf is not finite or is negative"
        );
        assert_eq!(
            message("C nan\n"),
            "1: radius NaN is not finite or is negative"
        );
        assert_eq!(
            message("\n\nC -1\n"),
            "3: radius -1 is not finite or is negative"
        );
        assert_eq!(message("Qq 1\n"), "1: \"Qq\" is no symbol of an element");
        assert_eq!(
            message("A B C 1\n"),
            "1: has 4 words, but 2 or 3 are needed"
        );
        assert_eq!(message("1.7\n"), "1: has 1 words, but 2 or 3 are needed");
        assert_eq!(
            message("HEM FE 1\nhem fe 2\n"),
            "2: the radius of hem fe is given in line 1 already"
        );
        assert_eq!(message("# nothing\n"), "holds no radii");
    }
}
