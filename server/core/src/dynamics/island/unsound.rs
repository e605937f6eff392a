//! Unusable solutions of several robots, and the robots that cause them.
//!
//! A robot that has diverged spoils everything that it is solved with: its effect on one row reaches the
//! others in the next sweep.

use glamx::DVec3;

use super::Island;
use crate::dynamics::articulation::Articulation;
use crate::dynamics::real::LARGEST_STATE;

/// Largest number of a row: its square times a velocity is still finite.
const LARGEST: f64 = 1e100;

/// Velocity, as a part of the fastest, from which all such robots count as the cause of a bad solution.
const NEARLY_FASTEST: f64 = 1e-3;

impl Island {
    /// Returns whether the velocities are usable. A robot that is solved alone affects no other one.
    pub(super) fn is_usable(&self) -> bool {
        self.members.len() < 2 || are_within(&self.velocities, LARGEST_STATE)
    }

    /// Sets the velocities of robots that spoil the solution to NaN, and restarts the others. These are
    /// robots with a row of unusable numbers, or if there are none, the fastest robots.
    pub(super) fn leave_out_unsound<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        gravity: DVec3,
        h: f64,
    ) {
        // Allocates. It is rare: a robot that is left out is disabled.
        let mut are_sound: Vec<bool> =
            robots.iter_mut().map(|robot| robot.as_mut().rows_are_within(LARGEST)).collect();
        let turning = self.turning.iter().map(|turning| &turning.rows);
        let links = self.links.iter().map(|link| &link.rows);
        for rows in self.rows.iter().chain(turning).chain(links) {
            for side in rows.sides.iter().filter(|side| side.len > 0) {
                let numbers = &self.blocks[side.at..side.at + side.size()];
                are_sound[side.member] &= are_within(numbers, LARGEST);
            }
        }
        if are_sound.iter().all(|is_sound| *is_sound) {
            // The others got it from the fastest ones.
            let largest =
                |own: &[f64]| own.iter().fold(0.0f64, |largest, velocity| largest.max(velocity.abs()));
            let most = largest(&self.free) * NEARLY_FASTEST;
            for (is_sound, member) in are_sound.iter_mut().zip(&self.members) {
                *is_sound = largest(&self.free[member.velocities()]) < most;
            }
        }
        for (robot, is_sound) in robots.iter_mut().zip(are_sound) {
            if is_sound {
                robot.as_mut().start_again(gravity, h);
            } else {
                robot.as_mut().spoil();
            }
        }
    }
}

/// Returns whether all numbers are finite and at most `most` in size.
fn are_within(numbers: &[f64], most: f64) -> bool {
    numbers.iter().all(|number| number.abs() <= most)
}
