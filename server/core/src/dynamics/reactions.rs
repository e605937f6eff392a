//! What joints carry: the force and the torque that each parent link exerts on its
//! child, through fixed joints too. What a force-torque sensor in the joint shows.

use glamx::DVec3;
use simd_model::RobotModel;

pub use super::link_motion::Motion;
use super::link_motion::{LinkMotion, link_motions};
use super::spatial::Spatial;
use super::tree::Tree;

/// One for each joint of the model, in the child link's frame: torque about its origin and
/// force, of the parent on the child. Newton's and Euler's equations of each link, summed
/// over what hangs on the joint (Featherstone section 5.3, with links in place of bodies).
///
/// `gravity` and `external` are in base axes; each of them is a link, and what acts on it from
/// outside with its torque about the link's origin.
pub fn joint_reactions(
    model: &RobotModel,
    tree: &Tree,
    motion: Motion<'_>,
    gravity: DVec3,
    external: &[(usize, Spatial)],
) -> Vec<Spatial> {
    reactions_of(model, &link_motions(tree, motion), gravity, external)
}

/// The same of links that move so.
pub fn reactions_of(
    model: &RobotModel,
    links: &[LinkMotion],
    gravity: DVec3,
    external: &[(usize, Spatial)],
) -> Vec<Spatial> {
    // What is needed to move each link, about the base's origin.
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
