//! Bookkeeping of leapfrog: the velocities that a step starts from, and those that it reports. See
//! [`integrator`](crate::dynamics::integrator) for the method.
//!
//! Smooth motion is extrapolated; otherwise integration restarts:
//!
//! * Velocities that were set (a spawn, a reset, other physics) belong to the start of a step. The velocities
//!   in its middle are half a kick away. They are a whole kick away if a contact or a limit holds: these
//!   prescribe velocities, and not forces.
//! * After some steps the velocities in their middle are reported unchanged. These are steps in which a
//!   contact acted, or a limit or dry friction began or ceased to hold. In others friction reversed, a joint
//!   came to rest at its limit, or an actuator reached or left its effort limit.
//! * Total accelerations are extrapolated, including impulses: a robot at rest stays at rest.
//! * A wrench that begins or ends between two steps acts as if half of a step had been made with it. A push
//!   of n steps gives n h times its force, and velocities in between are exact too.
//! * A target acts from the middle of the previous step on, so that a controller that sets one in each step
//!   is not delayed.

use glamx::{DQuat, DVec3};

use super::{Articulation, BodyState, StepScratch};
use crate::dynamics::articulated::write_free;
use crate::dynamics::constraint::{RowKey, respond_to_force};
use crate::dynamics::integrator::{ARRIVES, History, Implicitness, Integrator};
use crate::dynamics::kinematics::free_pose;
use crate::dynamics::spatial::Spatial;
use crate::dynamics::spin::{FreeBody, Momentum, Twist};

impl Articulation {
    /// Sets the velocities that a step changes.
    pub(super) fn begin_leapfrog(&mut self, integrator: Integrator) {
        let BodyState { velocities, half_velocities, history, has_external_changed, .. } = &mut self.state;
        if integrator != Integrator::Leapfrog {
            *history = History::Given;
        }
        if *history == History::Given {
            half_velocities.copy_from_slice(velocities);
        }
        self.scratch.integrator = integrator;
        (self.scratch.is_held, self.scratch.is_touched, self.scratch.is_kinked) = (false, false, false);
        self.scratch.is_linked = false;
        self.scratch.split.clear();
        let goes_on = !matches!(history, History::Given | History::Kinked);
        self.scratch.meets_jump = std::mem::take(has_external_changed) && goes_on;
    }

    /// If external forces have jumped since the last step, corrects the state as if they had acted in the
    /// previous steps.
    pub(super) fn meet_jump(&mut self, h: f64) {
        if !self.scratch.meets_jump || self.scratch.free_body.is_some() {
            return;
        }
        let StepScratch { new_velocities, passes, response, .. } = &mut self.scratch;
        let BodyState {
            positions, half_velocities, changes, changes_before, external, external_before, ..
        } = &mut self.state;
        for (body, (now, before)) in external.iter().zip(external_before).enumerate() {
            let jump = *now - *before;
            if jump == Spatial::ZERO {
                continue;
            }
            let rotation = passes.bodies[body].rotation;
            let jump = Spatial::new(rotation * jump.angular, rotation * jump.linear);
            respond_to_force(&self.tree, positions, (body, jump), passes, response);
            for (i, response) in response.iter().enumerate() {
                half_velocities[i] -= 0.5 * h * response;
                new_velocities[i] -= 0.5 * h * response;
                changes[i] += h * response;
                changes_before[i] += h * response;
            }
        }
    }

    /// Computes the new velocities of a single free body without constraints, after `part` of a kick.
    pub(super) fn drift(&mut self, gravity: DVec3, h: f64, part: f64) {
        let Some(body) = &self.scratch.free_body else { return };
        let state = &self.state;
        let (_, rotation) = free_pose(&state.positions);
        let momentum = body.momentum(rotation, twist(&state.half_velocities));
        let push = if self.scratch.meets_jump {
            (state.external[0] + state.external_before[0]) * 0.5
        } else {
            state.external[0]
        };
        let momentum = kick(body, momentum, rotation, push, gravity, part * h);
        self.scratch.drift = body.drift(rotation, momentum, h);
        let Twist { linear, angular } = self.scratch.drift.twist;
        write_free(&mut self.scratch.new_velocities, linear, angular);
    }

    /// Records that a contact has given it an impulse in this step.
    pub(in crate::dynamics) fn note_contact(&mut self) {
        self.scratch.is_touched = true;
    }

    /// Records that a constraint between links acts on it. `jump`: the velocities before did not satisfy it.
    /// `kink`: it acts differently than in the previous step.
    pub(in crate::dynamics) fn note_link(&mut self, jump: bool, kink: bool) {
        // A force on a single body is a kick before its drift.
        self.scratch.is_touched |= self.scratch.free_body.is_some();
        self.scratch.is_linked = true;
        self.scratch.is_held |= jump;
        self.scratch.is_kinked |= kink;
    }

    /// Returns whether all of its velocities would take half of a kick.
    pub(in crate::dynamics) fn takes_half_alike(&self) -> bool {
        let StepScratch { free_body, passes, .. } = &self.scratch;
        free_body.is_none() && passes.bodies.iter().all(|at| at.implicitness == Implicitness::MEAN)
    }

