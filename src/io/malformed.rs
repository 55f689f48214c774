//! Every malformed mesh file under `fixtures/malformed` is refused with the words beside it.

use super::source::Source;
use crate::error::Error;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

fn fixtures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/malformed");
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            ["obj", "ply", "stl", "off"]
                .iter()
                .any(|extension| path.extension().is_some_and(|e| e == *extension))
        })
        .collect();
    files.sort();
    files
}

/// What follows the path on standard error: the fault, and the way out on a line of its own.
fn message(source: &Source) -> String {
    match super::read(source, None) {
        Err(error @ Error::Malformed { .. }) => {
            let hint = error.hint().map(|hint| format!("{hint}\n"));
            let Error::Malformed { fault, .. } = &error else {
                return error.to_string();
            };
            format!("{fault}\n{}", hint.unwrap_or_default())
        }
        Err(error) => error.to_string(),
        Ok((content, ..)) => format!("read as {content:?}"),
    }
}

#[test]
fn malformed_meshes_are_refused_with_the_words_expected() {
    let files = fixtures();
    assert!(files.len() > 60, "{} files", files.len());
    let mut wrong = Vec::new();
    for path in files {
        let mut expected_path = path.clone().into_os_string();
        expected_path.push(".expected");
        let bytes = fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap();
        let plain = Source::from_bytes(name, bytes.clone()).unwrap();
        let found = message(&plain);
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            fs::write(&expected_path, &found).unwrap();
        }
        let expected = fs::read_to_string(&expected_path).unwrap_or_default();
        if found != expected {
            wrong.push(format!("{name}: {found}"));
        }
        let mut packer = GzEncoder::new(Vec::new(), Compression::fast());
        packer.write_all(&bytes).unwrap();
        let packed = Source::from_bytes(&format!("{name}.gz"), packer.finish().unwrap()).unwrap();
        assert_eq!(message(&packed), found, "{name}.gz");
    }
    assert!(wrong.is_empty(), "{}", wrong.join(""));
}
