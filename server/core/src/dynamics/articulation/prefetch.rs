//! Prefetch of a robot's memory before a step reads it.

use std::hint::black_box;

use super::Articulation;
use crate::dynamics::ldlt::Ldlt6;
use crate::dynamics::scratch::BodyScratch;

impl Articulation {
    /// Reads a number of each piece of memory that a step of a single body needs, and discards it.
    ///
    /// With a thousand robots, most are in distant memory, each in some ten pieces. A step that reads one
    /// piece after the other waits for each of them. This function waits for all of them at once. For a robot
    /// with joints, the arithmetic takes longer than the memory.
    pub fn prefetch(&self) {
        let (state, scratch) = (&self.state, &self.scratch);
        let ([at], [factors]) = (&scratch.passes.bodies[..], &scratch.passes.free[..]) else { return };
        let lists = [
            &state.positions,
            &state.velocities,
            &state.half_velocities,
            &state.changes,
            &state.changes_before,
            &scratch.new_velocities,
        ];
        let mut sum = 0;
        for list in lists {
            sum ^= list.first().map_or(0, |number| number.to_bits());
        }
        let BodyScratch { rotation, origin, velocity, velocity_product, articulated, bias, column, .. } = at;
        let Ldlt6 { lower, inverse_diagonal } = factors;
        for number in [
            rotation.x_axis.x,
            rotation.z_axis.z,
            origin.x,
            velocity.linear.x,
            velocity_product.linear.x,
            articulated.moment.xx,
            articulated.coupling.x_axis.x,
            articulated.mass.zz,
            bias.linear.x,
            column.linear.x,
            lower[0][0],
            lower[1][4],
            lower[3][0],
            lower[4][4],
            inverse_diagonal[5],
        ] {
            sum ^= number.to_bits();
        }
        if let [push] = &state.external[..] {
            sum ^= push.linear.x.to_bits();
        }
        black_box(sum);
    }
}
