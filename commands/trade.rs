//! Which commands trade accuracy for time, and why the others do not.

use scantle::anim::compress;
use scantle::points::splat;
use scantle::protein::tunnels;
use scantle::render::{shadow, splats};
use scantle::terrain::overlay;
use scantle::trade::Trade;
use scantle::volume::{smooth_mc, voxelize};

/// What a command says about its trade.
pub enum Declared {
    /// It has one.
    Trade(&'static Trade),
    /// It has none, for this reason.
    None(&'static str),
}

impl Declared {
    /// What the help of the command says of it.
    pub fn sentence(&self) -> String {
        match self {
            Declared::None(reason) => format!("It has no trade: {reason}."),
            Declared::Trade(trade) => {
                let knobs: Vec<String> = trade
                    .knobs
                    .iter()
                    .map(|k| format!("--{}", k.name))
                    .collect();
                let (knobs, error, reference) = (knobs.join(", "), trade.error, trade.reference);
                format!(
                    "What trades accuracy for time and memory: {knobs}. `scantle tradeoff` compares \
                     them by one error, verified against {reference}: {} ({}).",
                    error.name, error.unit
                )
            }
        }
    }
}

/// Every command; `tradeoff` and `stability` know no other way to one.
pub const TABLE: &[(&str, Declared)] = &[
    ("voxelize", Declared::Trade(&voxelize::TRADE)),
    ("shadow", Declared::Trade(&shadow::TRADE)),
    ("smooth-mc", Declared::Trade(&smooth_mc::TRADE)),
    ("tunnels", Declared::Trade(&tunnels::TRADE)),
    ("splat-gen", Declared::Trade(&splat::TRADE)),
    ("splat-trace", Declared::Trade(&splats::TRADE)),
    ("vector-overlay", Declared::Trade(&overlay::TRADE)),
    ("compress-anim encode", Declared::Trade(&compress::TRADE)),
    ("compress-anim", Declared::None("its verb `encode` has one")),
    (
        "isosurface",
        Declared::None("its vertices lie where linear interpolation meets the level"),
    ),
    (
        "drape",
        Declared::None("what it lays on triangles is on them but for roundings"),
    ),
    (
        "compare",
        Declared::None(
            "what it reports is the error of another result, with a bound that says how well it is known",
        ),
    ),
    (
        "convert",
        Declared::None("it keeps every number, or says what the format cannot hold"),
    ),
    ("info", Declared::None("it counts, exactly")),
    ("tradeoff", Declared::None("it measures that of others")),
    (
        "stability",
        Declared::None("it measures the drift of others"),
    ),
    ("formats", Declared::None("it reads no data")),
    ("schema", Declared::None("it reads no data")),
    ("completions", Declared::None("it reads no data")),
    ("man", Declared::None("it reads no data")),
    ("help", Declared::None("it reads no data")),
];

/// The trade of a command, or of a verb of one; else why there is none.
pub fn of(command: &str) -> Result<&'static Trade, String> {
    let is_there = TABLE.iter().any(|(name, _)| *name == command);
    let whole = command.split_once(' ').filter(|_| !is_there);
    let command = whole.map_or(command, |(whole, _)| whole);
    match TABLE.iter().find(|(name, _)| *name == command) {
        Some((_, Declared::Trade(trade))) => Ok(trade),
        Some((_, Declared::None(reason))) => Err(format!("{command} has no trade: {reason}")),
        None => {
            let names: Vec<_> = TABLE
                .iter()
                .filter(|(_, declared)| matches!(declared, Declared::Trade(_)))
                .map(|(name, _)| *name)
                .collect();
            let names = names.join(", ");
            Err(format!(
                "there is no command {command}; those with a trade: {names}"
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli;
    use scantle::io::format::Format;
    use scantle::trade::Placed;

    #[test]
    fn every_command_has_one_row() {
        let mut command = cli::command();
        command.build();
        let mut there: Vec<_> = command.get_subcommands().map(|c| c.get_name()).collect();
        // Verbs have rows of their own where they have a trade.
        let whole = TABLE.iter().filter(|(name, _)| !name.contains(' '));
        let mut rows: Vec<_> = whole.map(|(name, _)| *name).collect();
        there.sort_unstable();
        rows.sort_unstable();
        assert_eq!(there, rows);
    }

    #[test]
    fn every_help_names_the_trade_or_says_why_there_is_none() {
        let mut command = cli::command();
        command.build();
        for (name, declared) in TABLE.iter().filter(|(name, _)| *name != "help") {
            let definition = cli::find(&command, name).expect("a command");
            let about = definition.get_long_about().map(ToString::to_string);
            let about = about.unwrap_or_default();
            match declared {
                Declared::None(reason) => assert!(about.contains(reason), "{name}"),
                Declared::Trade(trade) => {
                    let knobs = trade.knobs.iter().map(|knob| format!("--{}", knob.name));
                    let others = [trade.error.name, trade.error.unit, trade.reference];
                    let mut words = knobs.chain(others.map(str::to_owned));
                    assert!(words.all(|word| about.contains(&word)), "{name}: {about}");
                }
            }
        }
    }

    /// Whether a command takes a word: as it is, or beside one of those that the command asks for.
    fn takes_words(words: &[String]) -> bool {
        let beside = [None, Some("--pores".to_owned())];
        beside.into_iter().any(|other| {
            let words: Vec<String> = words.iter().cloned().chain(other).collect();
            cli::parse_words(&words).is_ok()
        })
    }

    #[test]
    fn every_placed_option_takes_as_many_numbers_as_its_parts() {
        let trades = TABLE.iter().filter_map(|(name, declared)| match declared {
            Declared::Trade(trade) => Some((*name, *trade)),
            Declared::None(reason) => {
                assert!(!reason.is_empty(), "{name}");
                None
            }
        });
        for (name, trade) in trades {
            for placed in trade.placed {
                let Placed {
                    option,
                    prefix,
                    parts,
                } = placed;
                let takes = |count: usize| {
                    let numbers: Vec<String> = (1..=count).map(|n| n.to_string()).collect();
                    let option = format!("--{option}={prefix}{}", numbers.join(","));
                    let words = name.split(' ').chain(["a.ply", &option]);
                    takes_words(&words.map(str::to_owned).collect::<Vec<_>>())
                };
                let count = parts.iter().map(|part| part.numbers()).sum();
                assert!(takes(count) && !takes(count + 1), "{name} --{option}");
            }
        }
    }

    /// Words for all that a command must be given.
    fn inputs(name: &str) -> Vec<String> {
        let all = cli::command();
        let definition = cli::find(&all, name).expect("a command");
        let needed = definition
            .get_arguments()
            .filter(|arg| arg.is_required_set());
        let option = |arg: &clap::Arg| arg.get_long().map(|long| format!("--{long}"));
        needed
            .flat_map(|arg| option(arg).into_iter().chain(["a.ply".to_owned()]))
            .collect()
    }

    #[test]
    fn every_knob_is_an_option_and_takes_its_ladder() {
        for (name, declared) in TABLE {
            let Declared::Trade(trade) = declared else {
                continue;
            };
            assert!(!trade.knobs.is_empty(), "{name}");
            for knob in trade.knobs {
                assert!(knob.ladder.len() > 1, "{name} --{}", knob.name);
                for value in knob.ladder {
                    let option = format!("--{}", knob.name);
                    let mut words: Vec<String> = name.split(' ').map(str::to_owned).collect();
                    words.extend(inputs(name));
                    words.extend([option, (*value).to_owned()]);
                    let takes = takes_words(&words);
                    assert!(takes, "{name} --{} {value}", knob.name);
                }
            }
            let definition = cli::command();
            let definition = cli::find(&definition, name).expect("a command");
            let has = |long: &str| {
                definition
                    .get_arguments()
                    .any(|a| a.get_long() == Some(long))
            };
            let needed = ["verify", "timings", "report", "quiet", "output"];
            assert!(needed.iter().all(|long| has(long)), "{name}");
            assert!(!trade.reference.is_empty() && !trade.error.name.is_empty());
            let format = Format::from_name(trade.result).expect("a format");
            assert!(format.is_read() && format.is_written(), "{name}");
            for row in trade.invariant {
                assert!(row.only.iter().all(|(option, _)| has(option)), "{name}");
            }
            for tied in trade.tied {
                assert!(has(tied.option) && !tied.instead.is_empty(), "{name}");
            }
        }
    }
}
