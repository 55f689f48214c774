//! Which settings of a command to run, in which order, and what follows from the figures.
//!
//! Runs and clock are the caller's: nothing in here starts a process or looks at a watch.

mod choice;
mod grid;

pub use choice::{Choice, Limits, choose};
pub use grid::{Axis, Grid, Idle};

use crate::progress::Progress;
use crate::report::Modelled;
use crate::trade::named;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a grid of settings is run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// Timed runs of each setting, after one that verifies its error.
    pub repeat: u32,
    /// Seconds for all of it; without it every setting is run.
    pub budget_s: Option<f64>,
    /// Which cost counts.
    pub cost: Cost,
}

impl Params {
    /// Three timed runs of every setting, judged by the clock on the wall.
    pub const DEFAULT: Params = Params {
        repeat: 3,
        budget_s: None,
        cost: Cost::Wall,
    };
}

impl Default for Params {
    fn default() -> Self {
        Params::DEFAULT
    }
}

/// A cost that settings are ordered by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Cost {
    /// Seconds by the clock on the wall.
    Wall,
    /// Processor seconds, all threads together.
    Cpu,
    /// Bytes of memory.
    Memory,
}

named!(Cost { Wall = "wall", Cpu = "cpu", Memory = "memory" });

/// What one run took and found.
#[derive(Debug, Clone, PartialEq)]
pub struct Ran {
    /// Seconds by the clock on the wall.
    pub wall_s: f64,
    /// Processor seconds.
    pub cpu_s: f64,
    /// Largest resident memory, where the system tells.
    pub peak_bytes: Option<u64>,
    /// The error reached; `None` where the run did not verify it or there is none.
    pub error: Option<f64>,
    /// The proven bound on it.
    pub bound: Option<f64>,
    /// How much was built, of how much.
    pub modelled: Option<Modelled>,
}

/// How a run failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failed {
    /// Its exit code.
    pub code: u8,
    /// What it said.
    pub message: String,
}

/// The middle one of some figures, and the outermost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Spread {
    /// The middle one; of an even number the mean of the two.
    pub median: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// The spread of some figures; `None` of none.
    pub fn of(figures: &[f64]) -> Option<Self> {
        let mut sorted = figures.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let middle = sorted.len() / 2;
        let median = if sorted.len() % 2 == 1 {
            sorted[middle]
        } else {
            0.5 * (sorted[middle - 1] + sorted[middle])
        };
        Some(Spread { median, min, max })
    }
}

/// Runs a setting, and verifies its error where the second argument says so.
pub type Runner<'a> = dyn FnMut(&[usize], bool) -> Result<Ran, Failed> + 'a;

/// What became of a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Run, its error verified, its cost measured.
    Done,
    /// A run of it failed.
    Failed,
    /// Not run, for want of time.
    NotRun,
}

/// The figures of one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which value of each knob, from 0.
    pub setting: Vec<usize>,
    /// What became of it.
    pub status: Status,
    /// Exit code of the run that failed, else 0.
    pub code: u8,
    /// Why there are no figures, or not all.
    pub message: Option<String>,
    /// The error, verified.
    pub error: Option<f64>,
    /// The proven bound on it.
    pub bound: Option<f64>,
    /// Seconds of the timed runs.
    pub wall_s: Option<Spread>,
    /// Processor seconds of the timed runs.
    pub cpu_s: Option<Spread>,
    /// The most memory that a timed run took.
    pub peak_bytes: Option<u64>,
    /// How much was built, of how much.
    pub modelled: Option<Modelled>,
    /// Timed runs.
    pub runs: u32,
    /// Place among all by cost, from 1.
    pub rank: Option<usize>,
    /// Whether no other setting is as cheap and as exact, and better in one of both.
    pub on_front: bool,
}

impl Row {
    /// What it costs, where that is known.
    pub fn cost(&self, cost: Cost) -> Option<f64> {
        match cost {
            Cost::Wall => self.wall_s.map(|s| s.median),
            Cost::Cpu => self.cpu_s.map(|s| s.median),
            Cost::Memory => self.peak_bytes.map(|bytes| bytes as f64),
        }
    }
}

/// Runs a grid of settings: rows in the order of [`Grid::settings`].
///
/// `run(setting, verify)` runs one, `clock` tells seconds. Each setting is first run once to verify
/// its error, which warms caches up; then come `repeat` rounds of timed runs over all settings, to
/// and fro, so that a machine that becomes slower does so for all alike. With a budget settings
/// are taken up one at a time, those predicted to be cheapest first, for as long as the time is
/// predicted to suffice for all their runs; the first is run in any case. A setting that fails is
/// a row like any other. Nothing here costs anything beside the runs.
pub fn run<'a>(
    grid: &'a Grid,
    params: &Params,
    runner: &'a mut Runner<'a>,
    clock: &'a dyn Fn() -> f64,
    progress: &'a dyn Progress,
) -> Vec<Row> {
    let mut plan = Plan {
        grid,
        settings: grid.settings(),
        tried: Vec::new(),
        runner,
        clock,
        began: clock(),
        budget: params.budget_s,
        repeat: params.repeat,
        progress,
    };
    plan.tried.resize_with(plan.settings.len(), Tried::default);
    let first_round = match params.budget_s {
        None => {
            plan.verify_all();
            0
        }
        Some(_) => {
            plan.take_up_cheapest();
            1
        }
    };
    plan.time_all(first_round);
    let mut rows = plan.rows();
    rank(&mut rows, params.cost);
    mark_front(&mut rows, params.cost);
    rows
}

