//! The end of a step in which constraints between links put positions right.

use glamx::DVec3;

use super::{Articulation, StepScratch};
use crate::dynamics::integrate::advance;
use crate::dynamics::integrator::Integrator;
use crate::dynamics::kinematics::free_pose;

impl Articulation {
    /// The first part of [`finish`](Self::finish), where constraints between links put positions right;
    /// [`update_positions`](Self::update_positions) has to follow. What goes `far` is not smooth.
    pub(in crate::dynamics) fn begin_position_update(&mut self, far: bool, gravity: DVec3, h: f64) {
        self.scratch.is_kinked |= far;
        self.note_efforts(h);
        self.note_changes(gravity, h);
    }

    /// Moves on by the new velocities and by `split`, with which constraints between links put positions right. The new velocities
    /// go along, so that the robot keeps its kinetic energy. [`finish_velocities`](Self::finish_velocities) has to follow,
    /// and [`add_momenta_ahead`](Self::add_momenta_ahead) has to have looked.
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

    /// Of a single body, what its origin has to go faster by so that its centre of mass goes on as it did: it is elsewhere about the centre
    /// than it would have been.
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

    /// After [`update_positions`](Self::update_positions), what [`finish`](Self::finish) does with velocities.
    pub(in crate::dynamics) fn finish_velocities(&mut self, gravity: DVec3, h: f64) {
        // Leapfrog takes a single body's velocities for those at the begin of its drift.
        if self.scratch.integrator == Integrator::Leapfrog {
            self.shift_origin(-1.0);
        }
        self.take_new_velocities(gravity, h);
    }

    /// The velocities with which constraints between links have put its position right in the last step; none where they did not.
    pub fn split_velocities(&self) -> &[f64] {
        &self.scratch.split
    }
}
