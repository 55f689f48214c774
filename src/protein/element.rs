//! Chemical elements, and telling them by the names of atoms.

use super::polymer;
use std::fmt;

/// A chemical element by its atomic number; 0 is one that is not known.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Element(pub u8);

/// The symbols, from atomic number 1.
const SYMBOLS: [&str; 118] = [
    "H", "He", "Li", "Be", "B", "C", "N", "O", "F", "Ne", "Na", "Mg", "Al", "Si", "P", "S", "Cl",
    "Ar", "K", "Ca", "Sc", "Ti", "V", "Cr", "Mn", "Fe", "Co", "Ni", "Cu", "Zn", "Ga", "Ge", "As",
    "Se", "Br", "Kr", "Rb", "Sr", "Y", "Zr", "Nb", "Mo", "Tc", "Ru", "Rh", "Pd", "Ag", "Cd", "In",
    "Sn", "Sb", "Te", "I", "Xe", "Cs", "Ba", "La", "Ce", "Pr", "Nd", "Pm", "Sm", "Eu", "Gd", "Tb",
    "Dy", "Ho", "Er", "Tm", "Yb", "Lu", "Hf", "Ta", "W", "Re", "Os", "Ir", "Pt", "Au", "Hg", "Tl",
    "Pb", "Bi", "Po", "At", "Rn", "Fr", "Ra", "Ac", "Th", "Pa", "U", "Np", "Pu", "Am", "Cm", "Bk",
    "Cf", "Es", "Fm", "Md", "No", "Lr", "Rf", "Db", "Sg", "Bh", "Hs", "Mt", "Ds", "Rg", "Cn", "Nh",
    "Fl", "Mc", "Lv", "Ts", "Og",
];

/// Elements of two letters that an atom's name of four characters may begin with. All others would be
/// taken for a carbon, a nitrogen, an oxygen or a hydrogen with a long name: `CD12` is no cadmium.
const IN_LONG_NAMES: [&str; 10] = ["AL", "BR", "CL", "CU", "FE", "LI", "MG", "MN", "SE", "ZN"];

impl Element {
    /// What is not known.
    pub const UNKNOWN: Element = Element(0);
    /// Hydrogen, deuterium and tritium.
    pub const HYDROGEN: Element = Element(1);

