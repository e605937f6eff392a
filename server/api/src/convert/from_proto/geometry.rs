//! Vectors, poses, twists and wrenches from the wire.

use glamx::{DPose3, DQuat, DVec3};
use simd_proto::v1;

use crate::convert::field::{BadField, Path};

/// Converts three numbers without checks: the core checks the numbers of commands.
pub fn vector(v1::Vector3 { x, y, z }: v1::Vector3) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Converts three numbers; absent means zero.
pub fn vector_or_zero(given: Option<v1::Vector3>) -> DVec3 {
    given.map_or(DVec3::ZERO, vector)
}

/// Converts three finite numbers.
pub fn finite_vector(at: &Path<'_>, given: v1::Vector3) -> Result<DVec3, BadField> {
    for (name, value) in [("x", given.x), ("y", given.y), ("z", given.z)] {
        at.field(name).finite(value)?;
    }
    Ok(vector(given))
}

/// Returns a rotation of unit length from a quaternion of any length; all zeros mean no rotation.
pub fn rotation(at: &Path<'_>, quaternion: v1::Quaternion) -> Result<DQuat, BadField> {
    let v1::Quaternion { x, y, z, w } = quaternion;
    for (name, value) in [("x", x), ("y", y), ("z", z), ("w", w)] {
        at.field(name).finite(value)?;
    }
    let largest = [x, y, z, w].into_iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    if largest == 0.0 {
        return Ok(DQuat::IDENTITY);
    }
    // Scaled first: the square of a very large or small length overflows or underflows.
    let scaled = [x / largest, y / largest, z / largest, w / largest];
    Ok(DQuat::from_array(scaled).normalize())
}

/// Converts a transform; an absent part means none.
pub fn pose(at: &Path<'_>, pose: v1::Pose) -> Result<DPose3, BadField> {
    let translation = vector_or_zero(pose.position);
    let rotation = match pose.orientation {
        Some(orientation) => rotation(&at.field("orientation"), orientation)?,
        None => DQuat::IDENTITY,
    };
    Ok(DPose3 { rotation, translation })
}

/// Converts linear and angular velocity, in this order.
pub fn twist(twist: v1::Twist) -> (DVec3, DVec3) {
    (vector_or_zero(twist.linear), vector_or_zero(twist.angular))
}

/// Converts force and torque, in this order.
pub fn wrench(wrench: v1::Wrench) -> (DVec3, DVec3) {
    (vector_or_zero(wrench.force), vector_or_zero(wrench.torque))
}
