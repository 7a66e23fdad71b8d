//! The project's own rules (ARCHITECTURE.md), checked on its sources.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A source file past this many lines is asked what second thing it does.
const LINES_MAX: usize = 450;

/// Which of our crates each crate may lean on; `tests` may lean on all.
const ARROWS: [(&str, &[&str]); 6] = [
    ("proto", &[]),
    ("server/world", &[]),
    ("server/motion", &["world"]),
    ("devices", &[]),
    ("server", &["proto", "world", "motion", "devices"]),
    ("client", &["proto", "world", "motion"]),
];

/// Who alone may name what.
const SOLE_NAMES: [(&str, &str, &str); 3] = [
    ("serialport::", "devices/src", "devices/src/port.rs"),
    (
        "parry3d_f64",
        "server/world/src",
        "server/world/src/contact/broad.rs",
    ),
    ("std::time", "server/world/src", ""),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every Rust source below a folder, by its path from the root.
fn sources(folder: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![PathBuf::from(folder)];
    while let Some(folder) = folders.pop() {
        let entries =
            fs::read_dir(root().join(&folder)).expect("the project's own folders can be read");
        for entry in entries.map(|entry| entry.expect("an entry")) {
            let path = folder.join(entry.file_name());
            let is_own = !path.ends_with("target") && !path.ends_with(".git");
            if entry.path().is_dir() && is_own {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(entry.path()).expect("sources are text");
                found.insert(path.display().to_string(), text);
            }
        }
    }
    assert!(!found.is_empty(), "no sources in {folder}");
    found
}

fn all_sources() -> BTreeMap<String, String> {
    ["proto", "server", "devices", "client", "tests"]
        .into_iter()
        .flat_map(sources)
        .collect()
}

#[test]
fn crates_lean_only_where_they_may() {
    for (krate, allowed) in ARROWS {
        let manifest =
            fs::read_to_string(root().join(krate).join("Cargo.toml")).expect("a manifest");
        let lean = manifest
            .split("[dev-dependencies]")
            .next()
            .unwrap_or_default();
        for line in lean
            .lines()
            .filter_map(|line| line.strip_prefix("tsukamu-"))
        {
            let name = line.split(['.', ' ', '=']).next().unwrap_or_default();
            assert!(allowed.contains(&name), "{krate} must not lean on {name}");
        }
    }
}

#[test]
fn files_are_small_rooms() {
    let long: Vec<String> = all_sources()
        .iter()
        .map(|(path, text)| (path, text.lines().count()))
        .filter(|(_, n)| *n > LINES_MAX)
        .map(|(path, n)| format!("{path}: {n} lines"))
        .collect();
    assert!(long.is_empty(), "{long:#?}");
}

#[test]
fn what_one_file_alone_may_name_is_named_nowhere_else() {
    for (name, folder, sole) in SOLE_NAMES {
        for (path, text) in sources(folder) {
            assert!(path == sole || !text.contains(name), "{path} names {name}");
        }
    }
}

#[test]
fn nothing_is_left_unfinished() {
    // Put together here, so that this file does not find itself.
    let marks = [
        ["TO", "DO"],
        ["FIX", "ME"],
        ["unimple", "mented!("],
        ["#[ig", "nore"],
    ]
    .map(|parts| parts.concat());
    for (path, text) in all_sources() {
        for mark in &marks {
            assert!(!text.contains(mark.as_str()), "{path} has {mark}");
        }
    }
}

#[test]
fn one_version_of_what_everything_shares() {
    let lock = fs::read_to_string(root().join("Cargo.lock")).expect("the lock file is committed");
    let count = |name: &str| lock.matches(&format!("name = \"{name}\"\n")).count();
    for name in ["nalgebra", "prost", "tonic", "tokio", "libm"] {
        assert_eq!(count(name), 1, "{name}");
    }
    for name in ["aws-lc-rs", "openssl-sys", "libudev-sys", "parry3d"] {
        assert_eq!(count(name), 0, "{name}");
    }
}
