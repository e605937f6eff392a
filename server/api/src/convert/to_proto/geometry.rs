//! Vectors, poses and velocities to the wire.

use glamx::{DPose3, DQuat, DVec3};
use simd_proto::v1;

/// Converts a vector.
pub fn vector(vector: DVec3) -> v1::Vector3 {
    v1::Vector3 { x: vector.x, y: vector.y, z: vector.z }
}

/// Converts a rotation.
pub fn rotation(rotation: DQuat) -> v1::Quaternion {
    let [x, y, z, w] = rotation.to_array();
    v1::Quaternion { x, y, z, w }
}

/// Converts a transform.
pub fn pose(pose: DPose3) -> v1::Pose {
    v1::Pose { position: Some(vector(pose.translation)), orientation: Some(rotation(pose.rotation)) }
}

/// Converts velocities in world axes.
pub fn twist(linear: DVec3, angular: DVec3) -> v1::Twist {
    v1::Twist { linear: Some(vector(linear)), angular: Some(vector(angular)) }
}

/// Returns a transform as seven numbers: x y z, then the quaternion x y z w.
pub fn pose_values(pose: &DPose3) -> [f64; 7] {
    let [x, y, z] = pose.translation.to_array();
    let [qx, qy, qz, qw] = pose.rotation.to_array();
    [x, y, z, qx, qy, qz, qw]
}
