//! The command line as clap sees it: one variant per command.

use crate::exit::Exit;
use crate::streams::say;
use crate::trade::{Declared, TABLE};
use crate::{
    compare, completions, compress_anim, convert, drape, formats, info, isosurface, man, schema,
    shadow, smooth_mc, splat_gen, splat_trace, stability, tradeoff, tunnels, vector_overlay,
    voxelize,
};
use clap::error::ErrorKind;
use clap::{Arg, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::fmt::Write;

/// Geometry processing that measures the error it makes
///
/// Each command reads files, makes something of them, and reports in JSON on standard output what
/// it did, how exact it is and how it knows.
#[derive(Debug, Parser)]
#[command(name = "scantle", version, subcommand_required = true, arg_required_else_help = true, after_long_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    Voxelize(Box<voxelize::Args>),
    Shadow(Box<shadow::Args>),
    SmoothMc(Box<smooth_mc::Args>),
    Isosurface(isosurface::Args),
    Tunnels(Box<tunnels::Args>),
    SplatGen(Box<splat_gen::Args>),
    SplatTrace(Box<splat_trace::Args>),
    VectorOverlay(Box<vector_overlay::Args>),
    Drape(Box<drape::Args>),
    CompressAnim(compress_anim::Args),
    Info(info::Args),
    Compare(compare::Args),
    Convert(convert::Args),
    Tradeoff(Box<tradeoff::Args>),
    Stability(Box<stability::Args>),
    Formats(formats::Args),
    Schema(schema::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// The commands by what goes in and what comes out, as the help shows them.
const GROUPS: &[(&str, &[&str])] = &[
    ("Mesh to volume", &["voxelize"]),
    ("Mesh to picture", &["shadow"]),
    ("Volume to mesh", &["smooth-mc", "isosurface"]),
    ("Points", &["splat-gen", "splat-trace"]),
    ("Maps", &["vector-overlay", "drape"]),
    ("Molecules", &["tunnels"]),
    ("Animations", &["compress-anim"]),
    ("Any file", &["info", "convert", "compare"]),
    ("Any command", &["tradeoff", "stability"]),
    (
        "About scantle",
        &["formats", "schema", "completions", "help"],
    ),
];

const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  done, and a check that was asked for failed
  2  the command line is wrong
  3  an input is bad
  4  an output could not be written
  5  refused: over a stated limit, such as --max-memory
";

/// The whole command line, for parsing, completions and manual pages.
pub fn command() -> clap::Command {
    let command = Cli::command()
        .mut_subcommand("convert", |c| c.mut_arg("output", |arg| arg.required(true)))
        .mut_subcommands(|c| {
            c.mut_args(take_negative_numbers)
                .mut_subcommands(|c| c.mut_args(take_negative_numbers))
        });
    let command = TABLE.iter().fold(command, |command, (name, declared)| {
        let (first, verb) = match name.split_once(' ') {
            Some((first, verb)) => (first, Some(verb)),
            None => (*name, None),
        };
        if command.find_subcommand(first).is_none() {
            // `help` is added by building.
            return command;
        }
        command.mut_subcommand(first, |c| match verb {
            Some(verb) => c.mut_subcommand(verb, |c| with_trade(c, declared)),
            None => with_trade(c, declared),
        })
    });
    // Building adds the command `help`, which the list shows too.
    let mut built = command.clone();
    built.build();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{}Options:\n{{options}}{{after-help}}",
        grouped(&built)
    );
    command.help_template(template)
}

/// The definition of a command, or of a verb of one: `compress-anim encode`.
pub fn find<'a>(command: &'a clap::Command, name: &str) -> Option<&'a clap::Command> {
    name.split(' ')
        .try_fold(command, |command, name| command.find_subcommand(name))
}

/// A command whose long help says at the end what it trades for what.
fn with_trade(command: clap::Command, declared: &Declared) -> clap::Command {
    let about = command.get_long_about().or(command.get_about());
    let about = about.map(ToString::to_string).unwrap_or_default();
    command.long_about(format!("{about}\n\n{}", declared.sentence()))
}

/// Lets `--option -1` be a value that is out of range, rather than an option that is not known.
fn take_negative_numbers(arg: Arg) -> Arg {
    if arg.is_positional() || !arg.get_action().takes_values() {
        return arg;
    }
    arg.allow_negative_numbers(true)
}

/// The commands under the headings of [`GROUPS`].
fn grouped(command: &clap::Command) -> String {
    let mut text = String::new();
    for (heading, names) in GROUPS {
        let _ = writeln!(text, "{heading}:");
        for subcommand in names.iter().filter_map(|n| command.find_subcommand(n)) {
            let about = subcommand.get_about().map(ToString::to_string);
            let about = about.unwrap_or_default();
            let _ = writeln!(text, "  {:<13}{about}", subcommand.get_name());
        }
        text.push('\n');
    }
    text
}

