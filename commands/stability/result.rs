//! What is reported of the extremes: JSON, and tables.

use super::Args;
use crate::table::{Table, plain, short};
use crate::wrapped::Wrapped;
use scantle::image::plot::{Axis, Guide, Line, On, Plot, Point, Scale, Series};
use scantle::measure::stability::{Drift, Reach, Rounding, Step};
use scantle::measure::tradeoff::Failed;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

/// What was asked for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Asked {
    /// The command.
    command: String,
    /// Its words, the input included.
    words: Vec<String>,
    /// Exponents of the powers of two scaled by.
    scales: Vec<i32>,
    /// Offsets, in extents of the input.
    offsets: Vec<f64>,
    /// What orders and bits are drawn from.
    seed: u64,
    /// The largest drift allowed, null without a check.
    max_error: Option<f64>,
    /// Whether all ran in one process.
    in_process: bool,
}

impl Asked {
    pub fn new(wrapped: &Wrapped, args: &Args) -> Self {
        let named = wrapped.name.split(' ').count();
        Asked {
            command: wrapped.name.clone(),
            words: wrapped.words(&wrapped.inputs, &[]).split_off(named),
            scales: args.scales.0.clone(),
            offsets: args.offsets.0.clone(),
            seed: args.seed.seed,
            max_error: args.max_error,
            in_process: args.wrapping.in_process,
        }
    }
}

/// What was found.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stats {
    /// Longest side of the input's box, in its unit.
    extent: f64,
    /// The unit of drifts and of the bound, which is that of the command's own error.
    unit: &'static str,
    /// The proven bound on the command's own error, to judge drifts by; null where there is none.
    error_bound: Option<f64>,
    /// The largest drift under the changes that the command is promised to bear; null where one of
    /// them failed.
    drift: Option<f64>,
    /// How far results do not change at all.
    unchanged: Reach,
    /// How far the drift stays within the command's own error bound.
    within_bound: Option<Reach>,
    /// A row per change.
    rows: Vec<Row>,
}

/// What became of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The command ran on the changed input.
    Done,
    /// It failed, though the untouched input does not.
    Failed,
    /// The change cannot be made on this input.
    Skipped,
}

impl Outcome {
    /// Stands for a code where there was no run.
    pub const SKIPPED: u8 = 255;
}

/// A change, and how far the result drifted. Drifts are in the unit of the whole, other lengths in the
/// input's.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Row {
    /// Name of the change.
    change: &'static str,
    /// How much of it, where there are several.
    amount: String,
    /// Whether the command is promised to bear it.
    promised: bool,
    /// What became of it.
    status: Outcome,
    /// Exit code of the run that failed, else 0.
    exit_code: u8,
    /// Why there are no figures.
    message: Option<String>,
    /// Largest distance from something in one result to the nearest in the other, for spheres that of
    /// their centres or the difference of their radii; for pictures the largest difference of a channel,
    /// where 1 is full; for animations the error about the centroids in percent.
    drift: Option<f64>,
    /// The same over the longest side of the input's box; without meaning for pictures and
    /// animations, and null.
    drift_relative: Option<f64>,
    /// Voxels set in one result and not in the other.
    differing_voxels: Option<u64>,
    /// How far the rounding of the result's own place moves it; not part of the drift.
    place: Option<f64>,
    /// How far the input's vertices or atoms had to be rounded.
    input_rounding: Option<Rounding>,
    /// The drift that this rounding of the input alone makes; not part of the drift.
    input_drift: Option<f64>,
    /// The voxels that it changes.
    input_differing_voxels: Option<u64>,
    #[serde(skip)]
    step: Step,
}

impl Row {
    pub fn new(step: Step, promised: bool) -> Self {
        Row {
            change: step.change().name(),
            amount: step.amount(),
            promised,
            status: Outcome::Done,
            exit_code: 0,
            message: None,
            drift: None,
            drift_relative: None,
            differing_voxels: None,
            place: None,
            input_rounding: None,
            input_drift: None,
            input_differing_voxels: None,
            step,
        }
    }

    pub fn rounding(&mut self, rounding: Rounding) {
        self.input_rounding = Some(rounding);
    }

    pub fn skipped(mut self, why: String) -> Self {
        self.status = Outcome::Skipped;
        self.message = Some(why);
        self
    }

    pub fn failed(mut self, failed: Failed) -> Self {
        if failed.code == Outcome::SKIPPED {
            return self.skipped(failed.message);
        }
        self.status = Outcome::Failed;
        self.exit_code = failed.code;
        self.message = Some(failed.message);
        self
    }

    pub fn done(mut self, drift: Drift, by_input: Option<Drift>) -> Self {
        self.drift = drift.distance;
        self.differing_voxels = drift.differing;
        self.place = Some(drift.place);
        self.input_drift = by_input.and_then(|d| d.distance);
        self.input_differing_voxels = by_input.and_then(|d| d.differing);
        if self.drift.is_none() {
            self.message = Some("one of both results is empty".to_owned());
        }
        self
    }

    /// Whether the result is no farther off than `most`.
    fn holds(&self, most: f64) -> bool {
        match self.status {
            Outcome::Skipped => true,
            Outcome::Failed => false,
            Outcome::Done => self.drift.is_some_and(|drift| drift <= most),
        }
    }

    /// Its name, for people.
    pub fn name(&self) -> String {
        format!("{} {}", self.change, self.amount)
            .trim_end()
            .to_owned()
    }
}

