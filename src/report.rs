//! The report every command makes: one envelope, one vocabulary.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// The version of the envelope. Adding a field keeps it; renaming or removing one raises it.
pub const SCHEMA: u32 = 1;

/// The report of one run over one input (or one set of inputs).
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Report<P, R> {
    /// Version of this envelope.
    pub schema: u32,
    /// Version of scantle.
    pub scantle: String,
    /// The command that ran.
    pub command: String,
    /// What was read.
    pub input: Vec<Input>,
    /// What was written.
    pub output: Vec<Output>,
    /// Every effective parameter, defaults included.
    pub parameters: P,
    /// What the command found or made.
    pub result: R,
    /// The error made; an array where the command has several measures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Measures>,
    /// How much of the full model was built.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modelled: Option<Modelled>,
    /// What looks wrong but could be worked with.
    pub warnings: Vec<Warning>,
    /// Members of this report that vary from run to run, beside [`VARIES`] and in the same form.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub varies: Vec<&'static str>,
    /// What varies from run to run; only with `--timings`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<Run>,
}

/// Members of every report that depend on the run and not on the result, as JSON pointers
/// (RFC 6901) in which `*` stands for each element of an array.
pub const VARIES: &[&str] = &["/run", "/input/*/path", "/output/*/path"];

/// The members that a report states to vary, beside [`VARIES`].
pub fn stated_to_vary(report: &Value) -> impl Iterator<Item = &str> {
    let stated = report.get("varies").and_then(Value::as_array);
    stated.into_iter().flatten().filter_map(Value::as_str)
}

/// A file that was read.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Input {
    /// As given on the command line; `-` is standard input.
    pub path: String,
    /// Its format, as `scantle formats` names it.
    pub format: String,
    /// Size in bytes, as stored.
    pub bytes: u64,
    /// SHA-256 of the bytes as stored, in hexadecimal.
    pub sha256: String,
    /// Counts and bounds as read.
    #[serde(flatten)]
    pub content: Content,
}

/// What a file holds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Content {
    /// Vertices of a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<u64>,
    /// Faces as stored, of any number of corners.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub faces: Option<u64>,
    /// Triangles after faces of more corners are split.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangles: Option<u64>,
    /// Segments of polylines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<u64>,
    /// Points that stand alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<u64>,
    /// Splats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub splats: Option<u64>,
    /// Voxels along x, y, z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dims: Option<[u64; 3]>,
    /// Type of a voxel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_type: Option<String>,
    /// Pixels along a row and rows of an image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixels: Option<[u64; 2]>,
    /// Samples of a pixel: 1 grey, 2 with opacity, 3 colour, 4 with opacity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channels: Option<u64>,
    /// Bits of a sample of an image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<u32>,
    /// Atoms of a molecule, of all its models.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub atoms: Option<u64>,
    /// Residues of a molecule, of all its models; ligands, ions and water are some too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residues: Option<u64>,
    /// Models of a molecule, where there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub models: Option<u64>,
    /// Frames of an animation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
    /// Frames per second of an animation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// Documents of a JSON file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub documents: Option<u64>,
    /// Features on a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub features: Option<u64>,
    /// Places of the points, lines and rings of features.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub places: Option<u64>,
    /// Cells along a row and rows of a terrain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<[u64; 2]>,
    /// The coordinate reference system, where the file says it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crs: Option<String>,
    /// Smallest and largest coordinate on a map: `[[x, y], [x, y]]`, null when there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extent: Option<[[f64; 2]; 2]>,
    /// Smallest and largest coordinate: `[[x, y, z], [x, y, z]]`, null when there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[[f64; 3]; 2]>,
}

/// A file that was written.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Output {
    /// Where; `-` is standard output.
    pub path: String,
    /// Its format, as `scantle formats` names it.
    pub format: String,
    /// Size in bytes, as stored.
    pub bytes: u64,
    /// SHA-256 of the bytes as stored, in hexadecimal.
    pub sha256: String,
}

/// How many documents are reports of one command, as one version of scantle makes them.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct Made {
    /// The command.
    pub command: String,
    /// Version of scantle.
    pub scantle: String,
    /// Version of the envelope.
    pub schema: u64,
    /// The documents.
    pub documents: u64,
}

/// Whether a document has the envelope of a report.
pub fn is_report(document: &Value) -> bool {
    envelope(document).is_some()
}

fn envelope(document: &Value) -> Option<(&str, &str, u64)> {
    let command = document.get("command")?.as_str()?;
    let scantle = document.get("scantle")?.as_str()?;
    Some((command, scantle, document.get("schema")?.as_u64()?))
}

