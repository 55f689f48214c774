//! What is reported of a grid: JSON, and tables.

use super::vary::Knobs;
use crate::table::{Table, bytes, plain, short};
use crate::words;
use crate::wrapped::Wrapped;
use scantle::image::plot::{Axis, Guide, Marker, On, Plot, Point, Scale, Series};
use scantle::measure::tradeoff::{Choice, Cost, Limits, Params, Row, Spread, Status};
use scantle::report::Modelled;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The command.
    command: String,
    /// Its words that all settings have in common, inputs included.
    words: Vec<String>,
    /// The knobs, each with its values, cheapest first.
    vary: Map<String, Value>,
    #[serde(flatten)]
    params: Params,
    #[serde(flatten)]
    limits: Limits,
    /// Whether all ran in one process.
    in_process: bool,
}

impl Asked {
    pub fn new(
        wrapped: &Wrapped,
        knobs: &Knobs,
        params: Params,
        limits: Limits,
        in_process: bool,
    ) -> Self {
        let vary = knobs
            .iter()
            .map(|(name, values)| (name.to_owned(), values.into()));
        Asked {
            command: wrapped.name.clone(),
            words: wrapped
                .words(&wrapped.inputs, &[])
                .split_off(wrapped.name.split(' ').count()),
            vary: vary.collect(),
            params,
            limits,
            in_process,
        }
    }
}

/// What was found; [`Stats::varies`] says what of it does from run to run.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// The measure that compares settings.
    error: Error,
    /// Every setting, those first that are known to be cheaper beforehand.
    rows: Vec<Setting>,
    /// Indices of the rows that no other beats, cheapest first.
    front: Vec<usize>,
    /// The setting that keeps to the limits; null where none does, or there are none.
    pub choice: Option<Chosen>,
}

/// The measure that compares settings.
#[derive(Debug, Serialize, JsonSchema)]
struct Error {
    /// Its name in the reports of the command.
    measure: &'static str,
    /// Its unit.
    unit: &'static str,
    /// What it is verified against.
    reference: &'static str,
}

/// A setting and its figures.
#[derive(Debug, Serialize, JsonSchema)]
struct Setting {
    /// The value of each knob.
    setting: Map<String, Value>,
    /// What became of it.
    status: Status,
    /// Exit code of the run that failed, else 0.
    exit_code: u8,
    /// Why there are no figures, or not all.
    message: Option<String>,
    /// The error, verified; the largest over all inputs.
    error: Option<f64>,
    /// The proven bound on it.
    bound: Option<f64>,
    /// Seconds of the timed runs, from start to report; of all inputs together.
    wall_s: Option<Spread>,
    /// Processor seconds of the timed runs.
    cpu_s: Option<Spread>,
    /// The most memory that a timed run took.
    peak_bytes: Option<u64>,
    /// How much was built, of how much.
    modelled: Option<Modelled>,
    /// Timed runs.
    runs: u32,
    /// Place among all by cost, from 1.
    rank: Option<usize>,
    /// Whether no other setting is as cheap and as exact, and better in one of both.
    on_front: bool,
}

/// The setting that keeps to the limits.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Chosen {
    /// Index of its row.
    row: usize,
    /// The value of each knob.
    setting: Map<String, Value>,
    /// A line for a shell that runs it.
    pub command: String,
    /// In what it is the best.
    #[serde(skip)]
    pub best: &'static str,
}

