//! Access to a robot's state between steps, and changes of its pose.

use std::sync::Arc;

use glamx::{DPose3, DVec3};

use super::{Articulation, BodyState};
use crate::dynamics::actuator::{Actuator, Axis};
use crate::dynamics::articulated::write_free;
use crate::dynamics::integrator::History;
use crate::dynamics::real::LARGEST_STATE;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::Tree;

impl Articulation {
    /// Returns its structure.
    pub fn tree(&self) -> &Arc<Tree> {
        &self.tree
    }

    /// Returns the state that outlasts a step.
    pub fn state(&self) -> &BodyState {
        &self.state
    }

    /// Returns the state, to be written from lanes.
    pub(in crate::dynamics) fn state_mut(&mut self) -> &mut BodyState {
        &mut self.state
    }

    /// Copies another state of its tree.
    pub fn set_state(&mut self, state: &BodyState) {
        self.state.copy_from(state);
    }

    /// Returns positions q, with a free root's seven first.
    pub fn positions(&self) -> &[f64] {
        &self.state.positions
    }

    /// Returns the positions, to move it elsewhere.
    pub fn positions_mut(&mut self) -> &mut [f64] {
        self.state.history = History::Given;
        &mut self.state.positions
    }

    /// Returns velocities qd, with a free root's six first.
    pub fn velocities(&self) -> &[f64] {
        &self.state.velocities
    }

    /// Returns the velocities that moved it in the last step; with leapfrog, those in the middle of it. Rows
    /// hold for these.
    pub fn half_velocities(&self) -> &[f64] {
        &self.state.half_velocities
    }

    /// Returns the velocities, to set others.
    pub fn velocities_mut(&mut self) -> &mut [f64] {
        self.state.forget_last_step();
        &mut self.state.velocities
    }

    /// Returns the accelerations in the last step of `h`, one for each degree of freedom; zero if velocities
    /// were set since.
    pub fn last_accelerations(&self, h: f64) -> impl Iterator<Item = f64> + '_ {
        self.state.changes.iter().map(move |change| change / h)
    }

    /// Restarts the next step from the velocities at the end of the last one. Keeps accelerations constant if
    /// it is longer by a factor.
    pub(crate) fn change_step(&mut self, factor: f64) {
        self.state.history = History::Given;
        self.state.changes.iter_mut().for_each(|change| *change *= factor);
    }

    /// Returns settings and targets, one for each degree of freedom.
    pub fn axes(&self) -> &[Axis] {
        &self.state.axes
    }

    /// Returns settings and targets, to change them.
    pub fn axes_mut(&mut self) -> &mut [Axis] {
        self.state.history = self.state.history.min(History::Interrupted);
        &mut self.state.axes
    }

    /// Sets the target of an axis.
    pub fn set_actuator(&mut self, dof: usize, actuator: Actuator) {
        let present = &mut self.state.axes[dof].actuator;
        if actuator != *present {
            self.state.history = self.state.history.min(present.mode.history_after(actuator.mode));
        }
        *present = actuator;
    }

    /// Returns the efforts that the actuators applied over the last step, one for each degree of freedom.
    pub fn efforts(&self) -> &[f64] {
        &self.state.efforts
    }

    /// Returns whether an actuator applied its limit in the last step, or was predicted to.
    pub fn is_saturated(&self, dof: usize) -> bool {
        self.state.drives.get(dof).is_some_and(|drive| drive.saturated.is_some())
    }

    /// Returns the external forces on each body, in its own frame.
    pub fn external(&self) -> &[Spatial] {
        &self.state.external
    }

    /// Marks the next change of external forces as a jump, which is more than a turn of the body.
    pub fn begin_external_change(&mut self) {
        let BodyState { external, external_before, has_external_changed, .. } = &mut self.state;
        if !*has_external_changed {
            *has_external_changed = true;
            external_before.copy_from_slice(external);
        }
    }

    /// Returns the external forces, to change them.
    pub fn external_mut(&mut self) -> &mut [Spatial] {
        &mut self.state.external
    }

    /// Returns whether every position and velocity is finite and within [`LARGEST_STATE`].
    pub fn is_finite(&self) -> bool {
        self.state.positions.iter().chain(&self.state.velocities).all(|value| value.abs() <= LARGEST_STATE)
    }

    /// Returns `world_from_base`: the pose of a fixed root link, or the identity for a free root.
    pub fn base(&self) -> DPose3 {
        self.state.base
    }

    /// Returns `world_from_root`.
    pub fn root_pose(&self) -> DPose3 {
        self.state.root_pose(&self.tree)
    }

    /// Returns the linear velocity of the root link's origin and its angular velocity, world axes.
    pub fn root_twist(&self) -> (DVec3, DVec3) {
        if self.tree.fixed_base {
            return (DVec3::ZERO, DVec3::ZERO);
        }
        let qd = &self.state.velocities;
        let own = DVec3::new(qd[3], qd[4], qd[5]);
        (DVec3::new(qd[0], qd[1], qd[2]), self.root_pose().rotation * own)
    }

    /// Moves the root to a pose.
    pub fn set_root_pose(&mut self, world_from_root: DPose3) {
        self.state.history = History::Given;
        self.state.set_root_pose(&self.tree, world_from_root);
    }

    /// Sets the velocities of a free root, world axes; does nothing to a fixed one.
    pub fn set_root_twist(&mut self, linear: DVec3, angular: DVec3) {
        if !self.tree.fixed_base {
            self.state.forget_last_step();
            let own = self.root_pose().rotation.inverse() * angular;
            write_free(&mut self.state.velocities, linear, own);
        }
    }
}
