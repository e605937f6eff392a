//! Step of all lanes.

use pulp::{Simd, WithSimd};

use super::robot::{LaneRobot, number};
use crate::dynamics::articulation::MAX_ROUNDS;
use crate::dynamics::articulation::balance::Errors;
use crate::dynamics::contact_point::LOOK_AHEAD;
use crate::dynamics::integrator::{History, Integrator};
use crate::dynamics::lane::number::Mask;
use crate::dynamics::real::{MaskOf as _, Real as _};

/// A step, to be compiled for the processor that it runs on.
struct Step<'a, S: Simd>(&'a mut LaneRobot<S>);

impl<S: Simd> WithSimd for Step<'_, S> {
    type Output = ();

    #[inline(always)]
    fn with_simd<T: Simd>(self, _: T) {
        self.0.do_step();
    }
}

impl<S: Simd> LaneRobot<S> {
    /// Advances all copies by a step in which they touch nothing, or only planes with their feet, or the
    /// given contacts. [`has_stepped`](Self::has_stepped) returns which have done it; the others are
    /// unchanged.
    pub fn step(&mut self) {
        if self.occupied.all().iter().any(|taken| *taken > 0.0) {
            let simd = self.simd;
            simd.vectorize(Step(self));
        }
    }

    #[inline(always)]
    fn do_step(&mut self) {
        self.begin();
        let zero = self.occupied.splat(0.0);
        let taken = zero.lt(self.occupied);
        let mut is_done = taken;
        for part in 0..self.stepping.parts {
            is_done = is_done & self.do_part(taken, part == 0);
        }
        if self.first > 0 {
            is_done = is_done & self.root.is_usable();
        }
        for state in &self.states[self.first..] {
            is_done = is_done
                & state.position.is_usable()
                & state.velocity.is_usable()
                & state.half_velocity.is_usable()
                & state.setpoint.is_usable();
        }
        self.is_done = is_done.numbers();
        // Also in lanes without a copy: their numbers grow without end, and arithmetic with infinite ones is
        // slow.
        if (!is_done).any() {
            self.put_back();
        }
    }