impl Stats {
    /// What of the report varies from run to run: what is measured by the clock, what follows from
    /// that, and with a budget which settings were run at all.
    pub fn varies(params: &Params) -> Vec<&'static str> {
        let of_rows: &[&str] = match params.budget_s {
            Some(_) => &["/result/rows"],
            None => &[
                "/result/rows/*/wall_s",
                "/result/rows/*/cpu_s",
                "/result/rows/*/peak_bytes",
                "/result/rows/*/rank",
                "/result/rows/*/on_front",
            ],
        };
        let others = ["/result/front", "/result/choice"];
        // Plot and table show the times.
        let written = ["/output/*/bytes", "/output/*/sha256"];
        let all = of_rows.iter().copied().chain(others).chain(written);
        all.collect()
    }

    pub fn new(
        wrapped: &Wrapped,
        knobs: &Knobs,
        rows: &[Row],
        choice: Choice,
        limits: &Limits,
    ) -> Self {
        let trade = wrapped.trade;
        let best = match limits.max_error {
            Some(_) => "the cheapest",
            None => "the most exact",
        };
        let mut front: Vec<usize> = (0..rows.len()).filter(|i| rows[*i].on_front).collect();
        front.sort_by_key(|i| rows[*i].rank);
        let chosen = |row: usize| {
            let setting = &rows[row].setting;
            let mut line = vec!["scantle".to_owned()];
            line.extend(wrapped.words(&wrapped.inputs, &knobs.options(setting)));
            Chosen {
                row,
                setting: knobs.setting(setting),
                command: words::shell(&line),
                best,
            }
        };
        Stats {
            error: Error {
                measure: trade.error.name,
                unit: trade.error.unit,
                reference: trade.reference,
            },
            rows: rows.iter().map(|row| Setting::new(knobs, row)).collect(),
            front,
            choice: match choice {
                Choice::Row(row) => Some(chosen(row)),
                Choice::NotAsked | Choice::None => None,
            },
        }
    }
}

impl Setting {
    fn new(knobs: &Knobs, row: &Row) -> Self {
        Setting {
            setting: knobs.setting(&row.setting),
            status: row.status,
            exit_code: row.code,
            message: row.message.clone(),
            error: row.error,
            bound: row.bound,
            wall_s: row.wall_s,
            cpu_s: row.cpu_s,
            peak_bytes: row.peak_bytes,
            modelled: row.modelled.clone(),
            runs: row.runs,
            rank: row.rank,
            on_front: row.on_front,
        }
    }
}

/// The table for people.
pub fn shown(stats: &Stats) -> Table {
    let knobs = stats.rows.first().map(|row| &row.setting);
    let mut headings: Vec<String> = knobs.into_iter().flat_map(|s| s.keys().cloned()).collect();
    let figures = [
        "error", "bound", "wall s", "cpu s", "memory", "modelled", "front", "note",
    ];
    headings.extend(figures.map(str::to_owned));
    let rows = stats.rows.iter().map(|row| {
        let mut cells: Vec<String> = row.setting.values().map(plain).collect();
        let figure = |f: Option<f64>| f.map_or("-".to_owned(), short);
        cells.push(figure(row.error));
        cells.push(figure(row.bound));
        cells.push(row.wall_s.map_or("-".to_owned(), spread));
        cells.push(figure(row.cpu_s.map(|s| s.median)));
        cells.push(row.peak_bytes.map_or("-".to_owned(), bytes));
        let share = |m: &Modelled| format!("{} %", short(100.0 * m.share));
        cells.push(row.modelled.as_ref().map_or("-".to_owned(), share));
        cells.push(if row.on_front { "*" } else { "" }.to_owned());
        cells.push(row.message.clone().unwrap_or_default());
        cells
    });
    Table {
        rows: rows.collect(),
        headings,
    }
}

/// The middle, and by how much the outermost differ from it.
fn spread(spread: Spread) -> String {
    let Spread { median, min, max } = spread;
    if median > 0.0 {
        let off = 50.0 * (max - min) / median;
        format!("{} ±{off:.0} %", short(median))
    } else {
        short(median)
    }
}

