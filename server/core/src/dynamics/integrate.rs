//! Last pass: positions from the new velocities.

use glamx::{DQuat, DVec3};

use super::kinematics::free_pose;
use super::spherical::turn_by;
use super::tree::{JointType, Tree};

/// Integrates positions: q += h qd. A free body's origin follows its linear velocity. Its rotation, and a
/// ball joint's, follow the exponential map of the angular velocity in the body's own axes.
pub fn advance(tree: &Tree, q: &mut [f64], qd: &[f64], h: f64) {
    for body in &tree.bodies {
        advance_joint(body.joint_type, &mut q[body.position..], &qd[body.velocity..], h);
    }
}

/// Integrates one body, whose positions and velocities come first.
pub fn advance_joint(joint_type: JointType, q: &mut [f64], qd: &[f64], h: f64) {
    match joint_type {
        JointType::Revolute | JointType::Prismatic => q[0] += h * qd[0],
        JointType::Spherical { axis: 0 } => turn_by(q, DVec3::new(qd[0], qd[1], qd[2]) * h),
        JointType::Spherical { .. } => {}
        JointType::Free { .. } => {
            let (origin, rotation) = free_pose(q);
            let origin = origin + DVec3::new(qd[0], qd[1], qd[2]) * h;
            let turn = DQuat::from_scaled_axis(DVec3::new(qd[3], qd[4], qd[5]) * h);
            write_free_pose(q, origin, (rotation * turn).normalize());
        }
    }
}

/// Writes the seven positions of a free body.
pub fn write_free_pose(q: &mut [f64], origin: DVec3, rotation: DQuat) {
    q[..3].copy_from_slice(&origin.to_array());
    q[3..7].copy_from_slice(&rotation.to_array());
}
