//! `--vary`: the knobs, and the values that each is to have.

use crate::wrapped::Wrapped;
use scantle::measure::tradeoff::{Axis, Grid, Idle};
use scantle::trade::Knob;
use serde_json::{Map, Value};
use std::collections::BTreeSet;

/// Knobs with their values, cheapest first.
pub struct Knobs {
    all: Vec<(&'static Knob, Vec<String>)>,
}

impl Knobs {
    /// Reads the words after `--vary`, and checks each setting as clap would. Errs with what to say
    /// to the user.
    pub fn new(words: &[String], wrapped: &Wrapped) -> Result<Self, String> {
        let mut all: Vec<(&'static Knob, Vec<String>)> = Vec::new();
        for word in words {
            let wrong = |problem: String| format!("--vary {word}: {problem}");
            let (knob, values) = parse(word, wrapped).map_err(wrong)?;
            if all.iter().any(|(other, _)| other.name == knob.name) {
                return Err(wrong(format!("{} is varied already", knob.name)));
            }
            if wrapped.is_set(knob.name) {
                let (option, command) = (knob.name, &wrapped.name);
                return Err(wrong(format!(
                    "--{option} is among the options of {command} already"
                )));
            }
            all.push((knob, values));
        }
        let knobs = Knobs { all };
        for setting in knobs.grid().settings() {
            Wrapped::check(&wrapped.words(&wrapped.inputs, &knobs.options(&setting)))?;
        }
        Ok(knobs)
    }

    /// The grid of their values.
    pub fn grid(&self) -> Grid {
        let axis = |(knob, values): &(&Knob, Vec<String>)| Axis {
            count: values.len(),
            numbers: if knob.numeric {
                values.iter().map(|value| value.parse().ok()).collect()
            } else {
                None
            },
        };
        let mut idle = Vec::new();
        for (axis, (knob, _)) in self.all.iter().enumerate() {
            for (other, value) in knob.idle {
                let by = self.all.iter().position(|(knob, _)| knob.name == *other);
                let index = |by: usize| self.all[by].1.iter().position(|v| v == value);
                if let Some((by, value)) = by.and_then(|by| Some((by, index(by)?))) {
                    idle.push(Idle { axis, by, value });
                }
            }
        }
        Grid {
            axes: self.all.iter().map(axis).collect(),
            idle,
        }
    }

    /// Names and values, cheapest first.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &[String])> {
        self.all
            .iter()
            .map(|(knob, values)| (knob.name, values.as_slice()))
    }

    /// The knobs that have an effect in a setting, with their values; `None` for those that have none.
    fn values<'a>(
        &'a self,
        setting: &'a [usize],
    ) -> impl Iterator<Item = (&'static Knob, Option<&'a str>)> {
        let grid = self.grid();
        let all = self.all.iter().zip(setting).enumerate();
        all.map(move |(axis, ((knob, values), index))| {
            let value = values[*index].as_str();
            (*knob, (!grid.is_idle(setting, axis)).then_some(value))
        })
    }

    /// The options that make a setting.
    pub fn options(&self, setting: &[usize]) -> Vec<(String, Option<String>)> {
        self.values(setting)
            .filter_map(|(knob, value)| Some((knob.name.to_owned(), Some(value?.to_owned()))))
            .collect()
    }

    /// A setting for the report: numbers where the knob has numbers, null where it has no effect.
    pub fn setting(&self, setting: &[usize]) -> Map<String, Value> {
        let number = |text: &str| serde_json::from_str(text).unwrap_or_else(|_| text.into());
        let entries = self.values(setting).map(|(knob, value)| {
            let value = match value {
                None => Value::Null,
                Some(value) if knob.numeric => number(value),
                Some(value) => value.into(),
            };
            (knob.name.to_owned(), value)
        });
        entries.collect()
    }
}

/// A knob and its values, cheapest first.
fn parse(word: &str, wrapped: &Wrapped) -> Result<(&'static Knob, Vec<String>), String> {
    let (name, values) = match word.split_once('=') {
        Some((name, values)) => (name, Some(values)),
        None => (word, None),
    };
    let knob = wrapped.trade.knob(name).ok_or_else(|| {
        let names: Vec<_> = wrapped.trade.knobs.iter().map(|knob| knob.name).collect();
        let (command, names) = (&wrapped.name, names.join(", "));
        format!("{command} has no such knob; it has: {names}")
    })?;
    let mut values: Vec<String> = match values {
        None => knob
            .ladder
            .iter()
            .map(|value| (*value).to_owned())
            .collect(),
        Some("") => return Err("there is no value".to_owned()),
        Some(values) => values.split(',').map(str::to_owned).collect(),
    };
    let mut seen = BTreeSet::new();
    if let Some(twice) = values.iter().find(|value| !seen.insert(value.as_str())) {
        return Err(format!("the value '{twice}' is there twice"));
    }
    if knob.numeric {
        // What is no number is for clap to refuse.
        let number = |value: &String| value.parse().unwrap_or(f64::NAN);
        values.sort_by(|a, b| number(a).total_cmp(&number(b)));
        if knob.is_falling() {
            values.reverse();
        }
    } else {
        values.sort_by_key(|value| knob.ladder.iter().position(|step| step == value));
    }
    Ok((knob, values))
}
