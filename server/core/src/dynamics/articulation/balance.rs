//! Momentum of floating trees: after a disturbance, steps use velocity terms that conserve it.

use glamx::{DMat3, DVec3};

use super::{Articulation, BodyState, StepScratch};
use crate::dynamics::articulated::MidStep;
use crate::dynamics::integrate::advance;
use crate::dynamics::integrator::History;
use crate::dynamics::kinematics::update_kinematics;
use crate::dynamics::real::Real;
use crate::dynamics::scratch::BodyScratch;
use crate::dynamics::velocity_terms::is_fast;

/// Error of extrapolated velocities, as a part of the step's change, from which their terms change momentum.
/// The errors of old velocities are half of the change, and cancel from step to step; those of extrapolated
/// ones add up.
const DISTURBED: f64 = 0.02;

/// Sum of squares of velocity errors that counts as rounding.
const ROUNDING: f64 = 1e-12;

/// Maximum number of estimates of the new velocities.
const MAX_ESTIMATES: usize = 30;

/// Largest change of an estimate, as a part of the step's change, at which it counts as the solution.
const SETTLED: f64 = 1e-6;

/// Largest ratio of the changes of two estimates at which iteration converges soon.
const CONTRACTS: f64 = 0.7;

/// Squares of the errors of extrapolated velocities, and of the changes of velocities in a step, summed over
/// a tree.
#[derive(Clone, Copy, Debug)]
pub(in crate::dynamics) struct Errors<R: Real> {
    extrapolation: R,
    change: R,
}

impl<R: Real> Errors<R> {
    /// Returns sums of zero.
    #[inline(always)]
    pub(in crate::dynamics) fn none(zero: R) -> Self {
        Self { extrapolation: zero, change: zero }
    }

    /// Adds a velocity, which was extrapolated to the middle between an old and a new one.
    #[inline(always)]
    pub(in crate::dynamics) fn add(&mut self, extrapolated: R, old: R, new: R) {
        let off = extrapolated - old.splat(0.5) * (old + new);
        let change = new - old;
        self.extrapolation += off * off;
        self.change += change * change;
    }

    /// Returns whether velocity terms at the extrapolated velocities change momentum.
    #[inline(always)]
    pub(in crate::dynamics) fn disturb(self) -> R::Mask {
        let zero = self.change;
        (zero.splat(DISTURBED * DISTURBED) * self.change + zero.splat(ROUNDING)).lt(self.extrapolation)
    }
}

/// Velocities to evaluate.
#[derive(Clone, Copy)]
enum Velocities {
    /// Velocities in the middle of the previous step, or at the start of this one if they were set.
    Old,
    /// Velocities in the middle of this step.
    New,
}

impl Articulation {
    /// Returns whether the velocity terms of this step need [`solve_balanced`](Self::solve_balanced). A
    /// floating tree needs it if its velocities changed differently than in the steps before, so that the
    /// extrapolation failed.
    pub(super) fn is_disturbed(&self, h: f64) -> bool {
        let StepScratch { new_velocities, passes, .. } = &self.scratch;
        // A step from set velocities takes half of its kick; see `balance_half_kick`.
        if self.state.history == History::Given {
            return false;
        }
        let mut errors = Errors::none(0.0);
        let old = self.state.velocities.iter().zip(&self.state.half_velocities);
        for ((extrapolated, half), new) in old.zip(new_velocities) {
            errors.add(*extrapolated, *half, *new);
        }
        // Terms at the mean velocity conserve the energy of fast spins.
        let was_smooth = matches!(self.state.history, History::Smooth | History::SmoothTwice);
        errors.disturb() && !(was_smooth && is_fast(passes, h))
    }

    /// Solves the rows of a floating tree. The velocity terms conserve its momentum; their third-order loss
    /// of linear momentum is restored.
    pub(super) fn solve_floating(&mut self, gravity: DVec3, h: f64) {
        self.scratch.velocity_terms.keep(&self.scratch.new_velocities);
        self.solve_rows();
        let is_disturbed = self.is_disturbed(h);
        if is_disturbed {
            self.solve_balanced(h);
        }
        if self.state.history != History::Given && (is_disturbed || is_fast(&self.scratch.passes, h)) {
            self.keep_momentum(gravity, (-0.5 * h, h, h));
        }
    }

    /// Moves the whole tree so that its linear momentum after half of a step is conserved. It equals the
    /// momentum at the time `since`, from now, plus the impulses of gravity and wrenches over `kick` seconds
    /// of a step of `h`.
    fn keep_momentum(&mut self, gravity: DVec3, (since, kick, h): (f64, f64, f64)) {
        let (before, mass) = self.momentum_after(Velocities::Old, since);
        let (after, _) = self.momentum_after(Velocities::New, 0.5 * h);
        let StepScratch { new_velocities, passes, meets_jump, .. } = &mut self.scratch;
        let BodyState { base, external, external_before, .. } = &self.state;
        let mut force = base.rotation.inverse() * gravity * mass;
        for ((at, now), before) in passes.bodies.iter().zip(external).zip(external_before) {
            let push = if *meets_jump { (now.linear + before.linear) * 0.5 } else { now.linear };
            force += at.rotation * push;
        }
        // A root's linear velocity is in the axes of its parent.
        let root = self.tree.bodies.first().map_or(DMat3::IDENTITY, |root| root.at_zero.rotation);
        let lost = root.transpose() * ((before + force * kick - after) / mass);
        if lost.is_finite() {
            new_velocities.iter_mut().zip(lost.to_array()).for_each(|(velocity, lost)| *velocity += lost);
        }
    }

