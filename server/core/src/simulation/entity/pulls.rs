//! Pulls on the links of a robot.

use std::sync::Arc;

use glamx::{DMat3, DVec3};

use super::Entity;
use crate::dynamics::Integrator;
use crate::dynamics::spatial::Spatial;
use crate::simulation::pull::{ActivePull, MAX_PULLS};
use crate::simulation::wrench::{ActiveWrench, WrenchDuration};

impl Entity {
    /// Sets the pull on a link, replacing a previous one.
    pub(in crate::simulation) fn set_pull(&mut self, pull: ActivePull) {
        self.body.begin_external_change();
        match self.state.pulls.iter_mut().find(|known| known.link == pull.link) {
            Some(known) => *known = ActivePull { force: known.force, ..pull },
            None => self.state.pulls.push(pull),
        }
    }

    /// Returns whether one more pull has room: on this link, or in addition to the others.
    pub(in crate::simulation) fn has_room_for_pull(&self, link: usize) -> bool {
        let pulls = &self.state.pulls;
        pulls.len() < MAX_PULLS || pulls.iter().any(|known| known.link == link)
    }

    /// Softens pulls to the stiffness that steps of this length can follow, at the present pose and with the
    /// present number of pulls.
    pub(in crate::simulation) fn soften_pulls(&mut self, (h, integrator): (f64, Integrator)) {
        let mut pulls = std::mem::take(&mut self.state.pulls);
        let count = pulls.len();
        for pull in &mut pulls {
            if let Some((_, mobility)) = self.point_mobility(pull.link, pull.point, (h, integrator)) {
                pull.soften(&mobility, h, count);
            }
        }
        self.state.pulls = pulls;
    }

    /// Ends the pull on a link, if there is one.
    pub(in crate::simulation) fn end_pull(&mut self, link: usize) {
        self.body.begin_external_change();
        self.state.pulls.retain(|known| known.link != link);
    }

    /// Returns the position of a point of a link, and its mobility, world; see [`Articulation::mobility`].
    /// Returns `None` if the link belongs to a fixed base.
    ///
    /// [`Articulation::mobility`]: crate::dynamics::Articulation::mobility
    pub(in crate::simulation) fn point_mobility(
        &mut self,
        link: usize,
        point: DVec3,
        (h, integrator): (f64, Integrator),
    ) -> Option<(DVec3, DMat3)> {
        let frame = *self.body.tree().links.get(link)?;
        let body = frame.body?;
        self.body.update_kinematics();
        let at =
            self.body.body_motion(body).pose.transform_point(frame.body_from_link.transform_point(point));
        Some((at, self.body.mobility(body, at, h, integrator)))
    }

    /// Returns the mass of a link and of its load, kg; zero if it cannot move.
    pub(in crate::simulation) fn carried_mass(&self, link: usize) -> f64 {
        let tree = self.body.tree();
        let Some(first) = tree.links.get(link).and_then(|frame| frame.body) else { return 0.0 };
        let mut carried = vec![false; tree.bodies.len()];
        let mut mass = 0.0;
        // Parents come before their children.
        for (index, body) in tree.bodies.iter().enumerate() {
            let is_carried = index == first || body.parent.is_some_and(|parent| carried[parent]);
            if is_carried {
                carried[index] = true;
                mass += body.inertia.mass;
            }
        }
        mass
    }

    /// Adds the forces of pulls to the external ones, for the present motion of the links.
    pub(super) fn add_pull_forces(&mut self) {
        if self.state.pulls.is_empty() {
            return;
        }
        self.body.update_kinematics();
        let tree = Arc::clone(self.body.tree());
        let Self { body, state, .. } = self;
        for pull in &mut state.pulls {
            let Some(frame) = tree.links.get(pull.link) else { continue };
            let Some(index) = frame.body else { continue };
            let motion = body.body_motion(index);
            let in_body = frame.body_from_link.transform_point(pull.point);
            let arm = motion.pose.rotation * in_body;
            let velocity = motion.linear + motion.angular.cross(arm);
            pull.force = pull.force_at(motion.pose.translation + arm, velocity);
            let force = motion.pose.rotation.inverse() * pull.force;
            body.external_mut()[index] += Spatial::new(in_body.cross(force), force);
        }
    }

    /// Removes expired pulls after a step of `time_step` seconds. Their last forces are published with
    /// expired wrenches. Returns whether there were any.
    pub(super) fn end_pulls(&mut self, time_step: f64) -> bool {
        let state = &mut self.state;
        state.pulls.iter_mut().for_each(|pull| pull.remaining -= time_step);
        let over = state.pulls.extract_if(.., |pull| pull.remaining < 0.5 * time_step);
        let before = state.expired_wrenches.len();
        state.expired_wrenches.extend(over.map(|ActivePull { link, point, force, .. }| ActiveWrench {
            link,
            force,
            torque: DVec3::ZERO,
            in_link_axes: false,
            point,
            duration: WrenchDuration::NextStep,
            suspended: false,
        }));
        self.state.expired_wrenches.len() > before
    }
}
