//! The files of a run: none is written that is read, and none twice.

use scantle::error::{Error, Result};
use scantle::io;
use scantle::io::format::Format;
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// The options that name a file to read beside the inputs, in every command that has them.
pub const READ: &[&str] = &[
    "radii",
    "reference",
    "label-names",
    "base",
    "mesh",
    "terrain",
    "vectors",
    "style",
];

/// A file that is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reads {
    /// The option that names it, without dashes; none for an input.
    pub option: Option<&'static str>,
    /// The file, as the command line has it.
    pub word: String,
    /// The format that it is in, where the user says so.
    pub format: Option<Format>,
}

/// A file that is written.
#[derive(Debug, Clone, Copy)]
pub struct Writes<'a> {
    /// The option that says where, without dashes.
    pub option: &'static str,
    /// Where.
    pub sink: &'a Sink,
    /// In which format, where that may mean a second file.
    pub format: Option<Format>,
}

impl Reads {
    /// An input.
    pub fn input(word: &str, format: Option<Format>) -> Self {
        Reads {
            option: None,
            word: word.to_owned(),
            format,
        }
    }

    /// The file of an option, whose format the file itself tells.
    pub fn beside(option: &'static str, word: &str) -> Self {
        Reads {
            option: Some(option),
            word: word.to_owned(),
            format: None,
        }
    }

    /// What to say of an output that is this file.
    fn said(&self) -> String {
        match self.option {
            None => "is an input".to_owned(),
            Some(option) => format!("is what --{option} reads"),
        }
    }

    /// The files beside it that hold data of it. What cannot be read has none, and neither has what can
    /// be read only once.
    fn data(&self, memory: u64) -> Vec<PathBuf> {
        if !Path::new(&self.word).is_file() {
            return Vec::new();
        }
        let Ok(source) = Source::open(&self.word, memory) else {
            return Vec::new();
        };
        let beside = io::companions(&source, self.format).into_iter();
        beside
            .filter_map(|path| fs::canonicalize(path).ok())
            .collect()
    }
}

impl Writes<'_> {
    /// The files that are replaced, each with what it is called beside the option.
    fn files(&self) -> Vec<(&'static str, PathBuf)> {
        let Sink::File(path) = self.sink else {
            return Vec::new();
        };
        let beside = self.format.and_then(|f| io::written_beside(path, f));
        let all = [("", Some(path.clone())), ("the data of ", beside)];
        all.into_iter()
            .filter_map(|(part, path)| Some((part, path?)))
            // What is a pipe or a device holds nothing that could be lost.
            .filter(|(_, path)| fs::metadata(path).map_or(true, |m| m.is_file() || m.is_dir()))
            .collect()
    }
}

/// The places that are taken: by what is read, and by what is to be written.
///
/// Names are compared as the places they lead to, whether or not a file is there yet.
#[derive(Debug)]
pub struct Taken {
    reads: Vec<Reads>,
    memory: u64,
    /// Files that are read, each with what to say of it.
    read: Vec<(PathBuf, String)>,
    /// Files beside them, each with the word of whose data it holds. Looking for them costs a look into
    /// each file that is read, so they are not known before there is need.
    data: Option<Vec<(PathBuf, String)>>,
    /// Files to be written, each with what it is.
    written: Vec<(PathBuf, String)>,
    /// The option whose result standard output carries.
    streamed: Option<&'static str>,
}

/// Errs where standard input is to be read twice.
pub fn check_streams(reads: &[Reads]) -> Result<()> {
    let streams = reads.iter().filter(|reads| reads.word == "-");
    match streams.skip(1).last() {
        Some(second) => {
            let problem = "standard input can be read only once";
            let option = second.option.unwrap_or("input");
            Err(Error::parameter(option, "-", problem))
        }
        None => Ok(()),
    }
}

impl Taken {
    /// The places of what is read, holding at most `memory` bytes of it at once.
    ///
    /// Errs where standard input is to be read twice.
    pub fn by(reads: Vec<Reads>, memory: u64) -> Result<Self> {
        check_streams(&reads)?;
        let place = |reads: &Reads| Some((fs::canonicalize(&reads.word).ok()?, reads.said()));
        Ok(Taken {
            read: reads.iter().filter_map(place).collect(),
            reads,
            memory,
            data: None,
            written: Vec::new(),
            streamed: None,
        })
    }

