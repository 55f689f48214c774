//! A command that another one runs: its words taken apart and put together again.

use crate::cli;
use crate::taken::{READ, Reads};
use crate::trade;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches};
use scantle::io::format::Format;
use scantle::trade::Trade;

/// A command with its inputs and options.
#[derive(Debug)]
pub struct Wrapped {
    /// Its name.
    pub name: String,
    /// Its trade.
    pub trade: &'static Trade,
    /// What it reads.
    pub inputs: Vec<String>,
    definition: clap::Command,
    matches: ArgMatches,
}

/// Options that the wrapping command sets itself, or that would have every run write over one file.
const TAKEN: &[&str] = &[
    "output", "preview", "profile", "script", "plot", "clusters", "timings", "verify",
];

impl Wrapped {
    /// Takes the words of a command apart, the first of which may be its verb. Errs with what to say to
    /// the user.
    pub fn new(name: &str, words: &[String]) -> Result<Self, String> {
        let all = cli::command();
        let verb = words.first().map(|verb| format!("{name} {verb}"));
        let verb = verb.filter(|verb| cli::find(&all, verb).is_some());
        let (name, words) = match &verb {
            Some(verb) => (verb.as_str(), &words[1..]),
            None => (name, words),
        };
        let trade = trade::of(name)?;
        let full = std::iter::once("scantle").chain(name.split(' '));
        let matches = all
            .clone()
            .try_get_matches_from(full.chain(words.iter().map(String::as_str)))
            .map_err(|error| cli::message(&error))?;
        let matches = name.split(' ').try_fold(&matches, |matches, _| {
            matches.subcommand().map(|(_, matches)| matches)
        });
        let (Some(definition), Some(matches)) = (cli::find(&all, name), matches) else {
            return Err(format!("there is no command {name}"));
        };
        let mut wrapped = Wrapped {
            name: name.to_owned(),
            trade,
            inputs: Vec::new(),
            definition: definition.clone(),
            matches: matches.clone(),
        };
        wrapped.inputs = wrapped.positionals();
        if let Some(taken) = TAKEN.iter().find(|option| wrapped.is_set(option)) {
            return Err(format!(
                "--{taken} is set for {name} here, and cannot be given"
            ));
        }
        if wrapped.reads().iter().any(|reads| reads.word == "-") {
            return Err(format!(
                "standard input can be read only once, and {name} is run many times: name a file"
            ));
        }
        Ok(wrapped)
    }

    fn positionals(&self) -> Vec<String> {
        let positionals = self
            .definition
            .get_arguments()
            .filter(|a| a.is_positional());
        positionals.flat_map(|arg| self.raw(arg)).collect()
    }

    /// The values of an argument, defaults included.
    fn raw(&self, arg: &Arg) -> Vec<String> {
        let values = self.matches.get_raw(arg.get_id().as_str());
        values
            .map(|values| values.map(|v| v.to_string_lossy().into_owned()).collect())
            .unwrap_or_default()
    }

    fn arg(&self, option: &str) -> Option<&Arg> {
        let mut options = self.definition.get_arguments();
        options.find(|arg| arg.get_long() == Some(option))
    }

