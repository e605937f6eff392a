//! Solutions of several robots that are of no use, and which of the robots that is due to.
//!
//! One robot that has diverged takes along all that it is solved with: what it does to one row, the next sweep does to the others.

use glamx::DVec3;

use super::Island;
use crate::dynamics::articulation::{Articulation, LARGEST_STATE};

/// No number of a row may be larger than this: its square times a velocity is still one.
const LARGEST: f64 = 1e100;

/// Robots that were this part as fast as the fastest are taken for what has spoilt a solution, all of them.
const NEARLY_FASTEST: f64 = 1e-3;

impl Island {
    /// Whether the velocities that were found can be. A robot that is alone spoils no other one.
    pub(super) fn is_usable(&self) -> bool {
        self.members.len() < 2 || are_within(&self.velocities, LARGEST_STATE)
    }

    /// Leaves those robots not finite that the solution could not be found with: those of which a row has numbers that cannot be computed
    /// with, and where there are none, those that were the fastest. Starts the others again.
    pub(super) fn leave_out_unsound<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        gravity: DVec3,
        h: f64,
    ) {
        // Takes memory. It is rare: what is left out is disabled.
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
            // Others have got it from those that were the fastest.
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

/// Whether all are numbers of this size at the most.
fn are_within(numbers: &[f64], most: f64) -> bool {
    numbers.iter().all(|number| number.abs() <= most)
}
