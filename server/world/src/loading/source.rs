//! Where descriptions come from, and what is found out about them before a spawn.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use simd_model::robot::Sha256;
use simd_model::{LoadReport, RobotModel};

/// Where a description comes from.
#[derive(Clone, Debug)]
pub enum Source {
    /// An upload.
    Uploaded {
        /// Of the URDF.
        description: Sha256,
        /// Of its files, by URI.
        assets: BTreeMap<String, Sha256>,
        /// Where the client looked for URIs that it did not find.
        missing: BTreeMap<String, Vec<String>>,
    },
    /// The text itself.
    Inline {
        /// The URDF.
        urdf: Bytes,
        /// Of its files, by URI.
        assets: BTreeMap<String, Sha256>,
        /// Where the client looked for URIs that it did not find.
        missing: BTreeMap<String, Vec<String>>,
    },
    /// The daemon's own disk, below an asset root: a `.urdf`, or a package's folder.
    Path(String),
}

/// What the daemon knows of a file that a description names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssetState {
    /// No hash was given for it.
    Unresolved,
    /// No file of that hash is here.
    Lacking,
    /// It is here.
    Present,
}

/// A description that is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    /// Of the URDF: what it is called from now on.
    pub description: Sha256,
    /// The robot's name, fit for the wire.
    pub name: String,
    /// Each URI that it names, in the order of first use.
    pub assets: Vec<(String, AssetState)>,
    /// Names of the robots of an SDF or MJCF.
    pub models: Vec<String>,
}

/// A description that was read and not used.
#[derive(Clone, Debug)]
pub struct Validated {
    /// What was found.
    pub report: LoadReport,
    /// The report in one line.
    pub summary: String,
    /// `None` where a spawn would be refused.
    pub model: Option<Arc<RobotModel>>,
    /// Of the URDF.
    pub description: Sha256,
}
