//! Writing mmCIF files.

use crate::io::text::{push_number, spill};
use crate::protein::{Atom, Molecule, Name, Residue};
use std::io::{self, Write};

/// The columns, in the order in which the wwPDB has them.
const COLUMNS: [&str; 19] = [
    "group_PDB",
    "id",
    "type_symbol",
    "label_atom_id",
    "label_alt_id",
    "label_comp_id",
    "label_asym_id",
    "label_seq_id",
    "pdbx_PDB_ins_code",
    "Cartn_x",
    "Cartn_y",
    "Cartn_z",
    "occupancy",
    "B_iso_or_equiv",
    "auth_seq_id",
    "auth_comp_id",
    "auth_asym_id",
    "auth_atom_id",
    "pdbx_PDB_model_num",
];

/// Writes a data block of atoms, with all digits that numbers have.
///
/// Where an atom has a radius of its own that stands in place of the temperature factor. Chains, residues
/// and atoms are named as by their author; a residue has a place in the sequence, counted from 1 along its
/// chain, where the molecule says that it is of a polymer. Cost: linear.
pub fn write(molecule: &Molecule, out: &mut dyn Write) -> io::Result<()> {
    let mut text = Vec::new();
    let is_plain = |c: char| c.is_ascii_graphic() && c != '#';
    let id: String = molecule.id.chars().filter(|c| is_plain(*c)).collect();
    let id = if id.is_empty() { "molecule" } else { &id };
    writeln!(text, "data_{id}\n#\nloop_")?;
    for column in COLUMNS {
        writeln!(text, "_atom_site.{column}")?;
    }
    for (index, model) in molecule.models.iter().enumerate() {
        let mut in_chain = (Name::EMPTY, 0u64);
        for residue in &molecule.residues[molecule.residues_in(index)] {
            if in_chain.0 != residue.chain {
                in_chain = (residue.chain, 0);
            }
            in_chain.1 += u64::from(residue.in_polymer);
            let words = Words::new(residue, in_chain.1, model.number);
            for atom in molecule.atoms_in(&residue.atoms) {
                write_atom(&mut text, atom, &words)?;
            }
            spill(&mut text, out)?;
        }
    }
    text.extend(b"#\n");
    out.write_all(&text)
}

/// What the atoms of a residue have in common.
struct Words {
    name: Vec<u8>,
    chain: Vec<u8>,
    sequence: String,
    insertion: Vec<u8>,
    number: i32,
    model: i32,
}

impl Words {
    fn new(residue: &Residue, place: u64, model: i32) -> Self {
        Words {
            name: quoted(residue.name.as_bytes(), b"."),
            chain: quoted(residue.chain.as_bytes(), b"."),
            sequence: if residue.in_polymer {
                place.to_string()
            } else {
                ".".to_owned()
            },
            insertion: quoted(&letter(residue.insertion), b"?"),
            number: residue.number,
            model,
        }
    }
}

fn letter(byte: u8) -> Vec<u8> {
    if byte == b' ' { Vec::new() } else { vec![byte] }
}

fn write_atom(text: &mut Vec<u8>, atom: &Atom, of: &Words) -> io::Result<()> {
    text.extend(if atom.hetero {
        &b"HETATM "[..]
    } else {
        b"ATOM "
    });
    write!(
        text,
        "{} {} ",
        atom.serial,
        if atom.element.0 == 0 {
            "?"
        } else {
            atom.element.symbol()
        }
    )?;
    let name = quoted(atom.name.as_bytes(), b".");
    let alternative = quoted(&letter(atom.altloc), b".");
    for word in [&name, &alternative, &of.name, &of.chain] {
        text.extend(word);
        text.push(b' ');
    }
    write!(text, "{} ", of.sequence)?;
    text.extend(&of.insertion);
    let factor = atom.radius.unwrap_or_else(|| shortest(atom.b_factor));
    for number in atom
        .position
        .into_iter()
        .chain([shortest(atom.occupancy), factor])
    {
        text.push(b' ');
        push_number(text, number);
    }
    write!(text, " {} ", of.number)?;
    for word in [&of.name, &of.chain, &name] {
        text.extend(word);
        text.push(b' ');
    }
    writeln!(text, "{}", of.model)
}

/// The number of the shortest decimal that reads back as the same number of single precision.
fn shortest(value: f32) -> f64 {
    let hundredths = (f64::from(value) * 100.0).round() / 100.0;
    // Of up to six digits each decimal is read as another number.
    if value.abs() < 1e4 && hundredths as f32 == value {
        return hundredths;
    }
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// A word as a value: quoted where it needs to be, `missing` where it is empty.
///
/// A name that neither quote can hold stands in a block of text.
fn quoted(word: &[u8], missing: &[u8]) -> Vec<u8> {
    if word.is_empty() {
        return missing.to_vec();
    }
    let begins_plainly = !b"_#$'\"[];".contains(&word[0]);
    let lower = word.to_ascii_lowercase();
    let reserved = [&b"data_"[..], b"save_", b"loop_", b"stop_", b"global_"];
    let is_reserved = reserved.iter().any(|start| lower.starts_with(start));
    let is_whole = !word.contains(&b' ');
    if begins_plainly && is_whole && !is_reserved && word != b"?" && word != b"." {
        return word.to_vec();
    }
    let holds = |quote: u8| {
        !word
            .windows(2)
            .any(|pair| pair[0] == quote && pair[1] == b' ')
    };
    for quote in [b'\'', b'"'] {
        if holds(quote) {
            return [&[quote], word, &[quote]].concat();
        }
    }
    [b"\n;", word, b"\n;\n"].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_they_need_to_be() {
        for (word, value) in [
            ("CA", "CA"),
            ("O5'", "O5'"),
            ("", "."),
            (".", "'.'"),
            ("?", "'?'"),
            ("_x", "'_x'"),
            ("'", "'''"),
            ("a b", "'a b'"),
            ("a' b", "\"a' b\""),
            ("a' \" b", "\n;a' \" b\n;\n"),
            ("LOOP_", "'LOOP_'"),
            ("#", "'#'"),
        ] {
            assert_eq!(quoted(word.as_bytes(), b"."), value.as_bytes(), "{word}");
        }
    }
}
