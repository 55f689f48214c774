//! The command line as clap sees it: one variant per command.

use crate::exit::Exit;
use crate::streams::say;
use crate::{compare, completions, convert, formats, info, man, schema, voxelize};
use clap::error::ErrorKind;
use clap::{Arg, CommandFactory, FromArgMatches, Parser, Subcommand};
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
    Info(info::Args),
    Compare(compare::Args),
    Convert(convert::Args),
    Formats(formats::Args),
    Schema(schema::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// The commands by what goes in and what comes out, as the help shows them.
const GROUPS: &[(&str, &[&str])] = &[
    ("Mesh to volume", &["voxelize"]),
    ("Any file", &["info", "convert", "compare"]),
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
        .mut_subcommands(|c| c.mut_args(take_negative_numbers));
    // Building adds the command `help`, which the list shows too.
    let mut built = command.clone();
    built.build();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{}Options:\n{{options}}{{after-help}}",
        grouped(&built)
    );
    command.help_template(template)
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

/// Parses the words of this process; says help and usage errors itself.
pub fn parse() -> Result<Command, Exit> {
    let parsed = command()
        .try_get_matches()
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
                let text = error.to_string();
                let text = text.strip_prefix("error: ").unwrap_or(&text);
                say(text.trim_end());
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
}
