//! How each link of a robot moves and is accelerated: what an inertial unit in it feels, and what its joint has to carry.

use glamx::{DMat3, DVec3};

use super::kinematics::{free_pose, update_kinematics};
use super::scratch::BodyScratch;
use super::spherical::own_motion;
use super::tree::{JointType, LinkFrame, Tree};

/// How a robot moves at a moment.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// q.
    pub positions: &'a [f64],
    /// qd.
    pub velocities: &'a [f64],
    /// The change of qd in a second.
    pub accelerations: &'a [f64],
}

/// Where a link is and how it moves and is accelerated; in the base's axes, and against the base.
#[derive(Clone, Copy, Debug)]
pub struct LinkMotion {
    /// `base_from_link`.
    pub rotation: DMat3,
    /// Of its frame.
    pub origin: DVec3,
    /// rad/s.
    pub angular: DVec3,
    /// Of the origin, m/s.
    pub velocity: DVec3,
    /// rad/s^2.
    pub angular_acceleration: DVec3,
    /// Of the origin, m/s^2.
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

    /// The velocity of a point of it, `reach` from its origin in the base's axes: v + w x r.
    pub fn velocity_at(&self, reach: DVec3) -> DVec3 {
        self.velocity + self.angular.cross(reach)
    }

    /// The acceleration of a point of it: a + alpha x r + w x (w x r).
    pub fn acceleration_at(&self, reach: DVec3) -> DVec3 {
        self.acceleration
            + self.angular_acceleration.cross(reach)
            + self.angular.cross(self.angular.cross(reach))
    }
}

/// How each link of the model moves.
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
            // The three axes are the child's, and turn with it.
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
