//! A table of labels and their names.

use scantle::error::{Error, Fault, Result, number};
use scantle::io::source::Source;
use std::collections::BTreeMap;

/// Reads lines of a label, a comma and a name. A first line whose label is no number is a heading;
/// empty lines and those that start with `#` are left out.
pub fn read(file: &str, memory: u64) -> Result<BTreeMap<String, String>> {
    let source = Source::open(file, memory)?;
    let malformed = |line: usize, problem: String| Error::Malformed {
        path: file.into(),
        fault: Fault::line(line as u64 + 1, problem),
    };
    let text = std::str::from_utf8(source.bytes())
        .map_err(|_| malformed(0, "is not text in UTF-8".to_owned()))?;
    let mut names = BTreeMap::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let Some((label, name)) = line.split_once(',') else {
            let problem = format!("no comma between a label and its name: {line}");
            return Err(malformed(i, problem));
        };
        let name = name.trim().trim_matches('"').to_owned();
        match label.trim().parse::<f64>() {
            Ok(label) => {
                let label = number(label);
                if let Some(other) = names.insert(label.clone(), name) {
                    let problem = format!("label {label} has a name already: {other}");
                    return Err(malformed(i, problem));
                }
            }
            Err(_) if i == 0 => {}
            Err(_) => return Err(malformed(i, format!("{label} is no number"))),
        }
    }
    Ok(names)
}
