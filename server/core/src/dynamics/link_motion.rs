//! Velocity and acceleration of each link of a robot, for inertial sensors and joint reactions.

use glamx::{DMat3, DVec3};

use super::kinematics::{free_pose, update_kinematics};
use super::scratch::BodyScratch;
use super::spherical::own_motion;
use super::tree::{JointType, LinkFrame, Tree};

/// Motion of a robot at a moment.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// Positions q.
    pub positions: &'a [f64],
    /// Velocities qd.
    pub velocities: &'a [f64],
    /// Change of qd per second.
    pub accelerations: &'a [f64],
}

/// Pose, velocity and acceleration of a link, in the base's axes, relative to the base.
#[derive(Clone, Copy, Debug)]
pub struct LinkMotion {
    /// `base_from_link`.
    pub rotation: DMat3,
    /// Origin of its frame, metres.
    pub origin: DVec3,
    /// Angular velocity, rad/s.
    pub angular: DVec3,
    /// Velocity of the origin, m/s.
    pub velocity: DVec3,
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration: DVec3,
    /// Acceleration of the origin, m/s^2.
    pub acceleration: DVec3,
}

impl LinkMotion {
    const STILL: Self = Self {
        rotation: DMat3::IDENTITY,
        origin: DVec3::ZERO,
        angular: DVec3::ZERO,
        velocity: DVec3::ZERO,
        angular_acceleration: DVec3::ZERO,
        acceleration: DVec3::ZERO,
    };

    /// Returns the velocity of a point of the link, `reach` from its origin in the base's axes: v + w x r.
    pub fn velocity_at(&self, reach: DVec3) -> DVec3 {
        self.velocity + self.angular.cross(reach)
    }

    /// Returns the acceleration of a point of the link: a + alpha x r + w x (w x r).
    pub fn acceleration_at(&self, reach: DVec3) -> DVec3 {
        self.acceleration
            + self.angular_acceleration.cross(reach)
            + self.angular.cross(self.angular.cross(reach))
    }
}

/// Returns the motion of each link of the model.
pub fn link_motions(tree: &Tree, motion: Motion<'_>) -> Vec<LinkMotion> {
    let mut scratch = vec![BodyScratch::default(); tree.bodies.len()];
    update_kinematics(tree, motion.positions, motion.velocities, &mut scratch);
    let mut bodies: Vec<LinkMotion> = Vec::with_capacity(tree.bodies.len());
    for (body, at) in tree.bodies.iter().zip(&scratch) {
        let parent = body.parent.map_or(LinkMotion::STILL, |parent| bodies[parent]);
        let (qd, qdd) = (&motion.velocities[body.velocity..], &motion.accelerations[body.velocity..]);
        let axis = at.rotation.z_axis;
        let (turn, slide) = match body.joint_type {
            JointType::Revolute => (axis * qdd[0] + parent.angular.cross(axis * qd[0]), DVec3::ZERO),
            // The three axes belong to the child, and turn with it.
            JointType::Spherical { axis: 2 } => {
                let own = own_motion(&at.rotation, &motion.velocities[body.velocity - 2..]).angular;
                (axis * qdd[0] + at.velocity.angular.cross(own), DVec3::ZERO)
            }
            JointType::Spherical { .. } => (axis * qdd[0], DVec3::ZERO),
            // Coriolis: the axis turns with the parent.
            JointType::Prismatic => (DVec3::ZERO, axis * qdd[0] + 2.0 * parent.angular.cross(axis * qd[0])),
            JointType::Free { .. } => {
                // Linear in the parent's axes, angular in the body's own.
                let (_, rotation) = free_pose(&motion.positions[body.position..]);
                let axes = at.rotation * DMat3::from_quat(rotation).transpose();
                let linear = axes * DVec3::new(qd[0], qd[1], qd[2]);
                let own = at.velocity.angular - parent.angular;
                let turn = at.rotation * DVec3::new(qdd[3], qdd[4], qdd[5]) + parent.angular.cross(own);
                let slide = axes * DVec3::new(qdd[0], qdd[1], qdd[2]) + 2.0 * parent.angular.cross(linear);
                (turn, slide)
            }
        };
        bodies.push(LinkMotion {
            rotation: at.rotation,
            origin: parent.origin + at.reach,
            angular: at.velocity.angular,
            velocity: at.velocity.linear,
            angular_acceleration: parent.angular_acceleration + turn,
            acceleration: parent.acceleration_at(at.reach) + slide,
        });
    }
    let of_link = |frame: &LinkFrame| {
        let body = frame.body.map_or(LinkMotion::STILL, |body| bodies[body]);
        let reach = body.rotation * frame.body_from_link.translation;
        LinkMotion {
            rotation: body.rotation * DMat3::from_quat(frame.body_from_link.rotation),
            origin: body.origin + reach,
            velocity: body.velocity_at(reach),
            acceleration: body.acceleration_at(reach),
            ..body
        }
    };
    tree.links.iter().map(of_link).collect()
}
