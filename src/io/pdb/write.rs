//! Writing PDB files.

use crate::error::number;
use crate::io::hybrid36;
use crate::io::text::{push_decimal, spill};
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
        if !fits(value, 8, 3, 3) {
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
        if !fits(value, 6, 2, 0) {
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
    let loses = |value: f64, unit: f64| (value * unit).round() / unit != value;
    let mut rounded = [0; 2];
    for atom in &molecule.atoms {
        rounded[0] += u64::from(atom.position.iter().any(|c| loses(*c, 1e3)));
        rounded[1] += u64::from(atom.radius.is_some_and(|radius| loses(radius, 1e2)));
    }
    rounded
}

/// Appends a number in a width, with `decimals` decimals, or with as many fewer as it takes, but at least
/// `least`. `None`, and nothing appended, where it does not fit.
fn push_fixed(
    text: &mut Vec<u8>,
    value: f64,
    width: usize,
    decimals: usize,
    least: usize,
) -> Option<()> {
    let scaled = value * 10f64.powi(decimals as i32);
    let nearest = scaled.round();
    // Far from a tie and small, all ways of rounding agree.
    if (scaled - nearest).abs() < 0.25 && nearest.abs() < 1e9 {
        let from = text.len();
        text.extend_from_slice(&b"        "[..width]);
        push_decimal(text, nearest as i64, decimals);
        let length = text.len() - from - width;
        if length <= width {
            text.drain(from..from + length);
            return Some(());
        }
        text.truncate(from);
    }
    (least..=decimals).rev().find_map(|decimals| {
        let number = format!("{value:width$.decimals$}");
        let fits = number.len() <= width;
        fits.then(|| text.extend_from_slice(number.as_bytes()))
    })
}

/// Whether [`push_fixed`] finds a way.
fn fits(value: f64, width: usize, decimals: usize, least: usize) -> bool {
    // Far from the ends all ways of rounding agree.
    let largest = 10f64.powi((width - decimals - 1) as i32);
    let is_inside = value > 1.0 - largest / 10.0 && value < largest - 1.0;
    is_inside || push_fixed(&mut Vec::new(), value, width, decimals, least).is_some()
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
            spill(&mut text, out)?;
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
    let record = if atom.hetero { "HETATM" } else { "ATOM" };
    let serial = hybrid36::write(atom.serial, 5)?;
    // Writing into a vector does not fail.
    let _ = write!(text, "{record:<6}{serial:>5} ");
    push_name(text, atom);
    text.push(atom.altloc);
    let name = if residue.name.is_empty() {
        "UNK"
    } else {
        residue.name.as_str()
    };
    let number = hybrid36::write(i64::from(residue.number), 4)?;
    let _ = match name.len() {
        // Names end in the third column; those of four letters take the blank that follows.
        0..=3 => write!(text, "{name:>3} "),
        _ => write!(text, "{name}"),
    };
    let _ = write!(text, "{:1}{number:>4}", residue.chain);
    text.push(residue.insertion);
    text.extend_from_slice(b"   ");
    for coordinate in atom.position {
        push_fixed(text, coordinate, 8, 3, 3)?;
    }
    push_fixed(text, f64::from(atom.occupancy), 6, 2, 0)?;
    push_fixed(text, factor(atom), 6, 2, 0)?;
    let symbol = atom.element.symbol();
    let from = text.len() + 10;
    let _ = writeln!(text, "{:10}{symbol:>2}  ", "");
    text[from..].make_ascii_uppercase();
    Some(())
}

/// Names shorter than the four columns begin in the second, unless the symbol has two letters.
fn push_name(text: &mut Vec<u8>, atom: &Atom) {
    let name = if atom.name.is_empty() {
        "X"
    } else {
        atom.name.as_str()
    };
    let symbol = atom.element.symbol();
    let start = name.get(..2).unwrap_or_default();
    let is_wide = symbol.len() == 2 && start.eq_ignore_ascii_case(symbol);
    let _ = if name.len() >= 4 || is_wide {
        write!(text, "{name:<4}")
    } else {
        write!(text, " {name:<3}")
    };
}