/// The table for programs: all figures in full.
pub fn exported(stats: &Stats) -> Table {
    let knobs = stats.rows.first().map(|row| &row.setting);
    let mut headings: Vec<String> = knobs.into_iter().flat_map(|s| s.keys().cloned()).collect();
    let figures = [
        "status",
        "exit_code",
        "error",
        "bound",
        "wall_s",
        "wall_s_min",
        "wall_s_max",
        "cpu_s",
        "cpu_s_min",
        "cpu_s_max",
        "peak_bytes",
        "modelled_made",
        "modelled_full",
        "modelled_share",
        "runs",
        "rank",
        "on_front",
        "message",
    ];
    headings.extend(figures.map(str::to_owned));
    let rows = stats.rows.iter().map(|row| {
        let mut cells: Vec<String> = row.setting.values().map(plain).collect();
        let json = |value: Value| plain(&value);
        let spread = |s: Option<Spread>| [s.map(|s| s.median), s.map(|s| s.min), s.map(|s| s.max)];
        let figures = [row.error, row.bound].into_iter();
        let figures = figures.chain(spread(row.wall_s)).chain(spread(row.cpu_s));
        let modelled = row.modelled.as_ref();
        let status = match row.status {
            Status::Done => "done",
            Status::Failed => "failed",
            Status::NotRun => "not-run",
        };
        cells.push(status.to_owned());
        cells.push(row.exit_code.to_string());
        cells.extend(figures.map(|figure| json(figure.into())));
        cells.push(json(row.peak_bytes.into()));
        cells.push(json(modelled.map(|m| m.made).into()));
        cells.push(json(modelled.map(|m| m.full).into()));
        cells.push(json(modelled.map(|m| m.share).into()));
        cells.push(row.runs.to_string());
        cells.push(json(row.rank.into()));
        cells.push(row.on_front.to_string());
        cells.push(row.message.clone().unwrap_or_default());
        cells
    });
    Table {
        rows: rows.collect(),
        headings,
    }
}

/// Error against cost: the front, and what is not on it.
pub fn plot(stats: &Stats, cost: Cost, limits: &Limits) -> Plot {
    let (title, limit) = match cost {
        Cost::Wall => ("wall time (s)", limits.max_seconds),
        Cost::Cpu => ("processor time (s)", None),
        Cost::Memory => ("peak memory (bytes)", limits.max_memory.map(|m| m as f64)),
    };
    let point = |row: &Setting| {
        let spread = match cost {
            Cost::Wall => row.wall_s,
            Cost::Cpu => row.cpu_s,
            Cost::Memory => None,
        };
        let x = match cost {
            Cost::Memory => row.peak_bytes.map(|bytes| bytes as f64),
            _ => spread.map(|s| s.median),
        };
        let values: Vec<String> = row.setting.values().map(plain).collect();
        Some(Point {
            x: x?,
            y: row.error?,
            x_spread: spread.map(|s| [s.min, s.max]),
            y_spread: None,
            label: values.join(" "),
        })
    };
    let front = stats.front.iter().filter_map(|i| point(&stats.rows[*i]));
    let others = stats.rows.iter().filter(|row| !row.on_front);
    let Error { measure, unit, .. } = stats.error;
    let y = Axis::new(format!("error ({unit})"), Scale::Log);
    let mut plot = Plot::new(measure, Axis::new(title, Scale::Log), y);
    plot.series = vec![
        Series::front("on the front", front.collect()),
        Series {
            marker: Marker::Ring,
            ..Series::new("beaten by another", 0, others.filter_map(point).collect())
        },
    ];
    let guide = |on, value: Option<f64>| {
        value.map(|value| Guide {
            on,
            value,
            text: format!("at most {}", short(value)),
        })
    };
    let guides = [guide(On::Y, limits.max_error), guide(On::X, limit)];
    plot.guides = guides.into_iter().flatten().collect();
    plot.caption = stats.choice.as_ref().map_or(String::new(), |choice| {
        let values: Vec<String> = choice.setting.values().map(plain).collect();
        format!("{}: {}", choice.best, values.join(" "))
    });
    plot
}

/// The limits, for people: `an error of at most 0.1, at most 2 s`.
pub fn limits(limits: &Limits) -> String {
    let parts = [
        limits
            .max_error
            .map(|most| format!("an error of at most {most}")),
        limits.max_seconds.map(|most| format!("at most {most} s")),
        limits
            .max_memory
            .map(|most| format!("at most {most} bytes")),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    parts.join(", ")
}
