//! Finding the files of a sequence.

use crate::error::{Error, Fault, Result};
use crate::io::format::{Format, Kind};
use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

/// Whether a word names a sequence: a folder, or a pattern with `*` or `%d` that is no file's name.
pub fn is_sequence(word: &str) -> bool {
    let path = Path::new(word);
    path.is_dir() || (!path.is_file() && Pattern::of(path).is_some())
}

/// The files of a sequence, in its order.
///
/// A folder stands for all meshes in it by the extensions of their names, of the one format that is
/// asked for or that there is; numbers in names count as numbers, so `frame2` comes before `frame10`.
/// A pattern is the path of a file with one `*` in its name, for anything, sorted likewise; or with
/// one `%d` for a number, or `%04d` for one filled with zeros to four digits.
///
/// # Errors
///
/// No file; meshes of two formats in a folder, both named; with `%d` a number that is left out, with
/// the name that is missing.
pub fn find(word: &str, format: Option<Format>) -> Result<Vec<PathBuf>> {
    let path = Path::new(word);
    if path.is_dir() {
        return in_folder(path, format);
    }
    let wrong = |problem: &str| malformed(path, problem.to_owned());
    match Pattern::of(path) {
        Some(Pattern::Any { before, after }) => {
            let fits = |name: &str| {
                name.len() >= before.len() + after.len()
                    && name.starts_with(before)
                    && name.ends_with(after)
            };
            let mut names = names_in(&folder_of(path))?;
            names.retain(|name| fits(name));
            names.sort_by(|a, b| natural(a, b));
            match names.is_empty() {
                true => Err(wrong("no file has such a name")),
                false => Ok(names.iter().map(|name| path.with_file_name(name)).collect()),
            }
        }
        Some(Pattern::Number {
            before,
            width,
            after,
        }) => numbered(path, before, width, after),
        None => Err(wrong(
            "is neither a folder nor a pattern with one * or one %d in its last part",
        )),
    }
}

/// A name with a place in it that stands for others.
enum Pattern<'a> {
    /// Anything between two texts.
    Any { before: &'a str, after: &'a str },
    /// A number between two texts, filled with zeros to a width.
    Number {
        before: &'a str,
        width: usize,
        after: &'a str,
    },
}

impl Pattern<'_> {
    /// The pattern that the last part of a path is; none where it is none, or has two places.
    fn of(path: &Path) -> Option<Pattern<'_>> {
        let name = path.file_name()?.to_str()?;
        if let Some((before, after)) = name.split_once('*') {
            return (!after.contains('*')).then_some(Pattern::Any { before, after });
        }
        let (before, rest) = name.split_once('%')?;
        let (width, after) = rest.split_once('d')?;
        let is_width = width.is_empty()
            || (width.starts_with('0') && width.bytes().all(|b| b.is_ascii_digit()));
        let width = match width {
            "" => 1,
            digits => digits.parse().ok().filter(|w| *w <= 20)?,
        };
        (is_width && !after.contains('%')).then_some(Pattern::Number {
            before,
            width,
            after,
        })
    }
}

/// The folder that a file is in.
fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// The names of the files in a folder, hidden ones left out.
fn names_in(folder: &Path) -> Result<Vec<String>> {
    let failed = |source| Error::Read {
        path: folder.to_owned(),
        source,
    };
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name();
        // What is not UTF-8 has no extension that is known.
        if let Some(name) = name.to_str().filter(|name| !name.starts_with('.'))
            && entry.path().is_file()
        {
            names.push(name.to_owned());
        }
    }
    Ok(names)
}

fn in_folder(folder: &Path, format: Option<Format>) -> Result<Vec<PathBuf>> {
    let mut meshes: Vec<(String, Format)> = Vec::new();
    for name in names_in(folder)? {
        let found = mesh_format(&name).filter(|found| format.is_none_or(|f| f == *found));
        meshes.extend(found.map(|format| (name, format)));
    }
    meshes.sort_by(|(a, _), (b, _)| natural(a, b));
    let Some((first, format)) = meshes.first() else {
        return Err(malformed(folder, "holds no mesh".to_owned()));
    };
    if let Some((other, _)) = meshes.iter().find(|(_, other)| other != format) {
        let fault = Fault::whole(format!(
            "holds meshes of two formats, {first} and {other}, of which none is told to be meant"
        ));
        let hint = "name one with --input-format, or the files with a pattern (frame*.obj)";
        return Err(Error::Malformed {
            path: folder.to_owned(),
            fault: fault.with_hint(hint),
        });
    }
    Ok(meshes.iter().map(|(name, _)| folder.join(name)).collect())
}

/// The format of meshes that a name ends in, looking below a final `.gz`.
fn mesh_format(name: &str) -> Option<Format> {
    let path = Path::new(name);
    let extension = path.extension()?.to_str()?;
    let extension = match extension.eq_ignore_ascii_case("gz") {
        true => Path::new(path.file_stem()?).extension()?.to_str()?,
        false => extension,
    };
    // A text beside the frames is more often about them than one of them.
    let may_be =
        |format: &Format| format.kind() == Kind::Mesh && !extension.eq_ignore_ascii_case("txt");
    Format::from_extension(extension).filter(may_be)
}

/// The files whose numbers follow on each other.
fn numbered(path: &Path, before: &str, width: usize, after: &str) -> Result<Vec<PathBuf>> {
    let name = |number: u64| format!("{before}{number:0width$}{after}");
    let number = |found: &String| {
        let digits = found.strip_prefix(before)?.strip_suffix(after)?;
        let number = digits.parse().ok()?;
        // Neither signs nor zeros too many or too few.
        (*found == name(number)).then_some(number)
    };
    let names = names_in(&folder_of(path))?;
    let mut numbers: Vec<u64> = names.iter().filter_map(number).collect();
    numbers.sort_unstable();
    if numbers.is_empty() {
        return Err(malformed(path, "no file has such a name".to_owned()));
    }
    if let Some(gap) = numbers.windows(2).find(|w| w[0] + 1 != w[1]) {
        let [missing, next] = [name(gap[0] + 1), name(gap[1])];
        let problem = format!("{missing} is missing, but {next} is there");
        return Err(malformed(path, problem));
    }
    let named = numbers.into_iter().map(|n| path.with_file_name(name(n)));
    Ok(named.collect())
}

fn malformed(path: &Path, problem: String) -> Error {
    Error::Malformed {
        path: path.to_owned(),
        fault: Fault::whole(problem),
    }
}

/// The order of names in which runs of digits count as the numbers they are; names that are the same
/// but for zeros in front of a number are in the order of their letters.
pub fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.as_bytes(), b.as_bytes());
    while let (Some(x), Some(y)) = (left.first(), right.first()) {
        let order = if x.is_ascii_digit() && y.is_ascii_digit() {
            let [x, y] = [digits(&mut left), digits(&mut right)];
            x.len().cmp(&y.len()).then_with(|| x.cmp(y))
        } else {
            (left, right) = (&left[1..], &right[1..]);
            x.cmp(y)
        };
        if order.is_ne() {
            return order;
        }
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

/// Takes the digits at the start off a text. Returns them without zeros in front.
fn digits<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let end = text.iter().position(|b| !b.is_ascii_digit());
    let (number, rest) = text.split_at(end.unwrap_or(text.len()));
    *text = rest;
    let zeros = number.iter().take_while(|b| **b == b'0').count();
    &number[zeros..]
}
