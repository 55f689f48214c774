//! Writing PDB files.

use crate::error::number;
use crate::io::hybrid36;
use crate::protein::{Atom, Molecule, Name, Residue};
use std::collections::BTreeSet;
use std::io::{self, Write};

/// Why a molecule does not fit the columns, if it does not: which atom, and which of its figures.
///
/// Coordinates have eight columns with three decimals, names of atoms four, of residues four, of chains
/// one. Cost: linear.
pub fn refusal(molecule: &Molecule) -> Option<String> {
    let residues = molecule.residues.iter();
    let wrong = residues.filter_map(|residue| {
        let problem = refusal_of_residue(residue)?;
        Some(format!("residue {} {residue} {problem}", residue.name))
    });
    let atoms = molecule.atoms.iter().enumerate();
    let wrong_atoms = atoms.filter_map(|(index, atom)| {
        let problem = refusal_of_atom(atom)?;
        Some(format!("atom {index} {problem}"))
    });
    let models = molecule.models.iter();
    let wrong_models = models.filter_map(|model| {
        let number = model.number;
        let fits = (-999..=9999).contains(&number);
        (!fits).then(|| format!("model number {number} does not fit 4 columns"))
    });
    let problem = wrong.chain(wrong_atoms).chain(wrong_models).next()?;
    Some(format!("does not hold it: {problem}; cif does"))
}

fn refusal_of_residue(residue: &Residue) -> Option<String> {
    let long = |what: &str, name: Name, most: usize| {
        let is_long = name.as_bytes().len() > most;
        is_long.then(|| format!("has the {what} {name:?}, longer than {most} columns"))
    };
    let no_number = || {
        let fits = hybrid36::write(i64::from(residue.number), 4).is_some();
        (!fits).then(|| "has a number that does not fit 4 columns".to_owned())
    };
    long("name", residue.name, 4)
        .or_else(|| long("chain", residue.chain, 1))
        .or_else(no_number)
}

fn refusal_of_atom(atom: &Atom) -> Option<String> {
    if atom.name.as_bytes().len() > 4 {
        return Some(format!(
            "has the name {:?}, longer than 4 columns",
            atom.name
        ));
    }
    for value in atom.position {
        if fixed(value, 8, 3, 3).is_none() {
            let value = number(value);
            return Some(format!(
                "has the coordinate {value}, which does not fit 8 columns"
            ));
        }
    }
    for (what, value) in [
        ("occupancy", f64::from(atom.occupancy)),
        ("radius or temperature factor", factor(atom)),
    ] {
        if fixed(value, 6, 2, 0).is_none() {
            let value = number(value);
            return Some(format!(
                "has the {what} {value}, which does not fit 6 columns"
            ));
        }
    }
    if hybrid36::write(atom.serial, 5).is_none() {
        let serial = atom.serial;
        return Some(format!(
            "has the serial number {serial}, which does not fit 5 columns"
        ));
    }
    None
}

/// What stands in the columns of the temperature factor: the radius, where an atom has its own.
fn factor(atom: &Atom) -> f64 {
    atom.radius.unwrap_or(f64::from(atom.b_factor))
}

/// How many atoms have coordinates, and how many a radius, with more decimals than there are columns.
pub fn rounded(molecule: &Molecule) -> [u64; 2] {
    let loses = |value: f64, decimals: usize| format!("{value:.decimals$}").parse() != Ok(value);
    let mut rounded = [0; 2];
    for atom in &molecule.atoms {
        rounded[0] += u64::from(atom.position.iter().any(|c| loses(*c, 3)));
        rounded[1] += u64::from(atom.radius.is_some_and(|radius| loses(radius, 2)));
    }
    rounded
}

/// A number in a width, with `decimals` decimals, or with as many fewer as it takes, but at least `least`.
fn fixed(value: f64, width: usize, decimals: usize, least: usize) -> Option<String> {
    (least..=decimals).rev().find_map(|decimals| {
        let text = format!("{value:width$.decimals$}");
        (text.len() <= width).then_some(text)
    })
}

