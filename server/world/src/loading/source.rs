//! Sources of descriptions, and facts about them before a spawn.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use simd_model::robot::Sha256;
use simd_model::{LoadReport, RobotModel};

/// Source of a description.
#[derive(Clone, Debug)]
pub enum Source {
    /// Uploaded files.
    Uploaded {
        /// Hash of the URDF.
        description: Sha256,
        /// Hashes of its files, by URI.
        assets: BTreeMap<String, Sha256>,
        /// Paths where the client looked for URIs that it did not find.
        missing: BTreeMap<String, Vec<String>>,
    },
    /// The text of the request.
    Inline {
        /// The URDF.
        urdf: Bytes,
        /// Hashes of its files, by URI.
        assets: BTreeMap<String, Sha256>,
        /// Paths where the client looked for URIs that it did not find.
        missing: BTreeMap<String, Vec<String>>,
    },
    /// Path on the daemon's own disk, below an asset root: a `.urdf`, or a package's folder.
    Path(String),
}

/// Part of a file that a client uploads.
#[derive(Clone, Debug)]
pub struct FilePart {
    /// Hash of the whole file.
    pub sha256: Sha256,
    /// Size of the whole file, bytes.
    pub total: u64,
    /// Place of the part in the file, bytes.
    pub offset: u64,
    /// Bytes of the part.
    pub data: Bytes,
}

/// State of a file that a description names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssetState {
    /// No hash was given for it.
    Unresolved,
    /// No file with that hash is stored.
    Lacking,
    /// The file is stored.
    Present,
}

/// A stored description.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    /// Hash of the URDF, by which it is named from now on.
    pub description: Sha256,
    /// Name of the robot, fit for the wire.
    pub name: String,
    /// URIs that it names, in the order of first use.
    pub assets: Vec<(String, AssetState)>,
    /// Names of the robots in an SDF or MJCF.
    pub models: Vec<String>,
}

/// A description that was read, but not spawned.
#[derive(Clone, Debug)]
pub struct Validated {
    /// Findings.
    pub report: LoadReport,
    /// Summary of the report in one line.
    pub summary: String,
    /// Robots, in the order of the description; empty if a spawn would be refused.
    pub robots: Vec<ValidatedRobot>,
}

/// A robot of a description that was read, but not spawned.
#[derive(Clone, Debug)]
pub struct ValidatedRobot {
    /// Model.
    pub model: Arc<RobotModel>,
    /// Whether its root link is fixed unless a spawn says otherwise.
    pub fixed: bool,
    /// Hash of the URDF.
    pub description: Sha256,
}
