//! The setting to choose under limits.

use super::{Cost, Row, Status};
use schemars::JsonSchema;
use serde::Serialize;

/// What a setting must keep to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Limits {
    /// The largest error, in the unit of the command's measure.
    pub max_error: Option<f64>,
    /// The most seconds, by the median of the clock on the wall.
    pub max_seconds: Option<f64>,
    /// The most bytes.
    pub max_memory: Option<u64>,
}

/// What was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// There were no limits.
    NotAsked,
    /// No setting keeps to them.
    None,
    /// The row of this index.
    Row(usize),
}

/// Chooses: with a limit on the error the cheapest setting that keeps to all limits, else the most
/// exact. Of equals the more exact (the cheaper), then the first.
pub fn choose(rows: &[Row], limits: &Limits, cost: Cost) -> Choice {
    if *limits == Limits::default() {
        return Choice::NotAsked;
    }
    let order = |row: &Row| {
        let (price, error) = (row.cost(cost)?, row.error?);
        Some(match limits.max_error {
            Some(_) => [price, error],
            None => [error, price],
        })
    };
    let fitting = rows
        .iter()
        .enumerate()
        .filter(|(_, row)| keeps(row, limits));
    let best = fitting
        .filter_map(|(index, row)| Some((index, order(row)?)))
        .min_by(|(i, a), (j, b)| {
            a[0].total_cmp(&b[0])
                .then(a[1].total_cmp(&b[1]))
                .then(i.cmp(j))
        });
    best.map_or(Choice::None, |(index, _)| Choice::Row(index))
}

/// Whether a row keeps to the limits; what is not known keeps to none.
fn keeps(row: &Row, limits: &Limits) -> bool {
    let within = |figure: Option<f64>, most: Option<f64>| {
        most.is_none_or(|most| figure.is_some_and(|figure| figure <= most))
    };
    let memory = limits.max_memory.map(|bytes| bytes as f64);
    row.status == Status::Done
        && within(row.error, limits.max_error)
        && within(row.wall_s.map(|s| s.median), limits.max_seconds)
        && within(row.peak_bytes.map(|bytes| bytes as f64), memory)
}
