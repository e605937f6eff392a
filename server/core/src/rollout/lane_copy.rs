//! A copy in a group of lanes: how far it is, and how its world follows its lane.

use pulp::Simd;

use super::batch::{Stop, Worker};
use crate::dynamics::lanes::LaneRobot;

/// A copy in a group.
pub(super) struct Running {
    pub(super) copy: usize,
    /// Among those of the batch.
    pub(super) index: usize,
    /// Rows that are read.
    pub(super) rows: usize,
    /// Its view has all of its world, but for what a step of lanes changes.
    pub(super) is_seen: bool,
    /// Steps that it does by itself in a row where lanes do not do one: twice as many each time.
    pub(super) pause: u64,
    /// Steps that it had done when it last stepped by itself: that may be more than the group has done.
    pub(super) done: u64,
    /// Why it does no more, and the steps that it had done by then.
    pub(super) stop: Option<(Stop, u64)>,
}

impl Running {
    /// One that has done nothing.
    pub(super) fn new(copy: usize, index: usize) -> Self {
        Self { copy, index, rows: 0, is_seen: false, pause: 0, done: 0, stop: None }
    }

    /// Whether it has yet to do this step.
    pub(super) fn waits_for(&self, step: u64) -> bool {
        self.stop.is_none() && self.done <= step
    }
}

impl Worker {
    /// Brings its world to where the copy in a lane is, at this step of the world.
    pub(super) fn bring_back<S: Simd>(
        &mut self,
        lanes: &LaneRobot<S>,
        (lane, robot): (usize, usize),
        step: u64,
    ) {
        lanes.give_back(lane, self.world.body_mut(robot));
        self.world.pass_steps_to(step);
    }

    /// Looks at what a step of lanes has changed of a copy.
    pub(super) fn look_at_lane<S: Simd>(&mut self, lanes: &LaneRobot<S>, (lane, robot): (usize, usize)) {
        let state = &mut self.view.state;
        if let Some((pose, linear, angular)) = lanes.root(lane) {
            let root = &mut state.roots[robot];
            (root.pose, root.linear, root.angular) = (pose, linear, angular);
        }
        let layout = &state.world.entities[robot];
        let (positions, velocities) = (layout.positions.clone(), layout.velocities.clone());
        lanes.write_joints(
            lane,
            [
                &mut state.positions[positions],
                &mut state.velocities[velocities.clone()],
                &mut state.efforts[velocities],
            ],
        );
        self.view.changed();
    }
}
