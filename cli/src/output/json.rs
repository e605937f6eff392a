//! Common parts of JSON results: moments, vectors, names of enums.

use serde::Serialize;
use simd_client::proto::{Pose, Quaternion, Vector3};

/// `Stamp` of the schema.
#[derive(Debug, Serialize)]
pub(crate) struct Stamp {
    pub(crate) epoch: u64,
    pub(crate) step: u64,
    /// Seconds.
    pub(crate) sim_time: f64,
    /// RFC 3339, or null.
    pub(crate) wall_time: Option<String>,
    pub(crate) sequence: u64,
}

impl From<simd_client::proto::Stamp> for Stamp {
    fn from(stamp: simd_client::proto::Stamp) -> Self {
        Self {
            epoch: stamp.epoch,
            step: stamp.step,
            sim_time: stamp.sim_time,
            wall_time: stamp.wall_time.map(|time| time.to_string()),
            sequence: stamp.sequence,
        }
    }
}

impl std::fmt::Display for Stamp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "step {} ({:.3} s)", self.step, self.sim_time)
    }
}

/// Returns an enum's name in JSON and tables: `JOINT_MODE_HOLD` becomes `hold`.
pub(crate) fn name(prefix: &str, name_on_wire: &str) -> String {
    name_on_wire.strip_prefix(prefix).unwrap_or(name_on_wire).to_ascii_lowercase()
}

/// Returns x, y, z.
pub(crate) fn vector(vector: &Vector3) -> [f64; 3] {
    [vector.x, vector.y, vector.z]
}

/// Metres, and the quaternion x, y, z, w.
#[derive(Debug, Serialize)]
pub(crate) struct PoseView {
    pub(crate) position: [f64; 3],
    pub(crate) orientation: [f64; 4],
}

impl From<&Pose> for PoseView {
    fn from(pose: &Pose) -> Self {
        let identity = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
        let q = pose.orientation.unwrap_or(identity);
        Self {
            position: pose.position.as_ref().map(vector).unwrap_or_default(),
            orientation: [q.x, q.y, q.z, q.w],
        }
    }
}
