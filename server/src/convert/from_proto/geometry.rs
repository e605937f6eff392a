//! Vectors, poses, twists and wrenches from the wire.

use glamx::{DPose3, DQuat, DVec3};
use simd_proto::v1;

use crate::convert::field::{BadField, Path};

/// Three finite numbers.
pub fn vector(at: &Path<'_>, vector: v1::Vector3) -> Result<DVec3, BadField> {
    Ok(DVec3::new(
        at.field("x").finite(vector.x)?,
        at.field("y").finite(vector.y)?,
        at.field("z").finite(vector.z)?,
    ))
}

/// Three finite numbers, or zero.
pub fn vector_or_zero(at: &Path<'_>, given: Option<v1::Vector3>) -> Result<DVec3, BadField> {
    given.map_or(Ok(DVec3::ZERO), |given| vector(at, given))
}

/// A rotation of unit length from a quaternion of any length; all zero is none.
pub fn rotation(at: &Path<'_>, quaternion: v1::Quaternion) -> Result<DQuat, BadField> {
    let v1::Quaternion { x, y, z, w } = quaternion;
    for (name, value) in [("x", x), ("y", y), ("z", z), ("w", w)] {
        at.field(name).finite(value)?;
    }
    let largest = [x, y, z, w].into_iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    if largest == 0.0 {
        return Ok(DQuat::IDENTITY);
    }
    // Scaled first, since the square of a very large or small length is not a number of use.
    let scaled = [x / largest, y / largest, z / largest, w / largest];
    Ok(DQuat::from_array(scaled).normalize())
}

/// A transform; what is absent is none.
pub fn pose(at: &Path<'_>, pose: v1::Pose) -> Result<DPose3, BadField> {
    let translation = vector_or_zero(&at.field("position"), pose.position)?;
    let rotation = match pose.orientation {
        Some(orientation) => rotation(&at.field("orientation"), orientation)?,
        None => DQuat::IDENTITY,
    };
    Ok(DPose3 { rotation, translation })
}

/// Linear, then angular.
pub fn twist(at: &Path<'_>, twist: v1::Twist) -> Result<(DVec3, DVec3), BadField> {
    Ok((
        vector_or_zero(&at.field("linear"), twist.linear)?,
        vector_or_zero(&at.field("angular"), twist.angular)?,
    ))
}

/// Force, then torque.
pub fn wrench(at: &Path<'_>, wrench: v1::Wrench) -> Result<(DVec3, DVec3), BadField> {
    Ok((
        vector_or_zero(&at.field("force"), wrench.force)?,
        vector_or_zero(&at.field("torque"), wrench.torque)?,
    ))
}
