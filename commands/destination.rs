//! Where results go: `-o`, `--preview` and their like made into one file per input.

use crate::taken::Writes;
use scantle::error::{Error, Result};
use scantle::io::format::{Format, Kind};
use scantle::io::sink::Sink;
use std::collections::BTreeMap;
use std::fs;
use std::io::{Error as IoError, ErrorKind};
use std::path::{Path, PathBuf};

/// What stands for the number of a frame in the place of a result.
pub const FRAME: &str = "{frame}";
/// What stands for a label in the place of a result.
pub const LABEL: &str = "{label}";

/// Where the result of one input goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Destination {
    /// The file, or standard output.
    pub sink: Sink,
    /// Its folder is made when it is not there yet: the user named a folder, not a file.
    makes_folder: bool,
}

/// Where and as what the result of one input is written.
#[derive(Debug, Clone)]
pub struct Target {
    /// Where.
    pub place: Destination,
    /// In which format.
    pub format: Format,
    /// Whether the user named the format; else the name of the file tells it.
    pub is_named: bool,
}

/// What an option may have written beside the result: a picture, a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extra {
    /// The option, without dashes.
    pub option: &'static str,
    /// What it is in a word: `a picture`.
    pub what: &'static str,
    /// What it is exactly: `a PNG picture`.
    pub exactly: &'static str,
    /// Its formats, which are the extensions of its names too; the first is taken in a folder.
    pub formats: &'static [&'static str],
}

impl Extra {
    /// The picture of `--preview`.
    pub const PREVIEW: Extra = Extra {
        option: "preview",
        what: "a picture",
        exactly: "a PNG picture",
        formats: &["png"],
    };

    /// One destination per input for the word of the option.
    ///
    /// Errs for standard output, which carries the result or the report, and where a name asks for another
    /// format than there is. Where there is one format alone, a name without an extension is right: a device
    /// has none.
    pub fn plan(&self, word: &str, inputs: &[String]) -> Result<Vec<Beside>> {
        let wrong = |problem| Error::parameter(self.option, word, problem);
        if word == "-" {
            let problem = format!("{} goes to a file, not to standard output", self.what);
            return Err(wrong(problem));
        }
        let planned = plan(
            self.option,
            word,
            self.formats.first().copied(),
            inputs,
            None,
        )?;
        let beside = |place: Destination| {
            let format = self.format_of(place.sink.path()).ok_or_else(|| {
                let (option, exactly) = (self.option, self.exactly);
                let endings: Vec<String> = self.formats.iter().map(|f| format!(".{f}")).collect();
                let endings = endings.join(" or ");
                wrong(format!(
                    "a {option} is {exactly}, and its name must end in {endings}"
                ))
            })?;
            Ok(Beside {
                option: self.option,
                format,
                place,
            })
        };
        planned.into_iter().map(beside).collect()
    }

    /// The format that a name asks for.
    fn format_of(&self, path: &Path) -> Option<&'static str> {
        match (path.extension(), self.formats) {
            (None, [only]) => Some(only),
            (None, _) => None,
            (Some(extension), formats) => {
                let is_it = |format: &&&str| extension.eq_ignore_ascii_case(format);
                formats.iter().find(is_it).copied()
            }
        }
    }
}

/// Where and as what an [`Extra`] of one input is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Beside {
    /// The option, without dashes.
    pub option: &'static str,
    /// The format, as the report names it.
    pub format: &'static str,
    /// Where.
    pub place: Destination,
}

impl Target {
    /// It as an output of `--output`.
    pub fn writes(&self) -> Writes<'_> {
        Writes {
            option: "output",
            sink: &self.place.sink,
            format: Some(self.format),
        }
    }

    /// The format that a result of a kind is written in: where the name of the file tells it, formats of
    /// several kinds may share the extension.
    pub fn format_for(&self, kind: Kind) -> Format {
        if self.is_named {
            self.format
        } else {
            self.format.holding(kind)
        }
    }

    /// Whether its place has a placeholder, and so a file for each of what it stands for.
    pub fn is_pattern(&self, placeholder: &str) -> bool {
        let path = self.place.sink.path().display().to_string();
        path.contains(placeholder)
    }

    /// It with its result at another place.
    pub fn at(&self, path: &Path) -> Self {
        let mut own = self.clone();
        own.place.sink = Sink::File(path.to_owned());
        own
    }

    /// The error of a format that cannot be what is asked for, blamed on the option that said it.
    pub fn wrong(&self, problem: impl Into<String>) -> Error {
        if self.is_named {
            Error::parameter("output-format", self.format.name(), problem)
        } else {
            let (path, problem) = (self.place.sink.path().display(), problem.into());
            Error::parameter("output", path, format!("{} {problem}", self.format.name()))
        }
    }
}

