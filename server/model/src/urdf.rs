//! From URDF text to a robot. (Signatures are fixed; bodies to be written.)

use std::sync::Arc;

use crate::report::LoadReport;
use crate::robot::{RobotModel, Sha256};

/// A file that a description names.
#[derive(Clone, Debug)]
pub struct Asset {
    /// SHA-256 of `bytes`.
    pub sha256: Sha256,
    /// The whole file.
    pub bytes: Arc<[u8]>,
}

/// Where [`read`] gets the files that a description names.
pub trait Assets {
    /// The file for a URI as the description writes it, or the places where it
    /// was looked for.
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>>;
}

/// How to read.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions {
    /// Lengths are multiplied by it, inertias by its square; masses stay.
    pub scale: f64,
    /// Refuse a robot whose report has a warning.
    pub strict: bool,
}

/// Why a description is refused, as a sentence, and all that was found before.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Refused {
    /// Names the element and the line.
    pub message: String,
    /// Ends with the finding that refuses.
    pub report: LoadReport,
}

/// What can be said of a description without its assets.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// `name` of the `<robot>`.
    pub name: String,
    /// Mesh URIs as written, in the order of first use, each once.
    pub asset_uris: Vec<String>,
}
