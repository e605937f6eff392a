//! What is said about bringing robots in: requests and answers, without wire types.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use glamx::DPose3;
use simd_core::collision::MeshShapes;
use simd_core::simulation::command::ContactSettings;
use simd_model::robot::Sha256;
use simd_model::{LoadReport, RobotModel};

use super::Done;

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

/// A robot to bring in.
#[derive(Clone, Debug)]
pub struct SpawnRequest {
    /// Where its description comes from.
    pub source: Source,
    /// Empty: the model's own.
    pub name: String,
    /// Where the name is taken, add `_1`, `_2`, ... instead of refusing.
    pub allow_renaming: bool,
    /// `world_from_root`.
    pub pose: DPose3,
    /// `None` fixes a root link called `world`.
    pub fixed_base: Option<bool>,
    /// Joints are not actuated, instead of holding their position.
    pub passive: bool,
    /// Positions to start from, rad or m, by joint name.
    pub joint_positions: Vec<(String, f64)>,
    /// Lengths are multiplied by it; above 0, at most 1,000.
    pub scale: f64,
    /// Refuse a robot whose report has a warning.
    pub strict: bool,
    /// What its collision meshes become.
    pub mesh_shapes: MeshShapes,
    /// How it touches others and itself.
    pub contact_settings: ContactSettings,
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

/// A robot that is in the world now.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// From when.
    pub done: Done,
    /// Under this name.
    pub name: String,
    /// What was found.
    pub report: LoadReport,
    /// The report in one line.
    pub summary: String,
}

/// A robot that has a new model now.
#[derive(Clone, Debug)]
pub struct Reloaded {
    /// From when.
    pub done: Done,
    /// What was found.
    pub report: LoadReport,
    /// The report in one line.
    pub summary: String,
    /// Joints that it did not have.
    pub added: Vec<String>,
    /// Joints that it has no longer.
    pub removed: Vec<String>,
}