impl Destination {
    /// Errs where the folder of the result is not there and will not be made: better said before
    /// the work than after it.
    pub fn check(&self) -> Result<()> {
        if self.makes_folder {
            return Ok(());
        }
        check_place(&self.sink)
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

/// Errs where the folder in which a file is to be written is not there, or a folder stands where
/// the file is to be.
pub fn check_place(sink: &Sink) -> Result<()> {
    if *sink != Sink::Stdout && sink.path().is_dir() {
        return Err(Error::Write {
            path: sink.path().to_owned(),
            source: IoError::new(ErrorKind::IsADirectory, "is a folder"),
        });
    }
    let folder = sink.path().parent().filter(|f| !f.as_os_str().is_empty());
    match folder {
        Some(folder) if !folder.is_dir() => {
            let problem = format!("there is no folder {}", folder.display());
            Err(Error::Write {
                path: sink.path().to_owned(),
                source: IoError::new(ErrorKind::NotFound, problem),
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
    placeholder: Option<&str>,
) -> Result<Vec<Destination>> {
    let wrong = |problem: String| Error::parameter(option, word, problem);
    let is_folder = word.ends_with('/') || Path::new(word).is_dir();
    check_placeholders(word, placeholder).map_err(wrong)?;
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

fn check_placeholders(word: &str, also: Option<&str>) -> Result<(), String> {
    for part in word.split('{').skip(1) {
        let name = match part.split_once('}') {
            Some((name, _)) => format!("{{{name}}}"),
            None => format!("{{{part}"),
        };
        if name != "{stem}" && Some(name.as_str()) != also {
            let also = also.map_or(String::new(), |also| format!(" and {also}"));
            return Err(format!(
                "{name} is no placeholder here; there is {{stem}}{also}"
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

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(word: &str, extension: Option<&str>, inputs: &[&str]) -> Result<Vec<String>> {
        let inputs: Vec<String> = inputs.iter().map(|s| s.to_string()).collect();
        let planned = plan("output", word, extension, &inputs, None)?;
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
    fn extras_are_what_their_names_say() {
        const PLOT: Extra = Extra {
            option: "plot",
            what: "a picture",
            exactly: "an SVG or PNG picture",
            formats: &["svg", "png"],
        };
        let inputs = ["a/x.pdb", "y.cif.gz"].map(str::to_owned);
        let planned = |extra: Extra, word: &str, count: usize| {
            let planned = extra.plan(word, &inputs[..count])?;
            let said = planned.iter().map(|beside| {
                let path = beside.place.sink.path().display();
                format!("{} {path}", beside.format)
            });
            Ok::<_, Error>(said.collect::<Vec<_>>())
        };
        let two = planned(PLOT, "out/{stem}.PNG", 2).expect("two places");
        assert_eq!(two, ["png out/x.PNG", "png out/y.PNG"]);
        let two = planned(PLOT, "out/", 2).expect("two places");
        assert_eq!(two, ["svg out/x.svg", "svg out/y.svg"]);
        let device = planned(Extra::PREVIEW, "/dev/null", 1).expect("a place");
        assert_eq!(device, ["png /dev/null"]);
        let message = |word, count| {
            planned(PLOT, word, count)
                .expect_err("an error")
                .to_string()
        };
        for word in ["a.pdf", "a"] {
            assert_eq!(
                message(word, 1),
                format!(
                    "--plot {word}: a plot is an SVG or PNG picture, and its name must end in .svg or .png"
                )
            );
        }
        assert_eq!(
            message("-", 1),
            "--plot -: a picture goes to a file, not to standard output"
        );
        assert_eq!(
            message("a.svg", 2),
            "--plot a.svg: one place for the results of 2 inputs; name a folder (out/) or use {stem}"
        );
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
