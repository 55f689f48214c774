//! PQR: atoms with their charge and radius, as force fields give them.
//!
//! Lines of `ATOM` and `HETATM` are words parted by blanks: serial number, name, residue, chain (which
//! may be missing), number of the residue with its insertion code, x, y, z, charge, radius. Elements are
//! told by the names ([`Element::of_name`]). Source: the format as APBS and PDB2PQR describe it (T. J.
//! Dolinsky et al., Nucleic Acids Res. 32, 2004).

use super::gather::{BLANK, Gathered, name, radius};
use super::hybrid36;
use super::refusal::Refusal;
use super::text::{Lines, finite, integer, number, shown, words};
use crate::error::Fault;
use crate::io::source::Source;
use crate::protein::builder::Place;
use crate::protein::{Atom, Element, Molecule};
use crate::report::{Tally, Warning};

/// Bytes of a line with its end, as most files have them.
const ROW: usize = 71;

/// Reads atoms, residues and models, in the order of the file; `ENDMDL` and `END` end a model.
///
/// Charges are left out with a counted warning. Errs with the line where there are not ten or eleven
/// words, one of them is not the number that it has to be, or a radius is negative; and where atoms take
/// more than the source may hold. Cost: linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Molecule, Refusal> {
    let bytes = source.bytes();
    let mut gathered = Gathered::new(bytes.len(), ROW, source.limit());
    let mut charges = Tally::default();
    let mut has_ended = false;
    let mut lines = Lines::new(bytes);
    while let Some(line) = lines.next() {
        let at = lines.number();
        let mut words = words(line);
        let builder = &mut gathered.builder;
        match words.next() {
            Some(b"TER") => builder.end_residue(),
            Some(b"ENDMDL" | b"END") => has_ended = true,
            Some(b"MODEL") => {
                let next = builder.model().map_or(1, |model| model.saturating_add(1));
                let number = words.next().map_or(Some(next), small);
                let number =
                    number.ok_or_else(|| Fault::line(at, "the model has no whole number"))?;
                builder.begin_model(number);
                has_ended = false;
            }
            Some(record @ (b"ATOM" | b"HETATM")) => {
                let words: Vec<&[u8]> = words.collect();
                let (place, atom) = read_atom(&words, at)?;
                let hetero = record == b"HETATM";
                if std::mem::take(&mut has_ended) {
                    let last = builder.model().unwrap_or(0);
                    builder.begin_model(last.saturating_add(1));
                }
                charges.note(at);
                gathered.push(&place, Atom { hetero, ..atom })?;
            }
            _ => {}
        }
    }
    charges.warn("ignored-charges", "charges of atoms are not read", warnings);
    Ok(gathered.finish())
}

/// Whether the first atom of a text of PDB records has charge and radius, which have more decimals than
/// the two figures that a PDB file has in their place.
pub fn is_document(text: &[u8]) -> bool {
    let is_atom = |line: &&[u8]| line.starts_with(b"ATOM ") || line.starts_with(b"HETATM");
    let Some(atom) = Lines::new(text).find(is_atom) else {
        return false;
    };
    let found: Vec<&[u8]> = words(atom).collect();
    let Some([charge, radius]) = found.last_chunk() else {
        return false;
    };
    let decimals = |word: &[u8]| word.iter().rev().position(|b| *b == b'.').unwrap_or(0);
    let are_numbers = number(charge).is_some() && number(radius).is_some();
    are_numbers && decimals(charge) >= 3
}

fn small(word: &[u8]) -> Option<i32> {
    i32::try_from(integer(word)?).ok()
}