    /// Returns the linear momentum after some time with the old or the new velocities, base axes, kg m/s, and
    /// the mass.
    fn momentum_after(&mut self, which: Velocities, time: f64) -> (DVec3, f64) {
        let Self { tree, state, scratch } = self;
        let StepScratch { new_velocities, bodies_ahead, ahead, .. } = scratch;
        let velocities = match which {
            Velocities::Old => &state.half_velocities,
            Velocities::New => new_velocities,
        };
        ahead.clear();
        ahead.extend_from_slice(&state.positions);
        advance(tree, ahead, velocities, time);
        bodies_ahead.resize(tree.bodies.len(), BodyScratch::default());
        update_kinematics(tree, ahead, velocities, bodies_ahead);
        let (mut momentum, mut mass) = (DVec3::ZERO, 0.0);
        for (body, at) in tree.bodies.iter().zip(&*bodies_ahead) {
            momentum += body.inertia.turned(&at.rotation).times(at.velocity).linear;
            mass += body.inertia.mass;
        }
        (momentum, mass)
    }

    /// Makes the new velocities satisfy the rows, with the mean of the velocity terms at the old and the new
    /// velocities. If no such velocities are found, it uses the terms at the old ones, as Euler does.
    pub(super) fn solve_balanced(&mut self, h: f64) {
        let StepScratch { passes, velocity_terms, .. } = &mut self.scratch;
        let state = &self.state;
        let moved = MidStep { q: &state.positions, qd: &state.velocities, half: &state.half_velocities };
        let are_solved = is_fast(passes, h);
        velocity_terms.begin_balance(&self.tree, moved, passes, are_solved);
        let mut before = f64::INFINITY;
        for _ in 0..MAX_ESTIMATES {
            self.scratch.response.copy_from_slice(&self.scratch.new_velocities);
            self.solve_with_terms(h);
            let StepScratch { new_velocities, response: estimate, .. } = &self.scratch;
            let (off, change) = differences(new_velocities, estimate, &self.state.half_velocities);
            if off <= SETTLED * change + f64::sqrt(ROUNDING) {
                return;
            }
            if off > CONTRACTS * before {
                break;
            }
            before = off;
        }
        self.scratch.new_velocities.copy_from_slice(&self.state.half_velocities);
        self.solve_with_terms(h);
    }

    /// Converts the new velocities after half of a kick from set velocities to those with the velocity terms
    /// at its end: `M (u+ - v) = h/2 (f - b(q, u+))`.
    pub(super) fn balance_half_kick(&mut self, gravity: DVec3, h: f64) {
        if self.is_floating() {
            self.solve_half_kick(h);
            self.keep_momentum(gravity, (0.0, 0.5 * h, h));
        }
    }

    fn solve_half_kick(&mut self, h: f64) {
        let StepScratch { new_velocities, passes, velocity_terms, response: estimate, .. } =
            &mut self.scratch;
        let BodyState { positions, half_velocities: given, .. } = &self.state;
        velocity_terms.begin_half_kick(&self.tree, positions, given, passes, new_velocities);
        let mut before = f64::INFINITY;
        for _ in 0..MAX_ESTIMATES {
            estimate.copy_from_slice(new_velocities);
            velocity_terms.balance(&self.tree, positions, h, passes, new_velocities);
            let (off, change) = differences(new_velocities, estimate, given);
            if off <= SETTLED * change + f64::sqrt(ROUNDING) {
                return;
            }
            if off > CONTRACTS * before {
                break;
            }
            before = off;
        }
        new_velocities.copy_from_slice(given);
        velocity_terms.balance(&self.tree, positions, h, passes, new_velocities);
    }

    /// Returns whether its root moves freely and other bodies move with it.
    pub(super) fn is_floating(&self) -> bool {
        self.has_free_root() && self.scratch.free_body.is_none() && self.tree.bodies.len() > 1
    }

    /// Replaces the new velocities by those with velocity terms at the present ones, and makes them satisfy
    /// the rows.
    fn solve_with_terms(&mut self, h: f64) {
        let StepScratch { new_velocities, passes, velocity_terms, .. } = &mut self.scratch;
        velocity_terms.balance(&self.tree, &self.state.positions, h, passes, new_velocities);
        self.collect_rows(h);
        self.solve_rows();
    }
}

/// Returns the norms of the differences of velocities from their estimate, and from the old ones.
fn differences(new: &[f64], estimate: &[f64], old: &[f64]) -> (f64, f64) {
    let (mut off, mut change) = (0.0, 0.0);
    for ((new, estimate), old) in new.iter().zip(estimate).zip(old) {
        off += (new - estimate).powi(2);
        change += (new - old).powi(2);
    }
    (f64::sqrt(off), f64::sqrt(change))
}