    /// Takes a place for an output.
    ///
    /// Errs where that would go over what is read or the data beside it, or where another output goes.
    pub fn take(&mut self, output: &Writes) -> Result<()> {
        let refuse = |problem: String| {
            let shown = output.sink.path().display();
            Err(Error::parameter(output.option, shown, problem))
        };
        if *output.sink == Sink::Stdout
            && let Some(other) = self.streamed.replace(output.option)
        {
            return refuse(format!("is where --{other} goes already"));
        }
        for (part, path) in output.files() {
            let there = place_of(&path);
            let it = match part {
                "" => String::new(),
                _ => format!("its data goes to {}, which ", path.display()),
            };
            let find = |all: &[(PathBuf, String)]| {
                let found = all.iter().find(|(taken, _)| *taken == there);
                found.map(|(_, said)| said.clone())
            };
            if let Some(said) = find(&self.read) {
                return refuse(format!("{it}{said}, and inputs are never touched"));
            }
            // A file that is not there is data of nothing.
            if path.exists()
                && let Some(word) = find(self.data())
            {
                return refuse(format!(
                    "{it}holds the data of {word}, and inputs are never touched"
                ));
            }
            if let Some(other) = find(&self.written) {
                return refuse(format!("{it}is where {other} goes already"));
            }
            let option = output.option;
            self.written.push((there, format!("{part}--{option}")));
        }
        Ok(())
    }

    fn data(&mut self) -> &[(PathBuf, String)] {
        let (reads, memory) = (&self.reads, self.memory);
        self.data.get_or_insert_with(|| {
            let data = |reads: &Reads| {
                let word = reads.word.clone();
                let files = reads.data(memory).into_iter();
                files.map(move |path| (path, word.clone()))
            };
            reads.iter().flat_map(data).collect()
        })
    }
}

/// Where a path leads to: links are followed, and of what is not there yet, the folders that are.
fn place_of(path: &Path) -> PathBuf {
    if let Ok(there) = fs::canonicalize(path) {
        return there;
    }
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    match path.file_name() {
        Some(name) => place_of_folder(folder.unwrap_or(Path::new("."))).join(name),
        None => path.to_owned(),
    }
}

/// As [`place_of`], for a folder that may yet be made; `..` goes up from where it leads.
fn place_of_folder(folder: &Path) -> PathBuf {
    let here = Path::new(".");
    let mut there = fs::canonicalize(here).unwrap_or(here.to_owned());
    for part in folder.components() {
        match part {
            Component::ParentDir if !there.exists() => {
                there.pop();
            }
            part => there.push(part),
        }
        there = fs::canonicalize(&there).unwrap_or(there);
    }
    there
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli;

    /// The options that name a file to write; all but the report's are beside `--output`.
    const WRITTEN: &[&str] = &[
        "output", "preview", "profile", "plot", "script", "clusters", "csv", "report",
    ];

    #[test]
    fn every_option_that_names_a_file_is_known() {
        let mut found = 0;
        for command in cli::command().get_subcommands() {
            for arg in command.get_arguments() {
                let names = arg.get_value_names().unwrap_or_default();
                let Some(long) = arg
                    .get_long()
                    .filter(|_| names.iter().any(|n| *n == "FILE"))
                else {
                    continue;
                };
                found += 1;
                let known = READ.contains(&long) || WRITTEN.contains(&long);
                assert!(known, "{}: --{long} is neither", command.get_name());
            }
        }
        assert!(found > 20, "{found}");
    }

    #[test]
    fn standard_input_is_read_once() {
        let input = |word| Reads::input(word, None);
        let by = |reads| {
            Taken::by(reads, 1000)
                .map(|_| ())
                .map_err(|e| e.to_string())
        };
        assert_eq!(by(vec![input("-"), input("a")]), Ok(()));
        let twice = by(vec![input("-"), Reads::beside("radii", "-")]);
        let why = "--radii -: standard input can be read only once";
        assert_eq!(twice, Err(why.to_owned()));
    }
}