/// An atom of the words after the record's name.
fn read_atom(words: &[&[u8]], line: u64) -> Result<(Place, Atom), Fault> {
    let count = words.len();
    let (head, tail) = match words {
        [head @ .., x, y, z, charge, radius] if head.len() == 4 || head.len() == 5 => {
            (head, [*x, *y, *z, *charge, *radius])
        }
        _ => {
            let problem =
                format!("the atom has {count} words after its record, but 9 or 10 are needed");
            return Err(Fault::line(line, problem)
                .with_hint("SERIAL NAME RESIDUE [CHAIN] NUMBER X Y Z CHARGE RADIUS"));
        }
    };
    let serial = hybrid36::read(head[0], 5).ok_or_else(|| {
        Fault::line(
            line,
            format!("the serial number {} is none", shown(head[0])),
        )
    })?;
    let (chain, last) = match head {
        [_, _, _, chain, last] => (*chain, *last),
        // A chain's letter may touch a number of four digits.
        [.., last] => {
            let letters = last.iter().take_while(|b| b.is_ascii_alphabetic()).count();
            last.split_at(letters)
        }
        [] => (&[][..], &[][..]),
    };
    let word = head.last().copied().unwrap_or_default();
    let end = last.len() - usize::from(last.last().is_some_and(u8::is_ascii_alphabetic));
    let residue_number = small(&last[..end])
        .ok_or_else(|| Fault::line(line, format!("the residue number {} is none", shown(word))))?;
    let place = Place {
        name: name(head[2], "residue name", line)?,
        chain: name(chain, "chain", line)?,
        number: residue_number,
        insertion: last.get(end).copied().unwrap_or(b' '),
        in_polymer: false,
    };
    let [x, y, z, charge, own] = tail;
    finite(charge, line)?;
    let atom = Atom {
        position: [finite(x, line)?, finite(y, line)?, finite(z, line)?],
        radius: Some(radius(own, line)?),
        serial,
        name: name(head[1], "atom name", line)?,
        element: Element::of_name(head[1], head[2]),
        ..BLANK
    };
    Ok((place, atom))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<(Molecule, Vec<Warning>), Fault> {
        let source = Source::from_bytes("test.pqr", text.into()).expect("bytes");
        let mut warnings = Vec::new();
        let molecule = read(&source, &mut warnings).map_err(Refusal::fault)?;
        molecule.check()?;
        Ok((molecule, warnings))
    }

    #[test]
    fn chains_may_be_there_or_not() {
        let (molecule, warnings) = read_text(
            "REMARK   1 PQR\nATOM      1  N   MET     1      27.340  24.430   2.614  0.1592 1.8240\n\
             ATOM      2  CA  MET A   1      26.266  25.413   2.842  0.0221 1.9080\n\
             ATOM      3  C   MET A1000      26.913  26.639   3.531  0.6123 1.9080\n\
             HETATM    4  ZN  ZN  B  52A      1.0 2.0 -3e0 2 1.10\nTER\nEND\n",
        )
        .expect("a molecule");
        let said: Vec<String> = molecule.residues.iter().map(|r| r.to_string()).collect();
        assert_eq!(said, ["1", "A:1", "A:1000", "B:52A"]);
        let radii: Vec<_> = molecule.atoms.iter().map(|atom| atom.radius).collect();
        assert_eq!(radii, [1.824, 1.908, 1.908, 1.1].map(Some));
        let symbols: Vec<_> = molecule.atoms.iter().map(|a| a.element.symbol()).collect();
        assert_eq!(symbols, ["N", "C", "C", "Zn"]);
        assert_eq!(molecule.atoms[3].position, [1.0, 2.0, -3.0]);
        assert!(molecule.atoms[3].hetero && !molecule.atoms[2].hetero);
        let codes: Vec<_> = warnings.iter().map(|w| (&*w.code, w.count)).collect();
        assert_eq!(codes, [("ignored-charges", 4)]);
    }

    #[test]
    fn models_end_as_in_pdb_files() {
        let atom = "ATOM 1 N MET 1 0 0 0 0.1 1.8\n";
        let text = format!("MODEL 3\n{atom}ENDMDL\nMODEL\n{atom}END\n{atom}");
        let (molecule, _) = read_text(&text).expect("a molecule");
        let numbers: Vec<_> = molecule.models.iter().map(|m| m.number).collect();
        assert_eq!(numbers, [3, 4, 5]);
    }

    #[test]
    fn faults_name_the_line() {
        let message = |words: &str| {
            let text = format!("REMARK\nATOM {words}\n");
            read_text(&text).expect_err("a fault").to_string()
        };
        assert_eq!(
            message("1 N MET 0 0 0 0.1 1.8"),
            "2: the atom has 8 words after its record, but 9 or 10 are needed"
        );
        assert_eq!(
            message("1 N MET 1 0 0 0 0.1 -1.8"),
            "2: the radius \"-1.8\" is negative"
        );
        assert_eq!(
            message("1 N MET 1 0 0 0 0.1 nan"),
            "2: the radius \"nan\" is not finite"
        );
        assert_eq!(message("1 N MET 1 0 x 0 0.1 1"), "2: \"x\" is not a number");
        assert_eq!(
            message("1 N MET x 0 0 0 0.1 1"),
            "2: the residue number \"x\" is none"
        );
        assert_eq!(
            message("*** N MET 1 0 0 0 0.1 1"),
            "2: the serial number \"***\" is none"
        );
    }
}