    /// Does one of the equal parts of a step. Returns the lanes whose result is valid: equal to the copy's
    /// own step.
    #[inline(always)]
    fn do_part(&mut self, taken: Mask<S>, begins: bool) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let is_leapfrog = self.stepping.integrator == Integrator::Leapfrog;
        let is_fast = self.update_kinematics();
        let mut is_done = self.meets_nothing();
        let mut touching = zero.lt(zero);
        if self.has_feet() {
            is_done = is_done & !self.find_feet(begins);
            touching = self.feet.solver.touching() & taken;
        }
        if !is_leapfrog {
            self.history = zero.splat(number(History::Given));
            self.states.iter_mut().for_each(|state| state.half_velocity = state.velocity);
            self.root.half_velocities = self.root.velocities;
        }
        self.set_drives();
        let (mut going, mut discontinuous, mut has_rows) = (taken, zero.lt(zero), false);
        let (mut weakened, mut disturbed) = (zero.lt(zero), zero.lt(zero));
        for round in 0..MAX_ROUNDS {
            self.gather_inertia();
            self.accelerate(going);
            if round == 0 {
                has_rows = self.collect_rows(taken);
                // A copy that touches with velocities that are not finite is solved alone.
                is_done = is_done & (!touching | self.new_velocities_are_finite());
            }
            let clear = going & !touching;
            if has_rows && clear.any() {
                self.solve_rows(clear);
            }
            let meets = going & touching;
            if meets.any() {
                self.solve_feet(meets, round == 0);
            }
            if is_leapfrog && self.first > 0 && clear.any() {
                disturbed = disturbed | (clear & self.is_disturbed());
            }
            // With touching feet, the rows include all rounds.
            discontinuous = discontinuous | self.store_impulses(clear);
            going = self.saturate(going, round, &mut weakened);
            discontinuous = discontinuous | going;
            if !going.any() {
                break;
            }
        }
        if touching.any() {
            discontinuous = discontinuous | self.store_impulses(touching);
            self.keep_contacts(touching, self.feet.solver.was_least);
        }
        let discontinuous = discontinuous | self.set_ways(touching);
        self.note_efforts(weakened);
        self.finish(discontinuous);
        if is_leapfrog { is_done & !is_fast & !disturbed } else { is_done }
    }

    /// Returns the lanes in which velocity terms at the extrapolated velocities would change momentum; see
    /// [`Articulation::solve_alone`].
    ///
    /// [`Articulation::solve_alone`]: crate::dynamics::Articulation::solve_alone
    #[inline(always)]
    fn is_disturbed(&self) -> Mask<S> {
        let mut errors = Errors::none(self.occupied.splat(0.0));
        for ((extrapolated, half), new) in
            self.root.velocities.iter().zip(&self.root.half_velocities).zip(&self.root_new)
        {
            errors.add(*extrapolated, *half, *new);
        }
        for (state, at) in self.states[self.first..].iter().zip(&self.bodies[self.first..]) {
            errors.add(state.velocity, state.half_velocity, at.new_velocity);
        }
        errors.disturb()
    }

    /// Returns the lanes in which the new velocities are finite.
    #[inline(always)]
    fn new_velocities_are_finite(&self) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let mut are_finite = zero.le(zero);
        if self.first > 0 {
            for velocity in &self.root_new {
                are_finite = are_finite & velocity.is_finite();
            }
        }
        for at in &self.bodies[self.first..] {
            are_finite = are_finite & at.new_velocity.is_finite();
        }
        are_finite
    }

    /// Returns the lanes in which no contact would be found: all obstacles are farther away than contacts are
    /// looked for.
    #[inline(always)]
    fn meets_nothing(&self) -> Mask<S> {
        let zero = self.occupied.splat(0.0);
        let mut speed = zero;
        for (state, lever) in self.states[self.first..].iter().zip(&self.levers[self.first..]) {
            speed += *lever * state.velocity.abs();
        }
        if self.first > 0 {
            speed += self.root.speed(self.levers[0]);
        }
        let ahead = zero.splat(self.slack) + zero.splat(LOOK_AHEAD * self.stepping.h) * speed;
        ahead.lt(self.clearance.around) & ahead.lt(self.clearance.own)
    }

    /// Integrates with the new velocities.
    #[inline(always)]
    fn finish(&mut self, discontinuous: Mask<S>) {
        let zero = self.occupied.splat(0.0);
        let h = zero.splat(self.stepping.h);
        let is_leapfrog = self.stepping.integrator == Integrator::Leapfrog;
        let was_given = zero.splat(number(History::Given));
        let was_interrupted = zero.splat(number(History::Interrupted));
        let was_kinked = zero.splat(number(History::Kinked));
        let smooth = zero.splat(number(History::Smooth));
        let twice = zero.splat(number(History::SmoothTwice));
        if is_leapfrog {
            let before = self.history;
            let begins = before.equals(was_kinked) | before.equals(was_given);
            let after = begins.select(smooth, twice);
            let after = before.equals(was_interrupted).select(was_kinked, after);
            self.history = discontinuous.select(was_kinked, after);
        }
        let (is_smooth, is_twice) = (self.history.equals(smooth), self.history.equals(twice));
        if self.first > 0 {
            self.finish_root(discontinuous, is_smooth, is_twice);
        }
        let first = self.first;
        let joints = self.states[first..].iter_mut().zip(&self.laws[first..]);
        let joints = joints.zip(&self.bodies[first..]).zip(&self.levers[first..]);
        for (((state, law), at), lever) in joints {
            let new = at.new_velocity;
            state.change_before = state.change;
            state.change = new - state.half_velocity;
            state.position += h * at.way;
            let moved = *lever * (h * at.way).abs();
            self.clearance.around -= moved;
            self.clearance.own -= moved;
            state.half_velocity = new;
            if !is_leapfrog {
                state.velocity = new;
                continue;
            }
            let predicted = at.implicitness.decay() * state.change_before;
            let drift = is_twice.select(state.change - predicted, zero);
            let ahead = at.implicitness.ahead(state.change, drift);
            let end = new + (is_smooth | is_twice).select(ahead, zero);
            let turns = (end * new).lt(zero) & zero.lt(law.friction);
            let end = turns.select(zero, end);
            state.velocity = discontinuous.select(new, end);
        }
    }
}
