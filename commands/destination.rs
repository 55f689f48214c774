//! Where results go: `-o` and `--preview` made into one file per input.

use scantle::error::{Error, Result};
use scantle::io::sink::Sink;
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Where the result of one input goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Destination {
    /// The file, or standard output.
    pub sink: Sink,
    /// Its folder is made when it is not there yet: the user named a folder, not a file.
    makes_folder: bool,
}

impl Destination {
    /// Errs where the folder of the result is not there and will not be made: better said before
    /// the work than after it.
    pub fn check(&self) -> Result<()> {
        if self.makes_folder {
            return Ok(());
        }
        check_folder(&self.sink)
    }

    /// Makes the folder that the user named, if there is need.
    pub fn prepare(&self) -> Result<()> {
        match self.sink.path().parent() {
            Some(folder) if self.makes_folder => {
                fs::create_dir_all(folder).map_err(|source| Error::Write {
                    path: folder.to_owned(),
                    source,
                })
            }
            _ => Ok(()),
        }
    }
}

/// Errs where the folder in which a file is to be written is not there.
pub fn check_folder(sink: &Sink) -> Result<()> {
    let folder = sink.path().parent().filter(|f| !f.as_os_str().is_empty());
    match folder {
        Some(folder) if !folder.is_dir() => {
            let problem = format!("there is no folder {}", folder.display());
            Err(Error::Write {
                path: sink.path().to_owned(),
                source: io::Error::new(io::ErrorKind::NotFound, problem),
            })
        }
        _ => Ok(()),
    }
}

/// One destination per input for `--OPTION WORD`: a file, `-`, a folder, or a pattern with `{stem}`.
///
/// `extension` is the one for files in a folder, where it is known. Errors when several inputs
/// would go to one place.
pub fn plan(
    option: &'static str,
    word: &str,
    extension: Option<&str>,
    inputs: &[String],
) -> Result<Vec<Destination>> {
    let wrong = |problem: String| Error::parameter(option, word, problem);
    let is_folder = word.ends_with('/') || Path::new(word).is_dir();
    check_placeholders(word).map_err(wrong)?;
    if inputs.len() > 1 && !is_folder && !word.contains("{stem}") {
        return Err(wrong(format!(
            "one place for the results of {} inputs; name a folder (out/) or use {{stem}}",
            inputs.len()
        )));
    }
    let mut planned = Vec::with_capacity(inputs.len());
    let mut taken: BTreeMap<String, &String> = BTreeMap::new();
    for input in inputs {
        let mut path = word.replace("{stem}", &stem(input));
        if is_folder {
            let extension = extension.ok_or_else(|| {
                wrong("is a folder, so --output-format must say what to write there".to_owned())
            })?;
            let file = format!("{}.{extension}", stem(input));
            path = Path::new(&path).join(file).display().to_string();
        }
        if let Some(other) = taken.insert(path.clone(), input) {
            return Err(wrong(format!(
                "{other} and {input} would both go to {path}"
            )));
        }
        planned.push(Destination {
            sink: Sink::new(&path),
            makes_folder: word.ends_with('/'),
        });
    }
    Ok(planned)
}

fn check_placeholders(word: &str) -> Result<(), String> {
    for part in word.split('{').skip(1) {
        let name = part.split_once('}').map(|(name, _)| name);
        if name != Some("stem") {
            return Err(format!(
                "{{{} is no placeholder here; there is {{stem}}",
                name.map_or(part.to_owned(), |name| format!("{name}}}"))
            ));
        }
    }
    Ok(())
}

/// The name of an input without folder, `.gz` and extension; `stdin` for standard input.
pub fn stem(input: &str) -> String {
    if input == "-" {
        return "stdin".to_owned();
    }
    let mut name = PathBuf::from(Path::new(input).file_name().unwrap_or_default());
    if name
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gz"))
    {
        name.set_extension("");
    }
    name.file_stem()
        .map_or(String::new(), |stem| stem.display().to_string())
}

/// Refuses to write over an input, or twice to one place.
pub fn refuse_overlap(inputs: &[String], outputs: &[(&'static str, &Sink)]) -> Result<()> {
    let resolved = |path: &Path| fs::canonicalize(path).ok();
    let read: Vec<_> = inputs
        .iter()
        .filter_map(|input| resolved(Path::new(input)))
        .collect();
    let mut written: Vec<(&str, PathBuf)> = Vec::new();
    for (option, sink) in outputs {
        let path = sink.path();
        let target = match sink {
            Sink::Stdout => path.to_owned(),
            Sink::File(path) => resolved(path).unwrap_or_else(|| path.clone()),
        };
        if **sink != Sink::Stdout && read.contains(&target) {
            let problem = "is an input, and inputs are never touched";
            return Err(Error::parameter(option, path.display(), problem));
        }
        if let Some((other, _)) = written.iter().find(|(_, taken)| *taken == target) {
            let problem = format!("is where --{other} goes already");
            return Err(Error::parameter(option, path.display(), problem));
        }
        written.push((option, target));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(word: &str, extension: Option<&str>, inputs: &[&str]) -> Result<Vec<String>> {
        let inputs: Vec<String> = inputs.iter().map(|s| s.to_string()).collect();
        let planned = plan("output", word, extension, &inputs)?;
        Ok(planned
            .iter()
            .map(|p| p.sink.path().display().to_string())
            .collect())
    }

    #[test]
    fn one_file_per_input() {
        let two = ["data/a.obj", "b.ply.gz"];
        assert_eq!(paths("x.ply", None, &two[..1]).unwrap(), ["x.ply"]);
        assert_eq!(paths("-", None, &two[..1]).unwrap(), ["-"]);
        assert_eq!(
            paths("out/{stem}-low.ply", None, &two).unwrap(),
            ["out/a-low.ply", "out/b-low.ply"]
        );
        assert_eq!(
            paths("out/", Some("stl"), &two).unwrap(),
            ["out/a.stl", "out/b.stl"]
        );
        assert_eq!(paths("{stem}.ply", None, &["-"]).unwrap(), ["stdin.ply"]);
    }

    #[test]
    fn what_cannot_be_is_refused_with_words() {
        let two = ["a/x.obj", "b/x.obj"];
        let message = |word, extension| paths(word, extension, &two).unwrap_err().to_string();
        assert_eq!(
            message("x.ply", None),
            "--output x.ply: one place for the results of 2 inputs; name a folder (out/) or use {stem}"
        );
        assert_eq!(
            message("{stem}.ply", None),
            "--output {stem}.ply: a/x.obj and b/x.obj would both go to x.ply"
        );
        assert_eq!(
            message("{frame}.ply", None),
            "--output {frame}.ply: {frame} is no placeholder here; there is {stem}"
        );
        assert_eq!(
            message("out/", None),
            "--output out/: is a folder, so --output-format must say what to write there"
        );
    }
}
