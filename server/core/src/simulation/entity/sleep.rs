//! Which steps need a robot.

use super::Entity;
use crate::dynamics::spatial::Spatial;

impl Entity {
    /// Returns whether it takes part in the simulation.
    pub(in crate::simulation) fn is_active(&self) -> bool {
        self.state.disabled.is_none()
    }

    /// Returns whether any part of it can move.
    pub(in crate::simulation) fn moves(&self) -> bool {
        !self.body.tree().bodies.is_empty()
    }

    /// Returns whether a step has it in a group, with others or alone: it is active, and part of it can move.
    pub(in crate::simulation) fn is_solved(&self) -> bool {
        self.is_active() && self.moves()
    }

    /// Returns whether nothing needs its pose before it is solved, since it has no shapes. It is then fetched
    /// into the cache once in each part of a step, and not first for its poses.
    pub(in crate::simulation) fn begins_late(&self) -> bool {
        self.is_solved() && self.colliders.is_empty()
    }

    /// Returns whether a step changes it.
    pub(in crate::simulation) fn is_awake(&self) -> bool {
        !self.state.asleep && self.is_solved()
    }

    /// Returns whether no step changes it or has anything left to do for it: it cannot move, and its shapes
    /// are placed.
    pub(in crate::simulation) fn is_idle(&self) -> bool {
        let state = &self.state;
        !self.moves()
            && !state.teleported
            && state.applied_wrenches.is_empty()
            && state.expired_wrenches.is_empty()
            && state.pulls.is_empty()
            && (self.colliders.is_empty() || self.colliders.are_placed_for(self.body.base()))
    }

    pub(in crate::simulation) fn is_free_body(&self) -> bool {
        let tree = self.body.tree();
        !tree.fixed_base && tree.bodies.len() == 1
    }

    /// Returns whether it is a single free body without applied forces; damping is none.
    pub(in crate::simulation) fn may_sleep(&self) -> bool {
        self.is_free_body()
            && !self.state.contact_settings.stays_awake
            && self.state.pulls.is_empty()
            && (self.body.external().iter().all(|push| *push == Spatial::ZERO)
                || self.state.applied_wrenches.iter().all(|wrench| wrench.suspended))
    }

    pub(in crate::simulation) fn fall_asleep(&mut self) {
        self.state.asleep = true;
        self.state.rest_poses.extend(self.colliders.save_poses());
        self.body.velocities_mut().fill(0.0);
    }

    /// Wakes it.
    pub(in crate::simulation) fn wake(&mut self) {
        if self.state.asleep {
            self.state.asleep = false;
            self.state.rest_poses.clear();
            self.state.still_for = 0.0;
            self.body.update_kinematics();
        }
    }
}
