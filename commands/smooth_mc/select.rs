//! What of a volume is inside.

use super::{Args, Chosen};
use scantle::error::{Error, Result, number};
use scantle::volume::Volume;
use scantle::volume::isosurface::{self, Select};
use schemars::JsonSchema;
use serde::Serialize;

/// What counts as inside.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Inside {
    /// Every value but 0.
    Set,
    /// This value.
    Label(f64),
    /// Each of these values, a body of its own.
    Labels(Vec<f64>),
    /// This value and larger ones.
    AtLeast(f64),
}

/// What is inside: what was asked for, else the only value there is beside 0.
pub fn inside(volume: &Volume, args: &Args) -> Result<Inside> {
    if let Some(level) = args.threshold_value {
        return Ok(Inside::AtLeast(level));
    }
    if volume.is_binary() {
        return Ok(Inside::Set);
    }
    let kind = volume.data.sample_type();
    let found = isosurface::values(volume, MOST_VALUES);
    let Some(found) = found.filter(|f| f.iter().all(|v| v.fract() == 0.0 && v.abs() < 2e9)) else {
        let range = volume.range().unwrap_or_default();
        let problem = format!(
            "is needed: the voxels are {kind} from {} to {}, amounts rather than labels",
            range[0], range[1]
        );
        return Err(Error::parameter("threshold-value", "V", problem));
    };
    let there: Vec<f64> = found.into_iter().filter(|v| *v != 0.0).collect();
    let missing = |option, value: f64| {
        let problem = format!("is no label of the volume, which has {}", listed(&there));
        Error::parameter(option, number(value), problem)
    };
    match (args.label, &args.labels) {
        (Some(label), _) if there.contains(&label) => Ok(Inside::Label(label)),
        (Some(label), _) => Err(missing("label", label)),
        (None, Some(Chosen::All)) => Ok(Inside::Labels(there)),
        (None, Some(Chosen::These(values))) => {
            if let Some(value) = values.iter().find(|v| !there.contains(v)) {
                return Err(missing("labels", *value));
            }
            let mut values = values.clone();
            values.sort_by(f64::total_cmp);
            values.dedup();
            Ok(Inside::Labels(values))
        }
        (None, None) if there.len() > 1 => Err(Error::parameter(
            "label",
            "K",
            format!(
                "is needed, or --labels or --threshold-value: the volume has {}",
                listed(&there)
            ),
        )),
        (None, None) => Ok(there
            .first()
            .map_or(Inside::Set, |label| Inside::Label(*label))),
    }
}

/// Most different values that a volume of labels has.
const MOST_VALUES: usize = 4096;

/// Most labels that an error names.
const NAMED: usize = 24;

fn listed(labels: &[f64]) -> String {
    let names: Vec<String> = labels.iter().take(NAMED).map(|l| number(*l)).collect();
    let more = if labels.len() > NAMED { ", ..." } else { "" };
    match labels.len() {
        0 => "no label but 0".to_owned(),
        1 => format!("the label {}", names[0]),
        n => format!("{n} labels: {}{more}", names.join(", ")),
    }
}

impl Inside {
    /// It as the extraction takes it; labels are taken one by one.
    pub fn select(&self) -> Select {
        match self {
            Inside::Label(label) => Select::Equal(*label),
            Inside::AtLeast(level) => Select::AtLeast(*level),
            Inside::Set | Inside::Labels(_) => Select::Set,
        }
    }
}