/// The commands and versions that documents are reports of, in alphabetical order; documents that
/// are no reports are left out. Cost: n log n.
pub fn made_by(documents: &[Value]) -> Vec<Made> {
    let mut counts = BTreeMap::new();
    for made in documents.iter().filter_map(envelope) {
        *counts.entry(made).or_insert(0) += 1;
    }
    let rows = counts.into_iter();
    rows.map(|((command, scantle, schema), documents)| Made {
        command: command.to_owned(),
        scantle: scantle.to_owned(),
        schema,
        documents,
    })
    .collect()
}

/// One measure of the error made, or several.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Measures {
    /// The only one.
    One(Accuracy),
    /// All of them, in a fixed order.
    Many(Vec<Accuracy>),
}

/// One measure of the error made.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Accuracy {
    /// What is measured.
    pub measure: String,
    /// In which unit.
    pub unit: String,
    /// A proven upper bound, null where none is.
    pub bound: Option<f64>,
    /// The measured error, null where it was not measured.
    pub reached: Option<f64>,
    /// What it is measured against, or what proves the bound.
    pub reference: String,
    /// Whether `reached` was measured against that reference in this run.
    pub verified: bool,
}

/// How much of the full model was built.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Modelled {
    /// What is counted.
    pub unit: String,
    /// How many were made.
    pub made: u64,
    /// How many the full model has.
    pub full: u64,
    /// `made / full`.
    pub share: f64,
    /// Bytes of what was made.
    pub bytes: u64,
}

impl Modelled {
    /// The share follows from the two counts; an empty full model has share 0.
    pub fn new(unit: &str, made: u64, full: u64, bytes: u64) -> Self {
        let share = if full == 0 {
            0.0
        } else {
            made as f64 / full as f64
        };
        Modelled {
            unit: unit.to_owned(),
            made,
            full,
            share,
            bytes,
        }
    }
}

/// Something that looks wrong but can be worked with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Warning {
    /// Stable name for programs: `degenerate-triangles`.
    pub code: String,
    /// For a person.
    pub message: String,
    /// How many there are.
    pub count: u64,
    /// Index of the first, where it has one (counted from 0; lines from 1).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<u64>,
}

impl Warning {
    /// A counted warning.
    pub fn new(code: &str, message: impl Into<String>, count: u64, first: Option<u64>) -> Self {
        Warning {
            code: code.to_owned(),
            message: message.into(),
            count,
            first,
        }
    }
}

/// How many of something there are, and the first.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    count: u64,
    first: Option<u64>,
}

impl Tally {
    /// Counts the one at `place`; places come in rising order.
    pub fn note(&mut self, place: u64) {
        self.count += 1;
        self.first = self.first.or(Some(place));
    }

    /// Counts those of a later part.
    pub fn add(&mut self, later: Tally) {
        self.count += later.count;
        self.first = self.first.or(later.first);
    }

    /// How many there are.
    pub fn count(self) -> u64 {
        self.count
    }

    /// The place of the first.
    pub fn first(self) -> Option<u64> {
        self.first
    }

    /// Whether there is none.
    pub fn is_empty(self) -> bool {
        self.count == 0
    }

    /// Adds a warning, unless there is nothing to warn of.
    pub fn warn(self, code: &str, message: impl Into<String>, warnings: &mut Vec<Warning>) {
        if self.count > 0 {
            warnings.push(Warning::new(code, message, self.count, self.first));
        }
    }
}

/// What varies from run to run.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Run {
    /// Seconds from start to report.
    pub wall_s: f64,
    /// Processor seconds, all threads together.
    pub cpu_s: f64,
    /// Largest resident memory in bytes, null where the system does not tell.
    pub peak_bytes: Option<u64>,
    /// Worker threads.
    pub threads: usize,
    /// The steps, in order; they add up to the whole.
    pub stages: Vec<Stage>,
}

/// One step of a run.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Stage {
    /// `read`, the algorithm's own steps, `write`.
    pub name: String,
    /// Seconds.
    pub wall_s: f64,
    /// Processor seconds, all threads together.
    pub cpu_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn documents_are_told_to_be_reports_by_their_envelope() {
        let report = |command| json!({"schema": 1, "scantle": "0.1.0", "command": command});
        let made = |command: &str, documents| Made {
            command: command.to_owned(),
            scantle: "0.1.0".to_owned(),
            schema: 1,
            documents,
        };
        let others = [
            json!(null),
            json!([1]),
            json!({"schema": 1, "command": "info"}),
        ];
        assert!(!others.iter().any(is_report));
        let mut documents = vec![report("info"), report("compare"), report("info")];
        documents.extend(others);
        assert_eq!(made_by(&documents), [made("compare", 1), made("info", 2)]);
    }
}