    /// Its symbol: `C`, `Fe`; `X` where it is not known.
    pub fn symbol(self) -> &'static str {
        let place = usize::from(self.0).checked_sub(1);
        let symbol = place.and_then(|place| SYMBOLS.get(place));
        symbol.copied().unwrap_or("X")
    }

    /// The element of a symbol in any case; deuterium `D` and tritium `T` are hydrogen.
    #[inline]
    pub fn from_symbol(symbol: &[u8]) -> Option<Element> {
        // Nearly all atoms are of these.
        match symbol {
            b"C" => return Some(Element(6)),
            b"N" => return Some(Element(7)),
            b"O" => return Some(Element(8)),
            b"H" | b"D" | b"T" | b"d" | b"t" => return Some(Element::HYDROGEN),
            b"S" => return Some(Element(16)),
            b"P" => return Some(Element(15)),
            _ => {}
        }
        let is_it = |known: &str| known.as_bytes().eq_ignore_ascii_case(symbol);
        let place = SYMBOLS.iter().position(|known| is_it(known))?;
        Some(Element(place as u8 + 1))
    }

    /// Whether it is hydrogen.
    #[inline]
    pub fn is_hydrogen(self) -> bool {
        self == Element::HYDROGEN
    }

    /// The element that a name tells, whose columns are not known, as in PQR files.
    ///
    /// `name` and `residue` have no outer blanks. In standard residues the first letter tells. An
    /// atom that has the name of its residue, as ions do, is of that element.
    pub fn of_name(name: &[u8], residue: &[u8]) -> Element {
        match name.len() {
            0 | 4.. => Element::of_columns(name, residue),
            // As if it stood where all names of one-letter elements do.
            length => {
                let mut columns = *b"    ";
                let two = Element::leading_pair(name, &IN_LONG_NAMES).is_some();
                let start = usize::from(!two);
                columns[start..start + length].copy_from_slice(name);
                Element::of_columns(&columns, residue)
            }
        }
    }

    /// The element that a name in its four columns tells (13 to 16 of a PDB file): symbols end in the
    /// second, so that ` CA ` is a carbon and `CA  ` calcium.
    ///
    /// Names of four letters fill all columns whatever their element. In standard residues, where
    /// some programs shift names to the left, the first letter tells. An atom that has the name of
    /// its residue, as ions do, is of that element. Source: wwPDB, Format 3.3 (2012), ATOM.
    pub fn of_columns(columns: &[u8], residue: &[u8]) -> Element {
        let name = columns.trim_ascii();
        if name.eq_ignore_ascii_case(residue)
            && let Some(element) = Element::of_ion(name)
        {
            return element;
        }
        let letters = name.trim_ascii_start();
        let digits = letters.iter().take_while(|b| b.is_ascii_digit()).count();
        let letters = &letters[digits..];
        let first = letters.get(..1).and_then(Element::from_symbol);
        if polymer::is_standard(residue) {
            return first.unwrap_or_default();
        }
        let shifted = digits > 0 || columns.first() == Some(&b' ');
        let pair = if shifted {
            None
        } else if name.len() >= 4 {
            Element::leading_pair(letters, &IN_LONG_NAMES)
        } else if letters
            .first()
            .is_some_and(|b| b.eq_ignore_ascii_case(&b'h'))
        {
            // `HG  ` of a ligand is far more often a hydrogen than mercury, which has its own residue.
            None
        } else {
            let end = letters.len().min(2);
            Element::from_symbol(&letters[..end])
        };
        pair.or(first).unwrap_or_default()
    }

    /// The element of an ion's name: `ZN`, `Cl-`, `NA+`, `FE2`.
    fn of_ion(name: &[u8]) -> Option<Element> {
        let end = name.iter().position(|b| !b.is_ascii_alphabetic());
        Element::from_symbol(&name[..end.unwrap_or(name.len())])
    }

    fn leading_pair(letters: &[u8], known: &[&str]) -> Option<Element> {
        let pair = letters.get(..2)?;
        let is_known = |symbol: &str| symbol.as_bytes().eq_ignore_ascii_case(pair);
        known
            .iter()
            .any(|symbol| is_known(symbol))
            .then(|| Element::from_symbol(pair))?
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.symbol())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_are_read_back() {
        for number in 1..=118 {
            let symbol = Element(number).symbol();
            assert_eq!(
                Element::from_symbol(symbol.to_uppercase().as_bytes()),
                Some(Element(number))
            );
        }
        assert_eq!(Element::UNKNOWN.symbol(), "X");
        assert_eq!(Element(200).symbol(), "X");
        assert_eq!(Element::from_symbol(b"D"), Some(Element::HYDROGEN));
        assert_eq!(Element::from_symbol(b"Xx"), None);
        assert_eq!(Element::from_symbol(b""), None);
    }

    #[test]
    fn columns_tell_the_element() {
        for (columns, residue, symbol) in [
            (" CA ", "GLY", "C"),
            ("CA  ", "GLY", "C"),
            ("CA  ", " CA", "Ca"),
            (" CA ", "CA", "Ca"),
            ("CA  ", "LIG", "Ca"),
            (" CA ", "LIG", "C"),
            ("FE  ", "HEM", "Fe"),
            (" NA ", "HEM", "N"),
            ("NA  ", "NA", "Na"),
            ("HG11", "VAL", "H"),
            ("1HB ", "ALA", "H"),
            ("2HG1", "VAL", "H"),
            ("HMA1", "HEM", "H"),
            ("HO5'", "LIG", "H"),
            ("HG  ", "LIG", "H"),
            ("HG  ", "HG", "Hg"),
            ("CD12", "LIG", "C"),
            ("CL12", "LIG", "Cl"),
            ("SE  ", "MSE", "Se"),
            (" SD ", "MET", "S"),
            ("MN  ", "MN", "Mn"),
            (" OXT", "LEU", "O"),
            ("DA  ", "ALA", "H"),
            ("    ", "ALA", "X"),
            ("Q1  ", "LIG", "X"),
        ] {
            let found = Element::of_columns(columns.as_bytes(), residue.trim().as_bytes());
            assert_eq!(found.symbol(), symbol, "{columns:?} of {residue}");
        }
    }

    #[test]
    fn names_alone_tell_the_element() {
        for (name, residue, symbol) in [
            ("CA", "ALA", "C"),
            ("CA", "CA", "Ca"),
            ("CA", "LIG", "C"),
            ("FE", "HEM", "Fe"),
            ("CL1", "LIG", "Cl"),
            ("HG21", "THR", "H"),
            ("1HD2", "LEU", "H"),
            ("Cl-", "Cl-", "Cl"),
            ("NA+", "NA+", "Na"),
            ("SE", "MSE", "Se"),
            ("OP1", "DA", "O"),
            ("", "", "X"),
        ] {
            let found = Element::of_name(name.as_bytes(), residue.as_bytes());
            assert_eq!(found.symbol(), symbol, "{name:?} of {residue}");
        }
    }
}
