//! What a robot shows between steps, and where it is put.

use std::sync::Arc;

use glamx::{DPose3, DVec3};

use super::{Articulation, BodyState};
use crate::dynamics::actuator::Axis;
use crate::dynamics::articulated::write_free;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::tree::Tree;

impl Articulation {
    /// How it is built.
    pub fn tree(&self) -> &Arc<Tree> {
        &self.tree
    }

    /// All of it that outlasts a step.
    pub fn state(&self) -> &BodyState {
        &self.state
    }

    /// Puts it into another state of its tree.
    pub fn set_state(&mut self, state: BodyState) {
        self.state = state;
    }

    /// q: a free root's seven first.
    pub fn positions(&self) -> &[f64] {
        &self.state.positions
    }

    /// To put it elsewhere.
    pub fn positions_mut(&mut self) -> &mut [f64] {
        &mut self.state.positions
    }

    /// qd: a free root's six first.
    pub fn velocities(&self) -> &[f64] {
        &self.state.velocities
    }

    /// To give it other velocities.
    pub fn velocities_mut(&mut self) -> &mut [f64] {
        self.state.forget_accelerations();
        &mut self.state.velocities
    }

    /// How the velocities changed in the last step of `h`, one per degree of freedom and second; zero where they were
    /// given since.
    pub fn last_accelerations(&self, h: f64) -> impl Iterator<Item = f64> + '_ {
        let change = move |(after, before): (&f64, &f64)| {
            if self.state.has_stepped { (after - before) / h } else { 0.0 }
        };
        self.state.velocities.iter().zip(&self.state.velocities_before).map(change)
    }

    /// Keeps accelerations as they are where a step becomes longer by a factor.
    pub(crate) fn stretch_last_step(&mut self, factor: f64) {
        // Also to the bit.
        if factor == 1.0 {
            return;
        }
        let BodyState { velocities, velocities_before, .. } = &mut self.state;
        for (before, after) in velocities_before.iter_mut().zip(&*velocities) {
            *before = after - (after - *before) * factor;
        }
    }

    /// One per degree of freedom.
    pub fn axes(&self) -> &[Axis] {
        &self.state.axes
    }

    /// To change settings and targets.
    pub fn axes_mut(&mut self) -> &mut [Axis] {
        &mut self.state.axes
    }

    /// What the actuators applied over the last step, one per degree of freedom.
    pub fn efforts(&self) -> &[f64] {
        &self.state.efforts
    }

    /// Whether each actuator applied its limit in the last step.
    pub fn is_saturated(&self, dof: usize) -> bool {
        self.state.drives.get(dof).is_some_and(|drive| drive.saturated.is_some())
    }

    /// Forces from outside on each body, in its own frame.
    pub fn external(&self) -> &[Spatial] {
        &self.state.external
    }

    /// To change them.
    pub fn external_mut(&mut self) -> &mut [Spatial] {
        &mut self.state.external
    }

    /// Whether every position and velocity is finite.
    pub fn is_finite(&self) -> bool {
        self.state.positions.iter().chain(&self.state.velocities).all(|value| value.is_finite())
    }

    /// `world_from_base`: of a fixed root link; the world itself where the root is free.
    pub fn base(&self) -> DPose3 {
        self.state.base
    }

    /// `world_from_root`.
    pub fn root_pose(&self) -> DPose3 {
        self.state.root_pose(&self.tree)
    }

    /// Linear velocity of the root link's origin and its angular velocity, world axes.
    pub fn root_twist(&self) -> (DVec3, DVec3) {
        if self.tree.fixed_base {
            return (DVec3::ZERO, DVec3::ZERO);
        }
        let qd = &self.state.velocities;
        let own = DVec3::new(qd[3], qd[4], qd[5]);
        (DVec3::new(qd[0], qd[1], qd[2]), self.root_pose().rotation * own)
    }

    /// Puts the root elsewhere.
    pub fn set_root_pose(&mut self, world_from_root: DPose3) {
        self.state.set_root_pose(&self.tree, world_from_root);
    }

    /// Gives a free root other velocities, world axes; does nothing to a fixed one.
    pub fn set_root_twist(&mut self, linear: DVec3, angular: DVec3) {
        if !self.tree.fixed_base {
            self.state.forget_accelerations();
            let own = self.root_pose().rotation.inverse() * angular;
            write_free(&mut self.state.velocities, linear, own);
        }
    }
}
