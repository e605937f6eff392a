//! Modules import downwards only, in the order that `ARCHITECTURE.md` gives.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules of this crate from the top to the bottom. Those of one line do not import each other.
const LAYERS: [&[&str]; 10] = [
    &["daemon", "layers"],
    &["grpc"],
    &["http", "zenoh"],
    &["config", "service"],
    &["convert"],
    &["handle"],
    &["loading"],
    &["driver"],
    &["call_error"],
    &["info", "log", "run_state"],
];

/// Files whose imports upwards are left: states of the world out to files and in from them.
const EXCEPTIONS: [&str; 2] = ["loading/saved_state_file.rs", "loading/saved_states.rs"];

/// The number of a module's line.
fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&module))
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Names of modules in `use crate::a::b;` and in `crate::a::b` within a line.
fn imported(line: &str) -> impl Iterator<Item = &str> {
    line.split("crate::").skip(1).map(|rest| {
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        &rest[..end]
    })
}

#[test]
fn modules_import_downwards_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let mut wrong = Vec::new();
    let mut modules = 0;
    for file in files {
        let name = file.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/");
        let module = name.split('/').next().unwrap().trim_end_matches(".rs");
        // Tests may put together what they test.
        let is_test = name.contains("tests") || name.contains("test_world");
        if is_test || ["lib", "main"].contains(&module) || EXCEPTIONS.contains(&name.as_str()) {
            continue;
        }
        let own = layer(module).unwrap_or_else(|| panic!("{module} is in no layer"));
        modules += 1;
        let text = fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            for other in imported(line) {
                let other = if other == "SimHandle" { "handle" } else { other };
                let is_below = layer(other).is_none_or(|other| other > own);
                if other != module && !is_below {
                    wrong.push(format!("{name}: crate::{other}"));
                }
            }
        }
    }
    assert!(modules > 100);
    assert!(wrong.is_empty(), "{wrong:#?}");
}
