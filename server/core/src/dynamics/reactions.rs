//! What joints carry: the force and the torque that each parent link exerts on its
//! child, through fixed joints too. What a force-torque sensor in the joint shows.

use glamx::{DMat3, DVec3};
use simd_model::RobotModel;

use super::kinematics::{free_pose, update_kinematics};
use super::scratch::BodyScratch;
use super::spatial::Spatial;
use super::spherical::own_motion;
use super::tree::{JointType, Tree};

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

/// Where a link is and how it is accelerated; base axes.
#[derive(Clone, Copy)]
struct Moving {
    rotation: DMat3,
    origin: DVec3,
    /// rad/s.
    angular: DVec3,
    /// rad/s^2.
    angular_acceleration: DVec3,
    /// Of the origin, m/s^2.
    acceleration: DVec3,
}

impl Moving {
    const STILL: Self = Self {
        rotation: DMat3::IDENTITY,
        origin: DVec3::ZERO,
        angular: DVec3::ZERO,
        angular_acceleration: DVec3::ZERO,
        acceleration: DVec3::ZERO,
    };

    /// The acceleration of a point of it: a + alpha x r + w x (w x r).
    fn acceleration_at(&self, reach: DVec3) -> DVec3 {
        self.acceleration
            + self.angular_acceleration.cross(reach)
            + self.angular.cross(self.angular.cross(reach))
    }
}

/// One for each joint of the model, in the child link's frame: torque about its origin and
/// force, of the parent on the child. Newton's and Euler's equations of each link, summed
/// over what hangs on the joint (Featherstone section 5.3, with links in place of bodies).
///
/// `gravity` and `pushes` are in base axes; a push is a link, and what acts on it from
/// outside with its torque about the link's origin.
pub fn joint_reactions(
    model: &RobotModel,
    tree: &Tree,
    motion: Motion<'_>,
    gravity: DVec3,
    pushes: &[(usize, Spatial)],
) -> Vec<Spatial> {
    let links = links(tree, motion);
    // What is needed to move each link, about the base's origin.
    let mut needed: Vec<Spatial> = model
        .links
        .iter()
        .zip(&links)
        .map(|(link, at)| {
            let inertial = &link.inertial;
            let reach = at.rotation * inertial.center_of_mass;
            let force = (at.acceleration_at(reach) - gravity) * inertial.mass;
            let inertia = at.rotation * inertial.inertia * at.rotation.transpose();
            let torque = inertia * at.angular_acceleration + at.angular.cross(inertia * at.angular);
            Spatial::new(torque, force).force_from(at.origin + reach)
        })
        .collect();
    for &(link, push) in pushes {
        if let (Some(needed), Some(at)) = (needed.get_mut(link), links.get(link)) {
            *needed -= push.force_from(at.origin);
        }
    }
    let mut reactions = vec![Spatial::ZERO; model.joints.len()];
    for (joint, reaction) in model.joints.iter().zip(&mut reactions).rev() {
        let carried = needed[joint.child];
        needed[joint.parent] += carried;
        let at = &links[joint.child];
        let about_joint = carried.force_from(-at.origin);
        let turned = at.rotation.transpose();
        *reaction = Spatial::new(turned * about_joint.angular, turned * about_joint.linear);
    }
    reactions
}

/// How each link moves.
fn links(tree: &Tree, motion: Motion<'_>) -> Vec<Moving> {
    let mut scratch = vec![BodyScratch::default(); tree.bodies.len()];
    update_kinematics(tree, motion.positions, motion.velocities, &mut scratch);
    let mut bodies: Vec<Moving> = Vec::with_capacity(tree.bodies.len());
    for (body, at) in tree.bodies.iter().zip(&scratch) {
        let parent = body.parent.map_or(Moving::STILL, |parent| bodies[parent]);
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
        bodies.push(Moving {
            rotation: at.rotation,
            origin: parent.origin + at.reach,
            angular: at.velocity.angular,
            angular_acceleration: parent.angular_acceleration + turn,
            acceleration: parent.acceleration_at(at.reach) + slide,
        });
    }
    let of_link = |frame: &super::tree::LinkFrame| {
        let body = frame.body.map_or(Moving::STILL, |body| bodies[body]);
        let reach = body.rotation * frame.body_from_link.translation;
        Moving {
            rotation: body.rotation * DMat3::from_quat(frame.body_from_link.rotation),
            origin: body.origin + reach,
            acceleration: body.acceleration_at(reach),
            ..body
        }
    };
    tree.links.iter().map(of_link).collect()
}
