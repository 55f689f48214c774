//! How far two reports, or any two files of JSON, are from each other.

use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::report::{Accuracy, VARIES, is_report, stated_to_vary};
use gap::gap;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Number, Value};

mod difference;
mod gap;
#[cfg(test)]
mod tests;

pub use difference::{Change, Difference};
use difference::{Path, Step, shown, type_name};

/// Differences that are named.
const NAMED: usize = 20;

/// How two files of JSON are compared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// The largest relative difference of two numbers that is not named: the difference over the
    /// larger of the two.
    pub tolerance: f64,
    /// Whether that is compared too which is left out of reports: `run`, which varies from run to
    /// run, the `path` of each `input` and `output`, and what both reports state in `varies`.
    pub everything: bool,
}

impl Params {
    /// Every difference of what is found and made.
    pub const DEFAULT: Params = Params {
        tolerance: 0.0,
        everything: false,
    };

    /// Errors when the tolerance is negative or no number.
    pub fn check(&self) -> Result<()> {
        if self.tolerance.is_finite() && self.tolerance >= 0.0 {
            return Ok(());
        }
        let problem = "must be finite and not negative";
        Err(Error::parameter("tolerance", self.tolerance, problem))
    }
}

/// How two files of JSON differ.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ReportDifference {
    /// Whether nothing that was compared differs.
    pub identical: bool,
    /// Documents of the first file.
    pub documents_a: u64,
    /// Documents of the second file.
    pub documents_b: u64,
    /// Numbers, strings, booleans and nulls of the first file that the second has something for.
    pub values: u64,
    /// Members that were left out: see the parameter `everything`.
    pub left_out: u64,
    /// Differences; not those of numbers within the tolerance.
    pub differing: u64,
    /// Those of them that are not between two numbers.
    pub other: u64,
    /// Numbers that differ, but by no more than the tolerance.
    pub within: u64,
    /// The largest relative difference of two numbers, 0 where none differ.
    pub max_relative: f64,
    /// The largest difference of two numbers, 0 where none differ; null where it is beyond the
    /// largest double.
    pub max_absolute: Option<f64>,
    /// The first difference that is not between two numbers; where there is none, the first of the
    /// largest relative difference, be it within the tolerance; null where nothing differs.
    pub worst: Option<Difference>,
    /// The first 20 differences, in the order of the first file; of an object, members that only
    /// the second file has come last.
    pub first: Vec<Difference>,
}

impl ReportDifference {
    /// The largest relative difference of two numbers, as the accuracy of a report.
    ///
    /// It is null where anything else differs, which no number measures.
    pub fn accuracy(&self) -> Accuracy {
        let error = (self.other == 0).then_some(self.max_relative);
        Accuracy {
            measure: "largest relative difference".to_owned(),
            unit: "of the larger number".to_owned(),
            bound: error,
            reached: error,
            reference: "every number".to_owned(),
            verified: error.is_some(),
        }
    }
}

/// Compares two lists of documents, the first with the first and so on.
///
/// Numbers are compared by their values, however they are written: integers exactly, all others as
/// doubles. The order of an object's members does not matter. Of arrays of different lengths, the
/// elements that both have are compared too. Of documents that both are reports of scantle,
/// [`VARIES`] and what both state to vary are left out, unless asked for. Errors when the
/// parameters are out of range. Cost: linear in the values, and as deep a stack as they are nested.
pub fn compare(
    a: &[Value],
    b: &[Value],
    params: &Params,
    progress: &dyn Progress,
) -> Result<ReportDifference> {
    params.check()?;
    progress.stage("compare", a.len().max(b.len()) as u64);
    let mut walk = Walk::new(a, b, params.tolerance);
    for index in 0..a.len().max(b.len()) {
        walk.path = Path::new(index as u64);
        match (a.get(index), b.get(index)) {
            (Some(a), Some(b)) => {
                walk.left_out = left_out(a, b, params);
                walk.values(a, b);
            }
            (a, b) => walk.lone(a, b),
        }
        progress.advance(1);
    }
    Ok(walk.end())
}

/// The members of two documents that are not compared.
fn left_out<'v>(a: &'v Value, b: &'v Value, params: &Params) -> Vec<&'v str> {
    if params.everything || !is_report(a) || !is_report(b) {
        return Vec::new();
    }
    // A file alone cannot keep back what the other one has.
    let of_b: Vec<&str> = stated_to_vary(b).collect();
    let of_both = stated_to_vary(a).filter(|pointer| of_b.contains(pointer));
    VARIES.iter().copied().chain(of_both).collect()
}

/// A walk through two documents at once.
struct Walk<'v> {
    tolerance: f64,
    left_out: Vec<&'v str>,
    path: Path<'v>,
    max_absolute: f64,
    found: ReportDifference,
}