/// What is known of a setting so far.
#[derive(Default)]
struct Tried {
    verified: Option<Result<Ran, Failed>>,
    timed: Vec<Ran>,
    /// Seconds by the caller's clock of the verifying run, and of the timed run that took longest.
    verify_s: f64,
    timed_s: f64,
    cut_short: bool,
}

impl Tried {
    /// Share of the time that a timed run is expected to take, among the others.
    fn weight(&self) -> u64 {
        let seconds = if self.timed_s > 0.0 {
            self.timed_s
        } else {
            self.verify_s
        };
        (seconds * 1e3) as u64 + 1
    }

    fn is_alive(&self) -> bool {
        matches!(self.verified, Some(Ok(_)))
    }
}

struct Plan<'a> {
    grid: &'a Grid,
    settings: Vec<Vec<usize>>,
    tried: Vec<Tried>,
    runner: &'a mut Runner<'a>,
    clock: &'a dyn Fn() -> f64,
    began: f64,
    budget: Option<f64>,
    repeat: u32,
    progress: &'a dyn Progress,
}

impl Plan<'_> {
    fn verify_all(&mut self) {
        self.progress.stage("verify", self.settings.len() as u64);
        for index in 0..self.settings.len() {
            self.verify(index);
            self.progress.advance(1);
        }
    }

    fn verify(&mut self, index: usize) {
        let start = (self.clock)();
        let ran = (self.runner)(&self.settings[index], true);
        let tried = &mut self.tried[index];
        tried.verify_s = (self.clock)() - start;
        tried.verified = Some(ran);
    }

    fn time(&mut self, index: usize) {
        let start = (self.clock)();
        let ran = (self.runner)(&self.settings[index], false);
        let tried = &mut self.tried[index];
        tried.timed_s = tried.timed_s.max((self.clock)() - start);
        match ran {
            Ok(ran) => tried.timed.push(ran),
            Err(failed) => tried.verified = Some(Err(failed)),
        }
    }

    /// With a budget: verifies and times settings once each, the cheapest first.
    fn take_up_cheapest(&mut self) {
        self.progress.stage("verify", self.settings.len() as u64);
        while let Some((index, verify_s, timed_s)) = self.cheapest_ready() {
            let rest = f64::from(self.repeat.saturating_sub(1));
            let promised: f64 = self.tried.iter().map(|t| t.timed_s * rest).sum();
            let needed = verify_s + timed_s * (1.0 + rest);
            if self.spent() + promised + needed > self.budget.unwrap_or(f64::INFINITY) && index != 0
            {
                return;
            }
            self.verify(index);
            if self.tried[index].is_alive() && self.repeat > 0 {
                self.time(index);
            }
            self.progress.advance(1);
        }
    }

    fn spent(&self) -> f64 {
        (self.clock)() - self.began
    }

    /// The setting predicted to cost least of those whose cheaper neighbours are all done, with the
    /// seconds for a verifying and for a timed run of it.
    fn cheapest_ready(&self) -> Option<(usize, f64, f64)> {
        let ready = (0..self.settings.len()).filter(|i| self.tried[*i].verified.is_none());
        ready
            .filter_map(|index| {
                let (verify_s, timed_s) = self.predicted(index)?;
                Some((index, verify_s, timed_s))
            })
            .min_by(|a, b| (a.1 + a.2).total_cmp(&(b.1 + b.2)).then(a.0.cmp(&b.0)))
    }

    /// Seconds of a verifying and of a timed run, from the neighbours one step down each knob: each
    /// is taken to grow as it did on the step before, or on the same step beside, whichever is more,
    /// and the largest prediction counts. `None` while one of the neighbours has not been tried.
    fn predicted(&self, index: usize) -> Option<(f64, f64)> {
        let mut most = (0.0f64, 0.0f64);
        for axis in 0..self.grid.axes.len() {
            let Some(below) = grid::step_down(&self.settings, index, axis, 1) else {
                continue;
            };
            let near = &self.tried[below];
            near.verified.as_ref()?;
            let steps = self.steps_like(index, below, axis);
            let growth = |of: fn(&Tried) -> f64| {
                let assumed = self.grid.assumed_growth(axis, &self.settings[index]);
                let seen = steps
                    .iter()
                    .map(|[from, to]| of(&self.tried[*to]) / of(&self.tried[*from]))
                    .filter(|seen| seen.is_finite() && *seen > 0.0)
                    .reduce(f64::max);
                seen.map_or(assumed, |seen| seen.max(1.0)) * of(near)
            };
            most.0 = most.0.max(growth(|t| t.verify_s));
            most.1 = most.1.max(growth(|t| t.timed_s));
        }
        Some(most)
    }

    /// Steps along an axis that tell how much the one from `below` to `index` takes more: the one
    /// before it, and those beside it that are one step down another axis.
    fn steps_like(&self, index: usize, below: usize, axis: usize) -> Vec<[usize; 2]> {
        let down = |from, axis, steps| grid::step_down(&self.settings, from, axis, steps);
        let before = down(index, axis, 2).map(|before| [before, below]);
        let others = (0..self.grid.axes.len()).filter(|other| *other != axis);
        let beside = others.filter_map(|b| Some([down(below, b, 1)?, down(index, b, 1)?]));
        let tried = |i: &usize| self.tried[*i].verified.is_some();
        let all = before.into_iter().chain(beside);
        all.filter(|step| step.iter().all(tried)).collect()
    }

    /// Timed rounds over all that has not failed, to and fro.
    fn time_all(&mut self, first_round: u32) {
        let alive = self.tried.iter().filter(|t| t.is_alive());
        let rounds = u64::from(self.repeat.saturating_sub(first_round));
        let units = alive.map(Tried::weight).sum::<u64>() * rounds;
        let weights: Vec<u64> = self.tried.iter().map(Tried::weight).collect();
        self.progress.stage("measure", units);
        for round in first_round..self.repeat {
            for step in 0..self.settings.len() {
                let index = if round % 2 == 0 {
                    step
                } else {
                    self.settings.len() - 1 - step
                };
                if !self.tried[index].is_alive() {
                    continue;
                }
                let weight = weights[index];
                let over = self
                    .budget
                    .is_some_and(|most| self.spent() + self.tried[index].timed_s > most);
                if over {
                    self.tried[index].cut_short = true;
                } else {
                    self.time(index);
                }
                self.progress.advance(weight);
            }
        }
    }

    fn rows(self) -> Vec<Row> {
        let asked = self.repeat;
        let settings = self.settings.into_iter().zip(self.tried);
        settings.map(|(s, tried)| row(s, tried, asked)).collect()
    }
}

