//! Damping of the links of a robot.

use std::sync::Arc;

use glamx::DMat3;

use super::Entity;
use crate::dynamics::Integrator;
use crate::dynamics::link_damping::LinkDamping;
use crate::dynamics::spatial::Spatial;
use crate::simulation::contact_settings::LinkProperties;

impl Entity {
    /// Sets the damping of all links, or of one of them.
    pub(in crate::simulation) fn set_damping(&mut self, link: Option<usize>, properties: &LinkProperties) {
        let LinkProperties { linear_damping, angular_damping, .. } = *properties;
        if linear_damping.is_none() && angular_damping.is_none() {
            return;
        }
        let damping = &mut self.state.link_damping;
        damping.resize(self.model.links.len(), LinkDamping::default());
        let all = 0..damping.len();
        for of_link in &mut damping[link.map_or(all, |link| link..link + 1)] {
            of_link.linear = linear_damping.unwrap_or(of_link.linear);
            of_link.angular = angular_damping.unwrap_or(of_link.angular);
        }
        if damping.iter().all(|of_link| *of_link == LinkDamping::default()) {
            damping.clear();
        }
    }

    /// Adds the forces of damping to the external ones, for the present motion of the links and a part of a
    /// step of `h` seconds.
    pub(super) fn add_damping_forces(&mut self, integrator: Integrator, h: f64) {
        let h = if integrator.bullet().is_some() { 0.0 } else { h };
        if self.state.link_damping.is_empty() {
            return;
        }
        self.body.update_kinematics();
        let tree = Arc::clone(self.body.tree());
        let Self { body, state, model, .. } = self;
        for ((frame, link), damping) in tree.links.iter().zip(&model.links).zip(&state.link_damping) {
            let Some(index) = frame.body else { continue };
            let motion = body.own_motion(index);
            let at = frame.body_from_link;
            let velocity = motion.linear + motion.angular.cross(at.translation);
            let motion = Spatial::new(motion.angular, velocity);
            let force = damping.force(&link.inertial, &DMat3::from_quat(at.rotation), motion, h);
            body.external_mut()[index] += force.force_from(at.translation);
        }
    }
}
