//! Actuators in lanes: setpoints, laws and effort limits, as [`actuator`](crate::dynamics::actuator) has them
//! for one copy.

use pulp::Simd;

use super::joint::{Body, Drive, Law, State, has_setpoint};
use super::robot::LaneRobot;
use crate::dynamics::actuator::{NEARLY, SETTLED, advance_profile};
use crate::dynamics::articulation::{BOTH_WAYS_UNTIL, EXACT_ROUNDS, MAX_ROUNDS};
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::real::{MaskOf as _, Real as _};

/// Returns the requested effort, and in which of these lanes it is limited; `None` if in no lane.
#[inline(always)]
fn limited_law<S: Simd>(
    state: &State<S>,
    at: &Body<S>,
    h: Lanes<S>,
    going: Mask<S>,
) -> Option<(Lanes<S>, Mask<S>)> {
    let is_limited = state.drive.limit.lt(h.splat(f64::INFINITY)) & going;
    if !is_limited.any() {
        return None;
    }
    let velocities = [state.half_velocity, at.new_velocity];
    Some((state.drive.law(state.position, velocities, h, at.of_law), is_limited))
}

impl<S: Simd> LaneRobot<S> {
    /// Advances setpoints, and determines each actuator's law for the step.
    #[inline(always)]
    pub(super) fn set_drives(&mut self) {
        let h = self.occupied.splat(self.stepping.h);
        let first = self.first;
        let joints = self.states[first..].iter_mut().zip(&self.laws[first..]).zip(&self.modes[first..]);
        for ((state, law), mode) in joints {
            let follows_setpoint = mode.is_some_and(has_setpoint);
            let saturated = state.drive.saturated;
            let was = saturated.is_number();
            if follows_setpoint {
                advance_setpoint(state, law, h);
            }
            let Law { stiffness, damping, velocity, feed_forward, limit, .. } = *law;
            let zero = h.splat(0.0);
            let position = if follows_setpoint { state.setpoint } else { zero };
            let held = limit.copysign(saturated);
            let held = (was & held.is_finite()).select(held, zero.splat(f64::NAN));
            state.drive =
                Drive { stiffness, damping, position, velocity, feed_forward, limit, saturated: held };
        }
    }

