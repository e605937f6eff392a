//! Checks whether a robot can be solved together with others, and handling of one that cannot.

use glamx::DVec3;

use super::Articulation;
use crate::dynamics::constraint::Constraints;

impl Articulation {
    /// Returns whether all new velocities are finite and at most `most` in size.
    pub fn new_velocities_are_within(&self, most: f64) -> bool {
        self.scratch.new_velocities.iter().all(|velocity| velocity.abs() <= most)
    }

    /// Returns whether the targets of its joints' rows and the effects of their impulses are finite and at
    /// most `most` in size. Requires [prepared](Self::prepare_rows) rows.
    pub(in crate::dynamics) fn rows_are_within(&self, most: f64) -> bool {
        let Constraints { rows, responses, .. } = &self.scratch.constraints;
        let count = rows.len() * self.state.velocities.len();
        let aims = rows.iter().flat_map(|row| [row.bias, row.effect]);
        aims.chain(responses.iter().take(count).copied()).all(|number| number.abs() <= most)
    }

    /// Recomputes the new velocities without contacts after an unusable solution, and discards its
    /// saturation.
    pub(in crate::dynamics) fn start_again(&mut self, gravity: DVec3, h: f64) {
        self.forget_saturation();
        self.predict(gravity, h);
        self.collect_rows(h);
    }

    /// Makes the robot's state NaN after the step, whatever else is computed for it. Its owner then removes
    /// it from the simulation.
    pub(in crate::dynamics) fn spoil(&mut self) {
        // New velocities are computed from those of the last step.
        self.state.half_velocities.fill(f64::NAN);
        self.scratch.new_velocities.fill(f64::NAN);
    }
}
