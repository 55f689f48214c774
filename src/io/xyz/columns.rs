//! What the columns of a text of points are: by their names, or by how many there are.

use super::Split;
use crate::error::Fault;
use crate::io::text::number;

/// What three columns after the position are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    Normal,
    Color,
    /// A normal where all of them have unit length, else a colour.
    Either,
}

/// Which column is what.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    pub position: [usize; 3],
    pub groups: Vec<(Role, [usize; 3])>,
    pub alpha: Option<usize>,
    pub class: Option<usize>,
    /// How many values a row has.
    pub width: usize,
    /// The columns that are not read, by their names or numbers from 1.
    pub ignored: Vec<String>,
}

impl Columns {
    /// By the names in the first line. Errs with the name of an axis that no column, or more than one, has.
    pub fn named(names: &[&[u8]]) -> Result<Columns, String> {
        let bare: Vec<String> = names.iter().map(|name| bare(name)).collect();
        let find = |known: &[&str]| bare.iter().position(|name| known.contains(&name.as_str()));
        let all = |known: [&[&str]; 3]| {
            let [a, b, c] = known.map(find);
            Some([a?, b?, c?])
        };
        for axis in ["x", "y", "z"] {
            match bare.iter().filter(|name| *name == axis).count() {
                0 => return Err(format!("no column is named {axis}")),
                1 => {}
                count => return Err(format!("{count} columns are named {axis}")),
            }
        }
        let position = all([&["x"], &["y"], &["z"]]).unwrap_or([0, 1, 2]);
        let normal = all([
            &["nx", "normal_x", "normalx"],
            &["ny", "normal_y", "normaly"],
            &["nz", "normal_z", "normalz"],
        ]);
        let color = all([&["r", "red"], &["g", "green"], &["b", "blue"]]);
        let alpha = find(&["a", "alpha"]).filter(|_| color.is_some());
        let class = find(&["class", "classification", "scalar_classification"]);
        let groups = [(Role::Normal, normal), (Role::Color, color)];
        let groups: Vec<_> = groups
            .into_iter()
            .filter_map(|(role, columns)| Some((role, columns?)))
            .collect();
        let read = position.into_iter().chain(alpha).chain(class);
        let read: Vec<usize> = read
            .chain(groups.iter().flat_map(|(_, columns)| *columns))
            .collect();
        let ignored = (0..bare.len()).filter(|at| !read.contains(at));
        let ignored = ignored.map(|at| bare[at].clone()).collect();
        Ok(Columns {
            position,
            groups,
            alpha,
            class,
            width: names.len(),
            ignored,
        })
    }

    /// By how many there are; a file of `.pts` has an intensity before the colour.
    pub fn counted(width: usize, is_pts: bool) -> Columns {
        let groups = match width {
            7 if is_pts => vec![(Role::Color, [4, 5, 6])],
            6..=8 => vec![(Role::Either, [3, 4, 5])],
            9.. => vec![(Role::Either, [3, 4, 5]), (Role::Either, [6, 7, 8])],
            _ => Vec::new(),
        };
        let read = |at: &usize| groups.iter().any(|(_, columns)| columns.contains(at));
        let ignored = (3..width).filter(|at| !read(at));
        let ignored = ignored.map(|at| format!("column {}", at + 1)).collect();
        Columns {
            position: [0, 1, 2],
            groups,
            alpha: None,
            class: None,
            width,
            ignored,
        }
    }
}

/// A name in lower case, without quotes and without what makes its line a comment.
fn bare(name: &[u8]) -> String {
    let name = name.trim_ascii();
    let inner = name.strip_prefix(b"\"").and_then(|n| n.strip_suffix(b"\""));
    String::from_utf8_lossy(inner.unwrap_or(name).trim_ascii()).to_lowercase()
}

/// Whether a line of values has the names of the columns of points, and not of spheres.
pub fn are_names(names: &[&[u8]]) -> bool {
    let is_sphere = || {
        let has = |known: &[&str]| {
            names
                .iter()
                .any(|name| known.contains(&bare(name).as_str()))
        };
        has(&["r", "radius"]) && !(has(&["g", "green"]) && has(&["b", "blue"]))
    };
    Columns::named(names).is_ok() && !is_sphere()
}

/// Whether a row without names is one of points: no other text has rows of so many numbers alone.
pub fn are_values(values: &[&[u8]]) -> bool {
    let is_number = |word: &&[u8]| number(word).is_some();
    (values.len() == 3 || values.len() >= 6) && values.iter().all(is_number)
}

/// How the values of a line are parted.
pub fn split_of(line: &[u8]) -> Split {
    if line.contains(&b';') {
        Split::At(b';')
    } else if line.contains(&b',') {
        Split::At(b',')
    } else {
        Split::Blanks
    }
}

/// The fault of a first line that has neither numbers nor names.
pub fn no_columns(problem: String, line: u64) -> Fault {
    let hint = "rows are x y z, and may go on with a normal, a colour or both; other columns are named \
                in the first line; atoms are read from pdb, cif and pqr";
    Fault::line(line, problem).with_hint(hint)
}
