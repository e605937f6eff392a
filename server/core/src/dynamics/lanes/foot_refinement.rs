//! Refinement that makes the impulses of feet exact, for all copies, as
//! [`Direct`](crate::dynamics::direct::Direct) does with the factors of the last round of
//! Newton's method.

use pulp::Simd;

use super::foot_solver::FootSolver;
use crate::dynamics::constraint::contact_law::TOLERANCE;
use crate::dynamics::direct::{EXACT, REFINEMENTS};
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::real::{MaskOf as _, Real as _};

impl<S: Simd> FootSolver<S> {
    /// Computes the residual of each active row's equation. Returns the largest.
    #[inline(always)]
    fn take_residuals(&mut self) -> Lanes<S> {
        let zero = self.zero();
        let Self { feet, joints, velocities, .. } = self;
        let mut largest = zero;
        for foot in feet {
            let [n, t, u] = foot.slip(velocities);
            let (presses, sticks) = (foot.newton.presses, foot.newton.sticks);
            let all = [
                presses.select(foot.target - n, zero),
                (presses & sticks).select(-t, zero),
                (presses & sticks).select(-u, zero),
            ];
            for residual in all {
                largest = largest.max(residual.abs());
            }
            foot.newton.residuals = all;
        }
        joints.take_residuals(velocities, largest)
    }

    /// Removes the softness from velocities and impulses in some lanes. Returns the lanes in which this
    /// succeeds.
    #[inline(always)]
    pub(super) fn refine(&mut self, lanes: Mask<S>) -> Mask<S> {
        let zero = self.zero();
        let Self { feet, joints, velocities, free, .. } = self;
        for (velocity, free) in velocities.iter_mut().zip(&*free) {
            *velocity = lanes.select(*free, *velocity);
        }
        let mut slips = zero.lt(zero);
        for foot in &mut *feet {
            foot.apply_impulse(foot.impulse, lanes & foot.has_impulse(), velocities);
            let is_slip = foot.newton.presses & !foot.newton.sticks;
            slips = slips | (is_slip & lanes);
            for weight in &mut foot.newton.weights[1..] {
                *weight = is_slip.select(zero, *weight);
            }
        }
        joints.apply_all(lanes, velocities);
        // In lanes in which nothing slips the matrix is unchanged.
        let mut is_definite = lanes;
        if slips.any() {
            self.assemble();
            is_definite = self.matrix.factorise() & lanes;
        }
        let mut left = self.take_residuals();
        let mut going = is_definite;
        for _ in 0..REFINEMENTS {
            going = going & !left.le(zero.splat(EXACT));
            if !going.any() {
                break;
            }
            let Self { feet, joints, velocities, change, matrix, hardness, .. } = self;
            let hardness = *hardness;
            change.fill(zero);
            for foot in &*feet {
                let [n, t, u] = foot.newton.residuals;
                let has = foot.newton.presses;
                foot.add_momentum([n * hardness, t * hardness, u * hardness], has, change);
            }
            joints.add_residuals(change);
            matrix.solve(change);
            for foot in &mut *feet {
                let on = foot.newton.presses & going;
                let sticks = foot.newton.sticks;
                let moved = foot.velocities(change);
                let mut added = [zero; 3];
                for (k, added) in added.iter_mut().enumerate() {
                    *added = (foot.newton.residuals[k] - moved[k]) * hardness;
                }
                for own in &mut added[1..] {
                    *own = sticks.select(*own, zero);
                }
                for (impulse, added) in foot.impulse.iter_mut().zip(added) {
                    *impulse = on.select(*impulse + added, *impulse);
                }
                foot.apply_impulse(added, on, velocities);
            }
            joints.refine(going, change, velocities);
            let after = self.take_residuals();
            let is_nearer = after.lt(left);
            left = going.select(after, left);
            going = going & is_nearer;
        }
        is_definite & left.le(zero.splat(TOLERANCE))
    }
}
