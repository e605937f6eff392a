//! End of a step in which constraints between links correct positions.

use glamx::DVec3;

use super::{Articulation, StepScratch};
use crate::dynamics::integrate::advance;
use crate::dynamics::integrator::Integrator;
use crate::dynamics::kinematics::free_pose;

impl Articulation {
    /// First part of [`finish`](Self::finish) if constraints between links correct positions;
    /// [`update_positions`](Self::update_positions) must follow. A `far` correction is not smooth.
    pub(in crate::dynamics) fn begin_position_update(&mut self, far: bool, gravity: DVec3, h: f64) {
        self.scratch.is_kinked |= far;
        self.note_efforts(h);
        self.limit_velocities();
        self.note_changes(gravity, h);
    }

    /// Integrates positions with the new velocities and with `split`, the velocities by which constraints
    /// between links correct positions. It also transports the new velocities, so that the robot keeps its
    /// kinetic energy. Must follow [`add_momenta_ahead`](Self::add_momenta_ahead), and precede
    /// [`finish_velocities`](Self::finish_velocities).
    pub(in crate::dynamics) fn update_positions(&mut self, split: &[f64], h: f64) {
        let StepScratch {
            new_velocities, passes, velocity_terms, response: sum, split: own, free_body, ..
        } = &mut self.scratch;
        own.clear();
        own.extend_from_slice(split);
        sum.iter_mut().zip(&*new_velocities).zip(split).for_each(|((sum, new), split)| *sum = new + split);
        if free_body.is_none() {
            velocity_terms.transport(&self.tree, &self.state.positions, (split, h), passes, new_velocities);
        }
        advance(&self.tree, &mut self.state.positions, sum, h);
        self.scratch.shift = self.shift();
        self.shift_origin(1.0);
    }

    /// Returns the additional origin velocity of a single body with which its centre of mass continues its
    /// motion. The correction has rotated the origin about the centre.
    fn shift(&self) -> DVec3 {
        let StepScratch { new_velocities, ahead, free_body, .. } = &self.scratch;
        let (Some(body), [_, _, _, x, y, z]) = (free_body, &new_velocities[..]) else { return DVec3::ZERO };
        let swing = DVec3::new(*x, *y, *z).cross(body.about_own_center().0);
        let [without, with] = [ahead, &self.state.positions].map(|positions| free_pose(positions).1);
        without * swing - with * swing
    }

    fn shift_origin(&mut self, sign: f64) {
        let StepScratch { new_velocities, shift, .. } = &mut self.scratch;
        new_velocities
            .iter_mut()
            .zip(shift.to_array())
            .for_each(|(velocity, shift)| *velocity += sign * shift);
    }

    /// Does after [`update_positions`](Self::update_positions) what [`finish`](Self::finish) does with
    /// velocities.
    pub(in crate::dynamics) fn finish_velocities(&mut self, gravity: DVec3, h: f64) {
        // Leapfrog takes a single body's velocities for those at the begin of its drift.
        if self.scratch.integrator == Integrator::Leapfrog {
            self.shift_origin(-1.0);
        }
        self.take_new_velocities(gravity, h);
    }

    /// Returns the velocities by which constraints between links corrected its position in the last step;
    /// empty if they did not.
    pub fn split_velocities(&self) -> &[f64] {
        &self.scratch.split
    }
}
