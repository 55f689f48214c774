//! Spheres: a centre and a radius on each line, parted by blanks (XYZR) or by commas (CSV).
//!
//! `#` begins a comment. A CSV file may begin with the names of its columns, of which `x`, `y`, `z` and `r`
//! or `radius` are read; without them the first four are. All spheres are atoms of one residue without a
//! name, with serial numbers from 1, of no known element.

use super::gather::{BLANK, Gathered, radius};
use super::refusal::Refusal;
use super::text::{Lines, finite, number, push_number, shown, spill, words};
use crate::error::Fault;
use crate::io::source::Source;
use crate::protein::builder::Place;
use crate::protein::radii::Radii;
use crate::protein::{Atom, Molecule};
use crate::report::{Tally, Warning};
use std::io::{self, Write};

/// Bytes of a line with its end, as most files have them.
const ROW: usize = 24;

/// What is read, in any case.
const COLUMNS: [&[&str]; 4] = [&["x"], &["y"], &["z"], &["r", "radius"]];

/// How lines are parted into values.
type Split = for<'a> fn(&'a [u8]) -> Vec<&'a [u8]>;

/// Reads spheres whose values are parted by blanks.
///
/// Values after the fourth are left out with a counted warning. Errs with the line where there are fewer
/// than four, one is no finite number, or a radius is negative; and where atoms take more than the source
/// may hold. Cost: linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Molecule, Refusal> {
    let mut lines = Lines::new(unmarked(source.bytes()));
    read_rows(source, &mut lines, [0, 1, 2, 3], None, by_blanks, warnings)
}

/// Reads spheres whose values are parted by commas.
///
/// Errs as [`read`] does, and where a line of names lacks one that is read, or has it twice. Cost: linear
/// in the bytes.
pub fn read_csv(source: &Source, warnings: &mut Vec<Warning>) -> Result<Molecule, Refusal> {
    let mut lines = Lines::new(unmarked(source.bytes()));
    let after_names = &mut lines.clone();
    let first = after_names.next_filled().map(by_commas).unwrap_or_default();
    if first.first().is_none_or(|word| number(word).is_some()) {
        return read_rows(source, &mut lines, [0, 1, 2, 3], None, by_commas, warnings);
    }
    let at = places(&first, after_names.number())?;
    let width = Some(first.len());
    read_rows(source, after_names, at, width, by_commas, warnings)
}

/// Whether a text begins with the names of the columns of a CSV file.
pub fn is_document(text: &[u8]) -> bool {
    let mut lines = Lines::new(unmarked(text));
    let first = lines.next_filled().map(by_commas).unwrap_or_default();
    places(&first, 1).is_ok()
}