impl<'v> Walk<'v> {
    fn new(a: &[Value], b: &[Value], tolerance: f64) -> Self {
        Walk {
            tolerance,
            left_out: Vec::new(),
            path: Path::new(0),
            max_absolute: 0.0,
            found: ReportDifference {
                identical: true,
                documents_a: a.len() as u64,
                documents_b: b.len() as u64,
                values: 0,
                left_out: 0,
                differing: 0,
                other: 0,
                within: 0,
                max_relative: 0.0,
                max_absolute: None,
                worst: None,
                first: Vec::new(),
            },
        }
    }

    fn end(self) -> ReportDifference {
        let max_absolute = self.max_absolute;
        ReportDifference {
            identical: self.found.differing == 0 && self.found.within == 0,
            max_absolute: max_absolute.is_finite().then_some(max_absolute),
            ..self.found
        }
    }

    fn values(&mut self, a: &'v Value, b: &'v Value) {
        if !matches!(a, Value::Array(_) | Value::Object(_)) {
            self.found.values += 1;
        }
        match (a, b) {
            (Value::Object(a), Value::Object(b)) => self.objects(a, b),
            (Value::Array(a), Value::Array(b)) => self.arrays(a, b),
            (Value::Number(a), Value::Number(b)) => self.numbers(a, b),
            (Value::String(a), Value::String(b)) if a != b => self.note(Change::String {
                a: shown(a),
                b: shown(b),
            }),
            (Value::Bool(a), Value::Bool(b)) if a != b => {
                self.note(Change::Boolean { a: *a, b: *b });
            }
            _ if type_name(a) != type_name(b) => self.note(Change::Type {
                a: type_name(a).to_owned(),
                b: type_name(b).to_owned(),
            }),
            _ => {}
        }
    }

    fn objects(&mut self, a: &'v Map<String, Value>, b: &'v Map<String, Value>) {
        for (key, value) in a {
            self.member(key, Some(value), b.get(key));
        }
        for (key, value) in b.iter().filter(|(key, _)| !a.contains_key(*key)) {
            self.member(key, None, Some(value));
        }
    }

    fn member(&mut self, key: &'v str, a: Option<&'v Value>, b: Option<&'v Value>) {
        let mut left_out = self.left_out.iter();
        if left_out.any(|pointer| self.path.is_at(key, pointer)) {
            self.found.left_out += 1;
            return;
        }
        self.path.push(Step::Key(key));
        match (a, b) {
            (Some(a), Some(b)) => self.values(a, b),
            (a, b) => self.lone(a, b),
        }
        self.path.pop();
    }

    fn arrays(&mut self, a: &'v [Value], b: &'v [Value]) {
        if a.len() != b.len() {
            let (a, b) = (a.len() as u64, b.len() as u64);
            self.note(Change::Length { a, b });
        }
        for (index, (a, b)) in a.iter().zip(b).enumerate() {
            self.path.push(Step::Index(index));
            self.values(a, b);
            self.path.pop();
        }
    }

    /// What only one of the two has.
    fn lone(&mut self, a: Option<&Value>, b: Option<&Value>) {
        let name = |value| type_name(value).to_owned();
        if let Some(a) = a {
            self.note(Change::Missing { a: name(a) });
        } else if let Some(b) = b {
            self.note(Change::Added { b: name(b) });
        }
    }

    fn numbers(&mut self, a: &Number, b: &Number) {
        let gap = gap(a, b);
        if gap.relative == 0.0 {
            return;
        }
        let change = || Change::Number {
            a: a.clone(),
            b: b.clone(),
            absolute: gap.absolute.is_finite().then_some(gap.absolute),
            relative: gap.relative,
        };
        self.max_absolute = self.max_absolute.max(gap.absolute);
        if gap.relative > self.found.max_relative {
            self.found.max_relative = gap.relative;
            if self.found.other == 0 {
                self.found.worst = Some(self.path.difference(change()));
            }
        }
        if gap.relative > self.tolerance {
            self.found.differing += 1;
            self.name(change);
        } else {
            self.found.within += 1;
        }
    }

    /// Notes a difference that is not between two numbers.
    fn note(&mut self, change: Change) {
        if self.found.other == 0 {
            self.found.worst = Some(self.path.difference(change.clone()));
        }
        self.found.other += 1;
        self.found.differing += 1;
        self.name(|| change);
    }

    /// Adds a difference to the first ones, while there is room.
    fn name(&mut self, change: impl FnOnce() -> Change) {
        if self.found.first.len() < NAMED {
            self.found.first.push(self.path.difference(change()));
        }
    }
}
