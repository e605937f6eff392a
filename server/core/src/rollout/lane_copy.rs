//! Transfer of a copy's state from its lane to its world.

use pulp::Simd;

use super::batch::Worker;
use crate::dynamics::lanes::LaneRobot;

impl Worker {
    /// Copies the state of a lane to the copy's world, at this step of the world.
    pub(super) fn bring_back<S: Simd>(
        &mut self,
        lanes: &LaneRobot<S>,
        (lane, robot): (usize, usize),
        step: u64,
    ) {
        lanes.give_back(lane, self.world.body_mut(robot));
        if lanes.has_feet() {
            self.world.set_lane_contacts(lanes.contacts(lane));
        }
        self.world.pass_steps_to(step);
    }

    /// Updates the view with what a step of lanes has changed of a copy.
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
        if lanes.has_feet() {
            self.world.set_lane_contacts(lanes.contacts(lane));
            self.world.observe_contacts(&mut self.view.state);
        }
        self.view.changed();
    }
}