    /// Returns whether this step may take half of the change of its velocities, if nothing holds it.
    pub(in crate::dynamics) fn may_halve_its_kick(&self) -> bool {
        let StepScratch { integrator, free_body, .. } = &self.scratch;
        // A force on a single body is a kick before its drift.
        *integrator == Integrator::Leapfrog && self.state.history == History::Given && free_body.is_none()
    }

    /// Returns whether this step takes half of the change of its velocities, because they were set at its
    /// start.
    pub(in crate::dynamics) fn halves_its_kick(&self) -> bool {
        let is_smooth = !self.scratch.is_held && !self.scratch.is_touched;
        self.scratch.integrator == Integrator::Leapfrog && self.state.history == History::Given && is_smooth
    }

    /// Determines whether limits hold it, and whether a limit or dry friction has begun or ceased to hold or
    /// has reversed. Call it before the previous impulses are discarded. An unchanged state is smooth: a held
    /// joint has no acceleration.
    ///
    /// A joint that meets its limit takes two steps to stop. In the first it is slowed down so that it
    /// reaches the limit, and in the second it is stopped there. The limit acts in both, and neither is
    /// smooth.
    pub(super) fn judge_rows(&mut self) {
        let is_given = self.state.history == History::Given;
        let BodyState { impulses: before, half_velocities, .. } = &self.state;
        let scratch = &mut self.scratch;
        scratch.is_held = false;
        for row in &scratch.constraints.rows {
            match row.key {
                RowKey::Friction(dof) => {
                    let way = |impulse: f64| if impulse.abs() < row.most { 0.0 } else { impulse.signum() };
                    scratch.is_kinked |= !is_given && way(row.impulse) != way(before.friction[dof]);
                }
                RowKey::Mimic(_) => {}
                RowKey::Tendon(..) => {
                    let way = |impulse: f64| if impulse.abs() < row.most { 0.0 } else { impulse.signum() };
                    scratch.is_kinked |= !is_given && way(row.impulse) != way(before.get(row.key));
                }
                RowKey::Lower(dof) | RowKey::Upper(dof) => {
                    let (side, towards) = match row.key {
                        RowKey::Lower(_) => (&before.lower, -half_velocities[dof]),
                        _ => (&before.upper, half_velocities[dof]),
                    };
                    let (holds, held) = (row.impulse != 0.0, side[dof] != 0.0);
                    scratch.is_held |= holds;
                    scratch.is_kinked |= holds != held || (holds && towards > ARRIVES);
                }
            }
        }
    }

    /// Stores the step's changes of velocities, and takes only half of them if the velocities belong to its
    /// start.
    pub(super) fn note_changes(&mut self, gravity: DVec3, h: f64) {
        let BodyState { half_velocities, changes, changes_before, history, .. } = &mut self.state;
        std::mem::swap(changes_before, changes);
        for ((change, new), half) in
            changes.iter_mut().zip(&self.scratch.new_velocities).zip(&*half_velocities)
        {
            *change = new - half;
        }
        let is_smooth = !self.scratch.is_held && !self.scratch.is_touched;
        if self.scratch.integrator != Integrator::Leapfrog || *history != History::Given || !is_smooth {
            return;
        }
        if self.scratch.free_body.is_some() {
            self.drift(gravity, h, 0.5);
            return;
        }
        let all = self.implicitness_of_all();
        let StepScratch { new_velocities, passes, velocity_terms, is_kinked, .. } = &mut self.scratch;
        let BodyState { positions, half_velocities, changes, .. } = &self.state;
        let alike = passes.bodies.iter().all(|at| at.implicitness == Implicitness::MEAN);
        if let Some(all) = all.or(alike.then_some(Implicitness::MEAN)) {
            for ((new, half), change) in new_velocities.iter_mut().zip(half_velocities).zip(changes) {
                *new = half + all.damper() * change;
            }
            self.balance_half_kick(gravity, h);
            return;
        }
        // Other joints feel what a stiff joint does within the step.
        let part = |body: usize| passes.bodies[body].implicitness.damper();
        let change = velocity_terms.part_of(&self.tree, positions, passes, changes, part);
        for ((new, half), change) in new_velocities.iter_mut().zip(half_velocities).zip(change) {
            *new = half + change;
        }
        *is_kinked = true;
        self.balance_half_kick(gravity, h);
    }

