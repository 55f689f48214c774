//! The malformed glTF and volume files of `fixtures/malformed` and what is said about each.

use super::format::Format;
use super::source::Source;
use crate::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// Beginnings of the names of the files checked here, and the format each is read as.
const FORMATS: [(&str, Format); 7] = [
    ("gltf-", Format::Gltf),
    ("glb-", Format::Glb),
    ("nrrd-", Format::Nrrd),
    ("mha-", Format::Mha),
    ("mhd-", Format::Mhd),
    ("npy-", Format::Npy),
    ("binvox-", Format::Binvox),
];

/// Beside each file lies its message: the fault, then the way out where there is one.
/// `UPDATE_GOLDEN=1` rewrites the messages.
#[test]
fn every_malformed_file_is_refused_with_its_message() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/malformed");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let mut checked = [0; FORMATS.len()];
    let mut wrong = Vec::new();
    for path in files {
        let name = path.file_name().unwrap().to_str().unwrap();
        let known = FORMATS
            .iter()
            .position(|(start, _)| name.starts_with(start));
        let Some(index) = known.filter(|_| !name.ends_with(".expected")) else {
            continue;
        };
        checked[index] += 1;
        let source = Source::open(path.to_str().unwrap(), 1 << 30).unwrap();
        let found = match super::read(&source, Some(FORMATS[index].1)) {
            Err(Error::Malformed { fault, .. }) => match &fault.hint {
                Some(hint) => format!("{fault}\n{hint}\n"),
                None => format!("{fault}\n"),
            },
            other => panic!("{name} is not refused as malformed: {other:?}"),
        };
        let expected = path.with_file_name(format!("{name}.expected"));
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            fs::write(&expected, &found).unwrap();
        }
        let wanted = fs::read_to_string(&expected).unwrap_or_default();
        if found != wanted {
            wrong.push(format!("{name}: {wanted:?} became {found:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked.iter().all(|count| *count > 0), "{checked:?}");
}
