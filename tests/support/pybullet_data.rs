//! Other people's robots: those of the PyPI package `pybullet`, which `make test` installs.

use std::path::PathBuf;

/// Returns the package's data folder.
///
/// # Panics
/// Panics if it is not installed: the test cannot be done.
#[allow(clippy::panic, reason = "the test cannot be done")]
pub fn folder() -> PathBuf {
    let venv = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target/test-venv/lib");
    let pythons = std::fs::read_dir(&venv).into_iter().flatten().filter_map(Result::ok);
    let data = pythons.map(|python| python.path().join("site-packages/pybullet_data"));
    data.into_iter()
        .find(|folder| folder.is_dir())
        .unwrap_or_else(|| panic!("there is no pybullet_data below {}; run `make test-data`", venv.display()))
}
