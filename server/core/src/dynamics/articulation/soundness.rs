//! Whether a robot can be solved together with others, and what becomes of one that cannot.

use glamx::DVec3;
use simd_model::LARGEST_GIVEN;

use super::Articulation;
use crate::dynamics::constraint::Constraints;

/// What is faster than this, m/s or rad/s, or farther away, m or rad, is not computed with, nor solved together with others: far beyond
/// what follows from numbers that can be given.
pub const LARGEST_STATE: f64 = 1e6 * LARGEST_GIVEN;

impl Articulation {
    /// Whether each of the new velocities is a number, of this size at the most.
    pub fn new_velocities_are_within(&self, most: f64) -> bool {
        self.scratch.new_velocities.iter().all(|velocity| velocity.abs() <= most)
    }

    /// Whether what the rows of its joints aim at and what their impulses do are numbers of this size at the most. They have to be
    /// [prepared](Self::prepare_rows).
    pub(in crate::dynamics) fn rows_are_within(&self, most: f64) -> bool {
        let Constraints { rows, responses } = &self.scratch.constraints;
        let count = rows.len() * self.state.velocities.len();
        let aims = rows.iter().flat_map(|row| [row.bias, row.effect]);
        aims.chain(responses.iter().take(count).copied()).all(|number| number.abs() <= most)
    }

    /// Finds the new velocities without contacts again, after a solution that is of no use: also what that said of actuators.
    pub(in crate::dynamics) fn start_again(&mut self, gravity: DVec3, h: f64) {
        self.forget_saturation();
        self.predict(gravity, h);
        self.collect_rows(h);
    }

    /// Sees to it that the step leaves it not finite, whatever else is found of it: its owner takes it out of the simulation then.
    pub(in crate::dynamics) fn spoil(&mut self) {
        // New velocities are found from those of the last step.
        self.state.half_velocities.fill(f64::NAN);
        self.scratch.new_velocities.fill(f64::NAN);
    }
}
