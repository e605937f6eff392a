//! Joint reactions: the force and the torque that each parent link exerts on its child, also through fixed
//! joints. A force-torque sensor in the joint measures them.

use glamx::DVec3;
use simd_model::RobotModel;

pub use super::link_motion::Motion;
use super::link_motion::{LinkMotion, link_motions};
use super::spatial::Spatial;
use super::tree::Tree;

/// Returns the reaction of each joint of the model in the child link's frame. It is the torque about its
/// origin and the force that the parent exerts. Newton's and Euler's equations of each link are summed over
/// the subtree of the joint (Featherstone section 5.3, with links in place of bodies).
///
/// `gravity` and `external` are in base axes. Each entry of `external` is a link and its external force, with
/// the torque about the link's origin.
pub fn joint_reactions(
    model: &RobotModel,
    tree: &Tree,
    motion: Motion<'_>,
    gravity: DVec3,
    external: &[(usize, Spatial)],
) -> Vec<Spatial> {
    reactions_of(model, &link_motions(tree, motion), gravity, external)
}

/// Returns the joint reactions for links with this motion.
pub fn reactions_of(
    model: &RobotModel,
    links: &[LinkMotion],
    gravity: DVec3,
    external: &[(usize, Spatial)],
) -> Vec<Spatial> {
    // Force that moves each link, about the base's origin.
    let mut needed: Vec<Spatial> = model
        .links
        .iter()
        .zip(links)
        .map(|(link, at)| {
            let inertial = &link.inertial;
            let reach = at.rotation * inertial.center_of_mass;
            let force = (at.acceleration_at(reach) - gravity) * inertial.mass;
            let inertia = at.rotation * inertial.inertia * at.rotation.transpose();
            let torque = inertia * at.angular_acceleration + at.angular.cross(inertia * at.angular);
            Spatial::new(torque, force).force_from(at.origin + reach)
        })
        .collect();
    for &(link, wrench) in external {
        if let (Some(needed), Some(at)) = (needed.get_mut(link), links.get(link)) {
            *needed -= wrench.force_from(at.origin);
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