/// The commands that run another one, whose words they have among their own.
const WRAPPING: &[&str] = &["tradeoff", "stability"];

/// Puts the own options of a command that runs another one first, so that they may stand anywhere:
/// `tradeoff OWN -- COMMAND REST`, which may be written like that too, where COMMAND has options of
/// the same names. The words of other commands stay as they are.
fn sorted(words: Vec<OsString>, definition: &clap::Command) -> Vec<OsString> {
    let name = words.get(1).and_then(|word| word.to_str());
    let Some(wrapper) = name
        .filter(|name| WRAPPING.contains(name))
        .and_then(|name| definition.find_subcommand(name))
    else {
        return words;
    };
    let mut own = words[..2].to_vec();
    let mut rest = Vec::new();
    let mut words = words.into_iter().skip(2);
    while let Some(word) = words.next() {
        match word.to_str().and_then(|text| own_option(wrapper, text)) {
            _ if word == "--" => {
                // In front of the command it parts the own options from its words; after it, it is
                // one of them.
                if !rest.is_empty() {
                    rest.push(word);
                }
                rest.extend(words.by_ref());
            }
            None => rest.push(word),
            Some(takes_next) => {
                own.push(word);
                own.extend(words.by_ref().take(usize::from(takes_next)));
            }
        }
    }
    if !rest.is_empty() {
        own.push("--".into());
        own.extend(rest);
    }
    own
}

/// Whether a word is an option of a command, and if so whether the next word is its value.
fn own_option(command: &clap::Command, word: &str) -> Option<bool> {
    let (name, has_value) = match word.split_once('=') {
        Some((name, _)) => (name, true),
        None => (word, false),
    };
    if name == "--help" || name == "-h" {
        return Some(false);
    }
    let long = name.strip_prefix("--");
    let short = name.strip_prefix('-').and_then(|short| {
        let mut letters = short.chars();
        letters.next().filter(|_| letters.next().is_none())
    });
    let arg = command.get_arguments().find(|arg| {
        !arg.is_positional()
            && (long.is_some() && arg.get_long() == long
                || short.is_some() && arg.get_short() == short)
    })?;
    Some(arg.get_action().takes_values() && !has_value)
}

/// What clap says, without the word before it.
pub fn message(error: &clap::Error) -> String {
    let text = error.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text);
    text.trim_end().to_owned()
}

/// Parses words that follow the program's name.
pub fn parse_words(words: &[String]) -> Result<Command, clap::Error> {
    let words = std::iter::once("scantle").chain(words.iter().map(String::as_str));
    let matches = command().try_get_matches_from(words)?;
    Ok(Cli::from_arg_matches(&matches)?.command)
}

/// Parses the words of this process; says help and usage errors itself.
pub fn parse() -> Result<Command, Exit> {
    let definition = command();
    let words = sorted(std::env::args_os().collect(), &definition);
    let parsed = definition
        .try_get_matches_from(words)
        .and_then(|matches| Cli::from_arg_matches(&matches));
    parsed.map(|cli| cli.command).map_err(|error| {
        match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
                // A reader that leaves early has seen enough.
                let _ = error.print();
                Exit::Done
            }
            ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
                let _ = error.print();
                Exit::Usage
            }
            _ => {
                say(message(&error));
                Exit::Usage
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        command().debug_assert();
    }

    #[test]
    fn every_command_is_in_one_group_of_the_help() {
        let mut command = command();
        command.build();
        let mut listed: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        let mut there: Vec<&str> = command
            .get_subcommands()
            .filter(|subcommand| !subcommand.is_hide_set())
            .map(clap::Command::get_name)
            .collect();
        listed.sort_unstable();
        there.sort_unstable();
        assert_eq!(listed, there);
    }

    #[test]
    fn own_options_of_a_wrapping_command_stand_anywhere() {
        let sorted = |line: &str| {
            let words = line.split(' ').map(OsString::from).collect();
            let sorted = sorted(words, &command());
            sorted.join(" ".as_ref()).display().to_string()
        };
        assert_eq!(
            sorted("x tradeoff voxelize a.ply --vary mode --fill none -q --repeat=2 --pad 1"),
            "x tradeoff --vary mode -q --repeat=2 -- voxelize a.ply --fill none --pad 1"
        );
        assert_eq!(
            sorted("x tradeoff -v voxelize -o b.svo -- --vary"),
            "x tradeoff -v -- voxelize -o b.svo -- --vary"
        );
        assert_eq!(
            sorted("x tradeoff --vary mode -- voxelize a.ply --max-memory 1MiB -q"),
            "x tradeoff --vary mode -- voxelize a.ply --max-memory 1MiB -q"
        );
        assert_eq!(sorted("x tradeoff --help"), "x tradeoff --help");
        assert_eq!(
            sorted("x tradeoff voxelize -h"),
            "x tradeoff -h -- voxelize"
        );
        assert_eq!(sorted("x info a.ply --vary"), "x info a.ply --vary");
    }
}