    /// Finds the actuators whose solved effort exceeds their limit, and saturated ones that no longer need to
    /// be, in some lanes. Weakens them if this does not converge. Returns the lanes in which any changed. See
    /// [`Articulation::saturate`](crate::dynamics::Articulation).
    #[inline(always)]
    pub(super) fn saturate(&mut self, going: Mask<S>, round: usize, weakened: &mut Mask<S>) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let mut changed = zero.lt(zero);
        if round + 1 == MAX_ROUNDS {
            return changed;
        }
        let exact = going & !*weakened;
        if exact.any() {
            changed = self.saturate_exactly(exact, round == 0);
            if round + 1 >= EXACT_ROUNDS && changed.any() {
                *weakened = *weakened | changed;
                for at in &mut self.bodies[self.first..] {
                    at.part = changed.select(zero.splat(1.0), at.part);
                }
            }
        }
        let weakened = going & *weakened;
        if weakened.any() {
            changed = changed | self.weaken(weakened, round >= BOTH_WAYS_UNTIL);
        }
        changed
    }

    /// See [`Drive::saturate`](crate::dynamics::actuator::Drive::saturate).
    #[inline(always)]
    fn saturate_exactly(&mut self, going: Mask<S>, is_first: bool) -> Mask<S> {
        let h = self.occupied.splat(self.stepping.h);
        let zero = h.splat(0.0);
        let mut changed = zero.lt(zero);
        for (state, at) in self.states[self.first..].iter_mut().zip(&self.bodies[self.first..]) {
            let Some((law, is_limited)) = limited_law(state, at, h, going) else { continue };
            let drive = &mut state.drive;
            let was = drive.saturated.is_number();
            let begins = !was & drive.limit.lt(law.abs()) & is_limited;
            let asked = law * zero.splat(1.0).copysign(drive.saturated);
            let least = if is_first { drive.limit } else { drive.limit * zero.splat(NEARLY) };
            let ends = was & !(least.le(asked) | drive.limit.equals(zero)) & is_limited;
            drive.saturated = begins.select(drive.limit.copysign(law), drive.saturated);
            drive.saturated = ends.select(zero.splat(f64::NAN), drive.saturated);
            changed = changed | begins | ends;
        }
        changed
    }

    /// See [`Drive::weaken`](crate::dynamics::actuator::Drive::weaken).
    #[inline(always)]
    fn weaken(&mut self, going: Mask<S>, less: bool) -> Mask<S> {
        let h = self.occupied.splat(self.stepping.h);
        let (zero, one) = (h.splat(0.0), h.splat(1.0));
        let mut changed = zero.lt(zero);
        for (state, at) in self.states[self.first..].iter_mut().zip(&mut self.bodies[self.first..]) {
            let Some((law, is_limited)) = limited_law(state, at, h, going) else { continue };
            let drive = &mut state.drive;
            let is_off = drive.limit.equals(zero);
            drive.saturated = is_limited.select(is_off.select(zero, zero.splat(f64::NAN)), drive.saturated);
            let moves = is_limited & !is_off;
            let factor = drive.factor_to_limit(law, less, at.part);
            let moves = moves & !(factor - one).abs().le(zero.splat(SETTLED));
            drive.stiffness = moves.select(drive.stiffness * factor, drive.stiffness);
            drive.damping = moves.select(drive.damping * factor, drive.damping);
            drive.feed_forward = moves.select(drive.feed_forward * factor, drive.feed_forward);
            at.part = moves.select(at.part * factor, at.part);
            changed = changed | moves;
        }
        changed
    }

    /// Stores the efforts that the actuators apply at the new velocities.
    #[inline(always)]
    pub(super) fn note_efforts(&mut self, weakened: Mask<S>) {
        let h = self.occupied.splat(self.stepping.h);
        let any_weakened = weakened.any();
        let joints = self.states[self.first..].iter_mut().zip(&self.bodies[self.first..]);
        for ((state, at), mode) in joints.zip(&self.modes[self.first..]) {
            let velocities = [state.half_velocity, at.new_velocity];
            let asked = state.drive.law(state.position, velocities, h, at.of_law);
            let limit = state.drive.limit;
            if any_weakened {
                recover(&mut state.drive, asked, at.part, weakened);
            }
            let saturated = state.drive.saturated;
            state.effort = saturated.is_number().select(saturated, asked.clamp(-limit, limit));
            if saturated.is_number().any() && mode.is_some_and(has_setpoint) {
                let asked = state.drive.law(state.position, velocities, h, at.of_law);
                anti_windup(state, asked, at.new_velocity);
            }
        }
    }
}

/// See [`Drive::recover`](crate::dynamics::actuator::Drive::recover).
#[inline(always)]
fn recover<S: Simd>(drive: &mut Drive<S>, law: Lanes<S>, part: Lanes<S>, weakened: Mask<S>) {
    let is_less = part.lt(part.splat(1.0)) & weakened;
    for gain in [&mut drive.stiffness, &mut drive.damping, &mut drive.feed_forward] {
        *gain = is_less.select(*gain / part, *gain);
    }
    let is_saturated = (is_less | (drive.limit.lt(law.abs()) & weakened)) & !drive.saturated.is_number();
    drive.saturated = is_saturated.select(law, drive.saturated);
}

/// See [`Axis::advance_setpoint`](crate::dynamics::Axis::advance_setpoint).
#[inline(always)]
fn advance_setpoint<S: Simd>(state: &mut State<S>, law: &Law<S>, h: Lanes<S>) {
    let (setpoint, setpoint_velocity) = (state.setpoint, state.setpoint_velocity);
    let holds = setpoint.equals(law.target) & setpoint_velocity.equals(h.splat(0.0));
    if holds.all() {
        (state.setpoint, state.setpoint_velocity) = (law.target, h.splat(0.0));
        return;
    }
    (state.setpoint, state.setpoint_velocity) =
        advance_profile((setpoint, setpoint_velocity), law.target, (law.hardest, law.fastest), h);
}

/// See [`Axis::anti_windup`](crate::dynamics::Axis::anti_windup); acts on lanes whose actuators saturate.
#[inline(always)]
fn anti_windup<S: Simd>(state: &mut State<S>, law: Lanes<S>, qd: Lanes<S>) {
    let Drive { stiffness, limit, saturated, .. } = state.drive;
    let moves = saturated.is_number() & law.splat(0.0).lt(stiffness) & limit.lt(law.abs());
    let back = (limit.copysign(law) - law) / stiffness;
    state.setpoint = moves.select(state.setpoint + back, state.setpoint);
    state.setpoint_velocity = moves.select(qd, state.setpoint_velocity);
}