    /// Reports velocities at the end of the step, for the positions there.
    pub(super) fn take_new_velocities(&mut self, gravity: DVec3, h: f64) {
        let all = self.implicitness_of_all();
        if self.scratch.integrator == Integrator::Leapfrog && self.scratch.free_body.is_some() {
            self.take_drift(gravity, h);
            return;
        }
        let StepScratch { new_velocities, passes, integrator, is_touched, is_kinked, .. } = &self.scratch;
        let state = &mut self.state;
        state.half_velocities.copy_from_slice(new_velocities);
        if *integrator != Integrator::Leapfrog {
            state.velocities.copy_from_slice(new_velocities);
            return;
        }
        let is_smooth = !(*is_touched || *is_kinked);
        state.history = state.history.after(is_smooth);
        if !is_smooth {
            state.velocities.copy_from_slice(new_velocities);
            return;
        }
        // Slices of one length, so that an index is checked once.
        let n = new_velocities.len();
        let (new_velocities, velocities) = (&new_velocities[..n], &mut state.velocities[..n]);
        let (changes, before, axes) = (&state.changes[..n], &state.changes_before[..n], &state.axes[..n]);
        for (body, at) in self.tree.bodies.iter().zip(&passes.bodies) {
            let own = all.unwrap_or(at.implicitness);
            let dofs = body.velocity..body.velocity + body.joint_type.velocities();
            let moved = velocities[dofs.clone()].iter_mut().zip(&new_velocities[dofs.clone()]);
            let changed = changes[dofs.clone()].iter().zip(&before[dofs.clone()]);
            for (((velocity, new), (change, before)), axis) in moved.zip(changed).zip(&axes[dofs]) {
                let end = new + state.history.extrapolated(own, *change, *before);
                // Dry friction brakes only to rest.
                let turns = end * new < 0.0 && axis.settings.friction > 0.0;
                *velocity = if turns { 0.0 } else { end };
            }
        }
    }

    /// Reports the velocities of a single free body. Between two steps it has the velocities at the end of
    /// its drift, without the kick; the reported ones include half of it.
    fn take_drift(&mut self, gravity: DVec3, h: f64) {
        let StepScratch { new_velocities, free_body, drift, is_touched, .. } = &self.scratch;
        let Some(body) = free_body else { return };
        let BodyState {
            positions,
            velocities,
            half_velocities,
            changes,
            changes_before,
            history,
            external,
            ..
        } = &mut self.state;
        let (_, rotation) = free_pose(positions);
        let is_smooth = !*is_touched;
        let mut momentum = drift.after;
        if *is_touched {
            // Contact impulses are a kick: the body drifts from there, and keeps its energy.
            let new = twist(new_velocities);
            let push =
                Twist { linear: new.linear - drift.twist.linear, angular: new.angular - drift.twist.angular };
            momentum = body.drift(drift.rotation, body.push(drift.rotation, drift.before, push), h).after;
        }
        // Velocities at the ends of steps, if both include half of a kick.
        let ends = is_smooth && *history != History::Kinked;
        let last = if ends { &*velocities } else { &*half_velocities };
        changes_before.copy_from_slice(last);
        let Twist { linear, angular } = body.twist(rotation, momentum);
        write_free(half_velocities, linear, angular);
        if is_smooth {
            momentum = kick(body, momentum, rotation, external[0], gravity, 0.5 * h);
        }
        let Twist { linear, angular } = body.twist(rotation, momentum);
        write_free(velocities, linear, angular);
        let now = if ends { &*velocities } else { &*half_velocities };
        for ((change, before), now) in changes.iter_mut().zip(&mut *changes_before).zip(now) {
            *change = now - *before;
            *before = 0.0;
        }
        *history = history.after(is_smooth);
    }

    /// Returns the difference between a single free body's origin velocity in the last step and the one at
    /// its end. The origin revolves about the centre of mass, which moves in a straight line. World, m/s.
    pub(in crate::dynamics) fn swing_of_origin(&self, h: f64) -> DVec3 {
        let StepScratch { integrator, free_body, .. } = &self.scratch;
        let (Some(body), Integrator::Leapfrog) = (free_body, integrator) else { return DVec3::ZERO };
        let (center, _) = body.about_own_center();
        if center == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let angular = twist(&self.state.half_velocities).angular;
        free_pose(&self.state.positions).1 * (angular.cross(angular.cross(center)) * (0.5 * h))
    }

    /// Returns the common implicitness of all joints if joints follow others, tendons pull them or links are
    /// constrained, so that followers also follow in velocity.
    fn implicitness_of_all(&self) -> Option<Implicitness> {
        if self.tree.mimics.is_empty() && self.tree.tendons.is_empty() && !self.scratch.is_linked {
            return None;
        }
        let most = |a: Implicitness, b: Implicitness| if b.damper() > a.damper() { b } else { a };
        self.scratch.passes.bodies.iter().map(|at| at.implicitness).reduce(most)
    }
}

fn twist(velocities: &[f64]) -> Twist {
    Twist {
        linear: DVec3::new(velocities[0], velocities[1], velocities[2]),
        angular: DVec3::new(velocities[3], velocities[4], velocities[5]),
    }
}

/// Returns the momentum after a kick of `h` seconds by gravity and by a push about the body's origin, in its
/// own axes.
fn kick(
    body: &FreeBody,
    momentum: Momentum,
    rotation: DQuat,
    push: Spatial,
    gravity: DVec3,
    h: f64,
) -> Momentum {
    let torque = body.about_center(push.angular, push.linear);
    body.kick(momentum, torque, rotation * push.linear, gravity, h)
}