impl Stats {
    /// `in_space` says that drifts are lengths, to be shown as shares of the input's extent too.
    pub fn new(
        extent: f64,
        bound: Option<f64>,
        unit: &'static str,
        in_space: bool,
        mut rows: Vec<Row>,
    ) -> Self {
        for row in &mut rows {
            row.drift_relative = row.drift.filter(|_| in_space).map(|drift| drift / extent);
        }
        let reach = |most: f64| {
            let tried = rows.iter().filter(|row| row.status != Outcome::Skipped);
            let held: Vec<(Step, bool)> = tried.map(|row| (row.step, row.holds(most))).collect();
            Reach::of(&held)
        };
        let counted = rows
            .iter()
            .filter(|row| row.promised && row.status != Outcome::Skipped);
        let drifts: Option<Vec<f64>> = counted.map(|row| row.drift).collect();
        Stats {
            extent,
            unit,
            error_bound: bound,
            drift: drifts.map(|all| all.into_iter().fold(0.0, f64::max)),
            unchanged: reach(0.0),
            within_bound: bound.map(reach),
            rows,
        }
    }

    /// The rows that count and have drifted by more than `most`.
    pub fn broken(&self, most: f64) -> Vec<&Row> {
        let counted = self.rows.iter().filter(|row| row.promised);
        counted.filter(|row| !row.holds(most)).collect()
    }
}

/// The table for people.
pub fn table(stats: &Stats) -> Table {
    let drift = format!("drift ({})", stats.unit);
    let headings = [
        "change",
        "by",
        &drift,
        "voxels",
        "input moved",
        "ulps",
        "makes voxels",
        "promised",
        "note",
    ];
    let rows = stats.rows.iter().map(|row| {
        let figure = |f: Option<f64>| f.map_or("-".to_owned(), short);
        let count = |n: Option<u64>| n.map_or("-".to_owned(), |n| n.to_string());
        vec![
            row.change.to_owned(),
            row.amount.clone(),
            figure(row.drift),
            count(row.differing_voxels),
            figure(row.input_rounding.map(|r| r.max)),
            figure(row.input_rounding.map(|r| r.ulps)),
            count(row.input_differing_voxels),
            if row.promised { "yes" } else { "no" }.to_owned(),
            row.message.clone().unwrap_or_default(),
        ]
    });
    Table {
        headings: headings.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}

/// The table for programs: all figures in full.
pub fn exported(stats: &Stats) -> Table {
    let rows: Vec<Value> = stats
        .rows
        .iter()
        .map(|row| serde_json::to_value(row).unwrap_or_default())
        .collect();
    // The figures of the rounding become columns of their own.
    let flat = |row: &Value| -> Vec<(String, String)> {
        let mut cells = Vec::new();
        for (key, value) in row.as_object().into_iter().flatten() {
            if key == "input_rounding" {
                for part in ["max", "relative", "ulps"] {
                    cells.push((format!("{key}_{part}"), plain(&value[part])));
                }
            } else {
                cells.push((key.clone(), plain(value)));
            }
        }
        cells
    };
    let cells: Vec<Vec<(String, String)>> = rows.iter().map(flat).collect();
    let headings = cells
        .first()
        .into_iter()
        .flatten()
        .map(|(key, _)| key.clone());
    Table {
        headings: headings.collect(),
        rows: cells
            .iter()
            .map(|row| row.iter().map(|(_, cell)| cell.clone()).collect())
            .collect(),
    }
}

/// Drift against scale and offset, both as powers of two.
pub fn plot(stats: &Stats) -> Plot {
    let series = |name: &str, index, size: &dyn Fn(Step) -> Option<f64>| {
        let mut points: Vec<Point> = stats
            .rows
            .iter()
            .filter_map(|row| {
                Some(Point {
                    x: size(row.step)?,
                    y: row.drift?,
                    label: row
                        .differing_voxels
                        .map_or(String::new(), |n| n.to_string()),
                    ..Point::default()
                })
            })
            .collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Series {
            line: Line::Straight,
            ..Series::new(name, index, points)
        }
    };
    let scale = |step| match step {
        Step::Scale(exponent) => Some(f64::from(exponent)),
        _ => None,
    };
    let shift = |step| match step {
        Step::Shift(extents) => Some(extents.log2()),
        _ => None,
    };
    let x = Axis::new("power of two", Scale::Linear);
    let y = Axis::new(format!("drift ({})", stats.unit), Scale::Log);
    let mut plot = Plot::new(
        "Drift of the result against scale and offset of the input",
        x,
        y,
    );
    plot.series = vec![
        series("scaled by", 0, &scale),
        series("moved by, in extents", 1, &shift),
    ];
    plot.guides = stats
        .error_bound
        .map(|value| Guide {
            on: On::Y,
            value,
            text: format!("the command's own error bound, {}", short(value)),
        })
        .into_iter()
        .collect();
    plot
}

/// How far results hold, for people.
pub fn summary(stats: &Stats) -> String {
    let line = |reach: &Reach| {
        let scale = |k: Option<i32>| k.map_or("none".to_owned(), |k| format!("2^{k}"));
        let offset = reach
            .offset
            .map_or("none".to_owned(), |o| format!("{o:e} extents"));
        let (small, large) = (scale(reach.smallest_scale), scale(reach.largest_scale));
        format!("scales down to {small} and up to {large}, offsets up to {offset}")
    };
    let mut text = format!("unchanged under {}\n", line(&stats.unchanged));
    if let (Some(bound), Some(reach)) = (stats.error_bound, &stats.within_bound) {
        text += &format!(
            "within the error bound {} under {}\n",
            short(bound),
            line(reach)
        );
    }
    text
}
