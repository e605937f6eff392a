//! Robots of the test assets, read from disk without a daemon.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glamx::DPose3;
use simd_assets::Locator;
use simd_model::robot::Sha256;
use simd_model::{Asset, Assets, LoadLimits, LoadReport, ReadOptions, RobotModel};

/// Returns the folder of the test robots.
pub fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets")
}

/// Reads a URDF below the folder of the test robots, or of other people's robots if the path begins with
/// `pybullet_data/`.
///
/// # Panics
/// Panics if it cannot be read: then the test that asked for it has failed.
#[allow(clippy::panic, reason = "the test has failed")]
pub fn read(urdf: &str) -> (Arc<RobotModel>, LoadReport) {
    let (text, files) = opened(urdf);
    match simd_model::read(&text, &files, &ReadOptions::default()) {
        Ok((model, report)) => (Arc::new(model), report),
        Err(refused) => panic!("{urdf}: {refused}"),
    }
}

/// Files of a description without references.
pub struct NoFiles;

impl Assets for NoFiles {
    fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
        Err(Vec::new())
    }
}

/// Reads a URDF that refers to no file.
///
/// # Panics
/// Panics if it cannot be read: then the test that wrote it has failed.
#[allow(clippy::panic, reason = "the test has failed")]
pub fn from_text(urdf: &str) -> Arc<RobotModel> {
    match simd_model::read(urdf.as_bytes(), &NoFiles, &ReadOptions::default()) {
        Ok((model, _)) => Arc::new(model),
        Err(refused) => panic!("{refused}"),
    }
}

/// A robot of a file, its pose, and whether its root is fixed.
pub struct Described {
    /// The robot.
    pub model: Arc<RobotModel>,
    /// Pose of its root link.
    pub pose: DPose3,
    /// From the file.
    pub fixed: bool,
}

/// Returns all robots of an SDF, found as [`read`] finds a URDF.
///
/// # Panics
/// Panics if it cannot be read: then the test that asked for it has failed.
pub fn read_all(sdf: &str) -> Vec<Described> {
    let (text, files) = opened(sdf);
    all_of(sdf, &text, &files)
}

/// Returns all robots of the text of an SDF or MJCF that names no file.
///
/// # Panics
/// Panics if it cannot be read: then the test that wrote it has failed.
pub fn described(text: &str) -> Vec<Described> {
    all_of(text, text.as_bytes(), &NoFiles)
}

#[allow(clippy::panic, reason = "the test has failed")]
fn all_of(name: &str, text: &[u8], files: &dyn Assets) -> Vec<Described> {
    let translation = match simd_model::translate(text, files, &LoadLimits::default()) {
        Ok(Some(translation)) => translation,
        Ok(None) => panic!("{name} is a URDF"),
        Err(refused) => panic!("{name}: {refused}"),
    };
    let files = translation.files(files);
    let described = translation.models.iter().map(|translated| {
        match simd_model::read(translated.urdf.as_bytes(), &files, &ReadOptions::default()) {
            Ok((model, _)) => {
                Described { model: Arc::new(model), pose: translated.pose, fixed: translated.fixed }
            }
            Err(refused) => panic!("{name}: {refused}"),
        }
    });
    described.collect()
}

#[allow(clippy::panic, reason = "the test has failed")]
fn opened(file: &str) -> (Vec<u8>, OnDisk) {
    let path = match file.strip_prefix("pybullet_data/") {
        Some(file) => crate::pybullet_data::folder().join(file),
        None => assets().join(file),
    };
    let text = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    (text, OnDisk(Locator::new(&path)))
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
