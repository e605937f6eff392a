//! Limits and dry friction of joints, as [`constraint`](crate::dynamics::constraint) has them for one copy.
//! Projected Gauss-Seidel does as many sweeps in a lane as for its copy alone.

use pulp::Simd;

use super::joint::Row;
use super::robot::LaneRobot;
use crate::dynamics::constraint::{LIMIT_MARGIN, MAX_LIMIT_START, MAX_SWEEPS, SETTLED, limit_bias};
use crate::dynamics::integrator::ARRIVES;
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::real::{MaskOf as _, Real as _};

/// Indices among the rows of a joint.
pub(super) const FRICTION: usize = 0;
const LOWER: usize = 1;
pub(super) const UPPER: usize = 2;

/// Rows in the order of solving: dry friction of all joints, then both limits of each.
pub(super) const ORDER: [&[usize]; 2] = [&[FRICTION], &[LOWER, UPPER]];

impl<S: Simd> LaneRobot<S> {
    /// Collects the rows of the step. Returns whether there are any.
    #[inline(always)]
    pub(super) fn collect_rows(&mut self, taken: Mask<S>) -> bool {
        let zero = self.occupied.splat(0.0);
        let h = zero.splat(self.stepping.h);
        let infinity = zero.splat(f64::INFINITY);
        let mut any = zero.lt(zero);
        let first = self.first;
        let joints = self.states[first..].iter().zip(&self.laws[first..]).zip(&mut self.bodies[first..]);
        for ((state, law), at) in joints {
            let most = law.friction * h;
            at.most_friction = most;
            let has_friction = zero.lt(most) & taken;
            at.rows[FRICTION] = Row {
                is_there: has_friction.numbers(),
                bias: zero,
                impulse: state.friction.clamp(-most, most),
            };
            let reach = zero.splat(2.0) * h * at.new_velocity.abs() + zero.splat(LIMIT_MARGIN);
            for (side, distance, warm) in [
                (LOWER, state.position - law.lower, state.lower),
                (UPPER, law.upper - state.position, state.upper),
            ] {
                let is_near = distance.lt(reach) & taken;
                if !is_near.any() {
                    // Saves two divisions.
                    at.rows[side] = Row { is_there: zero, bias: zero, impulse: zero };
                    continue;
                }
                at.rows[side] = Row {
                    is_there: is_near.numbers(),
                    bias: limit_bias(distance, h),
                    impulse: warm.clamp(zero, infinity),
                };
                any = any | is_near;
            }
            any = any | has_friction;
        }
        any.any()
    }

    /// Changes the new velocities of some lanes until every row holds, or the maximum number of sweeps is
    /// reached.
    #[inline(always)]
    pub(super) fn solve_rows(&mut self, going: Mask<S>) {
        let zero = self.occupied.splat(0.0);
        let n = self.bodies.len();
        for joint in self.first..n {
            let [friction, lower, upper] = self.bodies[joint].rows;
            let is_there = friction.is_there + lower.is_there + upper.is_there;
            if (zero.lt(is_there) & going).any() {
                self.respond(joint);
            }
        }
        self.drop_useless_starts(going);
        for kinds in ORDER {
            for joint in self.first..n {
                for &kind in kinds {
                    self.start_row(joint, kind, going);
                }
            }
        }
        let mut sweeping = going;
        for _ in 0..MAX_SWEEPS {
            let mut largest = zero;
            for kinds in ORDER {
                for joint in self.first..n {
                    for &kind in kinds {
                        largest = self.sweep_row(joint, kind, sweeping, largest);
                    }
                }
            }
            sweeping = sweeping & zero.splat(SETTLED).lt(largest);
            if !sweeping.any() {
                break;
            }
        }
    }

    /// Clears initial impulses of limits that come from another round; see
    /// [`solve`](crate::dynamics::constraint::solve).
    #[inline(always)]
    fn drop_useless_starts(&mut self, going: Mask<S>) {
        let zero = self.occupied.splat(0.0);
        let mut asked = zero;
        for at in &self.bodies[self.first..] {
            for row in &at.rows {
                let own = at.new_velocity.abs() + row.bias.abs();
                asked = (zero.lt(row.is_there) & going).select(asked.max(own), asked);
            }
        }
        let most = zero.splat(MAX_LIMIT_START) * asked;
        let n = self.bodies.len();
        for joint in self.first..n {
            let effect = self.responses[joint * n + joint];
            for kind in [LOWER, UPPER] {
                let row = &mut self.bodies[joint].rows[kind];
                let is_useless = zero.lt(row.is_there) & going & most.lt(row.impulse * effect);
                row.impulse = is_useless.select(zero, row.impulse);
            }
        }
    }

