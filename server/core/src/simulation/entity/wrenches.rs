//! Wrenches that commands apply to the links of a robot.

use glamx::{DQuat, DVec3};

use super::Entity;
use crate::dynamics::Articulation;
use crate::dynamics::spatial::{Placement, Spatial};
use crate::simulation::world_state::EntityState;
use crate::simulation::wrench::{ActiveWrench, WrenchDuration};

impl Entity {
    /// Returns whether wrenches, pulls or damping may act on it.
    pub(super) fn has_external_forces(&self) -> bool {
        let EntityState { applied_wrenches, pulls, link_damping, .. } = &self.state;
        !(applied_wrenches.is_empty() && pulls.is_empty() && link_damping.is_empty())
    }

    /// Writes wrenches and pulls to the dynamics, each body's sum in its own frame. Each part of a step adds
    /// damping.
    pub(in crate::simulation) fn update_external_forces(&mut self) {
        self.body.external_mut().fill(Spatial::ZERO);
        self.add_pull_forces();
        let Self { body, state, .. } = self;
        for wrench in state.applied_wrenches.iter().filter(|wrench| !wrench.suspended) {
            if let Some((index, wrench)) = on_body(body, wrench) {
                body.external_mut()[index] += wrench;
            }
        }
    }

    /// Removes all wrenches and pulls, and their forces.
    pub(in crate::simulation) fn clear_external_forces(&mut self) {
        self.body.begin_external_change();
        self.state.applied_wrenches.clear();
        self.state.expired_wrenches.clear();
        self.state.pulls.clear();
        self.update_external_forces();
    }

    /// Adds a wrench. One with a duration or until cleared replaces those before on that link. One for the
    /// next step is added to the others for it, so that there are never more than a few for each link.
    pub(in crate::simulation) fn add_wrench(&mut self, wrench: ActiveWrench) {
        self.body.begin_external_change();
        let ActiveWrench { link, force, torque, in_link_axes, point, duration, .. } = wrench;
        let is_something = force != DVec3::ZERO || torque != DVec3::ZERO;
        match duration {
            WrenchDuration::NextStep => {}
            WrenchDuration::For(_) => {
                self.state.applied_wrenches.retain(|known| known.link != link || !known.is_timed());
                self.set_suspended(link, is_something);
                self.state.applied_wrenches.extend(is_something.then_some(wrench));
                return;
            }
            WrenchDuration::UntilCleared => {
                self.state
                    .applied_wrenches
                    .retain(|known| known.link != link || known.duration == WrenchDuration::NextStep);
                self.state.applied_wrenches.extend(is_something.then_some(wrench));
                return;
            }
        }
        // About the link's origin, so that wrenches for the next step can be summed.
        let arm = if in_link_axes { point } else { link_rotation(&self.body, link) * point };
        let torque = torque + arm.cross(force);
        let same = |known: &&mut ActiveWrench| {
            known.duration == WrenchDuration::NextStep
                && known.link == link
                && known.in_link_axes == in_link_axes
        };
        match self.state.applied_wrenches.iter_mut().find(same) {
            Some(known) => {
                known.force += force;
                known.torque += torque;
            }
            None => self.state.applied_wrenches.push(ActiveWrench { torque, point: DVec3::ZERO, ..wrench }),
        }
    }

    /// Suspends the wrench on a link that acts until it is cleared, or resumes it.
    fn set_suspended(&mut self, link: usize, suspended: bool) {
        let lasting =
            |known: &&mut ActiveWrench| known.link == link && known.duration == WrenchDuration::UntilCleared;
        self.state.applied_wrenches.iter_mut().filter(lasting).for_each(|known| known.suspended = suspended);
    }

    /// Resumes wrenches before a step that an expired one had suspended.
    pub(in crate::simulation) fn begin_wrenches(&mut self) {
        while let Some(over) = self.state.expired_wrenches.pop() {
            let is_timed = |known: &ActiveWrench| known.link == over.link && known.is_timed();
            if over.is_timed() && !self.state.applied_wrenches.iter().any(is_timed) {
                self.set_suspended(over.link, false);
            }
        }
    }

    /// Removes expired wrenches after a step of `time_step` seconds.
    pub(in crate::simulation) fn end_wrenches(&mut self, time_step: f64) {
        for wrench in &mut self.state.applied_wrenches {
            if let WrenchDuration::For(remaining) = &mut wrench.duration {
                *remaining -= time_step;
            }
        }
        let is_over = |wrench: &mut ActiveWrench| match wrench.duration {
            WrenchDuration::NextStep => true,
            WrenchDuration::For(remaining) => remaining < 0.5 * time_step,
            WrenchDuration::UntilCleared => false,
        };
        if self.state.applied_wrenches.is_empty() && self.state.pulls.is_empty() {
            return;
        }
        let before = self.state.expired_wrenches.len();
        self.state.expired_wrenches.extend(self.state.applied_wrenches.extract_if(.., is_over));
        if self.end_pulls(time_step) || self.state.expired_wrenches.len() > before {
            self.body.begin_external_change();
            self.update_external_forces();
        }
    }
}

/// Returns the rotation `world_from_link`.
fn link_rotation(body: &Articulation, link: usize) -> DQuat {
    body.tree().link_rotation(body.root_pose().rotation, body.positions(), link)
}

/// Returns the body that a wrench acts on, and its force and torque about that body's origin, in its axes.
/// Returns `None` if the link belongs to a fixed base.
fn on_body(body: &Articulation, wrench: &ActiveWrench) -> Option<(usize, Spatial)> {
    let frame = body.tree().links.get(wrench.link)?;
    let index = frame.body?;
    let (mut force, mut torque) = (wrench.force, wrench.torque);
    if !wrench.in_link_axes {
        let link_from_world = link_rotation(body, wrench.link).inverse();
        (force, torque) = (link_from_world * force, link_from_world * torque);
    }
    let about_link = Spatial::new(torque + wrench.point.cross(force), force);
    let link = Placement::new(frame.body_from_link.rotation, frame.body_from_link.translation);
    Some((index, link.force_to_parent(about_link)))
}