fn unmarked(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

fn by_blanks(line: &[u8]) -> Vec<&[u8]> {
    words(line).collect()
}

fn by_commas(line: &[u8]) -> Vec<&[u8]> {
    let values = line.split(|b| *b == b',').map(<[u8]>::trim_ascii);
    values.collect()
}

/// Where the columns that are read stand among the names of all.
fn places(names: &[&[u8]], line: u64) -> Result<[usize; 4], Fault> {
    let mut places = [0; 4];
    for (place, known) in places.iter_mut().zip(COLUMNS) {
        let is_it = |name: &[u8]| {
            let bare = name
                .strip_prefix(b"\"")
                .and_then(|name| name.strip_suffix(b"\""));
            let name = bare.unwrap_or(name).trim_ascii();
            known
                .iter()
                .any(|k| k.as_bytes().eq_ignore_ascii_case(name))
        };
        let mut found = (0..names.len()).filter(|i| is_it(names[*i]));
        *place = match (found.next(), found.next()) {
            (Some(place), None) => place,
            (Some(_), Some(_)) => {
                let problem = format!("two columns are named {}", known.join(" or "));
                return Err(Fault::line(line, problem));
            }
            (None, _) => {
                let problem = format!("no column is named {}", known.join(" or "));
                return Err(Fault::line(line, problem).with_hint(
                    "the columns are x, y, z and r, named in the first line or in that order",
                ));
            }
        };
    }
    Ok(places)
}

/// Reads the rows from here on; `width` is how many values each has, where that is known.
fn read_rows(
    source: &Source,
    lines: &mut Lines,
    places: [usize; 4],
    width: Option<usize>,
    split: Split,
    warnings: &mut Vec<Warning>,
) -> Result<Molecule, Refusal> {
    let mut gathered = Gathered::new(lines.bytes_left(), ROW, source.limit());
    let mut extra = Tally::default();
    let needed = width.unwrap_or(places.len());
    while let Some(line) = lines.next_filled() {
        let at = lines.number();
        let values = split(line);
        if values.len() < needed || width.is_some_and(|width| values.len() > width) {
            let count = values.len();
            let problem = format!(
                "has {count} values, but {needed} are needed: {}",
                shown(line)
            );
            return Err(Fault::line(at, problem).into());
        }
        if values.len() > places.len() {
            extra.note(at);
        }
        let value = |k: usize| values[places[k]];
        let atom = Atom {
            position: [
                finite(value(0), at)?,
                finite(value(1), at)?,
                finite(value(2), at)?,
            ],
            radius: Some(radius(value(3), at)?),
            serial: gathered.builder.len() as i64 + 1,
            ..BLANK
        };
        gathered.push(
            &Place {
                insertion: b' ',
                ..Place::default()
            },
            atom,
        )?;
    }
    extra.warn(
        "extra-values",
        "lines with more than x, y, z and radius; the rest is not read",
        warnings,
    );
    Ok(gathered.finish())
}

/// Writes the spheres of the first model, parted by blanks.
///
/// Atoms without a radius of their own have that of their element. Cost: linear.
pub fn write(molecule: &Molecule, out: &mut dyn Write) -> io::Result<()> {
    write_rows(molecule, b' ', Vec::new(), out)
}

/// Writes the spheres of the first model, parted by commas, after a line of names.
pub fn write_csv(molecule: &Molecule, out: &mut dyn Write) -> io::Result<()> {
    write_rows(molecule, b',', b"x,y,z,r\n".to_vec(), out)
}

fn write_rows(
    molecule: &Molecule,
    between: u8,
    mut text: Vec<u8>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let radii = Radii::default();
    let first = molecule
        .models
        .first()
        .map_or(0..0, |model| model.atoms.clone());
    for atom in molecule.atoms_in(&first) {
        for coordinate in atom.position {
            push_number(&mut text, coordinate);
            text.push(between);
        }
        push_number(&mut text, radii.of(atom, molecule.residue_of(atom)).0);
        text.push(b'\n');
        spill(&mut text, out)?;
    }
    out.write_all(&text)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Reader = fn(&Source, &mut Vec<Warning>) -> Result<Molecule, Refusal>;

    fn read_text(reader: Reader, text: &str) -> Result<(Vec<[f64; 4]>, Vec<Warning>), Fault> {
        let source = Source::from_bytes("test", text.into()).expect("bytes");
        let mut warnings = Vec::new();
        let molecule = reader(&source, &mut warnings).map_err(Refusal::fault)?;
        molecule.check()?;
        let rows = molecule.atoms.iter().map(|atom| {
            let [x, y, z] = atom.position;
            [x, y, z, atom.radius.expect("a radius")]
        });
        Ok((rows.collect(), warnings))
    }

    fn message(reader: Reader, text: &str) -> String {
        read_text(reader, text).expect_err("a fault").to_string()
    }

    #[test]
    fn rows_are_spheres() {
        let (rows, warnings) =
            read_text(read, "# x y z r\n1 2 3 1.7\n\n-1e2\t.5 0 0 CA # an atom\n").expect("rows");
        assert_eq!(rows, [[1.0, 2.0, 3.0, 1.7], [-100.0, 0.5, 0.0, 0.0]]);
        assert_eq!((&*warnings[0].code, warnings[0].count), ("extra-values", 1));
    }

    #[test]
    fn columns_have_names_or_not() {
        for text in [
            "1,2,3,1.5\n",
            "x,y,z,r\n1,2,3,1.5\n",
            "\u{feff}\"Radius\", Z ,y,name,X\r\n1.5,3,2,CA,1\r\n",
        ] {
            let (rows, _) = read_text(read_csv, text).expect("rows");
            assert_eq!(rows, [[1.0, 2.0, 3.0, 1.5]], "{text:?}");
        }
        assert!(is_document(b"# spheres\nx,y,z,radius\n"));
        assert!(!is_document(b"x,y,z\n1,2,3\n") && !is_document(b""));
    }

    #[test]
    fn faults_name_the_line() {
        assert_eq!(
            message(read, "1 2 3 4\n1 2 3\n"),
            "2: has 3 values, but 4 are needed: \"1 2 3\""
        );
        assert_eq!(message(read, "1 2 x 4\n"), "1: \"x\" is not a number");
        assert_eq!(message(read, "1 2 inf 4\n"), "1: \"inf\" is not finite");
        assert_eq!(
            message(read, "1 2 3 -4\n"),
            "1: the radius \"-4\" is negative"
        );
        assert_eq!(message(read, "# none\n"), "holds no atoms");
        assert_eq!(
            message(read_csv, "x,y,z\n1,2,3\n"),
            "1: no column is named r or radius"
        );
        assert_eq!(
            message(read_csv, "x,y,z,r,R\n"),
            "1: two columns are named r or radius"
        );
        assert_eq!(
            message(read_csv, "x,y,z,r,n\n1,2,3,4\n"),
            "2: has 4 values, but 5 are needed: \"1,2,3,4\""
        );
        assert_eq!(message(read_csv, "1;2;3;4\n"), "1: no column is named x");
    }
}
