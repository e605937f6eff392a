//! The daemon opens files by one module, so that pipes, devices and endless files in a folder do not delay it. It
//! writes them by another one, so that no file is half written.

use std::fs;

use crate::layers::sources;
use crate::root;

/// Ways to open, read or write a file beside `simd_assets::files` and `simd_assets::Replacement`.
const WAYS: &[&str] = &[
    "File::open(",
    "File::create(",
    "File::options(",
    "OpenOptions::new(",
    "fs::read(",
    "fs::read_to_string(",
    "fs::write(",
    "fs::copy(",
    "from_pem_file(",
    "pem_file_iter(",
];

/// Files that may, and why.
const ALLOWED: &[(&str, &str)] = &[
    ("server/formats/assets/src/files.rs", "the one that opens"),
    ("server/formats/assets/src/replacement.rs", "the one that writes"),
    ("server/src/daemon/folders.rs", "tries whether a regular file may be written"),
    ("server/src/http/metrics.rs", "the system's own files in /proc"),
    ("server/src/replay.rs", "a table that a person asked for, as a shell would write it"),
    ("server/world/src/loading/xacro.rs", "new files in a folder that the daemon has just made"),
    ("server/world/src/process.rs", "the system's own files in /proc"),
    ("server/world/src/recording/file.rs", "a new file that grows while a recording runs"),
];

/// Returns whether code has a call, and not one whose name only ends like it.
fn is_in(code: &str, call: &str) -> bool {
    let is_whole = |(at, _): (usize, &str)| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    code.match_indices(call).any(is_whole)
}

#[test]
fn the_daemon_opens_and_writes_files_in_one_place() {
    let folders = [
        "server/src",
        "server/api/src",
        "server/world/src",
        "server/core/src",
        "server/model/src",
        "server/mcap/src",
        "server/ros2/src",
        "server/formats/assets/src",
        "server/formats/gltf/src",
        "server/formats/xacro/src",
    ];
    let mut found = Vec::new();
    for folder in folders {
        let mut files = Vec::new();
        sources(&root().join(folder), &mut files);
        for file in files {
            let name = file.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/");
            let text = fs::read_to_string(&file).unwrap();
            // Files of tests are declared with this attribute, or have its name.
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
            let is_test = name.contains("tests") || name.contains("vectors.rs");
            let ways = WAYS.iter().filter(|way| is_in(code, way));
            found.extend(ways.filter(|_| !is_test).map(|way| (name.clone(), *way)));
        }
    }
    let is_allowed = |name: &str| ALLOWED.iter().any(|(allowed, _)| *allowed == name);
    let wrong: Vec<_> = found.iter().filter(|(name, _)| !is_allowed(name)).collect();
    assert!(wrong.is_empty(), "use simd_assets::files or simd_assets::Replacement: {wrong:?}");
    for (name, why) in ALLOWED {
        assert!(found.iter().any(|(file, _)| file == name), "{name} need not be allowed any more ({why})");
    }
}