/// Writes the records `MODRES` of residues that are held as `HETATM` but stand in a polymer.
fn write_modified(text: &mut Vec<u8>, molecule: &Molecule) -> io::Result<()> {
    let mut written = BTreeSet::new();
    for residue in molecule
        .residues
        .iter()
        .filter(|residue| residue.in_polymer)
    {
        let key = (
            residue.name,
            residue.chain,
            residue.number,
            residue.insertion,
        );
        let is_hetero = molecule.atoms_in(&residue.atoms)[0].hetero;
        let is_short = residue.name.as_bytes().len() <= 3;
        if is_hetero && is_short && written.insert(key) {
            let number = hybrid36::write(i64::from(residue.number), 4).ok_or_else(no_room)?;
            let (name, chain) = (residue.name, residue.chain);
            let insertion = char::from(residue.insertion);
            let id = if has_id(molecule) { &molecule.id } else { "" };
            writeln!(
                text,
                "{:<80}",
                format!("MODRES {id:4} {name:>3} {chain:1} {number:>4}{insertion}")
            )?;
        }
    }
    Ok(())
}

/// Whether the entry's name fits its columns.
fn has_id(molecule: &Molecule) -> bool {
    molecule.id.len() == 4 && molecule.id.bytes().all(|b| b.is_ascii_alphanumeric())
}

/// Writes atoms and models; of several models each between `MODEL` and `ENDMDL`.
///
/// Chains end with `TER`. Where an atom has a radius of its own that stands in place of the temperature
/// factor. A molecule that [`refusal`] has something against is an error of the writer. Cost: linear.
pub fn write(molecule: &Molecule, out: &mut dyn Write) -> io::Result<()> {
    let mut text = Vec::new();
    if has_id(molecule) {
        writeln!(text, "{:<62}{:<18}", "HEADER", molecule.id)?;
    }
    write_modified(&mut text, molecule)?;
    let has_models = molecule.models.len() > 1 || molecule.models.iter().any(|m| m.number != 1);
    for (index, model) in molecule.models.iter().enumerate() {
        if has_models {
            writeln!(text, "{:<80}", format!("MODEL     {:>4}", model.number))?;
        }
        let residues = &molecule.residues[molecule.residues_in(index)];
        let mut chain = residues.first().map(|residue| residue.chain);
        for residue in residues {
            if chain != Some(residue.chain) {
                writeln!(text, "{:<80}", "TER")?;
                chain = Some(residue.chain);
            }
            for atom in molecule.atoms_in(&residue.atoms) {
                write_atom(&mut text, atom, residue).ok_or_else(no_room)?;
            }
            crate::io::text::spill(&mut text, out)?;
        }
        writeln!(text, "{:<80}", "TER")?;
        if has_models {
            writeln!(text, "{:<80}", "ENDMDL")?;
        }
    }
    writeln!(text, "{:<80}", "END")?;
    out.write_all(&text)
}

fn no_room() -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidData,
        "a figure does not fit its columns",
    )
}

/// One line; `None` where something does not fit.
fn write_atom(text: &mut Vec<u8>, atom: &Atom, residue: &Residue) -> Option<()> {
    let [x, y, z] = atom.position.map(|c| fixed(c, 8, 3, 3));
    // Writing into a vector does not fail.
    writeln!(
        text,
        "{:<6}{:>5} {}{}{:<4}{:1}{:>4}{}   {}{}{}{}{}{:10}{:>2}  ",
        if atom.hetero { "HETATM" } else { "ATOM" },
        hybrid36::write(atom.serial, 5)?,
        name_columns(atom),
        char::from(atom.altloc),
        residue_columns(residue),
        residue.chain,
        hybrid36::write(i64::from(residue.number), 4)?,
        char::from(residue.insertion),
        x?,
        y?,
        z?,
        fixed(f64::from(atom.occupancy), 6, 2, 0)?,
        fixed(factor(atom), 6, 2, 0)?,
        "",
        atom.element.symbol().to_ascii_uppercase(),
    )
    .ok()
}

/// Names shorter than the four columns begin in the second, unless the symbol has two letters.
fn name_columns(atom: &Atom) -> String {
    let name = if atom.name.is_empty() {
        "X"
    } else {
        atom.name.as_str()
    };
    let symbol = atom.element.symbol();
    let is_wide = symbol.len() == 2
        && name
            .get(..2)
            .is_some_and(|start| start.eq_ignore_ascii_case(symbol));
    if name.len() >= 4 || is_wide {
        format!("{name:<4}")
    } else {
        format!(" {name:<3}")
    }
}

/// Names end in the third column; those of four letters take the blank that follows.
fn residue_columns(residue: &Residue) -> String {
    let name = if residue.name.is_empty() {
        "UNK"
    } else {
        residue.name.as_str()
    };
    format!("{name:>3}")
}