    /// Applies the initial impulse of a row.
    #[inline(always)]
    fn start_row(&mut self, joint: usize, kind: usize, going: Mask<S>) {
        let zero = self.occupied.splat(0.0);
        let row = self.bodies[joint].rows[kind];
        let is_there = zero.lt(row.is_there) & going;
        if !is_there.any() {
            return;
        }
        let effect = self.responses[joint * self.bodies.len() + joint];
        let acts = zero.lt(effect);
        let impulse = (is_there & !acts).select(zero, row.impulse);
        self.bodies[joint].rows[kind].impulse = impulse;
        self.push(joint, kind, impulse, is_there & acts);
    }

    /// Applies the impulse that corrects a row's velocity. Returns the largest change of a row's own velocity
    /// so far.
    #[inline(always)]
    fn sweep_row(&mut self, joint: usize, kind: usize, sweeping: Mask<S>, largest: Lanes<S>) -> Lanes<S> {
        let zero = self.occupied.splat(0.0);
        let row = self.bodies[joint].rows[kind];
        let is_there = zero.lt(row.is_there) & sweeping;
        if !is_there.any() {
            return largest;
        }
        let effect = self.responses[joint * self.bodies.len() + joint];
        let own = self.bodies[joint].new_velocity;
        let velocity = (if kind == UPPER { -own } else { own }) + row.bias;
        let wanted = row.impulse - velocity / effect;
        let impulse = if kind == FRICTION {
            let most = self.bodies[joint].most_friction;
            wanted.clamp(-most, most)
        } else {
            wanted.clamp(zero, zero.splat(f64::INFINITY))
        };
        let change = impulse - row.impulse;
        let moves = is_there & zero.lt(effect) & !change.equals(zero);
        self.bodies[joint].rows[kind].impulse = moves.select(impulse, row.impulse);
        self.push(joint, kind, change, moves);
        moves.select(largest.max((change * effect).abs()), largest)
    }

    /// Applies a row's impulse to the new velocities of some lanes.
    #[inline(always)]
    fn push(&mut self, joint: usize, kind: usize, impulse: Lanes<S>, lanes: Mask<S>) {
        let n = self.bodies.len();
        let impulse = if kind == UPPER { -impulse } else { impulse };
        let responses = &self.responses[joint * n..(joint + 1) * n];
        if self.first > 0 {
            for (new, response) in self.root_new.iter_mut().zip(&self.root_responses[joint]) {
                *new = lanes.select(*new + impulse * *response, *new);
            }
        }
        for (at, response) in self.bodies.iter_mut().zip(responses) {
            at.new_velocity = lanes.select(at.new_velocity + impulse * *response, at.new_velocity);
        }
    }

    /// Stores the impulses of some lanes for the next step. Returns the lanes in which a limit or dry
    /// friction has begun or ceased to hold, friction has reversed, or a limit stops a joint.
    #[inline(always)]
    pub(super) fn store_impulses(&mut self, going: Mask<S>) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let mut discontinuous = zero.lt(zero);
        for (state, at) in self.states[self.first..].iter_mut().zip(&self.bodies[self.first..]) {
            let most = at.most_friction;
            let [friction, lower, upper] = at.rows;
            let has = zero.lt(friction.is_there) & going;
            discontinuous =
                discontinuous | (has & !way(friction.impulse, most).equals(way(state.friction, most)));
            state.friction = going.select(has.select(friction.impulse, zero), state.friction);
            let arrives = zero.splat(ARRIVES);
            let (down, up) = (arrives.lt(-state.half_velocity), arrives.lt(state.half_velocity));
            for (row, before, towards) in [(lower, &mut state.lower, down), (upper, &mut state.upper, up)] {
                let has = zero.lt(row.is_there) & going;
                let (holds, held) = (row.impulse.equals(zero).numbers(), before.equals(zero).numbers());
                discontinuous =
                    discontinuous | (has & (!holds.equals(held) | (!row.impulse.equals(zero) & towards)));
                *before = going.select(has.select(row.impulse, zero), *before);
            }
        }
        discontinuous
    }
}

/// Returns the direction in which dry friction slips, given its largest impulse: 0 if it holds.
#[inline(always)]
fn way<S: Simd>(impulse: Lanes<S>, most: Lanes<S>) -> Lanes<S> {
    let zero = impulse.splat(0.0);
    let sign = impulse.lt(zero).select(zero.splat(-1.0), zero.splat(1.0));
    impulse.abs().lt(most).select(zero, sign)
}
