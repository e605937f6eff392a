//! Gravity compensation: the effort with which an actuator holds the weight that its joint carries.

use glamx::DVec3;

use super::actuator::{Axis, Drive, Mode};
use super::scratch::BodyScratch;
use super::tree::{JointType, Tree};

/// Mass of a body and its subtree without free bodies, in the base's axes, about the body's origin.
#[derive(Clone, Copy, Debug, Default)]
pub struct SubtreeMass {
    mass: f64,
    first_moment: DVec3,
    /// Effort of the body's joint, N m or N.
    effort: f64,
}

/// Returns whether the actuator of an axis holds the weight that it carries.
pub fn is_compensated(axis: &Axis) -> bool {
    axis.settings.gravity_compensation
        && matches!(axis.actuator.mode, Mode::Position | Mode::Velocity | Mode::Hold)
}

/// Adds the gravity term g(q) of the equations of motion to the feed-forward effort of actuators that
/// compensate it. It is the mass of a subtree times minus gravity, as a moment about its joint's axis, at the
/// pose of the kinematics. `base_acceleration` is minus gravity in the base's axes.
///
/// Only the robot's own masses count, not what it holds. A joint carries its followers by their multiplier.
pub fn compensate(
    tree: &Tree,
    axes: &[Axis],
    bodies: &[BodyScratch],
    base_acceleration: DVec3,
    subtrees: &mut Vec<SubtreeMass>,
    drives: &mut [Drive],
) {
    subtrees.clear();
    subtrees.extend(tree.bodies.iter().zip(bodies).map(|(body, at)| SubtreeMass {
        mass: body.inertia.mass,
        first_moment: at.rotation * body.inertia.first_moment,
        effort: 0.0,
    }));
    for (index, body) in tree.bodies.iter().enumerate().rev() {
        let (at, SubtreeMass { mass, first_moment, .. }) = (&bodies[index], subtrees[index]);
        let z = at.rotation.z_axis;
        subtrees[index].effort = match body.joint_type {
            JointType::Revolute | JointType::Spherical { .. } => z.dot(first_moment.cross(base_acceleration)),
            JointType::Prismatic => z.dot(base_acceleration) * mass,
            JointType::Free { .. } => continue,
        };
        if let Some(parent) = body.parent {
            subtrees[parent].mass += mass;
            subtrees[parent].first_moment += first_moment + at.reach * mass;
        }
    }
    for pair in &tree.mimics {
        let follower = subtrees[pair.follower].effort;
        subtrees[pair.leader].effort += pair.multiplier * follower;
    }
    for (body, subtree) in tree.bodies.iter().zip(subtrees) {
        if !matches!(body.joint_type, JointType::Free { .. }) && is_compensated(&axes[body.velocity]) {
            drives[body.velocity].feed_forward += subtree.effort;
        }
    }
}