fn row(setting: Vec<usize>, tried: Tried, asked: u32) -> Row {
    let mut row = Row {
        setting,
        status: Status::NotRun,
        code: 0,
        message: None,
        error: None,
        bound: None,
        wall_s: None,
        cpu_s: None,
        peak_bytes: None,
        modelled: None,
        runs: tried.timed.len() as u32,
        rank: None,
        on_front: false,
    };
    match tried.verified {
        None => row.message = Some("predicted to take longer than is left of the budget".into()),
        Some(Err(failed)) => {
            row.status = Status::Failed;
            row.code = failed.code;
            row.message = Some(failed.message);
        }
        Some(Ok(ran)) => {
            let figures = |of: fn(&Ran) -> f64| {
                let all: Vec<f64> = tried.timed.iter().map(of).collect();
                Spread::of(&all)
            };
            row.status = Status::Done;
            row.wall_s = figures(|r| r.wall_s);
            row.cpu_s = figures(|r| r.cpu_s);
            row.peak_bytes = tried.timed.iter().filter_map(|r| r.peak_bytes).max();
            row.error = ran.error;
            row.bound = ran.bound;
            row.modelled = ran.modelled;
            row.message = if row.error.is_none() {
                Some("there is no error to measure".into())
            } else if tried.cut_short {
                let runs = row.runs;
                Some(format!("{runs} of {asked} timed runs, for want of time"))
            } else {
                None
            };
        }
    }
    row
}

/// Numbers the settings by cost; of equals the first comes first.
fn rank(rows: &mut [Row], cost: Cost) {
    let mut order: Vec<usize> = (0..rows.len())
        .filter(|i| rows[*i].cost(cost).is_some())
        .collect();
    order.sort_by(|a, b| by_cost(&rows[*a], &rows[*b], cost).then(a.cmp(b)));
    for (place, index) in order.into_iter().enumerate() {
        rows[index].rank = Some(place + 1);
    }
}

fn by_cost(a: &Row, b: &Row, cost: Cost) -> std::cmp::Ordering {
    let of = |row: &Row| row.cost(cost).unwrap_or(f64::INFINITY);
    of(a).total_cmp(&of(b))
}

/// Marks the settings that no other dominates; of equals the first alone.
fn mark_front(rows: &mut [Row], cost: Cost) {
    let error = |row: &Row| row.error.unwrap_or(f64::INFINITY);
    let mut order: Vec<usize> = (0..rows.len())
        .filter(|i| rows[*i].error.is_some() && rows[*i].cost(cost).is_some())
        .collect();
    order.sort_by(|a, b| {
        by_cost(&rows[*a], &rows[*b], cost)
            .then(error(&rows[*a]).total_cmp(&error(&rows[*b])))
            .then(a.cmp(b))
    });
    let mut least = f64::INFINITY;
    for index in order {
        if error(&rows[index]) < least {
            least = error(&rows[index]);
            rows[index].on_front = true;
        }
    }
}

#[cfg(test)]
mod tests;