    /// Whether the user gave an option.
    pub fn is_set(&self, option: &str) -> bool {
        self.arg(option).is_some_and(|arg| {
            self.matches.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine)
        })
    }

    /// The value of an option, as given or by default.
    pub fn value(&self, option: &str) -> Option<String> {
        self.values(option).into_iter().next()
    }

    /// All values of an option that may be given several times.
    pub fn values(&self, option: &str) -> Vec<String> {
        self.arg(option)
            .map(|arg| self.raw(arg))
            .unwrap_or_default()
    }

    /// The format that the inputs are in, where the user says so.
    pub fn format(&self) -> Option<Format> {
        let name = self.value("input-format");
        name.as_deref().and_then(Format::from_name)
    }

    /// All that it reads: the inputs, and what options name beside them.
    pub fn reads(&self) -> Vec<Reads> {
        let format = self.format();
        let inputs = self.inputs.iter();
        let inputs = inputs.map(|word| Reads::input(word, format));
        let beside = READ.iter().flat_map(|option| {
            let words = self.values(option).into_iter();
            words.map(|word| Reads::beside(option, &word))
        });
        inputs.chain(beside).collect()
    }

    /// The options that the user gave, each with its value where it takes one.
    pub fn options(&self) -> Vec<(String, Option<String>)> {
        let mut found = Vec::new();
        for arg in self.definition.get_arguments() {
            let Some(long) = arg.get_long().filter(|long| self.is_set(long)) else {
                continue;
            };
            if arg.get_action().takes_values() {
                let values = self.raw(arg).into_iter();
                found.extend(values.map(|value| (long.to_owned(), Some(value))));
            } else {
                found.push((long.to_owned(), None));
            }
        }
        found
    }

    /// The words of a run, from the command's name on: over `inputs`, with the user's options and
    /// `more`, which replace those of the same name.
    pub fn words(&self, inputs: &[String], more: &[(String, Option<String>)]) -> Vec<String> {
        self.words_without(&[], inputs, more)
    }

    /// As [`Wrapped::words`], without some of the user's options.
    pub fn words_without(
        &self,
        without: &[&str],
        inputs: &[String],
        more: &[(String, Option<String>)],
    ) -> Vec<String> {
        let is_replaced = |name: &String| {
            without.contains(&name.as_str()) || more.iter().any(|(other, _)| other == name)
        };
        let kept = self.options().into_iter();
        let options = kept
            .filter(|(name, _)| !is_replaced(name))
            .chain(more.iter().cloned())
            .flat_map(|(name, value)| match value {
                // A value that begins with a dash would be taken for an option.
                Some(value) if value.starts_with('-') => vec![format!("--{name}={value}")],
                Some(value) => vec![format!("--{name}"), value],
                None => vec![format!("--{name}")],
            });
        let name = self.name.split(' ').map(str::to_owned);
        let inputs = inputs.iter().cloned();
        if inputs.clone().any(|input| input.starts_with('-')) {
            let dashes = std::iter::once("--".to_owned());
            name.chain(options).chain(dashes).chain(inputs).collect()
        } else {
            name.chain(inputs).chain(options).collect()
        }
    }

    /// Errs with what clap says about the words of a run.
    pub fn check(words: &[String]) -> Result<(), String> {
        let parsed = cli::parse_words(words);
        parsed.map(|_| ()).map_err(|error| cli::message(&error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrapped(line: &str) -> Result<Wrapped, String> {
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        Wrapped::new(&words[0], &words[1..])
    }

    #[test]
    fn words_come_back_in_order_with_what_is_changed() {
        let w = wrapped("voxelize --bounds=-1,0,0,1,1,1 a.ply --fill winding b.ply --threads 2")
            .expect("words");
        assert_eq!(w.inputs, ["a.ply", "b.ply"]);
        assert_eq!(w.value("mode").as_deref(), Some("conservative"));
        assert!(!w.is_set("mode") && w.is_set("bounds"));
        let more = [("fill".to_owned(), Some("none".to_owned()))];
        let inputs = ["c.ply".to_owned()];
        assert_eq!(
            w.words(&inputs, &more).join(" "),
            "voxelize c.ply --bounds=-1,0,0,1,1,1 --threads 2 --fill none"
        );
        let dashed = ["-c.ply".to_owned()];
        let words = w.words(&dashed, &more);
        assert_eq!(words[words.len() - 2..], ["--", "-c.ply"]);
        assert!(Wrapped::check(&words).is_ok());
    }

    #[test]
    fn a_verb_is_part_of_the_name() {
        let line = "compress-anim encode a.pc2 --base b.obj --target-kg 2 --fps=30";
        let w = wrapped(line).expect("words");
        assert_eq!(
            (w.name.as_str(), &w.inputs[..]),
            ("compress-anim encode", &["a.pc2".to_owned()][..])
        );
        let reads: Vec<String> = w.reads().into_iter().map(|reads| reads.word).collect();
        assert_eq!(reads, ["a.pc2", "b.obj"]);
        let more = [("target-kg".to_owned(), Some("0.5".to_owned()))];
        let words = w.words_without(&["base"], &["c".to_owned()], &more);
        assert_eq!(
            words.join(" "),
            "compress-anim encode c --fps 30 --target-kg 0.5"
        );
        assert!(Wrapped::check(&words).is_ok());
    }

    #[test]
    fn what_cannot_be_wrapped_is_refused_with_words() {
        let why = |line| wrapped(line).expect_err("a refusal");
        assert_eq!(
            why("nonsense a"),
            "there is no command nonsense; those with a trade: voxelize, shadow, smooth-mc, tunnels, splat-gen, splat-trace, vector-overlay, compress-anim encode"
        );
        assert_eq!(why("info a"), "info has no trade: it counts, exactly");
        assert_eq!(
            why("voxelize a.ply -o b.svo"),
            "--output is set for voxelize here, and cannot be given"
        );
        assert_eq!(
            why("voxelize -"),
            "standard input can be read only once, and voxelize is run many times: name a file"
        );
        assert_eq!(
            why("compress-anim decode a.sanim"),
            "compress-anim has no trade: its verb `encode` has one"
        );
        assert!(why("voxelize a.ply --mode x").starts_with("invalid value 'x' for '--mode"));
    }
}
