//! The manual pages under `man/` are those of this binary.

use crate::support::{Workplace, root};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn pages(folder: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(folder).expect("a folder of pages");
    entries
        .map(|entry| entry.expect("a page"))
        .filter(|entry| entry.path().extension().is_some_and(|e| e == "1"))
        .map(|entry| {
            let text = fs::read_to_string(entry.path()).expect("a page");
            (entry.file_name().display().to_string(), text)
        })
        .collect()
}

#[test]
fn manual_pages_are_current() {
    let place = Workplace::new();
    assert_eq!(place.run("man man").code, 0);
    let (kept, fresh) = (pages(&root().join("man")), pages(&place.path("man")));
    let stale: Vec<_> = kept
        .keys()
        .chain(fresh.keys())
        .filter(|name| kept.get(*name) != fresh.get(*name))
        .collect();
    let way_out = "run `cargo run -- man man`, and remove what is left over";
    assert!(stale.is_empty(), "{stale:?} in man/ are stale: {way_out}");
    assert!(fresh.contains_key("scantle.1") && fresh.contains_key("scantle-info.1"));
}
