//! Robots of the test assets, read from disk without a daemon.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use simd_assets::Locator;
use simd_model::robot::Sha256;
use simd_model::{Asset, Assets, LoadReport, ReadOptions, RobotModel};

/// The folder of the test robots.
pub fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets")
}

/// Reads a URDF below the folder of the test robots, or, where it begins with
/// `pybullet_data/`, one that others made.
///
/// # Panics
/// Where it cannot be read: then the test that asked for it has failed.
#[allow(clippy::panic, reason = "the test has failed")]
pub fn read(urdf: &str) -> (Arc<RobotModel>, LoadReport) {
    let path = match urdf.strip_prefix("pybullet_data/") {
        Some(urdf) => crate::pybullet_data::folder().join(urdf),
        None => assets().join(urdf),
    };
    let text = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let files = OnDisk(Locator::new(&path));
    match simd_model::read(&text, &files, &ReadOptions::default()) {
        Ok((model, report)) => (Arc::new(model), report),
        Err(refused) => panic!("{urdf}: {refused}"),
    }
}

struct OnDisk(Locator);

impl Assets for OnDisk {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let places = |paths: &[PathBuf]| -> Vec<String> {
            paths.iter().map(|path| path.display().to_string()).collect()
        };
        let path = self.0.find(uri).map_err(|missing| places(&missing.places))?;
        let bytes: Arc<[u8]> = std::fs::read(&path).map_err(|_| places(&[path]))?.into();
        Ok(Asset { sha256: Sha256::of(&bytes), bytes })
    }
}
